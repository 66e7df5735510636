"""Write the program's output into the documentation: run by ``make docs``. Tests compare the pages with the program."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def _output_of(*arguments: str) -> str:
    """Return what a command prints, without spaces at the ends of lines."""
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout  # noqa: S603 - our own command
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"


def _put(page: Path, opening: str, closing: str, text: str) -> None:
    """Replace the text of a page between two marks."""
    pattern = f"({re.escape(opening)}\n).*?({re.escape(closing)})"
    old = page.read_text(encoding="utf-8")
    page.write_text(re.sub(pattern, lambda m: m[1] + text + m[2], old, flags=re.DOTALL), encoding="utf-8")


limited = ("solve", "hexapod-machining", "--all")
# The last digits of the design differ between machines; those of the limits do not.
lines = _output_of(*limited).splitlines(keepends=True)
first, last = (next(i for i, line in enumerate(lines) if line.startswith(word)) for word in ("limit ", "tolerance"))
_put(
    ROOT / "docs" / "limits.md",
    f"<!-- begin: screwsynth {' '.join(limited)} -->",
    "<!-- end -->",
    f"```text\n{''.join(lines[first - 1 : last + 1])}```\n",
)
check = ("check", "--markdown")
_put(
    ROOT / "docs" / "reproduction.md",
    f"<!-- begin: screwsynth {' '.join(check)} -->",
    "<!-- end -->",
    _output_of(*check),
)
_put(
    ROOT / "docs" / "robots.md",
    "<!-- begin: screwsynth models delta --all -->",
    "<!-- end -->",
    f"```text\n{_output_of('models', 'delta', '--all')}```\n",
)
page = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
(shown,) = (each for each in re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL) if "[[task]]" in each)
with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "delta.toml").write_text(shown, encoding="utf-8")
    lines = _output_of("solve", str(Path(folder) / "delta.toml"), "--all").splitlines(keepends=True)
words = ("largest F", "        value", "rb ", "arm ", "p_z ", "actuator rates", "degrees of freedom", "rank of J")
kept = "".join(line for line in lines if line.startswith(words))
_put(ROOT / "docs" / "robots.md", "<!-- begin: solve -->", "<!-- end -->", f"```text\n{kept}```\n")
part = ("path", "hexapod-pocket")
_put(
    ROOT / "docs" / "paths.md",
    f"<!-- begin: screwsynth {' '.join(part)} -->",
    "<!-- end -->",
    f"```text\n{_output_of(*part)}```\n",
)

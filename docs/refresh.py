"""Write the program's output into the documentation: run by ``make docs``. Tests compare the pages with the program."""

import re
import subprocess
import sys
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


solve = ("solve", "paper-4.1-helical")
_put(ROOT / "README.md", f"```text\n$ screwsynth {' '.join(solve)}", "```", _output_of(*solve))
limited = ("solve", "hexapod-machining")
# The last digits of the design differ between machines; those of the limits do not.
lines = _output_of(*limited).splitlines(keepends=True)
first, last = (next(i for i, line in enumerate(lines) if line.startswith(word)) for word in ("limit ", "tolerance"))
_put(
    ROOT / "docs" / "limits.md",
    f"<!-- begin: screwsynth {' '.join(limited)} -->",
    "<!-- end -->",
    f"```text\n{''.join(lines[first : last + 1])}```\n",
)
check = ("check", "--markdown")
_put(
    ROOT / "docs" / "reproduction.md",
    f"<!-- begin: screwsynth {' '.join(check)} -->",
    "<!-- end -->",
    _output_of(*check),
)

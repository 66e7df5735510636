"""Write the parts of the documentation that the program prints: run by ``make docs``, held true by the tests."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def _printed(*arguments: str) -> str:
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout  # noqa: S603 - our own command
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"


def _put(page: Path, opening: str, closing: str, text: str) -> None:
    pattern = f"({re.escape(opening)}\n).*?({re.escape(closing)})"
    old = page.read_text(encoding="utf-8")
    page.write_text(re.sub(pattern, lambda m: m[1] + text + m[2], old, flags=re.DOTALL), encoding="utf-8")


solve = ("solve", "paper-4.1-helical")
_put(ROOT / "README.md", f"```text\n$ screwsynth {' '.join(solve)}", "```", _printed(*solve))
limited = ("solve", "hexapod-machining")
# The design varies in its last digits from machine to machine, its limits do not.
lines = _printed(*limited).splitlines(keepends=True)
first, last = (next(i for i, line in enumerate(lines) if line.startswith(word)) for word in ("limit ", "tolerance"))
_put(
    ROOT / "docs" / "limits.md",
    f"<!-- begin: screwsynth {' '.join(limited)} -->",
    "<!-- end -->",
    f"```text\n{''.join(lines[first : last + 1])}```\n",
)
check = ("check", "--markdown")
_put(
    ROOT / "docs" / "reproduction.md", f"<!-- begin: screwsynth {' '.join(check)} -->", "<!-- end -->", _printed(*check)
)

"""Run the commands of the worked introductions and write what they print into the pages: run by ``make docs``.

A page has three kinds of blocks. ``<!-- file: NAME -->`` stands before a block that is a file. ``<!-- run: A | B -->``
stands before a block that begins with ``$`` and a command; below it are the lines of the output that begin with A or B, in
their order, and every line without these words. ``<!-- run slowly: ... -->`` is the same, for what tests leave out.
"""

import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parent
PAGES = ("intro-machine-tool", "intro-delta", "intro-motion-base", "intro-wrist")
_PYTHON = [sys.executable, "-P"]
#: Programs of the commands, and what runs them.
_PROGRAMS = {"screwsynth": [*_PYTHON, "-m", "screwsynth.nlp"], "python": _PYTHON, "make": ["make", "--silent"]}
_BLOCK = re.compile(
    r"<!-- (?P<kind>file|run|run slowly): (?P<words>.*?) ?-->\n```\w+\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE
)


def output_of(command: str, folder: Path) -> list[str]:
    """Return the lines that a command of a page prints in a folder, without spaces at their ends.

    Raises:
        CalledProcessError: the command fails.
    """
    program, *arguments = shlex.split(command)
    done = subprocess.run(  # noqa: S603 - commands of our own pages
        [*_PROGRAMS[program], *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    return [line.rstrip() for line in done.stdout.splitlines()]


def chosen(lines: list[str], words: str) -> list[str]:
    """Return the lines that begin with one of several words; all without words.

    Raises:
        ValueError: no line begins with one of them.
    """
    beginnings = tuple(each.strip() for each in words.split("|") if each.strip())
    if not beginnings:
        return lines
    for each in beginnings:
        if not any(line.startswith(each) for line in lines):
            message = f"no line begins with {each!r}"
            raise ValueError(message)
    return [line for line in lines if line.startswith(beginnings)]


def runs(page: str, folder: Path, *, slowly: bool) -> Iterator[tuple[str, str, str]]:
    """Write the files of a page, run its commands in order, and yield each with the block as it is and as it should be.

    Args:
        page: text of the page.
        folder: where the commands run.
        slowly: whether those that tests leave out run too.
    """
    for block in _BLOCK.finditer(page):
        if block["kind"] == "file":
            (folder / block["words"]).write_text(block["text"], encoding="utf-8")
        elif slowly or block["kind"] == "run":
            command, _, _ = block["text"].partition("\n")
            lines = chosen(output_of(command.removeprefix("$ "), folder), block["words"])
            yield command, block["text"], "\n".join([command, *lines]) + "\n"


def main() -> None:
    """Write the output of all commands into the pages, or into those that the command names."""
    for name in sys.argv[1:] or PAGES:
        path = FOLDER / f"{name}.md"
        text = path.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            for _, old, new in runs(text, Path(folder), slowly=True):
                text = text.replace(f"```text\n{old}```", f"```text\n{new}```")
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

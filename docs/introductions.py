"""Run the commands of tutorials, how-to pages and README.md, and write their output into them: ``make docs``.

A page has three kinds of blocks. ``<!-- file: NAME -->`` stands before a block that is a file. ``<!-- run: WORDS -->``
stands before a block that begins with ``$`` and a command. Below are the lines of its output that WORDS choose, see
:func:`chosen`. A command that ends with ``> FILE`` writes its output to a file. ``<!-- run slowly: WORDS -->`` is the
same, for commands that tests leave out.
"""

import itertools
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parent
INTRODUCTIONS = ("intro-machine-tool", "intro-delta", "intro-motion-base", "intro-wrist")
PAGES = (
    *INTRODUCTIONS,
    "start",
    "certificate",
    "loads",
    "workspace",
    "printing",
    "servo-angles",
    "linuxcnc",
    "ankle",
    "../README",
)
_PYTHON = [sys.executable, "-P"]
#: Programs of the commands, and what runs them.
_PROGRAMS = {"screwsynth": [*_PYTHON, "-m", "screwsynth.nlp"], "python": _PYTHON, "make": ["make", "--silent"]}
#: A further line of one that is broken.
_GOES_ON = re.compile(r"  \S")
_BLOCK = re.compile(
    r"<!-- (?P<kind>file|run|run slowly): (?P<words>.*?) ?-->\n```\w+\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE
)


def output_of(command: str, folder: Path) -> list[str]:
    """Return the lines that a command of a page prints in a folder, without spaces at their ends.

    Raises:
        CalledProcessError: the command fails.
    """
    command, _, target = command.partition(" > ")
    program, *arguments = shlex.split(command)
    done = subprocess.run(  # noqa: S603 - commands of our own pages
        [*_PROGRAMS[program], *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    if target:
        (folder / target).write_text(done.stdout, encoding="utf-8")
    return [line.rstrip() for line in ("" if target else done.stdout).splitlines()]


def chosen(lines: list[str], words: str) -> list[str]:
    """Return the lines of an output that words choose, in the order of the words; spaces in lines count once.

    Args:
        lines: lines of the output.
        words: nothing for all lines, ``none``, or parts with ``|`` between them: ``A`` for all lines that begin with A,
            ``A!`` for the first of them, ``A .. B`` for the first of them and all before one that begins with B. The
            further lines of one that is broken, with two spaces before them, belong to it.

    Raises:
        ValueError: no line begins with one of the parts.
    """
    if words in {"", "none"}:
        return [] if words else lines
    kept: list[str] = []
    squeezed = ["" if _GOES_ON.match(line) else " ".join(line.split()) for line in lines]
    for part in words.split("|"):
        begin, *end = (each.strip() for each in part.split(".."))
        found = [k for k, line in enumerate(squeezed) if line.startswith(begin.removesuffix("!"))]
        if not found:
            message = f"no line begins with {begin!r}"
            raise ValueError(message)
        if end:
            ends = (k for k in range(found[0] + 1, len(lines)) if squeezed[k].startswith(end[0]))
            found = list(range(found[0], next(ends, len(lines))))
        for k in found[:1] if begin.endswith("!") else found:
            broken = () if end else itertools.takewhile(_GOES_ON.match, lines[k + 1 :])
            kept += [lines[k], *broken]
    return kept


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

"""English of the project: texts that ``make check`` refuses, with what to write instead.

    python bench/english.py [FILES ...]

Descriptions of arguments and attributes stand alone in tooltips, so they are noun phrases. Sentences of documents have
at most 35 words. Words that readers had to decode are listed in ``english.toml`` with their replacements, and with
the texts that are exceptions and why.
"""

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LONGEST = 35
#: First words with which a description of an argument or attribute cannot stand alone.
RIDDLES = frozenset({"of", "as", "that", "whose", "what", "who", "which"})
SECTIONS = re.compile(r"^ *(Args|Arguments|Attributes|Parameters):$")
ENTRY = re.compile(r"^( *)\*{0,2}([A-Za-z_][\w./, *]*?)(?: \([^)]*\))?: +(\S.*)$")


class Text(NamedTuple):
    """A text of a file with the line on which it begins; ``place`` is docs or program."""

    line: int
    place: str
    text: str


class Rules(NamedTuple):
    """Words with their replacements, and exceptions, of ``english.toml``."""

    words: list[tuple[re.Pattern[str], str, str]]
    exceptions: list[tuple[str, str]]

    def allow(self, file: str, text: str) -> bool:
        return any(file == name and part in text for name, part in self.exceptions)


def rules(path: Path) -> Rules:
    """Rules of a file.

    Raises:
        SystemExit: an exception has no reason.
    """
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    words = [
        (re.compile(each["pattern"].replace(" ", r"\s+"), re.IGNORECASE), each["instead"], each.get("where", "all"))
        for each in data["words"]
    ]
    exceptions = data.get("exceptions", [])
    for each in exceptions:
        if not each.get("reason"):
            sys.exit(f"{path}: exceptions: reason: missing for {each.get('text')!r}")
    return Rules(words, [(each["file"], " ".join(each["text"].split())) for each in exceptions])


def program_texts(source: str) -> Iterator[Text]:
    """Docstrings, other strings and comments of a module, but not keys; a string in pieces is one text."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield Text(node.lineno, "program", node.value)
        elif isinstance(node, ast.JoinedStr):
            parts = [each.value if isinstance(each, ast.Constant) else "{}" for each in node.values]
            yield Text(node.lineno, "program", "".join(map(str, parts)))
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text(token.start[0], "program", token.string.lstrip("#: "))


def descriptions(source: str) -> Iterator[tuple[int, str, str]]:
    """Line, name and description of each argument and attribute that a docstring of a module lists."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)):
            docstring = ast.get_docstring(node, clean=False)
            if docstring:
                yield from _entries(docstring, node.body[0].lineno)


def _entries(docstring: str, first: int) -> Iterator[tuple[int, str, str]]:
    depth: int | None = None
    entries: int | None = None
    for number, line in enumerate(docstring.splitlines(), first):
        indent = len(line) - len(line.lstrip())
        if SECTIONS.match(line):
            depth, entries = indent, None
        elif depth is not None and line.strip():
            if indent <= depth:
                depth = None
                continue
            entries = indent if entries is None else entries
            if indent == entries and (entry := ENTRY.match(line)):
                yield number, entry[2], entry[3]


def paragraphs(markdown: str) -> Iterator[Text]:
    """Paragraphs, items of lists, headings and rows of tables of a document, without code and formulas in lines."""
    fence, start, block = "", 1, list[str]()
    for number, line in enumerate([*markdown.splitlines(), ""], 1):
        opened = re.match(r" *(```+|~~~+|\$\$)", line)
        inside = bool(fence or opened)
        if fence:
            fence = "" if line.strip().endswith(fence) else fence
        elif opened:
            closed = line.strip() != opened[1] and line.strip().endswith(opened[1])
            fence = "" if closed else opened[1]
        apart = inside or not line.strip() or re.match(r" *([-*]|\d+\.) +| *(\||#|<|:|=+$|-+$)", line)
        if apart and block:
            yield Text(start, "docs", re.sub(r"`[^`]*`", "`code`", " ".join(block)))
            block = []
        if not inside and line.strip():
            start = start if block else number
            block.append(line.strip())


def sentences(markdown: str) -> Iterator[Text]:
    """Sentences of a document, without headings and tables."""
    for paragraph in paragraphs(markdown):
        if not re.match(r"\||#|<|:|=+$|-+$", paragraph.text):
            yield from _split(paragraph.line, paragraph.text)


def _split(line: int, text: str) -> Iterator[Text]:
    plain = re.sub(r"\$[^$]*\$", "formula", re.sub(r"\]\([^)]*\)", "]", text))
    for sentence in re.split(r"(?<=[.!?])[\")*\]]*\s+(?=\S)", plain):
        yield Text(line, "docs", sentence)


def faults(path: Path, rules: Rules) -> Iterator[str]:
    """Lines for each fault of a file: place, what was read, what to write instead."""
    name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.as_posix()
    source = path.read_text(encoding="utf-8")
    texts: Iterable[Text]
    if path.suffix == ".md":
        texts = paragraphs(source)
        for each in sentences(source):
            count = len(re.findall(r"[A-Za-z0-9][\w'./+-]*", each.text))
            if count > LONGEST and not rules.allow(name, each.text):
                yield f"{name}:{each.line}: a sentence of {count} words, at most {LONGEST}: {each.text[:90]}..."
    else:
        texts = program_texts(source)
        for line, argument, description in descriptions(source):
            first = description.split()[0].strip("*`").lower()
            if first in RIDDLES and not rules.allow(name, description):
                yield f"{name}:{line}: {argument}: begins with {first!r}; a noun phrase: {description[:70]}"
    for text in texts:
        for pattern, instead, where in rules.words:
            found = where in ("all", text.place) and pattern.search(text.text)
            if found and not rules.allow(name, " ".join(text.text.split())):
                read = " ".join(found[0].split())
                yield f"{name}:{text.line}: {read!r}: write {instead!r}"


def files() -> list[Path]:
    """Files that the rules hold for."""
    python = [each for room in ("nlp", "models", "cases") for each in sorted((ROOT / room).rglob("*.py"))]
    return [*python, ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def main(names: list[str]) -> int:
    known = rules(Path(__file__).with_suffix(".toml"))
    lines = [line for path in (map(Path, names) if names else files()) for line in faults(path.absolute(), known)]
    print("\n".join(lines) or "English: nothing found")
    return min(len(lines), 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

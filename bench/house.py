"""Sizes of the rooms of the house, printed by ``make check``; a room is a package folder of ``nlp`` or ``models``.

Lines of code are all but blank lines, comments and docstrings. Files in C belong to the nearest package above them.
Importers are modules of ``nlp`` and ``models``, also inside functions and for types alone, and the public stub.
Modules that are only loaded by name have none. With ``--names`` all names are listed.
"""

import ast
import gc
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from newton_loops import newton_loops

DATA, NEWTON, SINGLE = "classes ...Data", "loops of Newton's method", "modules with one importer"


class Module(NamedTuple):
    name: str
    room: str
    code: int
    statements: list[ast.AST]  # none of a file in C
    is_package: bool
    uses_linalg: bool


def statements(node: ast.AST) -> Iterator[ast.AST]:
    yield node
    for field in ("body", "orelse", "handlers", "finalbody", "cases"):
        for each in getattr(node, field, []):
            yield from statements(each)


def read(path: Path, root: Path) -> Module:
    text, place = path.read_text(encoding="utf-8"), path.relative_to(root)
    room = next(each for each in path.parents if (each / "__init__.py").exists()).relative_to(root).as_posix()
    is_c, name = path.suffix in (".c", ".h"), ".".join(place.with_suffix("").parts).removesuffix(".__init__")
    lines = (re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL) if is_c else text).splitlines()
    code = {k for k, line in enumerate(lines, 1) if line.strip() and (is_c or not line.lstrip().startswith("#"))}
    found = [] if is_c else list(statements(ast.parse(text)))
    for each in found:
        if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant):
            code.difference_update(range(each.lineno, each.end_lineno + 1))
    count = 0 if path.suffix == ".pyi" else len(code)
    return Module(name, room, count, found, path.stem == "__init__", "linalg" in text)


def imports(module: Module, known: set[str]) -> Iterator[tuple[str, str, str]]:
    """Yield of each import of the project: the name here, the module, the name there."""
    parts = module.name.split(".")
    for each in module.statements:
        if isinstance(each, ast.ImportFrom):
            above = parts[: len(parts) - each.level + module.is_package] if each.level else []
            start = ".".join([*above, *filter(None, [each.module])]).removeprefix("screwsynth.")
            for alias in each.names:
                inner = f"{start}.{alias.name}"
                yield alias.asname or alias.name, inner if inner in known else start, alias.name


def findings(modules: list[Module]) -> dict[str, list[tuple[str, str]]]:
    """Return by title what is counted, as rooms and names."""
    known, rooms = {m.name for m in modules}, {m.name: m.room for m in modules}
    importers, names = defaultdict(set), defaultdict(dict)
    for m in modules:
        for here, where, there in imports(m, known):
            importers[where].add(m.name)
            names[m.name][here] = where, there
    functions = [(m.name, each) for m in modules for each in m.statements if isinstance(each, ast.FunctionDef)]
    for name, function in functions:
        names[name][function.name] = name, function.name
    loops = newton_loops(functions, names, {m.name for m in modules if m.uses_linalg})
    classes = [(m, each.name) for m in modules for each in m.statements if isinstance(each, ast.ClassDef)]
    return {
        DATA: [(m.room, f"{m.name}.{name}") for m, name in classes if name.endswith("Data")],
        NEWTON: [(rooms[name], f"{name}.{function}, line {line}") for name, function, line in loops],
        SINGLE: [(m.room, m.name) for m in modules if not m.is_package and len(importers[m.name] - {m.name}) == 1],
    }


def house(root: Path, *, with_names: bool = False) -> Iterator[str]:
    """Yield the lines that are printed about a project."""
    paths = sorted(each for top in ("models", "nlp") for each in (root / top).rglob("*.*"))
    modules = [read(each, root) for each in paths if each.suffix in (".py", ".pyi", ".c", ".h")]
    code, found, row = defaultdict(int), findings(modules), "{:<32}{:>8}{:>8}{:>8}{:>14}".format
    for m in modules:
        code[m.room] += m.code
    yield row("room", "code", "...Data", "Newton", "one importer")
    for room in sorted(code):
        yield row(room, code[room], *(sum(each == room for each, _ in some) or "" for some in found.values()))
    yield row("all", sum(code.values()), *(len(some) for some in found.values()))
    for title in found if with_names else [NEWTON]:
        yield "\n  ".join([f"{title}:", *(name for _, name in found[title])])


if __name__ == "__main__":
    gc.disable()  # The trees stay: looking for garbage among them takes longer than all else.
    print(*house(Path(__file__).parents[1], with_names="--names" in sys.argv), sep="\n")

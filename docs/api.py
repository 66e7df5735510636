"""Write docs/api.md from the docstrings of all public objects: run by ``make docs``. A test holds the page to them."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import griffe

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "api.md"

_HEAD = """# Python API

Every public name of `screwsynth.nlp` and `screwsynth.models`, from the docstrings (`make docs` writes this page).
Lengths are in the unit of the case and angles in radians. `screwsynth.nlp.__version__` is the version of the package;
`screwsynth` itself is a namespace package without a file, so that there is no `screwsynth.__version__`.

A first tour is [the notebook](tour.ipynb).
"""
#: Sections of a docstring that become lists, with their headings.
_LISTS = {"parameters": "Arguments", "attributes": "Attributes", "raises": "Raises"}

_MARKS = {griffe.ParameterKind.var_positional: "*", griffe.ParameterKind.var_keyword: "**"}


def public_names() -> dict[str, dict[str, str]]:
    """Return the module of every public name, for each of the two packages."""
    packages = {"nlp": "nlp/__init__.pyi", "models": "models/__init__.py"}
    found: dict[str, dict[str, str]] = {}
    for package, file in packages.items():
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 1]
        names = {alias.asname or alias.name: str(node.module) for node in imports for alias in node.names}
        found[package] = dict(sorted(names.items()))
    return found


def page() -> str:
    """Return the whole page."""
    lines, seen = [_HEAD], dict[str, int]()
    for package, names in public_names().items():
        modules = {module: _module(package, module) for module in dict.fromkeys(names.values())}
        lines.append(f"## screwsynth.{package}\n")
        links = []
        for name in names:
            # GitHub numbers headings that differ in the case of their letters only.
            count = seen[name.lower()] = seen.get(name.lower(), -1) + 1
            links.append(f"[`{name}`](#{name.lower()}{f'-{count}' if count else ''})")
        lines.append(", ".join(links) + "\n")
        for name, module in names.items():
            lines += _object(modules[module].members[name], f"screwsynth.{package}.{module}")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).rstrip() + "\n"


def _module(package: str, module: str) -> griffe.Module:
    """Return a module, read without being imported."""
    file = ROOT / package / f"{module.replace('.', '/')}.py"
    source = file.read_text(encoding="utf-8")
    return griffe.visit(f"screwsynth.{package}.{module}", filepath=file, code=source, docstring_parser="google")


def _object(item: griffe.Object | griffe.Alias, module: str) -> Iterator[str]:
    """Yield the section of a public object."""
    yield f"### {item.name}\n"
    if isinstance(item, griffe.Function):
        yield f"```python\n{_signature(item)}\n```\n"
    elif isinstance(item, griffe.Attribute):
        yield f"```python\n{item.name} = {item.value}\n```\n"
    elif isinstance(item, griffe.Class):
        yield f"```python\n{_construction(item)}\n```\n"
    yield f"In `{module}`.\n"
    yield from _docstring(item)
    if isinstance(item, griffe.Class):
        yield from _members(item)
        for base in _hidden_bases(item):
            yield from _docstring(base, only="attributes")
            yield from _members(base)


def _construction(item: griffe.Class) -> str:
    """Return a class as it is constructed; with its bases where it is no value with fields."""
    if isinstance(own := item.members.get("__init__"), griffe.Function):
        return _signature(own).replace("__init__", item.name, 1).removesuffix(" -> None")
    decorators = [str(each.value) for each in item.decorators]
    is_tuple = any(str(base).startswith("NamedTuple") for base in item.bases)
    if not is_tuple and not any(each.startswith("dataclass") for each in decorators):
        bases = ", ".join(str(base) for base in item.bases)
        return f"class {item.name}{f'({bases})' if bases else ''}"
    free: list[str] = []
    named: list[str] = []
    for kind in [*reversed(list(_hidden_bases(item))), item]:
        fields = free
        for name, member in kind.members.items():
            if not isinstance(member, griffe.Attribute) or "property" in member.labels or member.annotation is None:
                continue
            if str(member.annotation) == "KW_ONLY":
                fields = named
            elif not name.startswith("_") and "instance-attribute" in member.labels:
                default = "" if member.value is None else f" = {member.value}"
                default = re.sub(r"field\(default_factory=(\w+)\)", r"\1()", default)
                fields.append(f"{name}: {member.annotation}{default}")
    return f"{item.name}({', '.join([*free, *(['*'] if named else []), *named])})"


def _hidden_bases(item: griffe.Class) -> Iterator[griffe.Class]:
    """Yield the bases of a class that belong to the package and are not public themselves, the nearest first."""
    public = {name for names in public_names().values() for name in names}
    for base in item.bases:
        name = str(base).partition("[")[0]
        found = item.module.members.get(name)
        if name not in public and isinstance(found, griffe.Alias):
            found = _imported(item.module, name)
        if name not in public and isinstance(found, griffe.Class):
            yield found
            yield from _hidden_bases(found)


def _imported(module: griffe.Module, name: str) -> griffe.Object | griffe.Alias | None:
    """Return an object that a module imports from another of the package's modules; None from elsewhere."""
    for node in ast.parse(Path(str(module.filepath)).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.level and name in [alias.name for alias in node.names]:
            folder = module.path.split(".")[: -node.level]
            _, package, *path = [*folder, *str(node.module).split(".")]
            return _module(package, ".".join(path)).members[name] if path else None
    return None


def _members(item: griffe.Class) -> Iterator[str]:
    """Yield the members of an enumeration, and the public methods and properties of a class."""
    described = {
        each.name
        for section in (item.docstring.parsed if item.docstring else [])
        if section.kind is griffe.DocstringSectionKind.attributes
        for each in section.value
    }
    for name, member in item.members.items():
        if name.startswith("_") or member.is_alias:
            continue
        if isinstance(member, griffe.Function):
            yield f"`{_signature(member)}`: {_first_words(member)}\n"
        elif isinstance(member, griffe.Attribute) and name not in described:
            if "property" in member.labels:
                yield f"`{name}`: {_first_words(member)}\n"
            elif member.value is not None:
                yield f"`{name} = {member.value}`\n"


def _first_words(item: griffe.Object) -> str:
    """Return the first paragraph of a docstring."""
    text = item.docstring.value if item.docstring else ""
    return _text(_joined(text.partition("\n\n")[0]))


def _joined(text: str) -> str:
    """Return a text on one line."""
    return re.sub(r"\s+", " ", text)


def _signature(item: griffe.Function) -> str:
    """Return a function as it is called, without ``self``."""
    parts, star = [], False
    for parameter in item.parameters:
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is griffe.ParameterKind.keyword_only and not star:
            parts.append("*")
            star = True
        mark = _MARKS.get(parameter.kind, "")
        star = star or mark == "*"
        text = mark + parameter.name
        if parameter.annotation is not None:
            text += f": {parameter.annotation}"
        if parameter.default is not None and not mark:
            text += f" = {parameter.default}" if parameter.annotation is not None else f"={parameter.default}"
        parts.append(text)
    returned = "" if item.returns is None else f" -> {item.returns}"
    return f"{item.name}({', '.join(parts)}){returned}"


def _docstring(item: griffe.Object | griffe.Alias, only: str | None = None) -> Iterator[str]:
    """Yield a docstring: its text, and a list for each of its sections; or only one kind of section."""
    for section in item.docstring.parsed if item.docstring else []:
        kind = section.kind.value
        if only not in (None, kind):
            continue
        if kind == "text":
            yield f"{_text(section.value)}\n"
        elif kind in _LISTS:
            yield f"{_LISTS[kind]}:\n"
            for each in section.value:
                label = each.annotation if kind == "raises" else each.name
                yield f"- `{label}`: {_text(_joined(each.description))}"
            yield ""
        elif kind == "returns":
            words = " ".join(each.description for each in section.value)
            yield f"Returns: {_text(_joined(words))}\n"


def _text(text: str) -> str:
    """Return a docstring's text as Markdown: references and literals as code."""
    text = re.sub(r":\w+:`~?\.*([^`]+)`", r"`\1`", text)
    text = re.sub(r"``(.+?)``", r"`\1`", text)
    return re.sub(r"\)::\n|::\n", ":\n", text)


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(PAGE.read_text(encoding="utf-8") != page())
    PAGE.write_text(page(), encoding="utf-8")

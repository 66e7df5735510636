"""What a reader tries: every public name has a docstring, the notebook runs."""

import dataclasses
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import FunctionType, ModuleType

import nbformat
import pytest
from builders import DOCS

import screwsynth.models
import screwsynth.nlp
from screwsynth.nlp.system.jsonvalues import JsonObject

REFERENCE = "\n".join(page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("api-*.md")))
PUBLIC = [(package, name) for package in (screwsynth.nlp, screwsynth.models) for name in package.__all__]


@pytest.mark.parametrize(("package", "name"), PUBLIC, ids=[name for _, name in PUBLIC])
def test_every_public_name_says_what_it_is_and_what_it_takes(package: ModuleType, name: str) -> None:
    value = getattr(package, name)
    if not isinstance(value, type | FunctionType):
        # A name for a type has no docstring: the reference describes it.
        assert f".. py:type:: {name}\n   :module: {package.__name__}\n" in REFERENCE
        return
    text = inspect.cleandoc(value.__doc__ or "")
    first = text.partition("\n\n")[0]
    # Not the signature that a dataclass without words of its own has.
    assert first.endswith((".", ":"))
    assert not first.startswith(f"{name}(")
    parts = _parts_of(value)
    of_bases = [inspect.cleandoc(base.__doc__ or "") for base in getattr(value, "__mro__", ())[1:]]
    lists = [each for each in (text, *of_bases) if re.search(r"^(Args|Attributes):$", each, flags=re.MULTILINE)]
    if text in lists or len(parts) > 3:
        described = "\n".join(lists)
        unsaid = [each for each in parts if not re.search(rf"^    \*{{0,2}}{each}: \S", described, flags=re.MULTILINE)]
        assert unsaid == []


def test_the_reference_has_every_public_name_once_by_its_kind() -> None:
    described = re.findall(r"^\.\. auto(\w+):: (\S+)$", REFERENCE, flags=re.MULTILINE)
    described += [
        ("type", f"{module}.{name}")
        for name, module in re.findall(r"^\.\. py:type:: (\w+)\n   :module: (\S+)$", REFERENCE, flags=re.MULTILINE)
    ]
    names = [(_kind(getattr(package, name)), f"{package.__name__}.{name}") for package, name in PUBLIC]
    assert sorted(described) == sorted(names)


def _kind(value: object) -> str:
    """The kind of a public name, as directives of autodoc call it."""
    if isinstance(value, type):
        return "exception" if issubclass(value, BaseException) else "class"
    return "function" if isinstance(value, FunctionType) else "type"


def _parts_of(value: type | FunctionType) -> list[str]:
    """The arguments of a function, and the fields of a class."""
    if isinstance(value, FunctionType):
        return list(inspect.signature(value).parameters)
    if dataclasses.is_dataclass(value):
        return [field.name for field in dataclasses.fields(value) if not field.name.startswith("_")]
    return list(getattr(value, "fields" if issubclass(value, JsonObject) else "_fields", ()))


def test_the_notebook_runs_and_shows_what_it_shows_here(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    target = tmp_path / "tour.ipynb"
    command = [sys.executable, "-P", str(DOCS / "tour.py"), str(target)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    ran, written = (nbformat.read(file, as_version=4) for file in (target, DOCS / "tour.ipynb"))
    nbformat.validate(written)
    assert len(ran.cells) == len(written.cells)
    kinds = set()
    for new, old in zip(ran.cells, written.cells, strict=True):
        assert new.source == old.source
        for one, two in zip(new.get("outputs", []), old.get("outputs", []), strict=True):
            assert one.output_type == two.output_type
            kinds |= set(one.get("data", {}))
            assert _steady(one.get("text", "")) == _steady(two.get("text", ""))
            assert one.get("data", {}).keys() == two.get("data", {}).keys()
    assert {"text/html", "text/plain"} <= kinds
    shown = "".join(
        output["data"]["text/html"]
        for cell in ran.cells
        for output in cell.get("outputs", [])
        if "text/html" in output.get("data", {})
    )
    texts = [output.get("text", "") for cell in ran.cells for output in cell.get("outputs", [])]
    assert any("largest F = 407.2107" in text for text in texts)
    assert shown.count("data:image/svg+xml;base64,") == 3


def _steady(text: str) -> list[str]:
    """The lines of a text whose last digits do not differ between machines, numbers to four digits."""
    lines = [line for line in text.splitlines() if not line.startswith("evidence")]
    return [re.sub(r"\d+\.\d+", lambda found: f"{float(found[0]):.4g}", line) for line in lines]


def test_lines_of_code_fit_into_the_column_of_the_site() -> None:
    wide = []
    for page in sorted(DOCS.glob("*.md")):
        for block in re.findall(
            r"^( *)```[^\n]*\n(.*?)^\1```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
        ):
            wide += [f"{page.name}: {line}" for line in block[1].splitlines() if len(line) > 108]
    assert wide == []

"""The pages about Python: the API reference is what the docstrings say, and the notebook runs."""

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from builders import DOCS, docs_script

import screwsynth.models
import screwsynth.nlp


def test_the_reference_is_up_to_date() -> None:
    written = (DOCS / "api.md").read_text(encoding="utf-8")
    assert written == docs_script("api").page(), "run `make docs`"


def test_the_reference_names_every_public_object() -> None:
    nlp, models = (DOCS / "api.md").read_text(encoding="utf-8").split("## screwsynth.models\n")
    for text, package in ((nlp, screwsynth.nlp), (models, screwsynth.models)):
        headings = re.findall(r"^### (\w+)$", text, flags=re.MULTILINE)
        assert sorted(headings) == sorted(package.__all__)
        sections = dict(zip(headings, re.split(r"^### \w+$", text, flags=re.MULTILINE)[1:], strict=True))
        for name in headings:
            value = getattr(package, name)
            # Its own words stand there, and the arguments of a function.
            if isinstance(value, type) or callable(value):
                words = re.sub(r"\s+", " ", (value.__doc__ or "").partition("\n\n")[0]).strip()[:40]
                plain = re.sub(r"\s+", " ", sections[name])
                assert re.split(r"[`:]", words)[0] in plain, name
    for name in ("table", "plot", "report", "to_dict"):
        assert f"`{name}(" in nlp.partition("### Solution\n")[2].partition("\n### ")[0]
    assert "`to_toml() -> str`" in nlp
    assert "no `screwsynth.__version__`" in nlp


def test_links_within_the_reference_lead_to_headings() -> None:
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    anchors: list[str] = []
    for heading in re.findall(r"^###? (\S+)$", text, flags=re.MULTILINE):
        plain = heading.lower().replace(".", "")
        count = sum(re.fullmatch(rf"{re.escape(plain)}(-\d+)?", each) is not None for each in anchors)
        anchors.append(f"{plain}-{count}" if count else plain)
    links = re.findall(r"\]\(#([^)]+)\)", text)
    assert len(links) > 100
    assert set(links) <= set(anchors)


def test_the_first_steps_of_the_documentation_print_what_they_show(tmp_path: Path) -> None:
    page = (DOCS / "start.md").read_text(encoding="utf-8")
    ran = re.findall(r"```sh\nscrewsynth (.*)\n```(?:\n\n```text\n([^`]*)```)?", page)
    assert [bool(shown) for _, shown in ran] == [False, True, True, True]
    for line, shown in ran:
        arguments, _, target = line.partition(" > ")
        command = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments.split()]
        out = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
        if target:
            (tmp_path / target).write_text(out, encoding="utf-8")
        printed = [each.rstrip() for each in out.splitlines()]
        assert [each for each in shown.splitlines() if each not in printed] == []


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

"""Live pages of the site: which cases have one, links to them, and pages that are kept between builds."""

import importlib.util
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from builders import DOCS, docs_script

from screwsynth.nlp import shipped_cases
from screwsynth.nlp.view.wasm import find_compiler

SCRIPT = docs_script("livepages")
INTRODUCTIONS = docs_script("introductions").INTRODUCTIONS


def test_introductions_and_examples_of_the_paper_have_a_live_page() -> None:
    names = SCRIPT.live_names()
    assert set(names) <= set(shipped_cases())
    for page in INTRODUCTIONS:
        (name,) = SCRIPT.names_in((DOCS / f"{page}.md").read_text(encoding="utf-8"))
        assert f"(../cases/{name}.toml)" in (DOCS / f"{page}.md").read_text(encoding="utf-8")
    paper = list(SCRIPT.names_in((DOCS / "reproduction.md").read_text(encoding="utf-8")))
    assert {name[:9] for name in paper} == {"paper-4.1", "paper-4.2", "paper-4.3", "paper-4.4"}
    # The page of all cases links each of them.
    assert list(SCRIPT.names_in((DOCS / "cases.md").read_text(encoding="utf-8"))) == names


def test_comments_become_links_to_the_pages_of_the_site() -> None:
    text = "before\n\n<!-- live: one, two-2.1 -->\n\nbetween\n\n<!-- live: three -->\n\n<!-- live: four -->\n"
    assert list(SCRIPT.names_in(text)) == ["one", "two-2.1", "three", "four"]
    one, two = (f'<a href="live/{name}.html">{name}</a>' for name in ("one", "two-2.1"))
    linked = SCRIPT.with_links(text, {"one": "", "two-2.1": "no compiler", "three": "no C"})
    assert linked.split("\n\n") == [
        "before",
        f'<p class="live">Pages that solve: {one}, {two} (without sliders)</p>',
        "between",
        '<p class="live">Robot in three dimensions: <a href="live/three.html">three</a> (without sliders)</p>',
        "\n",
    ]
    assert "live" not in SCRIPT.with_links(text, {})


def test_pages_are_made_again_only_after_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []

    def view_page(name: str, target: Path) -> str:
        made.append(name)
        target.write_text(f"page {name}", encoding="utf-8")
        return "no compiler" if name == "b" else ""

    monkeypatch.setattr(SCRIPT, "view_page", view_page)
    site, cache = tmp_path / "site" / "live", tmp_path / "cache"
    for _ in range(2):
        assert SCRIPT.write_pages(site, ["a", "b"], cache) == {"a": "", "b": "no compiler"}
        assert sorted(made) == ["a", "b"]
        assert (site / "a.html").read_text(encoding="utf-8") == "page a"
    # After other sources all pages are made again, and those of the old ones are gone.
    monkeypatch.setattr(SCRIPT, "checksum_of_sources", lambda: "other")
    SCRIPT.write_pages(site, ["a"], cache)
    assert sorted(made) == ["a", "a", "b"]
    assert [each.name for each in cache.iterdir()] == ["other"]

    def fails(name: str, _target: Path) -> str:
        raise subprocess.CalledProcessError(2, name)

    monkeypatch.setattr(SCRIPT, "view_page", fails)
    with pytest.raises(subprocess.CalledProcessError):
        SCRIPT.write_pages(site, ["c"], cache)
    assert not (site / "c.html").exists()


def test_the_checksum_follows_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "package"
    for room in ("models", "nlp", "cases"):
        (folder / room).mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "nlp" / "page.js").write_text("1", encoding="utf-8")
    monkeypatch.setattr(SCRIPT, "screwsynth", SimpleNamespace(__file__=str(folder / "__init__.py")))
    first = SCRIPT.checksum_of_sources()
    assert SCRIPT.checksum_of_sources() == first
    (folder / "nlp" / "page.js").write_text("2", encoding="utf-8")
    second = SCRIPT.checksum_of_sources()
    monkeypatch.setattr(SCRIPT, "find_compiler", lambda: None)
    assert len({first, second, SCRIPT.checksum_of_sources()}) == 2 + (find_compiler() is not None)


def test_a_page_without_sliders_gives_its_reason(tmp_path: Path) -> None:
    # The objective of this case is not in C, also where a compiler is installed.
    fault = SCRIPT.view_page("agile-eye", tmp_path / "page.html")
    assert "this case minimises the actuator speed" in fault
    assert "<canvas" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_picture_of_a_live_page_is_small() -> None:
    picture = (DOCS / "figures" / "view.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) <= 80_000
    for page in (DOCS.parent / "README.md", DOCS / "view.md"):
        assert "figures/view.png)" in page.read_text(encoding="utf-8")


@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="sphinx is not installed")
def test_the_configuration_writes_the_pages_and_their_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    conf = docs_script("conf")
    monkeypatch.setattr(conf.livepages, "write_pages", lambda _folder, names: dict.fromkeys(names, ""))
    app = SimpleNamespace(builder=SimpleNamespace(format="html"), outdir=str(tmp_path))
    conf.write_live_pages(app)
    source = ["<!-- live: machine-tool -->"]
    conf.add_live_links(app, "intro-machine-tool", source)
    assert 'href="live/machine-tool.html"' in source[0]

"""Pages as tests read them: their elements without a browser, and the fixtures that make them once."""

import json
import os
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import case_from
from measures import exponential

from screwsynth.nlp import Solution, result_of, solve
from screwsynth.nlp.cli.main import run as command_line
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.webpage import page_of


@dataclass
class Page(HTMLParser):
    """What a page has, read without a browser."""

    text: str
    elements: list[tuple[str, dict[str, str | None]]] = field(default_factory=list)
    scripts: list[tuple[dict[str, str | None], str]] = field(default_factory=list)
    words: str = ""
    tables: dict[str, list[list[str]]] = field(default_factory=dict)
    titles: str = ""

    def __post_init__(self) -> None:
        super().__init__()
        self._open: list[str] = []
        self._rows: list[list[str]] = []
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in {"meta", "link", "input", "img", "br", "source"}:
            self._open.append(tag)
        if tag == "script":
            self.scripts.append((dict(attrs), ""))
        if tag == "table":
            self._rows = []
            self.tables[dict(attrs).get("id") or f"table {len(self.tables)}"] = self._rows
        if tag == "tr":
            self._rows.append([])
        if tag in {"td", "th"}:
            self._rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag, "elements close in order"

    def handle_data(self, data: str) -> None:
        if self._open[-1:] == ["script"]:
            attributes, text = self.scripts[-1]
            self.scripts[-1] = attributes, text + data
        elif self._open == ["html", "head", "title"]:
            self.titles += data
        elif "style" not in self._open:
            self.words += data
            if {"td", "th"} & set(self._open):
                self._rows[-1][-1] += data

    def script(self, name: str) -> str:
        return next(text for attributes, text in self.scripts if attributes.get("id") == name)

    @property
    def data(self) -> dict[str, Any]:
        return dict(json.loads(self.script("data")))


#: Searches of the pages: what a page shows does not depend on how many starts found the same optimum.
FEW = ("--starts", "4")


def made(case: str, target: Path, *options: str) -> tuple[int, str]:
    """Exit status and standard error of the command that writes a page, in this process."""
    errors = StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()), redirect_stderr(errors):
        # Without a compiler, a report has the 3-D view; tests of live pages have reports with the live view.
        patch.setattr("screwsynth.nlp.view.wasm.find_compiler", lambda: None)
        patch.setattr(sys, "argv", ["screwsynth", "report", case, "--out", str(target), *options])
        return command_line(), errors.getvalue()


@pytest.fixture(scope="session")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The page of a shipped case, made once for all processes of the tests."""
    # Processes of pytest-xdist have folders of their own in a common one.
    base = tmp_path_factory.getbasetemp()
    root = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "pages"
    root.mkdir(exist_ok=True)

    def make(case: str, *options: str) -> Path:
        target = root / f"{' '.join([case, *options])}.html"
        if not target.exists():
            # Only a whole page has the common name: another process may be making the same one.
            own = tmp_path_factory.mktemp("report") / "page.html"
            assert made(case, own, *FEW, *options) == (0, "")
            own.replace(target)
        return target

    return make


@pytest.fixture(scope="session")
def page(page_file: Callable[..., Path]) -> Callable[..., Page]:
    return cache(lambda case, *options: Page(page_file(case, *options).read_text(encoding="utf-8")))


def displaced(points: np.ndarray, twist: np.ndarray, t: float) -> np.ndarray:
    """Points (n, 3) after a motion with a constant twist."""
    E = exponential(twist, t)
    return np.asarray(points @ E[:3, :3].T + E[:3, 3])


def rates_of_lines(view: dict[str, Any], points: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of straight limbs, and the rates at which a twist of their upper ends changes them."""
    names = [point["body"] for point in view["points"]]
    lengths, rates = [], []
    for row in view["rows"]:
        (ends,) = [link["ends"] for link in view["links"] if link["limb"] == row["limb"]]
        lower, upper = sorted(ends, key=lambda index: names[index] == "platform")
        along = points[upper] - points[lower]
        length = float(np.linalg.norm(along))
        lengths.append(length)
        rates.append(along @ (twist[3:] + np.cross(twist[:3], points[upper])) / length)
    return np.array(lengths), np.array(rates)


def number(text: str) -> float:
    return float(text.replace("\N{MINUS SIGN}", "-").removesuffix(" %"))


@cache
def posed(text: str) -> tuple[Solution, str]:
    """The solution and the page of a case."""
    solution = solve(case_from(text, "poses"))
    return solution, page_of(report_of("", solution, result_of(solution)))

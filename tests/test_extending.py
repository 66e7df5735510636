"""The sections "How to add ..." of docs/development.md, each followed in a temporary module.

A limit is added in tests/nlp/test_limits.py, a robot of another package in tests/nlp/test_plugins.py.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from screwsynth.nlp import Solution, Status, load_case, result_of, solve
from screwsynth.nlp.words.summary import case_summary

Module = Callable[[str, str], ModuleType]


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Module]:
    """Makes a module of one file."""
    monkeypatch.syspath_prepend(tmp_path)
    made: list[str] = []

    def make(name: str, text: str) -> ModuleType:
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
        made.append(name)
        return importlib.import_module(name)

    yield make
    for name in made:
        sys.modules.pop(name, None)


GRADIENT_STEPS = '''
"""A solver in one file: projected gradient steps with backtracking, for programs whose only limits are bounds."""

import numpy as np

from screwsynth.nlp import SolverResult, StopReason


def projected_gradient(nlp, search, points, count):
    """Return searches that follow the gradient along the box."""

    def run(start):
        x = start
        for iteration in range(search.max_iterations):
            at = nlp.program.kernels.derivatives(x, nlp.arguments)
            F, slope = float(at.F[0, 0]), nlp.sign * at.gradient.ravel() * nlp.scale**2
            step = 1.0 / max(1e-300, float(np.max(np.abs(slope / nlp.scale))))
            while step > 1e-12:
                moved = np.clip(x - step * slope, nlp.lower, nlp.upper)
                if nlp.sign * (nlp.evaluate(moved)[0] - F) < 0:
                    break
                step /= 4
            else:
                break
            x = moved
        return SolverResult(x, np.where(x >= nlp.upper, 1.0, np.where(x <= nlp.lower, -1.0, 0.0)),
                            np.zeros(len(nlp.program.constraints)), StopReason.SUCCEEDED, iteration)

    return [run] * count
'''


def test_a_solver_is_one_file(module: Module) -> None:
    """Its word is not taken for it: the points are corrected and judged by the program's own conditions."""
    solver = module("gradient_steps", GRADIENT_STEPS).projected_gradient
    case = load_case("paper-4.1-rotation-axis-z", {"angle": -6.0})
    by_ipopt = solve(case, starts=4)
    by_gradient = solve(case, starts=4, solver=solver)
    assert by_gradient.status is by_ipopt.status is Status.OPTIMAL
    assert pytest.approx(by_ipopt.F, rel=1e-9) == by_gradient.F
    np.testing.assert_allclose(by_gradient.x, by_ipopt.x, atol=1e-7)


def test_a_solver_that_claims_a_wrong_point_gives_no_optimum(module: Module) -> None:
    text = GRADIENT_STEPS.replace("range(search.max_iterations)", "range(1)")
    case = load_case("paper-4.1-helical")
    found = solve(case, starts=2, solver=module("one_step", text).projected_gradient)
    best = solve(case, starts=2)
    # One step from the start, and a correction that only polishes: an optimum is reported only where it is one.
    assert found.status is not Status.OPTIMAL or pytest.approx(best.F, rel=1e-9) == found.F


CSV = '''
"""An output in one file: the lines and tables of a result as comma-separated values."""

import csv
import io

from screwsynth.nlp.words.text import Line


def as_csv(summary):
    """Return one row of text for each line, and for each row of a table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\\n")
    for item in summary:
        if isinstance(item, Line):
            writer.writerow([item.label, f"{item.before}{item.text}{item.after}"])
        else:
            writer.writerows([item.headers, *([str(getattr(cell, "text", cell)) for cell in row] for row in item.rows)])
    return text.getvalue()
'''


@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.2"])
def test_an_output_is_one_file(name: str, module: Module) -> None:
    """It renders lines and tables, and solves nothing: the words are those of the terminal."""
    solution: Solution = solve(load_case(name), starts=4)
    result = result_of(solution)
    text = module("comma_separated", CSV).as_csv(case_summary(solution.case, result))
    assert solution.case.title in text
    assert any(line.startswith(("x1,12,cm", "x1,")) for line in text.splitlines())
    assert "\x1b" not in text

"""Proved bounds of all schedules of one and two settings: exhaustive search over grids, samples, stops and refusals."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import casadi as ca
import jsonschema
import numpy as np
import pytest
from builders import Run
from test_schedule_measures import _ANY_FORCE, _RADIUS, _minimised
from test_schedules import _DEGREE, _few_points, _written

from screwsynth.models import FloatArray
from screwsynth.nlp import CaseError, load_case, solve
from screwsynth.nlp.errors import UncoveredError
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.schedule.cells import cell_bound, check_certified
from screwsynth.nlp.solver.schedule.dynamic import sliding_maximum
from screwsynth.nlp.solver.schedule.polish import polish
from screwsynth.nlp.solver.schedule.problem import ScheduleProblem, ends

_NO_DESIGN = np.zeros(0)
_TWO = ("x1 = 26.5", _RADIUS)


def _uneven_times(file: Path, rng: np.random.Generator) -> None:
    """Give the path uneven times, so that the steps of the rates differ from point to point."""
    with file.open() as text:
        rows = list(csv.DictReader(text))
    times = np.cumsum(rng.uniform(0.3, 3.0, len(rows)))
    lines = [",".join(rows[0])]
    lines += [
        ",".join([repr(float(t)), *(row[key] for key in rows[0] if key != "t")])
        for t, row in zip(times, rows, strict=True)
    ]
    file.write_text("\n".join(lines) + "\n")


def _grid_schedule(problem: ScheduleProblem, counts: tuple[int, int]) -> FloatArray | None:
    """Return the best schedule (N, 2) among grid values that keeps limits and rates, by comparison of all pairs."""
    low, high, _ = ends(problem.settings)
    axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)]
    grid = np.stack([each.ravel() for each in np.meshgrid(*axes, indexing="ij")], axis=1)
    apart = np.abs(grid[:, None] - grid[None])
    level, steps = None, []
    for i in range(len(problem.points)):
        found = problem.at(_NO_DESIGN, grid, [i] * len(grid))
        own = problem.combined(found.objective) * (1.0 if problem.is_worst else problem.points.weights[i])
        own = np.where((found.excess <= 0).all(axis=1), own, -math.inf)
        if level is None:
            level = own
            continue
        whole = np.where((apart <= problem.steps[i - 1]).all(axis=2), level[None], -math.inf)
        steps.append(whole.argmax(axis=1))
        level = np.minimum(own, whole.max(axis=1)) if problem.is_worst else own + whole.max(axis=1)
    assert level is not None
    if not math.isfinite(level.max()):
        return None
    chosen = [int(level.argmax())]
    for each in reversed(steps):
        chosen.append(int(each[chosen[-1]]))
    return np.asarray(grid[chosen[::-1]])


@pytest.mark.parametrize("seed", [0, 1, 2, 3, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(4, 24))])
def test_bound_of_two_settings_is_never_below_a_schedule(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rates = [rng.uniform(0.3, 3.0), rng.uniform(3.0, 30.0)]
    if seed % 5 == 4:
        rates[int(rng.integers(2))] = math.inf
    changes = [
        ("x1 = 26.5", _RADIUS.replace("rate = 0.5", f"rate = {rates[0]}")),
        ("rate = 5 ", f"rate = {rates[1]} "),
        ("x4 = 5", f"x4 = {rng.uniform(2, 20):.6f}"),
        ("max = 43", f"max = {rng.uniform(41, 46):.6f}"),
    ]
    changes += [('as = "mean"', 'as = "worst"')] if seed % 2 else []
    changes += [('sense = "max"', 'sense = "min"')] if seed % 4 >= 2 else []
    file = _written(tmp_path, *changes, count=7)
    if seed % 3:
        _uneven_times(tmp_path / "own.csv", rng)
    problem = _few_points(load_case(str(file)), 6)
    assert len(problem.points) == 7
    known = _grid_schedule(problem, (25, 31))
    assert known is not None
    best = problem.value(_NO_DESIGN, known)
    polished = polish(problem, _NO_DESIGN, known)
    if polished is not None:
        best = max(best, polished.value)
    # Also if only a poorer schedule is known, or a wide gap is requested.
    poor = cell_bound(problem, _NO_DESIGN, best - 0.05 * abs(best), 0.04)
    assert poor.bound >= best
    close = cell_bound(problem, _NO_DESIGN, best, 2e-3)
    assert best <= close.bound
    if not close.reason and polished is not None and polished.value == best:
        assert close.bound <= best + 2e-3 * abs(best)
    # A bound of all schedules holds for each that keeps limits and rates by chance.
    for _ in range(200):
        moved = known + rng.normal(scale=[0.2, 2 * _DEGREE], size=known.shape)
        if problem.is_feasible(_NO_DESIGN, moved, slack=0.0):
            assert problem.value(_NO_DESIGN, moved) <= close.bound


def test_bound_of_two_settings_is_close_to_the_schedule(tmp_path: Path, cli: Run) -> None:
    result = tmp_path / "r.json"
    file = _written(tmp_path, _TWO, count=50)
    code, out, err = cli("solve", str(file), "--certify", "--gap", "0.01", "--json", str(result))
    assert (code, err) == (0, "")
    assert "no schedule of this robot within the limits and rates has more than" in " ".join(out.split())
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    schedule = data["schedule"]
    assert schedule["names"] == ["x1", "turn"]
    assert schedule["value"] == pytest.approx(1.991367, abs=2e-4)
    assert schedule["value"] <= schedule["bound"] <= 1.01 * schedule["value"]
    assert schedule["gap"] <= 0.01
    assert "reason" not in schedule


@pytest.mark.parametrize("measure", ["leg_length", "actuator_force"])
@pytest.mark.parametrize("over", [pytest.param("mean", marks=pytest.mark.soak), "worst"])
def test_bound_of_quantities_of_legs_and_actuators(tmp_path: Path, measure: str, over: str) -> None:
    tables = (_ANY_FORCE if measure == "actuator_force" else "") + "[limits]\nleg_length = { min = 17, max = 46 }\n"
    problem = _few_points(load_case(str(_written(tmp_path, _TWO, *_minimised(measure, over, tables), count=6))), 5)
    known = _grid_schedule(problem, (17, 21))
    assert known is not None
    polished = polish(problem, _NO_DESIGN, known)
    assert polished is not None
    best = max(polished.value, problem.value(_NO_DESIGN, known))
    # The objective is negative for a minimum, and no schedule has less than minus the bound.
    assert best <= cell_bound(problem, _NO_DESIGN, best, 0.01).bound <= best + 0.01 * abs(best)


def test_a_stop_keeps_the_bound_proved_by_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = _few_points(load_case(str(_written(tmp_path, count=8))), 8)
    known = polish(problem, _NO_DESIGN, np.zeros((len(problem.points), 1)))
    assert known is not None
    with monkeypatch.context() as patched:
        patched.setattr("screwsynth.nlp.solver.schedule.cells.is_requested", lambda: True)
        none = cell_bound(problem, _NO_DESIGN, known.value, 1e-9)
    assert none.bound == math.inf
    assert none.reason
    calls = []

    def after_two() -> bool:
        calls.append(1)
        return len(calls) > 2

    monkeypatch.setattr("screwsynth.nlp.solver.schedule.cells.is_requested", after_two)
    some = cell_bound(problem, _NO_DESIGN, known.value, 1e-9)
    assert some.reason
    assert known.value <= some.bound < math.inf


def test_a_stopped_proof_shows_the_schedule_and_its_bound(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = tmp_path / "r.json"
    file = str(_written(tmp_path, ("max = 43", "max = 60"), count=8))
    monkeypatch.setattr("screwsynth.nlp.solver.schedule.cells._MOST", 100)
    code, out, _ = cli("solve", file, "--certify", "--gap", "1e-9", "--json", str(result))
    assert code == 1  # the requested gap was not reached
    schedule = json.loads(result.read_text())["schedule"]
    assert schedule["reason"] == "more than 100 cells"
    assert schedule["value"] <= schedule["bound"]
    assert "stopped: more than 100 cells)" in " ".join(out.split())
    monkeypatch.setattr("screwsynth.nlp.solver.schedule.cells.is_requested", lambda: True)
    code, out, _ = cli("solve", file, "--certify", "--json", str(result))
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    assert code == 1
    assert "bound" not in data["schedule"]
    assert "bound  none proved; stopped: " in out


def test_an_operation_without_an_enclosure_is_refused_before_the_search(tmp_path: Path) -> None:
    problem = _few_points(load_case(str(_written(tmp_path, count=8))), 8)
    check_certified(problem)
    with pytest.raises(UncoveredError, match="no bound can be proved: the robot's expressions contain"):
        check_certified(replace(problem, objective=ca.erf(problem.objective)))


def test_three_settings_and_no_setting_have_no_bound(tmp_path: Path) -> None:
    three = ("x3 = 0", 'x3 = { min = 0, max = 30, per = "path", rate = 2 }')
    case = load_case(str(_written(tmp_path, _TWO, three)))
    words = r"certify: bounds schedules of at most two changing numbers; this case has 3: x1, x3, turn; fix one of them"
    with pytest.raises(CaseError, match=words):
        solve(case, gap=1e-4)
    fixed = load_case(str(_written(tmp_path, ("{ min = -75, max = 75, rate = 5 }", "10"))))
    with pytest.raises(CaseError, match="certify: bounds schedules, but no value of this case changes along the path"):
        solve(fixed, gap=1e-4)


def test_sliding_maximum_between_boxes_equals_its_definition() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(9, 7))
    for reach, shift, size in ((0, 0, 9), (2, -3, 5), (1, 4, 12), (3, 20, 4), (40, -6, 3), (2, -30, 4)):
        for axis in (0, 1):
            own = np.moveaxis(values, axis, 0)
            expected = np.full((size, own.shape[1]), -math.inf)
            for j in range(size):
                near = own[max(j + shift - reach, 0) : max(j + shift + reach + 1, 0)]
                if len(near):
                    expected[j] = near.max(axis=0)
            found = sliding_maximum(values, reach, shift=shift, size=size, axis=axis)
            np.testing.assert_array_equal(np.moveaxis(found, axis, 0), expected)

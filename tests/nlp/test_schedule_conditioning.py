"""Schedules with the largest smallest singular value: independent Jacobian, proved bounds, limits and refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import Run
from test_schedule_measures import _NO_TASK, _RADIUS, _jacobian
from test_schedules import _DEGREE, _few_points, _written

from screwsynth.models import FloatArray
from screwsynth.nlp import CaseError, load_case
from screwsynth.nlp.path.path import Poses
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.schedule.cells import cell_bound
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.schedule.polish import polish
from screwsynth.nlp.solver.schedule.search import solve_schedule

_LENGTH = 10.0
_NO_DESIGN = np.zeros(0)
#: Largest number of cells of a bound.
_LARGEST = "screwsynth.nlp.solver.schedule.cells._MOST"


def _maximised(over: str, *more: tuple[str, str]) -> list[tuple[str, str]]:
    """Return the changes by which a case maximises its smallest singular value."""
    text = f'as = "{over}"\nmaximise = "smallest_singular_value"\nlength = {_LENGTH:g}'
    return [_NO_TASK, ('as = "mean"', text), *more]


def _smallest(poses: Poses, turns: FloatArray) -> FloatArray:
    """Return the smallest singular values (N,) of the homogenised J, with turns in degrees."""
    scale = np.array([1 / _LENGTH] * 3 + [1.0] * 3)
    return np.array([
        np.linalg.svd(_jacobian(p, R, turn * _DEGREE) * scale, compute_uv=False)[-1]
        for p, R, turn in zip(poses.positions, poses.rotations, turns, strict=True)
    ])  # fmt: skip


@pytest.mark.parametrize("over", [pytest.param("mean", marks=pytest.mark.soak), "worst"])
def test_smallest_singular_value_along_a_path(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, over: str
) -> None:
    result, table = tmp_path / "r.json", tmp_path / "s.csv"
    file = _written(tmp_path, *_maximised(over, ("max = 43", "max = 60")), count=40)
    arguments = ("--certify", "--gap", "0.01", "--json", str(result), "--schedule", str(table))
    solutions = []

    def kept(*given: Any, **named: Any) -> Any:  # noqa: ANN401 - those of the replaced function
        solutions.append(solve_schedule(*given, **named))
        return solutions[-1]

    # The answer in numbers too, without a second search.
    monkeypatch.setattr("screwsynth.nlp.solver.schedule.search.solve_schedule", kept)
    code, out, err = cli("solve", str(file), *arguments)
    assert (code, err) == (0, "")
    assert f"{'mean ' if over == 'mean' else ''}smallest singular value = " in out
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    case = load_case(str(file))
    schedule = solutions[0].schedule
    assert schedule is not None
    assert schedule.constant is not None
    values = _smallest(schedule.poses, schedule.values[:, 0])
    np.testing.assert_allclose(schedule.F, values, rtol=1e-9)
    weights = schedule_problem(case).points.weights

    def combined(each: FloatArray) -> float:
        return float(each.min() if over == "worst" else weights @ each)

    assert schedule.value == pytest.approx(combined(values), rel=1e-9)
    assert data["schedule"]["value"] == pytest.approx(schedule.value, rel=1e-9)
    assert schedule.value <= data["schedule"]["bound"] <= 1.01 * schedule.value
    # The best constant of a scan, within its limits.
    held = [combined(_smallest(schedule.poses, np.full(len(values), turn))) for turn in np.arange(-20.0, 20.5, 0.5)]
    assert schedule.value >= max(held) - 5e-3 * max(held)
    assert schedule.constant.value >= max(held) - 5e-3 * max(held)
    assert (np.abs(np.diff(schedule.values[:, 0])) <= 5 * np.diff(schedule.times)).all()


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 12))])
def test_bound_of_the_smallest_singular_value_is_not_below_a_schedule(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    # The sampled schedules are not the best ones, so no bound comes close to them.
    monkeypatch.setattr(_LARGEST, 100_000)
    rng = np.random.default_rng(seed)
    changes = _maximised(
        "worst" if seed % 2 else "mean",
        ("x4 = 5", f"x4 = {rng.uniform(2, 20):.6f}"),
        ("rate = 5 ", f"rate = {rng.uniform(5, 60):.6f} "),
        ("max = 43", f"max = {rng.uniform(44, 60):.6f}"),
    )
    if seed % 3 == 1:
        changes.append(("x1 = 26.5", _RADIUS))
    problem = _few_points(load_case(str(_written(tmp_path, *changes, count=6))), 5)
    low, high = (np.array([getattr(each, name) for each in problem.settings]) for name in ("lower", "upper"))
    best = -math.inf
    polishes = 0
    for _ in range(100):
        s = np.empty((len(problem.points), len(low)))
        s[0] = rng.uniform(low, high)
        for i, step in enumerate(problem.steps):
            s[i + 1] = np.clip(s[i] + rng.uniform(-step, step), low, high)
        if problem.is_feasible(_NO_DESIGN, s, slack=0.0):
            best = max(best, problem.value(_NO_DESIGN, s))
            polished = polish(problem, _NO_DESIGN, s) if polishes < 1 else None
            polishes += 1
            best = best if polished is None else max(best, polished.value)
    assert math.isfinite(best)
    assert cell_bound(problem, _NO_DESIGN, best - 0.05 * best, 0.04).bound >= best
    assert cell_bound(problem, _NO_DESIGN, best, 0.01).bound >= best


def test_a_limit_on_a_singular_value_excludes_no_schedule_that_keeps_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_LARGEST, 100_000)
    # On the axis of the robot singular values coincide in pairs, and their estimate is 0.35 % too small.
    text = "smallest_singular_value = { min = 0.1, length = 10 }\nleg_length"
    tool = ('follows = "feed"', 'follows = "thrust"')
    file = _written(tmp_path, tool, ("leg_length", text), count=2)
    (tmp_path / "own.csv").write_text("t,x,y,z\n0,0,0,20\n4,0,0,24\n")
    smallest = [
        float(np.linalg.svd(_jacobian(np.array([0, 0, z]), np.eye(3), 0.0) * ([0.1] * 3 + [1] * 3))[1][-1])
        for z in np.linspace(20, 24, 9)
    ]
    least = min(smallest) * (1 - 1e-4)
    file.write_text(file.read_text().replace("min = 0.1, length", f"min = {least!r}, length"))
    problem = _few_points(load_case(str(file)), 8)
    still = np.zeros((len(problem.points), 1))
    values = problem.at(_NO_DESIGN, still)
    estimated = np.array(problem.are_exact) == False  # noqa: E712 - an array
    assert estimated.any()
    # The schedule keeps the limit, and only its estimate is violated.
    assert (values.excess[:, estimated] > 0).any()
    assert (values.excess[:, ~estimated] <= 0).all()
    own = problem.value(_NO_DESIGN, still)
    assert cell_bound(problem, _NO_DESIGN, 0.5 * own, 0.4).bound >= own


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("length = 10", "")], "objective.length: is missing: maximise needs the length"),
        ([("length = 10", "length = 0")], "objective.length = 0.0: must be positive"),
        ([("length = 10", "length = -1")], "objective.length = -1.0: must be positive"),
        ([("length = 10", "length = nan")], "objective.length = nan: must be positive"),
        ([("length = 10", "length = inf")], "objective.length = inf: must be positive"),
        ([('over = "path"\n', ""), ('as = "worst"\n', "")], "path.tool.turn"),
        ([("length = 10", 'length = 10\nminimise = "leg_length"')],
         'objective.maximise: conflicts with minimise = "leg_length"; remove one of them'),
        ([('maximise = "smallest_singular_value"\n', 'minimise = "leg_length"\n')],
         "objective.length: has an effect only with maximise; remove it"),
        ([("[limits]", '[[task]]\nsense = "min"\naxis = [0, 0, 1]\npitch = inf\n\n[limits]')],
         'task[0].sense = "min": objective.maximise needs no task: remove [[task]], or give it sense = "max"'),
        ([('maximise = "smallest_singular_value"', 'maximise = "leg_length"')], "objective.maximise"),
    ],
)  # fmt: skip
def test_bad_objectives_are_refused(tmp_path: Path, changes: list[tuple[str, str]], words: str) -> None:
    with pytest.raises(CaseError) as error:
        load_case(str(_written(tmp_path, *_maximised("worst"), *changes)))
    assert words in str(error.value)


def test_the_case_is_read_again_from_its_text(tmp_path: Path) -> None:
    case = load_case(str(_written(tmp_path, *_maximised("worst"))))
    text = case.to_toml()
    assert 'maximise = "smallest_singular_value"' in text
    (tmp_path / "again.toml").write_text(text)
    again = load_case(str(tmp_path / "again.toml"))
    assert again.tasks[0].length == _LENGTH
    assert again.to_toml() == text

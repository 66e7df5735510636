"""Schedules for actuator quantities, and schedules of two settings: independent statics, and each setting alone."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from builders import Run
from test_schedules import _DEGREE, _STRUT, _written

from screwsynth.models import FloatArray
from screwsynth.nlp import load_case, solve
from screwsynth.nlp.path.path import Poses
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.schedule.dynamic import grid_of
from screwsynth.nlp.solver.schedule.formulation import schedule_problem

_NO_TASK, _INCHES = _STRUT[0], ('length = "in"', 'length = "in"\nforce = "lbf"')
_LIMITS = "[limits]\nleg_length = { min = 17, max = 43 }"


def _minimised(measure: str, over: str, tables: str) -> list[tuple[str, str]]:
    """Return the changes by which a case minimises an actuator quantity along its path."""
    return [_NO_TASK, _INCHES, ('as = "mean"', f'as = "{over}"\nminimise = "{measure}"'), (_LIMITS, tables)]


_ANY_FORCE = '[[load]]\nname = "tool"\nany = { force = 20 }\n'


def _struts_at(position: FloatArray, rotation: FloatArray, turn: float) -> tuple[FloatArray, FloatArray]:
    """Return arms (6, 3) from the platform origin to its joints, and vectors (6, 3) of the struts."""
    centres, signs = np.repeat([0.0, 120.0, 240.0], 2) * _DEGREE, np.tile([-1, 1], 3)
    at = centres + signs * 55 * _DEGREE
    base = 26.5 * np.stack([np.cos(centres), np.sin(centres), 0 * at], axis=1)
    platform = 11.543 * np.stack([np.cos(at + turn), np.sin(at + turn), 0 * at], axis=1)
    arms = platform @ rotation.T
    return arms, position + arms - base


def _jacobian(position: FloatArray, rotation: FloatArray, turn: float) -> FloatArray:
    """Return J (6, 6): strut rates per angular velocity and velocity of the platform origin."""
    arms, struts = _struts_at(position, rotation, turn)
    units = struts / np.linalg.norm(struts, axis=1)[:, None]
    return np.hstack([np.cross(arms, units), units])


def _forces(poses: Poses, turns: FloatArray) -> FloatArray:
    """Return the largest strut force (N,) for a force of 20 at the platform origin in any direction, turns in deg."""
    rows = zip(poses.positions, poses.rotations, turns * _DEGREE, strict=True)
    return np.array([20 * np.linalg.norm(np.linalg.inv(_jacobian(*row))[3:], axis=0).max() for row in rows])


@pytest.mark.parametrize(
    ("lean", "over", "held", "value"),
    [
        (40, "worst", 15.7338, 15.4329),
        pytest.param(30, "worst", 13.0828, 13.0268, marks=pytest.mark.soak),
        pytest.param(30, "mean", 12.84557, 12.78481, marks=pytest.mark.soak),
    ],
)
def test_largest_strut_force_in_any_direction(tmp_path: Path, lean: int, over: str, held: float, value: float) -> None:
    case = load_case(str(_written(tmp_path, *_minimised("actuator_force", over, _ANY_FORCE), count=200, lean=lean)))
    schedule = solve(case).schedule
    assert schedule is not None
    assert schedule.constant is not None
    assert schedule.value == pytest.approx(value, abs=2e-4)
    assert schedule.constant.value == pytest.approx(held, abs=2e-4)
    forces = _forces(schedule.poses, schedule.values[:, 0])
    np.testing.assert_allclose(schedule.F, forces, rtol=1e-9)
    # Intervals are equal, so the ends have half the weight.
    weights = np.full(200, 1 / 199)
    weights[[0, -1]] /= 2

    def combined(values: FloatArray) -> float:
        return float(values.max()) if over == "worst" else float(weights @ values)

    assert combined(forces) == pytest.approx(schedule.value, rel=1e-3)
    best = min(combined(_forces(schedule.poses, np.full(200, turn))) for turn in np.arange(-4.0, 4.0, 1.0))
    assert schedule.constant.value * (1 - 1e-3) <= best <= schedule.constant.value * 1.02
    assert (np.abs(np.diff(schedule.values[:, 0])) <= 5 * np.diff(schedule.times)).all()


@pytest.mark.soak
def test_bound_of_the_largest_force_is_not_above_the_schedule(tmp_path: Path, cli: Run) -> None:
    result, written = tmp_path / "r.json", tmp_path / "s.csv"
    file = _written(tmp_path, *_minimised("actuator_force", "worst", _ANY_FORCE), count=40)
    code, out, err = cli(
        "solve", str(file), "--certify", "--gap", "0.002", "--json", str(result), "--schedule", str(written)
    )
    assert code == 0, err
    assert "largest actuator force = " in out
    assert " lbf along " in " ".join(out.split())
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    schedule = data["schedule"]
    assert schedule["bound"] <= schedule["value"] * (1 + 1e-9)
    assert schedule["gap"] <= 0.002


@pytest.mark.parametrize("measure", ["actuator_speed", "actuator_power"])
def test_speeds_and_powers_equal_those_of_the_inverse_jacobian(tmp_path: Path, measure: str) -> None:
    tables = '[[load]]\nname = "weight"\nforce = [0, 3, -20]\n\n[motion]\nlinear = 2\nangular = 3\n'
    problem = schedule_problem(load_case(str(_written(tmp_path, *_minimised(measure, "worst", tables), count=12))))
    turns = np.linspace(-0.4, 0.5, len(problem.points))
    found = -problem.combined(problem.at(np.zeros(0), turns[:, None]).objective)
    for value, p, R, s in zip(found, problem.points.positions, problem.points.rotations, turns, strict=True):
        J = _jacobian(p, R, s)
        speeds = 2 * np.linalg.norm(J[:, 3:], axis=1) + (3 * _DEGREE) * np.linalg.norm(J[:, :3], axis=1)
        forces = np.linalg.solve(J.T, [0, 0, 0, 0, -3, 20])
        expected = speeds if measure == "actuator_speed" else speeds * np.abs(forces)
        assert value == pytest.approx(expected.max(), rel=1e-9)


@pytest.mark.soak
def test_mean_longest_strut_is_below_that_of_the_shortest_worst_one(tmp_path: Path) -> None:
    means = []
    for over in ("mean", "worst"):
        changes = [_NO_TASK, ('as = "mean"', f'as = "{over}"\nminimise = "leg_length"'), ("max = 43", "max = 60")]
        schedule = solve(load_case(str(_written(tmp_path, *changes, count=60, lean=40)))).schedule
        assert schedule is not None
        rows = zip(schedule.poses.positions, schedule.poses.rotations, schedule.values[:, 0] * _DEGREE, strict=True)
        longest = np.array([np.linalg.norm(_struts_at(*row)[1], axis=1).max() for row in rows])
        np.testing.assert_allclose(schedule.F, longest, rtol=1e-9)
        means.append(longest.mean())
    assert means[0] < means[1] + 1e-6


_RADIUS = 'x1 = { min = 18, max = 34, per = "path", rate = 0.5 }'


@pytest.mark.soak
def test_two_settings_are_better_than_each_alone(tmp_path: Path) -> None:
    both = solve(load_case(str(_written(tmp_path, ("x1 = 26.5", _RADIUS), count=50)))).schedule
    assert both is not None
    assert both.constant is not None
    assert both.constant.value == pytest.approx(1.867333, abs=1e-5)
    assert both.value == pytest.approx(1.991367, abs=2e-4)
    assert both.names == ("x1", "turn")
    seconds = np.diff(both.times)
    assert (np.abs(np.diff(both.values, axis=0)) <= seconds[:, None] * [0.5, 5] * (1 + 1e-12)).all()
    # Both settings move.
    assert (np.ptp(both.values, axis=0) > [1.0, 5.0]).all()
    radius, turn = both.constant.values.tolist()
    yaw = solve(load_case(str(_written(tmp_path, ("x1 = 26.5", f"x1 = {radius!r}"), count=50)))).schedule
    fixed = [("x1 = 26.5", _RADIUS), ("{ min = -75, max = 75, rate = 5 }", f"{turn!r}")]
    rails = solve(load_case(str(_written(tmp_path, *fixed, count=50)))).schedule
    for alone in (yaw, rails):
        assert alone is not None
        assert both.constant.value - 1e-6 <= alone.value < both.value - 0.01


@pytest.mark.parametrize(("count", "fine"), [(50, True), (200, True), (200, False), (600, False)])
def test_grid_never_freezes_a_slow_setting(tmp_path: Path, count: int, fine: bool) -> None:
    for rate in (0.5, 0.02):
        slow = _RADIUS.replace("rate = 0.5", f"rate = {rate}")
        problem = schedule_problem(load_case(str(_written(tmp_path, ("x1 = 26.5", slow), count=count))))
        held = np.tile([26.5, 0.0], (len(problem.points), 1))
        grid = grid_of(problem, np.zeros(0), held, 0, fine)
        assert (grid.reach >= 1).mean() > 0.9

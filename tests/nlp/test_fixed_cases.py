"""Cases that leave nothing free, or fewer numbers than equations; working modes of optima; poses free one by one."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, case_file, case_of, case_tables, starter, turn_about
from measures import circle_joints
from typer.testing import CliRunner

from screwsynth.models import Model, robot_function
from screwsynth.nlp import Case, Free, Rotation, Status, Task, formulate, json_data, result_of, solve
from screwsynth.nlp.cli.app import app
from screwsynth.nlp.evidence.assembly import assembly_over_poses
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.linalg import least_squares, nonnegative_least_squares
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.evidence.workingmode import turned_over_poses
from screwsynth.nlp.program.blocks import Blocks
from screwsynth.nlp.results.wording import starts_lines

TASK = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))


def typical(model: Model) -> dict[str, float]:
    return {item.name: item.typical[0] for item in model.parameters}


@pytest.mark.parametrize("name", ["3-rps", "delta", "3-upu", "planar-3-rrr"])
def test_a_case_that_leaves_nothing_free_is_evaluated_once(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function(name)()
    solution = solve(Case(model, typical(model), model.home, [TASK]))
    assert solution.status is Status.EVALUATED
    assert solution.starts == ()
    assert solution.evidence is None
    assert loops_are_closed(solution.nlp, solution.x)
    np.testing.assert_allclose(solution.x, 0, atol=1e-9)  # all joints are at home
    data = json_data(result_of(solution))
    assert (data["status"], data["optimality"]) == ("evaluated", None)
    # A pose that the robot cannot take: no numbers are left to choose, and no solver is asked.
    if name in ("delta", "3-upu"):
        refused = solve(Case(model, typical(model), model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
        assert refused.status is Status.INFEASIBLE
        assert refused.starts == ()
    assert capfd.readouterr().err == ""


def test_more_equations_than_variables_need_no_solver(capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function("delta")()
    values = typical(model) | {"rb": Free(0.12, 0.2)}
    nlp = formulate(Case(model, values, model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
    assert nlp.is_overdetermined
    assert not nlp.is_fixed
    solution = solve(nlp.case, starts=3)
    assert solution.status is Status.INFEASIBLE
    assert capfd.readouterr().err == ""


def test_the_command_says_evaluated(tmp_path: Path) -> None:
    values = typical(robot_function("3-rps")())
    task = {"name": "t", "sense": "max", "axis": [0, 1, 2], "point": [0, 0, 0], "pitch": 2}
    robot = {"model": "3-rps", "parameters": values}
    case = case_file(tmp_path, case_tables(robot, pose={"position": [0, 0, values["h"]]}, task=[task]))
    result = CliRunner().invoke(app, ["solve", str(case)])
    assert result.exit_code == 0
    assert "fixed point: F = " in result.output
    assert "(evaluated)" in result.output
    assert "converged" not in result.output


def free_case(name: str, reach: float) -> Case:
    model = robot_function(name)()
    position = [Free(value - reach, value + reach) for value in model.home]
    return Case(model, typical(model), position, [TASK], Rotation(None, Free(-0.3, 0.3)))


def test_each_limb_bent_the_other_way_is_another_working_mode() -> None:
    nlp = formulate(free_case("6-rus", 0.2))
    (own,) = nlp.program.places.unknowns
    rng = np.random.default_rng(4)
    for limb in range(6):
        x = np.array(nlp.start)
        x[:3] += rng.uniform(-0.05, 0.05, 3)
        near = close_equations(nlp, x)
        assert turned_over_poses(nlp, near) == ((),)
        far = near.copy()
        far[own[limb]] += math.radians(110)
        far = close_equations(nlp, far)
        assert np.abs(far - near)[own[limb]] > 0.3
        assert turned_over_poses(nlp, far) == ((str(limb + 1),),)
        found = assembly_over_poses(nlp, far)
        assert found.turned == (str(limb + 1),)
        assert found.brief == f"another working mode (limb {limb + 1})"


def test_planar_limbs_bent_the_other_way_are_found_too() -> None:
    # Their wrenches are members without smooth directions, so the sense is that of a determinant of screws.
    model = robot_function("planar-3-rrr")()
    nlp = formulate(Case(model, typical(model), [Free(-0.2, 0.2), Free(-0.2, 0.2), 0.0], [TASK]))
    (own,) = nlp.program.places.unknowns
    closed = close_equations(nlp, nlp.start)
    found = set()
    for k in range(len(own)):
        for way in (-2.0, 2.0):
            x = closed.copy()
            x[own[k]] += way
            x = close_equations(nlp, x)
            if loops_are_closed(nlp, x) and np.abs(x - closed)[list(own)].max() > 0.5:
                (turned,) = turned_over_poses(nlp, x)
                judged = assembly_over_poses(nlp, x)
                assert judged.turned == turned
                found.add(turned)
    assert {("1",), ("2",), ("3",)} <= found


def test_every_distinct_optimum_says_its_working_mode() -> None:
    solution = solve(starter("6-rus"), starts=16)
    own = solution.outcomes[0].own
    brief = [found.assembly.brief for found in own.optima if found.assembly is not None]
    assert len(brief) == len(own.optima) > 1
    assert len({found.x.tobytes() for found in own.optima}) == len(own.optima)
    for found in own.optima:
        assert found.assembly.is_home == (turned_over_poses(own.nlp, found.x) == ((),))
    assert any(words.startswith("another working mode (limb") for words in brief)
    data = result_of(solution).starts
    assert [each.assembly for each in data.optima] == brief
    lines = [line.text for line in starts_lines(data)]
    assert sum("in another working mode (limb" in line for line in lines) == sum(map(bool, brief[:5]))


SHORTEST, LONGEST = 17.0, 43.0


def displacement(at: float) -> tuple[Array, Array]:
    """A tilt of 30 degrees and a place on a circle, by an angle."""
    tilt = turn_about((-math.sin(at), math.cos(at), 0), math.radians(30))
    return tilt, np.array([4 + 5 * math.cos(at), 3 + 5 * math.sin(at), 20])


def circling(count: int, over_poses: str, starts: int, x1: object = 26.5, **search: object) -> Case:
    """A hexapod that pushes along x at poses on a circle, each of which may turn about the platform's axis."""
    turn, poses = {"axis": [0, 0, 1], "angle": {"min": -75, "max": 75}}, list[dict[str, Any]]()
    for at in np.linspace(0, 2 * math.pi, count):
        tilt, place = displacement(at)
        step = {"rotation": tilt.tolist(), "translation": place.tolist()}
        poses.append({"position": [0, 0, 0], "rotation": turn, "displacements": [step]})
    parameters = {"x1": x1, "x2": 11.543, "x3": 0, "x4": 5}
    return case_of(
        {"model": "stewart-gough", "layout": "octahedral", "parameters": parameters},
        units={"length": "in"},
        pose=poses,
        task=[{"sense": "max", "axis": [1, 0, 0], "pitch": math.inf}],
        combine={"over_poses": over_poses} if count > 1 else None,
        limits={"leg_length": {"min": SHORTEST, "max": LONGEST}},
        solve={"starts": starts, **search},
    )


def values_at(at: float, angles: Array) -> Array:
    """F of a pose at angles; minus infinity where a leg is outside of its limits."""
    base, platform = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})
    tilt, place = displacement(at)
    turns = np.array([turn_about((0, 0, 1), each) for each in angles])
    legs = place + platform @ np.swapaxes(tilt @ turns, 1, 2) - base
    lengths = np.linalg.norm(legs, axis=2)
    kept = (lengths.min(axis=1) >= SHORTEST) & (lengths.max(axis=1) <= LONGEST)
    return np.asarray(np.where(kept, ((legs[:, :, 0] / lengths) ** 2).sum(axis=1), -np.inf))


@cache
def best_at(at: float) -> float:
    """The largest F of a pose within the limits on the legs, over its angle: on a grid, and on two finer ones in it."""
    angles = np.radians(np.linspace(-75, 75, 601))
    for _ in range(3):
        values = values_at(at, angles)
        best, step = angles[int(values.argmax())], angles[1] - angles[0]
        angles = np.clip(best + step * np.linspace(-1, 1, 101), math.radians(-75), math.radians(75))
    return float(values.max())


@pytest.mark.parametrize(
    ("count", "over_poses", "starts"), [(20, "mean", 32), (80, "mean", 8), (20, "worst", 32), (7, "sum", 16)]
)
def test_many_poses_reach_the_best_of_each_by_itself(count: int, over_poses: str, starts: int) -> None:
    each = np.array([best_at(at) for at in np.linspace(0, 2 * math.pi, count)])
    best = {"mean": each.mean(), "worst": each.min(), "sum": each.sum()}[over_poses]
    found = solve(circling(count, over_poses, starts))
    assert found.status is Status.OPTIMAL
    # The grid is coarse by a little, and never better.
    assert best * (1 - 1e-9) <= found.F <= best * (1 + 1e-5)
    assert found.evidence is not None
    assert found.evidence.feasibility <= 1e-9
    assert found.evidence.stationarity <= 1e-7


def test_blocks_are_the_poses_whose_best_parts_are_put_together() -> None:
    each = np.array([best_at(at) for at in np.linspace(0, 2 * math.pi, 8)])
    found = solve(circling(8, "mean", 12, screen=False))
    assert found.status is Status.OPTIMAL
    assert each.mean() * (1 - 1e-9) <= found.F <= each.mean() * (1 + 1e-5)
    blocks = Blocks(formulate(circling(6, "mean", 2))).blocks
    assert [each.variables for each in blocks] == [(k,) for k in range(6)]
    assert [each.terms for each in blocks] == [(k,) for k in range(6)]
    assert sorted(k for each in blocks for k in each.constraints) == list(range(36))
    levels = Blocks(formulate(circling(6, "worst", 2))).blocks
    assert [each.variables for each in levels] == [(k,) for k in range(6)]
    assert Blocks(formulate(circling(6, "mean", 2, x1={"min": 20, "max": 30}))).blocks == ()
    assert Blocks(formulate(circling(1, "mean", 2))).blocks == ()


def test_least_squares_by_blocks_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(1)
    A = np.zeros((200, 150))
    for k in range(50):
        rows, columns = slice(4 * k, 4 * k + 4), slice(3 * k, 3 * k + 3)
        A[rows, columns] = rng.normal(size=(4, 3)) @ np.diag([1, 1, k % 2])  # of rank 2 and 3
    rows, columns = rng.permutation(200), rng.permutation(150)
    A, b = A[rows][:, columns], rng.normal(size=200)
    np.testing.assert_allclose(least_squares(A, b), np.linalg.lstsq(A, b, rcond=None)[0], atol=1e-10)
    y = nonnegative_least_squares(A, b)
    drive = A.T @ (b - A @ y)
    assert y.min() >= 0
    assert drive.max() <= 1e-9
    assert np.abs(drive * y).max() <= 1e-9

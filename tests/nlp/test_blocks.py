"""Poses of a fixed robot that are free one by one: the best of all together is that of each by itself.

F and leg lengths of each pose are measured from the joints alone, at some 800 angles.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from builders import Array, case_from, turn_about
from measures import circle_joints

from screwsynth.nlp import Case, solve
from screwsynth.nlp.evidence.linalg import least_squares, nonnegative_least_squares
from screwsynth.nlp.program.blocks import Blocks
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.solver.status import Status

SHORTEST, LONGEST = 17.0, 43.0


def displacement(at: float) -> tuple[Array, Array]:
    """A tilt of 30 degrees and a place on a circle, by an angle."""
    tilt = turn_about((-math.sin(at), math.cos(at), 0), math.radians(30))
    return tilt, np.array([4 + 5 * math.cos(at), 3 + 5 * math.sin(at), 20])


def case_of(count: int, over_poses: str, starts: int, x1: object = 26.5, **search: object) -> Case:
    """A hexapod that pushes along x at poses on a circle, each of which may turn about the platform's axis."""
    angle = {"min": -75, "max": 75}
    poses: list[dict[str, Any]] = []
    for at in np.linspace(0, 2 * math.pi, count):
        tilt, place = displacement(at)
        step = {"rotation": tilt.tolist(), "translation": place.tolist()}
        turn = {"axis": [0, 0, 1], "angle": angle}
        poses.append({"position": [0, 0, 0], "rotation": turn, "displacements": [step]})
    return case_from(
        {
            "units": {"length": "in"},
            "robot": {
                "model": "stewart-gough",
                "layout": "octahedral",
                "parameters": {"x1": x1, "x2": 11.543, "x3": 0, "x4": 5},
            },
            "pose": poses,
            "task": [{"sense": "max", "axis": [1, 0, 0], "pitch": math.inf}],
            **({"combine": {"over_poses": over_poses}} if count > 1 else {}),
            "limits": {"leg_length": {"min": SHORTEST, "max": LONGEST}},
            "solve": {"starts": starts, **search},
        }
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
    found = solve(case_of(count, over_poses, starts))
    assert found.status is Status.OPTIMAL
    # The grid is coarse by a little, and never better.
    assert best * (1 - 1e-9) <= found.F <= best * (1 + 1e-5)
    assert found.evidence is not None
    assert found.evidence.feasibility <= 1e-9
    assert found.evidence.stationarity <= 1e-7


def test_without_the_quick_search_the_best_parts_of_all_ends_are_put_together() -> None:
    each = np.array([best_at(at) for at in np.linspace(0, 2 * math.pi, 8)])
    found = solve(case_of(8, "mean", 12, screen=False))
    assert found.status is Status.OPTIMAL
    assert each.mean() * (1 - 1e-9) <= found.F <= each.mean() * (1 + 1e-5)


def test_blocks_are_the_poses_unless_dimensions_are_free() -> None:
    blocks = Blocks(formulate(case_of(6, "mean", 2))).blocks
    assert [each.variables for each in blocks] == [(k,) for k in range(6)]
    assert [each.terms for each in blocks] == [(k,) for k in range(6)]
    assert sorted(k for each in blocks for k in each.constraints) == list(range(36))
    levels = Blocks(formulate(case_of(6, "worst", 2))).blocks
    assert [each.variables for each in levels] == [(k,) for k in range(6)]
    assert Blocks(formulate(case_of(6, "mean", 2, x1={"min": 20, "max": 30}))).blocks == ()
    assert Blocks(formulate(case_of(1, "mean", 2))).blocks == ()


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

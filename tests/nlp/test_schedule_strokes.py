"""Strokes along a path: the longest minus the shortest length of a leg over all points of a schedule."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from builders import Run
from test_schedule_measures import _struts_at
from test_schedules import _DEGREE, _written

from screwsynth.models import FloatArray
from screwsynth.nlp import load_case, solve
from screwsynth.nlp.solver.scheduled import Schedule

_FREE = ("max = 43", "max = 60")


def _lengths(schedule: Schedule) -> FloatArray:
    """Return the lengths (N, 6) of the struts at the points of a schedule, by kinematics of the tests."""
    rows = zip(schedule.poses.positions, schedule.poses.rotations, schedule.values[:, 0] * _DEGREE, strict=True)
    return np.array([np.linalg.norm(_struts_at(*row)[1], axis=1) for row in rows])


def test_a_schedule_keeps_a_stroke_and_a_dead_length(tmp_path: Path) -> None:
    free = solve(load_case(str(_written(tmp_path, _FREE, count=20)))).schedule
    assert free is not None
    lengths = _lengths(free)
    strokes = np.ptp(lengths, axis=0)
    most = float(strokes.max()) - 0.5
    stated = ("[limits]", f"[limits]\nactuator = {{ stroke_max = {most!r} }}")
    kept = solve(load_case(str(_written(tmp_path, _FREE, stated, count=20))), gap=0.05).schedule
    assert kept is not None
    reached = float(np.ptp(_lengths(kept), axis=0).max())
    # The stroke of the best schedule without the limit is larger, so the limit is reached and costs F.
    assert most * (1 - 1e-3) <= reached <= most * (1 + 1e-6)
    assert kept.value < free.value - 1e-6
    # The bound is also one of schedules with larger strokes.
    assert kept.bound is not None
    assert kept.bound >= free.value - 1e-9
    dead = float((2 * lengths.min(axis=0) - lengths.max(axis=0)).min()) + 0.4
    stated = ("[limits]", f"[limits]\nactuator = {{ dead_length = {dead!r} }}")
    long = solve(load_case(str(_written(tmp_path, _FREE, stated, count=20)))).schedule
    assert long is not None
    lengths = _lengths(long)
    margin = float((2 * lengths.min(axis=0) - lengths.max(axis=0)).min()) - dead
    assert margin >= -1e-6 * dead
    assert long.value < free.value - 1e-6


def test_a_stroke_is_proved_along_the_whole_path(tmp_path: Path) -> None:
    # A stroke that is exactly reached at the points cannot be proved, so the schedule keeps a margin.
    whole = ("[limits]", '[limits]\nover = "path"\nactuator = { stroke_max = 14.2 }')
    found = solve(load_case(str(_written(tmp_path, _FREE, whole, count=8)))).schedule
    assert found is not None
    assert found.judgement is not None
    assert found.judgement.is_proved
    assert np.ptp(_lengths(found), axis=0).max() <= 14.2


def test_a_stroke_that_no_schedule_keeps_is_not_converged(tmp_path: Path, cli: Run) -> None:
    stated = ("[limits]", "[limits]\nactuator = { stroke_max = 0.5 }")
    table = tmp_path / "s.csv"
    code, out, err = cli("solve", str(_written(tmp_path, _FREE, stated, count=8)), "--schedule", str(table))
    assert (code, err) == (1, "")
    assert "no schedule found" in out
    assert not table.exists()

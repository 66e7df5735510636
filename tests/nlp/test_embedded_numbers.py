"""Generated C with other fixed numbers than the case's own, judged by formulas that are not the program's."""

from __future__ import annotations

import importlib
import itertools
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from builders import case_from, starter_tables
from generated import COMPILERS, INFEASIBLE, OK, written

from screwsynth.nlp import CompiledCase, formulate, load_compiled
from screwsynth.nlp.embedding.runtimelimits import held_by_fixed_numbers

BENCH = Path(__file__).parents[2] / "bench" / "soak"

PLATE = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 0.2, x2 = { min = 0.05, max = 0.15 }, x3 = 10, x4 = { min = 3, max = 27 } }
[pose]
position = [0, 0, { min = 0.25, max = 0.4 }]
[[task]]
name = "turn"
sense = "max"
axis = [0, 1, 0]
point = [0, 0, 0.22]
pitch = 0
[limits]
joint_spacing = { min = 0.04 }
"""


def delta_tables() -> dict[str, Any]:
    """A Delta whose platform is held without rotation: three of its loop equations follow from the others."""
    tables = starter_tables("delta")
    tables["pose"]["rotation"] = {"axis": [0, 0, 1], "angle": 0}
    tables["solve"]["starts"] = 2
    return tables


def compiled(tables: dict[str, Any], name: str, folder: Path) -> CompiledCase:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")
    return load_compiled(written(case_from(tables, name), folder))


def numbers(own: CompiledCase, **changed: float) -> np.ndarray:
    """The case's fixed numbers, some of them changed."""
    values = {each.name: each.default for each in own.parameters}
    assert changed.keys() <= values.keys()
    return np.array(list((values | changed).values()))


def test_loops_that_closed_by_a_fixed_number_are_judged(tmp_path: Path) -> None:
    sys.path.append(str(BENCH))
    formulas: ModuleType = importlib.import_module("formulas")
    own = compiled(delta_tables(), "delta", tmp_path)
    names = [each.name for each in own.variables]

    def gap(x: np.ndarray, p: np.ndarray) -> float:
        """Largest difference of a rod's length between its joints from its own, by the positions of the joints."""
        at = dict(zip(names, x.reshape(-1, 1), strict=True))
        at |= dict(zip([each.name for each in own.parameters], p.reshape(-1, 1), strict=True))
        return float(np.abs(formulas.delta(at).equations).max())

    for angle in (0.0, 1e-4, 0.1):
        p = numbers(own, angle=angle)
        for seeds in (1, 16):
            found = own.solve(None, p, seeds=seeds)
            assert (gap(found.x[0], p) < 1e-8) == (found.status[0] == OK), angle
            assert (found.violation[0] <= 1e-9) == (found.status[0] == OK)
            assert found.status[0] == (OK if angle == 0 else INFEASIBLE)
    # All starting points of the case's own numbers still end at an optimum.
    low, high = (np.array([getattr(each, end) for each in own.variables]) for end in ("lower", "upper"))
    starts = low + (high - low) * np.random.default_rng(0).uniform(size=(300, len(low)))
    assert set(own.solve(starts, numbers(own), seeds=2).status.tolist()) == {OK}
    # An axis that is no direction gives no rotation.
    assert own.solve(None, numbers(own, axis_z=2.0)).status[0] == INFEASIBLE


def test_limits_on_fixed_numbers_are_judged(tmp_path: Path) -> None:
    own = compiled(tomllib.loads(PLATE), "plate", tmp_path)

    def spacing(x1: float, x3: float) -> float:
        """Least distance of the base's joints: at angles x3 beside three directions on a circle of radius x1."""
        angles = np.radians(np.array([0, 120, 240])[:, None] + np.array([-x3, x3])).ravel()
        return min(2 * x1 * abs(np.sin((a - b) / 2)) for a, b in itertools.combinations(angles, 2))

    for x1, x3 in ((0.2, 10.0), (0.2, 5.0), (0.2, 5.75), (0.1, 10.0), (0.3, 5.0)):
        # In C an angle is in radians.
        p = numbers(own, x1=x1, x3=np.radians(x3))
        for least in (None, 0.045, 0.06, 0.1):
            limit = 0.04 if least is None else least
            found = own.solve(None, p, limits={} if least is None else {"joint_spacing.min": least})
            assert found.status[0] == (OK if spacing(x1, x3) >= limit else INFEASIBLE), (x1, x3, least)


def test_pairs_of_fixed_lengths_are_judged(tmp_path: Path) -> None:
    # Leg 1 alone is free. Of each other leg's 12 pairs of lengths, the tightest one of the case stands for all.
    tables = starter_tables("hexapod")
    heights = {"pose1_p_z": 35.0, "pose2_p_z": 36.0, "pose3_p_z": 37.0, "pose4_p_z": 38.0}
    tables["pose"] = [{"position": [0, 0, height]} for height in heights.values()]
    tables |= {"limits": {"actuator": {"stroke_max": 3.5}}, "combine": {"over_poses": "mean"}, "solve": {"starts": 2}}
    own = compiled(tables, "strokes", tmp_path)
    given = tables["robot"]["parameters"]

    def stroke(leg: int, **changed: float) -> float:
        """Longest less shortest length of a leg."""
        across = np.subtract(given[f"platform_{leg}"], given[f"base_{leg}"])
        lengths = [np.hypot(np.hypot(*across[:2]), across[2] + z) for z in (heights | changed).values()]
        return float(max(lengths) - min(lengths))

    verdicts = []
    one = [{"pose2_p_z": 39.5}, {"pose2_p_z": 38.4}, {"pose3_p_z": 34.9}, {"pose3_p_z": 34.0}]
    for changed in ({}, *one, {"pose1_p_z": 33.0, "pose4_p_z": 36.3}):
        for limit in (3.0, 3.5, 4.0, 5.0):
            found = own.solve(None, numbers(own, **changed), limits={"actuator.stroke_max": limit})
            verdicts.append(max(stroke(leg, **changed) for leg in range(2, 7)) <= limit)
            assert found.status[0] == (OK if verdicts[-1] else INFEASIBLE), (changed, limit)
    assert 5 < sum(verdicts) < len(verdicts) - 5


def test_what_fixed_numbers_make_hold_is_kept() -> None:
    nlp = formulate(case_from(delta_tables(), "delta"))
    held = held_by_fixed_numbers(nlp)
    loops = [each.name for each in nlp.program.constraints if each.name.startswith("loop")]
    found = [each.constraint.name for each in held.items]
    every = [each.name for each in nlp.case.model.closure]
    assert sorted([*loops, *found[: held.equations]]) == sorted(every)
    assert found[held.equations :] == ["|axis|"]

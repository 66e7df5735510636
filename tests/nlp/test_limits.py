"""Limits: what they measure, that they hold, and what they cost, each by an independent route; and their registry."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_file, case_from, case_tables, saved, starter_tables, turn_about
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st
from measures import leg_measures, placed_joints, segment_distance

from screwsynth.models import Model, hexapod, robot_function, stewart_gough, three_upu
from screwsynth.nlp import Case, Free, LegLength, Limits, Relations, Solution, Status, Task, json_data, result_of, solve
from screwsynth.nlp.case.limits.clearance import LegClearance, squared_distance
from screwsynth.nlp.case.limits.constraint import LENGTH, BoundedConstraint, between
from screwsynth.nlp.case.limits.interval import IntervalLimit, QuantityLimit
from screwsynth.nlp.case.limits.joints import BaseJointAngle
from screwsynth.nlp.case.limits.limit import PosedRobot
from screwsynth.nlp.case.limits.plates import JointSpacing
from screwsynth.nlp.case.limits.registry import LIMIT_TYPES
from screwsynth.nlp.case.limits.singular_values import largest_eigenvalue, smallest_eigenvalue
from screwsynth.nlp.case.schema import Document
from screwsynth.nlp.case.settings import Search
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.solver.compromise import solution_of_one_task
from screwsynth.nlp.solver.multistart import solve_program
from screwsynth.nlp.solver.starts import StartStatus
from screwsynth.nlp.starter.text import starter_case

HEXAPOD: dict[str, Any] = case_tables(
    {"model": "stewart-gough", "layout": "octahedral", "parameters": {
        "x1": {"min": 8, "max": 16}, "x2": {"min": 4, "max": 9}, **{x: {"min": 2, "max": 28} for x in ("x3", "x4")},
    }},
    units={"length": "cm"},
    pose={
        "position": [{"min": -10, "max": 10}, {"min": -10, "max": 10}, {"min": 20, "max": 50}],
        "rotation": {"angle": {"min": -30, "max": 30}},
    },
    task=[{"sense": "max", "axis": [2, 2, 1], "point": [2, 3, 6], "pitch": 1}],
)  # fmt: skip

#: Sets of limits, each with some that are active at the optimum.
SETS: dict[str, dict[str, Any]] = {
    "legs": {"leg_length": {"min": 25, "max": 40}},
    "cones": {"base_joint_angle": 12, "platform_joint_angle": {"max": 9, "about": "normal"}},
    "cones-about-axes": {"base_joint_angle": {"max": 20, "about": [0.2, 0, 1]}},
    "cones-about-home": {
        "platform_joint_angle": {"max": 14, "about": "home"},
        "home": {"position": [0, 0, 30], "angle": 5},
    },
    "plates": {"joint_spacing": {"min": 7}, "footprint": {"base": 13, "platform": 8}, "leg_length": {"max": 45}},
    "ratio": {"radius_ratio": {"max": 0.5}, "leg_length": {"max": 45}},
    "clearance": {"leg_clearance": {"min": 8}, "leg_length": {"max": 45}},
    "condition": {"condition_number": {"max": 10, "length": 8}},
    "singular-value": {"smallest_singular_value": {"min": 0.21, "length": 8}},
    "shares": {"rate_share": {"max": 0.3}},
    "custom": {"custom": ["x1 - 2*x2 >= 0", "cos(x3) <= 0.95"]},
    "actuator": {"actuator": {"dead_length": 24, "stroke_max": 20}, "leg_length": {"max": 38}},
}


def case_with(limits: dict[str, Any], tables: Mapping[str, Any] = HEXAPOD, **values: object) -> Case:
    """The hexapod, or another case, with limits, and with some parameters in the place of their ranges."""
    robot = {**tables["robot"], "parameters": tables["robot"]["parameters"] | values}
    return case_from({**tables, "robot": robot, "limits": limits}, "hexapod")


def solved(case: Case, *first: Array, starts: int = 4) -> Solution:
    search = Search(starts=1 if first else starts)
    return solution_of_one_task(case, solve_program(formulate(case), search, first=first))


def measured(result: dict[str, Any], limits: dict[str, Any], home: dict[str, Any] | None = None) -> dict[str, float]:
    """What each limit measures at its worst place, by NumPy alone."""
    b, a, _ = placed_joints(result)
    R, p = np.array(result["pose"]["rotation_matrix"]), np.array(result["pose"]["position"])
    J = np.array(result["jacobian"])
    J = np.hstack([J[:, :3], (J[:, 3:] - np.cross(p, J[:, :3])) / 8])
    values = np.linalg.svd(J, compute_uv=False)
    rates = np.array(result["rates"])
    axes = {"base_joint_angle": np.tile([0.0, 0, 1], (6, 1)), "platform_joint_angle": np.tile(R[:, 2], (6, 1))}
    about = limits.get("base_joint_angle")
    if isinstance(about, dict) and isinstance(about["about"], list):
        axes["base_joint_angle"] = np.tile(about["about"], (6, 1))
    if home is not None:
        R0 = turn_about([0, 0, 1], math.radians(home["angle"]))
        axes["platform_joint_angle"] = (np.array(home["position"]) + a @ R0.T - b) @ R0 @ R.T
    x, legs = result["parameters"], leg_measures(b, a, R, p, *axes.values())
    return legs | {
        **{key: math.degrees(legs[key]) for key in ("base_joint_angle.max", "platform_joint_angle.max")},
        "actuator.dead_length": legs["leg_length.min"],
        "radius_ratio.max": math.sqrt((a[:, :2] ** 2).sum() / (b[:, :2] ** 2).sum()),
        "condition_number.max": values[0] / values[-1],
        "smallest_singular_value.min": values[-1],
        "rate_share.max": (rates**2).max() / (rates**2).sum(),
        "custom[0]": x["x1"] - 2 * x["x2"],
        "custom[1]": math.cos(math.radians(x["x3"])) - 0.95,
    }


@pytest.mark.parametrize("name", SETS)
def test_limits_hold_have_the_margins_that_numpy_measures_and_cost_what_moving_them_does(name: str) -> None:
    limits = SETS[name]
    solution = solved(case_with(limits))
    assert solution.status is Status.OPTIMAL
    result = json_data(result_of(solution))
    found = measured(result, limits, limits.get("home"))
    assert result["limits"]
    assert any(row["active"] for row in result["margins"])
    assert len({row["name"] for row in result["margins"]}) * 2 >= len(result["margins"])
    for row in result["limits"]:
        key = row["key"]
        # Grid refinement of a distance is good to a few parts in 1e9.
        assert row["value"] == pytest.approx(found[key], rel=1e-7, abs=1e-8), row
        assert row["margin"] >= -1e-8, row
        if not row["active"] or key.startswith("custom"):
            continue
        step, ends = 1e-4 * max(1.0, abs(row["limit"])), []
        for moved in (row["limit"] - step, row["limit"] + step):
            again = solved(case_with(with_number(limits, key, moved)), solution.x)
            assert again.status is Status.OPTIMAL
            ends.append(again.F)
        difference = (ends[1] - ends[0]) / (2 * step)
        assert row["cost"] == pytest.approx(difference, rel=0.01, abs=1e-6 * solution.F), key


def with_number(limits: dict[str, Any], key: str, number: float) -> dict[str, Any]:
    """The limits with one number of theirs changed."""
    name, _, side = key.partition(".")
    return limits | {name: limits[name] | {side: number} if isinstance(limits[name], dict) else number}


@pytest.mark.parametrize(
    ("relation", "limits"), [("x1 - 2*x2 >= {}", {}), ("x1 - 2*x2 == {}", {"leg_length": {"max": 45}})]
)
def test_a_custom_relation_costs_what_moving_its_right_hand_side_does(relation: str, limits: dict[str, Any]) -> None:
    def case_at(value: float) -> Case:
        return case_with({"custom": [relation.format(value)], **limits})

    solution = solved(case_at(0))
    row = next(row for row in json_data(result_of(solution))["margins"] if row["key"] == "custom[0]")
    assert row["bound"] == ("equal" if "==" in relation else "min")
    assert row["active"]
    ends = [solved(case_at(value), solution.x).F for value in (-1e-3, 1e-3)]
    assert row["cost"] == pytest.approx((ends[1] - ends[0]) / 2e-3, rel=0.01)
    assert "==" in relation or row["cost"] < 0


def test_what_cannot_hold_says_by_how_much_and_what_is_fixed_and_holds_costs_nothing() -> None:
    apart = solved(case_with({"custom": ["x1 == 5*x2"]}))
    assert apart.status is Status.INFEASIBLE
    # x1 is at most 16 and x2 at least 4: 4 short.
    assert [(row.key, round(abs(row.needed), 4)) for row in apart.relaxation] == [("custom[0]", 4.0)]
    fixed = {"x1": 12, "x2": 8, "x3": 20, "x4": 8}
    tables = HEXAPOD | {"pose": {"position": [0, 0, 35]}}
    assert solved(case_with({"leg_length": {"max": 45}}, tables, **fixed)).status is Status.EVALUATED
    solution = solved(case_with({"leg_length": {"max": 30}}, tables, **fixed))
    assert solution.status is Status.INFEASIBLE
    longest = solution.state.quantities["leg_length"].max()
    needed = [(row.key, row.needed) for row in solution.relaxation]
    assert needed == [("leg_length.max", pytest.approx(longest, rel=1e-6))]
    plates, limits = {"x1": 12, "x3": 20}, {"footprint": {"base": 13}, "leg_length": {"max": 45}}
    result = json_data(result_of(solved(case_with(limits, **plates))))
    row = next(row for row in result["limits"] if row["key"] == "footprint.base")
    assert (row["cost"], row["active"]) == (0.0, [])
    assert row["margin"] == pytest.approx(1, rel=1e-9)
    solution = solved(case_with(limits | {"footprint": {"base": 11}}, **plates))
    assert solution.status is Status.INFEASIBLE
    assert [(row.key, round(row.needed, 4)) for row in solution.relaxation] == [("footprint.base", 12.0)]


def test_the_same_design_in_radians_costs_the_same_per_radian() -> None:
    degrees = json_data(result_of(solved(case_with({"base_joint_angle": 12}))))
    tables = HEXAPOD | {"units": {"length": "cm", "angle": "rad"}}
    turn = math.radians(30)
    tables["pose"] = HEXAPOD["pose"] | {"rotation": {"angle": {"min": -turn, "max": turn}}}
    half = {"min": math.radians(2), "max": math.radians(28)}
    limits = {"base_joint_angle": math.radians(12)}
    radians = json_data(result_of(solved(case_with(limits, tables, x3=half, x4=half))))
    assert radians["F"] == pytest.approx(degrees["F"], rel=1e-9)
    assert radians["limits"][0]["unit"] == "rad"
    assert radians["limits"][0]["cost"] == pytest.approx(math.degrees(degrees["limits"][0]["cost"]), rel=1e-6)


THREE_UPU: dict[str, Any] = case_tables(
    {"model": "three-upu", "axes": "tsai", "parameters": {
        "base_radius": {"min": 20, "max": 60}, "platform_radius": {"min": 10, "max": 40},
    }},
    pose={"position": [{"min": -10, "max": 10}, {"min": -10, "max": 10}, {"min": 20, "max": 80}]},
    task=[{"sense": "max", "axis": [1, 2, 3], "point": [4, 0, 10], "pitch": 2}],
)  # fmt: skip


def test_a_three_legged_robot_with_couples_keeps_limits_too() -> None:
    limits = {
        "leg_length": {"max": 50}, "base_joint_angle": 40, "radius_ratio": {"min": 0.4}, "joint_spacing": {"min": 20},
        "leg_clearance": {"min": 18}, "rate_share": {"max": 0.6},
        "smallest_singular_value": {"min": 0.015, "length": 30},
    }  # fmt: skip
    result = json_data(result_of(solved(case_with(limits, THREE_UPU), starts=16)))
    assert result["status"] == "optimal"
    radii = {plate: result["parameters"][f"{plate}_radius"] for plate in ("base", "platform")}
    corners = np.array([[math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3), 0] for k in range(3)])
    b, p = radii["base"] * corners, np.array(result["pose"]["position"])
    ends = p + radii["platform"] * corners
    rows = {row["key"]: row for row in result["limits"]}
    assert rows["leg_length.max"]["value"] == pytest.approx(np.linalg.norm(ends - b, axis=1).max(), rel=1e-9)
    assert rows["radius_ratio.min"]["value"] == pytest.approx(radii["platform"] / radii["base"], rel=1e-9)
    assert rows["joint_spacing.min"]["value"] == pytest.approx(math.sqrt(3) * min(radii.values()), rel=1e-9)
    pairs = ((0, 1), (0, 2), (1, 2))
    clearance = min(segment_distance(b[i], ends[i], b[j], ends[j]) for i, j in pairs)
    assert rows["leg_clearance.min"]["value"] == pytest.approx(clearance, rel=1e-7)
    J = np.array(result["jacobian"])
    J[:3, 3:] -= np.cross(p, J[:3, :3])
    J[:, 3:] /= 30
    smallest = np.linalg.svd(J, compute_uv=False)[-1]
    assert rows["smallest_singular_value.min"]["value"] == pytest.approx(smallest, rel=1e-7)
    squares = np.array(result["rates"]).reshape(2, 3) ** 2
    assert rows["rate_share.max"]["value"] == pytest.approx(squares.sum(axis=0).max() / squares.sum(), rel=1e-9)
    assert min(row["margin"] for row in result["margins"]) >= -1e-8


def test_a_robot_without_legs_has_limits_on_its_own_measures_only() -> None:
    model = hexapod()
    bare = replace(model, legs=(), built=())
    parameters = {item.name: item.typical for item in bare.parameters}
    common: dict[str, Any] = {"model": bare, "parameters": parameters, "position": [Free(-9, 9), 0, 35]}
    task = Task.screw("max", axis=[1, 2, 3], point=[0, 0, 9], pitch=1)
    for limit in (LegClearance(1.0), JointSpacing(1.0), BaseJointAngle(1.0)):
        with pytest.raises(
            CaseError, match=r"no such limit for the robot 'hexapod'; allowed: leg_length, base_joint_angle"
        ):
            Case(**common, tasks=[task], limits=Limits(limit))
    refused = r"tolerance\.joint_centre: is not supported for the robot '{}': {}"
    with pytest.raises(CaseError, match=refused.format("hexapod", "its joint centres")):
        Case(**common, tasks=[task], joint_centre_tolerance=0.1)
    by_joints = robot_function("6-ups")()
    values = {item.name: item.typical[0] for item in by_joints.parameters}
    with pytest.raises(CaseError, match=refused.format("6-ups", r"add a \[workspace\]")):
        Case(by_joints, values, by_joints.home, [task], joint_centre_tolerance=0.1)
    for limit in (QuantityLimit("leg_length", max=37.0), LegLength(max=37.0)):
        limited = Case(**common, tasks=[task], limits=Limits(limit))
        solution = solved(limited)
        assert solution.state.quantities["leg_length"].max() == pytest.approx(37, rel=1e-9)


def test_limits_in_python_are_those_of_a_file() -> None:
    written = case_with(
        {
            "custom": ["x1 - 2*x2 >= 0", "cos(x3) <= 0.95"],
            "leg_clearance": {"min": 2},
            "leg_length": {"max": 45},
            "base_joint_angle": {"max": 20, "about": [0, 0, 1]},
        }
    ).limits
    built = Limits(
        Relations("x1 - 2*x2 >= 0", "cos(x3) <= 0.95"),
        BaseJointAngle(math.radians(20), about=((0.0, 0.0, 1.0),)),
        LegClearance(2.0),
        LegLength(max=45.0),
    )
    assert built == written
    assert [limit.name for limit in built] == ["leg_length", "base_joint_angle", "leg_clearance", "custom"]
    assert len(built) == 4
    assert built.of(LegClearance) == LegClearance(2.0)
    assert built.of(JointSpacing) is None
    assert not Limits()
    with pytest.raises(CaseError, match=r"limits\.leg_length: must be given once, got 2"):
        Limits(LegLength(max=45.0), LegLength(min=20.0))


def test_evaluate_shows_margins_and_exits_with_1_outside_of_a_limit(cli: Run, tmp_path: Path) -> None:
    path = case_file(tmp_path, HEXAPOD | {"limits": {"leg_length": {"max": 30}}})
    code, out, _ = cli("evaluate", str(path), "--all")
    assert code == 1
    assert "violated: leg_length limb 1-" in out
    assert "leg_length.max" in out
    code, out, _ = cli("evaluate", str(path), "--set", "p_z=20", "--json", "-")
    result = json.loads(out)
    assert code == (1 if result["violated"] else 0)
    assert {row["cost"] for row in result["margins"]} == {None}


#: (24,) the ends of two segments.
_P = [SX.sym(name, 3) for name in "pdqe"]
_DISTANCE = ca.Function("distance", _P, [squared_distance(*_P), ca.gradient(squared_distance(*_P), ca.vertcat(*_P))])
number = st.floats(-5, 5, allow_nan=False).map(lambda value: round(value, 3))
point = st.tuples(number, number, number).map(np.array)


@settings(max_examples=150, deadline=None)
@given(point, point, point, point, st.sampled_from(["any", "parallel", "crossing", "end-to-end"]))
def test_distance_of_segments_is_that_of_brute_force(p: Array, d: Array, q: Array, e: Array, kind: str) -> None:
    if np.linalg.norm(d) < 0.1 or np.linalg.norm(e) < 0.1:
        return
    if kind == "parallel":
        e = 0.7 * d
    elif kind == "crossing":
        q = p + 0.4 * d - 0.3 * e
    elif kind == "end-to-end":
        q = p + d
    found = math.sqrt(max(float(_DISTANCE(p, d, q, e)[0]), 0.0))
    assert found == pytest.approx(segment_distance(p, p + d, q, q + e), abs=2e-5, rel=1e-7)


def test_gradient_of_the_distance_is_that_of_the_nearest_points() -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        ends = random.normal(size=(4, 3))
        gradient = _DISTANCE(*ends)[1].full().ravel()
        flat, numeric = ends.ravel(), np.zeros(12)
        for i, step in enumerate(1e-6 * np.eye(12)):
            high, low = (float(_DISTANCE(*(flat + s * step).reshape(4, 3))[0]) for s in (1, -1))
            numeric[i] = (high - low) / 2e-6
        np.testing.assert_allclose(gradient, numeric, atol=2e-5)


def test_derivatives_are_finite_for_parallel_legs_that_are_far_apart() -> None:
    aligned = {**HEXAPOD, "robot": HEXAPOD["robot"] | {"layout": "aligned"}}
    nlp = formulate(case_with({"leg_clearance": {"min": 1.0}}, aligned, x2={"min": 4, "max": 16}))
    names = [variable.name for variable in nlp.program.variables]
    x = np.array(nlp.start)
    for name, value in (("x1", 12.0), ("x2", 12.0), ("x3", math.radians(20)), ("x4", math.radians(20))):
        x[names.index(name)] = value
    hessian = nlp.program.kernels.hessian(x, nlp.arguments, 0.0, np.ones(len(nlp.program.constraints)))
    # All six legs are parallel here, the nearest two 8.2 cm apart.
    angle = names.index("q_x")
    hessian[angle : angle + 3, angle : angle + 3] = 0
    np.testing.assert_allclose(hessian, 0, atol=1e-12)


@pytest.mark.parametrize("model", [stewart_gough(), hexapod(), three_upu(axes="tsai")], ids=lambda model: model.name)
def test_a_starter_case_with_its_limits_is_solved_from_every_start(model: Model) -> None:
    case = case_from(starter_case(model))
    assert case.limits.of(LegClearance)
    solution = solved(case, starts=16)
    assert solution.status is Status.OPTIMAL
    assert all(start.status is StartStatus.CONVERGED for start in solution.starts)


_A = SX.sym("A", 6, 6)
_EIGENVALUES = ca.Function("eigenvalues", [_A], [smallest_eigenvalue(_A), largest_eigenvalue(_A)])


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(1e-3, 10), min_size=6, max_size=6), st.integers(0, 1000), st.integers(1, 4))
def test_eigenvalues_are_on_the_safe_side_and_close(values: list[float], seed: int, repeated: int) -> None:
    values = sorted(values)
    values[:repeated] = [values[0]] * repeated
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(6, 6)))[0]
    smallest, largest = (float(each) for each in _EIGENVALUES(Q @ np.diag(values) @ Q.T))
    slack = 1e-9 * values[-1]
    factor = 1.01 * (1 - 6 ** (-1 / 8)) ** 2
    assert values[0] * (1 - factor) - slack <= smallest <= values[0] + slack
    assert values[-1] - slack <= largest <= values[-1] * (1 + 0.3 * factor) + slack
    if values[repeated] > 1.5 * values[0] and repeated == 1:
        assert smallest == pytest.approx(values[0], rel=1e-3)


def test_a_singular_matrix_has_no_eigenvalue_but_nothing_breaks() -> None:
    smallest, largest = (float(each) for each in _EIGENVALUES(np.diag([0.0, 0, 1, 2, 3, 4])))
    assert abs(smallest) < 1e-8
    assert largest == pytest.approx(4, rel=0.02)


ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
KEYS = [key for kind in LIMIT_TYPES for key in kind.fields()]


def test_registry_schema_and_documentation_have_every_limit_and_no_other() -> None:
    table = Document.file_schema()["$defs"]["LimitsTable"]
    assert list(table["properties"]) == ["over", *KEYS]
    assert all(field["description"] for field in table["properties"].values())
    # The measures of robots are the other keys.
    assert table["additionalProperties"] == {"$ref": "#/$defs/IntervalTable"}
    (written, *_) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    assert list(tomllib.loads(written)["limits"]) == KEYS
    named = [kind.key for kind in LIMIT_TYPES if kind.key]
    assert len(set(named)) == len(named) == len(LIMIT_TYPES) - 1
    for kind in LIMIT_TYPES:
        assert kind.__module__.startswith("screwsynth.nlp.case.limits.")
        assert kind.__doc__


@dataclass(frozen=True)
class Height(IntervalLimit):
    """Height of the platform's origin: a limit that is in no registry."""

    key: ClassVar[str] = "height"
    description: ClassVar[str] = "of the platform's origin"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        yield between(f"height{pose.where}", pose.robot.position[2], LENGTH, self.key, lower=self.min, upper=self.max)


def test_a_limit_outside_of_the_registry_limits_a_case_made_in_python() -> None:
    written = case_from(starter_tables(stewart_gough()), "high")
    case = replace(written, limits=Limits(Height(min=36.5), LegLength(max=60.0)))
    assert [limit.name for limit in case.limits] == ["leg_length", "height"]
    solution = solve(case, starts=2)
    assert solution.status is Status.OPTIMAL
    rows = {row.key: row for row in margins_of(solution.nlp, solution.x, optimal=True)}
    assert rows["height.min"].active
    assert rows["height.min"].value == pytest.approx(36.5, rel=1e-9)
    with pytest.raises(CaseError, match=r"limits\.height\.min = 3\.0: must be below max = 2 cm"):
        replace(written, limits=Limits(Height(min=3.0, max=2.0)))


#: A limit is added in a copy of the package, from outside; nothing but its file and the registry changes.
ADDED_LIMIT = """
import json
import tomllib
import screwsynth.nlp
from screwsynth.models import stewart_gough
from screwsynth.nlp import CaseError, Status, case_from_tables, formulate, json_data, result_of, solve
from screwsynth.nlp.case.limits.platform_height import PlatformHeight
from screwsynth.nlp.case.schema import Document
from screwsynth.nlp.starter.text import starter_case

starter = tomllib.loads(starter_case(stewart_gough()))

def case_with(**limits):
    return case_from_tables({**starter, "limits": limits}, name="high", source="high.toml")

def refusal(**limits):
    try:
        case_with(**limits)
    except CaseError as error:
        return str(error)

case = case_with(platform_height={"min": 36.5}, leg_length={"max": 60})
solution = solve(case, starts=4)
moved = solve(case_with(platform_height={"min": 36.51}, leg_length={"max": 60}), starts=4)
contradicting = solve(case_with(platform_height={"min": 80}), starts=1)
wrong = [{"min": 40, "max": 30}, {"min": "high"}, {"min": -1}]
print(json.dumps({
    "file": screwsynth.nlp.__file__,
    "read": case.limits.of(PlatformHeight) == PlatformHeight(min=36.5),
    "refused": [*(refusal(platform_height=each) for each in wrong), refusal(platform_heigth={"min": 3})],
    "constraints": [each.name for each in formulate(case).program.constraints],
    "optimal": solution.status is Status.OPTIMAL,
    "height": float(solution.state.position[2]),
    "limits": json_data(result_of(solution))["limits"],
    "slope": (moved.F - solution.F) / 0.01,
    "relaxed": [[row.key, row.needed] for row in contradicting.relaxation],
    "schema": Document.file_schema()["$defs"]["LimitsTable"]["properties"]["platform_height"],
}))
"""


def test_a_limit_is_added_by_its_file_and_a_row_of_the_registry(tmp_path: Path) -> None:
    package = tmp_path / "screwsynth"
    for name in ("models", "nlp", "cases"):
        shutil.copytree(ROOT / name, package / name, ignore=shutil.ignore_patterns("__pycache__"))
    room = package / "nlp" / "case" / "limits"
    (module,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    saved(room / "platform_height.py", module)
    registry = (room / "registry.py").read_text(encoding="utf-8")
    imported, row = "from .plates import", "    RateShare,\n"
    assert registry.count(imported) == registry.count(row) == 1
    registry = registry.replace(imported, f"from .platform_height import PlatformHeight\n{imported}")
    saved(room / "registry.py", registry.replace(row, f"{row}    PlatformHeight,\n"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-P", "-c", ADDED_LIMIT]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout)

    assert Path(found["file"]).is_relative_to(package)
    assert found["read"]
    crossed, text, negative, misspelt = found["refused"]
    assert crossed == "high.toml: limits.platform_height.min = 40.0: must be below max = 30 cm"
    assert text == 'high.toml: limits.platform_height.min = "high": must be a number'
    assert negative == "high.toml: limits.platform_height.min = -1.0: must be above 0 cm"
    assert "limits.platform_heigth: no such limit for the robot 'stewart-gough'" in misspelt
    assert "rate_share, platform_height, custom" in misspelt
    assert "platform_height" in found["constraints"]
    assert found["optimal"]
    assert found["height"] == pytest.approx(36.5, rel=1e-9)
    row = next(row for row in found["limits"] if row["key"] == "platform_height.min")
    assert row["active"] == ["platform_height"]
    assert (row["value"], row["limit"], row["unit"]) == (pytest.approx(36.5, rel=1e-9), 36.5, "cm")
    assert row["cost"] == pytest.approx(found["slope"], rel=0.01)
    # The starter's platform is at most 10 cm above 35 cm.
    assert found["relaxed"] == [["platform_height.min", pytest.approx(45, rel=1e-4)]]
    assert found["schema"]["description"] == "height of the platform's origin above the base"

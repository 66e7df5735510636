"""Limits on forces, speeds and powers of actuators: their numbers, derivatives, designs that keep them, and their cost.

The numbers come from joint centres and from the platform's equilibrium, in NumPy alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from builders import Array, case_from, edited, starter_tables, turn_about
from measures import circle_joints

from screwsynth.models import Dimension
from screwsynth.nlp import Case, Limits, Margin, Nlp, Status, Units, formulate, json_data, margins_of, result_of, solve
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.verdict import Outcome

LEGS = ("1-", "1+", "2-", "2+", "3-", "3+")
#: A weight that is always there, a force of both signs at a tool that also has one of any direction, and a gust.
CASE = """\
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = { min = 1.0, max = 2.0, start = 1.4 }
x2 = { min = 0.5, max = 1.0, start = 0.7 }
x3 = { min = 2, max = 25, start = 8 }
x4 = { min = 2, max = 25, start = 12 }
[pose]
position = [0.1, { min = -0.4, max = 0.4 }, { min = 1.0, max = 2.0, start = 1.5 }]
rotation = { angle = { min = -20, max = 20 } }
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [0.3, 0.1, 1.2]
pitch = 0.1
[[load]]
name = "payload"
mass = 40
centre = [0.05, -0.02, 0.3]
always = true
[[load]]
name = "cut"
force = [50, 20, -120]
moment = [3, 4, 5]
point = [0, 0, -0.2]
frame = "platform"
sign = "both"
any = { force = 30, moment = 2 }
[[load]]
name = "gust"
force = [0, 80, 0]
point = [0, 0, 0.4]
[motion]
linear = 0.5
angular = 40
[limits]
actuator_force = { max = 400 }
actuator_speed = { max = 0.9 }
actuator_power = { max = 300 }
[solve]
starts = 6
"""
WEIGHT = np.array([0, 0, -9.81 * 40])
CASES = ("cut", "cut reversed", "gust")


def cross(a: Array, b: Array) -> Array:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


class Expected:
    """Forces under each load case, and speeds, of the legs of a design, in radians."""

    def __init__(self, x: Mapping[str, float], R: Array, p: Array) -> None:
        base, platform = circle_joints(x)
        arms = platform @ R.T
        spans = p + arms - base
        u = spans / np.linalg.norm(spans, axis=1)[:, None]
        rows = np.array([[*direction, *cross(arm, direction)] for direction, arm in zip(u, arms, strict=True)])
        # sum of f_i (u_i, arm_i x u_i) and of the load is 0
        to_forces = -np.linalg.inv(rows.T)

        def wrench(force: Array, moment: Array, point: Array) -> Array:
            return np.concatenate([force, moment + cross(R @ point, force)])

        weight = wrench(WEIGHT, np.zeros(3), np.array([0.05, -0.02, 0.3]))
        tool = np.array([0.0, 0.0, -0.2])
        cut = wrench(R @ [50.0, 20.0, -120.0], R @ [3.0, 4.0, 5.0], tool)
        gust = wrench(np.array([0.0, 80.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 0.4]))
        self.centre = {
            "cut": to_forces @ (weight + cut),
            "cut reversed": to_forces @ (weight - cut),
            "gust": to_forces @ (weight + gust),
        }
        # Of a force d at the tool in any direction: its part along the gradient of a leg's force by d.
        at_tool = to_forces @ np.array([wrench(each, np.zeros(3), tool) for each in np.eye(3)]).T
        moments = to_forces[:, 3:]
        any_part = 30 * np.linalg.norm(at_tool, axis=1) + 2 * np.linalg.norm(moments, axis=1)
        self.spread = {"cut": any_part, "cut reversed": any_part, "gust": np.zeros(6)}
        self.speeds = 0.5 * np.linalg.norm(rows[:, :3], axis=1)
        self.speeds += np.radians(40) * np.linalg.norm(rows[:, 3:], axis=1)

    @property
    def constraints(self) -> dict[str, float]:
        """The number of each constraint of the program, by its name."""
        found = {}
        for k, leg in enumerate(LEGS):
            found[f"actuator_speed actuator {leg}"] = self.speeds[k]
            for load in CASES:
                centre, spread, speed = self.centre[load][k], self.spread[load][k], self.speeds[k]
                for way, size in (("", centre + spread), (" backwards", spread - centre)):
                    found[f"actuator_force actuator {leg}{way} load {load}"] = size
                    found[f"actuator_power actuator {leg}{way} load {load}"] = size * speed
        return found

    @property
    def largest_force(self) -> float:
        return float(max((np.abs(self.centre[load]) + self.spread[load]).max() for load in CASES))


@cache
def legs_nlp() -> Nlp:
    return formulate(case_from(CASE))


def expected_at(nlp: Nlp, x: Array) -> Expected:
    """The design and pose of a point of the program: its variables by name, of the turn a unit quaternion's vector."""
    at = dict(zip((each.name for each in nlp.program.variables), x, strict=True))
    q = np.array([at[name] for name in ("q_x", "q_y", "q_z")])
    R = turn_about(q, 2 * np.arcsin(np.linalg.norm(q)))
    return Expected({name: at[name] for name in ("x1", "x2", "x3", "x4")}, R, np.array([0.1, at["p_y"], at["p_z"]]))


def random_points(nlp: Nlp, count: int, seed: int) -> list[Array]:
    """Points inside the box, with turns of at most 20 degrees or so."""
    rng = np.random.default_rng(seed)
    turns = [each.name.startswith("q_") for each in nlp.program.variables]
    found = []
    for _ in range(count):
        x = nlp.centre + 0.9 * nlp.scale * rng.uniform(-1, 1, nlp.n)
        x[turns] = rng.uniform(-0.1, 0.1, 3)
        found.append(x)
    return found


def test_the_numbers_of_the_limits_are_those_of_the_legs() -> None:
    nlp = legs_nlp()
    names = [each.name for each in nlp.program.constraints]
    for x in random_points(nlp, 30, 1):
        expected = expected_at(nlp, x).constraints
        found = dict(zip(names, nlp.evaluate(x).g, strict=True))
        del found["angle"]
        assert found.keys() == expected.keys()
        scale = max(map(abs, expected.values()))
        assert [found[name] for name in expected] == pytest.approx(
            list(expected.values()), rel=1e-10, abs=1e-12 * scale
        )


def test_a_smallest_and_a_largest_force_are_signed_and_may_both_be_below_0() -> None:
    text = edited(CASE, ("actuator_force = { max = 400 }", "actuator_force = { min = -70, max = -5 }"))
    nlp = formulate(case_from(text))
    index = {each.name: k for k, each in enumerate(nlp.program.constraints)}
    assert not [name for name in index if name.startswith("actuator_force") and "backwards" in name]
    for x in random_points(nlp, 3, 7):
        at, g = expected_at(nlp, x), nlp.evaluate(x).g
        for load in CASES:
            for k, leg in enumerate(LEGS):
                largest = index[f"actuator_force actuator {leg} load {load}"]
                smallest = index[f"actuator_force actuator {leg} smallest load {load}"]
                assert g[largest] == pytest.approx(at.centre[load][k] + at.spread[load][k], rel=1e-9, abs=1e-9)
                assert g[smallest] == pytest.approx(at.centre[load][k] - at.spread[load][k], rel=1e-9, abs=1e-9)
                assert (nlp.g_upper[largest], nlp.g_lower[smallest]) == (-5.0, -70.0)


def test_the_derivatives_of_the_limits_are_differences_of_the_legs_forces() -> None:
    nlp = legs_nlp()
    names = [each.name for each in nlp.program.constraints]
    for x in random_points(nlp, 6, 2):
        found = nlp.program.kernels.derivatives(x, nlp.arguments).jacobian
        differences = np.zeros_like(found)
        for k in range(nlp.n):
            step = np.zeros(nlp.n)
            step[k] = 1e-5
            ends = [expected_at(nlp, x + sign * step).constraints for sign in (1, -1)]
            differences[1:, k] = [(ends[0][name] - ends[1][name]) / 2e-5 for name in names[1:]]
        sizes = np.abs(differences[1:]).max(axis=1, keepdims=True)
        np.testing.assert_allclose(found[1:] / sizes, differences[1:] / sizes, rtol=0, atol=1e-6)


#: Robots given joint by joint: actuators that turn and slide, platforms with fewer freedoms, parasitic motions.
JOINTED = ("3-rps", "6-rus", "delta", "planar-3-rrr", "tricept")
LOADED: dict[str, Any] = {
    "load": [
        {"name": "weight", "mass": 3.0, "centre": [0.05, 0.02, 0.1], "always": True},
        {"name": "tool", "force": [2.0, -1.0, 5.0], "moment": [0.3, 0.2, -0.1], "any": {"force": 1.0, "moment": 0.2}},
    ],
    "motion": {"linear": 0.4, "angular": 30.0},
    "gravity": {"acceleration": [1.0, 2.0, -9.0]},
}
LARGE = {"actuator_force": {"max": 1e6}, "actuator_speed": {"max": 1e6}, "actuator_power": {"max": 1e6}}


@pytest.mark.parametrize("name", JOINTED)
def test_the_derivatives_of_limits_on_robots_joint_by_joint_are_differences(name: str) -> None:
    nlp = formulate(case_from({**starter_tables(name), **LOADED, "limits": LARGE}))
    names = [each.name for each in nlp.program.constraints]
    own = [k for k, each in enumerate(names) if each.startswith("actuator_")]
    assert len({names[k].split()[0] for k in own}) == 3
    rng = np.random.default_rng(3)
    for _ in range(3):
        # The loops need not be closed for derivatives, and near home the robot is regular.
        x = nlp.start + 0.01 * nlp.scale * rng.uniform(-1, 1, nlp.n)
        found = nlp.program.kernels.derivatives(x, nlp.arguments).jacobian[own]
        differences = np.zeros_like(found)
        for k in range(nlp.n):
            step = np.zeros(nlp.n)
            # Fourth order: of the values at 1 and 2 steps to each side.
            step[k] = 5e-5 * nlp.scale[k]
            values = [nlp.evaluate(x + n * step).g[own] for n in (-2, -1, 1, 2)]
            differences[:, k] = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step[k])
        sizes = np.abs(differences * nlp.scale).max(axis=1, keepdims=True)
        assert sizes.min() > 1e-3
        np.testing.assert_allclose(found * nlp.scale / sizes, differences * nlp.scale / sizes, rtol=0, atol=1e-6)


def largest(at: Expected, key: str) -> float:
    return max(value for name, value in at.constraints.items() if name.startswith(key))


def limited(key: str, number: float) -> Case:
    kind = {"actuator_force": ActuatorForce, "actuator_speed": ActuatorSpeed, "actuator_power": ActuatorPower}[key]
    return replace(case_from(CASE), limits=Limits(kind(max=number)))


def best(case: Case) -> Any:  # noqa: ANN401 - a solution
    solution = solve(case)
    assert solution.status is Status.OPTIMAL
    return solution


#: Largest numbers that the best design without limits exceeds.
ACTIVE = {"actuator_force": 205.0, "actuator_speed": 0.8, "actuator_power": 230.0}


@pytest.mark.parametrize("key", ACTIVE)
def test_a_design_keeps_an_active_limit_and_its_cost_is_what_moving_it_does(key: str) -> None:
    number = ACTIVE[key]
    free = best(replace(case_from(CASE), limits=Limits()))
    assert largest(expected_at(free.nlp, free.x), key) > 1.05 * number
    solution = best(limited(key, number))
    assert solution.F < free.F
    assert largest(expected_at(solution.nlp, solution.x), key) == pytest.approx(number, rel=1e-9)
    rows = [row for row in margins_of(solution.nlp, solution.x, optimal=True) if row.key == f"{key}.max"]
    active = [row for row in rows if row.active]
    assert active
    assert [row.margin for row in active] == pytest.approx([0.0] * len(active), abs=1e-8 * number)
    assert all(row.margin > 0 for row in rows if not row.active)
    step = 1e-4 * number
    ends = [best(limited(key, number + sign * step)).F for sign in (1, -1)]
    assert sum(row.cost for row in active) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-3)


def test_limits_by_actuator_and_by_sign() -> None:
    """A leg that pushes by at least so much under every load, and one whose force has a largest size."""
    case = replace(case_from(CASE), limits=Limits(ActuatorForce("3+", min=35.0), ActuatorForce("1+", max=230.0)))
    free = best(replace(case, limits=Limits()))

    def ends(solution: Any) -> tuple[float, float]:  # noqa: ANN401
        at = expected_at(solution.nlp, solution.x)
        smallest = min((at.centre[load] - at.spread[load])[5] for load in CASES)
        return float(smallest), float(max((np.abs(at.centre[load]) + at.spread[load])[1] for load in CASES))

    smallest, size = ends(free)
    assert smallest < 30.0
    assert size > 240.0
    solution = best(case)
    assert ends(solution) == pytest.approx((35.0, 230.0), rel=1e-9)
    rows = {row.key: row for row in margins_of(solution.nlp, solution.x, optimal=True) if row.active}
    assert {"actuator_force.3+.min", "actuator_force.1+.max"} <= rows.keys()
    moved = best(replace(case, limits=Limits(ActuatorForce("3+", min=35.01), ActuatorForce("1+", max=230.0)))).F
    back = best(replace(case, limits=Limits(ActuatorForce("3+", min=34.99), ActuatorForce("1+", max=230.0)))).F
    assert rows["actuator_force.3+.min"].cost == pytest.approx((moved - back) / 0.02, rel=1e-3)
    assert moved < back


@pytest.mark.parametrize(("name", "dimension"), [("tricept", Dimension.FORCE), ("6-rus", Dimension.TORQUE)])
def test_a_robot_joint_by_joint_keeps_an_active_limit(name: str, dimension: Dimension) -> None:
    case = case_from({**starter_tables(name), **LOADED})

    def rows_of(solution: Any) -> list[Margin]:  # noqa: ANN401
        rows = margins_of(solution.nlp, solution.x, optimal=True)
        return [row for row in rows if row.key == "actuator_force.max"]

    free = best(replace(case, limits=Limits(ActuatorForce(max=1e6))))
    assert {row.dimension for row in rows_of(free)} == {dimension}
    number = 0.95 * max(row.value for row in rows_of(free))
    solution, *ends = (best(replace(case, limits=Limits(ActuatorForce(max=number * k)))) for k in (1, 1.0001, 0.9999))
    active = [row for row in rows_of(solution) if row.active]
    assert max(row.value for row in rows_of(solution)) == pytest.approx(number, rel=1e-9)
    slope = (ends[0].F - ends[1].F) / (2e-4 * number)
    assert sum(row.cost or 0.0 for row in active) == pytest.approx(slope, rel=1e-3)
    assert slope > 0


# -- over a workspace

BOX = "[{ min = -0.1, max = 0.1 }, { min = -0.1, max = 0.1 }, { min = 1.4, max = 1.6 }]"
#: The design's numbers fixed, over a box of positions.
FIXED = edited(
    CASE,
    ("x1 = { min = 1.0, max = 2.0, start = 1.4 }", "x1 = 1.4"),
    ("x2 = { min = 0.5, max = 1.0, start = 0.7 }", "x2 = 0.7"),
    ("x3 = { min = 2, max = 25, start = 8 }", "x3 = 8"),
    ("x4 = { min = 2, max = 25, start = 12 }", "x4 = 12"),
    ("[0.1, { min = -0.4, max = 0.4 }, { min = 1.0, max = 2.0, start = 1.5 }]", "[0, 0, 1.5]"),
    ("rotation = { angle = { min = -20, max = 20 } }\n", ""),
    ("[limits]", f"[workspace]\nposition = {BOX}\n[limits]"),
    ("actuator_speed = { max = 0.9 }\nactuator_power = { max = 300 }", ""),
)


def test_proven_largest_forces_over_a_workspace_are_above_all_samples_and_near_the_largest() -> None:
    rng = np.random.default_rng(6)
    x = {"x1": 1.4, "x2": 0.7, "x3": np.radians(8), "x4": np.radians(12)}
    ends = np.array(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1])).reshape(3, -1).T
    points = np.vstack([ends, rng.uniform(-1, 1, (1500, 3))]) * 0.1 + [0, 0, 1.5]
    sampled = [Expected(x, np.eye(3), p).constraints for p in points]
    found = {each.name: each for each in judge_workspace(case_from(FIXED), jobs=1).extremes if each.key}
    names = [name for name in sampled[0] if name.startswith("actuator_force")]
    assert found.keys() == set(names)
    for name in names:
        most = max(each[name] for each in sampled)
        claim = found[name]
        assert (claim.key, claim.outcome) == ("actuator_force.max", Outcome.PROVED)
        # What limits the size of a force in the other sense is claimed of the signed one.
        sign = -1 if " backwards " in name else 1
        assert sign * claim.bound >= most
        assert sign * claim.bound == pytest.approx(most, abs=2.0)
        assert sign * claim.reached <= sign * claim.bound


#: A published 3-UPU: its largest force in a box of 0.2 x 0.2 x 0.1 is 8.08803 N, at a corner.
UPU = """\
[robot]
model = "three-upu"
axes = "tsai"
parameters = { base_radius = 0.5, platform_radius = 0.12 }
[pose]
position = [0, 0, 0.45]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[load]]
force = [2, 2, -10]
[limits]
actuator_force = { max = MAX }
[workspace]
position = [{ min = -0.1, max = 0.1 }, { min = -0.1, max = 0.1 }, { min = 0.4, max = 0.5 }]
"""


def test_the_largest_force_of_a_published_robot_is_proved_and_a_smaller_limit_refuted() -> None:
    for number, outcome in (("8.09", Outcome.PROVED), ("8.08", Outcome.REFUTED)):
        claims = judge_workspace(case_from(UPU.replace("MAX", number)), jobs=1).extremes
        (worst,) = [each for each in claims if each.name == "actuator_force actuator 1 load load 1"]
        assert worst.outcome is outcome
        assert worst.reached == pytest.approx(8.08803, abs=5e-6)
        assert worst.bound >= 8.08803 - 5e-6
        assert worst.bound <= 8.09 or outcome is Outcome.REFUTED  # where a pose decides
        assert worst.pose is not None
        x, y, z = worst.pose.position
        assert (x, abs(y), z) == pytest.approx((0.1, 0.1, 0.4), abs=1e-6)


def test_a_limit_on_the_speed_of_cranks_costs_the_same_in_radians() -> None:
    case = case_from({**starter_tables("6-rus"), **LOADED})
    case = replace(case, limits=Limits(ActuatorSpeed(max=3.4)))
    (degrees,), (radians,) = (
        json_data(result_of(best(replace(case, units=Units(case.units.length, unit, "N")))))["limits"]
        for unit in ("deg", "rad")
    )
    assert (degrees["unit"], radians["unit"]) == ("deg/s", "rad/s")
    assert (degrees["limit"], radians["limit"]) == (pytest.approx(np.degrees(3.4)), 3.4)
    assert (degrees["value"], radians["value"]) == pytest.approx((np.degrees(3.4), 3.4), rel=1e-9)
    assert radians["cost"] == pytest.approx(np.degrees(degrees["cost"]), rel=1e-6)
    assert radians["cost"] > 0

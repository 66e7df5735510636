"""Limits on forces, speeds and powers of actuators: numbers, derivatives, costs, virtual work in MuJoCo, and text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from builders import EACH_KIND, FEW_KINDS, Array, case_from, edited, soaked, starter, starter_tables, turn_about
from hypothesis import given, settings
from hypothesis import strategies as st
from measures import circle_joints
from mujoco_robots import null_space
from mujoco_trees import Tree

from screwsynth.models import Dimension
from screwsynth.models.catalog import SHIPPED
from screwsynth.nlp import Case, Limits, Margin, Nlp, Status, Units, formulate, json_data, margins_of, result_of, solve
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.optimality import PointKind
from screwsynth.nlp.formats.solved.mechanism_of import mechanism_of
from screwsynth.nlp.formats.writing.mjcf import mjcf_text
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.solver.starts import StartStatus

LEGS = ("1-", "1+", "2-", "2+", "3-", "3+")
#: A weight that is always there, a force of both signs at a tool that also has one of any direction, and a gust.
TABLES = """\
robot = { model = "stewart-gough", layout = "octahedral", parameters = NUMBERS }
pose = { position = POSITION }
task = [{ sense = "max", axis = [1, 2, 6], point = [0.3, 0.1, 1.2], pitch = 0.1 }]
motion = { linear = 0.5, angular = 40 }
limits = { LIMITS }
solve.starts = 6
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
"""
NUMBERS = (
    "{ x1 = { min = 1.0, max = 2.0, start = 1.4 }, x2 = { min = 0.5, max = 1.0, start = 0.7 }, "
    "x3 = { min = 2, max = 25, start = 8 }, x4 = { min = 2, max = 25, start = 12 } }"
)
PLACE = (
    "[0.1, { min = -0.4, max = 0.4 }, { min = 1.0, max = 2.0, start = 1.5 }], rotation.angle = { min = -20, max = 20 }"
)
FORCE, OTHERS = "actuator_force = { max = 400 }", ", actuator_speed = { max = 0.9 }, actuator_power = { max = 300 }"
CASE = edited(TABLES, ("NUMBERS", NUMBERS), ("POSITION", PLACE), ("LIMITS", FORCE + OTHERS))
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
        loads = {"cut": weight + cut, "cut reversed": weight - cut, "gust": weight + gust}
        self.centre = {name: to_forces @ load for name, load in loads.items()}
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


def test_the_numbers_of_the_limits_and_their_derivatives_are_those_of_the_legs() -> None:
    nlp = legs_nlp()
    names = [each.name for each in nlp.program.constraints]
    for x in random_points(nlp, 30, 1):
        expected = expected_at(nlp, x).constraints
        found = dict(zip(names, nlp.evaluate(x).g, strict=True))
        del found["angle"]
        assert found.keys() == expected.keys()
        wanted = pytest.approx(list(expected.values()), rel=1e-10, abs=1e-12 * max(map(abs, expected.values())))
        assert [found[name] for name in expected] == wanted
    for x in random_points(nlp, 6, 2):
        slopes = nlp.program.kernels.derivatives(x, nlp.arguments).jacobian
        differences = np.zeros_like(slopes)
        for k, step in enumerate(1e-5 * np.eye(nlp.n)):
            ends = [expected_at(nlp, x + sign * step).constraints for sign in (1, -1)]
            differences[1:, k] = [(ends[0][name] - ends[1][name]) / 2e-5 for name in names[1:]]
        sizes = np.abs(differences[1:]).max(axis=1, keepdims=True)
        np.testing.assert_allclose(slopes[1:] / sizes, differences[1:] / sizes, rtol=0, atol=1e-6)


def test_a_smallest_and_a_largest_force_are_signed_and_may_both_be_below_0() -> None:
    nlp = formulate(case_from(edited(CASE, (FORCE, "actuator_force = { min = -70, max = -5 }"))))
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
        for k, step in enumerate(5e-5 * np.diag(nlp.scale)):
            # Fourth order: of the values at 1 and 2 steps to each side.
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
    moved, back = (
        best(replace(case, limits=Limits(ActuatorForce("3+", min=force), ActuatorForce("1+", max=230.0)))).F
        for force in (35.01, 34.99)
    )
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


BOX = "[0, 0, 1.5] }\nworkspace = { position = [{ min = -0.1, max = 0.1 }, { min = -0.1, max = 0.1 }, "
#: The design's numbers fixed, over a box of positions.
FIXED = edited(
    TABLES,
    ("NUMBERS", "{ x1 = 1.4, x2 = 0.7, x3 = 8, x4 = 12 }"),
    ("POSITION", f"{BOX}{{ min = 1.4, max = 1.6 }}]"),
    ("LIMITS", FORCE),
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


LOADS = 4


@pytest.mark.parametrize("name", soaked([*EACH_KIND, *SHIPPED], (*FEW_KINDS, "delta", *list(SHIPPED)[:1])))
def test_exported_actuators_hold_the_loads_with_the_programs_forces(name: str) -> None:
    """The null space of the exported tree's constraints has all motions: in each, actuators and loads do no work."""
    rng = np.random.default_rng([5, *name.encode()])
    own = [[tuple(rng.normal(size=3).tolist()) for _ in range(3)] for _ in range(LOADS)]
    loading = Loading(tuple(Load(f"{k}", *parts) for k, parts in enumerate(own)))
    nlp = formulate(replace(starter(name), loading=loading, limits=Limits(ActuatorForce(max=1e9))))
    part = np.array([0.01 if each.name.startswith("q") else 0.1 for each in nlp.program.variables])
    x = close_equations(nlp, closed_start(nlp) + part * rng.uniform(-1, 1, nlp.n) * (nlp.upper - nlp.lower))
    values = dict(zip((each.name for each in nlp.program.constraints), nlp.evaluate(x).g, strict=True))
    exported = mechanism_of(nlp, x)
    actuators = [joint.actuator for joint in exported.joints if joint.actuator]
    found = np.array([[values[f"actuator_force actuator {each} load {k}"] for k in range(LOADS)] for each in actuators])
    backwards = [
        [values[f"actuator_force actuator {each} backwards load {k}"] for k in range(LOADS)] for each in actuators
    ]
    np.testing.assert_array_equal(-found, backwards)

    tree = Tree(mjcf_text(exported.mechanism), exported.size)
    assert tree.open < 1e-12
    state = nlp.program.kernels.robot_state(x, nlp.arguments)
    R, p = (np.array(each) for each in (state.rotation, state.position))
    rates, work = virtual_work(
        tree, [np.concatenate([f, m + np.cross(p.ravel() + R @ at, f)]) for f, m, at in map(np.array, own)]
    )
    assert np.linalg.matrix_rank(rates, 1e-9) == len(actuators)
    np.testing.assert_allclose(rates @ found, -work, rtol=0, atol=1e-10 * np.abs(found).max())


def virtual_work(tree: Tree, wrenches: list[Array]) -> tuple[Array, Array]:
    """Rates (n, a) of the actuators, and work (n, k) of wrenches about the world origin, in each feasible motion."""
    constraints, of_platform = tree.jacobians
    motions = null_space(constraints) if len(constraints) else np.eye(tree.model.nv)
    return motions[tree.driven].T, motions.T @ of_platform.T @ np.roll(np.array(wrenches).T, 3, axis=0)


#: Of an angle that is written in degrees.
ULP = 3e-16
SIX, TURNING = starter("stewart-gough"), starter("delta")

NUMBER = st.floats(-1e30, 1e30) | st.integers(-1000, 1000).map(float) | st.sampled_from([0.0, -0.0, 5e-324, 1e-7, 0.1])
SIZE = st.floats(0, 1e30) | st.sampled_from([0.0, 1.0, 12.5])
POSITIVE = st.floats(1e-300, 1e30) | st.sampled_from([1.0, 2.5])
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER) | st.just((0.0, 0.0, 0.0))
#: No half of a pair of surrogates, which no text file has.
NAME = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12) | st.sampled_from(["cut", "a b", '"'])


@st.composite
def drawn_loads(draw: st.DrawFn, name: str) -> Load:
    always = draw(st.booleans())
    if draw(st.booleans()):
        return Load(name, point=draw(VECTOR), mass=draw(POSITIVE), always=always)
    force, moment, size, turn = draw(VECTOR), draw(VECTOR), draw(SIZE), draw(SIZE)
    if not (any(force) or any(moment) or size or turn):
        force = (0.0, 0.0, -1.0)
    is_fixed = any(force) or any(moment)
    both = is_fixed and draw(st.booleans())
    return Load(name, force, moment, draw(VECTOR), draw(st.booleans()), both, size, turn, always=always)


@st.composite
def loadings(draw: st.DrawFn) -> Loading:
    names = draw(st.lists(NAME.filter(lambda name: "reversed" not in name), max_size=4, unique=True))
    own = tuple(draw(drawn_loads(name)) for name in names)
    motion = Motion(*draw(st.tuples(SIZE, st.floats(0, 1e28)))) if draw(st.booleans()) else None
    if motion is not None and not (motion.linear or motion.angular):
        motion = Motion(1.0)
    gravity = draw(st.none() | VECTOR.filter(any))
    return Loading(own, motion, gravity)


def same_but_for_degrees(one: Loading, two: Loading) -> bool:
    turns = [None if each.motion is None else each.motion.angular for each in (one, two)]
    left = [replace(each.motion, angular=0.0) if each.motion else None for each in (one, two)]
    rows = [[vars(load) for load in each.loads] for each in (one, two)]
    gravities = [None if each.gravity is None else tuple(each.gravity) for each in (one, two)]
    close = turns[0] == turns[1] or abs(turns[0] - turns[1]) <= ULP * abs(turns[0])
    return rows[0] == rows[1] and left[0] == left[1] and gravities[0] == gravities[1] and close


@given(loadings(), st.sampled_from([("m", "N"), ("mm", "N"), ("in", "lbf")]), st.sampled_from(["deg", "rad"]))
@settings(max_examples=60, deadline=None)
def test_random_loads_are_the_same_when_read_again(loading: Loading, units: tuple[str, str], angle: str) -> None:
    if loading.gravity is None and units != ("m", "N"):
        loading = loading._replace(gravity=(0.0, 0.0, -1.0))
    own = Units(units[0], angle, units[1])
    case = replace(SIX, units=own, loading=loading)
    text = case.to_toml()
    again = case_from(text, case.name)
    assert same_but_for_degrees(case.loading, again.loading)
    assert again.units == own
    assert [each.name for each in again.loading.cases] == [each.name for each in loading.cases]
    if angle == "rad" or loading.motion is None:
        assert again.to_toml() == text


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_random_limits_on_actuators_are_the_same_when_they_are_read_again(data: st.DataObject) -> None:
    case, names = data.draw(st.sampled_from([(SIX, ("1-", "2+", "3+")), (TURNING, ("1", "2", "3"))]))
    every = data.draw(st.booleans())
    actuators = [""] if every else data.draw(st.lists(st.sampled_from(names), min_size=1, unique=True))
    limits: list[ActuatorForce | ActuatorSpeed | ActuatorPower] = []
    for actuator in actuators:
        low = data.draw(st.none() | st.floats(-1e6, 1e6))
        high = data.draw(st.floats(1e-3, 1e3)) + (0.0 if low is None else max(low, 0.0))
        most = data.draw(st.just(high) | (st.none() if low is not None else st.just(high)))
        limits.append(ActuatorForce(actuator, min=low, max=most))
        limits.append(ActuatorSpeed(actuator, max=data.draw(POSITIVE)))
    limits.append(ActuatorPower("", max=data.draw(POSITIVE)))
    loading = Loading((Load("tool", (1.0, 2.0, 3.0)),), Motion(1.0))
    made = replace(case, loading=loading, limits=Limits(*limits))
    again = case_from(made.to_toml(), made.name)
    assert len(again.limits.items) == len(limits)
    for limit in limits:
        (other,) = [each for each in again.limits if (type(each), each.name) == (type(limit), limit.name)]
        for key in ("min", "max"):
            one, two = (getattr(each, key, None) for each in (limit, other))
            assert one == two or abs(one - two) <= ULP * abs(one)


def test_numbers_of_arrays_are_written_as_numbers_and_no_loads_in_no_words() -> None:
    load = Load("tool", np.array([1.0, 2.0, 3.0]), np.zeros(3), np.array([0.1, 0.2, 0.3]), any_force=np.float64(2.0))
    loading = Loading((load, Load("payload", mass=np.float64(3.0))), Motion(np.float64(0.5)), np.array([0.0, 0, -9.81]))
    again = case_from(replace(SIX, loading=loading).to_toml(), SIX.name)
    assert same_but_for_degrees(loading, again.loading)
    for word in ("load", "motion", "gravity", "force"):
        assert word not in SIX.to_toml()


@pytest.mark.parametrize("angle", ["deg", "rad"])
def test_speeds_of_actuators_that_turn_have_the_unit_of_angles(angle: str) -> None:
    tables = "[motion]\nlinear = 0.5\nangular = 30\n[limits]\nactuator_speed = { max = 90 }\n"
    own = Units("m", angle)
    base = replace(TURNING, units=own).to_toml()
    factor = np.pi / 180 if angle == "deg" else 1.0
    case = case_from(base + tables)
    assert case.loading.motion == Motion(0.5, 30 * factor)
    assert case.limits == Limits(ActuatorSpeed(max=90 * factor))
    # Legs that slide have a speed of length, whatever the unit of angles.
    six: Case = case_from(replace(SIX, units=own).to_toml() + tables)
    assert six.limits == Limits(ActuatorSpeed(max=90.0))


PRESS = """\
units = { length = "LENGTH", force = "N", angle = "deg" }
robot.model = "stewart-gough"
robot.layout = "octahedral"
robot.parameters = { x1 = X1, x2 = X2, x3 = { min = 0, max = 30 }, x4 = { min = 0, max = 30 } }
pose = { position = [{ min = -Q, max = Q }, { min = -Q, max = Q }, Z] }
task = [{ sense = "max", axis = [0, 0, -1], pitch = inf }]
load = [{ force = [0, 0, 300] }]
solve.starts = 4
"""


@pytest.mark.parametrize(("length", "metre"), [("m", 1.0), ("mm", 1e3)])
def test_a_singular_design_breaks_limits_on_forces_that_it_leaves_undetermined(length: str, metre: float) -> None:
    """F is largest where both circles carry regular hexagons: three parallel pairs of legs, and J has rank 3."""
    numbers = {"X1": 0.18, "X2": 0.11, "Q": 0.03, "Z": 0.25}
    text = PRESS.replace("LENGTH", length)
    for name, value in numbers.items():
        text = text.replace(name, repr(value * metre))
    free = solve(case_from(text))
    assert free.status.is_answer
    assert free.state is not None
    assert free.state.is_singular
    limited = f"{text}[limits]\nactuator_force = {{ max = 80 }}\n"
    refused = solve(case_from(limited))
    assert refused.status is Status.SINGULAR
    assert refused.evidence is not None
    assert refused.evidence.kind is PointKind.SINGULAR
    assert {each.status for each in refused.starts} == {StartStatus.SINGULAR}
    data: Any = json_data(result_of(refused))
    assert (data["status"], data["F"]) == ("singular", None)
    assert {each["value"] for each in data["reached"]["violated"]} == {None}
    rows = margins_of(refused.nlp, refused.x, optimal=False)
    assert all(each.violated and not np.isfinite(each.value) for each in rows)
    # Kept away from the singularity, the six legs share the load: with height h and length L, f = 300 L / (6 h).
    kept = solve(case_from(f"{limited}smallest_singular_value = {{ min = 0.2, length = {0.11 * metre!r} }}\n"))
    assert kept.status is Status.OPTIMAL
    assert kept.state is not None
    legs = kept.state.quantities["leg_length"]
    shared = 300 * legs / (6 * 0.25 * metre)
    values = [each.value for each in margins_of(kept.nlp, kept.x, optimal=False) if each.key == "actuator_force.max"]
    assert np.sort(np.abs(values)) == pytest.approx(np.sort(np.concatenate([shared, shared])), rel=1e-6)

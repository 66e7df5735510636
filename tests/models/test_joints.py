"""Robots joint by joint: reference numbers, published facts, screws against loop equations, and robots by rows."""

import copy
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from builders import Array, turn_about
from casadi import SX
from robot_gallery import CHI, LENGTH, RANKS, REFERENCE, snu, table

from screwsynth import models
from screwsynth.models import Model, Velocities, hexapod, instantiate, rank_of_rows, robot, stewart_gough
from screwsynth.models.basis import basis_of_member
from screwsynth.models.expression import ExpressionError, evaluate
from screwsynth.models.joints.home.motion import AxisKind, JointAxis, Motion
from screwsynth.models.member import resisted_parts, scaled_twists
from screwsynth.models.rows import column_groups
from screwsynth.models.wrench import WrenchKind
from screwsynth.nlp import Case, Free, Nlp, Rotation, Task, formulate
from screwsynth.nlp.evidence.kkt import close_equations

RPS = """
home = [0, 0, 1.1]
[[limb]]
repeat = { count = 3 }
points = { B = [1, 0, 0], A = [0.6, 0, 1.1] }
joints = [{ type = "R", at = "B", axis = "y" }, { type = "P", at = "B", axis = "A - B", actuated = true },
          { type = "S", at = "A" }]
"""
PLANAR = """
[[limb]]
repeat = { count = 3 }
points = { B = [1, 0, 0], A = ["0.35*cos(0.2)", "0.35*sin(0.2)", 0], E = "(A + B)/2 + 0.35*y" }
joints = [{ type = "R", at = "B", axis = "z", actuated = true }, { type = "R", at = "E", axis = "z" },
          { type = "R", at = "A", axis = "z" }]
"""


def written(text: str) -> Model:
    return robot(**{"name": "test", **tomllib.loads(text)})


def gallery(name: str, dimensions: Mapping[str, float]) -> Model:
    """A robot of the gallery whose typical dimensions are these."""
    tables = copy.deepcopy(table(name))
    for key, value in dimensions.items():
        tables["dimensions"][key]["typical"] = value
    return robot(**tables)


class Numbers(NamedTuple):
    """The robot in numbers: F and work rates of a twist, rows of the instance, actuators' screws, residuals."""

    F: float
    rates: Array
    J: Array
    driven: Array
    relations: Array
    loops: Array
    quantities: Array
    position: Array

    @property
    def velocities(self) -> Velocities:
        return Velocities(self.J, self.driven, self.relations)


class Robot:
    """A model with fixed dimensions; ``pose`` is a Cayley vector, a position, then the unknowns."""

    def __init__(self, model: Model, length: float = LENGTH, parameters: Mapping[str, float] | None = None) -> None:
        self.model = model
        values = {item.name: item.typical[0] for item in model.parameters} | dict(parameters or {})
        self.home = np.concatenate([np.zeros(3), model.home, np.zeros(len(model.unknowns))])
        pose, twist = SX.sym("pose", len(self.home)), SX.sym("twist", 6)
        dimensions = ca.vertcat(SX(0, 1), *[SX(values[item.name]) for item in model.parameters])
        substitution = models.Substitution(dimensions, pose[6:], models.matrix_from_cayley(pose[:3]), pose[3:6])
        here = instantiate(model, substitution, SX(length), [twist])
        quantities = ca.vertcat(SX(0, 1), *here.quantities)
        outputs = [here.F, here.rates, here.jacobian, here.driven, here.relations, here.loops, quantities]
        self._numbers = ca.Function("numbers", [pose, twist], [ca.densify(each) for each in outputs])
        loops = ca.vertcat(here.loops, quantities)
        self._loops = ca.Function("loops", [pose], [ca.densify(loops), ca.densify(ca.jacobian(loops, pose))])
        self._count = here.loops.numel()

    def at(self, pose: Array, twist: Array = CHI) -> Numbers:
        F, rates, J, driven, relations, loops, quantities = (each.full() for each in self._numbers(pose, twist))
        ravelled = (each.ravel() for each in (loops, quantities))
        return Numbers(float(F.item()), rates.ravel(), J, driven, relations, *ravelled, pose[3:6])

    def driven(self, target: Array) -> Array:
        """Return the closed pose near home at which the actuators are away from home by so much."""
        pose = self.home
        for _ in range(40):
            residual, slopes = (each.full() for each in self._loops(pose))
            residual = residual.ravel()
            residual[self._count :] -= target
            pose = pose - np.linalg.lstsq(slopes, residual, rcond=1e-9)[0]
        assert np.abs(residual).max() < 1e-9
        return pose

    def reached(self, position: Array) -> Array:
        """Return the closed pose with a position and without rotation."""
        pose = np.concatenate([np.zeros(3), position, np.zeros(len(self.model.unknowns))])
        for _ in range(40):
            residual, slopes = (each.full()[: self._count] for each in self._loops(pose))
            pose[6:] -= np.linalg.lstsq(slopes[:, 6:], residual.ravel(), rcond=1e-9)[0]
        assert np.abs(residual).max() < 1e-9
        return pose


def work(rows: Array) -> Array:
    """Return rows (m, 6) that multiply a twist (omega, v), from force and moment."""
    return np.hstack([rows[:, 3:], rows[:, :3]])


def actuator_rates(model: Model, here: Numbers) -> Array:
    """Return the rates that leave least of what each limb resists, in the order of the actuators."""
    found = []
    for limb in dict.fromkeys(each.limb for each in model.actuators):
        rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
        found += list(np.linalg.lstsq(here.driven[np.ix_(rows, own)], here.rates[rows], rcond=None)[0])
    return np.array(found)


@pytest.mark.parametrize("name", REFERENCE)
def test_robots_have_the_numbers_of_an_independent_computation(name: str) -> None:
    dimensions, F, F_feasible, rates, F_driven = REFERENCE[name]
    model, ranks = gallery(name, dimensions), RANKS[name]
    here = Robot(model)
    home = here.at(here.home)
    assert pytest.approx(F, abs=1e-10) == home.F
    constraints = models.constraint_rows(model, home.velocities, home.position)
    _, values, right = np.linalg.svd(work(constraints))
    rank = int(np.count_nonzero(values > 1e-9))
    assert rank == ranks.constraints == rank_of_rows(constraints, np.zeros(3), 1.0)
    feasible = right[rank:].T @ right[rank:] @ CHI
    moved = here.at(here.home, feasible)
    assert pytest.approx(F_feasible, abs=1e-10) == moved.F
    assert actuator_rates(model, moved) == pytest.approx(np.array(rates), abs=1e-6)
    counts = tuple(sum(row.limb == limb for row in model.rows) for limb in model.limbs)
    assert counts == (ranks.W if name != "delta" else (2, 2, 2))
    driven = here.at(here.driven(np.full(len(model.actuators), 0.05)))
    assert pytest.approx(F_driven, abs=1e-10) == driven.F
    assert np.abs(driven.loops).max(initial=0.0) < 1e-12
    # The rows of results are a basis of the same wrenches: J'J and so F, singular values and rank are the same.
    for each in (home, driven):
        rows = models.reporting_matrix(model, each.velocities, each.position) @ each.J
        assert len(rows) == sum(ranks.W)
        assert rows.T @ rows == pytest.approx(each.J.T @ each.J, abs=1e-12)
    assert (model.generic.jacobian, model.generic.constraints) == (6, ranks.constraints)


def test_published_facts_of_the_three_upu_hold() -> None:
    tsai, other = (Robot(model, length=1.0) for model in (gallery("3-upu", {}), robot(**snu())))
    about_z = np.array([0, 0, 1.0, 0, 0, 0])
    values = np.linalg.svd(tsai.at(tsai.home).J, compute_uv=False)[:6]
    assert values == pytest.approx(np.repeat([1.601235, 0.896811, 0.243109], 2), abs=1e-6)
    assert pytest.approx(2.563954, abs=1e-6) == tsai.at(tsai.home, about_z).F
    here = other.at(other.home)
    assert rank_of_rows(here.J, np.zeros(3), 1.0) == 4
    # Constraint singularity: the constraints have rank 1 where they have 3 elsewhere.
    assert rank_of_rows(models.constraint_rows(other.model, here.velocities, here.position), np.zeros(3), 1.0) == 1
    assert other.model.generic.constraints == 3
    assert pytest.approx(3.0, abs=1e-12) == other.at(other.home, about_z).F
    for angle in (0.0, 0.7, 2.0):
        line = np.array([math.cos(angle), math.sin(angle), 0.0])
        assert other.at(other.home, np.hstack([line, np.cross([0, 0, 1.4], line)])).F < 1e-20


@pytest.mark.parametrize("name", ["delta", "delta-parallelogram"])
def test_inverse_kinematics_of_the_delta_are_those_of_williams(name: str) -> None:
    """Williams, The Delta Parallel Robot: ABB FlexPicker IRB 360; his first motor stands at azimuth -90 degrees."""
    sides = {"rb": 0.567 / math.sqrt(12), "rp": 0.076 / math.sqrt(3), "tilt": 0.0}
    here, turn = Robot(gallery(name, sides)), turn_about([0, 0, 1], math.pi / 2)
    for position, expected in (
        ((0.0, 0.0, -0.9), (-20.547, -20.547, -20.547)),
        ((0.3, 0.5, -1.1), (47.504, -11.569, 21.378)),
    ):
        found = here.at(here.reached(turn @ position)).quantities
        assert np.degrees(found) == pytest.approx(np.array(expected), abs=1e-3)


def test_isotropic_robots_are_isotropic() -> None:
    # Agile Eye: the actuators turn as the platform does, and F = l^2 |omega|^2 for a rotation.
    eye = Robot(models.robot_function("spherical-3-rrr")())
    turning = eye.at(eye.home, np.hstack([CHI[:3], np.zeros(3)]))
    assert pytest.approx(LENGTH**2 * float(CHI[:3] @ CHI[:3]), abs=1e-14) == turning.F
    assert actuator_rates(eye.model, turning) == pytest.approx(CHI[:3], abs=1e-14)
    moving = np.hstack([np.zeros(3), CHI[3:]])
    # Orthoglide: at its centre alone; Tripteron: everywhere.
    for name, place, same in (
        ("orthoglide", np.zeros(3), True),
        ("orthoglide", np.array([0.05, -0.04, 0.03]), False),
        ("tripteron", np.zeros(3), True),
        ("tripteron", np.array([0.05, -0.08, 0.1]), True),
    ):
        here = Robot(models.robot_function(name)())
        numbers = here.at(here.reached(place), moving)
        assert (pytest.approx(float(CHI[3:] @ CHI[3:]), abs=1e-12) == numbers.F) is same
        assert (actuator_rates(here.model, numbers) == pytest.approx(CHI[3:], abs=1e-12)) is same


def test_other_ways_to_write_a_limb_give_the_same_robot() -> None:
    home = Robot(written(RPS))
    F, J = home.at(home.home).F, home.at(home.home).J
    passive = """
[[limb]]
joints = [{ type = "U", at = "0*x", axes = ["x", "y"] }, { type = "P", at = "0*x", axis = "z" },
          { type = "S", at = [0, 0, 1.1] }]
"""
    wrist = RPS.replace(
        '{ type = "S", at = "A" }',
        '{ type = "R", at = "A", axis = "x" }, { type = "R", at = "A", axis = "y" },'
        '{ type = "R", at = "A + z", axis = "z" }',
    )
    cylinder = RPS.replace('{ type = "R", at = "B", axis = "y" },', '{ type = "H", at = "B", axis = "y", pitch = 0 },')
    for text in (wrist, RPS + passive, cylinder):
        other = Robot(written(text))
        numbers = other.at(other.home)
        assert pytest.approx(F, abs=1e-14) == numbers.F
        assert pytest.approx(J.T @ J, abs=1e-13) == numbers.J.T @ numbers.J
    moved = Robot(written(wrist)).driven(np.full(3, 0.05))
    assert pytest.approx(REFERENCE["3-rps"][4], abs=1e-10) == Robot(written(wrist)).at(moved).F


def test_a_twist_that_rides_along_with_the_whole_robot_has_the_same_f() -> None:
    turned: dict[str, Any] = tomllib.loads(PLANAR)
    here = Robot(written(PLANAR))
    expected = here.at(here.home).F
    shift = np.array([0.4, -0.7, 0.3])
    for limb in turned["limb"]:
        limb["points"] = {
            "B": "1*x + 0.4*x - 0.7*y + 0.3*z",
            "A": "0.35*cos(0.2)*x + 0.35*sin(0.2)*y + 0.4*x - 0.7*y + 0.3*z",
            "E": "(A + B)/2 + 0.35*y",
        }
        limb["repeat"]["through"] = shift.tolist()
    other = Robot(robot(name="moved", home=shift.tolist(), limb=turned["limb"]))
    twist = np.hstack([CHI[:3], CHI[3:] + np.cross(shift, CHI[:3])])
    assert pytest.approx(expected, abs=1e-13) == other.at(other.home, twist).F


NAMES = {"a": SX(2.0), "E": SX([1, 2, 3])}
NO_EXPRESSIONS = [
    "a.real", "[1, 2]", "a if a else a", "a == 1", "lambda: 1", "f'{a}'", "a[0]", "a := 1", "not a", "a // 2", "a % 2",
    "'a'", "True", "None", "1j", "x y", "", "sin(a=1)", "sin(*E)", "print(1)", "sin", "unit", "1e999", "(" * 500,
    "9^999", "E^2", "x + 1", "1/x", "cos(x)", "cross(1, x)", "\0", "a\nb", "9" * 400, "import os", "exec('1')",
]  # fmt: skip


@pytest.mark.parametrize(
    ("size", "count", "rank"), [(6, 5, 5), (6, 3, 3), (6, 5, 3), (6, 4, 2), (3, 1, 1), (3, 4, 2), (6, 0, 0)]
)
def test_the_projector_is_that_of_a_singular_value_decomposition(size: int, count: int, rank: int) -> None:
    columns, vectors = SX.sym("columns", size, count), SX.sym("vectors", size, 2)
    function = ca.Function("parts", [columns, vectors], [ca.densify(resisted_parts(columns, rank, vectors))])
    rng = np.random.default_rng(size + count)
    for _ in range(20):
        several = count > rank
        a = (
            rng.normal(size=(size, rank)) @ rng.normal(size=(rank, count))
            if several
            else rng.normal(size=(size, count))
        )
        x = rng.normal(size=(size, 2))
        space = np.linalg.svd(a)[0][:, rank:] if count else np.eye(size)
        assert function(a, x).full() == pytest.approx(space @ space.T @ x, abs=1e-7)


def test_a_small_resistance_is_not_lost_and_scaled_coordinates_give_the_work_rate() -> None:
    columns, vectors = SX.sym("columns", 6, 5), SX.sym("vectors", 6, 1)
    function = ca.Function("parts", [columns, vectors], [resisted_parts(columns, 5, vectors)])
    rng = np.random.default_rng(0)
    for _ in range(20):
        a = rng.normal(size=(6, 5))
        across = np.linalg.svd(a)[0][:, 5]
        small = 1e-6 * across + a @ rng.normal(size=5)
        found = function(a, small).full().ravel()
        # The difference of two squares would have a relative error of 1e-3 here.
        assert float(found @ found) == pytest.approx(1e-12, rel=1e-8)
    rng = np.random.default_rng(1)
    twist, centre, length = rng.normal(size=6), rng.normal(size=3), 0.7
    f, m = rng.normal(size=3), rng.normal(size=3)
    x = np.array(ca.DM(scaled_twists(SX(twist), SX(centre), SX(length), 6))).ravel()
    y = np.hstack([f, (m - np.cross(centre, f)) / length])
    assert float(x @ y) == pytest.approx(float(m @ twist[:3] + f @ twist[3:]), abs=1e-14)


def test_displacements_and_screws_of_joints_are_those_of_numbers() -> None:
    rng = np.random.default_rng(2)
    for kind, pitch in ((AxisKind.ROTATION, 0.0), (AxisKind.ROTATION, 0.3), (AxisKind.TRANSLATION, math.inf)):
        axis, point, value = rng.normal(size=3), rng.normal(size=3), 0.8
        axis /= np.linalg.norm(axis)
        joint = JointAxis(kind, SX(axis), SX(point), False, SX(0 if math.isinf(pitch) else pitch), SX.zeros(3))
        expected = models.displacement(models.screw_from_axis(axis, point, pitch), value)
        found = joint.motion(SX(value))
        assert np.array(ca.DM(found.rotation)) == pytest.approx(expected.rotation, abs=1e-14)
        assert np.array(ca.DM(found.point(SX.zeros(3)))).ravel() == pytest.approx(expected.translation, abs=1e-14)
        assert np.array(ca.DM(found.after(found.inverse()).rotation)) == pytest.approx(np.eye(3), abs=1e-14)
    # A parallelogram's unit screw is its displacement's derivative, in parts of the rod's length.
    rod, q = SX([0.3, 0.1, -0.8]), SX.sym("q")
    joint = JointAxis(AxisKind.PARALLELOGRAM, SX([0, 1, 0]), SX.zeros(3), False, SX(0), rod)
    slope = ca.Function("slope", [q], [ca.jacobian(joint.motion(q).point(SX.zeros(3)), q) / ca.norm_2(rod)])
    screw = ca.Function("screw", [q], [joint.screw(q, Motion.none())[3:]])
    assert screw(0.4).full() == pytest.approx(slope(0.4).full(), abs=1e-15)


def test_a_basis_of_wrenches_has_couples_and_forces_first() -> None:
    rng = np.random.default_rng(3)
    wrenches = np.array([[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1], [0, 1, 0, 0, 0.5, 0], [0, 0, 1, 0, 0, 0]], dtype=float)
    wrenches /= np.linalg.norm(wrenches, axis=1, keepdims=True)
    mixed = np.linalg.qr(rng.normal(size=(4, 4)))[0] @ wrenches
    basis = basis_of_member(mixed.T @ mixed, wrenches[3:].T, 4)
    assert basis.kinds == (WrenchKind.COUPLE, WrenchKind.FORCE, WrenchKind.WRENCH, WrenchKind.FORCE)
    assert basis.rows @ basis.rows.T == pytest.approx(np.eye(4), abs=1e-12)
    assert np.abs(basis.rows[3] @ wrenches[3]) == pytest.approx(1, abs=1e-12)


def test_expressions_have_the_values_of_mathematics() -> None:
    for text, expected in (
        ("-a^2 + 3*2^-1", -2.5), ("2^3^2", 512.0), ("atan2(1, 1)*4 - pi", 0.0), ("norm(cross(x, y))", 1.0), (7, 7.0),
        ("sqrt(abs(-9)) + cos(0) + tan(0)", 4.0), ("dot(E, x + 2*z)", 7.0),
    ):  # fmt: skip
        assert float(evaluate(text, NAMES)) == pytest.approx(expected, abs=1e-15)
    assert np.array(ca.DM(evaluate("unit(E - x)*sqrt(13) + a/2*y", NAMES))).ravel() == pytest.approx([0, 3, 3])
    with pytest.raises(ValueError, match=re.escape("limb 1, joint 1 (R), axis: is 'q', which has the name 'q'")):
        robot(name="wrong", limb=[{"joints": [{"type": "R", "at": "x", "axis": "q"}]}])


@pytest.mark.parametrize("text", NO_EXPRESSIONS)
def test_nothing_but_mathematics_is_an_expression(text: str) -> None:
    with pytest.raises(ExpressionError):
        evaluate(text, NAMES)


def test_redundant_parallel_hinges_leave_the_robot_the_same() -> None:
    """A planar limb with a fourth and fifth hinge: dependent screws of the same span, and so the same wrenches."""

    def members(extra: int) -> tuple[np.ndarray, int]:
        hinges = [{"type": "R", "at": [0.5, 0.1 * k, 0], "axis": "z"} for k in range(extra)]
        own = [{"type": "R", "at": at, "axis": "z"} for at in ("x", [0.7, 0.4, 0], [0.6, -0.3, 0], [0.35, 0, 0])]
        joints = [own[0] | {"actuated": True}, *own[1:3], *hinges, own[3]]
        model = robot(name="planar", limb=[{"repeat": {"count": 3}, "joints": joints}])
        member = model.members[0]
        home = [model.home, np.eye(3), np.zeros(len(model.unknowns))]
        unknowns = ca.vertcat(SX(0, 1), *[each.symbol for each in model.unknowns])
        symbols = [model.pose.position, model.pose.rotation, unknowns]
        columns = scaled_twists(member.screws, member.centre, SX(1), 6)
        projector = ca.Function("projector", symbols, [resisted_parts(columns, member.rank, SX.eye(6))])
        return projector(*home).full(), member.rank

    expected, rank = members(0)
    for extra in (1, 2):
        found, same = members(extra)
        assert same == rank == 3
        assert found == pytest.approx(expected, abs=1e-12)


def test_columns_fall_into_the_smallest_groups_whose_ranks_add_up() -> None:
    """Two columns of one direction, three of a plane, a lone one and a zero; a ball's axes first, where they stay."""
    rng, points, balls = np.random.default_rng(6), [], []
    for _ in range(4):
        span = rng.normal(size=(6, 4))
        parts = [span[:, :1] @ rng.normal(size=(1, 2)), span[:, 1:3] @ rng.normal(size=(2, 3)), span[:, 3:]]
        points.append(np.hstack([*parts, np.zeros((6, 1))])[:, [0, 2, 1, 3, 4, 5, 6]])
        ball = [np.vstack([ca.skew(ca.DM(rng.normal(size=3))).full(), np.eye(3)]) for _ in range(2)]
        balls.append(np.hstack(ball))
    assert column_groups(points, 4) == (((0, 2, 6), 1), ((1, 3, 4), 2), ((5,), 1))
    assert column_groups(balls, 5) == (((0,), 1), ((1,), 1), ((2,), 1), ((3, 4, 5), 2))
    assert column_groups(points[:1], 4) == ()
    # A third axis in the plane of two is no multiple of either: its group is none of theirs.
    axes = np.array([[1.0, 0, 1, 0], [0, 1, 1, 0], [0, 0, 0, 1]])
    pencils = [np.vstack([ca.skew(ca.DM(rng.normal(size=3))).full() @ axes, axes]) for _ in range(4)]
    flat = [np.hstack([each[:, :3], rng.normal(size=(6, 1))]) for each in pencils]
    assert column_groups(flat, 3) == ()


# Screws against equations: motions that keep all loops closed are those in which the constraints do no work.

THREE = "repeat = { count = 3 }\n"
SIX = "repeat = { angles = [0, 60, 110, 170, 240, 300] }\n"
CUBE = "repeat = { count = 3, axis = [1, 1, 1] }\n"
#: Repetition, joints (type with ``!`` where it is driven, place, axes), and the freedoms that the robot has.
LIMBS: dict[str, tuple[str, str, int]] = {
    "SPR": (THREE, "S B; P! B A-B; R A y", 3),
    "RUU": (THREE, "R! B y; U E y x; U A x y", 3),
    "PCU": (THREE, "P! B z; C B y; U A x y", 3),
    "RHS": (THREE, "R! B y; H E y; S A", 3),
    "two actuators": (THREE, "R! B y; P! B A-B; S A", 3),
    "six hinges": (THREE, "R! B x; R B y; R E y; R E+0.2*z x+0.3*z; R A z; R A+0.1*x x", 6),
    "slide beside its rod": (SIX, "U B x y; P! E z+0.2*x; S A", 6),
    "slide beside its line": (THREE, "R B y; P! E z+0.2*x; S A", 3),
    "rod to the base": (THREE, "S B; U E x y; R! A y", 6),
    "slides alone": (CUBE, "P! B x; P B y; P B z", 3),
}


def joint_of(words: str) -> dict[str, object]:
    kind, at, *axes = words.split()
    table: dict[str, object] = {"type": kind[0], "at": at} | ({"actuated": True} if kind.endswith("!") else {})
    if axes:
        table |= {"axis": axes[0]} if len(axes) == 1 else {"axes": axes}
    return table | ({"pitch": 0.3} if kind == "H" else {})


def check_tangents(model: Model, freedoms: int) -> None:
    """Check the tangents of all loop equations at a closed configuration away from home."""
    rng = np.random.default_rng(0)
    c, p, u = SX.sym("c", 3), SX.sym("p", 3), SX.sym("u", len(model.unknowns))
    omega, v = SX.sym("omega", 3), SX.sym("v", 3)
    R, position = (SX.eye(3) + ca.skew(omega)) @ models.matrix_from_cayley(c), p + v + ca.cross(omega, p)
    typical = np.array([item.typical[0] for item in model.parameters])
    dimensions = SX(typical) if typical.size else SX(0, 1)
    here = instantiate(model, models.Substitution(dimensions, u, R, position), SX(0.7), [SX.zeros(6)])
    quantities = ca.vertcat(SX(0, 1), *here.quantities)
    moving = ca.vertcat(omega, v, u)
    outputs = [here.loops, ca.jacobian(here.loops, moving), here.jacobian, here.driven, here.relations]
    outputs += [ca.jacobian(quantities, moving)]
    at = ca.vertcat(c, p, u)
    function = ca.Function("here", [at, omega, v], [ca.densify(each) for each in outputs])
    loops = here.loops
    still = ca.substitute(loops, ca.vertcat(omega, v), SX.zeros(6))
    closing = ca.Function("closing", [at], [ca.densify(still), ca.densify(ca.jacobian(still, at))])
    size = max(1.0, float(np.abs(model.home).max()))
    x = np.hstack([np.zeros(3), model.home, np.zeros(len(model.unknowns))])
    assert np.abs(closing(x)[0].full()).max(initial=0.0) < 1e-12  # home is closed
    x = x + 0.05 * np.hstack([rng.normal(size=3), size * rng.normal(size=3), rng.normal(size=len(model.unknowns))])
    for _ in range(40):
        residual, slopes = (each.full() for each in closing(x))
        x = x - np.linalg.lstsq(slopes, residual.ravel(), rcond=1e-9)[0]
    found = function(x, np.zeros(3), np.zeros(3))
    residual, slopes, J, driven, relations, quantity_slopes = (each.full() for each in found)
    assert np.abs(residual).max(initial=0.0) < 1e-12
    values, right = np.linalg.svd(slopes)[1:] if slopes.size else (np.zeros(0), np.eye(moving.numel()))
    tangents = right[int(np.count_nonzero(values > 1e-8 * values.max(initial=1e-300))) :]
    constraints = models.constraint_rows(model, Velocities(J, driven, relations), x[3:6])
    work = np.hstack([constraints[:, 3:], constraints[:, :3]])
    assert np.abs(work @ tangents[:, :6].T).max(initial=0.0) < 1e-12
    rank = rank_of_rows(constraints, x[3:6], size)
    assert np.linalg.matrix_rank(tangents[:, :6], tol=1e-7) == 6 - rank == freedoms
    assert 6 - model.generic.constraints == freedoms
    owners = [owner for quantity in model.quantities for owner in quantity.owners]
    for limb in dict.fromkeys(each.limb for each in model.actuators):
        rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
        resisted = J[rows] @ np.hstack([tangents[:, 3:6], tangents[:, :3]]).T
        rates = np.linalg.lstsq(driven[np.ix_(rows, own)], resisted, rcond=None)[0]
        expected = quantity_slopes[[owners.index(model.actuators[k].name) for k in own]] @ tangents.T
        assert rates == pytest.approx(expected, abs=1e-10 * size)


@pytest.mark.parametrize("name", LIMBS)
def test_limbs_of_many_kinds(name: str) -> None:
    repeat, joints, freedoms = LIMBS[name]
    points = "points = { B = [1, 0, 0], A = [0.6, 0, 1.1], E = [1.2, 0.1, 0.5] }\n"
    limb = {**tomllib.loads(repeat + points), "joints": [joint_of(words) for words in joints.split(";")]}
    home = (0, 0, 0) if repeat == CUBE else (0, 0, 1.1)
    check_tangents(robot(name=name, home=home, limb=[limb]), freedoms)


@pytest.mark.parametrize("name", ["3-upu", "6-rus", "delta", "delta-parallelogram", "planar-3-rrr", "spherical-3-rrr"])
def test_robots_of_the_gallery(name: str) -> None:
    check_tangents(models.robot_function(name)(), 6 if name == "6-rus" else 3)


# The robots that are given by their rows equal their descriptions joint by joint: F and its gradient.

Build = Callable[[], Model]
TWIST = np.array([0.3, -0.5, 0.7, 4.0, 6.0, -2.0])
POINTS = 20


def program(model: Model, rotation: Rotation) -> Nlp:
    """The program in which all dimensions and the pose are free about their typical values and home."""
    reach = {"length": 5.0, "angle": 0.1}
    parameters = {
        item.name: [Free(value - each, value + each) for value in item.typical]
        for item, each in ((item, reach[item.dimension.value]) for item in model.parameters)
    }
    position = [Free(value - 5.0, value + 5.0) for value in model.home]
    return formulate(Case(model, parameters, position, [Task(TWIST)], rotation, characteristic_length=2.0))


def legs(
    sides: str, dimensions: dict[str, dict[str, object]], points: list[tuple[list[object], list[object]]]
) -> Model:
    """Legs between universal and ball joints at given points of base and platform."""
    joints = [joint_of(words) for words in ("U B x y", "P! B A-B", "S A")]
    limbs = [
        {"points": {"B": base, "A": [platform[0], platform[1], f"35 + {platform[2]}"]}, "joints": joints}
        for base, platform in points
    ]
    return robot(sides, home=[0, 0, 35], dimensions=dimensions, limb=limbs)


def six_six(offset: float, sign: int) -> Model:
    """The 6-6 platform: pairs of joints on two circles, at ``-+x3`` and ``offset -+ sign*x4``."""
    dimensions: dict[str, dict[str, object]] = {"x1": {"typical": 12.0}, "x2": {"typical": 8.0}}
    dimensions |= {"x3": {"typical": 20.0, "kind": "angle"}, "x4": {"typical": 8.0, "kind": "angle"}}
    points: list[tuple[list[object], list[object]]] = []
    for k in range(3):
        for side in (-1, 1):
            b, a = f"({k}*2*pi/3 + {side}*x3)", f"({k}*2*pi/3 + {side}*({offset!r} + {sign}*x4))"
            points.append(([f"x1*cos{b}", f"x1*sin{b}", 0], [f"x2*cos{a}", f"x2*sin{a}", 0]))
    return legs("6-6", dimensions, points)


def twelve_points() -> Model:
    """Legs between twelve points, with the names of the hexapod's own parameters for their components."""
    given = hexapod()
    values = [zip(item.components, item.typical, strict=True) for item in given.parameters]
    dimensions: dict[str, dict[str, object]] = {name: {"typical": value} for item in values for name, value in item}
    names = [[list(item.components) for item in given.parameters if item.name.startswith(part)] for part in ("b", "p")]
    return legs("12 points", dimensions, [(list(b), list(a)) for b, a in zip(*names, strict=True)])


def upu() -> Model:
    """The 3-UPU with tangential first axes at both ends of each limb."""
    joints = [joint_of(words) for words in ("U B y cross(y,A-B)", "P! B A-B", "U A cross(y,A-B) y")]
    points = {"B": ["base_radius", 0, 0], "A": ["platform_radius", 0, 50]}
    limb = {"repeat": {"count": 3}, "points": points, "joints": joints}
    dimensions = {"base_radius": {"typical": 50.0}, "platform_radius": {"typical": 25.0}}
    return robot("3-UPU", home=[0, 0, 50], dimensions=dimensions, limb=[limb])


def gradient(nlp: Nlp, x: Array, count: int) -> Array:
    """Gradient of F by the first numbers, the unknowns behind them keeping the loops closed."""
    found = nlp.program.kernels.derivatives(x, nlp.arguments)
    slope, equal = found.gradient.ravel(), nlp.g_lower == nlp.g_upper
    loops = found.jacobian[equal]
    return slope[:count] - slope[count:] @ np.linalg.lstsq(loops[:, count:], loops[:, :count], rcond=1e-9)[0]


@pytest.mark.parametrize(
    ("by_rows", "by_joints", "rotation"),
    [
        (stewart_gough, lambda: six_six(0.0, 1), Rotation(None, Free(-1.0, 1.0))),
        (lambda: stewart_gough(layout="octahedral"), lambda: six_six(math.pi / 3, -1), Rotation(None, Free(-1.0, 1.0))),
        (hexapod, twelve_points, Rotation(None, Free(-1.0, 1.0))),
        # The rows of the 3-UPU take the lower joints to be parallel to the upper ones: where the platform translates.
        (lambda: models.three_upu(axes="tsai"), upu, Rotation()),
    ],
    ids=["stewart-gough", "octahedral", "hexapod", "three-upu"],
)
def test_f_and_its_gradient_are_those_of_the_rows(by_rows: Build, by_joints: Build, rotation: Rotation) -> None:
    rows, joints = program(by_rows(), rotation), program(by_joints(), rotation)
    names = [item.name for item in rows.program.variables]
    assert [item.name for item in joints.program.variables][: len(names)] == names
    rng = np.random.default_rng(14)
    for _ in range(POINTS):
        x = rows.centre + rows.scale * rng.uniform(-0.55, 0.55, rows.n)
        closed = close_equations(joints, np.concatenate([x, joints.start[rows.n :]]))
        assert closed[: rows.n] == pytest.approx(x, rel=0, abs=0)
        F = rows.evaluate(x).F
        assert pytest.approx(F, rel=1e-12) == joints.evaluate(closed).F
        expected = rows.program.kernels.derivatives(x, rows.arguments).gradient.ravel()
        assert gradient(joints, closed, rows.n) == pytest.approx(expected, rel=0, abs=1e-11 * max(1, *np.abs(expected)))

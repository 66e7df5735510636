"""Parts of robots given joint by joint: projector, basis, displacements, expressions."""

import math
import re

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.models import displacement, robot, screw_from_axis
from screwsynth.models.basis import basis_of_member
from screwsynth.models.joints.expression import ExpressionError, evaluate
from screwsynth.models.joints.motion import AxisKind, JointAxis, Motion
from screwsynth.models.member import resisted_parts, scaled_twists
from screwsynth.models.rows import column_groups
from screwsynth.models.wrench import WrenchKind

NO_EXPRESSIONS = [
    *(
        "a.real",
        "[1, 2]",
        "a if a else a",
        "a == 1",
        "lambda: 1",
        "f'{a}'",
        "a[0]",
        "a := 1",
        "not a",
        "a // 2",
        "a % 2",
    ),
    *("'a'", "True", "None", "1j", "x y", "", "sin(a=1)", "sin(*E)", "print(1)", "sin", "unit", "1e999", "(" * 500),
    *("9^999", "E^2", "x + 1", "1/x", "cos(x)", "cross(1, x)", "\0", "a\nb", "9" * 400, "import os", "exec('1')"),
]


@pytest.mark.parametrize(
    ("size", "count", "rank"), [(6, 5, 5), (6, 3, 3), (6, 5, 3), (6, 4, 2), (3, 1, 1), (3, 4, 2), (6, 0, 0)]
)
def test_the_projector_is_that_of_a_singular_value_decomposition(size: int, count: int, rank: int) -> None:
    columns, vectors = SX.sym("columns", size, count), SX.sym("vectors", size, 2)
    function = ca.Function("parts", [columns, vectors], [ca.densify(resisted_parts(columns, rank, vectors))])
    rng = np.random.default_rng(size + count)
    for _ in range(20):
        a = (
            rng.normal(size=(size, rank)) @ rng.normal(size=(rank, count))
            if count > rank
            else rng.normal(size=(size, count))
        )
        x = rng.normal(size=(size, 2))
        space = np.linalg.svd(a)[0][:, rank:] if count else np.eye(size)
        assert function(a, x).full() == pytest.approx(space @ space.T @ x, abs=1e-7)


def test_a_small_resistance_is_not_lost_in_rounding() -> None:
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


def test_scaled_coordinates_give_the_work_rate() -> None:
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
        expected = displacement(screw_from_axis(axis, point, pitch), value)
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
    names = {"a": SX(2.0), "E": SX([1, 2, 3])}
    for text, expected in (
        ("-a^2 + 3*2^-1", -2.5),
        ("2^3^2", 512.0),
        ("atan2(1, 1)*4 - pi", 0.0),
        ("sqrt(abs(-9)) + cos(0) + tan(0)", 4.0),
        ("dot(E, x + 2*z)", 7.0),
        ("norm(cross(x, y))", 1.0),
        (7, 7.0),
    ):
        assert float(evaluate(text, names)) == pytest.approx(expected, abs=1e-15)
    assert np.array(ca.DM(evaluate("unit(E - x)*sqrt(13) + a/2*y", names))).ravel() == pytest.approx([0, 3, 3])


@pytest.mark.parametrize("text", NO_EXPRESSIONS)
def test_nothing_but_mathematics_is_an_expression(text: str) -> None:
    with pytest.raises(ExpressionError):
        evaluate(text, {"a": SX(2.0), "E": SX([1, 2, 3])})


def test_redundant_parallel_hinges_leave_the_robot_the_same() -> None:
    """A planar limb with a fourth and fifth hinge: dependent screws of the same span, and so the same wrenches."""

    def members(extra: int) -> tuple[np.ndarray, int]:
        hinges = [{"type": "R", "at": [0.5, 0.1 * k, 0], "axis": "z"} for k in range(extra)]
        joints = [
            {"type": "R", "at": "x", "axis": "z", "actuated": True},
            {"type": "R", "at": [0.7, 0.4, 0], "axis": "z"},
            {"type": "R", "at": [0.6, -0.3, 0], "axis": "z"},
            *hinges,
            {"type": "R", "at": [0.35, 0, 0], "axis": "z"},
        ]
        model = robot(name="planar", limb=[{"repeat": {"count": 3}, "joints": joints}])
        member = model.members[0]
        home = [model.home, np.eye(3), np.zeros(len(model.unknowns))]
        own = [
            model.pose.position,
            model.pose.rotation,
            ca.vertcat(SX(0, 1), *[each.symbol for each in model.unknowns]),
        ]
        columns = scaled_twists(member.screws, member.centre, SX(1), 6)
        projector = ca.Function("projector", own, [resisted_parts(columns, member.rank, SX.eye(6))])
        return projector(*home).full(), member.rank

    expected, rank = members(0)
    for extra in (1, 2):
        found, same = members(extra)
        assert same == rank == 3
        assert found == pytest.approx(expected, abs=1e-12)


def test_messages_name_the_place() -> None:
    with pytest.raises(ValueError, match=re.escape("limb 1, joint 1 (R), axis: is 'q', which has the name 'q'")):
        robot(name="wrong", limb=[{"joints": [{"type": "R", "at": "x", "axis": "q"}]}])


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

"""Derivatives against differences, evidence against optima that are known in closed form, and principal motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from builders import Array
from casadi import SX
from numpy.typing import ArrayLike

from screwsynth import models
from screwsynth.models import Closure, Dimension, Model, Unknown, Wrench, axis_from_screw, hexapod, stewart_gough
from screwsynth.models.linalg import echelon_basis, nonnegative_least_squares
from screwsynth.nlp import Case, Free, Nlp, Rotation, TaskAnalysis, analyse_tasks, evaluate, formulate, load_case
from screwsynth.nlp.case.limits.constraint import Constraint, Reading
from screwsynth.nlp.case.task import Sense, Task
from screwsynth.nlp.evidence.optimality import Evidence, PointKind, examine
from screwsynth.nlp.program.places import Places, Scalar
from screwsynth.nlp.program.program import Program


@cache
def donor() -> Nlp:
    return formulate(load_case("paper-4.1-helical"))


def examined(
    objective: Callable[[SX], SX],
    sense: Sense,
    bounds: list[tuple[float, float]],
    at: ArrayLike,
    constraints: Sequence[tuple[str, Callable[[SX], SX], float, float]] = (),
) -> Evidence:
    """The evidence at a point of a program in the variables v0, v1, ..., with these bounds and constraints."""
    nlp = donor()
    x, ends = SX.sym("x", len(bounds)), np.array(bounds, dtype=float)
    program = Program(
        tuple(Scalar(f"v{i}", Dimension.LENGTH) for i in range(len(bounds))), (Scalar("unused", Dimension.NUMBER),),
        x=x, p=SX.sym("unused"), objective=objective(x),
        constraints=tuple(Constraint(name, g(x), Reading(Dimension.NUMBER)) for name, g, _, _ in constraints),
        robots=nlp.program.robots, model=nlp.program.model, places=Places((), (), (), ()),
    )  # fmt: skip
    g_lower, g_upper = (np.array([each[k] for each in constraints], dtype=float) for k in (2, 3))
    nlp = Nlp(
        program, nlp.case, sense, np.zeros(1), lower=ends[:, 0], upper=ends[:, 1], start=ends.mean(axis=1),
        g_lower=g_lower, g_upper=g_upper, size=1.0,  # the donor robot's size means nothing here
    )  # fmt: skip
    return examine(nlp, np.array(at, dtype=float))


def test_strict_minimum_inside_and_not_stationary_away_from_it() -> None:
    evidence = examined(lambda x: (x[0] - 1) ** 2 + 4 * x[1] ** 2, Sense.MIN, [(-2, 2), (-2, 2)], [1.0, 0.0])
    assert evidence.kind is PointKind.STRICT_MINIMUM
    # Half ranges are 2: second derivatives 2 and 8 in scaled variables are 8 and 32.
    np.testing.assert_allclose(evidence.eigenvalues, [8, 32])
    assert evidence.active == ()
    assert evidence.licq
    evidence = examined(lambda x: x**2, Sense.MIN, [(-1, 3)], [0.5])
    assert evidence.kind is PointKind.NOT_STATIONARY
    assert evidence.stationarity == pytest.approx(2 * 0.5 * 2)


@pytest.mark.parametrize(
    ("objective", "sense", "bounds", "at", "kind"),
    [
        (lambda x: (x[0] - 1) ** 2 + 4 * x[1] ** 2, Sense.MAX, [(-2, 2), (-2, 2)], [1.0, 0.0], PointKind.SADDLE),
        # A bound that pushes the wrong way holds nothing.
        (lambda x: x**2, Sense.MIN, [(1, 3)], [1], PointKind.STRICT_MINIMUM),
        (lambda x: x**2, Sense.MIN, [(1, 3)], [3], PointKind.NOT_STATIONARY),
        # A minimum of a quartic on a bound is no maximum.
        (lambda x: (1 + x**2) ** 2, Sense.MAX, [(0, 1)], [0.0], PointKind.SADDLE),
    ],
)
def test_kinds_of_points(
    objective: Callable[[SX], SX], sense: Sense, bounds: list[tuple[float, float]], at: list[float], kind: PointKind
) -> None:
    assert examined(objective, sense, bounds, at).kind is kind


def test_multiplier_is_the_gain_per_unit_of_room() -> None:
    evidence = examined(lambda x: 3 * x[0] - x[1] ** 2, Sense.MAX, [(0, 5), (-1, 1)], [5.0, 0.0])
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    (side,) = evidence.active
    assert (side.name, side.bound, side.value) == ("v0", "max", 5.0)
    assert side.multiplier == pytest.approx(3)


@pytest.mark.parametrize("sense", list(Sense))
def test_multiplier_of_a_constraint_matches_the_optimal_value_function(sense: Sense) -> None:
    # On the disc |x|^2 <= c the linear function a.x ranges over +-|a| sqrt(c): d/dc = |a| / (2 sqrt(c)).
    a, disc = np.array([3.0, 4.0]), ("disc", ca.sumsqr, -np.inf, 4.0)
    point = a / 5 * 2 * (1 if sense is Sense.MAX else -1)
    evidence = examined(lambda x: ca.dot(ca.DM(a), x), sense, [(-9, 9), (-7, 7)], point, [disc])
    assert evidence.kind in (PointKind.STRICT_MAXIMUM, PointKind.STRICT_MINIMUM)
    (side,) = evidence.active
    assert side.multiplier == pytest.approx(5 / (2 * 2))
    assert evidence.eigenvalues.shape == (1,)


def test_an_equation_is_active_and_its_multiplier_may_be_negative() -> None:
    # min |x|^2 on x0 + x1 = 2 is 2 at (1, 1); with right-hand side r it is r^2 / 2, which grows by 2 per unit.
    total = ("sum", lambda x: x[0] + x[1], 2.0, 2.0)
    evidence = examined(ca.sumsqr, Sense.MIN, [(-5, 5), (-4, 4)], [1.0, 1.0], [total])
    assert evidence.kind is PointKind.STRICT_MINIMUM
    (side,) = evidence.active
    assert side.bound == "equal"
    assert side.multiplier == pytest.approx(-2)  # improvement of a minimum: minus its growth


def test_outside_a_limit_is_infeasible_and_at_a_vertex_there_is_no_direction_left() -> None:
    evidence = examined(lambda x: x[0], Sense.MAX, [(-9, 9), (-9, 9)], [1.5, 0.0], [("disc", ca.sumsqr, -np.inf, 1.0)])
    assert evidence.kind is PointKind.INFEASIBLE
    assert evidence.violated == ("disc",)
    evidence = examined(lambda x: x[0] + 2 * x[1], Sense.MAX, [(0, 1), (0, 1)], [1.0, 1.0])
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    assert evidence.eigenvalues.size == 0


@pytest.mark.parametrize(
    ("objective", "ends", "at", "slope"),
    [
        (lambda x: (x[0] * x[1] - 1) ** 2, (0.1, 4), [1.0, 1.0, 0.3], pytest.approx(-1)),
        (lambda x: (x[0] - x[1]) ** 4, (-1, 1), [0.1, 0.1, 0.2], pytest.approx(1, rel=0.05)),
    ],
    ids=["manifold", "quartic valley"],
)
def test_minima_that_are_not_isolated_name_their_flat_directions(
    objective: Callable[[SX], SX], ends: tuple[float, float], at: list[float], slope: object
) -> None:
    evidence = examined(objective, Sense.MIN, [ends, ends, (-1, 1)], at)
    assert evidence.kind is PointKind.NOT_ISOLATED
    directions = [dict(direction) for direction in evidence.flat]
    assert {frozenset(direction) for direction in directions} == {frozenset({"v2"}), frozenset({"v0", "v1"})}
    along = next(direction for direction in directions if "v0" in direction)
    assert along["v0"] / along["v1"] == slope


def test_a_direction_along_active_bounds_is_flat_and_a_quartic_minimum_is_not() -> None:
    bounds = [(0, 4), (-1, 1), (-1, 1), (-2, 3)]
    evidence = examined(lambda x: x[0] + x[1] ** 2 - x[3], Sense.MIN, bounds, [0.0, 0.0, 0.3, 3.0])
    assert evidence.kind is PointKind.NOT_ISOLATED
    assert [set(direction) for direction in evidence.flat] == [{"v2"}]
    evidence = examined(lambda x: x**4, Sense.MIN, [(-1, 1)], [0.0])
    assert evidence.kind is PointKind.UNDECIDED
    assert evidence.flat == ()


def test_dependent_active_normals_lose_licq_and_still_certify() -> None:
    # x0 <= 1 stands twice: as a bound and as a constraint.
    again = ("again", lambda x: x[0], -np.inf, 1.0)
    evidence = examined(lambda x: x[0] - x[1] ** 2, Sense.MAX, [(-1, 1), (-1, 1)], [1.0, 0.0], [again])
    assert not evidence.licq
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    assert sum(side.multiplier for side in evidence.active) == pytest.approx(1)


def test_least_squares_are_optimal_and_an_echelon_basis_spans_the_same_space() -> None:
    generator = np.random.default_rng(5)
    for _ in range(200):
        n, k = generator.integers(1, 8, size=2)
        A, b = generator.normal(size=(n, k)), generator.normal(size=n)
        if k > 1:
            A[:, -1] = A[:, 0]  # dependent columns too
        y = nonnegative_least_squares(A, b)
        slope = A.T @ (A @ y - b)
        assert y.min() >= 0
        assert slope.min() >= -1e-9
        assert abs(slope @ y) <= 1e-9
    generator = np.random.default_rng(6)
    for _ in range(50):
        vectors = generator.normal(size=(3, 6))
        basis = echelon_basis(vectors)
        assert np.linalg.matrix_rank(np.vstack([vectors, basis]), tol=1e-9) == 3
        assert np.abs(basis).max() == 1


# Derivatives of the program against differences of its values, which need nothing but the values.
POINTS = 3  # of each program
POSITION = (Free(-10, 10), Free(-10, 10), Free(20, 50))
DIMENSIONS = {"x1": Free(8, 14), "x2": Free(5, 9), "x3": Free(0.05, 0.5), "x4": Free(0.05, 0.5)}
HELD, FREE = Rotation((1, -2, 3), Free(-0.7, 0.7)), Rotation(None, Free(-1.2, 1.2))
SHELL = Rotation(None, Free(0.3, 1.2))


def task(seed: int) -> Task:
    rng = np.random.default_rng(seed)
    return Task(np.concatenate([rng.normal(size=3), rng.normal(0, 10, size=3)]))


def some_of_a_hexapod(rotation: Rotation) -> Case:
    rng = np.random.default_rng(9)
    parameters: dict[str, tuple[float | Free, ...]] = {}
    for leg in "123456":
        parameters[f"base_{leg}"] = tuple(rng.uniform([-15, -15, -3], [15, 15, 3]).tolist())
        parameters[f"platform_{leg}"] = tuple(rng.uniform([-8, -8, -3], [8, 8, 3]).tolist())
    parameters["base_2"] = (Free(5, 12), 1.0, Free(-3, 3))
    parameters["platform_5"] = (2.0, Free(-7, -1), Free(-2, 2))
    return Case(hexapod(), parameters, (Free(-5, 5), 2.0, Free(20, 40)), [task(3)], rotation)


def closed_by_equations() -> Case:
    """Two legs whose lengths are unknowns, and a couple: closure equations beside the ball of the rotation."""
    pose = models.PoseSymbols()
    rows, unknowns, closure = [], [], []
    for name, base, end in (("a", (9.0, 1.0, 0.0), (5.0, -2.0, 1.0)), ("b", (-8.0, 3.0, 0.0), (-4.0, 4.0, 0.0))):
        length = ca.SX.sym(f"l{name}")
        span = pose.position + pose.rotation @ ca.DM(end) - ca.DM(base)
        rows.append(Wrench(name, models.WrenchKind.FORCE, span, ca.cross(ca.DM(base), span), length**2))
        unknowns.append(Unknown(f"l{name}", length, Dimension.LENGTH, "length of a leg", 15, 60))
        closure.append(Closure(f"close_{name}", length**2 - ca.sumsqr(span)))
    rows.append(
        models.couple_about("c", pose.rotation @ ca.DM([1.0, 2.0, 0.5]) + ca.cross(pose.position, ca.DM([0, 0, 0.1])))
    )
    model = Model(
        "closed", "a toy", (), pose, (0.0, 0.0, 30.0), tuple(rows), unknowns=tuple(unknowns),
        closure=tuple(closure),
    )  # fmt: skip
    return Case(model, {}, POSITION, [task(4)], FREE, characteristic_length=7.0)


CASES: dict[str, Callable[[], Case]] = {
    "aligned, all free, axis held": lambda: Case(stewart_gough(), DIMENSIONS, POSITION, [task(0)], HELD),
    "octahedral, all free, axis free": lambda: Case(
        stewart_gough(layout="octahedral"), DIMENSIONS, POSITION, [task(1)], FREE
    ),
    "aligned, pose free, least angle": lambda: Case(
        stewart_gough(), {"x1": 12.0, "x2": 8.0, "x3": 0.3, "x4": 0.1}, POSITION, [task(2)], SHELL
    ),
    "hexapod, some joints free, axis held": lambda: some_of_a_hexapod(HELD),
    "hexapod, some joints free, axis free": lambda: some_of_a_hexapod(FREE),
    "closure equations and a couple": closed_by_equations,
}


@cache
def program(name: str) -> Nlp:
    return formulate(CASES[name]())


def points(nlp: Nlp, seed: int) -> Array:
    """Points well inside the box, the last one without rotation."""
    rng = np.random.default_rng(seed)
    inside = nlp.centre + rng.uniform(-0.6, 0.6, size=(POINTS, nlp.n)) * nlp.scale
    inside[-1, [each.name in {"angle", "q_x", "q_y", "q_z"} for each in nlp.program.variables]] = 0.0
    return inside


def values(nlp: Nlp, x: Array) -> Array:
    """Objective, then constraints."""
    F, g = nlp.evaluate(x)
    return np.array([F, *g])


def sizes(nlp: Nlp, at: Array) -> Array:
    """(1 + c,) size of the objective and of each constraint among some points: one may vanish at one of them."""
    return np.asarray(np.max(np.abs([values(nlp, x) for x in at]), axis=0))


def extrapolated(difference: Callable[[float], Array], step: float, levels: int) -> Array:
    """Richardson's limit of a difference whose error has even powers of the step only."""
    table = [difference(h) for h in step / 2.0 ** np.arange(levels)]
    for order in range(1, levels):
        table = [b + (b - a) / (4.0**order - 1) for a, b in pairwise(table)]
    return table[0]


# Steps are in scaled variables, where 1 is half of a variable's range: functions of the pose change their character
# over 1 to 4 of them. Five steps from 0.2 leave a truncation error of (0.2^5 / 2^10)^2 = 1e-13 of the tenth derivative.
# The rounding error is 1e-16 to 1e-15 of the values over the smallest step, 0.0125, or over its square: 1e-13 for a
# slope, 1e-11 for a curvature. The worst seen are 4e-14 and 9e-12.
def slopes(nlp: Nlp, x: Array) -> Array:
    """(1 + c, n) first derivatives of objective and constraints in scaled variables."""
    columns = [
        extrapolated(lambda h, d=step: (values(nlp, x + h * d) - values(nlp, x - h * d)) / (2 * h), 0.2, 5)
        for step in np.diag(nlp.scale)
    ]
    return np.array(columns).T


def curvatures(nlp: Nlp, x: Array) -> Array:
    """(1 + c, n, n) second derivatives of objective and constraints in scaled variables."""
    middle = values(nlp, x)

    def along(d: Array) -> Array:
        return extrapolated(lambda h: (values(nlp, x + h * d) - 2 * middle + values(nlp, x - h * d)) / h**2, 0.2, 5)

    steps = np.diag(nlp.scale)
    found = np.empty((len(middle), nlp.n, nlp.n))
    for i in range(nlp.n):
        for j in range(i + 1):
            # Half the directions' sum and difference: as short a step as along a variable.
            plus, minus = along((steps[i] + steps[j]) / 2), along((steps[i] - steps[j]) / 2)
            found[:, i, j] = found[:, j, i] = plus - minus
    return found


@pytest.mark.parametrize("name", CASES)
def test_gradients_of_objective_and_constraints_are_slopes(name: str) -> None:
    nlp = program(name)
    size = sizes(nlp, points(nlp, 1))
    for x in points(nlp, 1):
        F, gradient, g, jacobian = (part.full() for part in nlp.program.derivatives(x, nlp.arguments))
        np.testing.assert_array_equal(np.array([F.item(), *g.ravel()]), values(nlp, x))
        assert gradient.shape == (1, nlp.n)
        assert jacobian.shape == (len(nlp.program.constraints), nlp.n)
        exact, expected = np.vstack([gradient, jacobian]) * nlp.scale, slopes(nlp, x)
        # Each function to its own size, for a constraint is 1e-3 of the objective.
        assert np.max(np.abs(exact - expected) / size[:, None]) < 3e-13


@pytest.mark.parametrize("name", CASES)
def test_hessians_of_objective_and_constraints_are_curvatures(name: str) -> None:
    nlp = program(name)
    count = len(nlp.program.constraints)
    size = sizes(nlp, points(nlp, 2))
    for x in points(nlp, 2):
        expected = curvatures(nlp, x)
        # Weight and multipliers one at a time, so that no function hides behind a larger one.
        for index, chosen in enumerate(np.eye(1 + count)):
            hessian = nlp.program.hessian(x, nlp.arguments, chosen[0], chosen[1:]).full()
            exact = hessian * np.outer(nlp.scale, nlp.scale)
            np.testing.assert_array_equal(exact, exact.T)
            assert np.max(np.abs(exact - expected[index])) < 1e-10 * size[index]


@pytest.mark.parametrize("name", CASES)
def test_hessians_are_slopes_of_gradients(name: str) -> None:
    # One order of differencing less than from the values, so two digits sharper: the worst seen is 2e-13. Weight and
    # multipliers are mixed.
    nlp = program(name)
    rng = np.random.default_rng(3)
    weight, multipliers = rng.normal(), rng.normal(size=len(nlp.program.constraints))

    def gradient(x: Array) -> Array:
        _, gradient, _, jacobian = (part.full() for part in nlp.program.derivatives(x, nlp.arguments))
        return (weight * gradient.ravel() + jacobian.T @ multipliers) * nlp.scale

    for x in points(nlp, 4):
        exact = nlp.program.hessian(x, nlp.arguments, weight, multipliers).full() * np.outer(nlp.scale, nlp.scale)
        for step, column in zip(np.diag(nlp.scale), exact.T, strict=True):
            expected = extrapolated(
                lambda h, x=x, d=step: (gradient(x + h * d) - gradient(x - h * d)) / (2 * h), 0.2, 5
            )
            size = np.max(np.abs(gradient(x))) + np.max(np.abs(exact))
            assert np.max(np.abs(column - expected)) < 2e-12 * size


@pytest.mark.parametrize("name", [name for name in CASES if "free, axis free" in name or "least" in name])
def test_the_limit_on_a_free_rotation_is_a_ball_with_exact_derivatives(name: str) -> None:
    nlp = program(name)
    names = [variable.name for variable in nlp.program.variables]
    at = [names.index(f"q_{axis}") for axis in "xyz"]
    unit = np.zeros((nlp.n, nlp.n))
    unit[at, at] = 1
    for x in points(nlp, 5):
        _, g = nlp.evaluate(x)
        np.testing.assert_allclose(g, [x[at] @ x[at]], rtol=4e-16)
        _, _, _, jacobian = nlp.program.derivatives(x, nlp.arguments)
        np.testing.assert_array_equal(jacobian.full(), [2 * unit @ x])
        np.testing.assert_array_equal(nlp.program.hessian(x, nlp.arguments, 0, 1).full(), 2 * unit)
    # |q| is the sine of half the angle, 1.2 at most and 0.3 at least where there is a least.
    assert nlp.g_upper == pytest.approx([math.sin(0.6) ** 2], rel=1e-15)
    assert nlp.g_lower == pytest.approx([math.sin(0.15) ** 2 if "least" in name else -math.inf], rel=1e-15)


def test_every_kind_of_variable_is_covered() -> None:
    free = {variable.name for name in CASES for variable in program(name).program.variables}
    assert {"x1", "x2", "x3", "x4", "p_x", "p_y", "p_z", "angle", "q_x", "q_y", "q_z", "base_2_x", "la"} <= free
    constraints = {constraint.name for name in CASES for constraint in program(name).program.constraints}
    assert constraints == {"angle", "close_a", "close_b"}
    # None of the programs is flat in one of its variables, which would make a wrong derivative right.
    for name in CASES:
        nlp = program(name)
        assert np.all(np.max(np.abs(slopes(nlp, points(nlp, 1)[0])), axis=0) > 1e-3)


def random_jacobian(seed: int, rows: int = 6, arm: float = 10.0) -> Array:
    """Unit forces through random points."""
    generator = np.random.default_rng(seed)
    f = generator.normal(size=(rows, 3))
    f /= np.linalg.norm(f, axis=1, keepdims=True)
    return np.hstack([f, np.cross(arm * generator.normal(size=(rows, 3)), f)])


def degenerate_jacobian(kind: str) -> Array:
    J = random_jacobian(7)
    generator = np.random.default_rng(8)
    if kind == "planar forces":  # no row resists the translation along z
        f = np.column_stack([generator.normal(size=(6, 2)), np.zeros(6)])
        f /= np.linalg.norm(f, axis=1, keepdims=True)
        return np.hstack([f, np.cross(generator.normal(size=(6, 3)), f)])
    if kind == "parallel forces":
        f = np.tile([0.6, 0.0, 0.8], (6, 1))
        return np.hstack([f, np.cross(generator.normal(size=(6, 3)), f)])
    if kind == "couples only":
        return np.hstack([np.zeros((3, 3)), generator.normal(size=(3, 3))])
    if kind in ("one row", "two rows"):
        return J[: 1 + (kind == "two rows")]
    if kind == "forces through a point":
        f = J[:, :3]
        return np.hstack([f, np.cross(np.array([1.0, 2.0, 3.0]), f)])
    return np.vstack([J, J[:2], random_jacobian(9, 3)])  # eleven rows, two of them twice


DEGENERATE = ["planar forces", "parallel forces", "couples only", "one row", "two rows", "forces through a point"]
DEGENERATE.append("many rows")
JACOBIANS = [pytest.param(random_jacobian(seed), id=f"random {seed}") for seed in range(6)]
JACOBIANS += [pytest.param(degenerate_jacobian(kind), id=kind) for kind in DEGENERATE]


def form(J: Array) -> Array:
    """The quadratic form of F in a twist (omega, v), built entry by entry from Eq. 14."""
    swapped = np.column_stack([J[:, 3:], J[:, :3]])
    return np.asarray(sum(np.outer(row, row) for row in swapped))


def spectrum(found: TaskAnalysis) -> tuple[Array, Array]:
    return np.array([m.F for m in found.rotations]), np.array([m.F for m in found.translations])


@pytest.mark.parametrize("seed", range(10))
def test_rotations_solve_the_generalised_eigenproblem(seed: int) -> None:
    J = random_jacobian(seed, arm=1.0)
    K, E = form(J), np.diag([1.0, 1, 1, 0, 0, 0])
    # K is regular: the three non-zero eigenvalues of K^-1 E are the inverses of F.
    inverse = np.sort(np.linalg.eigvals(np.linalg.solve(K, E)).real)[::-1][:3]
    rotations, _ = spectrum(analyse_tasks(J))
    np.testing.assert_allclose(rotations * inverse, 1, rtol=1e-12 * np.linalg.cond(K))
    for motion in analyse_tasks(J).rotations:
        left = K @ motion.twist - motion.F * E @ motion.twist
        np.testing.assert_allclose(left, 0, atol=1e-13 * np.linalg.norm(K) * np.linalg.norm(motion.twist))


@pytest.mark.parametrize("J", JACOBIANS)
def test_rotations_are_those_of_the_least_squares_translation(J: Array) -> None:
    # Project: with the best v for each unit omega, F is a form in omega; its matrix column by column from lstsq.
    left = np.column_stack(
        [J[:, 3:] @ e - J[:, :3] @ np.linalg.lstsq(J[:, :3], J[:, 3:] @ e, rcond=1e-9)[0] for e in np.eye(3)]
    )
    size = float(np.linalg.norm(J[:, 3:]) ** 2)
    rotations, _ = spectrum(analyse_tasks(J))
    np.testing.assert_allclose(rotations, np.linalg.eigvalsh(left.T @ left), atol=1e-13 * size)


@pytest.mark.parametrize("J", JACOBIANS)
def test_motions_are_as_they_say_and_translations_are_eigenvectors_of_the_forces(J: Array) -> None:
    found = analyse_tasks(J)
    K = form(J)
    for motion in (*found.rotations, *found.translations):
        size = float(np.linalg.norm(K) * np.sum(motion.twist**2))
        assert pytest.approx(float(motion.twist @ K @ motion.twist), abs=1e-14 * size) == motion.F
        assert motion.F >= 0
    omegas = np.array([motion.twist[:3] for motion in found.rotations])
    speeds = np.array([motion.twist[3:] for motion in found.translations])
    np.testing.assert_allclose(omegas @ omegas.T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(speeds @ speeds.T, np.eye(3), atol=1e-13)
    assert not np.any([motion.twist[:3] for motion in found.translations])
    for values in spectrum(found):
        assert np.all(np.diff(values) >= -1e-13 * np.linalg.norm(K))
    gram = np.asarray(sum(np.outer(row[:3], row[:3]) for row in J))
    np.testing.assert_allclose(spectrum(found)[1], np.linalg.eigvalsh(gram), atol=1e-14 * len(J))
    for motion in found.translations:
        np.testing.assert_allclose(gram @ motion.twist[3:], motion.F * motion.twist[3:], atol=1e-14 * len(J))


@pytest.mark.parametrize("J", JACOBIANS)
def test_no_motion_is_resisted_less_than_the_first(J: Array) -> None:
    found = analyse_tasks(J)
    generator = np.random.default_rng(3)
    omega = generator.normal(size=(20_000, 3))
    omega /= np.linalg.norm(omega, axis=1, keepdims=True)
    # Half of the twists anywhere, half near the best motion, where the least F would be crossed if it were wrong.
    v = generator.normal(size=(20_000, 3)) * 10.0 ** generator.uniform(-2, 2, size=(20_000, 1))
    first = found.rotations[0].twist
    near = first[:3] + 1e-2 * generator.normal(size=(10_000, 3))
    omega[10_000:] = near / np.linalg.norm(near, axis=1, keepdims=True)
    v[10_000:] = first[3:] + 1e-2 * generator.normal(size=(10_000, 3))
    F = np.sum((omega @ J[:, 3:].T + v @ J[:, :3].T) ** 2, axis=1)
    assert F.min() >= found.rotations[0].F - 1e-13 * np.linalg.norm(form(J))
    speeds = generator.normal(size=(20_000, 3))
    speeds /= np.linalg.norm(speeds, axis=1, keepdims=True)
    F = np.sum((speeds @ J[:, :3].T) ** 2, axis=1)
    assert F.min() >= found.translations[0].F - 1e-13
    assert F.max() <= found.translations[2].F + 1e-13


@pytest.mark.parametrize("J", JACOBIANS)
def test_every_principal_rotation_is_stationary(J: Array) -> None:
    def resistance(twist: Array) -> float:
        scaled = twist / np.concatenate([np.full(3, np.linalg.norm(twist[:3])), np.ones(3)])
        return float(np.sum((J[:, 3:] @ scaled[:3] + J[:, :3] @ scaled[3:]) ** 2))

    h = 1e-4
    for motion in analyse_tasks(J).rotations:
        size = float(np.linalg.norm(form(J)) * np.sum(motion.twist**2))
        for direction in np.eye(6):
            # F is quadratic but for the normalisation: central differences err by h^2 and by 1e-16 / h of its size.
            slope = (resistance(motion.twist + h * direction) - resistance(motion.twist - h * direction)) / (2 * h)
            assert abs(slope) < 1e-7 * size


def test_motions_that_no_force_resists_are_those_known_by_hand() -> None:
    found = analyse_tasks(degenerate_jacobian("planar forces"))
    assert found.translations[0].F < 1e-30
    np.testing.assert_allclose(np.abs(found.translations[0].twist), [0, 0, 0, 0, 0, 1], atol=1e-14)
    # Where no force stops a translation, the rotation that goes with it has none of it.
    for motion in found.rotations:
        assert abs(motion.twist[5]) < 1e-12
    found = analyse_tasks(degenerate_jacobian("forces through a point"))
    for motion in found.rotations:
        assert motion.F < 1e-28
        screw = axis_from_screw(motion.twist)
        assert abs(screw.pitch) < 1e-13
        assert np.linalg.norm(np.cross(np.array([1.0, 2.0, 3.0]) - screw.point, screw.axis)) < 1e-12


def test_the_frame_of_moments_does_not_matter() -> None:
    J = random_jacobian(11)
    moved = J.copy()
    moved[:, 3:] += np.cross(np.array([5.0, -7.0, 3.0]), J[:, :3])
    before, after = analyse_tasks(J), analyse_tasks(moved)
    # F among unit rotations with any v is the same about any point, though each v is another.
    np.testing.assert_allclose(spectrum(before)[0], spectrum(after)[0], rtol=1e-11)
    for one, other in zip(before.rotations, after.rotations, strict=True):
        # The same motion: with omega the same, v' = v - t x omega, up to the eigenvectors' condition.
        np.testing.assert_allclose(one.twist[:3], other.twist[:3], atol=1e-10)
        shifted = one.twist[3:] - np.cross(one.twist[:3], np.array([5.0, -7.0, 3.0]))
        np.testing.assert_allclose(other.twist[3:], shifted, atol=1e-9)


def test_the_snu_robot_has_two_free_rotations_about_horizontal_lines_where_the_limbs_meet() -> None:
    task, radii = Task.screw("min", axis=[0, 0, 1], point=[0, 0, 0], pitch=0), (0.57735, 0.288675)
    parameters = dict(zip(("base_radius", "platform_radius"), radii, strict=True))
    case = Case(models.three_upu(axes="snu"), parameters, [0, 0, 0.7], [task])
    nlp = formulate(case)
    found = analyse_tasks(evaluate(nlp, nlp.start).jacobian)
    for motion in found.rotations[:2]:
        assert motion.F < 1e-28
        screw = axis_from_screw(motion.twist)
        assert abs(screw.axis[2]) < 1e-13
        assert abs(screw.pitch) < 1e-13
        assert np.linalg.norm(np.cross(np.array([0, 0, 1.4]) - screw.point, screw.axis)) < 1e-13
    assert pytest.approx(3.0, rel=1e-13) == found.rotations[2].F
    np.testing.assert_allclose(found.rotations[2].twist, [0, 0, 1, 0, 0, 0], atol=1e-13)
    # Three symmetric limbs at this slope: sum s s' is diagonal, 3/2 of the squared run across and 3 of the rise along.
    run = 0.288675 / math.hypot(0.7, 0.288675)
    expected = sorted([1.5 * run**2, 1.5 * run**2, 3 * (1 - run**2)])
    np.testing.assert_allclose([motion.F for motion in found.translations], expected, rtol=1e-13)

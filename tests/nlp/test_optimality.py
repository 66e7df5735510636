"""The evidence against functions whose optima are known in closed form.

The programs here are made by hand around a CasADi expression, so nothing of the robots or of the solver is in play.
"""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.models import Dimension
from screwsynth.nlp import Nlp, PointKind, examine, formulate, load_case
from screwsynth.nlp.case.limits.constraint import Constraint, Reading
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.evidence.linalg import echelon_basis, nonnegative_least_squares
from screwsynth.nlp.program.places import Places, Scalar
from screwsynth.nlp.program.program import Program


def program_of(
    x: SX,
    objective: SX,
    sense: Sense,
    bounds: list[tuple[float, float]],
    constraints: list[tuple[str, SX, float, float]] | None = None,
) -> Nlp:
    donor = formulate(load_case("paper-4.1-helical"))
    rows = constraints or []
    program = Program(
        variables=tuple(Scalar(f"v{i}", Dimension.LENGTH) for i in range(x.numel())),
        arguments=(Scalar("unused", Dimension.NUMBER),),
        x=x,
        p=SX.sym("unused"),
        objective=objective,
        constraints=tuple(Constraint(name, g, Reading(Dimension.NUMBER)) for name, g, _, _ in rows),
        robots=donor.program.robots,
        model=donor.program.model,
        places=Places(numbers=(), rotations=(), unknowns=(), twists=()),
    )
    return Nlp(
        program=program,
        case=donor.case,
        sense=sense,
        arguments=np.zeros(1),
        lower=np.array([lower for lower, _ in bounds], dtype=float),
        upper=np.array([upper for _, upper in bounds], dtype=float),
        start=np.array([(lower + upper) / 2 for lower, upper in bounds], dtype=float),
        g_lower=np.array([lower for _, _, lower, _ in rows], dtype=float),
        g_upper=np.array([upper for _, _, _, upper in rows], dtype=float),
        size=1.0,  # the donor robot's size means nothing here
    )


def test_strict_minimum_inside() -> None:
    x = SX.sym("x", 2)
    nlp = program_of(x, (x[0] - 1) ** 2 + 4 * x[1] ** 2, Sense.MIN, [(-2, 2), (-2, 2)])
    evidence = examine(nlp, np.array([1.0, 0.0]))
    assert evidence.kind is PointKind.STRICT_MINIMUM
    # Half ranges are 2: second derivatives 2 and 8 in scaled variables are 8 and 32.
    np.testing.assert_allclose(evidence.eigenvalues, [8, 32])
    assert evidence.active == ()
    assert evidence.licq


def test_the_same_point_is_no_maximum() -> None:
    x = SX.sym("x", 2)
    nlp = program_of(x, (x[0] - 1) ** 2 + 4 * x[1] ** 2, Sense.MAX, [(-2, 2), (-2, 2)])
    assert examine(nlp, np.array([1.0, 0.0])).kind is PointKind.SADDLE


def test_not_stationary_away_from_the_optimum() -> None:
    x = SX.sym("x", 1)
    nlp = program_of(x, x**2, Sense.MIN, [(-1, 3)])
    evidence = examine(nlp, np.array([0.5]))
    assert evidence.kind is PointKind.NOT_STATIONARY
    assert evidence.stationarity == pytest.approx(2 * 0.5 * 2)


def test_a_bound_that_pushes_the_wrong_way_holds_nothing() -> None:
    x = SX.sym("x", 1)
    nlp = program_of(x, x**2, Sense.MIN, [(1, 3)])
    assert examine(nlp, np.array([1.0])).kind is PointKind.STRICT_MINIMUM
    assert examine(nlp, np.array([3.0])).kind is PointKind.NOT_STATIONARY


def test_multiplier_is_the_gain_per_unit_of_room() -> None:
    x = SX.sym("x", 2)
    nlp = program_of(x, 3 * x[0] - x[1] ** 2, Sense.MAX, [(0, 5), (-1, 1)])
    evidence = examine(nlp, np.array([5.0, 0.0]))
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    (side,) = evidence.active
    assert (side.name, side.bound, side.value) == ("v0", "max", 5.0)
    assert side.multiplier == pytest.approx(3)


@pytest.mark.parametrize("sense", list(Sense))
def test_multiplier_of_a_constraint_matches_the_optimal_value_function(sense: Sense) -> None:
    # On the disc |x|^2 <= c the linear function a.x ranges over +-|a| sqrt(c): d/dc = |a| / (2 sqrt(c)).
    x, a, c = SX.sym("x", 2), np.array([3.0, 4.0]), 4.0
    nlp = program_of(x, ca.dot(ca.DM(a), x), sense, [(-9, 9), (-7, 7)], [("disc", ca.sumsqr(x), -np.inf, c)])
    point = a / 5 * 2 * (1 if sense is Sense.MAX else -1)
    evidence = examine(nlp, point)
    assert evidence.kind in (PointKind.STRICT_MAXIMUM, PointKind.STRICT_MINIMUM)
    (side,) = evidence.active
    assert side.multiplier == pytest.approx(5 / (2 * 2))
    assert evidence.eigenvalues.shape == (1,)


def test_an_equation_is_active_and_its_multiplier_may_be_negative() -> None:
    # min |x|^2 on x0 + x1 = 2 is 2 at (1, 1); with right-hand side r it is r^2 / 2, which grows by 2 per unit.
    x = SX.sym("x", 2)
    nlp = program_of(x, ca.sumsqr(x), Sense.MIN, [(-5, 5), (-4, 4)], [("sum", x[0] + x[1], 2.0, 2.0)])
    evidence = examine(nlp, np.array([1.0, 1.0]))
    assert evidence.kind is PointKind.STRICT_MINIMUM
    (side,) = evidence.active
    assert side.bound == "equal"
    assert side.multiplier == pytest.approx(-2)  # improvement of a minimum: minus its growth


def test_outside_a_limit_is_infeasible_and_names_it() -> None:
    x = SX.sym("x", 2)
    nlp = program_of(x, x[0], Sense.MAX, [(-9, 9), (-9, 9)], [("disc", ca.sumsqr(x), -np.inf, 1.0)])
    evidence = examine(nlp, np.array([1.5, 0.0]))
    assert evidence.kind is PointKind.INFEASIBLE
    assert evidence.violated == ("disc",)


def test_a_manifold_of_minima_is_not_isolated_and_its_direction_is_named() -> None:
    x = SX.sym("x", 3)
    nlp = program_of(x, (x[0] * x[1] - 1) ** 2, Sense.MIN, [(0.1, 4), (0.1, 4), (-1, 1)])
    evidence = examine(nlp, np.array([1.0, 1.0, 0.3]))
    assert evidence.kind is PointKind.NOT_ISOLATED
    directions = [dict(direction) for direction in evidence.flat]
    assert {frozenset(direction) for direction in directions} == {frozenset({"v2"}), frozenset({"v0", "v1"})}
    tangent = next(direction for direction in directions if "v0" in direction)
    assert tangent["v0"] == pytest.approx(-tangent["v1"])


def test_a_quartic_minimum_is_not_called_flat() -> None:
    x = SX.sym("x", 1)
    nlp = program_of(x, x**4, Sense.MIN, [(-1, 1)])
    evidence = examine(nlp, np.array([0.0]))
    assert evidence.kind is PointKind.UNDECIDED
    assert evidence.flat == ()


def test_flat_directions_of_a_quartic_valley_are_the_valley_s() -> None:
    x = SX.sym("x", 3)
    nlp = program_of(x, (x[0] - x[1]) ** 4, Sense.MIN, [(-1, 1), (-1, 1), (-1, 1)])
    evidence = examine(nlp, np.array([0.1, 0.1, 0.2]))
    assert evidence.kind is PointKind.NOT_ISOLATED
    directions = [dict(direction) for direction in evidence.flat]
    assert {frozenset(direction) for direction in directions} == {frozenset({"v2"}), frozenset({"v0", "v1"})}
    along = next(direction for direction in directions if "v0" in direction)
    assert along["v0"] == pytest.approx(along["v1"], rel=0.05)


def test_a_minimum_of_a_quartic_on_a_bound_is_no_maximum() -> None:
    x = SX.sym("x", 1)
    nlp = program_of(x, (1 + x**2) ** 2, Sense.MAX, [(0, 1)])
    assert examine(nlp, np.array([0.0])).kind is PointKind.SADDLE


def test_dependent_active_normals_lose_licq_and_still_certify() -> None:
    # x0 <= 1 stands twice: as a bound and as a constraint.
    x = SX.sym("x", 2)
    nlp = program_of(x, x[0] - x[1] ** 2, Sense.MAX, [(-1, 1), (-1, 1)], [("again", x[0], -np.inf, 1.0)])
    evidence = examine(nlp, np.array([1.0, 0.0]))
    assert not evidence.licq
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    assert sum(side.multiplier for side in evidence.active) == pytest.approx(1)


def test_at_a_vertex_there_is_no_direction_left() -> None:
    x = SX.sym("x", 2)
    nlp = program_of(x, x[0] + 2 * x[1], Sense.MAX, [(0, 1), (0, 1)])
    evidence = examine(nlp, np.array([1.0, 1.0]))
    assert evidence.kind is PointKind.STRICT_MAXIMUM
    assert evidence.eigenvalues.size == 0


def test_nonnegative_least_squares_satisfies_its_optimality_conditions() -> None:
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


def test_echelon_basis_spans_the_same_space() -> None:
    generator = np.random.default_rng(6)
    for _ in range(50):
        vectors = generator.normal(size=(3, 6))
        basis = echelon_basis(vectors)
        assert np.linalg.matrix_rank(np.vstack([vectors, basis]), tol=1e-9) == 3
        assert np.abs(basis).max() == 1

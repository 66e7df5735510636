"""Parts of the checkers by themselves: rounding, steps, signs and orders of boxes, on which few whole proofs depend."""

from fractions import Fraction
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.bisection import show
from screwsynth.nlp.proof.checker.optimum import Claims, rule_of
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace.closed_loops import Assembly, LoopPoints
from screwsynth.nlp.proof.checker.workspace.loop_claims import PosedLoops
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot
from screwsynth.nlp.proof.checker.workspace.pose_boxes import pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import RankClaim
from screwsynth.nlp.proof.statement.machine import workspace_of_case
from screwsynth.nlp.proof.statement.standard_form import StandardForm


def test_small_coefficients_next_to_a_constant_are_not_lost() -> None:
    """``((1 + sum x) y - 1) z^3`` with every x below the rounding of 1: all of it is left when 1 is taken off."""
    m, r = 20, 1.1e-16
    x = SX.sym("x", m + 2)
    turned = (1 + ca.sum1(x[:m])) * x[m] - 1
    function = ca.Function("f", [x], [turned * (x[m + 1] * x[m + 1] * x[m + 1]), turned])
    radius = np.repeat([[r]] * m + [[0.0], [1.0]], 3, axis=1)
    centre = np.repeat([[0.0]] * m + [[1.0], [0.0]], 3, axis=1)
    product, factor = PolynomialArithmetic(function)(centre - radius, centre + radius)
    assert (product.V[0] <= -m * r).all()
    assert (product.V[1] >= m * r).all()
    np.testing.assert_allclose(factor.size, m * r)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_size_of_a_polynomial_is_that_of_its_coefficients(seed: int) -> None:
    rng, x = np.random.default_rng(seed), SX.sym("x", 3)
    Q, b = (ca.DM(rng.normal(size=shape)) for shape in ((3, 3), (3, 1)))
    polynomial = ca.bilin(Q, x, x) + ca.dot(b, x)
    outputs = [polynomial, polynomial + 1e8, (polynomial + 1e8) * x[0] - 1e8, (polynomial - 0.7) / (x[1] + 3) + 0.3]
    width = 10.0 ** rng.uniform(-9, -1, (3, 40))
    lower = np.array([[1.0], [0.3], [-0.5]]) - width * rng.random((3, 40))
    for value in PolynomialArithmetic(ca.Function("f", [x], outputs))(lower, lower + width):
        for k, size in enumerate(value.size):
            exact = sum(abs(Fraction(float(each))) for each in value.P[:, k])
            assert abs(Fraction(float(size)) - exact) <= exact * Fraction(1e-12)


def test_a_step_is_known_where_its_argument_has_one_sign() -> None:
    rng, x = np.random.default_rng(3), SX.sym("x", 2)
    # Quarters, of which differences are exact and never 0.
    lower = rng.integers(-6, 6, (2, 300)) / 4 + np.array([[0.125], [0.0]])
    upper = lower + rng.integers(0, 4, (2, 300)) / 4
    least, most = lower[1] - upper[0], upper[1] - lower[0]
    expected = np.where(least > 0, 1.0, 0.0), np.where(most < 0, 0.0, 1.0)
    known = expected[0] == expected[1]
    assert 50 < known.sum() < 250
    for expression, low, high in ((x[0] <= x[1], 0.0, 1.0), (ca.sign(x[1] - x[0]), -1.0, 1.0)):
        function = ca.Function("f", [x], [expression])
        (value,) = PolynomialArithmetic(function)(lower, upper)
        for end, of_value in zip(expected, value.V, strict=True):
            np.testing.assert_allclose(of_value, low + (high - low) * end, atol=1e-14)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_bounds_of_a_limb_are_shown_for_the_boxes_claimed(count: int, side: int) -> None:
    """As many boxes as variables, too: along both the square rises, or falls, and a box has its bound at a corner."""
    x, rng = SX.sym("x", 2), np.random.default_rng(count)
    function = (5 + side * (x[0] + 2 * x[1])) ** 2 / (4 - side * x[0])
    nlp = formulate(load_case("paper-4.2-rotation"))
    form = StandardForm(nlp, x, -np.ones(2), np.ones(2), (function,), ())
    for _ in range(5):
        lower = rng.uniform(-1, 0.8, (count, 2))
        upper = lower + rng.uniform(0.01, 0.2, (count, 2))
        corner = upper if side > 0 else -lower
        highest = float(((5 + corner[:, 0] + 2 * corner[:, 1]) ** 2 / (4 - corner[:, 0])).max())
        for more, is_shown in ((1e-6, True), (-1e-6, False)):
            bounds = np.full(count, highest + more)
            claims = Claims(form, Node.BOUNDED, 0, lower.T, upper.T, bounds)
            if is_shown:
                assert show(rule_of(claims), claims.lower, claims.upper) >= count
            else:
                with pytest.raises(ProofError, match="could not be shown"):
                    show(rule_of(claims), claims.lower, claims.upper)


def sign_of(block: np.ndarray) -> int:
    """The sign of the determinant of a matrix (2, 2), in fractions."""
    a, b, c, d = (Fraction(float(each)) for each in block.ravel())
    return (a * d > b * c) - (a * d < b * c)


def test_no_points_are_closed() -> None:
    """A block of pairs of boxes may have been tied already, every one."""
    case = load_case("hexapod-linuxcnc")
    robot = PosedRobot(case, case.model, pose_root(workspace_of_case(case)))
    points = LoopPoints(robot, robot.z[:2])
    assert points.closed(np.zeros((0, 6)), [0, 1], to=np.zeros((0, 4)), steps=2).shape == (0, 6)


def test_ways_to_closed_points_stay_between_their_ends() -> None:
    """On a unit circle, from the top or the bottom to the side: beyond it there are no points."""
    z = SX.sym("z", 2)
    points = LoopPoints(SimpleNamespace(size=np.ones(2), z=z), ca.sumsqr(z) - 1)  # type: ignore[arg-type]
    angle = np.random.default_rng(0).uniform(-0.5, 0.5, 40)
    begin = np.stack([np.sin(angle), np.repeat([1.0, -1.0], 20) * np.cos(angle)], axis=1)
    found = points.closed(begin, [1], np.full((40, 1), 0.8), steps=4)
    assert found == pytest.approx(np.stack([np.full(40, 0.8), np.repeat([0.6, -0.6], 20)], axis=1))


@pytest.mark.parametrize("size", [2.0**-40, 1.0, 2.0**40])
def test_the_sign_of_a_nearly_singular_matrix_is_right_or_unknown(size: float) -> None:
    """Two rows are parallel but for rounding, and the sign of the computed inverse is wrong."""
    rng, case = np.random.default_rng(1), load_case("hexapod-linuxcnc")
    robot = PosedRobot(case, case.model, pose_root(workspace_of_case(case)))
    loops, at = PosedLoops(robot, robot.centre, Assembly(robot, SX(0, 1), robot.centre), 0.0), np.zeros((1, 6))

    def shown(block: np.ndarray) -> int:
        M = np.eye(6)
        M[4:, 4:] = block
        return RankClaim(loops, SX(ca.DM(size * M)), 0)._signs_at(at)[0]

    row, factor = rng.normal(size=(4000, 2)), rng.normal(size=4000)
    blocks = np.stack([row, factor[:, None] * row], axis=1)
    blocks = blocks[np.linalg.det(blocks) != 0]
    wrong = [each for each in blocks if sign_of(np.linalg.inv(each)) != sign_of(each)]
    assert len(wrong) > 100
    for block in wrong[:150]:
        assert shown(block) in (0, sign_of(block))
    for block in rng.normal(size=(20, 2, 2)):
        assert shown(block) == sign_of(block)

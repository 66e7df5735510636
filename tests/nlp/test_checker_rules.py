"""Rules and parts of the checkers one by one, and proofs by limbs that share variables."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from limb_cases import machine, poses, separated

from screwsynth.models.arrays import FloatArray, values_at
from screwsynth.nlp import Case, CertificateStatus, Free, Nlp, Rotation, Search, certify_program, formulate, load_case
from screwsynth.nlp.proof.boxes.limbs import shared as sharedsearch
from screwsynth.nlp.proof.boxes.limbs.decomposition import LimbBound, bound_limb, first_largest_of_lists
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.bisection import Shown, show
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.optimum import Claims, rule_of
from screwsynth.nlp.proof.checker.polymodels import Tilts, forms_of, polynomial_sum
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import ProofClaim, ProofError
from screwsynth.nlp.proof.checker.tree import Node, SharedLeaves, leaf_bytes, read_shared
from screwsynth.nlp.proof.checker.workspace.closed_loops import Assembly, LoopPoints
from screwsynth.nlp.proof.checker.workspace.loop_claims import PosedLoops
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot
from screwsynth.nlp.proof.checker.workspace.number_claims import change_of_jacobian
from screwsynth.nlp.proof.checker.workspace.pose_boxes import pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import RankClaim, change_of_rows
from screwsynth.nlp.proof.statement.fixed_robot import Legs, workspace_of_case
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm, standard_form
from screwsynth.nlp.solver.multistart import ProgramSolution, solve_program


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.mark.parametrize("length", [1e6, 1.0, 1e-3], ids=["forces", "both", "moments"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_change_of_the_jacobian_is_nearly_reached(seed: int, length: float) -> None:
    """Legs of equal length that point to the platform's origin: both errors of a leg turn its force and its moment."""
    rng, t, leg = np.random.default_rng(seed), 1e-3, 10.0
    n = unit(rng.normal(size=(6, 3)))
    platform = -rng.uniform(1, 4, (6, 1)) * n
    base = platform - leg * n
    across = unit(np.cross(n, rng.normal(size=(6, 3))))

    def jacobian(e: np.ndarray, f: np.ndarray) -> np.ndarray:
        direction = unit(platform + f - base - e)
        return np.concatenate([direction, np.cross(platform + f, direction) / length], axis=1)

    nothing = np.zeros((6, 3))
    reached = np.linalg.norm(jacobian(-t * across, t * across) - jacobian(nothing, nothing))
    bound = change_of_jacobian(Legs(base, platform), t, length, leg - 2 * t)
    assert reached <= bound <= 1.001 * reached


def test_errors_that_take_up_a_leg_have_no_bound() -> None:
    joints = Legs(np.zeros((6, 3)), np.ones((6, 3)))
    assert change_of_jacobian(joints, 1.0, 1.0, 0.0) == np.inf
    assert change_of_jacobian(joints, 1.0, 1.0, 0.1) < np.inf


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_change_of_the_rows_is_nearly_reached(seed: int) -> None:
    rng, t = np.random.default_rng(seed), 1e-4
    base, platform = rng.uniform(-10, 10, (6, 3)), rng.uniform(-5, 5, (6, 3))
    s, u, span = 1.3, 1.3 * platform, rng.uniform((-3, -3, 9), (3, 3, 15)) - base
    change = change_of_rows(np.array([s]), np.abs(span)[None], np.abs(u)[None], t)[0]
    for k in range(3):
        # f x d has the component f.(d x e_k), and u x e the component e.(e_k x u).
        axis = np.eye(3)[k]
        f, e = t * unit(np.cross(span, axis)), -t * unit(np.cross(axis, u))
        moment = s * np.cross(f, span) - np.cross(u, e) - s * np.cross(f, e)
        assert (np.abs(moment[:, k]) <= change[:, 3 + k]).all()
        assert (change[:, 3 + k] <= 1.001 * np.abs(moment[:, k])).all()
    assert (change[:, :3] >= 2 * s * t).all()
    assert (change[:, :3] <= 1.001 * 2 * s * t).all()
    other = change_of_rows(np.array([s]), np.abs(span)[None], np.abs(u)[None], t, 2.0)[0]
    np.testing.assert_allclose(other * [1, 1, 1, 2, 2, 2], change, rtol=1e-12)


@pytest.mark.parametrize(
    ("term", "low"),
    [
        ("v[0]**2 / v[1]", (1.0, 0.0)),
        ("v[0]**2 / v[1]", (1.0, -1.0)),
        ("v[0]**2 / ca.exp(400 * v[1])", (1.0, 0.0)),
        ("(1 / v[0])**2 / v[1]", (0.0, 1.0)),
        ("ca.log(v[0])**2 / v[1]", (0.0, 1.0)),
    ],
    ids=["D is 0", "D is negative", "D has no end", "N has no end", "N has no value"],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_square_without_a_value_proves_nothing(term: str, low: tuple[float, float], sign: float) -> None:
    x = SX.sym("x", 2)
    function = sign * eval(term, {"v": x, "ca": ca})  # noqa: S307 - one of those above
    lower, upper = np.array([low, (1.0, 1.0)]).T, np.array([(2.0, 2.0), (1.5, 1.5)]).T
    (value,) = PolynomialArithmetic(ca.Function("f", [x], [function + x[1]]))(lower, upper)
    np.testing.assert_array_equal(np.isnan(value.s), [True, False])
    for end in value.V:
        np.testing.assert_array_equal(np.isnan(end), [True, False])


#: Numbers of the random forms: variables, boxes of each, and points in each box.
N, BOXES, POINTS = 3, 60, 400


def random_form(seed: int, is_equation: bool) -> StandardForm:
    """Two functions, and two conditions: one on the first two variables alone, and ``z - p`` of these."""
    rng, x = np.random.default_rng(seed), SX.sym("x", N)

    def polynomial(some: SX) -> SX:
        Q, b = (ca.DM(rng.normal(size=shape)) for shape in ((some.numel(), some.numel()), (some.numel(), 1)))
        return ca.dot(b, some) + 0.5 * ca.bilin(Q + Q.T, some, some) + 0.3 * ca.sin(some[0] * some[1])

    nlp = formulate(load_case("paper-4.2-rotation"))
    functions = (polynomial(x) + 4 * x[0], polynomial(x) + 4 * x[0])
    conditions = (
        Condition("cap", polynomial(x[:2]) - 0.5, is_equation=False),
        Condition("relation", x[2] - 0.3 * polynomial(x[:2]), is_equation=is_equation),
    )
    return StandardForm(nlp, x, -np.ones(N), np.ones(N), functions, conditions)


def attempt(
    form: StandardForm, kind: Node, index: int, boxes: "Sampled", bound: float = 0.0, tilts: Tilts | None = None
) -> Shown:
    """What the rule of a claim shows of boxes, each of which is claimed."""
    count = boxes.lower.shape[1]
    claims = Claims(form, kind, index, boxes.lower, boxes.upper, np.full(count, bound), tilts)
    with np.errstate(all="ignore"):
        return rule_of(claims).examine(boxes.lower, boxes.upper, np.arange(count))


class Sampled:
    """Feasible points of random boxes of a form, with its expressions and their derivatives."""

    def __init__(self, seed: int, is_equation: bool) -> None:
        self.form, rng = random_form(seed, is_equation), np.random.default_rng(seed)
        width = 10.0 ** rng.uniform(-2.5, 0, (N, BOXES))
        at_end = rng.random((N, BOXES)) < 0.3
        low = np.where(at_end, 1 - 2 * width, rng.uniform(-1, 1, (N, BOXES)) * (1 - width) - width)
        self.lower, self.upper = np.maximum(low, -1.0), np.minimum(low + 2 * width, 1.0)
        share = rng.random((POINTS, N, BOXES))
        share[::3] = np.round(share[::3])
        points = self.lower + share * (self.upper - self.lower)
        function = ca.Function("all", [self.form.x], [self.form.expressions, ca.vec(self.form.jacobian)])
        if is_equation:
            h = np.array(function(np.moveaxis(points, 1, 0).reshape(N, -1))[0])[3].reshape(POINTS, BOXES)
            points[:, 2] -= h
        inside = ((points >= self.lower) & (points <= self.upper)).all(axis=1)
        values, slopes = (np.array(each) for each in function(np.moveaxis(points, 1, 0).reshape(N, -1)))
        self.values = values.reshape(4, POINTS, BOXES)
        self.slopes = slopes.reshape(N, 4, POINTS, BOXES)
        kept = np.abs(self.values[3]) < 1e-12 if is_equation else self.values[3] <= 0
        self.points, self.inside, self.feasible = points, inside, inside & kept & (self.values[2] <= 0)

    def left(self, shown: Shown) -> np.ndarray:
        """Which points (POINTS, BOXES) are in what is left of their boxes."""
        room = 1e-12
        return ((self.points >= shown.lower - room) & (self.points <= shown.upper + room)).all(axis=1)


CASES = [(seed, is_equation) for seed in range(3) for is_equation in (False, True)]


@pytest.mark.parametrize(("seed", "is_equation"), CASES)
def test_what_is_left_of_boxes_holds_all_points_above_a_bound(seed: int, is_equation: bool) -> None:
    some = Sampled(seed, is_equation)
    least = np.where(some.feasible, some.values[:2].min(axis=0), -np.inf)
    known = least[np.isfinite(least)]
    cuts = holds = 0
    for bound in np.quantile(known, [0.02, 0.3, 0.6, 0.9, 0.999, 1.0]):
        shown = attempt(some.form, Node.BOUNDED, 0, some, float(bound))
        above = least > bound + 1e-9
        assert (some.left(shown) | ~above).all()
        assert not (shown.holds & above.any(axis=0)).any()
        holds += int(shown.holds.sum())
        cuts += int(((shown.lower > some.lower) | (shown.upper < some.upper)).any(axis=0).sum())
    assert holds > 40
    assert cuts > 15


@pytest.mark.parametrize(("seed", "is_equation"), CASES)
def test_what_is_left_of_boxes_holds_all_points_that_keep_a_condition(seed: int, is_equation: bool) -> None:
    some, holds = Sampled(seed, is_equation), 0
    for r in (2, 3):
        shown = attempt(some.form, Node.INFEASIBLE, r, some)
        keeps = some.feasible | (some.values[r] <= 0) if r == 2 or not is_equation else some.feasible
        keeps &= some.inside
        assert (some.left(shown) | ~keeps).all()
        assert not (shown.holds & keeps.any(axis=0)).any()
        holds += int(shown.holds.sum())
    assert holds > 5


@pytest.mark.parametrize(("seed", "is_equation"), CASES)
def test_a_function_rises_where_its_box_is_claimed_to_be_monotone(seed: int, is_equation: bool) -> None:
    some, holds = Sampled(seed, is_equation), 0
    depends = some.form.dependence
    for i in range(N):
        for kind in (Node.MONOTONE, Node.FACE_UPPER, Node.FACE_LOWER):
            shown = attempt(some.form, kind, i, some)
            assert (some.left(shown) | ~some.feasible | shown.holds).all()
            rises = np.zeros(BOXES, dtype=bool)
            for side in {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(kind, (1, -1)):
                own = ((side * some.slopes[i, :2] > 0) | ~some.inside).all(axis=(0, 1))
                for r in (2, 3):
                    if depends[r][i]:
                        free = ((some.values[r] < 0) | ~some.inside).all(axis=0)
                        if r == 2 or not is_equation:
                            free |= ((side * some.slopes[i, r] < 0) | ~some.inside).all(axis=0)
                        own &= free
                if kind == Node.MONOTONE:
                    own &= some.upper[i] < 1 if side > 0 else some.lower[i] > -1
                rises |= own
            # Without a feasible point any claim holds.
            assert not (shown.holds & ~rises & some.feasible.any(axis=0)).any()
            holds += int(shown.holds.sum())
    assert holds > 30


@pytest.mark.parametrize(("seed", "is_equation"), CASES)
def test_a_limb_collapses_on_faces_to_which_it_rises(seed: int, is_equation: bool) -> None:
    """The first variable is shared. A feasible point above the bound moves to what is left, where it is both too."""
    some = Sampled(seed, is_equation)
    form = replace(some.form, functions=some.form.functions[:1])
    flat = Tilts.over(some.lower[:1], some.upper[:1], np.zeros((1, BOXES)), np.zeros((1, 1, BOXES)))
    function, collapsed = ca.Function("all", [form.x], [form.expressions]), 0
    for bound in np.quantile(some.values[0], [0.01, 0.1, 0.5]):
        shown = attempt(form, Node.BOUNDED, 0, some, float(bound), flat)
        moved = np.clip(some.points, shown.lower, shown.upper)
        values = np.array(function(np.moveaxis(moved, 1, 0).reshape(N, -1))).reshape(3, POINTS, BOXES)
        above = some.feasible & (some.values[0] > bound + 1e-9)
        assert (np.abs(moved - some.points)[:, 0] < 1e-12)[above].all()
        assert (values[0] >= some.values[0] - 1e-12)[above].all()
        assert (values[1] <= 1e-12)[above].all()
        assert ((np.abs(values[2]) if is_equation else values[2]) <= 1e-12)[above].all()
        faces = (shown.lower == shown.upper) & (some.lower < some.upper) & ~shown.holds
        assert not faces[0].any()
        collapsed += int(faces.sum())
    # Every variable is in the equation, which stops all points.
    assert (collapsed == 0) if is_equation else (collapsed > 20)


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
                with pytest.raises(ProofError, match="could not be proved"):
                    show(rule_of(claims), claims.lower, claims.upper)


def sign_of(block: np.ndarray) -> int:
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

    def of(expression: SX) -> Callable[[FloatArray], list[FloatArray]]:
        function = ca.Function("values", [z], [ca.densify(expression)])
        return lambda at: values_at(function, at)

    robot = SimpleNamespace(size=np.ones(2), function=of, slopes=lambda g: lambda at: of(ca.jacobian(g, z))(at)[0])
    points = LoopPoints(robot, ca.sumsqr(z) - 1)  # type: ignore[arg-type]
    angle = np.random.default_rng(0).uniform(-0.5, 0.5, 40)
    begin = np.stack([np.sin(angle), np.repeat([1.0, -1.0], 20) * np.cos(angle)], axis=1)
    found = points.closed(begin, [1], np.full((40, 1), 0.8), steps=4)
    assert found == pytest.approx(np.stack([np.full(40, 0.8), np.repeat([0.6, -0.6], 20)], axis=1))


@pytest.mark.parametrize("size", [2.0**-40, 1.0, 2.0**40])
def test_the_sign_of_a_nearly_singular_matrix_is_right_or_unknown(size: float) -> None:
    """Two rows are parallel but for rounding, and the sign of the computed inverse is wrong."""
    rng, case = np.random.default_rng(1), load_case("hexapod-linuxcnc")
    robot = PosedRobot(case, case.model, pose_root(workspace_of_case(case)))
    loops, at = PosedLoops(robot, robot.centre, Assembly(robot, SX(0, 1), robot.centre), 0.0, ()), np.zeros((1, 6))

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


GAP = 1e-2


def near_home() -> Case:
    """The hexapod with 36 free joint coordinates, and its pose free by a little."""
    case = machine(2.0)
    position: list[object] = [Free(-0.3, 0.3), Free(-0.3, 0.3), Free(19.8, 20.2)]
    rotation = Rotation(axis=None, angle=Free(-0.0175, 0.0175))
    return Case(case.model, case.parameters, position, case.tasks, rotation=rotation)


def proof_of(nlp: Nlp, gap: float, x: np.ndarray | None = None) -> ProofClaim:
    """The proof that a search records, whatever it is worth."""
    recorder = TreeRecord()
    found = certify_program(nlp, x, gap=gap, jobs=1, recorder=recorder)
    assert found.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    bound = None if found.status is CertificateStatus.INFEASIBLE else -nlp.sign * found.bound
    return ProofClaim("limbs", "", "program", bound, fingerprint(nlp), recorder.tree())


@pytest.fixture(scope="module")
def best() -> ProgramSolution:
    return solve_program(formulate(near_home()), Search(starts=1))


@pytest.fixture(scope="module")
def nlp(best: ProgramSolution) -> Nlp:
    return best.nlp


@pytest.fixture(scope="module")
def proof(best: ProgramSolution) -> ProofClaim:
    return proof_of(best.nlp, GAP, best.x)


def middle_leaf(proof: ProofClaim, nlp: Nlp) -> SharedLeaves:
    """The leaf whose box is nearest to home's rotation, in which poses are feasible."""
    _, found = separated(nlp.case)
    (leaves,) = read_shared(proof.tree, found.common.lower, found.common.upper, len(found.limbs))
    leaves = leaves.select(np.isfinite(leaves.bounds).all(axis=0))
    away = np.linalg.norm(np.clip(0.0, leaves.lower[3:], leaves.upper[3:]), axis=0)
    return SharedLeaves(*(each[..., away.argmin()] for each in leaves))


def rejected(proof: ProofClaim, nlp: Nlp) -> str:
    with pytest.raises(ProofError) as caught:
        check_proof(proof, nlp)
    return str(caught.value)


def test_a_proof_by_limbs_that_share_variables_holds(proof: ProofClaim, nlp: Nlp) -> None:
    assert proof.tree[0] == Node.SHARED
    checked = check_proof(proof, nlp)
    assert checked.leaves > 1
    assert checked.bound == proof.bound


def test_boxes_outside_of_the_ball_of_rotations_are_shown_by_it(best: ProgramSolution) -> None:
    """Beyond the ball the sum of the limbs is above the bound, which needs small boxes."""
    proof = proof_of(best.nlp, 5e-4, best.x)
    assert bytes([Node.INFEASIBLE]) in proof.tree
    assert check_proof(proof, best.nlp).bound == proof.bound


def test_what_was_tampered_with_is_rejected(proof: ProofClaim, nlp: Nlp) -> None:
    size = abs(proof.bound)
    for less in (2 * GAP, 0.7 * GAP):
        assert "could not be proved" in rejected(replace(proof, bound=proof.bound - less * size), nlp)
    leaf = middle_leaf(proof, nlp)
    node = leaf_bytes(leaf.bounds, leaf.g, leaf.Q)
    assert "ends before" in rejected(replace(proof, tree=proof.tree.replace(node, b"")), nlp)
    assert "additional data after its last box" in rejected(replace(proof, tree=proof.tree + node), nlp)
    assert "does not exist" in rejected(replace(proof, tree=bytes([Node.SHARED, Node.HALF, 6])), nlp)
    assert "a node" in rejected(replace(proof, tree=bytes([Node.SHARED, Node.FACE_UPPER, 0])), nlp)
    nothing = replace(proof, tree=proof.tree.replace(node, bytes([Node.INFEASIBLE])))
    assert "sum of the limbs" in rejected(nothing, nlp)

    # Other numbers in one leaf: a limb's bound, a tilt, two limbs exchanged, no feasible limb, and no number.
    (b, g, Q), swap = (leaf.bounds, leaf.g, leaf.Q), [3, 1, 2, 0, *range(4, len(leaf.bounds))]
    off, tilted, unknown = np.zeros(len(b)), g.copy(), g.copy()
    off[2], tilted[1, 0], unknown[0, 0] = 0.02 * size, g[1, 0] + 0.05 * size, np.nan
    empty = np.where(np.arange(len(b)) == 4, -np.inf, np.inf)
    for numbers, fault in (
        ((b - off, g, Q), "limb with base_3"),
        ((b + off, g, Q), "sum of the limbs"),
        ((b, tilted, Q), "could not be proved"),
        ((b[swap], g[swap], Q[swap]), "could not be proved"),
        ((empty, g, Q), "could not be proved"),
        ((b, unknown, Q), "not a finite number"),
    ):
        assert proof.tree.count(node) == 1
        assert fault in rejected(replace(proof, tree=proof.tree.replace(node, leaf_bytes(*numbers))), nlp)


def test_proofs_of_several_poses_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limbs with conditions of their own, maximum and minimum, with limits and without."""
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    for seed in (0, 7):
        nlp = formulate(poses(seed))
        proof = proof_of(nlp, 1e-2)
        assert proof.tree[0] == Node.SHARED
        check_proof(proof, nlp)


def test_a_limb_without_a_feasible_point_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    nlp = formulate(poses(2))
    places = [i for i, name in enumerate(standard_form(nlp).names) if i in separated(nlp.case)[1].limbs[0].own]
    # Legs of at most 34 mm do not reach so far.
    far = np.array(nlp.lower)
    far[places] += 100.0
    proof = proof_of(replace(nlp, lower=far, upper=np.array(nlp.upper) + (far - nlp.lower)), 1e-2)
    assert proof.bound is None
    assert check_proof(proof, replace(nlp, lower=far, upper=np.array(nlp.upper) + (far - nlp.lower))).leaves == 1


@pytest.mark.parametrize("part", [0.01, 0.03])
def test_a_fault_in_dropping_own_boxes_is_found(
    monkeypatch: pytest.MonkeyPatch, best: ProgramSolution, part: float
) -> None:
    """Own boxes are dropped for a value at the good point that is too large by a part of itself."""

    def careless(*given: object) -> LimbBound:
        found = bound_limb(*given)  # type: ignore[arg-type]
        own = found.own
        reached = found.reached + part * np.abs(found.reached)
        bounds = np.where(found.bounds < reached[own.of], -np.inf, found.bounds)
        best = np.maximum.reduceat(bounds, own.starts)
        return replace(found, bounds=bounds, best=best, top=first_largest_of_lists(bounds, own))

    monkeypatch.setattr(sharedsearch, "bound_limb", careless)
    wrong = proof_of(best.nlp, GAP, best.x)
    assert "could not be proved" in rejected(wrong, best.nlp)


@pytest.mark.parametrize("kind", ["limb", "minus limb", "zeros", "minus zeros"])
def test_models_of_limbs_minus_tilts_bound_every_point(kind: str) -> None:
    """phi_k - t_k at random points of random pieces of random boxes, for both signs of the squared quotients."""
    _, found = separated(near_home())
    m, limb = len(found.shared), found.limbs[1].form
    function, sign = limb.functions[0] + 3 * limb.x[0], -1.0 if kind.startswith("minus") else 1.0
    if "zeros" in kind:
        # A numerator that is 0 in every box, where the square of its error is most of the quotient.
        e = limb.x - 0.5 * (limb.lower + limb.upper)
        function = (e[6] * e[7] + 0.1 * e[8] + e[9] * e[6]) ** 2 / (9 + e[6] ** 2)
    limb = replace(limb, functions=(sign * function,))
    rng = np.random.default_rng(1)
    L, points = 100, 100
    room = (limb.upper - limb.lower)[:, None]
    # Boxes along few variables, where bounds are sharp, and along all.
    size = room * 10.0 ** rng.uniform(-4, 0, (limb.n, L)) * (rng.random((limb.n, L)) < rng.choice([0.1, 0.3, 1.0], L))
    low = limb.lower[:, None] + (0.5 if "zeros" in kind else rng.random((limb.n, L))) * (room - size)
    high = low + size
    outer = low[:m] - rng.random((m, L)) * room[:m], high[:m] + rng.random((m, L)) * room[:m]
    scale = 10.0 ** rng.uniform(-1, 2, L) * rng.integers(0, 2, L)
    Q = rng.normal(size=(m, m, L)) * scale
    tilts = Tilts.over(*outer, rng.normal(size=(m, L)) * scale, Q + Q.swapaxes(0, 1))
    with np.errstate(all="ignore"):
        (value,) = PolynomialArithmetic(ca.Function("f", [limb.x], [limb.functions[0]]))(low, high)
        assert np.isfinite(value.s).all()
        forms = forms_of([value - tilts.polynomial(low, high)], low, high, limb)
        bound = polynomial_sum(forms, np.ones((1, L))).bound()
    share = np.concatenate([rng.random((limb.n, L, points)), rng.integers(0, 2, (limb.n, L, points))], axis=2)
    x = low[:, :, None] + share * size[:, :, None]
    flat = x.reshape(limb.n, -1)
    value = ca.Function("f", [limb.x], [limb.functions[0]]).map(flat.shape[1])(flat).full().reshape(L, -1)
    t = tilts.select(np.repeat(np.arange(L), 2 * points)).at(flat[:m]).reshape(L, -1)
    excess = (value - t).max(axis=1) - bound
    size = np.abs(value).max(axis=1) + tilts.sizes()
    assert (excess <= 1e-14 * size).all()
    # The bound is no wider than it must be: at small boxes it is reached.
    assert (np.median(-excess) < 0.5 * np.median(size)) or "zeros" in kind

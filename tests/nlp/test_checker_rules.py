"""Rules of the checkers one by one: their bounds hold and are nearly reached, and what has no value proves nothing."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.bisection import Shown
from screwsynth.nlp.proof.checker.optimum import Claims, rule_of
from screwsynth.nlp.proof.checker.polymodels import Tilts
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace.number_claims import change_of_jacobian
from screwsynth.nlp.proof.checker.workspace.ranks import change_of_rows
from screwsynth.nlp.proof.statement.machine import Legs
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm


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

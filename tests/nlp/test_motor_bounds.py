"""Bounds of numbers of actuators over single boxes: no claim that a pose refutes holds; forms of second order."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from builders import Array
from workspace_cases import CUT, robot_of

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.case.motors import ActuatorQuantity, Motor
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.cli.proofs import _premises
from screwsynth.nlp.proof.checker.workspace.check import VerifiedWorkspace
from screwsynth.nlp.proof.checker.workspace.forms import AffineMatrix, solved
from screwsynth.nlp.proof.checker.workspace.loop_claims import PosedLoops, posed_loops
from screwsynth.nlp.proof.checker.workspace.motor_claims import MotorClaims
from screwsynth.nlp.proof.checker.workspace.pose_boxes import PoseRoot, pose_root
from screwsynth.nlp.proof.statement.fixed_robot import joint_centres, workspace_of_case
from screwsynth.nlp.proof.statement.motors import motor_claims
from screwsynth.nlp.proof.statement.tolerance import built_model
from screwsynth.nlp.proof.workspace.numbers.motors import Motors
from screwsynth.nlp.proof.workspace.numbers.quadratic_forms import Quadratics
from screwsynth.nlp.proof.workspace.numbers.quadratic_forms import solved as second_order
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem

#: Two loads together, of which one turns with the platform and is reversed.
TILTED = Load("tilted", (1.0, -4.0, 2.0), (0.3, 0.2, -0.1), (0.1, 0.0, -0.1), in_platform=True, both_signs=True)
#: The second of two cases is meant.
LOADING = Loading((Load("light", (0.0, 0.0, -0.1)), CUT, replace(TILTED, always=True)), Motion(1.0, 0.5))


def affine(rng: np.random.Generator, signs: tuple[float, ...] = (1.0, -1.0)) -> AffineMatrix:
    """A random form of one number in one coordinate."""
    M, A, E = (rng.uniform(low, high, (1, 1, 1)) for low, high in ((0.2, 1), (0.02, 0.1), (0, 0.05)))
    return AffineMatrix(M * rng.choice(signs), A[:, None] * rng.choice(signs), E)


def largest_rest(form: AffineMatrix, e: float, values: list[float]) -> float:
    """How far values where the coordinate is e are from the affine part of a form."""
    return max(abs(value - (form.M + e * form.A[:, 0]).item()) for value in values)


@pytest.mark.parametrize("is_product", [True, False])
def test_products_and_solutions_of_numbers_have_the_least_rests(*, is_product: bool) -> None:
    """With one number a rest is that at an end: any part less and it is lost."""
    for seed in range(20):
        a, b = (affine(np.random.default_rng([seed, k]), (1.0, 1.0 if is_product else -1.0)) for k in (0, 1))
        form, known = (a.matmul(b), np.ones(1)) if is_product else solved(a, b)[:2]
        assert known.all()
        most = 0.0
        for e in (-1.0, 1.0):
            u, v = ([(each.M + e * each.A[:, 0] + f * each.E).item() for f in (-1, 1)] for each in (a, b))
            values = [one * other if is_product else other / one for one in u for other in v]
            most = max(most, *(abs(value - (form.M + e * form.A[:, 0]).item()) for value in values))
        assert most <= form.E.item() * (1 + 1e-12)
        assert form.E.item() <= most * (1 + 1e-9 if is_product else 1.7)


def test_what_counts_in_a_ball_of_rotations_is_not_negative_inside_of_it() -> None:
    """Rotations of which a part is known up to a rest, as those of loops are, on the edge of the ball."""
    rng, least = np.random.default_rng(1), math.inf
    for _ in range(40):
        r, along = rng.normal(size=(2, 3))
        r, along, rest = r / np.linalg.norm(r), 0.05 * along, rng.uniform(0.0, 0.02, 3)
        turn = AffineMatrix(r[None, None], along[None, None, None], rest[None, None])
        claims = SimpleNamespace(free=[3], _ball=1.0)
        at = MotorClaims._inside(claims, np.array([[math.copysign(1.0, along @ r)]]), turn)[0]  # type: ignore[arg-type]
        corners = turn.corners(1)[0, :, 0]
        for where in rng.uniform(size=20):
            inside = np.array([where, 1.0 - where])
            whole = inside @ corners
            # The rotation is nearer to the middle of the ball than its known part is, by as much as it may be.
            true = whole - rest * np.sign(whole)
            if np.linalg.norm(true) <= 1.0:
                assert inside @ at >= 0
                least = min(least, (inside @ at) / max(at.max(), 1e-300))
    assert least < 0.1  # some are on the edge


def test_no_solution_is_known_where_a_system_may_be_singular() -> None:
    """The coordinate, or the rest, reaches a number without an inverse; in one of two rows that are apart as well."""
    one, zero = np.ones((1, 1, 1)), np.zeros((1, 1, 1))
    right = AffineMatrix(one, zero[:, None], zero)
    for A, E in ((1.2, 0.0), (0.0, 1.2), (0.6, 0.6), (1.0, 0.0)):
        assert not solved(AffineMatrix(one, A * one[:, None], E * one), right)[1].any()
    wide = AffineMatrix(np.eye(2)[None], np.diag([1.2, 0.0])[None, None], np.zeros((1, 2, 2)))
    for column in np.eye(2):
        right = AffineMatrix(column[None, :, None], np.zeros((1, 1, 2, 1)), np.zeros((1, 2, 1)))
        assert not solved(wide, right)[1].any()


def test_solutions_of_more_rows_than_columns_are_in_their_forms() -> None:
    """Systems with a solution at every value of three coordinates."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        A, Y = (
            AffineMatrix(rng.normal(size=(1, *shape)), 0.03 * rng.normal(size=(1, 3, *shape)), np.zeros((1, *shape)))
            for shape in ((7, 4), (4, 2))
        )
        found, known, _ = solved(A, A.matmul(Y))
        if not known.all():
            continue
        assert np.abs(found.M - Y.M).max() < 1e-12
        for e in rng.choice([-1, 1], (16, 3)):
            at = [each.M[0] + np.tensordot(e, each.A[0], 1) for each in (Y, found)]
            assert (np.abs(at[0] - at[1]) <= found.E[0]).all()


class Subject(NamedTuple):
    """A robot, as the check has it."""

    case: Case
    loops: PosedLoops
    root: PoseRoot

    @classmethod
    def of(cls, case: Case) -> "Subject":
        model, root, tolerance = closed_form(case.model).model, pose_root(workspace_of_case(case)), 0.0
        if not case.joint_centre_tolerance:
            return cls(case, posed_loops(case, model, root), root)
        tolerance = case.joint_centre_tolerance
        return cls(case, posed_loops(case, model, root, tolerance, built_model(case.model)), root)

    def holds(self, motor: Motor, sense: Sense, bound: float, box: FloatArray) -> bool:
        """Whether a claim is shown on a box (2, 6) at once."""
        claims = MotorClaims(self.case, self.loops, self.root, [(motor, sense, bound)])
        low, high, _ = self.root.contracted(box[:1], box[1:])
        return bool(claims.attempt(low, high).holds[0])


def boxes(root: PoseRoot, rng: np.random.Generator, part: float, count: int) -> list[FloatArray]:
    """Random boxes (2, 6) of some size in parts of the root, some at its border."""
    wide, found = root.upper - root.lower, []
    for _ in range(count):
        size = part * wide * rng.uniform(0.3, 1, 6)
        low = root.lower + (wide - size) * rng.choice([0, 1, 0.5, 0.2, 0.8], 6)
        found.append(np.array([low, low + size]))
    return [box for box in found if root.contracted(box[:1], box[1:])[2][0] and len(points(root, box, rng, 500)) > 50]


def points(root: PoseRoot, box: FloatArray, rng: np.random.Generator, count: int) -> FloatArray:
    """Random points (N, 6) of a box, many at its border, and of the ball and many on its surface."""
    y = box[0] + (box[1] - box[0]) * rng.choice([0, 1, 0, 1, 0, 1, rng.uniform()], (count, 6))
    y[::3] = box[0] + (box[1] - box[0]) * rng.uniform(size=y[::3].shape)
    if math.isfinite(root.ball):
        size = np.linalg.norm(y[:, 3:], axis=1, keepdims=True)
        y[:, 3:] *= np.minimum(1.0, math.sqrt(root.ball) * (1 - 1e-15) / np.maximum(size, 1e-300))
        y = y[((y >= box[0]) & (y <= box[1])).all(axis=1)]
    return y


def legs_premise(case: Case, y: FloatArray, errors: FloatArray) -> dict[tuple[str, int], FloatArray]:
    """Forces upwards and downwards under the second load case, and speeds, (N,) each of six legs, in NumPy alone."""
    legs, r = joint_centres(case), y[:, 3:]
    turns = workspace_of_case(case).turns
    if turns.kind.value == "axis":
        r = y[:, 3:4] * np.array(turns.axis)
    size, skew = (r * r).sum(axis=1)[:, None, None], np.cross(np.eye(3), r[:, None])
    R = ((1 - size) * np.eye(3) + 2 * r[:, :, None] * r[:, None] + 2 * skew) / (1 + size)
    arms = np.einsum("nij,nkj->nki", R, legs.platform + errors[:, 1])
    d = y[:, None, :3] + arms - legs.base - errors[:, 0]
    u = d / np.linalg.norm(d, axis=2, keepdims=True)
    moments = np.cross(arms, u)
    X = np.linalg.inv(np.concatenate([u, moments], axis=2))
    held, spread = np.zeros((len(y), 6)), np.zeros((len(y), 6))
    for load, sign in case.loading.cases[1].parts:
        arm = np.einsum("nij,j->ni", R, np.array(load.point))
        at = X[:, :3] + np.cross(X[:, 3:], arm[:, :, None], axis=1)
        turn = R if load.in_platform else np.broadcast_to(np.eye(3), R.shape)
        force, moment = (turn @ np.array(each) for each in (load.force, load.moment))
        held -= sign * (np.einsum("ni,nik->nk", force, at) + np.einsum("ni,nik->nk", moment, X[:, 3:]))
        spread += load.any_force * np.linalg.norm(at, axis=1) + load.any_moment * np.linalg.norm(X[:, 3:], axis=1)
    motion = case.loading.motion or Motion()
    speed = motion.linear + motion.angular * np.linalg.norm(moments, axis=2)
    return {
        (word, k): each[:, k]
        for word, each in (("up", held + spread), ("down", spread - held), ("speed", speed))
        for k in range(6)
    }


def worst_errors(case: Case, y: FloatArray, key: tuple[str, int]) -> FloatArray:
    """Errors (N, 2, 6, 3) of joint centres with which a number is about the largest at poses (N, 6)."""
    t, n = case.joint_centre_tolerance or 0.0, len(y)
    slopes = np.zeros((n, 36))
    for j in range(36 if t else 0):
        step = np.zeros((n, 36))
        step[:, j] = 0.1 * t
        two = (legs_premise(case, y, sign * step.reshape(n, 2, 6, 3))[key] for sign in (1, -1))
        slopes[:, j] = next(two) - next(two)
    own = slopes.reshape(n, 2, 6, 3)
    return np.asarray(t * own / np.maximum(np.linalg.norm(own, axis=3, keepdims=True), 1e-300))


@pytest.mark.parametrize("name", ["legs", "legs with a tolerance"])
def test_no_claim_about_legs_holds_that_a_pose_of_the_box_refutes(name: str) -> None:
    """Forces, speeds and powers under two loads together, over boxes inside of the ball and at its surface."""
    case = replace(robot_of(name), loading=LOADING, characteristic_length=0.6)
    subject, rng, load = Subject.of(case), np.random.default_rng(5), case.loading.cases[1].name
    shown, count = 0, 5 if case.joint_centre_tolerance else 12
    for k, box in enumerate(boxes(subject.root, rng, 0.3, count) + boxes(subject.root, rng, 0.02, count)):
        place = k % 6
        y = points(subject.root, box, rng, 2000 if name == "legs" else 60)
        most = {}
        for word in ("up", "down", "speed"):
            values = legs_premise(case, y, worst_errors(case, y, (word, place)))
            most[word] = values[word, place]
        claims = (
            (Motor(ActuatorQuantity.FORCE, place, load=load), Sense.MAX, most["up"].max()),
            (Motor(ActuatorQuantity.FORCE, place, load=load), Sense.MIN, -most["down"].max()),
            (Motor(ActuatorQuantity.SPEED, place), Sense.MAX, most["speed"].max()),
            (
                Motor(ActuatorQuantity.POWER, place, load=load),
                Sense.MAX,
                (np.maximum(most["up"], 0) * most["speed"]).max(),
            ),
        )
        for motor, sense, value in claims:
            said = f"{motor} {sense} {box}"
            scale = abs(most["up"]).max() if motor.number is not ActuatorQuantity.SPEED else value
            if value:
                assert not subject.holds(motor, sense, value - sense.sign * 1e-9 * abs(value), box), said
            if motor.number is not ActuatorQuantity.POWER:
                shown += subject.holds(motor, sense, value + sense.sign * 0.05 * scale, box)
    assert shown >= 20


@pytest.mark.parametrize("angular", [0.0, 5.0])
def test_speeds_of_three_freedoms_are_those_of_results(angular: float) -> None:
    """Rates of least size: of other rates in the same motions a bound may be below the speed that results have."""
    case = replace(robot_of("3-rps"), loading=Loading((), Motion(1.0, angular)), characteristic_length=0.6)
    subject, rng = Subject.of(case), np.random.default_rng(2)
    meant = build_problem(case, closed_form(case.model).model, pose_box(workspace_of_case(case)))
    free = MotorClaims(case, subject.loops, subject.root, [(Motor(ActuatorQuantity.SPEED), Sense.MAX, 1.0)]).free
    own = [meant.free.index(each) for each in free]
    for k, claim in enumerate(motor_claims(case)):
        motor = claim.motor or Motor()
        for box in boxes(subject.root, rng, 0.02 if k else 0.4, 6):
            z = np.tile(meant.start, (100, 1))
            z[:, own] = points(subject.root, box, rng, 100)[:, free]
            number = Motors(meant, case, [claim])
            value = float(-number.values(number.closed(z)).min())
            assert not subject.holds(motor, Sense.MAX, value * (1 - 1e-9), box)
            assert subject.holds(motor, Sense.MAX, value * (1.2 if not k else 1.02), box)


def test_proofs_name_the_assembly_that_numbers_of_actuators_are_about() -> None:
    """They follow the loops, and are not about every assembly as other numbers may be."""
    case = robot_of("3-rps")
    said = []
    for each in (case, replace(case, loading=Loading())):
        checked = VerifiedWorkspace((), "every assembly", workspace_of_case(each), 0, 0)
        said.append(list(_premises(each, checked))[-1])
    assert said == [
        f"assembly modes: {ranks} in the home assembly mode at the workspace centre, {numbers} in every assembly"
        for ranks, numbers in (("ranks, forces, speeds and powers", "other quantities"), ("ranks", "quantities"))
    ]


FORM_BOXES, FORM_POINTS = 40, 40


def random_forms(rng: np.random.Generator, shape: tuple[int, int], count: int, errors: int, width: Array) -> Quadratics:
    """Matrices near the identity over boxes of widths (B,): linear parts, products and rests shrink with them.

    With errors of joint centres there are no products.
    """
    p, B = 0 if errors else count * (count + 1) // 2, len(width)
    c = np.eye(*shape)[:, :, None] + 0.2 * rng.normal(size=(*shape, B))
    a = width * rng.normal(size=(*shape, count + 3 * errors, B))
    q = width**2 * rng.normal(size=(*shape, p, B))
    return Quadratics(c, a, q, 0.1 * width**3 * rng.uniform(size=(*shape, B)), 3 * errors)


def values_at(forms: Quadratics, e: Array, part: Array | None = None) -> Array:
    """Values (n, m, B) at points (t, B) of the boxes, at a part of the rests or without them."""
    i, j = np.triu_indices(len(e) if forms.q.shape[2] else 0)
    linear, products = ((each * by).sum(axis=2) for each, by in ((forms.a, e), (forms.q, e[i] * e[j])))
    return np.asarray(forms.c + linear + products + (0.0 if part is None else part * forms.r))


def form_point(rng: np.random.Generator, count: int, errors: int) -> Array:
    """A point (t, B) of each box, many at ends; errors are vectors of unit size."""
    e = rng.uniform(-1, 1, size=(count, FORM_BOXES))
    vectors = rng.normal(size=(errors, 3, FORM_BOXES))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.concatenate([np.where(rng.uniform(size=e.shape) < 0.6, np.sign(e), e), vectors.reshape(-1, FORM_BOXES)])


@pytest.mark.parametrize(("count", "errors"), [(1, 0), (3, 0), (6, 0), (2, 3)])
def test_products_solutions_and_sizes_are_within_their_forms(count: int, errors: int) -> None:
    rng = np.random.default_rng(count)
    width = np.geomspace(1e-3, 0.2, FORM_BOXES) / (count + errors)
    A, D = (random_forms(rng, shape, count, errors, width) for shape in ((4, 4), (4, 2)))
    product, Y, size, entries = A.matmul(D), second_order(A, D), D.lengths(), D.by(A[:, :2])
    assert np.isfinite(Y.r[..., : FORM_BOXES // 2]).all()
    worst = 0.0
    for _ in range(FORM_POINTS):
        e, parts = form_point(rng, count, errors), [rng.choice([-1.0, 0.0, 1.0], each.r.shape) for each in (A, D)]
        a, d = (values_at(each, e, part) for each, part in zip((A, D), parts, strict=True))
        exact = np.linalg.solve(a.transpose(2, 0, 1), d.transpose(2, 0, 1)).transpose(1, 2, 0)
        for forms, value in ((product, np.einsum("ikb,kjb->ijb", a, d)), (Y, exact), (entries, d * a[:, :2])):
            assert (np.abs(value - values_at(forms, e)) <= forms.r).all()
            assert (value <= forms.upper()).all()
        worst = max(worst, float(np.max(np.abs(exact - values_at(Y, e)) / Y.r)))
        assert (np.linalg.norm(d, axis=0)[None] <= values_at(size, e) + size.r).all()
    assert worst > 0.02, worst  # the largest rest needed is not far below the one allowed


def test_terms_of_third_order_are_all_that_a_solution_leaves() -> None:
    """Half the width leaves an eighth, where the parts have no rests."""
    rng, width = np.random.default_rng(5), np.full(FORM_BOXES, 0.02)
    A, D = (random_forms(rng, shape, 3, 0, width) for shape in ((3, 3), (3, 1)))
    rests = []
    for half in (1.0, 0.5):
        own = (replace(each, a=half * each.a, q=half**2 * each.q, r=0 * each.r) for each in (A, D))
        rests.append(second_order(*own).r)
    assert (rests[1] <= rests[0] / 7.5).all()
    assert (rests[1] >= rests[0] / 10).all()

"""Rules of the checkers one by one: their bounds hold and are nearly reached, and what has no value proves nothing."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.case.pose import Free
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.certificate.paper.limbs.tilted import TiltedForm
from screwsynth.nlp.certificate.standardform import StandardForm
from screwsynth.nlp.workspace.paper.ballrows import AFTER, BEFORE, Joints, ball_rows
from screwsynth.nlp.workspace.paper.built.changes import change_of_jacobian, change_of_rows
from screwsynth.nlp.workspace.paper.poseroot import pose_root
from screwsynth.nlp.workspace.posebox import pose_box


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
    bound = change_of_jacobian(Joints(base, platform), t, length, leg)
    assert reached <= bound <= 1.001 * reached


def test_errors_that_take_up_a_leg_have_no_bound() -> None:
    joints = Joints(np.zeros((6, 3)), np.ones((6, 3)))
    assert change_of_jacobian(joints, 1.0, 1.0, 2.0) == np.inf
    assert change_of_jacobian(joints, 1.0, 1.0, 2.1) < np.inf


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_change_of_the_rows_is_nearly_reached(seed: int) -> None:
    rng, t = np.random.default_rng(seed), 1e-4
    joints = Joints(rng.uniform(-10, 10, (6, 3)), rng.uniform(-5, 5, (6, 3)))
    space = Workspace((Free(-3.0, 3.0), Free(-3.0, 3.0), Free(9.0, 15.0)), Turns(TurnKind.ANY_AXIS, (Free(-0.4, 0.4),)))
    y = pose_box(space).random(1, rng)
    found = ball_rows(pose_root(space), joints, y, y)
    change = change_of_rows(found, joints, t)[0]
    s, u, span = found.scale.c[0], found.arm.c[0], y[0, :3] - joints.base
    for k in range(3):
        # f x d has the component f.(d x e_k), and u x e the component e.(e_k x u).
        axis = np.eye(3)[k]
        f, e = t * unit(np.cross(span, axis)), -t * unit(np.cross(axis, u))
        moment = s * np.cross(f, span) - np.cross(u, e) - s * np.cross(f, e)
        assert (np.abs(moment[:, k]) <= change[:, 3 + k]).all()
        assert (change[:, 3 + k] <= 1.001 * np.abs(moment[:, k])).all()
    assert (change[:, :3] >= 2 * s * t).all()
    assert (change[:, :3] <= 1.001 * 2 * s * t).all()
    assert AFTER != BEFORE


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
    nlp = formulate(load_case("paper-4.2-rotation"))
    form = StandardForm(nlp, x, np.zeros(2), np.ones(2), (function + x[1],), (), (), 1.0, has_epigraph=False)
    lower, upper = np.array([low, (1.0, 1.0)]).T, np.array([(2.0, 2.0), (1.5, 1.5)]).T
    with np.errstate(all="ignore"):
        found = TiltedForm(form).slopes(lower, upper)
        (square,) = found.squares
        np.testing.assert_array_equal(square.is_defined, [False, True])
        np.testing.assert_array_equal(found.defined, [False, True])
        np.testing.assert_array_equal(found.is_below(np.full(2, 1e300)), [False, True])
    assert (found.rises_low[:, 0] == -np.inf).all()
    assert (found.rises_high[:, 0] == np.inf).all()

"""Why some printed values cannot be right: arguments, each with its inequality checked by computation.

Nothing here samples a maximum and hopes. Where a maximum is needed it is bounded from above.
"""

import math

import numpy as np
import pytest
from builders import Array

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, Rotation, Task, evaluate, formulate, load_case, solve

PRINTED_PITCH_1, PRINTED_PITCH_0, PRINTED_4_3, PRINTED_4_4 = 400.3, 284.4, 524.7, 457.5

#: The twist of Sections 4.1 and 4.3, pitch 1, worked out by hand: s = (2, 2, 1) / 3 through s0 = (2, 3, 6), v = s0 x s
#: + s = (-9, 10, -2) / 3 + (2, 2, 1) / 3.
OMEGA = np.array([2.0, 2.0, 1.0]) / 3
V = np.array([-7.0, 12.0, -1.0]) / 3


# The pitch. Of a screw of pitch h, v = s0 x s + h s, so a unit force f changes its rate by f . s when h grows by 1. The
# six rates are a vector whose length is sqrt(F); it moves by (f_1 . s, ..., f_6 . s), whose length is at most sqrt(6).


def unit_force_rows(generator: np.random.Generator, kind: int) -> Array:
    f = generator.normal(size=(6, 3))
    if kind == 1:  # nearly along one line: where the inequality is tight
        f = f * 1e-3 + [0, 0, 1]
    f /= np.linalg.norm(f, axis=1, keepdims=True)
    arms = generator.normal(size=(6, 3)) * 10.0 ** generator.uniform(-1, 2)
    return np.hstack([f, np.cross(arms, f)])


def test_one_more_of_pitch_moves_the_root_of_f_by_at_most_root_6_and_two_printed_maxima_by_more() -> None:
    for seed in range(200):
        generator = np.random.default_rng(seed)
        J = unit_force_rows(generator, seed % 2)
        s = np.array([0.0, 0.0, 1.0]) if seed % 4 == 1 else generator.normal(size=3)
        s = s / np.linalg.norm(s)
        point, pitch = 10 * generator.normal(size=3), 10 * generator.normal()
        twists = [np.asarray(Task.screw("max", axis=s, point=point, pitch=h).twist) for h in (pitch, pitch + 1)]
        roots = [float(np.linalg.norm(J[:, 3:] @ twist[:3] + J[:, :3] @ twist[3:])) for twist in twists]
        # The chain that proves it: triangle inequality, then Cauchy-Schwarz for each unit force.
        moved = float(np.linalg.norm(J[:, :3] @ s))
        assert abs(roots[1] - roots[0]) <= moved + 1e-12 * max(roots), seed
        assert moved <= math.sqrt(6) * (1 + 1e-14), seed
    # The bound is attained by six forces along the axis: all rates are the pitch.
    J = np.tile([0.0, 0, 1, 0, 0, 0], (6, 1))
    twists = [np.asarray(Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=h).twist) for h in (1, 2)]
    rates = [float(np.linalg.norm(J[:, :3] @ twist[3:])) for twist in twists]
    assert rates[1] - rates[0] == pytest.approx(math.sqrt(6), rel=1e-15)
    # Where F is 400.3 with pitch 1, it is at least this with pitch 0, at the same pose; the maximum is no less.
    least = (math.sqrt(PRINTED_PITCH_1) - math.sqrt(6)) ** 2
    assert least == pytest.approx(308.3, abs=0.05)
    assert least > PRINTED_PITCH_0 + 23


@pytest.mark.parametrize("suffix", ["", "-axis-z"])
def test_this_programs_maxima_of_section_4_1_keep_the_inequality(suffix: str) -> None:
    helical, rotation = (load_case(f"paper-4.1-{name}{suffix}") for name in ("helical", "rotation"))
    # The same robot and axis, one of pitch 1 and one of pitch 0, or the inequality would say nothing.
    twists = [np.asarray(each.tasks[0].twist) for each in (helical, rotation)]
    np.testing.assert_allclose(twists[0] - twists[1], [0, 0, 0, *OMEGA], atol=1e-15)
    np.testing.assert_allclose(twists[0], [*OMEGA, *V], atol=1e-15)
    one, nought = (math.sqrt(solve(case, starts=8).F) for case in (helical, rotation))
    assert abs(one - nought) <= math.sqrt(6)
    assert math.sqrt(PRINTED_PITCH_1) - math.sqrt(PRINTED_PITCH_0) > math.sqrt(6)


# Section 4.3. A three-fold symmetric robot on two circles has its six legs in two triples: leg k of a triple joins the
# base at azimuth b + 120 k to the platform at azimuth a + 120 k, with any a and b of the triple's own. So F is the sum
# of two values of one function T(b, a) and at most twice the maximum of T.

ANGLE = math.radians(4.3)
CENTRE = np.array([-10.0, -10.0, 50.0])
BASE_RADIUS, PLATFORM_RADIUS = 12.0, 8.0
STEP = math.radians(0.5)


def joints(b: Array, a: Array) -> tuple[Array, Array]:
    """World coordinates (..., 3) of a base joint and of a platform joint, from their azimuths."""
    B = BASE_RADIUS * np.stack([np.cos(b), np.sin(b), np.zeros_like(b)], axis=-1)
    y = PLATFORM_RADIUS * np.sin(a)
    A = np.stack([PLATFORM_RADIUS * np.cos(a), math.cos(ANGLE) * y, math.sin(ANGLE) * y], axis=-1) + CENTRE
    return B, A


def rates(b: Array, a: Array) -> Array:
    B, A = joints(b, a)
    s = A - B
    s = s / np.linalg.norm(s, axis=-1, keepdims=True)
    # Work rate of a unit force along s through B: the velocity of the platform point at B along s.
    return np.asarray(np.sum(s * (V + np.cross(OMEGA, B)), axis=-1))


def triple(b: Array, a: Array) -> Array:
    return np.asarray(sum(rates(b + third, a + third) ** 2 for third in np.arange(3) * 2 * math.pi / 3))


def lipschitz() -> tuple[float, float]:
    """Bounds of |dT/db| and |dT/da| over all azimuths, 1/rad.

    The rate of a leg is r = s . V_A = s . V_B, with V_X = v + omega x X the velocity of the platform point at X and s
    the unit vector from B to A; both are the same because omega x (A - B) is perpendicular to s. Moving B along its
    circle turns s at most by |B'| / |A - B| = 12 / d and leaves A, so |dr/db| <= 12 |V_A| / d. Moving A likewise gives
    |dr/da| <= 8 |V_B| / d. With |omega| = 1, |V_B| <= |v| + 12 and |V_A| <= |V_centre| + 8. The base lies in z = 0, and
    the platform above 50 - 8 sin(angle), which bounds d from below. At last |r| <= |V_B|, and T is a sum of three r^2.
    """
    speed_b = float(np.linalg.norm(V)) + BASE_RADIUS
    speed_a = float(np.linalg.norm(V + np.cross(OMEGA, CENTRE))) + PLATFORM_RADIUS
    shortest = CENTRE[2] - PLATFORM_RADIUS * math.sin(ANGLE)
    along_b = 3 * 2 * speed_b * BASE_RADIUS * speed_a / shortest
    along_a = 3 * 2 * speed_b * PLATFORM_RADIUS * speed_b / shortest
    return along_b, along_a


def grid() -> tuple[Array, Array]:
    # Turning both azimuths by 120 degrees only renames the legs: a third of a turn of b is enough, with all of a.
    b = np.arange(0, 2 * math.pi / 3 - STEP / 2, STEP)
    a = np.arange(0, 2 * math.pi - STEP / 2, STEP)
    return np.meshgrid(b, a, indexing="ij")  # type: ignore[return-value]


def test_the_triples_of_this_test_are_those_of_the_program() -> None:
    parameters = {"x1": BASE_RADIUS, "x2": PLATFORM_RADIUS, "x3": math.radians(30), "x4": math.radians(21.1)}
    task = Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1)
    case = Case(stewart_gough(), parameters, CENTRE.tolist(), [task], Rotation([1, 0, 0], ANGLE))
    nlp = formulate(case)
    half = [np.radians([30.0, 21.1]) * sign for sign in (1, -1)]
    F = sum(float(triple(np.array(b), np.array(a))) for b, a in half)
    assert pytest.approx(F, rel=1e-13) == evaluate(nlp, nlp.start).F
    assert pytest.approx(407.06, abs=0.01) == F


def test_no_three_fold_symmetric_robot_reaches_the_value_printed_in_section_4_3() -> None:
    b, a = grid()
    T = triple(b, a)
    # Every point is within half a step, in each azimuth, of a point of the grid.
    bound = 2 * (float(T.max()) + sum(lipschitz()) * STEP / 2)
    # More than the printed robot has, so that the triples include it; far less than the printed value.
    assert 2 * T.max() == pytest.approx(417.49, abs=0.01)
    assert bound < 440
    assert bound < PRINTED_4_3
    b, a = grid()
    T = triple(b, a)
    assert b.shape == (240, 720)
    # The columns close up: past the last of a is the first; past the last of b is the first with a turned by -120.
    np.testing.assert_allclose(triple(b[-1] + STEP, a[-1]), np.roll(T[0], 240), rtol=1e-12)
    np.testing.assert_allclose(triple(b[:, -1], a[:, -1] + STEP), T[:, 0], rtol=1e-12)
    steps_b = np.abs(np.diff(T, axis=0)).max() / STEP
    steps_a = np.abs(np.diff(T, axis=1)).max() / STEP
    along_b, along_a = lipschitz()
    assert steps_b <= along_b
    assert steps_a <= along_a
    # Both ways of writing a rate, on which the constants rest.
    B, A = joints(b, a)
    s = (A - B) / np.linalg.norm(A - B, axis=-1, keepdims=True)
    np.testing.assert_allclose(np.sum(s * (V + np.cross(OMEGA, A)), axis=-1), rates(b, a), atol=1e-13)


# Section 4.4. F of a 3-UPU is that of three forces and of three unit couples. The couples' part is omega' G omega with
# G = sum u u', which is positive semidefinite with trace 3: its largest eigenvalue is at most 3.


def test_three_unit_couples_give_at_most_three() -> None:
    for seed in range(50):
        generator = np.random.default_rng(seed)
        u = generator.normal(size=(3, 3)) * [1, 1, 10.0 ** generator.uniform(-6, 3)]
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        G = u.T @ u
        eigenvalues = np.linalg.eigvalsh(G)
        assert np.trace(G) == pytest.approx(3, rel=1e-14)
        assert eigenvalues[0] > -1e-15
        # Hence for every omega at once, not only for those that were tried.
        assert eigenvalues[2] <= 3 * (1 + 1e-15)
        omega = generator.normal(size=3)
        assert np.sum((u @ omega) ** 2) <= 3 * float(omega @ omega) * (1 + 1e-14)


@pytest.mark.parametrize("name", ["paper-4.4-max", "paper-4.4-min"])
def test_the_limbs_of_section_4_4_do_no_work_in_its_task(name: str) -> None:
    case = load_case(name)
    nlp = formulate(case)
    state = evaluate(nlp, nlp.start)
    twist = np.asarray(case.tasks[0].twist)
    assert np.linalg.norm(twist[:3]) == pytest.approx(1, rel=1e-15)
    # A force whose line meets the axis of a pure rotation does no work: all three lines pass through (0, 0, 100).
    meeting = np.array([0.0, 0.0, 100.0])
    np.testing.assert_allclose(twist[3:], np.cross(meeting, twist[:3]), atol=1e-13)
    forces = state.jacobian[:3]
    np.testing.assert_allclose(np.cross(meeting, forces[:, :3]), forces[:, 3:], atol=1e-13)
    np.testing.assert_allclose(state.rates[:3], 0, atol=1e-13)
    # The limbs hang on the pose and the radii alone, and all of these are fixed: so it is with any axes.
    assert {variable.name[:2] for variable in nlp.program.variables} == {"u1", "u2"}
    assert case.characteristic_length == 1.0
    ceiling = 3 * float(twist[:3] @ twist[:3]) + float(state.rates[:3] @ state.rates[:3])
    assert ceiling < 3 + 1e-12 < PRINTED_4_4


def test_the_program_attains_the_ceiling_and_the_printed_axes_give_next_to_nothing() -> None:
    assert pytest.approx(3, abs=1e-13) == solve(load_case("paper-4.4-max"), starts=2).F
    first = np.array([[0, -0.989, 0.012], [0.887, 0.51, 0], [-0.855, 0.49, 0]])
    second = np.array([[0.91, 0, 0.03], [-0.52, 0.856, 0], [-0.498, -0.846, 0]])
    lengths = np.linalg.norm([first, second], axis=-1)
    cosines = np.sum(first * second, axis=1) / np.prod(lengths, axis=0)
    # Three decimals would leave a unit vector to 1e-3 and right angles likewise.
    assert np.max(np.abs(lengths - 1)) > 0.05
    assert np.all((np.abs(cosines) > 2e-3) | (np.abs(lengths - 1) > 2e-3).any(axis=0))
    omega = np.array([-0.939, 0.346, 0])
    omega /= np.linalg.norm(omega)
    u = np.cross(first, second)
    raw = float(np.sum((u @ omega) ** 2))
    normalised = float(np.sum((u @ omega) ** 2 / np.sum(u**2, axis=1)))
    assert raw < 0.002
    assert normalised < 0.002

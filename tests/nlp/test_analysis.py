"""Principal motions against other ways to the same eigenproblem."""

import math

import numpy as np
import pytest
from builders import Array

from screwsynth.models import axis_from_screw, three_upu
from screwsynth.nlp import Case, Task, TaskAnalysis, analyse_tasks, evaluate, formulate


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


KINDS = [
    "planar forces",
    "parallel forces",
    "couples only",
    "one row",
    "two rows",
    "forces through a point",
    "many rows",
]
ROBOTS = [pytest.param(random_jacobian(seed), id=f"random {seed}") for seed in range(6)]
ROBOTS += [pytest.param(degenerate_jacobian(kind), id=kind) for kind in KINDS]


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


@pytest.mark.parametrize("J", ROBOTS)
def test_rotations_are_those_of_the_least_squares_translation(J: Array) -> None:
    # Project: with the best v for each unit omega, F is a form in omega; its matrix column by column from lstsq.
    left = np.column_stack(
        [J[:, 3:] @ e - J[:, :3] @ np.linalg.lstsq(J[:, :3], J[:, 3:] @ e, rcond=1e-9)[0] for e in np.eye(3)]
    )
    size = float(np.linalg.norm(J[:, 3:]) ** 2)
    rotations, _ = spectrum(analyse_tasks(J))
    np.testing.assert_allclose(rotations, np.linalg.eigvalsh(left.T @ left), atol=1e-13 * size)


@pytest.mark.parametrize("J", ROBOTS)
def test_motions_are_as_they_say(J: Array) -> None:
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


@pytest.mark.parametrize("J", ROBOTS)
def test_translations_are_eigenvectors_of_the_forces(J: Array) -> None:
    gram = np.asarray(sum(np.outer(row[:3], row[:3]) for row in J))
    found = analyse_tasks(J)
    np.testing.assert_allclose(spectrum(found)[1], np.linalg.eigvalsh(gram), atol=1e-14 * len(J))
    for motion in found.translations:
        np.testing.assert_allclose(gram @ motion.twist[3:], motion.F * motion.twist[3:], atol=1e-14 * len(J))


@pytest.mark.parametrize("J", ROBOTS)
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


@pytest.mark.parametrize("J", ROBOTS)
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


def test_a_direction_in_which_nothing_pushes_has_no_resistance() -> None:
    found = analyse_tasks(degenerate_jacobian("planar forces"))
    assert found.translations[0].F < 1e-30
    np.testing.assert_allclose(np.abs(found.translations[0].twist), [0, 0, 0, 0, 0, 1], atol=1e-14)
    # Where no force stops a translation, the rotation that goes with it has none of it.
    for motion in found.rotations:
        assert abs(motion.twist[5]) < 1e-12


def test_forces_through_a_point_let_the_platform_turn_about_it() -> None:
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
        np.testing.assert_allclose(
            other.twist[3:], one.twist[3:] - np.cross(one.twist[:3], np.array([5.0, -7.0, 3.0])), atol=1e-9
        )


def test_the_snu_robot_has_two_free_rotations_about_horizontal_lines_where_the_limbs_meet() -> None:
    case = Case(
        model=three_upu(axes="snu"),
        parameters={"base_radius": 0.57735, "platform_radius": 0.288675},
        position=[0, 0, 0.7],
        tasks=[Task.screw("min", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)],
    )
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

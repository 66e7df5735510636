"""Screws, lines and rotations: by hand, by their definitions, and back from their numbers."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from builders import Array, turn_about
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from screwsynth import models
from screwsynth.models import axis_angle_from_matrix, axis_from_screw, line_through, reciprocal_product, screw_from_axis

Triple = tuple[float, float, float]

many = settings(derandomize=True, deadline=None, max_examples=50)


def triples(limit: float) -> st.SearchStrategy[Triple]:
    coordinate = st.floats(-limit, limit, allow_subnormal=False)
    return st.tuples(coordinate, coordinate, coordinate)


#: Directions of a length that says nothing: from 1e-3 to 1e3.
directions = st.tuples(triples(1).filter(lambda n: math.hypot(*n) > 0.1), st.floats(-3, 3)).map(
    lambda parts: 10 ** parts[1] * np.array(parts[0])
)
points = triples(100).map(np.array)
pitches = st.floats(-50, 50, allow_subnormal=False)
intensities = st.floats(0.01, 100)


def unit(n: Array) -> Array:
    return np.asarray(n / np.linalg.norm(n))


def perpendicular(n: Array) -> Array:
    """A unit vector square to ``n``."""
    return unit(np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))]))


@pytest.mark.parametrize(
    ("axis", "point", "pitch", "intensity", "expected"),
    [
        # s0 x s + h s = (0, 2, 0) x (0, 0, 1) + 5 (0, 0, 1) = (2, 0, 5), twice over.
        ((0, 0, 10), (0, 2, 7), 5, 2, [0, 0, 2, 4, 0, 10]),
        # The axis (2, 2, 1) / 3 through (2, 3, 6) with pitch 1: (3 - 12, 12 - 2, 4 - 6) / 3 + (2, 2, 1) / 3.
        ((2, 2, 1), (2, 3, 6), 1, 1, [2 / 3, 2 / 3, 1 / 3, -7 / 3, 4, -1 / 3]),
        ((3, 0, 4), (1, 2, 3), math.inf, 10, [0, 0, 0, 6, 0, 8]),
    ],
)
def test_screws_by_hand(axis: Triple, point: Triple, pitch: float, intensity: float, expected: list[float]) -> None:
    np.testing.assert_allclose(screw_from_axis(axis, point, pitch, intensity), expected, rtol=4e-16)


def test_line_by_hand() -> None:
    # From (1, 0, 0) straight up: (1, 0, 0) x (0, 0, 1) = (0, -1, 0).
    np.testing.assert_array_equal(line_through((1, 0, 0), (1, 0, 5)), [0, 0, 1, 0, -1, 0])


@many
@given(directions, points, pitches, intensities)
def test_a_twist_gives_the_velocity_of_every_point(n: Array, s0: Array, h: float, q: float) -> None:
    twist = screw_from_axis(n, s0, h, q)
    omega, v = twist[:3], twist[3:]
    s = unit(n)
    for along in (-2.0, 0.0, 3.0):
        # Points of the axis move along it, by the pitch for every radian; terms are of size q * (|s0| + |h| + 3).
        on_axis = s0 + along * s
        np.testing.assert_allclose(v + np.cross(omega, on_axis), q * h * s, rtol=0, atol=1e-15 * q * 400)


@many
@given(directions, points, pitches, intensities)
def test_an_axis_comes_back_from_its_screw(n: Array, s0: Array, h: float, q: float) -> None:
    screw = axis_from_screw(screw_from_axis(n, s0, h, q))
    s = unit(n)
    # Point and pitch are lengths beside arms of up to 173 length units and pitches of 50.
    np.testing.assert_allclose(screw.axis, s, rtol=0, atol=1e-15)
    np.testing.assert_allclose(screw.point, s0 - (s0 @ s) * s, rtol=0, atol=2e-13)
    assert screw.pitch == pytest.approx(h, rel=0, abs=1e-13)
    assert screw.intensity == pytest.approx(q, rel=1e-15)


@many
@given(directions, points, intensities)
def test_an_axis_of_infinite_pitch_comes_back_without_a_place(n: Array, s0: Array, q: float) -> None:
    screw = axis_from_screw(screw_from_axis(n, s0, math.inf, q))
    np.testing.assert_allclose(screw.axis, unit(n), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(screw.point, np.zeros(3))
    assert screw.pitch == math.inf
    assert screw.intensity == pytest.approx(q, rel=1e-15)


@many
@given(directions, points, pitches, intensities)
def test_a_negative_intensity_is_the_opposite_axis(n: Array, s0: Array, h: float, q: float) -> None:
    given_so = screw_from_axis(n, s0, h, -q)
    np.testing.assert_allclose(given_so, screw_from_axis(-n, s0, h, q), rtol=0, atol=1e-13 * q)
    screw = axis_from_screw(given_so)
    assert screw.intensity > 0
    np.testing.assert_allclose(screw.axis, -unit(n), rtol=0, atol=1e-15)
    assert screw.pitch == pytest.approx(h, rel=0, abs=1e-13)


@many
@given(triples(10).map(np.array), triples(1000).map(np.array))
def test_a_screw_comes_back_from_its_axis(direction: Array, moment: Array) -> None:
    assume(np.linalg.norm(direction) > 1e-3)
    before = np.concatenate([direction, moment])
    screw = axis_from_screw(before)
    after = screw_from_axis(screw.axis, screw.point, screw.pitch, screw.intensity)
    size = float(np.linalg.norm(moment)) + 1e-300
    np.testing.assert_allclose(after[:3], direction, rtol=0, atol=1e-15 * float(np.linalg.norm(direction)))
    np.testing.assert_allclose(after[3:], moment, rtol=0, atol=2e-15 * size)
    # The point is the axis's nearest to the origin.
    assert abs(float(screw.point @ screw.axis)) <= 1e-15 * size / screw.intensity


def test_pitch_is_infinite_only_where_the_direction_is_rounding_error() -> None:
    # No axis is 1e12 length units away, but one may be 1e9 away or have a pitch of that size.
    far = axis_from_screw([1e-9, 0, 0, 0, 1, 0])
    assert (far.pitch, far.intensity) == (0.0, 1e-9)
    np.testing.assert_allclose(far.point, [0, 0, 1e9], rtol=1e-15)
    steep = axis_from_screw([0, 0, 1e-9, 0, 0, -1])
    assert steep.pitch == pytest.approx(-1e9, rel=1e-15)
    noise = axis_from_screw([1e-16, -1e-16, 0, 0, 3, 4])
    assert (noise.pitch, noise.intensity) == (math.inf, 5.0)
    np.testing.assert_allclose(noise.axis, [0, 0.6, 0.8], rtol=1e-15)
    for screw, pitch in (([0, 0, 2, 0, 0, 0], 0.0), ([0, 0, 0, 0, -3, 0], math.inf)):
        found = axis_from_screw(screw)
        assert isinstance(found, models.Screw)
        assert found.pitch == pitch
        np.testing.assert_array_equal(found.point, np.zeros(3))


@many
@given(points, points)
def test_a_line_is_normal_to_its_moment_and_holds_both_points(first: Array, second: Array) -> None:
    assume(np.linalg.norm(second - first) > 0.01)
    line = line_through(first, second)
    s, moment = line[:3], line[3:]
    assert np.linalg.norm(s) == pytest.approx(1, rel=4e-16)
    assert float(s @ (second - first)) == pytest.approx(float(np.linalg.norm(second - first)), rel=1e-15)
    # Arms of 173 length units; the second point also carries the direction's rounding, over points 0.01 apart or more
    # whose difference is exact to 1e-14.
    np.testing.assert_allclose(moment, np.cross(first, s), rtol=0, atol=1e-13)
    np.testing.assert_allclose(moment, np.cross(second, s), rtol=0, atol=2e-13)


@many
@given(directions, points, st.floats(0, 50), st.floats(-math.pi, math.pi), pitches, pitches, points)
def test_work_rate_of_two_screws_from_distance_angle_and_pitches(
    n: Array, foot: Array, a: float, alpha: float, pitch: float, other_pitch: float, slide: Array
) -> None:
    # The second axis is a along the common normal from the first, and turned about it by alpha.
    s = unit(n)
    normal = perpendicular(s)
    t = turn_about(normal, alpha) @ s
    # Any point of an axis will do.
    one, other = foot + slide[0] * s, foot + a * normal + slide[1] * t
    lines = reciprocal_product(screw_from_axis(s, one, 0), screw_from_axis(t, other, 0))
    assert float(lines) == pytest.approx(-a * math.sin(alpha), rel=0, abs=2e-13)
    screws = reciprocal_product(screw_from_axis(s, one, pitch), screw_from_axis(t, other, other_pitch))
    expected = (pitch + other_pitch) * math.cos(alpha) - a * math.sin(alpha)
    assert float(screws) == pytest.approx(expected, rel=0, abs=3e-13)


@many
@given(directions, directions, points, points, pitches)
def test_work_rate_of_translations_and_couples(n: Array, m: Array, here: Array, there: Array, h: float) -> None:
    force, couple = screw_from_axis(n, here, h), screw_from_axis(n, here, math.inf)
    turning, sliding = screw_from_axis(m, there, h), screw_from_axis(m, there, math.inf)
    cosine = float(unit(n) @ unit(m))
    assert float(reciprocal_product(force, sliding)) == pytest.approx(cosine, rel=0, abs=1e-15)
    assert float(reciprocal_product(couple, turning)) == pytest.approx(cosine, rel=0, abs=1e-15)
    assert float(reciprocal_product(couple, sliding)) == 0.0


def test_reciprocal_product_pairs_force_with_velocity_and_moment_with_angular_velocity() -> None:
    # Six unit wrenches against one twist whose components tell themselves apart.
    twist = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    np.testing.assert_array_equal(reciprocal_product(np.eye(6), twist), [4, 5, 6, 1, 2, 3])
    assert reciprocal_product(np.eye(6)[4], twist).shape == ()
    assert reciprocal_product(np.zeros((0, 6)), twist).shape == (0,)


@many
@given(directions, points, pitches, directions, st.floats(-math.pi, math.pi), points)
def test_a_moved_screw_is_the_screw_of_the_moved_axis(
    n: Array, s0: Array, h: float, about: Array, angle: float, shift: Array
) -> None:
    R = turn_about(about, angle)
    moved = models.moved_screw(screw_from_axis(n, s0, h, 2), R, shift)
    np.testing.assert_allclose(moved, screw_from_axis(R @ n, R @ s0 + shift, h, 2), rtol=0, atol=5e-13)
    translation = models.moved_screw(screw_from_axis(n, s0, math.inf, 2), R, shift)
    np.testing.assert_allclose(translation, [0, 0, 0, *(2 * R @ unit(n))], rtol=0, atol=2e-15)


@pytest.mark.parametrize(
    ("axis", "point", "pitch", "intensity", "fault"),
    [
        ((0, 0, 0), (0, 0, 0), 0.0, 1.0, "axis must be finite and not zero"),
        ((0, math.nan, 1), (0, 0, 0), 0.0, 1.0, "axis must be finite and not zero"),
        ((0, math.inf, 1), (0, 0, 0), 0.0, 1.0, "axis must be finite and not zero"),
        ((0, 0, 0), (0, 0, 0), math.inf, 1.0, "axis must be finite and not zero"),
        ((0, 0, 1), (0, math.nan, 0), 0.0, 1.0, "point and intensity must be finite"),
        ((0, 0, 1), (0, math.inf, 0), 0.0, 1.0, "point and intensity must be finite"),
        ((0, 0, 1), (0, 0, 0), 0.0, math.nan, "point and intensity must be finite"),
        ((0, 0, 1), (0, 0, 0), 0.0, math.inf, "point and intensity must be finite"),
        ((0, 0, 1), (0, 0, 0), math.nan, 1.0, r"pitch must be a number or \+inf"),
        ((0, 0, 1), (0, 0, 0), -math.inf, 1.0, r"pitch must be a number or \+inf"),
        ((0, 1), (0, 0, 0), 0.0, 1.0, "must have 3 components"),
        ((0, 0, 1), (0, 0, 0, 0), 0.0, 1.0, "must have 3 components"),
    ],
)
def test_no_screw_without_axis_or_with_numbers_that_are_none(
    axis: tuple[float, ...], point: tuple[float, ...], pitch: float, intensity: float, fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        screw_from_axis(axis, point, pitch, intensity)


def test_no_screw_has_no_axis_and_one_point_no_line() -> None:
    with pytest.raises(ValueError, match="six zeros"):
        axis_from_screw(np.zeros(6))
    for bad in (math.nan, math.inf, -math.inf):
        with pytest.raises(ValueError, match="six finite numbers"):
            axis_from_screw([1, 0, 0, 0, bad, 0])
    with pytest.raises(ValueError, match="shape"):
        axis_from_screw([1, 0, 0])
    with pytest.raises(ValueError, match="not zero"):
        line_through((1, 2, 3), (1, 2, 3))
    with warnings.catch_warnings():
        # What NumPy thinks of inf - inf is its own affair.
        warnings.simplefilter("ignore", RuntimeWarning)
        for bad in ((1, math.nan, 0), (1, math.inf, 0)):
            with pytest.raises(ValueError, match="finite"):
                line_through(bad, (1, 2, 3))


@many
@given(directions, st.integers(-300, 300))
def test_a_direction_is_found_from_a_vector_of_any_length(n: Array, exponent: int) -> None:
    # Squares of such components would overflow or vanish.
    vector = n / np.linalg.norm(n) * 10.0**exponent
    np.testing.assert_allclose(models.unit_vector(vector), unit(n), rtol=0, atol=1e-15)
    np.testing.assert_allclose(screw_from_axis(vector, (0, 0, 0), math.inf)[3:], unit(n), rtol=0, atol=1e-15)


def test_results_cannot_be_written_to_and_arguments_are_left_alone() -> None:
    screw = screw_from_axis((0, 0, 1), (1, 0, 0), 1)
    parts = axis_from_screw(screw)
    others = (line_through((0, 0, 0), (1, 0, 0)), models.moved_screw(screw, np.eye(3), screw[:3]))
    for array in (screw, parts.axis, parts.point, *others):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7
    axis, point = np.array([0.0, 0.0, 4.0]), np.array([1.0, 0.0, 0.0])
    screw_from_axis(axis, point, 1)
    np.testing.assert_array_equal(axis, [0, 0, 4])
    np.testing.assert_array_equal(point, [1, 0, 0])


often = settings(derandomize=True, deadline=None, max_examples=80)

_vector, _angle = ca.SX.sym("vector", 3), ca.SX.sym("angle")
_FROM_QUATERNION = ca.Function("q", [_vector], [models.matrix_from_quaternion_vector(_vector)])
_FROM_CAYLEY = ca.Function("c", [_vector], [models.matrix_from_cayley(_vector)])
_FROM_AXIS_ANGLE = ca.Function("a", [_vector, _angle], [models.matrix_from_axis_angle(_vector, _angle)])

#: Entries of a rotation matrix are sums of three or four products below 2.
ROUNDING = 2e-15

axes = (
    st.tuples(*[st.floats(-1, 1, allow_subnormal=False)] * 3)
    .filter(lambda n: math.hypot(*n) > 0.1)
    .map(lambda n: np.array(n) / np.linalg.norm(n))
)


def from_quaternion(axis: Array, angle: float) -> Array:
    return np.asarray(_FROM_QUATERNION(np.sin(angle / 2) * axis).full())


def from_cayley(axis: Array, angle: float) -> Array:
    return np.asarray(_FROM_CAYLEY(np.tan(angle / 2) * axis).full())


def from_axis_angle(axis: Array, angle: float) -> Array:
    return np.asarray(_FROM_AXIS_ANGLE(axis, angle).full())


def turned(n: Array, angle: float, x: Array) -> Array:
    """Rodrigues' formula for one vector, with 1 - cos free of cancellation."""
    return np.asarray(np.cos(angle) * x + np.sin(angle) * np.cross(n, x) + 2 * np.sin(angle / 2) ** 2 * (n @ x) * n)


def matrix(n: Array, angle: float) -> Array:
    return np.column_stack([turned(n, angle, e) for e in np.eye(3)])


@pytest.mark.parametrize("function", [from_quaternion, from_cayley, from_axis_angle])
def test_no_rotation_is_the_identity(function: Callable[[Array, float], Array]) -> None:
    np.testing.assert_array_equal(function(np.array([0.6, 0.0, 0.8]), 0.0), np.eye(3))


# Quaternion and Cayley vectors have no half turn: 1 - |q|^2 and 1 / tan lose digits as it is approached.
@often
@given(axes, st.floats(-3, 3))
def test_the_three_matrices_agree_and_are_rotations(n: Array, angle: float) -> None:
    expected = matrix(n, angle)
    for function, tolerance in (
        (from_axis_angle, ROUNDING),
        (from_cayley, ROUNDING),
        # q0 = sqrt(1 - |q|^2) is known to 1e-16 / q0, and q0 >= cos(1.5) = 0.07.
        (from_quaternion, ROUNDING / math.cos(angle / 2)),
    ):
        R = function(n, angle)
        np.testing.assert_allclose(R, expected, rtol=0, atol=tolerance)
        # A quaternion vector gives a rotation however badly q0 is known, up to q0's own rounding.
        np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=2 * ROUNDING)
        assert np.linalg.det(R) == pytest.approx(1, rel=0, abs=2 * ROUNDING)


@often
@given(axes, st.floats(-7, 7), st.floats(-7, 7))
def test_turns_about_one_axis_add_up(n: Array, one: float, other: float) -> None:
    product = from_axis_angle(n, one) @ from_axis_angle(n, other)
    # The sum of angles of 7 is rounded by 1e-15 of its own.
    np.testing.assert_allclose(product, from_axis_angle(n, one + other), rtol=0, atol=2 * ROUNDING)


@often
@given(axes, st.floats(0, math.pi))
def test_axis_and_angle_come_back_from_the_matrix(n: Array, angle: float) -> None:
    axis, found = axis_angle_from_matrix(matrix(n, angle))
    assert 0 <= found <= math.pi
    assert np.linalg.norm(axis) == pytest.approx(1, rel=4e-16)
    assert found == pytest.approx(angle, rel=0, abs=ROUNDING)
    # What counts is the rotation: at no angle the axis may be any, at half a turn its opposite. Within 1e-12 of half a
    # turn the choice of the axis's sign costs twice that angle.
    slack = 2 * (math.pi - angle) if math.pi - angle < 2e-12 else 0.0
    np.testing.assert_allclose(matrix(axis, found), matrix(n, angle), rtol=0, atol=2 * ROUNDING + slack)


@often
@given(axes, st.floats(0.1, 3.1))
def test_the_axis_itself_comes_back_away_from_no_turn_and_half_a_turn(n: Array, angle: float) -> None:
    axis, _ = axis_angle_from_matrix(matrix(n, angle))
    # A matrix known to 1e-16 gives the axis to that over the sine or 1 - cosine: at worst over sin(0.1).
    np.testing.assert_allclose(axis, n, rtol=0, atol=10 * ROUNDING)


TURNS = [(exponent, False) for exponent in (1, 2, 4, 6, 8, 10, 12, 20, 50, 100)]
TURNS += [(exponent, True) for exponent in (1, 2, 4, 6, 8, 10, 11)]


@pytest.mark.parametrize(("exponent", "is_half"), TURNS)
def test_a_small_turn_and_one_short_of_half_a_turn_are_found_to_full_accuracy(exponent: int, *, is_half: bool) -> None:
    """An arc cosine of the trace would lose turns below 1e-8; the sine alone an axis to 1e-16 / (pi - angle)."""
    rng = np.random.default_rng(exponent)
    for _ in range(20):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        small = rng.uniform(0.1 + 0.1 * is_half, 1) * 10.0**-exponent
        angle = math.pi - small if is_half else small
        axis, found = axis_angle_from_matrix(matrix(n, angle))
        assert found == pytest.approx(angle, rel=0 if is_half else ROUNDING, abs=ROUNDING if is_half else 0)
        np.testing.assert_allclose(axis, n, rtol=0, atol=ROUNDING)


def test_half_a_turn_is_found_with_the_axis_whose_first_component_is_positive() -> None:
    rng = np.random.default_rng(4)
    special = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 1], [-1, 0, 1], [-1, 1, 0], [-1, -1, -1], [1e-6, -1, 0]]
    for given_axis in [*special, *rng.normal(size=(20, 3)).tolist()]:
        n = np.array(given_axis, dtype=np.float64)
        n /= np.linalg.norm(n)
        axis, found = axis_angle_from_matrix(2 * np.outer(n, n) - np.eye(3))
        assert found == pytest.approx(math.pi, rel=0, abs=ROUNDING)
        leading = n[np.flatnonzero(n)[0]]
        np.testing.assert_allclose(axis, math.copysign(1, leading) * n, rtol=0, atol=ROUNDING)


def test_no_turn_has_the_z_axis_by_convention_read_only_and_a_matrix_three_rows() -> None:
    axis, angle = axis_angle_from_matrix(np.eye(3))
    np.testing.assert_array_equal(axis, [0, 0, 1])
    assert angle == 0.0
    with pytest.raises(ValueError, match="read-only"):
        axis[0] = 1
    with pytest.raises(ValueError, match="shape"):
        axis_angle_from_matrix(np.eye(2))

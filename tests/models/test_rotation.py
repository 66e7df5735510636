from __future__ import annotations

import math
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from builders import Array
from hypothesis import given, settings
from hypothesis import strategies as st

from screwsynth.models import (
    axis_angle_from_matrix,
    matrix_from_axis_angle,
    matrix_from_cayley,
    matrix_from_quaternion_vector,
)

many = settings(derandomize=True, deadline=None, max_examples=80)

_vector, _angle = ca.SX.sym("vector", 3), ca.SX.sym("angle")
_FROM_QUATERNION = ca.Function("q", [_vector], [matrix_from_quaternion_vector(_vector)])
_FROM_CAYLEY = ca.Function("c", [_vector], [matrix_from_cayley(_vector)])
_FROM_AXIS_ANGLE = ca.Function("a", [_vector, _angle], [matrix_from_axis_angle(_vector, _angle)])

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
@many
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


@many
@given(axes, st.floats(-7, 7), st.floats(-7, 7))
def test_turns_about_one_axis_add_up(n: Array, one: float, other: float) -> None:
    product = from_axis_angle(n, one) @ from_axis_angle(n, other)
    # The sum of angles of 7 is rounded by 1e-15 of its own.
    np.testing.assert_allclose(product, from_axis_angle(n, one + other), rtol=0, atol=2 * ROUNDING)


@many
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


@many
@given(axes, st.floats(0.1, 3.1))
def test_the_axis_itself_comes_back_away_from_no_turn_and_half_a_turn(n: Array, angle: float) -> None:
    axis, _ = axis_angle_from_matrix(matrix(n, angle))
    # A matrix known to 1e-16 gives the axis to that over the sine or 1 - cosine: at worst over sin(0.1).
    np.testing.assert_allclose(axis, n, rtol=0, atol=10 * ROUNDING)


@pytest.mark.parametrize("exponent", [1, 2, 4, 6, 8, 10, 12, 20, 50, 100])
def test_a_small_turn_is_found_to_full_relative_accuracy(exponent: int) -> None:
    rng = np.random.default_rng(exponent)
    for _ in range(20):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        angle = rng.uniform(0.1, 1) * 10.0**-exponent
        axis, found = axis_angle_from_matrix(matrix(n, angle))
        # An arc cosine of the trace would lose everything below 1e-8.
        assert found == pytest.approx(angle, rel=ROUNDING)
        np.testing.assert_allclose(axis, n, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("exponent", [1, 2, 4, 6, 8, 10, 11])
def test_a_turn_short_of_half_a_turn_is_found_with_the_right_axis(exponent: int) -> None:
    rng = np.random.default_rng(exponent)
    for _ in range(20):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        angle = math.pi - rng.uniform(0.2, 1) * 10.0**-exponent
        axis, found = axis_angle_from_matrix(matrix(n, angle))
        # The sine alone would give the axis to 1e-16 / (pi - angle) only.
        assert found == pytest.approx(angle, rel=0, abs=ROUNDING)
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


def test_no_turn_has_the_z_axis_by_convention() -> None:
    axis, angle = axis_angle_from_matrix(np.eye(3))
    np.testing.assert_array_equal(axis, [0, 0, 1])
    assert angle == 0.0


def test_an_axis_is_read_only_and_a_matrix_must_have_three_rows() -> None:
    axis, _ = axis_angle_from_matrix(np.eye(3))
    with pytest.raises(ValueError, match="read-only"):
        axis[0] = 1
    with pytest.raises(ValueError, match="shape"):
        axis_angle_from_matrix(np.eye(2))

"""Newton's method with the equations handed in: least-norm steps, refusals, and damped least squares."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from builders import Array

from screwsynth.models.linalg import least_squares
from screwsynth.models.newton import Linear, VectorEquations, newton


def circle(z: Array) -> tuple[Array, Array]:
    """A point of the plane on the unit circle; the third number enters no equation."""
    return np.array([z[0] ** 2 + z[1] ** 2 - 1]), np.array([[2 * z[0], 2 * z[1], 0.0]])


def test_least_norm_steps_lead_straight_to_a_circle() -> None:
    """Every step is along the radius, and what enters no equation stays; the error is squared in each step."""
    start, errors = np.array([3.0, 4.0, 7.0]), []
    equations = VectorEquations(circle, 1e-15)
    for steps in range(9):
        found = newton(equations, equations.at(start), steps=steps)
        errors.append(abs(float(np.hypot(*found.z[:2])) - 1))
        np.testing.assert_allclose(found.z / np.array([*[np.hypot(*found.z[:2])] * 2, 7]), [0.6, 0.8, 1], rtol=1e-15)
    assert errors[-1] <= 2e-16
    # Of the radius the step is (r - 1 / r) / 2, whose error is (r - 1)^2 / 2 r.
    for before, after in pairwise(errors[:6]):
        assert after == pytest.approx(before**2 / (2 * (1 + before)), rel=1e-3)


def test_numbers_that_do_not_move_and_sizes() -> None:
    """One number alone moves; and with sizes a step is shortest in parts of them."""
    equations = VectorEquations(circle, 1e-15, [1])
    found = newton(equations, equations.at(np.array([0.6, 2.0, 7.0])), steps=20)
    np.testing.assert_allclose(found.z, [0.6, 0.8, 7], rtol=1e-15)
    size = np.array([1.0, 10.0])
    sized = VectorEquations(circle, 0.0, [0, 1], size)
    step = newton(sized, sized.at(np.array([3.0, 4.0, 7.0])), steps=1).z[:2] - [3, 4]
    # Minimal |step / size|^2 with 6 a + 8 b = -24: the step is along size^2 times the gradient.
    gradient = np.array([6.0, 8.0])
    np.testing.assert_allclose(step, -24 * size**2 * gradient / (size**2 @ gradient**2), rtol=1e-14)


def test_no_solution_and_no_value() -> None:
    """Where no point solves the equations the method ends after its steps, and at once where there is no value."""
    parallel = VectorEquations(lambda z: (np.array([z[0], z[0] - 1]), np.array([[1.0], [1.0]])), 1e-9)
    assert newton(parallel, parallel.at(np.array([5.0])), steps=50).error == pytest.approx(0.5)
    with np.errstate(invalid="ignore"):
        root = VectorEquations(lambda z: (np.sqrt(z) - 1, 1 / (2 * np.sqrt(z[:, None]))), 1e-9)
        found = newton(root, root.at(np.array([-5.0])), steps=50)
    assert (found.error, found.z) == (np.inf, [-5])
    steep = VectorEquations(lambda z: (z, np.full((1, 1), np.inf)), 1e-9)
    assert steep.at(np.array([0.0])).error == np.inf


class Falling:
    """``arctan(x) = 0``, of which full steps from afar lead away: steps that make the value larger are refused."""

    def __init__(self) -> None:
        self.tried: list[float] = []

    def linear(self, at: float) -> Linear | None:
        return Linear(np.array([np.arctan(at)]), np.array([[1 / (1 + at**2)]])) if at else None

    def moved(self, at: float, step: Array) -> float | None:
        there = at + float(step[0])
        self.tried.append(there)
        return there if abs(there) < abs(at) else None


def test_refused_steps_are_shortened() -> None:
    whole, parts = Falling(), Falling()
    assert newton(whole, 3.0, steps=50) == 3.0
    assert whole.tried == [pytest.approx(3 - 10 * np.arctan(3))]
    assert newton(parts, 3.0, steps=50, parts=[1.0, 0.5, 0.25]) == pytest.approx(0, abs=1e-15)
    assert max(map(abs, parts.tried)) > 3


def test_singular_values_below_a_part_are_tried_as_zero() -> None:
    """With a nearly dependent equation the first step is refused as too long, the second leaves it out."""

    class Nearly:
        def linear(self, at: Array) -> Linear | None:
            return Linear(np.array([at[0] - 1, 1e-9 * at[1] + 1e-6]), np.diag([1.0, 1e-9]))

        def moved(self, at: Array, step: Array) -> Array | None:
            return at + step if np.abs(step).max() < 10 else None

    np.testing.assert_allclose(newton(Nearly(), np.zeros(2), steps=1, zeros=[1e-11]), 0)
    np.testing.assert_allclose(newton(Nearly(), np.zeros(2), steps=1, zeros=[1e-11, 1e-8]), [1, 0])


@pytest.mark.parametrize("shape", [(4, 7), (7, 4), (5, 5), (120, 90)])
def test_damped_least_squares_are_those_of_more_rows(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    A, b = rng.normal(size=shape), rng.normal(size=shape[0])
    rows, right = np.vstack([A, 0.3 * np.eye(shape[1])]), np.concatenate([b, np.zeros(shape[1])])
    expected = np.linalg.lstsq(rows, right, rcond=None)[0]
    np.testing.assert_allclose(least_squares(A, b, damping=0.09), expected, atol=1e-13)

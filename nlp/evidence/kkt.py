"""First-order analysis of a program at a point: gradient, active sides, multipliers, and a Newton correction.

All quantities are in scaled variables ``s = (x - centre) / scale``, which run from -1 to 1; the scaled objective
``phi = sign * F / objective_scale`` is minimised. A bound or constraint has one or two *sides* ``slack >= 0`` with an
outward unit normal ``a``: ``slack`` is, to first order, a distance in scaled variables. A point is stationary if

    grad phi + sum_j mu_j a_j = 0,    mu_j >= 0 on inequalities,    mu_j = 0 where slack_j > 0.

No solver is used: everything is computed from the program and the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.linalg import least_squares, nonnegative_least_squares
from ...models.newton import Linear, newton
from ...models.values import dataclass
from ..program.nlp import Nlp, Side
from .equations import ProgramEquations, gradient_sizes

#: Largest slack of an active side, in scaled variables: well above the rounding error of a corrected point, well below
#: any distance that is relevant to a design.
ACTIVE = 1e-7
#: Largest scaled derivative of the Lagrangian at a stationary point: F can then still improve by at most about this
#: part of its size over the whole range of a variable along which it is linear.
STATIONARY = 1e-7
#: Largest violation of a side at a feasible point, in scaled variables.
FEASIBLE = 1e-9
#: Relative size below which the gradient of a constraint counts as zero.
NO_GRADIENT = 1e-9
#: Rounding error of a constraint's distance, in rounding units of its bound, and its smallest allowance.
ROUNDINGS = 4
NOTABLE = 1e-10
#: Largest number of Newton steps of a correction. From an interior-point solution, two or three reach rounding error; a
#: change of the active set, or an optimum where F is flatter than a parabola, needs more.
_NEWTON_STEPS = 40
#: Steps with a subset of the variables before more may move: from home, loops close in five or six.
_FIRST_STEPS = 12
#: Largest step of a correction in a scaled variable: a correction improves a point and does not search.
_LONGEST_STEP = 0.1
#: Relative thresholds of zero singular values in the Newton system, which is singular at optima that are not isolated.
#: Where second derivatives are nearly zero, the first threshold gives too long a step, and the next one is tried.
_NEWTON_RCOND = (1e-11, 1e-8, 1e-6)
#: Residual of the stationarity conditions that is rounding error. Newton's method converges quadratically: the step
#: that reaches this value mostly reaches 1e-16.
_ROUNDING = 1e-13
#: Residual below which Newton's method has converged on its active set; a multiplier below minus this is negative.
_CONVERGED = 1e-10


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A program linearised at a point, in scaled variables.

    Attributes:
        x: (n,) the point, unscaled.
        F: objective, unscaled.
        phi: scaled objective, which is minimised.
        gradient: (n,) gradient of phi in scaled variables.
        sides: the k sides of all bounds and constraints.
        slack: (k,) distance to each side, negative outside; for an equation, minus the size of the residual.
        residual: (k,) signed residual ``expression - limit``, positive outside, scaled to the same distance.
        normals: (k, n) outward unit normals in scaled variables; for an equation, the gradient's direction.
        per_unit: (k,) change of the slack per unit by which a side's limit is relaxed.
        noise: (k,) rounding error of the slack if narrow ranges make it notable; otherwise 0.
        rounding: rounding error of the stationarity conditions.
    """

    x: FloatArray
    F: float
    phi: float
    gradient: FloatArray
    sides: tuple[Side, ...]
    slack: FloatArray
    residual: FloatArray
    normals: FloatArray
    per_unit: FloatArray
    noise: FloatArray
    rounding: float

    @property
    def violation(self) -> float:
        """Largest distance outside a side; 0 at a feasible point, ``inf`` where the program has no finite value."""
        if not (np.isfinite(self.phi) and np.isfinite(self.slack).all()):
            return float("inf")
        return float(max(0.0, -(self.slack + self.noise).min(initial=0.0)))

    def active(self, tolerance: float = ACTIVE) -> tuple[int, ...]:
        """Return the indices of the active set: the sides whose slack is at most the tolerance.

        Args:
            tolerance: largest slack of an active side.
        """
        return tuple(int(j) for j in np.flatnonzero(self.slack <= tolerance))


def linearise(nlp: Nlp, x: FloatArray) -> Linearisation:
    """Return the program linearised at a point (n,)."""
    F, gradient, g, jacobian = nlp.program.kernels.derivatives(x, nlp.arguments)
    sides, scale = nlp.sides, nlp.scale
    rows = jacobian * scale
    sizes = gradient_sizes(rows, nlp.row_sizes, NO_GRADIENT)
    per_unit = 1 / np.concatenate([scale, sizes])[sides.place]
    residual = sides.sign * (np.concatenate([x, g.ravel()])[sides.place] - sides.limit) * per_unit
    outward = sides.sign * per_unit
    normals = outward[:, None] * np.concatenate([np.diag(scale), rows])[sides.place]
    # Rounding of a constraint comes from its value and from its variables.
    steps = np.abs(normals) @ (np.abs(x) / scale)
    noise = ROUNDINGS * np.finfo(float).eps * (np.abs(sides.limit) * per_unit + steps)
    noise[sides.place < nlp.n] = 0.0
    noise = np.where(noise > NOTABLE, noise, 0.0)
    weight = nlp.sign / nlp.objective_scale
    return Linearisation(
        x=np.asarray(x, dtype=np.float64),
        F=float(F[0, 0]),
        phi=weight * float(F[0, 0]),
        gradient=weight * gradient.ravel() * scale,
        sides=sides.sides,
        slack=np.where(sides.equal, -np.abs(residual), -residual),
        residual=residual,
        normals=normals,
        per_unit=per_unit,
        noise=noise,
        rounding=max(nlp.rounding, float(noise.max(initial=0.0))),
    )


class Multipliers(NamedTuple):
    """Multipliers of the sides at a point.

    Attributes:
        mu: (k,) multipliers: nonnegative on inequalities, zero on inactive sides.
        residual: largest component of ``grad phi + sum mu a``; zero where ``-grad phi`` lies in the cone of the outward
            normals, ``inf`` where the gradient is not finite.
    """

    mu: FloatArray
    residual: float


def multipliers(at: Linearisation, active: Sequence[int]) -> Multipliers:
    """Return the multipliers that minimise the residual of the stationarity conditions.

    Args:
        at: linearised program at the point.
        active: indices of the sides with multipliers that may differ from zero.
    """
    mu = np.zeros(len(at.sides))
    if not np.isfinite(at.gradient).all():
        return Multipliers(mu, float("inf"))
    if active:
        columns = [(j, 1.0) for j in active]
        columns += [(j, -1.0) for j in active if at.sides[j].bound == "equal"]
        A = np.array([sign * at.normals[j] for j, sign in columns]).T
        for value, (j, sign) in zip(nonnegative_least_squares(A, -at.gradient), columns, strict=True):
            mu[j] += sign * value
    left = at.gradient + at.normals.T @ mu
    return Multipliers(mu, float(np.max(np.abs(left), initial=0.0)))


def constraint_weights(nlp: Nlp, at: Linearisation, mu: FloatArray) -> FloatArray:
    """Return the weight of each constraint's expression, (c,), in the Lagrangian ``phi + sum mu residual``.

    Args:
        nlp: the nonlinear program.
        at: linearised program at the point.
        mu: (k,) multipliers of the sides.
    """
    sides = nlp.sides
    weights = np.bincount(sides.place, sides.sign * mu * at.per_unit, nlp.n + len(nlp.program.constraints))
    return np.asarray(weights[nlp.n :], dtype=np.float64)


def lagrangian_hessian(nlp: Nlp, at: Linearisation, mu: FloatArray) -> FloatArray:
    """Return the Hessian of the Lagrangian ``phi + sum mu residual`` in scaled variables, (n, n).

    Args:
        nlp: the nonlinear program.
        at: linearised program at the point.
        mu: (k,) multipliers of the sides.
    """
    weights = constraint_weights(nlp, at, mu)
    full = nlp.program.kernels.hessian(at.x, nlp.arguments, nlp.sign / nlp.objective_scale, weights)
    return full * np.outer(nlp.scale, nlp.scale)


def correct_point(nlp: Nlp, x: FloatArray, active: Sequence[int]) -> Linearisation:
    """Return a point corrected by Newton's method on the stationarity conditions with an active set.

    A side that a step would cross joins the active set; a side with a negative multiplier leaves it. Steps are
    least-norm, so that a point on a manifold of optima does not move along the manifold.

    Args:
        nlp: the nonlinear program.
        x: (n,) point near a stationary point.
        active: indices (into ``nlp.sides``) of the first active set.

    Returns:
        The linearised program at the corrected point, inside the variables' bounds; where Newton's method does not
        converge, at the iterate with the smallest residual since the last change of the active set.
    """
    at = linearise(nlp, _move_onto_bounds(nlp, np.clip(x, nlp.lower, nlp.upper), active))
    conditions = _Stationarity(nlp, at, active)
    for _ in range(_NEWTON_STEPS):
        at = newton(conditions, at, steps=_NEWTON_STEPS, zeros=_NEWTON_RCOND)
        if not conditions.drops_side(at):
            break
    return conditions.best


class _Stationarity:
    """Stationarity conditions with an active set, as equations in scaled variables and multipliers.

    Args:
        nlp: the nonlinear program.
        at: linearised program at the first point.
        active: indices of the first active set.

    Attributes:
        best: linearised program at the point with the smallest residual since the last change of the active set.
    """

    def __init__(self, nlp: Nlp, at: Linearisation, active: Sequence[int]) -> None:
        self._nlp, self._active, self._left = nlp, list(active), _NEWTON_STEPS
        self.best, self._least = at, np.inf
        self._mu, self._error = np.zeros(len(at.sides)), np.inf

    def linear(self, at: Linearisation) -> Linear | None:
        """Return the conditions to first order; None if the conditions hold to rounding, or after the last step."""
        n, k = self._nlp.n, len(self._active)
        if not self._left:
            return None
        self._left -= 1
        self._mu, self._error = _residual(at, self._active)
        if self._error <= self._least:
            self.best, self._least = at, self._error
        if self._error <= _ROUNDING:
            return None
        A = at.normals[self._active]
        matrix = np.zeros((n + k, n + k))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = lagrangian_hessian(self._nlp, at, self._mu), A.T, A
        residual = np.concatenate([at.gradient + at.normals.T @ self._mu, at.residual[self._active]])
        return Linear(residual, matrix) if np.isfinite(matrix).all() and np.isfinite(residual).all() else None

    def moved(self, at: Linearisation, step: FloatArray) -> Linearisation | None:
        """Return the program after a step; None if the step is too long, or the residual grows.

        A step that would cross a side ends on the side, which joins the active set.
        """
        nlp, active = self._nlp, self._active
        step = step[: nlp.n]
        if np.max(np.abs(step), initial=0.0) > _LONGEST_STEP:
            return None
        towards = at.normals @ step
        towards[active] = 0.0
        reach = np.where(towards > 1e-12, np.maximum(at.slack, 0.0) / np.maximum(towards, 1e-12), np.inf)
        part = min(1.0, float(reach.min(initial=1.0)))
        crossed = [int(np.argmin(reach))] if part < 1.0 else []
        moved = np.clip(at.x + part * nlp.scale * step, nlp.lower, nlp.upper)
        after = linearise(nlp, _move_onto_bounds(nlp, moved, [*active, *crossed]))
        # Newton's error is about the square of its step: a residual that grows no further decreases at the next step.
        if not crossed and not _residual(after, active)[1] < max(self._error, 4 * float(step @ step)):
            return None
        self._change([*active, *crossed])
        return after

    def drops_side(self, at: Linearisation) -> bool:
        """Remove the side with the most negative multiplier from the active set; return True if a side was removed."""
        wrong = np.where(self._nlp.sides.equal, 0.0, self._mu)
        converged = max(_CONVERGED, 4 * at.rounding)
        if not self._left or not self._error <= converged or wrong.min(initial=0.0) >= -converged:
            return False
        worst = int(np.argmin(wrong))
        self._change([j for j in self._active if j != worst])
        return True

    def _change(self, active: list[int]) -> None:
        if active != self._active:
            self._active, self._least = active, np.inf


def _residual(at: Linearisation, active_set: list[int]) -> tuple[FloatArray, float]:
    """Return least-squares multipliers (k,) of an active set, and the residual of the KKT conditions.

    The residual is the largest of three values: the derivatives of the Lagrangian, the distances from the active sides,
    inside or outside, and the violation.
    """
    mu = np.zeros(len(at.sides))
    if active_set and np.isfinite(at.gradient).all():
        A = at.normals[active_set]
        # Normals of variables' bounds are orthonormal, and most active sets have no other sides.
        orthonormal = np.array_equal(A @ A.T, np.eye(len(active_set)))
        mu[active_set] = -A @ at.gradient if orthonormal else least_squares(A.T, -at.gradient)
    left = at.gradient + at.normals.T @ mu
    off = float(np.max(np.abs(at.residual[active_set]), initial=0.0)) if active_set else 0.0
    return mu, max(float(np.max(np.abs(left), initial=0.0)), off, at.violation)


def _move_onto_bounds(nlp: Nlp, x: FloatArray, active_set: Sequence[int]) -> FloatArray:
    """Return a point (n,) with the variables of active bounds exactly on these bounds."""
    sides, moved = nlp.sides, x.copy()
    for j in active_set:
        variable = sides.sides[j].variable
        if variable is not None:
            moved[variable] = sides.limit[j]
    return moved


def close_equations(nlp: Nlp, x: FloatArray, *, in_place: bool = False) -> FloatArray:
    """Return the nearest point, to first order, at which the program's equations hold.

    Newton's method with least-norm steps solves only the equations: unit lengths of directions and closure of loops.
    First only internal unknowns that the loops determine move. If this fails, free actuator coordinates move too, then
    the pose, then all variables.

    Args:
        nlp: the nonlinear program.
        x: (n,) given point.
        in_place: If true, only internal unknowns may move.

    Returns:
        (n,) the point inside the variables' bounds; the last iterate if Newton's method does not converge.
    """
    if not nlp.sides.equal.any():
        return np.asarray(x, dtype=np.float64)
    for movable in [list(nlp.program.places.inner)] if in_place else _movable(nlp):
        equations = ProgramEquations(nlp, movable, _ROUNDING, NO_GRADIENT)
        steps = _NEWTON_STEPS if len(movable) == nlp.n else _FIRST_STEPS
        at = newton(equations, equations.at(x), steps=steps)
        if np.max(np.abs(at.residual)) <= FEASIBLE:
            break
    return at.x


def _movable(nlp: Nlp) -> list[list[int]]:
    """Return the sets of variables that may move, in the order of the attempts."""
    places, every = nlp.program.places, list(range(nlp.n))
    unknowns = [sorted(places.determined), sorted({index for at_pose in places.unknowns for index in at_pose})]
    unknowns = unknowns if len(unknowns[0]) < len(unknowns[1]) else unknowns[:1]
    if not unknowns[-1]:
        return [every]
    dimensions = {place.index for place in places.numbers[: places.dimensions] if place.vector == "x"}
    return [*unknowns, [index for index in every if index not in dimensions], every]

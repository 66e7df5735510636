"""First-order geometry of a program at a point: gradient, active sides, multipliers, and a Newton correction.

Everything is in scaled variables ``s = (x - centre) / scale``, which run from -1 to 1, and for the objective
``phi = sign * F / objective_scale``, which is minimised. Every bound and constraint becomes *sides* ``slack >= 0`` with
an outward unit normal ``a``, so that ``slack`` is, to first order, a distance in scaled variables. A point is
stationary when

    grad phi + sum_j mu_j a_j = 0,    mu_j >= 0 on inequalities,    mu_j = 0 where slack_j > 0.

Nothing here knows of a solver: all of it comes from the program and the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.program import Nlp

#: A side closer than this, in scaled variables, is active: well above the rounding error of a corrected point, well
#: below any clearance that means something in a design.
ACTIVE = 1e-7
#: Newton steps of a correction; from an interior-point solution two or three reach rounding error.
_NEWTON_STEPS = 12
#: A correction moves no variable by more than this part of half its range: it polishes, it does not search.
_LONGEST_STEP = 0.1
#: Singular values below this part of the largest are zero in the Newton system: it may be singular (flat optima).
_NEWTON_RCOND = 1e-11


@dataclass(frozen=True)
class Side:
    """One side of a bound or constraint.

    Attributes:
        name: the variable or constraint.
        bound: which side of it.
        variable: index of the variable, or None for a constraint.
        constraint: index of the constraint, or None for a variable's bound.
    """

    name: str
    bound: Literal["min", "max", "equal"]
    variable: int | None = None
    constraint: int | None = None

    @property
    def sign(self) -> float:
        """Direction, along the bounded expression, that leaves the feasible side."""
        return -1.0 if self.bound == "min" else 1.0


@dataclass(frozen=True, eq=False)
class Linearisation:
    """The program at a point, to first order.

    Attributes:
        x: (n,) the point, unscaled.
        F: objective as it stands.
        phi: objective that is minimised, scaled.
        gradient: (n,) of phi in scaled variables.
        sides: every side of every bound and constraint.
        slack: (k,) distance to each side; negative outside. For an equation, minus the size of the residual.
        residual: (k,) signed residual ``expression - limit``, as the same distance.
        normals: (k, n) outward unit normals in scaled variables; for an equation, the gradient's direction.
        per_unit: (k,) distance per unit by which a side's limit is moved.
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

    @property
    def violation(self) -> float:
        """Largest distance outside a side; 0 when feasible, ``inf`` where the program is not defined."""
        if not (np.isfinite(self.phi) and np.isfinite(self.slack).all()):
            return float("inf")
        return float(max(0.0, -self.slack.min(initial=0.0)))

    def active(self, tolerance: float = ACTIVE) -> tuple[int, ...]:
        """Indices of the sides that the point lies on, or outside of."""
        return tuple(int(j) for j in np.flatnonzero(self.slack <= tolerance))


def sides_of(nlp: Nlp) -> tuple[Side, ...]:
    """Every side of a program, variables' bounds first."""
    sides: list[Side] = []
    for index, variable in enumerate(nlp.program.variables):
        sides += [Side(variable.name, "min", variable=index), Side(variable.name, "max", variable=index)]
    for index, constraint in enumerate(nlp.program.constraints):
        lower, upper = nlp.g_lower[index], nlp.g_upper[index]
        if lower == upper:
            sides.append(Side(constraint.name, "equal", constraint=index))
            continue
        if np.isfinite(lower):
            sides.append(Side(constraint.name, "min", constraint=index))
        if np.isfinite(upper):
            sides.append(Side(constraint.name, "max", constraint=index))
    return tuple(sides)


def limit_of(nlp: Nlp, side: Side) -> float:
    """The limit of a side, in the program's terms."""
    if side.variable is not None:
        return float((nlp.lower if side.bound == "min" else nlp.upper)[side.variable])
    return float((nlp.g_lower if side.bound == "min" else nlp.g_upper)[side.constraint or 0])


def linearise(nlp: Nlp, x: FloatArray) -> Linearisation:
    """The program at a point (n,), to first order."""
    F, gradient, g, jacobian = (output.full() for output in nlp.program.derivatives(x, nlp.arguments))
    scale, sides = nlp.scale, sides_of(nlp)
    residual, normals, per_unit = np.zeros(len(sides)), np.zeros((len(sides), nlp.n)), np.zeros(len(sides))
    for j, side in enumerate(sides):
        if side.variable is not None:
            row, value = np.zeros(nlp.n), x[side.variable]
            row[side.variable] = scale[side.variable]
        else:
            row, value = jacobian[side.constraint or 0] * scale, g[side.constraint or 0, 0]
        # Where a constraint has no gradient there is no distance to it; its own residual then stands for one.
        size = float(np.linalg.norm(row)) if np.any(np.abs(row) > 1e-9) else 1.0
        residual[j] = side.sign * (value - limit_of(nlp, side)) / size
        normals[j], per_unit[j] = side.sign * row / size, 1 / size
    slack = np.array([-abs(r) if s.bound == "equal" else -r for r, s in zip(residual, sides, strict=True)])
    weight = nlp.sign / nlp.objective_scale
    return Linearisation(
        x=np.asarray(x, dtype=np.float64),
        F=float(F[0, 0]),
        phi=weight * float(F[0, 0]),
        gradient=weight * gradient.ravel() * scale,
        sides=sides,
        slack=slack,
        residual=residual,
        normals=normals,
        per_unit=per_unit,
    )


def multipliers(at: Linearisation, active: Sequence[int]) -> tuple[FloatArray, float]:
    """The multipliers that make a point as stationary as it can be, and what is left.

    Args:
        at: the point.
        active: indices of the sides that may carry a multiplier.

    Returns:
        (k,) multipliers, not negative on inequalities and zero on inactive sides, and the largest component of
        ``grad phi + sum mu a``: the distance of ``-grad phi`` from the cone of outward normals.
    """
    mu = np.zeros(len(at.sides))
    if not np.isfinite(at.gradient).all():
        return mu, float("inf")
    if active:
        columns = [(j, 1.0) for j in active]
        columns += [(j, -1.0) for j in active if at.sides[j].bound == "equal"]
        A = np.array([sign * at.normals[j] for j, sign in columns]).T
        for value, (j, sign) in zip(nonnegative_least_squares(A, -at.gradient), columns, strict=True):
            mu[j] += sign * value
    left = at.gradient + at.normals.T @ mu
    return mu, float(np.max(np.abs(left), initial=0.0))


def nonnegative_least_squares(A: FloatArray, b: FloatArray) -> FloatArray:
    """``argmin |A y - b|`` over ``y >= 0`` by the active-set method of Lawson and Hanson (1974, chapter 23).

    Args:
        A: (n, k) matrix, possibly rank deficient.
        b: (n,) vector.
    """
    k = A.shape[1]
    y, passive = np.zeros(k), np.zeros(k, dtype=bool)
    tolerance = 1e-14 * max(1.0, float(np.linalg.norm(b)))
    for _ in range(3 * k + 3):
        drive = A.T @ (b - A @ y)
        drive[passive] = -np.inf
        if passive.all() or drive.max() <= tolerance:
            break
        passive[int(np.argmax(drive))] = True
        while True:
            trial = np.zeros(k)
            trial[passive] = np.linalg.lstsq(A[:, passive], b, rcond=None)[0]
            blocked = passive & (trial <= 0)
            if not blocked.any():
                break
            step = float(np.min(y[blocked] / np.maximum(y[blocked] - trial[blocked], 1e-300)))
            y = y + step * (trial - y)
            passive &= y > 1e-15
            y[~passive] = 0.0
        y = trial
    return y


def lagrangian_hessian(nlp: Nlp, at: Linearisation, mu: FloatArray) -> FloatArray:
    """Hessian of ``phi + sum mu slack-side`` in scaled variables, (n, n)."""
    weights = np.zeros(len(nlp.program.constraints))
    for side, value, per_unit in zip(at.sides, mu, at.per_unit, strict=True):
        if side.constraint is not None:
            weights[side.constraint] += side.sign * value * per_unit
    full = nlp.program.hessian(at.x, nlp.arguments, nlp.sign / nlp.objective_scale, weights).full()
    return np.asarray(full * np.outer(nlp.scale, nlp.scale), dtype=np.float64)


def correct(nlp: Nlp, x: FloatArray, active: Sequence[int]) -> FloatArray:
    """Newton's method on the stationarity conditions with a given active set, from a point close to a solution.

    The steps are least-norm, so a point on a manifold of optima stays where it is along it.

    Args:
        nlp: the program.
        x: (n,) point near a stationary one.
        active: indices (into :func:`sides_of`) of the sides to hold at their limits.

    Returns:
        (n,) the corrected point, inside the variables' bounds; the given one where Newton's method does not help.
    """
    rows = list(active)
    at = linearise(nlp, np.clip(x, nlp.lower, nlp.upper))
    best, best_error = x, _error(at, rows)
    for _ in range(_NEWTON_STEPS):
        A = at.normals[rows]
        mu = np.zeros(len(at.sides))
        if rows:
            mu[rows] = np.linalg.lstsq(A.T, -at.gradient, rcond=None)[0]
        H = lagrangian_hessian(nlp, at, mu)
        k = len(rows)
        matrix = np.block([[H, A.T], [A, np.zeros((k, k))]])
        right = -np.concatenate([at.gradient + at.normals.T @ mu, at.residual[rows]])
        if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
            break
        step = np.linalg.lstsq(matrix, right, rcond=_NEWTON_RCOND)[0][: nlp.n]
        if np.max(np.abs(step), initial=0.0) > _LONGEST_STEP:
            break
        moved = np.clip(at.x + nlp.scale * step, nlp.lower, nlp.upper)
        for j in rows:
            variable = at.sides[j].variable
            if variable is not None:
                moved[variable] = limit_of(nlp, at.sides[j])
        at = linearise(nlp, moved)
        error = _error(at, rows)
        if not error < best_error:
            break
        best, best_error = moved, error
    return best


def _error(at: Linearisation, rows: Sequence[int]) -> float:
    """Residual of the stationarity conditions with the given sides held; ``inf`` where it is not defined."""
    if not np.isfinite(at.violation):
        return float("inf")
    A = at.normals[list(rows)]
    left = at.gradient
    if rows:
        left = left + A.T @ np.linalg.lstsq(A.T, -at.gradient, rcond=None)[0]
    return max(float(np.max(np.abs(left), initial=0.0)), at.violation)

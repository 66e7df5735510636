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

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.linear import nonnegative_least_squares
from screwsynth.nlp.program import Nlp, Side

#: A side closer than this, in scaled variables, is active: well above the rounding error of a corrected point, well
#: below any clearance that means something in a design.
ACTIVE = 1e-7
#: Newton steps of a correction; from an interior-point solution two or three reach rounding error.
_NEWTON_STEPS = 12
#: A correction moves no variable by more than this part of half its range: it polishes, it does not search.
_LONGEST_STEP = 0.1
#: Singular values below this part of the largest are zero in the Newton system: it may be singular (flat optima).
_NEWTON_RCOND = 1e-11
#: A residual of the stationarity conditions that further steps cannot bring down: a few rounding errors.
_ROUNDING = 1e-15


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


def linearise(nlp: Nlp, x: FloatArray) -> Linearisation:
    """The program at a point (n,), to first order."""
    F, gradient, g, jacobian = (output.full() for output in nlp.program.derivatives(x, nlp.arguments))
    table, scale = nlp.sides, nlp.scale
    rows = jacobian * scale
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    # Where a constraint has no gradient there is no distance to it; its own residual then stands for one.
    sizes = np.where(sizes > 1e-9, sizes, 1.0)
    per_unit = 1 / np.concatenate([scale, sizes])[table.place]
    residual = table.sign * (np.concatenate([x, g.ravel()])[table.place] - table.limit) * per_unit
    outward = table.sign * per_unit
    normals = outward[:, None] * np.concatenate([np.diag(scale), rows])[table.place]
    weight = nlp.sign / nlp.objective_scale
    return Linearisation(
        x=np.asarray(x, dtype=np.float64),
        F=float(F[0, 0]),
        phi=weight * float(F[0, 0]),
        gradient=weight * gradient.ravel() * scale,
        sides=table.sides,
        slack=np.where(table.equal, -np.abs(residual), -residual),
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


def lagrangian_hessian(nlp: Nlp, at: Linearisation, mu: FloatArray) -> FloatArray:
    """Hessian of ``phi + sum mu slack-side`` in scaled variables, (n, n)."""
    table = nlp.sides
    carried = np.bincount(table.place, table.sign * mu * at.per_unit, nlp.n + len(nlp.program.constraints))
    weights = carried[nlp.n :]
    full = nlp.program.hessian(at.x, nlp.arguments, nlp.sign / nlp.objective_scale, weights).full()
    return np.asarray(full * np.outer(nlp.scale, nlp.scale), dtype=np.float64)


def correct(nlp: Nlp, x: FloatArray, active: Sequence[int]) -> FloatArray:
    """Newton's method on the stationarity conditions with a given active set, from a point close to a solution.

    The steps are least-norm, so a point on a manifold of optima stays where it is along it.

    Args:
        nlp: the program.
        x: (n,) point near a stationary one.
        active: indices (into ``nlp.sides``) of the sides to hold at their limits.

    Returns:
        (n,) the corrected point, inside the variables' bounds; the given one where Newton's method does not help.
    """
    rows = list(active)
    pinned = [(nlp.sides.place[j], nlp.sides.limit[j]) for j in rows if nlp.sides.sides[j].variable is not None]
    best, least = x, np.inf
    at = linearise(nlp, np.clip(x, nlp.lower, nlp.upper))
    for _ in range(_NEWTON_STEPS + 1):
        A = at.normals[rows]
        mu = np.zeros(len(at.sides))
        if rows:
            mu[rows] = np.linalg.lstsq(A.T, -at.gradient, rcond=None)[0]
        left = at.gradient + at.normals.T @ mu
        error = max(float(np.max(np.abs(left), initial=0.0)), at.violation)
        if not error < least:
            break
        best, least = at.x, error
        if error <= _ROUNDING:
            break
        k = len(rows)
        matrix = np.zeros((nlp.n + k, nlp.n + k))
        matrix[: nlp.n, : nlp.n] = lagrangian_hessian(nlp, at, mu)
        matrix[: nlp.n, nlp.n :], matrix[nlp.n :, : nlp.n] = A.T, A
        if not np.isfinite(matrix).all():
            break
        right = -np.concatenate([left, at.residual[rows]])
        step = np.linalg.lstsq(matrix, right, rcond=_NEWTON_RCOND)[0][: nlp.n]
        if np.max(np.abs(step), initial=0.0) > _LONGEST_STEP:
            break
        moved = np.clip(at.x + nlp.scale * step, nlp.lower, nlp.upper)
        for variable, limit in pinned:
            moved[variable] = limit
        at = linearise(nlp, moved)
    return best

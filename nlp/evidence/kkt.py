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

from ...models import FloatArray
from ..program.nlp import Nlp, Side
from .linalg import nonnegative_least_squares

#: A side closer than this, in scaled variables, is active: well above the rounding error of a corrected point, well
#: below any clearance that means something in a design.
ACTIVE = 1e-7
#: Largest scaled derivative of the Lagrangian that counts as none: F can then still improve by about this part of its
#: size, at most, over the whole range of a variable along which it is straight.
STATIONARY = 1e-7
#: Largest distance outside a limit, in half ranges, of a point that is feasible.
FEASIBLE = 1e-9
#: Newton steps of a correction. Two or three reach rounding error from an interior-point solution; a change of the
#: active set, or an optimum where F is flatter than a parabola, takes more.
_NEWTON_STEPS = 40
#: A correction moves no variable by more than this part of half its range at once: it polishes, it does not search.
_LONGEST_STEP = 0.1
#: Singular values below this part of the largest are zero in the Newton system, which is singular at optima that are
#: not isolated. Where second derivatives are nearly zero but not quite, the first cut gives too long a step and the
#: next one is taken.
_NEWTON_RCOND = (1e-11, 1e-8, 1e-6)
#: A residual of the stationarity conditions that is rounding error. Newton's method is quadratic: the step that gets
#: below this mostly lands at 1e-16.
_ROUNDING = 1e-13
#: Newton's method has settled on its active set when the residual is below this, and a multiplier is negative when it
#: is below minus this.
_SETTLED = 1e-10


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
    F, gradient, g, jacobian = nlp.program.kernels.derivatives(x, nlp.arguments)
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
    weights = carried[nlp.n :].astype(np.float64)
    full = nlp.program.kernels.hessian(at.x, nlp.arguments, nlp.sign / nlp.objective_scale, weights)
    return full * np.outer(nlp.scale, nlp.scale)


def correct(nlp: Nlp, x: FloatArray, active: Sequence[int]) -> Linearisation:
    """Newton's method on the stationarity conditions with an active set, from a point close to a solution.

    A side that a step would cross joins the active set; one that ends up with a multiplier of the wrong sign leaves it.
    The steps are least-norm, so a point on a manifold of optima stays where it is along it.

    Args:
        nlp: the program.
        x: (n,) point near a stationary one.
        active: indices (into ``nlp.sides``) of the sides to hold at first.

    Returns:
        The corrected point, inside the variables' bounds; where Newton's method does not help, the best one met.
    """
    held = list(active)
    at = linearise(nlp, _pinned(nlp, np.clip(x, nlp.lower, nlp.upper), held))
    best, least = at, np.inf
    for _ in range(_NEWTON_STEPS):
        mu, error = _residual(at, held)
        if error <= least:
            best, least = at, error
        count = len(held)
        following = None if error <= _ROUNDING else _newton_step(nlp, at, held, mu, error)
        if following is not None:
            at = following
            least = least if len(held) == count else np.inf
            continue
        wrong = np.where(nlp.sides.equal, 0.0, mu)
        if not error <= _SETTLED or wrong.min(initial=0.0) >= -_SETTLED:
            break
        held.remove(int(np.argmin(wrong)))
        least = np.inf
    return best


def _residual(at: Linearisation, held: list[int]) -> tuple[FloatArray, float]:
    """Least-squares multipliers (k,) of the held sides, and the largest error of the stationarity conditions.

    A held side counts by its distance: it is to be lain on, and not only kept.
    """
    mu = np.zeros(len(at.sides))
    if held and np.isfinite(at.gradient).all():
        A = at.normals[held]
        # Bounds alone have orthonormal normals, and most active sets are bounds alone.
        orthonormal = np.array_equal(A @ A.T, np.eye(len(held)))
        mu[held] = -A @ at.gradient if orthonormal else np.linalg.lstsq(A.T, -at.gradient, rcond=None)[0]
    left = at.gradient + at.normals.T @ mu
    off = float(np.max(np.abs(at.residual[held]), initial=0.0)) if held else 0.0
    return mu, max(float(np.max(np.abs(left), initial=0.0)), off, at.violation)


def _pinned(nlp: Nlp, x: FloatArray, held: Sequence[int]) -> FloatArray:
    """The point with the variables whose bounds are held exactly on them."""
    table, moved = nlp.sides, x.copy()
    for j in held:
        variable = table.sides[j].variable
        if variable is not None:
            moved[variable] = table.limit[j]
    return moved


def _newton_step(nlp: Nlp, at: Linearisation, held: list[int], mu: FloatArray, error: float) -> Linearisation | None:
    """The point after one Newton step; None when no small step brings the residual down.

    Where the step would cross a side, it ends there and the side joins ``held``.
    """
    n, k, A = nlp.n, len(held), at.normals[held]
    left = at.gradient + at.normals.T @ mu
    matrix = np.zeros((n + k, n + k))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = lagrangian_hessian(nlp, at, mu), A.T, A
    right = -np.concatenate([left, at.residual[held]])
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return None
    for rcond in _NEWTON_RCOND:
        step = np.linalg.lstsq(matrix, right, rcond=rcond)[0][:n]
        if np.max(np.abs(step), initial=0.0) > _LONGEST_STEP:
            continue
        towards = at.normals @ step
        towards[held] = 0.0
        reach = np.where(towards > 1e-12, np.maximum(at.slack, 0.0) / np.maximum(towards, 1e-12), np.inf)
        part = min(1.0, float(reach.min(initial=1.0)))
        met = [int(np.argmin(reach))] if part < 1.0 else []
        moved = np.clip(at.x + part * nlp.scale * step, nlp.lower, nlp.upper)
        after = linearise(nlp, _pinned(nlp, moved, [*held, *met]))
        # Newton's error is about the square of its step: one that grows no further than that falls at the next step.
        if met or _residual(after, held)[1] < max(error, 4 * float(step @ step)):
            held += met
            return after
    return None


def assembled(nlp: Nlp, x: FloatArray) -> FloatArray:
    """The point (n,) nearest to the given one, to first order, at which the program's equations hold.

    Newton's method with least-norm steps on the equations alone: unit lengths of directions and closure of loops. Where
    it does not get there, what it reached.
    """
    at = linearise(nlp, x)
    for _ in range(_NEWTON_STEPS):
        rows = np.flatnonzero(nlp.sides.equal)
        if not len(rows) or np.max(np.abs(at.residual[rows])) <= _ROUNDING or not np.isfinite(at.violation):
            break
        step = np.linalg.lstsq(at.normals[rows], -at.residual[rows], rcond=None)[0]
        at = linearise(nlp, np.clip(at.x + nlp.scale * step, nlp.lower, nlp.upper))
    return at.x

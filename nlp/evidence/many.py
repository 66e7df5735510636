"""Evidence of optimality for many points of one program at once, with other data at each point.

The conditions are those of :mod:`.kkt` and :mod:`.optimality`, on arrays with one row for each point. A point is
reported as a strict optimum only in the clear case: feasible and stationary, with independent active normals, positive
multipliers and a positive reduced Hessian. :func:`~.optimality.examine` judges every other point, one at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from ...models import FloatArray, frozen_vector
from ..program.nlp import Nlp, scale_of_change
from .kkt import ACTIVE, FEASIBLE, NO_GRADIENT, NOTABLE, ROUNDINGS, STATIONARY
from .optimality import CURVED, STRONG

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Singular value below which active normals of length 1 count as dependent, as in ``examine``.
_DEPENDENT = 1e-9


class Numbers(NamedTuple):
    """Arguments, bounds and constraint limits of one program at N points.

    Attributes:
        arguments: (N, k) arguments.
        lower: (N, n) lower bounds of the variables.
        upper: (N, n) upper bounds of the variables.
        g_lower: (N, c) lower sides of the constraints, infinite and equal in the same places as in the program.
        g_upper: (N, c) upper sides of the constraints, infinite and equal in the same places as in the program.
    """

    arguments: FloatArray
    lower: FloatArray
    upper: FloatArray
    g_lower: FloatArray
    g_upper: FloatArray

    def at(self, rows: NDArray[np.intp]) -> Numbers:
        """Return the data of some of the points."""
        return Numbers(*(each[rows] for each in self))

    def put_into(self, nlp: Nlp, k: int) -> Nlp:
        """Return a program with the data of point k; its start is moved between the bounds."""
        lower, upper = self.lower[k], self.upper[k]
        return replace(
            nlp,
            arguments=frozen_vector(self.arguments[k]),
            lower=frozen_vector(lower),
            upper=frozen_vector(upper),
            start=frozen_vector(np.clip(nlp.start, lower, upper)),
            g_lower=frozen_vector(self.g_lower[k]),
            g_upper=frozen_vector(self.g_upper[k]),
        )


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Evidence of optimality at N points of a program.

    Attributes:
        is_strict: (N,) True if the point is clearly a strict local optimum.
        F: (N,) objective.
        stationarity: (N,) largest scaled derivative of the Lagrangian; infinite if the active normals are dependent.
        feasibility: (N,) largest violation of a side, in half ranges.
        curvature: (N,) smallest eigenvalue of the reduced Hessian; infinite if the active sides leave no direction,
            NaN where it is not computed.
        active: (N, k) True for active sides of the program.
        multipliers: (N, k) scaled multipliers of the sides.
        weights: (N, k) factors from scaled multipliers to F per unit of the side's bound.
    """

    is_strict: NDArray[np.bool_]
    F: FloatArray
    stationarity: FloatArray
    feasibility: FloatArray
    curvature: FloatArray
    active: NDArray[np.bool_]
    multipliers: FloatArray
    weights: FloatArray


class _Scales(NamedTuple):
    """Scales at N points: variables (N, n), objective (N,), gradients of the constraints (N, c)."""

    scale: FloatArray
    objective: FloatArray
    typical: FloatArray


class _Linear(NamedTuple):
    """A program linearised at N points, in the terms of :class:`~.kkt.Linearisation`."""

    F: FloatArray
    gradient: FloatArray
    slack: FloatArray
    normals: FloatArray
    per_unit: FloatArray
    violation: FloatArray


def judge_many(nlp: Nlp, x: FloatArray, numbers: Numbers) -> Verdicts:
    """Return the evidence of optimality at points of a program.

    Args:
        nlp: nonlinear program in which limits on pairs (of legs or poses) have a constraint for every pair.
        x: (N, n) the points.
        numbers: data of the program at the points.
    """
    count, sides = len(x), nlp.sides
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        scales = _scales(nlp, numbers)
        at = _linearise(nlp, x, numbers, scales)
        # No side is active where the equations have no finite value.
        active = (at.slack <= ACTIVE) & np.isfinite(at.violation)[:, None]
        mu = np.zeros((count, len(sides.sides)))
        stationarity, curvature = np.full(count, np.inf), np.full(count, np.nan)
        is_decided = np.zeros(count, dtype=bool)
        regular = np.isfinite(at.gradient).all(axis=1) & (at.violation <= FEASIBLE)
        tangents: list[tuple[NDArray[np.intp], FloatArray]] = []
        for rows, held in _groups(active, regular, nlp.n):
            found = _multipliers(at.gradient[rows], at.normals[rows][:, held])
            mu[rows[:, None], held], stationarity[rows] = found.mu, found.stationarity
            strong = (found.mu > STRONG) | sides.equal[held]
            decided = found.is_independent & strong.all(axis=1) & (found.stationarity <= STATIONARY)
            is_decided[rows] = decided
            tangents.append((rows[decided], found.tangents[decided]))
        chosen = np.flatnonzero(is_decided)
        H = np.zeros((count, nlp.n, nlp.n))
        if len(chosen):
            H[chosen] = _hessians(nlp, x[chosen], numbers.at(chosen), mu[chosen], scales, at, chosen)
        is_decided &= np.isfinite(H).all(axis=(1, 2))
        for rows, Z in tangents:
            if not Z.shape[2]:
                curvature[rows] = np.inf
            elif len(rows) and np.isfinite(H[rows]).all():
                curvature[rows] = np.linalg.eigvalsh(np.swapaxes(Z, 1, 2) @ H[rows] @ Z)[:, 0]
        is_strict = is_decided & (curvature > CURVED)
    weights = at.per_unit * scales.objective[:, None]
    return Verdicts(is_strict, at.F, stationarity, at.violation, curvature, active, mu, weights)


def _scales(nlp: Nlp, numbers: Numbers) -> _Scales:
    """Return the scales of :class:`~..program.nlp.Nlp` at every point; NaN where the robot is not defined at the start.

    Such points are left to ``examine``, which evaluates the magnitude of the objective around the start.
    """
    scale, centre = (numbers.upper - numbers.lower) / 2, (numbers.upper + numbers.lower) / 2
    count = len(scale)
    if nlp.size is None:
        start = np.clip(nlp.start, numbers.lower, numbers.upper)
        magnitude = nlp.program.robot.magnitude
        function = ca.Function("magnitude", [nlp.program.x, nlp.program.p], [ca.mmax(magnitude)])
        size = np.asarray(function(start.T, numbers.arguments.T).full()).ravel()
        size = np.where(np.isfinite(size) & (size > 0), size, np.nan)
    else:
        size = np.full(count, nlp.size)
    change, rows = np.zeros(count), np.zeros((count, len(nlp.program.constraints)))
    for share in nlp.shares:
        _, gradient, _, jacobian = _derivatives(nlp, centre + scale * share, numbers.arguments)
        summed = np.abs(gradient * scale).sum(axis=1)
        change = np.maximum(change, np.where(np.isfinite(summed), summed, 0.0))
        lengths = np.linalg.norm(jacobian * scale[:, None, :], axis=2)
        rows = np.maximum(rows, np.where(np.isfinite(lengths), lengths, 0.0))
    objective = scale_of_change(size, np.where(change > 0, change, size)) if nlp.has_scale_of_changes else size
    return _Scales(scale, objective, np.where(rows > 0, np.minimum(rows, 1.0), 1.0))


def _linearise(nlp: Nlp, x: FloatArray, numbers: Numbers, scales: _Scales) -> _Linear:
    """Return the program linearised at every point, by the formulas of :func:`~.kkt.linearise`."""
    sides, n, count = nlp.sides, nlp.n, len(x)
    F, gradient, g, jacobian = _derivatives(nlp, x, numbers.arguments)
    scale = scales.scale
    rows = jacobian * scale[:, None, :]
    sizes = np.linalg.norm(rows, axis=2)
    sizes = np.where(sizes > NO_GRADIENT * scales.typical, sizes, scales.typical)
    per_unit = 1 / np.concatenate([scale, sizes], axis=1)[:, sides.place]
    is_lower = np.array([side.bound == "min" for side in sides.sides], dtype=bool)
    lower = np.concatenate([numbers.lower, numbers.g_lower], axis=1)[:, sides.place]
    upper = np.concatenate([numbers.upper, numbers.g_upper], axis=1)[:, sides.place]
    limit = np.where(is_lower, lower, upper)
    residual = sides.sign * (np.concatenate([x, g], axis=1)[:, sides.place] - limit) * per_unit
    diagonal = np.zeros((count, n, n))
    diagonal[:, range(n), range(n)] = scale
    normals = (sides.sign * per_unit)[:, :, None] * np.concatenate([diagonal, rows], axis=1)[:, sides.place]
    steps = np.einsum("nij,nj->ni", np.abs(normals), np.abs(x) / scale)
    noise = ROUNDINGS * np.finfo(float).eps * (np.abs(limit) * per_unit + steps)
    noise[:, sides.place < n] = 0.0
    noise = np.where(noise > NOTABLE, noise, 0.0)
    slack = np.where(sides.equal, -np.abs(residual), -residual)
    weight = nlp.sign / scales.objective
    violation = np.maximum(-(slack + noise).min(axis=1, initial=0.0), 0.0) + 0.0  # without minus zero
    is_defined = np.isfinite(F) & np.isfinite(slack).all(axis=1)
    return _Linear(
        F,
        weight[:, None] * gradient * scale,
        slack,
        normals,
        per_unit,
        np.where(is_defined, violation, np.inf),
    )


class _Multipliers(NamedTuple):
    """Multipliers of one active set of k sides at m points.

    Attributes:
        mu: (m, k) multipliers.
        stationarity: (m,) largest derivative of the Lagrangian.
        is_independent: (m,) True for independent normals.
        tangents: (m, n, n - k) orthonormal bases of the normals' null spaces.
    """

    mu: FloatArray
    stationarity: FloatArray
    is_independent: NDArray[np.bool_]
    tangents: FloatArray


def _multipliers(gradient: FloatArray, A: FloatArray) -> _Multipliers:
    """Return the multipliers of active sides with normals A (m, k, n) at points with gradients (m, n)."""
    m, k, n = A.shape
    if not k:
        identity = np.broadcast_to(np.eye(n), (m, n, n))
        return _Multipliers(
            np.zeros((m, 0)), np.abs(gradient).max(axis=1, initial=0.0), np.ones(m, dtype=bool), identity
        )
    U, sizes, V = np.linalg.svd(A)
    smallest = sizes[:, -1]
    safe = np.where(smallest > _DEPENDENT, 1.0, np.nan)[:, None] / sizes
    along = np.einsum("mij,mj->mi", V[:, :k], gradient)
    mu = -np.einsum("mij,mj->mi", U, along * safe)
    left = gradient + np.einsum("mki,mk->mi", A, mu)
    stationarity = np.where(smallest > _DEPENDENT, np.abs(left).max(axis=1), np.inf)
    return _Multipliers(np.nan_to_num(mu), stationarity, smallest > _DEPENDENT, np.swapaxes(V[:, k:], 1, 2))


def _groups(
    active: NDArray[np.bool_], regular: NDArray[np.bool_], most: int
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield the points with the same active set, and the sides of the set; sets with too many sides are left out."""
    chosen = np.flatnonzero(regular)
    if not len(chosen):
        return
    sets, which = np.unique(active[chosen], axis=0, return_inverse=True)
    for k, each in enumerate(sets):
        if np.count_nonzero(each) <= most:
            yield chosen[which.ravel() == k], np.flatnonzero(each)


def _hessians(
    nlp: Nlp, x: FloatArray, numbers: Numbers, mu: FloatArray, scales: _Scales, at: _Linear, rows: NDArray[np.intp]
) -> FloatArray:
    """Return the Hessians (m, n, n) of the Lagrangians in scaled variables, at the points of the given rows."""
    n, sides = nlp.n, nlp.sides
    terms = sides.sign * mu * at.per_unit[rows]
    weights = np.zeros((len(rows), n + len(nlp.program.constraints)))
    for side, place in enumerate(sides.place):
        weights[:, place] += terms[:, side]
    weight = nlp.sign / scales.objective[rows]
    found = nlp.program.hessian(x.T, numbers.arguments.T, weight[None], weights[:, n:].T).full()
    scale = scales.scale[rows]
    # CasADi returns the matrices side by side; a Hessian is symmetric.
    return np.asarray(found.T.reshape(len(rows), n, n) * scale[:, :, None] * scale[:, None, :], dtype=np.float64)


class _Derivatives(NamedTuple):
    """Objective (N,), its gradient (N, n), constraints (N, c) and their Jacobian (N, c, n)."""

    F: FloatArray
    gradient: FloatArray
    g: FloatArray
    jacobian: FloatArray


def _derivatives(nlp: Nlp, x: FloatArray, p: FloatArray) -> _Derivatives:
    """Return values and derivatives at points x (N, n) with arguments p (N, k)."""
    count, n, c = len(x), nlp.n, len(nlp.program.constraints)
    F, gradient, g, jacobian = (each.full() for each in nlp.program.derivatives(x.T, p.T))
    rows = jacobian.reshape(c, count, n).transpose(1, 0, 2)
    return _Derivatives(F.ravel(), gradient.reshape(count, n), g.T, rows)

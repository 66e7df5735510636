"""Evidence that a point is an optimum, recomputed from the program and the point alone.

The paper checks each of its solutions by the derivatives and the Hessian's eigenvalues of the objective. With bounds
that is not enough, so this module checks the whole of the first- and second-order conditions (J. Nocedal and
S. Wright, *Numerical Optimization*, 2nd edition, sections 12.3 to 12.5), in the scaled terms of
:mod:`screwsynth.nlp.evidence.kkt`, and says in words what holds.

Sign convention of multipliers: a multiplier is the rate at which the optimal F **improves** (grows for a maximum, falls
for a minimum) per unit by which the limit is **relaxed**, in F per the case's unit of that limit. It is never negative
on a bound; on an equation it is the improvement per unit by which the equation's right-hand side grows.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from ...models import Dimension, FloatArray, frozen_array
from ..case.task import Sense
from ..program.nlp import Nlp
from .kkt import FEASIBLE, STATIONARY, Linearisation, correct, lagrangian_hessian, linearise, multipliers
from .linalg import plain_basis

#: A multiplier below this, in scaled terms, does not hold the point at its side: the side is weakly active.
STRONG = 1e-9
#: An eigenvalue of the scaled reduced Hessian below this is zero: over half a variable's range F would change by less
#: than this part of its size.
CURVED = 1e-8
#: How far a flat direction is followed to see whether F really stays, in half ranges.
_PROBE = 0.02
#: How often a flat direction may be turned by following it, and the cosine from which it was not turned.
_TURNS = 4
_STRAIGHT = 0.999
#: Flat directions found by following are known to a few parts in a hundred: what is closer is one and the same, and a
#: component below a part in a hundred is left out.
_INDEPENDENT = 0.05
_TRACE = 1e-2


class PointKind(enum.Enum):
    """What a point is."""

    STRICT_MAXIMUM = "strict local maximum"
    STRICT_MINIMUM = "strict local minimum"
    NOT_ISOLATED = "not isolated: F keeps its optimal value along the flat directions"
    UNDECIDED = "stationary, and the second-order test does not decide"
    SADDLE = "saddle: stationary, but F improves along some direction"
    NOT_STATIONARY = "not stationary: F improves to first order"
    INFEASIBLE = "infeasible: a limit is violated"
    UNDEFINED = "undefined: the robot's equations have no finite value there"

    @property
    def is_optimum(self) -> bool:
        """Whether the point may be reported as an optimum."""
        return self in (PointKind.STRICT_MAXIMUM, PointKind.STRICT_MINIMUM, PointKind.NOT_ISOLATED, PointKind.UNDECIDED)


@dataclass(frozen=True)
class ActiveSide:
    """A limit that the point lies on.

    Attributes:
        name: the variable or constraint.
        bound: ``min``, ``max`` or ``equal``.
        value: the limit, radians for angles.
        multiplier: improvement of F per unit by which the limit is relaxed, in the same unit.
        dimension: what the limit measures.
    """

    name: str
    bound: Literal["min", "max", "equal"]
    value: float
    multiplier: float
    dimension: Dimension


@dataclass(frozen=True, eq=False)
class Evidence:
    """What holds at a point.

    Attributes:
        kind: the verdict.
        stationarity: largest scaled derivative of the Lagrangian, with the best multipliers there are.
        feasibility: largest distance outside a limit, in half ranges; 0 inside.
        complementarity: largest product of a multiplier and its side's slack, scaled.
        active: limits that the point lies on, with multipliers.
        violated: names of the limits that the point lies outside of.
        licq: whether the active normals are linearly independent, so that the multipliers are unique.
        eigenvalues: of the scaled Lagrangian's Hessian on the tangent space of the strongly active limits, ascending;
            positive means that F gets worse on leaving the point, for a maximum as for a minimum.
        flat: directions along which F keeps its optimal value: rates of the variables, in their units, by name,
            for a step of half a range in the variable that moves most.
    """

    kind: PointKind
    stationarity: float
    feasibility: float
    complementarity: float
    active: tuple[ActiveSide, ...]
    violated: tuple[str, ...]
    licq: bool
    eigenvalues: FloatArray
    flat: tuple[Mapping[str, float], ...]


def examine(nlp: Nlp, x: FloatArray) -> Evidence:
    """Examine a point (n,) of a program."""
    at = linearise(nlp, x)
    active = at.active()
    mu, stationarity = multipliers(at, active)
    feasibility = at.violation
    normals = at.normals[list(active)]
    kind = PointKind.INFEASIBLE if feasibility > FEASIBLE else PointKind.NOT_STATIONARY
    if not math.isfinite(feasibility):
        kind = PointKind.UNDEFINED
    eigenvalues: FloatArray = np.zeros(0)
    flat: list[FloatArray] = []
    if feasibility <= FEASIBLE and stationarity <= STATIONARY:
        kind, eigenvalues, flat = _second_order(nlp, at, mu)
    return Evidence(
        kind=kind,
        stationarity=stationarity,
        feasibility=feasibility,
        complementarity=float(np.max(np.abs(mu * at.slack), initial=0.0)),
        active=tuple(_active_side(nlp, at, j, mu[j]) for j in active),
        violated=tuple(dict.fromkeys(at.sides[j].name for j in active if at.slack[j] < -FEASIBLE)),
        licq=bool(np.linalg.matrix_rank(normals, tol=1e-9) == len(active)) if active else True,
        eigenvalues=frozen_array(eigenvalues, eigenvalues.shape),
        flat=tuple(_named(nlp, direction) for direction in flat),
    )


def _active_side(nlp: Nlp, at: Linearisation, j: int, mu: float) -> ActiveSide:
    side = at.sides[j]
    limit = float(nlp.sides.limit[j])
    multiplier = float(mu * at.per_unit[j] * nlp.objective_scale)
    if side.constraint is not None:
        reading = nlp.program.constraints[side.constraint].reading
        value, slope = reading.from_value(limit), reading.slope(limit)
        return ActiveSide(side.name, side.bound, value, multiplier * slope, reading.dimension)
    dimension = nlp.program.variables[side.variable or 0].dimension
    return ActiveSide(side.name, side.bound, limit, multiplier, dimension)


def _second_order(nlp: Nlp, at: Linearisation, mu: FloatArray) -> tuple[PointKind, FloatArray, list[FloatArray]]:
    strict = PointKind.STRICT_MAXIMUM if nlp.sense is Sense.MAX else PointKind.STRICT_MINIMUM
    active = at.active()
    strong = [j for j in active if mu[j] > STRONG or at.sides[j].bound == "equal"]
    weak = [j for j in active if j not in strong]
    H = lagrangian_hessian(nlp, at, mu)
    eigenvalues, _ = _reduced(H, at.normals[strong])
    if np.all(eigenvalues > CURVED):
        return strict, eigenvalues, []
    if _improves(H, at.normals[strong], at.normals[weak]):
        return PointKind.SADDLE, eigenvalues, []
    inner, directions = _reduced(H, at.normals[list(active)])
    candidates = [directions[:, k] for k in np.flatnonzero(np.abs(inner) <= CURVED)]
    followed = [_followed(nlp, at, direction) for direction in candidates]
    flat = np.array([direction for direction in followed if direction is not None]).reshape(-1, nlp.n)
    if len(flat):
        return PointKind.NOT_ISOLATED, eigenvalues, _span(flat)
    return PointKind.UNDECIDED, eigenvalues, []


def _improves(H: FloatArray, strong: FloatArray, weak: FloatArray) -> bool:
    """Whether F improves to second order along a direction that the strong sides hold and the weak ones allow.

    Finding out for certain is a hard problem (copositivity). Tried are the directions of negative curvature with all,
    all but one, and none of the weak sides held, and each of these brought back inside the weak sides.
    """
    rows = list(range(len(weak)))
    for held in [rows, *([k for k in rows if k != freed] for freed in rows), []]:
        values, directions = _reduced(H, np.vstack([strong, weak[held]]))
        for k in np.flatnonzero(values < -CURVED):
            for sign in (1.0, -1.0):
                d = sign * directions[:, k]
                inside = d - weak.T @ np.maximum(weak @ d, 0.0) if len(weak) else d
                for each in (d, inside):
                    size = float(each @ each)
                    allowed = np.all(weak @ each <= 1e-9) and np.all(np.abs(strong @ each) <= 1e-9)
                    if size > 1e-6 and allowed and float(each @ H @ each) < -CURVED * size:
                        return True
    return False


def _reduced(H: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of H on the null space of the normals, ascending, and their directions as columns (n, .)."""
    if len(normals):
        _, sizes, rows = np.linalg.svd(normals)
        Z = rows[int(np.count_nonzero(sizes > 1e-9)) :].T
    else:
        Z = np.eye(len(H))
    values, vectors = np.linalg.eigh(Z.T @ H @ Z)
    return np.asarray(values, dtype=np.float64), np.asarray(Z @ vectors, dtype=np.float64)


def _followed(nlp: Nlp, at: Linearisation, direction: FloatArray) -> FloatArray | None:
    """The direction (n,) in which F really stays when one sets out along the given one; None when it does not.

    A step is corrected back onto the optimal set; where the correction turns it, the turned direction is tried next.
    """
    for _ in range(_TURNS):
        moved = next((m for m in (_displacement(nlp, at, s * direction) for s in (1.0, -1.0)) if m is not None), None)
        if moved is None:
            return None
        turned = moved / np.linalg.norm(moved)
        if abs(float(turned @ direction)) > _STRAIGHT:
            return direction
        direction = turned
    return None


def _displacement(nlp: Nlp, at: Linearisation, direction: FloatArray) -> FloatArray | None:
    """Where a short step along a direction ends after correction, from the point; None when F changes or it cannot."""
    away = at.x + _PROBE * nlp.scale * direction
    if np.any(away < nlp.lower) or np.any(away > nlp.upper):
        return None
    back = correct(nlp, away, at.active())
    moved = np.asarray((back.x - at.x) / nlp.scale, dtype=np.float64)
    stays = back.violation <= FEASIBLE and abs(back.phi - at.phi) <= 1e-11
    return moved if stays and float(np.linalg.norm(moved)) > _PROBE / 3 else None


def _span(directions: FloatArray) -> list[FloatArray]:
    """The independent ones among directions (k, n), in as few names as possible."""
    _, sizes, rows = np.linalg.svd(directions, full_matrices=False)
    plain = plain_basis(rows[sizes > _INDEPENDENT * sizes[0]])
    return list(np.where(np.abs(plain) > _TRACE, plain, 0.0))


def _named(nlp: Nlp, direction: FloatArray) -> Mapping[str, float]:
    """A scaled direction as rates of the named variables in their units."""
    steps = direction * nlp.scale
    return MappingProxyType(
        {
            variable.name: float(step)
            for variable, step, part in zip(nlp.program.variables, steps, direction, strict=True)
            if abs(part) > _TRACE
        }
    )

"""Evidence that a point is an optimum, recomputed from the program and the point only.

The paper checks its solutions by derivatives and Hessian eigenvalues of the objective. With bounds this is not enough:
this module checks the complete first- and second-order conditions (J. Nocedal and S. Wright, *Numerical Optimization*,
2nd edition, sections 12.3 to 12.5), in the scaled terms of :mod:`screwsynth.nlp.evidence.kkt`.

Sign of multipliers: a multiplier is the rate at which the optimal F **improves** (grows for a maximum, falls for a
minimum) per unit by which the limit is **relaxed**, in F per the case's unit of that limit. It is never negative on an
inequality; on an equation it is the improvement per unit by which the right-hand side grows.
"""

import enum
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

import numpy as np

from ...models import Dimension, FloatArray, frozen_array
from ...models.linalg import echelon_basis
from ..case.task import Sense
from ..program.nlp import Bound, Nlp
from ..program.pairs import with_pairs_at
from ..system.jsonvalues import Absent, Hidden, JsonObject, Key, Known, Row, Shown, Slope
from ..units import Units
from .kkt import FEASIBLE, STATIONARY, Linearisation, correct_point, lagrangian_hessian, linearise, multipliers
from .margins import unit_of_side
from .singularities import is_passive_singular
from .state import loses_forces

#: Scaled multiplier below which an active side is weakly active.
STRONG = 1e-9
#: Eigenvalue of the scaled reduced Hessian below which it counts as zero: over half a variable's range F then changes
#: by less than this fraction of its size.
CURVED = 1e-8
#: Length of the trial step along a flat direction, in half ranges: F must keep its value.
_FLAT_STEP = 0.02
#: Largest number of corrections of a flat direction by such steps.
_DIRECTION_CHANGES = 4
#: Cosine between two directions above which they count as equal.
_SAME_DIRECTION = 0.999
#: Flat directions from such steps are accurate to a few percent: singular values below this fraction of the largest
#: one do not belong to a separate direction.
_INDEPENDENT = 0.05
#: For the same reason, components of a flat direction below this fraction of the largest are omitted.
_NEGLIGIBLE = 1e-2


class PointKind(enum.Enum):
    """Verdict on a point."""

    STRICT_MAXIMUM = "strict local maximum"
    STRICT_MINIMUM = "strict local minimum"
    NOT_ISOLATED = "not isolated: F keeps its optimal value along the flat directions"
    UNDECIDED = "stationary, and the second-order test does not decide"
    SADDLE = "saddle: stationary, but F improves along some direction"
    NOT_STATIONARY = "not stationary: F improves to first order"
    LIMB_SINGULAR = "no optimum: passive joints of a limb are dependent there, so that F jumps"
    SINGULAR = "no optimum: J is singular there, so that the loads do not determine the actuator forces"
    INFEASIBLE = "infeasible: a limit is violated"
    UNDEFINED = "undefined: the robot's equations have no finite value there"

    @property
    def is_optimum(self) -> bool:
        """Whether the point may be reported as an optimum."""
        return self in (PointKind.STRICT_MAXIMUM, PointKind.STRICT_MINIMUM, PointKind.NOT_ISOLATED, PointKind.UNDECIDED)


class ActiveSide(JsonObject):
    """A bound or limit on which the point lies.

    Attributes:
        name: name of the variable or constraint.
        bound: side of the bound or limit.
        value: value of the bound or limit.
        unit: unit of the value; left out for a plain number.
        multiplier: improvement of F per unit by which the limit is relaxed.
        dimension: dimension of the value; angles are in radians.
    """

    name: str
    bound: Bound
    value: Shown
    unit: Absent[str]
    multiplier: Slope[float]
    dimension: Hidden[Dimension] = Dimension.NUMBER


class Evidence(JsonObject):
    """Evidence of optimality, from the program and the point only.

    Attributes:
        kind: kind of the point, such as a strict local optimum or a saddle.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest violation of a limit, in half ranges.
        complementarity: largest product of a scaled multiplier and the slack of its side.
        licq: If true, the active normals are linearly independent.
        active: bounds and limits on which the point lies.
        eigenvalues: eigenvalues of the reduced Hessian, ascending: the scaled Hessian of the Lagrangian on the tangent
            space of the strongly active sides. For a positive eigenvalue, F gets worse along its eigenvector.
        flat: rates of the variables along directions in which F keeps its optimal value. In a result, the variable that
            moves most relative to its range has rate 1; otherwise rates are in the variables' units per half range.
        violated: names of the variables and constraints of violated sides.
    """

    kind: PointKind
    stationarity: Known
    feasibility: Known
    complementarity: Known
    licq: bool
    active: tuple[ActiveSide, ...]
    eigenvalues: Annotated[Row, Key("reduced_hessian_eigenvalues")]
    flat: Annotated[tuple[Mapping[str, float], ...], Key("flat_directions")]
    violated: Hidden[tuple[str, ...]] = ()

    def multipliers_in(self, units: Units) -> tuple[float, ...]:
        """Return the multipliers of the active sides, per unit of the case."""
        return tuple(units.per_unit(side.multiplier, side.dimension) for side in self.active)


def examine(nlp: Nlp, x: FloatArray) -> Evidence:
    """Return the evidence of optimality of a point.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
    """
    nlp = with_pairs_at(nlp, [x])
    at = linearise(nlp, x)
    active, feasibility = at.active(), at.violation
    violated = tuple(dict.fromkeys(at.sides[j].name for j in active if at.slack[j] < -FEASIBLE))
    if not math.isfinite(feasibility):
        return Evidence(
            kind=PointKind.UNDEFINED,
            stationarity=math.inf,
            feasibility=feasibility,
            complementarity=math.inf,
            licq=True,
            active=(),
            eigenvalues=frozen_array((), (0,)),
            flat=(),
            violated=violated,
        )
    mu, stationarity = multipliers(at, active)
    normals = at.normals[list(active)]
    kind = PointKind.INFEASIBLE if feasibility > FEASIBLE else PointKind.NOT_STATIONARY
    eigenvalues: FloatArray = np.zeros(0)
    flat: list[FloatArray] = []
    if feasibility <= FEASIBLE and stationarity <= STATIONARY:
        kind, eigenvalues, flat = _second_order_test(nlp, at, mu)
        if kind.is_optimum and any(is_passive_singular(nlp, x, pose) for pose in range(len(nlp.program.robots))):
            kind = PointKind.LIMB_SINGULAR
        elif kind.is_optimum and loses_forces(nlp, x):
            kind = PointKind.SINGULAR
    return Evidence(
        kind=kind,
        stationarity=stationarity,
        feasibility=feasibility,
        complementarity=float(np.max(np.abs(mu * at.slack), initial=0.0)),
        active=tuple(_active_side(nlp, at, j, mu[j]) for j in active),
        violated=violated,
        licq=_is_independent(normals),
        eigenvalues=frozen_array(eigenvalues, eigenvalues.shape),
        flat=tuple(_changes_by_name(nlp, direction) for direction in flat),
    )


def _is_independent(normals: FloatArray) -> bool:
    """Return whether the gradients (k, n) of active sides are finite and linearly independent."""
    if not len(normals):
        return True
    return bool(np.isfinite(normals).all() and np.linalg.matrix_rank(normals, tol=1e-9) == len(normals))


def _active_side(nlp: Nlp, at: Linearisation, j: int, mu: float) -> ActiveSide:
    """Return side j with its scaled multiplier converted to F per unit of the limit."""
    side = at.sides[j]
    limit = nlp.stated_limit(j)
    multiplier = float(mu * at.per_unit[j] * nlp.objective_scale)
    if side.constraint is not None:
        reading = nlp.program.constraints[side.constraint].reading
        limit, multiplier, dimension = reading.from_value(limit), multiplier * reading.slope(limit), reading.dimension
    else:
        dimension = nlp.program.variables[side.variable or 0].dimension
    return ActiveSide(
        name=side.name,
        bound=side.bound,
        value=limit,
        unit=unit_of_side(nlp.case, side.name, dimension) or None,
        multiplier=multiplier,
        dimension=dimension,
    )


def _second_order_test(nlp: Nlp, at: Linearisation, mu: FloatArray) -> tuple[PointKind, FloatArray, list[FloatArray]]:
    """Return verdict, eigenvalues of the reduced Hessian and flat directions (n,) of a stationary, feasible point."""
    strict = PointKind.STRICT_MAXIMUM if nlp.sense is Sense.MAX else PointKind.STRICT_MINIMUM
    active = at.active()
    strong = [j for j in active if mu[j] > STRONG or at.sides[j].bound == "equal"]
    weak = [j for j in active if j not in strong]
    H = lagrangian_hessian(nlp, at, mu)
    eigenvalues, _ = _reduced_eigenpairs(H, at.normals[strong])
    if np.all(eigenvalues > CURVED):
        return strict, eigenvalues, []
    if _has_improving_direction(H, at.normals[strong], at.normals[weak]):
        return PointKind.SADDLE, eigenvalues, []
    inner, directions = _reduced_eigenpairs(H, at.normals[list(active)])
    candidates = [directions[:, k] for k in np.flatnonzero(np.abs(inner) <= CURVED)]
    tested = [_follow_flat_direction(nlp, at, direction) for direction in candidates]
    flat = np.array([direction for direction in tested if direction is not None]).reshape(-1, nlp.n)
    if len(flat):
        return PointKind.NOT_ISOLATED, eigenvalues, _independent_directions(flat)
    return PointKind.UNDECIDED, eigenvalues, []


def _has_improving_direction(H: FloatArray, strong: FloatArray, weak: FloatArray) -> bool:
    """Return whether F improves to second order along a feasible direction.

    An exact answer is a hard problem (copositivity of H on a cone). The test covers the directions of negative
    curvature with all, all but one, and none of the weakly active sides as equations. Each of these directions is also
    tried after a correction to the inside of the weakly active sides.

    Args:
        H: (n, n) Hessian of the Lagrangian in scaled variables.
        strong: (s, n) normals of the strongly active sides, to which a step must be orthogonal.
        weak: (w, n) outward normals of the weakly active sides, along which a step must not go outwards.
    """
    rows = list(range(len(weak)))
    for equations in [rows, *([k for k in rows if k != left_out] for left_out in rows), []]:
        values, directions = _reduced_eigenpairs(H, np.vstack([strong, weak[equations]]))
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


def _reduced_eigenpairs(H: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues of the reduced Hessian, ascending, and its eigenvectors as columns (n, .).

    Args:
        H: (n, n) Hessian.
        normals: (k, n) rows, on whose null space H is reduced.
    """
    if len(normals):
        _, sizes, rows = np.linalg.svd(normals)
        Z = rows[int(np.count_nonzero(sizes > 1e-9)) :].T
    else:
        Z = np.eye(len(H))
    values, vectors = np.linalg.eigh(Z.T @ H @ Z)
    return np.asarray(values, dtype=np.float64), np.asarray(Z @ vectors, dtype=np.float64)


def _follow_flat_direction(nlp: Nlp, at: Linearisation, direction: FloatArray) -> "FloatArray | None":
    """Return a nearby direction along which F keeps its value over a finite step, or None.

    Newton's method corrects a step along the direction back onto the optimal set. If the correction changes the
    direction, the next attempt uses the new direction.

    Args:
        nlp: the nonlinear program.
        at: linearised program at an optimum.
        direction: (n,) unit vector in scaled variables, along which the curvature is zero.
    """
    for _ in range(_DIRECTION_CHANGES):
        steps = (_step_on_optimal_set(nlp, at, sign * direction) for sign in (1.0, -1.0))
        step = next((each for each in steps if each is not None), None)
        if step is None:
            return None
        changed = step / np.linalg.norm(step)
        if abs(float(changed @ direction)) > _SAME_DIRECTION:
            return direction
        direction = changed
    return None


def _step_on_optimal_set(nlp: Nlp, at: Linearisation, direction: FloatArray) -> "FloatArray | None":
    """Return the scaled step (n,) from the point to another optimum: a short step along a direction, corrected.

    None is returned for a step that leaves the box, changes F or returns to the point.
    """
    away = at.x + _FLAT_STEP * nlp.scale * direction
    if np.any(away < nlp.lower) or np.any(away > nlp.upper):
        return None
    back = correct_point(nlp, away, at.active())
    step = np.asarray((back.x - at.x) / nlp.scale, dtype=np.float64)
    keeps_F = back.violation <= FEASIBLE and abs(back.phi - at.phi) <= max(1e-11, nlp.rounding)
    return step if keeps_F and float(np.linalg.norm(step)) > _FLAT_STEP / 3 else None


def _independent_directions(directions: FloatArray) -> list[FloatArray]:
    """Return a sparse basis of vectors (n,) of the span of directions (k, n), sorted by their first nonzero index."""
    _, sizes, rows = np.linalg.svd(directions, full_matrices=False)
    basis = echelon_basis(rows[sizes > _INDEPENDENT * sizes[0]])
    return sorted(np.where(np.abs(basis) > _NEGLIGIBLE, basis, 0.0), key=lambda row: int(np.argmax(row != 0)))


def _changes_by_name(nlp: Nlp, direction: FloatArray) -> Mapping[str, float]:
    """Return a scaled direction (n,) as the change of each variable by name, in the unit of the variable."""
    steps = direction * nlp.scale
    return MappingProxyType(
        {
            variable.name: float(step)
            for variable, step, part in zip(nlp.program.variables, steps, direction, strict=True)
            if abs(part) > _NEGLIGIBLE
        }
    )

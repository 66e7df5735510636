"""How far a point is inside each of the case's limits, and what each limit costs.

The cost of a limit is the derivative of the optimal F by the number that stands in the case, from the multipliers: with
the Lagrangian ``phi + sum_j mu_j (g_j - c_j)`` of :mod:`.kkt`, ``d phi* / d c_j = -mu_j``. A number that
limits several legs or poses costs the sum of what it costs at each of them. The derivative is two-sided where the
active limits have independent normals and positive multipliers, which :mod:`screwsynth.nlp.evidence.optimality` tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np

from ...models import Dimension, FloatArray, WrenchKind
from ..case.limits.constraint import BoundedConstraint, Constraint
from ..case.limits.limits import Homogenised
from ..program.nlp import Nlp
from .kkt import linearise, multipliers
from .state import evaluate


@dataclass(frozen=True)
class Margin:
    """A limit at one leg, joint or pose.

    Attributes:
        name: the limit and where.
        key: dotted key, below ``limits``, of the number in the case.
        bound: which side of it.
        value: what is measured there, radians for angles.
        limit: the number in the case, radians for angles.
        dimension: what both measure.
        active: whether the point lies on it.
        cost: derivative of the optimal F by the limit, per radian for angles; None where there is no optimum.
    """

    name: str
    key: str
    bound: Literal["min", "max", "equal"]
    value: float
    limit: float
    dimension: Dimension
    active: bool
    cost: float | None

    @property
    def margin(self) -> float:
        """How far inside; negative outside."""
        if self.bound == "equal":
            return -abs(self.value - self.limit)
        return self.limit - self.value if self.bound == "max" else self.value - self.limit


def margins_of(nlp: Nlp, x: FloatArray, *, optimal: bool) -> list[Margin]:
    """Margins of a point (n,) in every limit of the case, in the order of the program's constraints.

    Args:
        nlp: the program.
        x: the point.
        optimal: whether the point is an optimum, so that costs mean something.
    """
    if not nlp.case.limits:
        return []
    at = linearise(nlp, x)
    active = set(at.active())
    mu, _ = multipliers(at, sorted(active)) if optimal else (np.zeros(len(at.sides)), 0.0)
    gained = -mu * nlp.sides.sign * at.per_unit * nlp.objective_scale * nlp.sign
    g = nlp.evaluate(x)[1]
    exact = _exact(nlp, x, nlp.program.constraints)
    rows = []
    for j, side in enumerate(nlp.sides.sides):
        if side.constraint is None:
            continue
        constraint = nlp.program.constraints[side.constraint]
        key = constraint.keys[1 if side.bound == "max" else 0]
        if not key:
            continue
        limit = float(nlp.sides.limit[j])
        rows.append(
            Margin(
                name=side.name,
                key=key,
                bound=side.bound,
                value=_value(nlp, x, constraint, float(g[side.constraint]), exact),
                limit=constraint.reading.from_value(limit),
                dimension=constraint.reading.dimension,
                active=j in active,
                cost=float(gained[j] * constraint.reading.slope(limit)) if optimal else None,
            )
        )
    return [*rows, *_met(nlp, x, optimal=optimal)]


def _met(nlp: Nlp, x: FloatArray, *, optimal: bool) -> list[Margin]:
    """Margins of the limits that hold whatever is chosen: they cost nothing."""
    if not nlp.met:
        return []
    expressions = ca.vertcat(*[item.constraint.expression for item in nlp.met])
    function = ca.Function("met", [nlp.program.x, nlp.program.p], [ca.densify(expressions)])
    values = function(x, nlp.arguments).full().ravel()
    exact = _exact(nlp, x, [item.constraint for item in nlp.met])
    return [
        Margin(
            name=item.constraint.name,
            key=key,
            bound=bound,
            value=_value(nlp, x, item.constraint, float(value), exact),
            limit=item.constraint.reading.from_value(limit),
            dimension=item.constraint.reading.dimension,
            active=False,
            cost=0.0 if optimal else None,
        )
        for item, value in zip(nlp.met, values, strict=True)
        for bound, key, limit in _sides(item)
    ]


def _sides(item: BoundedConstraint) -> list[tuple[Literal["min", "max", "equal"], str, float]]:
    low, high = item.constraint.keys
    if item.lower == item.upper:
        return [("equal", low, item.lower)]
    sides: list[tuple[Literal["min", "max", "equal"], str, float]] = []
    if low:
        sides.append(("min", low, item.lower))
    if high:
        sides.append(("max", high, item.upper))
    return sides


def _exact(nlp: Nlp, x: FloatArray, constraints: Sequence[Constraint]) -> dict[str, float]:
    """Measured numbers by name, of the constraints that say them near their limits only."""
    told = {each.name: each.exact for each in constraints if each.exact is not None}
    if not told:
        return {}
    function = ca.Function("exact", [nlp.program.x, nlp.program.p], [ca.densify(ca.vertcat(*told.values()))])
    return dict(zip(told, map(float, function(x, nlp.arguments).full().ravel()), strict=True))


def _value(nlp: Nlp, x: FloatArray, constraint: Constraint, measured: float, exact: dict[str, float]) -> float:
    """The measured number; singular values, which the program keeps to from the safe side, as they are."""
    if constraint.name in exact:
        return exact[constraint.name]
    limits = nlp.case.limits
    if constraint.keys[0].startswith("smallest_singular_value") and limits.smallest_singular_value is not None:
        return float(_singular_values(nlp, x, constraint.pose, limits.smallest_singular_value)[-1])
    if constraint.keys[1].startswith("condition_number") and limits.condition_number is not None:
        values = _singular_values(nlp, x, constraint.pose, limits.condition_number)
        return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")
    return constraint.reading.from_value(measured)


def _singular_values(nlp: Nlp, x: FloatArray, pose: int, homogenised: Homogenised) -> FloatArray:
    """(6,) singular values of J with moments about the platform's origin, divided by a length; 0 for missing rows."""
    state = evaluate(nlp, x, pose)
    forces, moments = state.jacobian[:, :3], np.array(state.jacobian[:, 3:])
    along = [row.kind is WrenchKind.FORCE for row in nlp.program.model.wrenches]
    moments[along] -= np.cross(state.position, forces[along])
    values = np.linalg.svd(np.hstack([forces, moments / homogenised.length]), compute_uv=False)
    return np.concatenate([values, np.zeros(6 - len(values))])

"""Data about building the design: margins and costs, relaxations, sensitivities."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...models import Dimension, FloatArray, frozen_array
from ..case.case import Case
from ..evidence.margins import Margin, margins_of
from ..evidence.sensitivity import sensitivities
from ..evidence.tolerance import tolerance_loss
from ..program.nlp import Nlp
from ..program.relaxation import RelaxedLimit
from ..system.jsonvalues import finite_or_none, vector
from ..units import rate_unit
from .parts import JointGradientData, LimitData, MarginData, RelaxationData, SensitivityData, ToleranceData
from .rounding import NOISE

#: Beginning of the names of constraints on the rates of actuators.
_RATE = "actuator_rate actuator "


def margins_data(nlp: Nlp, x: FloatArray, *, optimal: bool) -> tuple[MarginData, ...]:
    """Return the margins of a point (n,) in every limit of the case; their costs too where the point is an optimum."""
    return tuple(_margin(nlp.case, row) for row in margins_of(nlp, x, optimal=optimal))


def _margin(case: Case, row: Margin) -> MarginData:
    """Return a margin in the case's units."""
    units = case.units
    return MarginData.of(
        row,
        value=finite_or_none(units.shown(row.value, row.dimension)),
        limit=units.shown(row.limit, row.dimension),
        margin=finite_or_none(units.shown(row.margin, row.dimension)),
        unit=unit_of_side(case, row.name, row.dimension),
        cost=None if row.cost is None else units.per_unit(row.cost, row.dimension),
    )


def unit_of_side(case: Case, name: str, dimension: Dimension) -> str:
    """Return the unit of a bound's or a limit's number; empty for a plain number.

    Args:
        case: the case.
        name: of the variable or the constraint.
        dimension: of the number; a limit on actuators' rates has one number for angles and lengths.
    """
    if not name.startswith(_RATE):
        return case.units.label(dimension)
    owners = [each for each in case.model.actuators if name.startswith(f"{_RATE}{each.name}")]
    kind = max(owners, key=lambda each: len(each.name)).dimension if owners else Dimension.LENGTH
    tasks = [task for task in case.tasks if f" task {task.name}" in name] or list(case.tasks[:1])
    return rate_unit(frozen_array(tasks[0].twist, (6,)), case.units, kind)


def limits_data(margins: Sequence[MarginData]) -> tuple[LimitData, ...]:
    """Return one row for each limiting number of the case: its least margin, where it is active, and its whole cost."""
    keys = dict.fromkeys(row.key for row in margins)
    return tuple(_limit([row for row in margins if row.key == key]) for key in keys)


def _limit(margins: Sequence[MarginData]) -> LimitData:
    """Return one limiting number from all its margins."""
    sizes = [-math.inf if row.margin is None else row.margin for row in margins]
    # The first of equally near ones: rounding must not choose among legs that are images of each other.
    near = min(sizes) + NOISE * max(abs(margins[0].limit), abs(margins[0].value or 0.0))
    least = next(row for row, size in zip(margins, sizes, strict=True) if size <= near)
    costs = [row.cost for row in margins if row.cost is not None]
    return LimitData.of(
        least,
        nearest=least.name,
        active=tuple(row.name for row in margins if row.active),
        violated=tuple(row.name for row in margins if row.violated),
        cost=sum(costs) if costs else None,
    )


def relaxation_data(nlp: Nlp, relaxation: Sequence[RelaxedLimit]) -> tuple[RelaxationData, ...] | None:
    """Return the numbers of the case that must be moved for it to be feasible, all at once; None without any."""
    units = nlp.case.units
    rows = tuple(
        RelaxationData.of(
            row,
            limit=units.shown(row.limit, row.dimension),
            needed=units.shown(row.needed, row.dimension),
            unit=units.label(row.dimension),
        )
        for row in relaxation
    )
    return rows or None


def sensitivity_data(nlp: Nlp, x: FloatArray) -> tuple[SensitivityData, ...]:
    """Return the sensitivities of the optimal F at an optimum (n,) to the numbers that the case fixes."""
    units = nlp.case.units
    return tuple(
        SensitivityData.of(
            row,
            value=units.shown(row.value, row.dimension),
            unit=units.label(row.dimension),
            derivative=None if row.derivative is None else units.per_unit(row.derivative, row.dimension),
            hindrance=None if row.hindrance is None else row.hindrance.value,
        )
        for row in sensitivities(nlp, x)
    )


def tolerance_data(nlp: Nlp, x: FloatArray) -> ToleranceData | None:
    """Return the loss at an optimum (n,) by inexact joint centres; None without a tolerance, or without rows of it."""
    tolerance = nlp.case.joint_centre_tolerance
    if tolerance is None or not nlp.case.model.built or nlp.case.tasks[0].measure or nlp.case.worst_everywhere:
        return None
    lost = tolerance_loss(nlp, x, tolerance)
    return ToleranceData.of(
        lost,
        joint_centre=lost.tolerance,
        joints=tuple(
            JointGradientData(limb=limb, plate=plate, gradient=vector(gradient))
            for (limb, plate), gradient in zip(lost.joints, lost.gradients, strict=True)
        ),
    )

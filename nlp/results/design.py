"""Margins of a design, derivatives of F, and the loss of F by joint-centre errors, in the units of the case."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...models import FloatArray
from ..evidence.margins import Margin, margins_of
from ..evidence.tolerance import ToleranceLoss, tolerance_loss
from ..program.nlp import Nlp
from .parts import LimitData
from .rounding import NOISE


def margins_data(nlp: Nlp, x: FloatArray, *, optimal: bool) -> tuple[Margin, ...]:
    """Return the margins of a point (n,) in the case's units; at an optimum, with derivatives of F."""
    return Margin.of_each(margins_of(nlp, x, optimal=optimal), nlp.case.units)


def limits_data(margins: Sequence[Margin]) -> tuple[LimitData, ...]:
    """Return a row for each limit: smallest margin, places at which the limit is active, and derivative of F."""
    keys = dict.fromkeys(row.key for row in margins)
    return tuple(_limit([row for row in margins if row.key == key]) for key in keys)


def _limit(margins: Sequence[Margin]) -> LimitData:
    """Return the row of a limit from all its margins."""
    sizes = [row.margin if math.isfinite(row.margin) else -math.inf for row in margins]
    # The first of equal margins: rounding must not choose among symmetric legs.
    beside = [abs(each) for each in (margins[0].limit, margins[0].value) if math.isfinite(each)]
    near = min(sizes) + NOISE * max(beside)
    least = next(row for row, size in zip(margins, sizes, strict=True) if size <= near)
    costs = [row.cost for row in margins if row.cost is not None]
    return LimitData.of(
        least,
        nearest=least.name,
        active=tuple(row.name for row in margins if row.active),
        violated=tuple(row.name for row in margins if row.violated),
        cost=sum(costs) if costs else None,
    )


def tolerance_loss_of(nlp: Nlp, x: FloatArray) -> ToleranceLoss | None:
    """Return the loss of F by joint-centre errors at an optimum (n,); None without a tolerance or a rule for it."""
    tolerance = nlp.case.joint_centre_tolerance
    if tolerance is None or not nlp.case.model.built or nlp.case.tasks[0].measure or nlp.case.worst_everywhere:
        return None
    return tolerance_loss(nlp, x, tolerance)

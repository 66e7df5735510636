"""Limits of a robot that is not six straight legs with searches of their own, and limits that are not judged."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from .....models import Dimension, Model
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.legs import Actuator
from ....case.limits.limit import Limit
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.task import Sense
from ....errors import UncoveredError
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, build_problem
from ..robot.tolerance_model import Family
from ..verdict import Outcome
from .bound_search import Oracle
from .extremes import Extreme
from .leg_numbers import from_minimum, searched_minimum
from .spectrum import Spectrum


def limited_spectrum(
    case: Case,
    model: Model,
    box: PoseBox,
    family: Family | None,
    unknown: str,
    *,
    gap: float,
) -> Iterator[Extreme]:
    """Yield the extremes of limits with searches of their own of a robot that is not six straight legs.

    Distances of legs and strokes have no search over a workspace, and are open.

    Args:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        box: the poses.
        family: all machines that are meant; None for the design alone.
        unknown: reason why the machines that are meant are not judged; else empty.
        gap: allowed distance of a bound from the best value known, as a part of it.
    """
    for limit in case.limits:
        if isinstance(limit, SmallestSingularValue | ConditionNumber):
            is_condition = isinstance(limit, ConditionNumber)
            end, value, sign = (
                ("max", limit.max, -1.0) if isinstance(limit, ConditionNumber) else ("min", limit.min, 1.0)
            )
            sense = Sense.MAX if is_condition else Sense.MIN
            try:
                if unknown:
                    raise NotJudgedError(unknown)
                oracle = robot_spectrum(case, model, box, limit.length, family, is_condition=is_condition)
            except (UncoveredError, NotJudgedError) as error:
                nothing = (-sign * math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, str(error))
                yield Extreme(limit.key, sense, Dimension.NUMBER, f"{limit.key}.{end}", value, *nothing)
                continue
            found = searched_minimum(oracle, box, sign * value, gap, None)
            yield from_minimum(limit.key, f"{limit.key}.{end}", sign * value, box, found, sign=sign)
        else:
            yield from _not_judged(limit)


def _not_judged(limit: Limit[Any]) -> Iterator[Extreme]:
    """Yield open extremes of limits that are judged for six straight legs alone."""
    fault = "this limit is judged over a workspace for six straight legs alone"
    ends: list[tuple[str, Sense, float | None]] = []
    if isinstance(limit, LegClearance):
        ends = [("leg_clearance.min", Sense.MIN, limit.min)]
    elif isinstance(limit, Actuator):
        ends = [
            ("actuator.stroke_max", Sense.MAX, limit.stroke_max),
            ("actuator.dead_length", Sense.MIN, limit.dead_length),
        ]
    for key, sense, value in ends:
        if value is not None:
            nothing = (math.inf if sense is Sense.MAX else -math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, fault)
            yield Extreme(key, sense, Dimension.LENGTH, key, value, *nothing)


def robot_spectrum(
    case: Case, model: Model, box: PoseBox, length: float, family: Family | None, *, is_condition: bool
) -> Oracle:
    """Return bounds of a number over boxes of a robot that is not six straight legs.

    Raises:
        NotJudgedError: the robot has loops without a closed form.
    """
    problem = build_problem(case, model, box) if family is None else family.problem
    if problem.dependent:
        raise NotJudgedError("the robot has loops that are not solved in closed form")
    return Spectrum(problem, length, is_condition=is_condition, family=family)

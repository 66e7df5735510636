"""Singular values and condition numbers that are asked for where the case does not limit them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ....models import Dimension, Model
from ...case.case import Case
from ...case.limits.clearance import LegClearance
from ...case.limits.legs import Actuator
from ...case.limits.limit import Limit
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.task import Sense
from ...errors import UncoveredError
from ..general.family import Family
from ..general.problem import NotJudgedError, build_problem
from ..general.spectrum import Spectrum
from ..machine import legs_of
from ..posebox import PoseBox
from ..verdict import Outcome
from .boundsearch import Oracle, prove_minimum
from .extremes import Extreme
from .ownsearches import from_minimum, searched_minimum
from .singular import SingularValues

#: Names of the measures that are no quantities of a robot.
SPECTRAL = (SmallestSingularValue.key, ConditionNumber.key)


def spectral_extremes(
    case: Case,
    model: Model,
    box: PoseBox,
    names: Sequence[str],
    *,
    gap: float,
    time_limit: float | None,
    interrupted: Callable[[], bool],
) -> Iterator[Extreme]:
    """Yield the smallest singular value, or the largest condition number, of J over a box of poses.

    Moments about the platform's origin are divided by the case's characteristic length.

    Args:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        box: the poses.
        names: of :data:`SPECTRAL`.
        gap: allowed distance of a bound from the best value known, as a part of it.
        time_limit: seconds for each search.
        interrupted: whether the work is requested to stop.
    """
    for name in names:
        is_condition = name == ConditionNumber.key
        sense = Sense.MAX if is_condition else Sense.MIN
        sign = -1.0 if is_condition else 1.0
        try:
            oracle = _oracle(case, model, box, is_condition=is_condition)
        except (UncoveredError, NotJudgedError) as error:
            nothing = (sign * -math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, str(error))
            yield Extreme(name, sense, Dimension.NUMBER, "", None, *nothing)
            continue
        middle = abs(float(oracle.values((0.5 * (box.lower + box.upper))[None])[0]))
        found = prove_minimum(oracle, box, gap=gap * (middle or 1.0), time_limit=time_limit, interrupted=interrupted)
        outcome = Outcome.OPEN if found.reason else Outcome.PROVED
        reached = (sign * found.bound, sign * found.value, box.pose(found.y), outcome)
        yield Extreme(name, sense, Dimension.NUMBER, "", None, *reached, found.boxes, found.seconds, found.reason)


def limited_spectrum(
    case: Case,
    model: Model,
    box: PoseBox,
    family: Family | None,
    unknown: str,
    *,
    gap: float,
    time_limit: float | None,
    interrupted: Callable[[], bool],
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
        time_limit: seconds for each search.
        interrupted: whether the work is requested to stop.
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
                oracle = _spectrum(case, model, box, limit.length, family, is_condition=is_condition)
            except (UncoveredError, NotJudgedError) as error:
                nothing = (-sign * math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, str(error))
                yield Extreme(limit.key, sense, Dimension.NUMBER, f"{limit.key}.{end}", value, *nothing)
                continue
            found = searched_minimum(oracle, box, sign * value, gap, time_limit, interrupted, None)
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


def _oracle(case: Case, model: Model, box: PoseBox, *, is_condition: bool) -> Oracle:
    """Return bounds of a number over boxes.

    Raises:
        NotJudgedError: the robot has loops without a closed form, or other machines are meant too.
    """
    if case.joint_centre_tolerance:
        raise NotJudgedError("measures that no limit asks for are bounded for the exact machine alone: give a limit")
    legs, length = legs_of(case), case.characteristic_length
    if legs is not None:
        return SingularValues(legs, box, length, is_condition=is_condition)
    return _spectrum(case, model, box, length, None, is_condition=is_condition)


def _spectrum(
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

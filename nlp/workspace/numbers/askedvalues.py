"""Singular values and condition numbers that are asked for where the case does not limit them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from ....models import Dimension, Model
from ...case.case import Case
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.task import Sense
from ...errors import UncoveredError
from ..general.problem import NotJudgedError, build_problem
from ..general.spectrum import Spectrum
from ..machine import legs_of
from ..posebox import PoseBox
from ..verdict import Outcome
from .boundsearch import Oracle, prove_minimum
from .extremes import Extreme
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
    problem = build_problem(case, model, box)
    if problem.dependent:
        raise NotJudgedError("the robot has loops that are not solved in closed form")
    return Spectrum(problem, length, is_condition=is_condition)

"""Singular values and condition numbers that are asked for where the case does not limit them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .....models import Dimension, Model
from ....case.case import Case
from ....case.limits.singular_values import ConditionNumber
from ....case.task import Sense
from ....errors import UncoveredError
from ...statement.claims import asked_name, asked_spectra
from ...statement.machine import legs_of
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError
from ..robot.tolerance_model import Family
from ..verdict import Outcome
from .bound_search import Oracle, prove_minimum
from .extremes import Extreme
from .robot_limits import robot_spectrum
from .singular import SingularValues

if TYPE_CHECKING:
    from ..proof_record import PaperRecord

#: Reason for a measure of which nothing is known of every machine.
_TOO_LARGE = "the errors of joint centres are too large for a bound of the change of J"
#: Number of poses at which the width of a bound over machines is taken, and as many near corners.
_POINTS, _SEED = 64, 0


def spectral_extremes(
    case: Case,
    model: Model,
    box: PoseBox,
    names: Sequence[str],
    *,
    gap: float,
    shortest: float = 0.0,
    family: Family | None = None,
    unknown: str = "",
    paper: PaperRecord | None = None,
) -> Iterator[Extreme]:
    """Yield the smallest singular value, or the largest condition number, of J over a box of poses.

    Moments about the platform's origin are divided by the case's characteristic length.

    Args:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        box: the poses.
        names: measures that are asked for, of which the others are left out.
        gap: allowed distance of a bound from the best value known, as a part of it.
        shortest: no leg of any machine is shorter over the workspace; used with a tolerance of its legs alone.
        family: all machines that are meant of a robot that is not six straight legs; None for the design alone.
        unknown: reason why the machines that are meant are not judged; else empty.
        paper: records the searches for a proof.
    """
    for name in asked_spectra(case, names):
        is_condition = name == ConditionNumber.key
        sense = Sense.MAX if is_condition else Sense.MIN
        sign = -1.0 if is_condition else 1.0
        try:
            oracle = _oracle(case, model, box, shortest, family, unknown, is_condition=is_condition)
        except (UncoveredError, NotJudgedError) as error:
            nothing = (sign * -math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, str(error))
            yield Extreme(asked_name(case, name), sense, Dimension.NUMBER, "", None, *nothing)
            continue
        middle = abs(float(oracle.values((0.5 * (box.lower + box.upper))[None])[0]))
        allowed, is_of_legs = gap * (middle or 1.0), isinstance(oracle, SingularValues)
        if case.joint_centre_tolerance:
            allowed += _width(oracle, box)
        recorder = paper.own(asked_name(case, name)) if paper is not None and is_of_legs else None
        found = prove_minimum(oracle, box, gap=allowed, recorder=recorder)
        # A smallest singular value of at least 0, or an infinite condition number, says nothing.
        is_bound = math.isfinite(found.bound) and (is_condition or found.bound > 0)
        reason = found.reason or ("" if is_bound or not case.joint_centre_tolerance else _TOO_LARGE)
        reached = (
            sign * found.bound,
            sign * found.value,
            box.pose(found.at),
            Outcome.OPEN if reason else Outcome.PROVED,
        )
        ended = (*reached, found.boxes, found.seconds, reason)
        extreme = Extreme(asked_name(case, name), sense, Dimension.NUMBER, "", None, *ended)
        if case.joint_centre_tolerance and isinstance(oracle, SingularValues):
            extreme = replace(extreme, errors=oracle.errors(found.at))
        yield extreme


def _width(oracle: Oracle, box: PoseBox) -> float:
    """Return how far the bound at a pose is from the value of the worst machine there, the most at a few poses.

    A bound of the change of J is wider than its change in any one machine, and no smaller boxes make it less wide.
    """
    rng = np.random.default_rng(_SEED)
    points = box.random(_POINTS, rng)
    points = np.concatenate([points, box.clipped(np.where(rng.uniform(size=points.shape) < 0.5, box.lower, box.upper))])
    return float(np.nanmax(oracle.values(points) - oracle.bounds(points, points).lower, initial=0.0))


def _oracle(
    case: Case, model: Model, box: PoseBox, shortest: float, family: Family | None, unknown: str, *, is_condition: bool
) -> Oracle:
    """Return bounds of a number over boxes.

    Raises:
        NotJudgedError: the robot has loops without a closed form, or the machines that are meant are not judged.
    """
    legs, length = legs_of(case), case.characteristic_length
    if legs is not None:
        return SingularValues(legs, box, length, is_condition=is_condition, shortest=shortest)
    if unknown:
        raise NotJudgedError(unknown)
    return robot_spectrum(case, model, box, length, family, is_condition=is_condition)

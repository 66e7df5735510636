"""Ranges of joints from the limits of a case, counted from the pose that is exported.

Ranges come from ``leg_length``, from ``actuator_angle`` and ``actuator_length``, and from ranges of joints. Other
limits (cones, strokes, clearances, rates) are no ranges of one joint.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ....models.limbjoints import LimbJoint
from ....models.mechanism import MechanismJoint
from ...case.case import Case
from .words import ExportedJoint

if TYPE_CHECKING:
    from collections.abc import Mapping

#: A slide with one side of a range has this many times the robot's size as the other: no loop of the robot is as long.
_FAR = 100.0


def joint_range(
    case: Case,
    joint: MechanismJoint,
    words: ExportedJoint,
    given: LimbJoint | None,
    lengths: Mapping[str, float],
    size: float,
) -> tuple[float, float] | None:
    """Return the smallest and the largest coordinate of a joint from the exported pose; None without a limit.

    Args:
        case: with its limits.
        joint: the joint.
        words: the same in the words of the case.
        given: the joint of the robot file that it is part of; None for a leg.
        lengths: of the legs at that pose, by limb.
        size: length of the order of the robot's own.
    """
    if not case.limits or joint.kind in ("S", "weld") or words.follows:
        return None
    # The classes of limits need pydantic, which a case without limits does not load.
    from ...case.limits.interval import QuantityLimit  # noqa: PLC0415
    from ...case.limits.joint_motion import JointMotion  # noqa: PLC0415
    from ...case.limits.legs import LegLength  # noqa: PLC0415

    is_slide = joint.kind == "P"
    measure = "actuator_angle" if words.lever is None and not is_slide else "actuator_length"
    lower, upper, lever, value = -math.inf, math.inf, words.lever or 1.0, words.coordinate or 0.0
    for limit in case.limits:
        at = None
        if isinstance(limit, LegLength) and joint.actuated and words.actuator in lengths:
            at = lengths[words.actuator]
        elif isinstance(limit, QuantityLimit) and joint.actuated and given is not None:
            at = value if limit.measure == measure else None
        elif isinstance(limit, JointMotion) and given is not None and given.is_called(limit.joint):
            at = value if limit.part == words.part else None
        if at is not None and isinstance(limit, LegLength | QuantityLimit | JointMotion):
            lower = max(lower, -math.inf if limit.min is None else limit.min / lever - at)
            upper = min(upper, math.inf if limit.max is None else limit.max / lever - at)
    if math.isinf(lower) and math.isinf(upper):
        return None
    # Formats have ranges with two sides; a limit of an angle counts within half a turn from home.
    far = _FAR * size if is_slide else math.pi
    middle = 0.0 if is_slide else -value
    return max(lower, middle - far), min(upper, middle + far)

"""Actuated joints that the pose does not determine, as settings or constants along the tool path of a case.

For a case that is optimised along its path, the free actuator coordinates of the robot become parameters. Limits on
joints state their ranges; with a rate, a coordinate changes along the path.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...models import Model
from ...models.model import joint_parameter
from ..errors import CaseError
from ..units import Units
from .limits.limit import LimitedCase
from .limits.limits import Limits
from .loads import NO_LOADING
from .pose import Free


class JointsAlong(NamedTuple):
    """Robot whose free actuator coordinates are parameters, and the values of all its parameters by name."""

    model: Model
    parameters: Mapping[str, Any]


def with_joints_along(model: Model, parameters: Mapping[str, Any], limits: Limits, units: Units) -> JointsAlong:
    """Return the robot and the parameters of a case that is optimised along its path.

    Args:
        model: robot of the case.
        parameters: value of each parameter by name; fixed joint coordinates stay fixed.
        limits: limits of the case.
        units: units of messages.

    Raises:
        CaseError: a limit on a joint is not allowed, or a free joint has no range.
    """
    if not model.undetermined:
        return JointsAlong(model, parameters)
    from .limits.joint_motion import JointMotion  # noqa: PLC0415 - most cases start without the tables of limits

    motions = [each for each in limits if isinstance(each, JointMotion)]
    for each in motions:
        each.check(LimitedCase(model, units, {}, NO_LOADING))
    found = dict(parameters)
    for label in model.undetermined:
        name = joint_parameter(label)
        given = found.get(name)
        (value,) = given if isinstance(given, Sequence) and len(given) == 1 else (given,)
        if isinstance(value, Free) and name in parameters and model.free_joints:
            fault = "must be a number, at which the joint is locked; state a range in limits.joint"
            raise CaseError(f"robot.parameters.{name}", fault)
        if value is None or isinstance(value, Free):
            named = [each for each in motions if any(joint.label == label for joint in each.joints(model))]
            found[name] = _range(label, named)
    return JointsAlong(model.with_joints_as_parameters(), found)


def _range(label: str, motions: Sequence[Any]) -> Free:
    """Return the range of a free joint from the limits on it, with their smallest rate and a start near home.

    Args:
        label: label of the joint.
        motions: limits on its coordinate.

    Raises:
        CaseError: the range has no end on one side, or is empty.
    """
    lower = max((each.min for each in motions if each.min is not None), default=None)
    upper = min((each.max for each in motions if each.max is not None), default=None)
    if lower is None or upper is None:
        fault = 'needs min and max with over = "path": the pose does not determine this actuated joint'
        raise CaseError(f"limits.joint.{label}", f'{fault}; add per = "path" and rate if it moves along the path')
    if not lower < upper:
        raise CaseError(f"limits.joint.{label}.min", "must be below max in all limits on this joint together")
    rate = min((each.rate for each in motions if each.rate is not None), default=None)
    return Free(lower, upper, min(max(0.0, lower), upper), rate=rate)


def check_joint_rates(model: Model, limits: Limits, *, has_path: bool) -> None:
    """Refuse a joint that changes along the path in a case that is not optimised along a path.

    Args:
        model: robot of the case.
        limits: limits of the case.
        has_path: whether the case has a tool path.

    Raises:
        CaseError: a limit on a joint has a rate.
    """
    if model.locked:  # the robot at one point, or with a stated schedule
        return
    for each in limits:
        if getattr(each, "rate", None) is None:
            continue
        if not has_path:
            raise CaseError(f"limits.{each.name}.per", "the case states no path", "path")
        fault = f'{each.name} changes along the path, which needs over = "path" and as = "mean" or "worst"'
        raise CaseError("objective", fault)

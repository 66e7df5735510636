"""The robot of a case at a point, with its numbers by name in the units of the case. Nothing is optimised."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from ...models import FloatArray
from ..case.case import Case
from ..case.limits.limits import Limits
from ..program.epigraph import with_exact_level
from ..program.formulation import formulate
from ..program.nlp import Nlp
from ..system.deprecated import renamed_argument
from ..system.jsonvalues import Vector
from . import state as states
from .closing import closed_start
from .state import RobotState, stated_poses


@renamed_argument("nlp", "case")
def evaluate(case: Case | Nlp, x: FloatArray | None = None, pose: int = 0) -> RobotState:
    """Return the robot of a case at a point, as the command ``evaluate`` does.

    Args:
        case: the case, with its first task; or a program.
        x: (n,) values of the free variables of the program. Left out, they are at their starts, or in the middle of
            their ranges, with the robot's loops closed in the home assembly mode.
        pose: index of the pose, in a case with several poses.

    Returns:
        The robot with the rates of the program's task, or of its first task where the program combines several.

    Raises:
        CaseError: the fixed numbers of the case contradict each other.
        EvaluationError: a number is not finite at this point, as where a limb has zero length.
    """
    nlp = formulate(without_speeds(case)) if isinstance(case, Case) else case
    return states.evaluate(nlp, starting_point(nlp) if x is None else x, pose)


def starting_point(nlp: Nlp) -> FloatArray:
    """Return the point (n,) of a program that is evaluated where none is given: the first starting point, closed.

    Raises:
        EvaluationError: the robot does not exist there.
    """
    return with_exact_level(nlp, closed_start(nlp))


def without_speeds(case: Case) -> Case:
    """Return a case without the limits on speeds and powers of a path, whose motion the case does not state."""
    left_out = case.without_motion
    return replace(case, limits=Limits(*(each for each in case.limits if each not in left_out))) if left_out else case


def shown_parameters(case: Case, state: RobotState) -> Mapping[str, float | Vector]:
    """Return the robot's parameters by name, in the case's units: several numbers for a point or direction."""
    shown: dict[str, float | Vector] = {}
    for parameter in case.model.parameters:
        values = [case.units.shown(float(value), parameter.dimension) for value in state.parameters[parameter.name]]
        shown[parameter.name] = values[0] if len(values) == 1 else tuple(values)
    return MappingProxyType(shown)


def shown_numbers(nlp: Nlp, x: FloatArray, state: RobotState) -> Mapping[str, float | Vector]:
    """Return the numbers of a case at a point in its units, by the names that ``--set`` has for them.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there.

    Returns:
        Parameters and their components, then position, angle and axis of each stated pose.
    """
    case = nlp.case
    found: dict[str, float | Vector] = {}
    for name, value in shown_parameters(case, state).items():
        found[case.parameter_name(name)] = value
    for parameter in case.model.parameters:
        values = (case.units.shown(float(each), parameter.dimension) for each in state.parameters[parameter.name])
        found |= dict(zip(case.component_names(parameter), values, strict=True))
    for prefix, pose in zip(case.pose_prefixes, stated_poses(nlp, x), strict=True):
        shown = type(pose).of(pose, case.units)
        found |= {f"{prefix}p_{axis}": value for axis, value in zip("xyz", shown.position, strict=True)}
        found |= {f"{prefix}angle": shown.angle, f"{prefix}axis": shown.axis}
    return MappingProxyType(found)

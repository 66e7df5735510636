"""Evaluation of a case at a point without optimisation, with its parameters by name in the units of the case."""

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
    """Return the state of a case's robot at a point, as the command ``evaluate`` does.

    Args:
        case: case, whose first task is used; or a nonlinear program.
        x: (n,) values of the free variables of the program. If left out: their starts, or the middle of their ranges,
            with the robot's loops closed in the home assembly mode.
        pose: index of the pose, in a case with several poses.

    Returns:
        The state with the rates of the program's task; for combined tasks, of the first task.

    Raises:
        CaseError: the fixed values of the case contradict each other.
        EvaluationError: a value is not finite at this point, for example because a limb has zero length.
    """
    nlp = formulate(without_speeds(case)) if isinstance(case, Case) else case
    return states.evaluate(nlp, starting_point(nlp) if x is None else x, pose)


def starting_point(nlp: Nlp) -> FloatArray:
    """Return the default point (n,) for an evaluation: the first starting point, with closed loops.

    Raises:
        EvaluationError: the loops cannot be closed.
    """
    return with_exact_level(nlp, closed_start(nlp))


def without_speeds(case: Case) -> Case:
    """Return a case without limits on speeds and powers, if the case has no motion."""
    left_out = case.without_motion
    return replace(case, limits=Limits(*(each for each in case.limits if each not in left_out))) if left_out else case


def shown_parameters(case: Case, state: RobotState) -> Mapping[str, float | Vector]:
    """Return the robot's parameters by name, in the case's units; a point or direction has several components."""
    shown: dict[str, float | Vector] = {}
    for parameter in case.model.parameters:
        values = [case.units.shown(float(value), parameter.dimension) for value in state.parameters[parameter.name]]
        shown[parameter.name] = values[0] if len(values) == 1 else tuple(values)
    return MappingProxyType(shown)


def shown_values(nlp: Nlp, x: FloatArray, state: RobotState) -> Mapping[str, float | Vector]:
    """Return the parameters and pose coordinates of a case at a point in its units, by their names for ``--set``.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point.

    Returns:
        Parameters and their components, then position, angle and axis of each stated pose.
    """
    case = nlp.case
    found: dict[str, float | Vector] = {}
    shown = shown_parameters(case, state)
    for parameter in case.model.parameters:
        value = shown[parameter.name]
        found[case.parameter_name(parameter.name)] = value
        components = value if isinstance(value, tuple) else (value,)
        found |= dict(zip(case.component_names(parameter), components, strict=True))
    for prefix, pose in zip(case.pose_prefixes, stated_poses(nlp, x), strict=True):
        stated = type(pose).of(pose, case.units)
        found |= {f"{prefix}p_{axis}": value for axis, value in zip("xyz", stated.position, strict=True)}
        found |= {f"{prefix}angle": stated.angle, f"{prefix}axis": stated.axis}
    return MappingProxyType(found)

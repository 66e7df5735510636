"""Robots with fixed dimensions: checks of cases, and joint centres of straight legs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray, Model, frozen_array
from ....models.model import joint_parameter
from ...case.case import Case
from ...case.checks import check_determined_joints
from ...case.pose import Free
from ...case.workspace import Workspace
from ...errors import CaseError, InputError
from ...evidence.dependent import with_dependent

#: Number of legs of a hexapod: the degrees of freedom of a rigid body.
LEGS = 6
#: Factor of the tolerance for computed joint-centre errors, so that rounding does not exceed the tolerance.
INSIDE = 1 - 1e-12


class Legs(NamedTuple):
    """Joint centres of a robot's k legs.

    Attributes:
        base: (k, 3) base joint centres in the world frame, length.
        platform: (k, 3) platform joint centres in the platform frame, length.
        tolerance: joint-centre tolerance, length; 0 for the nominal robot.
    """

    base: FloatArray
    platform: FloatArray
    tolerance: float = 0.0

    def spans(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the vectors (k, 3) from the base joints to the platform joints at a pose, in the world frame."""
        return np.asarray(position + self.platform @ rotation.T - self.base)


class JointErrors(NamedTuple):
    """Joint-centre errors of one robot.

    Attributes:
        names: names of the m joint centres; for straight legs the base centre, then the platform centre, leg by leg.
        vectors: (m, 3) errors in the world frame at home, length; in the platform frame for platform centres of legs.
    """

    names: tuple[str, ...]
    vectors: FloatArray


def workspace_of_case(case: Case) -> Workspace:
    """Return a case's workspace in world coordinates, with the dependent coordinates of its robot.

    Raises:
        CaseError: the case has no workspace, a dimension of its robot is free, limits need a motion that the case does
            not state, or the pose does not determine its driven joints; and for the reasons of
            :func:`~...evidence.dependent.with_dependent`.
    """
    if case.workspace is None:
        raise CaseError("workspace", "is missing: state the poses to be verified in [workspace]", source=case.source)
    case.fixed_parameters("a workspace is judged with fixed dimensions")
    case.require_motion()
    check_determined_joints(case.model, "workspace", case.source)
    return with_dependent(case, case.world_workspace or case.workspace)


def check_changing(case: Case, names: Sequence[str]) -> None:
    """Refuse what is not supported along a path: free dimensions, and some robots and limits while dimensions change.

    Args:
        case: the case.
        names: dimensions that change along the path: components of the robot's parameters.

    Raises:
        CaseError: another dimension is free; or see :func:`check_moving`.
    """
    case.fixed_parameters("a path is judged with fixed dimensions", names)
    check_moving(case, names)


def check_moving(case: Case, names: Sequence[str]) -> None:
    """Refuse robots and limits that are not supported along a path while dimensions change.

    Args:
        case: the case; its other dimensions may be free.
        names: dimensions that change along the path: components of the robot's parameters.

    Raises:
        CaseError: a dimension changes that is no coordinate of an actuated joint, and the robot does not have six
            straight legs; or a limit is about home.
    """
    if not names:
        return
    first = case.parameter_name(names[0])
    joints = [joint_parameter(label) for label in case.model.locked]
    if not (has_straight_legs(case.model) or all(name in joints for name in names)):
        fault = f"{case.model.name} is not a robot with six straight legs, for which alone this is proved"
        raise CaseError(f"robot.parameters.{first}.per", f"{fault}; give the drive as a joint", "path", case.source)
    check_home(case, [first])


def check_home(case: Case, names: Sequence[str]) -> None:
    """Refuse a limit about home while dimensions change along a path, because home states no values of them.

    Args:
        case: the case.
        names: names of the dimensions that change, as messages show them.

    Raises:
        CaseError: a limit is about home, and a dimension changes.
    """
    for limit in case.limits:
        if names and limit.reference == "home":
            fault = f"home has no {names[0]}, which changes along the path; state mounting axes"
            raise CaseError(f"limits.{limit.key}.about", fault, "home", case.source)


def check_leg_error(case: Case, leg_error: float) -> None:
    """Check a leg-length error.

    Raises:
        InputError: the error is negative or not finite, or the robot does not have six straight legs.
    """
    if not 0 <= leg_error < float("inf"):
        raise InputError(f"--leg-error {leg_error:g}: must be finite and not negative")
    if leg_error and not has_straight_legs(case.model):
        raise InputError(
            f"--leg-error {leg_error:g}: needs a robot with six straight legs, which {case.model.name!r} is not"
        )


def has_straight_legs(model: Model) -> bool:
    """Return whether a robot that is given by its rows consists of six straight legs between fixed joint centres."""
    if model.settings:
        return False
    return len(model.legs) == LEGS == len(model.wrenches) and not (model.members or model.unknowns or model.structure)


def legs_of(case: Case) -> Legs | None:
    """Return the :func:`joint_centres` of a robot with six straight legs; None for other robots.

    The result is None, too, if a dimension is free or changes along a path.
    """
    is_fixed = not any(isinstance(value, Free) for name in case.parameters for value in case.components(name))
    return joint_centres(case) if is_fixed and has_straight_legs(case.model) else None


def joint_centres(case: Case) -> Legs:
    """Return the joint centres of a robot's straight legs (possibly none), with the tolerance."""
    model = case.model
    symbols = model.symbols
    parts = [value for name in case.parameters for value in case.components(name)]
    values = ca.vertcat(ca.DM(0, 1), *[ca.DM(value) for value in parts if not isinstance(value, Free)])
    ends = [
        ca.densify(ca.horzcat(ca.SX(3, 0), *[getattr(leg, end) for leg in model.legs])) for end in ("base", "platform")
    ]
    found = ca.Function("legs", [symbols], ends).call([values])
    base, platform = (frozen_array(np.array(each).T, (len(model.legs), 3)) for each in found)
    return Legs(base, platform, case.joint_centre_tolerance or 0.0)

"""A robot with its dimensions: a case all of whose parameters are fixed, and its legs as numbers."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray, Model, frozen_array
from ...case.case import Case
from ...case.checks import check_determined_joints
from ...case.pose import Free
from ...case.workspace import Workspace
from ...errors import CaseError, InputError
from ...evidence.dependent import with_dependent

#: Number of legs, as many as the platform has freedoms.
LEGS = 6
#: Part of a tolerance that the errors of a machine within it have, so that rounding leaves none outside.
INSIDE = 1 - 1e-12


class Legs(NamedTuple):
    """Joint centres of a robot's k legs.

    Attributes:
        base: (k, 3) in the world frame, length.
        platform: (k, 3) in the platform frame, length.
        tolerance: largest error of each centre in the machines that are meant, length; 0 for the exact machine.
    """

    base: FloatArray
    platform: FloatArray
    tolerance: float = 0.0

    def spans(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the vectors (k, 3) from the base joints to the platform joints at a pose, in the world frame."""
        return np.asarray(position + self.platform @ rotation.T - self.base)


class JointErrors(NamedTuple):
    """Errors of the joint centres of one machine.

    Attributes:
        names: of the m joint centres; of straight legs that on the base, then that on the platform, leg by leg.
        vectors: (m, 3) in the world frame at home, length; of platform joints of legs in the platform's frame.
    """

    names: tuple[str, ...]
    vectors: FloatArray


def workspace_of_case(case: Case) -> Workspace:
    """Return a case's workspace, with the coordinates that its robot cannot choose.

    Raises:
        CaseError: the case has none, a dimension of its robot is free, limits need a motion that it does not state, or
            the pose does not determine its driven joints; or as :func:`~...evidence.dependent.with_dependent`.
    """
    if case.workspace is None:
        raise CaseError("workspace", "is missing: it states the poses to be judged", source=case.source)
    case.fixed_parameters("a workspace is judged with fixed dimensions")
    case.require_motion()
    check_determined_joints(case.model, "workspace", case.source)
    return with_dependent(case, case.workspace)


def check_leg_error(case: Case, leg_error: float) -> None:
    """Refuse an error of the lengths of legs that is none, or that no claim about the robot has.

    Raises:
        InputError: it is negative or not finite, or is given for a robot that is not six straight legs.
    """
    if not 0 <= leg_error < float("inf"):
        raise InputError(f"--leg-error {leg_error:g}: must be finite and not negative")
    if leg_error and not has_straight_legs(case.model):
        raise InputError(f"--leg-error {leg_error:g}: is for six straight legs, which {case.model.name!r} is not")


def has_straight_legs(model: Model) -> bool:
    """Return whether a robot that is given by its rows is six straight legs and nothing else."""
    return len(model.legs) == LEGS == len(model.wrenches) and not (model.members or model.unknowns or model.structure)


def legs_of(case: Case) -> Legs | None:
    """Return the legs of a robot that is six straight legs, as :func:`joint_centres` does; None for another one."""
    return joint_centres(case) if has_straight_legs(case.model) else None


def joint_centres(case: Case) -> Legs:
    """Return the straight legs, if any, of a robot with fixed dimensions, with the case's tolerance."""
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

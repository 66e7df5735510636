"""Forces and speeds of actuators at a pose, as expressions, for every load case and for the largest platform speeds.

Loads of unknown direction change an actuator force by at most ``a |v| + b |omega|``: a and b are the magnitudes of
force and moment, v and omega the velocities of the loaded point and of the platform at a unit rate of this actuator.
The largest actuator speed is ``linear |g_v| + angular |g_omega|``, from the two parts of the actuator's row of rates.
It is exact for six degrees of freedom and for pure translations; otherwise it is an upper bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import Model
from ...models.parts import Dimension
from ...models.statics import DrivenJoint, Statics, degrees_of_freedom, driven_joints
from .loads import LoadCase, Loading, Motion

#: Smoothing of the norm of a vector at 0: the norm is too large by at most this fraction of a typical norm.
_SMOOTH = 1e-12


class CaseForces(NamedTuple):
    """Forces of the actuators under one load case, as numerators and a common divisor.

    Attributes:
        case: loads that act together.
        wrench: (6, 1) wrench of the loads of fixed direction: force, then moment about the platform origin, in the
            world frame.
        centre: (a, 1) actuator forces that balance this wrench, times the divisor; torques for revolute actuators;
            positive in the sense of the actuator's rate.
        spread: (a, 1) largest change of each actuator force by loads of unknown direction, times the magnitude of the
            divisor.
        divisor: (1, 1) common divisor of the motions of the platform that the actuators drive.
    """

    case: LoadCase
    wrench: SX
    centre: SX
    spread: SX
    divisor: SX

    @property
    def largest(self) -> SX:
        """Largest signed force (a, 1) of each actuator."""
        return self.centre / self.divisor + self.spread / ca.fabs(self.divisor)

    @property
    def smallest(self) -> SX:
        """Smallest signed force (a, 1) of each actuator; negative for a pulling force."""
        return self.centre / self.divisor - self.spread / ca.fabs(self.divisor)

    @property
    def squares(self) -> tuple[SX, ...]:
        """Squares (a, 1) of largest and smallest force of each actuator, in any order; one if both are equal."""
        if self.spread.is_zero():
            return (self.centre**2 / self.divisor**2,)
        return tuple((self.centre + sign * self.spread) ** 2 / self.divisor**2 for sign in (1, -1))


class PosedForces(NamedTuple):
    """Forces and speeds of the actuators at a pose.

    Attributes:
        joints: actuated joints.
        statics: motions of the platform by each actuator.
        cases: forces of the actuators under each load case.
        speeds: (a, 1) largest speeds of the actuators; empty without a motion.
        stiffness: (a, 1) stiffness of each actuator, force per displacement; empty if not known.
        size: (1, 1) characteristic size of the robot, length.
    """

    joints: tuple[DrivenJoint, ...]
    statics: Statics
    cases: tuple[CaseForces, ...]
    speeds: SX
    stiffness: SX
    size: SX

    @property
    def compliance(self) -> SX:
        """Compliance (6, 6): rotation and translation of the platform origin per moment and force of a load."""
        return self.statics.compliance(self.stiffness)

    def displacement(self, case: CaseForces) -> SX:
        """Return the displacement (6, 1) by loads of fixed direction: rotation and translation of the platform origin.

        Args:
            case: forces of the actuators under a load case.
        """
        return -self.statics.motions @ (case.centre / case.divisor / self.stiffness)

    def deflection(self, case: CaseForces) -> SX:
        """Return an upper bound of the translation (1, 1) of the platform origin; exact for loads of fixed direction.

        The bound adds up the largest force changes of all actuators, although a single load direction may not cause
        them at the same time.

        Args:
            case: forces of the actuators under a load case.
        """
        found = _size(self.displacement(case)[3:], self.size)
        if not case.spread.is_zero():
            motions = zip(ca.horzsplit(self.statics.motions), _reaches(self.joints, self.size), strict=True)
            sizes = [_size(each[3:], reach) for each, reach in motions]
            found += ca.dot(ca.vertcat(*sizes), case.spread / ca.fabs(case.divisor) / self.stiffness)
        return found


def forces_at(model: Model, statics: Statics, rotation: SX, loading: Loading, size: SX) -> PosedForces:
    """Return the forces and speeds of a robot's actuators at a pose.

    Args:
        model: the robot.
        statics: motions of the platform at the pose.
        rotation: (3, 3) rotation from platform to world coordinates.
        loading: loads on the platform, and its largest speeds.
        size: (1, 1) characteristic size of the robot, length.
    """
    joints = driven_joints(model)
    cases = tuple(_case_forces(case, statics, rotation, joints, size) for case in loading.cases)
    speeds = SX(0, 1) if loading.motion is None else _speeds(model, statics, loading.motion, joints, size)
    known = [] if loading.stiffness is None else loading.stiffness_of([joint.name for joint in joints])
    return PosedForces(joints, statics, cases, speeds, SX(known) if known else SX(0, 1), size)


def _case_forces(case: LoadCase, statics: Statics, rotation: SX, joints: Sequence[DrivenJoint], size: SX) -> CaseForces:
    """Return the forces under one load case."""
    motions = ca.horzsplit(statics.numerators)
    wrench = case.wrench(rotation)
    centre = ca.vertcat(*[-(ca.dot(wrench[:3], each[3:]) + ca.dot(wrench[3:], each[:3])) for each in motions])
    spread = SX.zeros(len(motions))
    for load, _ in case.parts:
        if load.any_force or load.any_moment:
            arm = rotation @ SX([float(value) for value in load.point])
            spread += ca.vertcat(
                *[
                    load.any_force * _size(each[3:] + ca.cross(each[:3], arm), reach * statics.divisor)
                    + load.any_moment * _size(each[:3], reach / size * statics.divisor)
                    for each, reach in zip(motions, _reaches(joints, size), strict=True)
                ]
            )
    return CaseForces(case, wrench, centre, spread, statics.divisor)


def _reaches(joints: Sequence[DrivenJoint], size: SX) -> list[SX]:
    """Return the typical platform displacement per unit of each actuator: 1 if prismatic, robot size if revolute."""
    return [size if joint.dimension is Dimension.ANGLE else SX(1) for joint in joints]


def _speeds(model: Model, statics: Statics, motion: Motion, joints: Sequence[DrivenJoint], size: SX) -> SX:
    """Return the largest speeds (a, 1) of the actuators."""
    is_legs = degrees_of_freedom(model) == 6 and not model.actuators
    rates = statics.rows if is_legs else statics.rates(SX(motion.length(size)))
    return ca.vertcat(
        *[
            motion.linear * _size(row[3:].T, 1 / reach) + motion.angular * _size(row[:3].T, size / reach)
            for row, reach in zip(ca.vertsplit(rates), _reaches(joints, size), strict=True)
        ]
    )


def _size(vector: SX, typical: SX) -> SX:
    """Return the norm of a vector (3, 1), smooth where it is 0; ``typical`` (1, 1) is a typical norm."""
    return SX(0) if vector.is_zero() else ca.sqrt(ca.sumsqr(vector) + (_SMOOTH * typical) ** 2)


def dimension_of_measure(measure: str, joint: DrivenJoint) -> Dimension:
    """Return the dimension of an actuator's ``actuator_force``, ``actuator_speed`` or ``actuator_power``."""
    if measure == "actuator_power":
        return Dimension.POWER
    return dimension_of_force(joint) if measure == "actuator_force" else dimension_of_speed(joint)


def dimension_of_force(joint: DrivenJoint) -> Dimension:
    """Return the dimension of an actuator's force: torque if revolute, force if prismatic."""
    return Dimension.TORQUE if joint.dimension is Dimension.ANGLE else Dimension.FORCE


def dimension_of_speed(joint: DrivenJoint) -> Dimension:
    """Return the dimension of an actuator's speed: angular if revolute, linear if prismatic."""
    return Dimension.TURN_SPEED if joint.dimension is Dimension.ANGLE else Dimension.SPEED

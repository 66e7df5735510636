"""Forces and speeds of actuators at a pose, as expressions: for every load case, and for the fastest motions.

A load case has one force of an actuator, and a largest change of it by loads of any direction: ``a |v| + b |omega|``
for a force of size a at a point, whose velocity is v in the platform's motion by a unit rate of this actuator alone,
and a moment of size b. The largest rate of an actuator is ``linear |g_v| + angular |g_omega|`` for the two parts of its
row of rates. It is exact where the platform has its rotations and translations independently, as with six freedoms or
with translations alone; else a motion with both at their largest may be none that it can make.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import Model
from ...models.parts import Dimension
from ...models.statics import DrivenJoint, Statics, driven_joints, freedoms_of
from .loads import LoadCase, Loading, Motion

#: Keeps the norm of a vector smooth where it is 0: the norm is too large by at most this part of a typical norm.
_SMOOTH = 1e-12


class CaseForces(NamedTuple):
    """Forces of the actuators under one load case, as quotients.

    Attributes:
        case: the loads.
        wrench: (6, 1) their fixed part: force, then moment about the platform's origin, in the world frame.
        centre: (a, 1) forces that hold it, times the divisor: positive in the sense of the actuator's rate, torques of
            turning actuators.
        spread: (a, 1) largest change of each by loads of any direction, times the size of the divisor.
        divisor: (1, 1) that of the motions.
    """

    case: LoadCase
    wrench: SX
    centre: SX
    spread: SX
    divisor: SX

    @property
    def largest(self) -> SX:
        """Largest force (a, 1) of each actuator."""
        return self.centre / self.divisor + self.spread / ca.fabs(self.divisor)

    @property
    def smallest(self) -> SX:
        """Smallest force (a, 1) of each actuator, negative where it pulls."""
        return self.centre / self.divisor - self.spread / ca.fabs(self.divisor)

    @property
    def squares(self) -> tuple[SX, ...]:
        """Squares (a, 1) of the largest and of the smallest force of each actuator, in any order; one if equal."""
        if self.spread.is_zero():
            return (self.centre**2 / self.divisor**2,)
        return tuple((self.centre + sign * self.spread) ** 2 / self.divisor**2 for sign in (1, -1))


class PosedForces(NamedTuple):
    """Forces and speeds of the actuators at a pose.

    Attributes:
        joints: the actuators.
        statics: motions of the platform by each of them.
        cases: their forces under each load case.
        speeds: (a, 1) their largest speeds; empty without a motion.
        stiffness: (a, 1) force of each by its displacement; empty where it is not known.
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
        """Displacement (6, 6) of the platform, turn and translation of its origin, by moment and force of a load."""
        return self.statics.compliance(self.stiffness)

    def displacement(self, case: CaseForces) -> SX:
        """Return the platform's displacement (6, 1), turn and translation of its origin, by the fixed part of loads."""
        return -self.statics.motions @ (case.centre / case.divisor / self.stiffness)

    def deflection(self, case: CaseForces) -> SX:
        """Return an upper bound of the translation (1, 1) of the platform's origin; exact for loads without any part.

        Changes of the actuators' forces by loads of any direction add up in it, although no one direction may be the
        worst for all.
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
        statics: motions of its platform at the pose.
        rotation: (3, 3) platform to world coordinates.
        loading: loads on its platform, and its motions.
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
    """Return the typical displacement of the platform by a unit of each actuator: 1 for slides, else the size."""
    return [size if joint.dimension is Dimension.ANGLE else SX(1) for joint in joints]


def _speeds(model: Model, statics: Statics, motion: Motion, joints: Sequence[DrivenJoint], size: SX) -> SX:
    """Return the largest speeds (a, 1) of the actuators."""
    is_legs = freedoms_of(model) == 6 and not model.actuators
    rates = statics.rows if is_legs else statics.rates(SX(motion.length(size)))
    return ca.vertcat(
        *[
            motion.linear * _size(row[3:].T, 1 / reach) + motion.angular * _size(row[:3].T, size / reach)
            for row, reach in zip(ca.vertsplit(rates), _reaches(joints, size), strict=True)
        ]
    )


def _size(vector: SX, typical: SX) -> SX:
    """Return the norm of a vector (3, 1), smooth where it is 0; ``typical`` (1, 1) is a norm of its order."""
    return SX(0) if vector.is_zero() else ca.sqrt(ca.sumsqr(vector) + (_SMOOTH * typical) ** 2)


def dimension_of_measure(measure: str, joint: DrivenJoint) -> Dimension:
    """Return the dimension of a number of an actuator: ``actuator_force``, ``actuator_speed`` or ``actuator_power``."""
    if measure == "actuator_power":
        return Dimension.POWER
    return dimension_of_force(joint) if measure == "actuator_force" else dimension_of_speed(joint)


def dimension_of_force(joint: DrivenJoint) -> Dimension:
    """Return the dimension of an actuator's force: a torque where it turns."""
    return Dimension.TORQUE if joint.dimension is Dimension.ANGLE else Dimension.FORCE


def dimension_of_speed(joint: DrivenJoint) -> Dimension:
    """Return the dimension of an actuator's speed."""
    return Dimension.TURN_SPEED if joint.dimension is Dimension.ANGLE else Dimension.SPEED

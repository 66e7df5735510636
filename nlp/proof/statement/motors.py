"""Claims about the actuators of a robot over a workspace: their forces under each load, their speeds and powers."""

from __future__ import annotations

from collections.abc import Iterator

from ....models import Dimension
from ....models.statics import driven_joints
from ...case.case import Case
from ...case.forces import dimension_of_force, dimension_of_speed
from ...case.limits.constraint import Reading
from ...case.limits.forces import ActuatorForce, ActuatorLimit, ActuatorPower, ActuatorSpeed
from ...case.motors import Motor, MotorNumber
from ...case.task import Sense
from .claims import Claim, ClaimKind


def motor_claims(case: Case) -> Iterator[Claim]:
    """Yield the claims about a case's actuators, with its limits: those of an actuator and a load after each other.

    Names are those of the limits' constraints at a pose.
    """
    loading = case.loading
    for k, joint in enumerate(driven_joints(case.model) if loading.loads or loading.motion else ()):
        limits = [each for each in case.limits if isinstance(each, ActuatorLimit)]
        own = {type(each): each for each in limits if each.actuator in ("", joint.name)}
        force, reading = own.get(ActuatorForce), Reading(dimension_of_force(joint))
        low, high = (force.min, force.max) if isinstance(force, ActuatorForce) else (None, None)
        is_size = low is None and high is not None  # a largest force alone is one in both senses
        if loading.motion is not None:
            speed = Motor(MotorNumber.SPEED, k, joint.name)
            yield _claim(speed, "", Sense.MAX, Reading(dimension_of_speed(joint)), own.get(ActuatorSpeed))
        for load in loading.cases:
            motor = Motor(MotorNumber.FORCE, k, joint.name, load.name)
            if is_size and high is not None:
                yield _claim(motor, " backwards", Sense.MIN, reading, force, "max", -high)
            else:
                yield _claim(motor, " smallest", Sense.MIN, reading, force, "min", low)
            yield _claim(motor, "", Sense.MAX, reading, force)
            for senses in ("", " backwards") if loading.motion is not None else ():
                power = Motor(MotorNumber.POWER, k, joint.name, load.name, is_backwards=bool(senses))
                yield _claim(power, senses, Sense.MAX, Reading(Dimension.POWER), own.get(ActuatorPower))


def _claim(
    motor: Motor,
    part: str,
    sense: Sense,
    reading: Reading,
    limit: ActuatorLimit | None,
    end: str = "max",
    value: float | None = None,
) -> Claim:
    """Return the claim about a number of an actuator; its limit is the largest one, if no value is given."""
    if end == "max" and value is None:
        value = getattr(limit, "max", None)
    key = "" if limit is None or value is None else f"{limit.name}.{end}"
    name = f"actuator_{motor.number.value} actuator {motor.actuator}{part}"
    name = f"{name} load {motor.load}" if motor.load else name
    return Claim(name, sense, reading=reading, key=key, limit=value, kind=ClaimKind.MOTOR, motor=motor)

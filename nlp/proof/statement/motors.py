"""Claims about the actuators of a robot over a workspace: forces under each load, speeds and powers."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import replace

import casadi as ca
from casadi import SX

from ....models import Dimension
from ....models.statics import DrivenJoint, driven_joints, statics_hindrance
from ...case.case import Case
from ...case.forces import dimension_of_force, dimension_of_speed
from ...case.limits.constraint import Reading
from ...case.limits.forces import ActuatorForce, ActuatorLimit, ActuatorPower, ActuatorSpeed
from ...case.loads import Motion
from ...case.motors import ActuatorQuantity, Motor
from ...case.task import Sense
from ...program.layout import Layout
from .claims import ACTUATED, Claim, ClaimKind


def motor_claims(case: Case) -> Iterator[Claim]:
    """Yield the claims about a case's actuators with their limits, grouped by actuator and load.

    Names are the same as for constraints at a pose. If one limit applies to all actuators and another limit to a
    single actuator, the tighter limit counts.
    """
    yield from _tightest(_claims(case))


def in_motion(case: Case) -> Case:
    """Return a case with a placeholder motion, so that limits on speeds and powers along a path are claimed.

    The path defines the actual motion.
    """
    return replace(case, loading=case.loading._replace(motion=case.loading.motion or Motion(1.0)))


def actuator_coordinates(layout: Layout) -> dict[str, SX]:
    """Return the known actuator coordinates (1, 1) by name: leg lengths, or displacements from home."""
    model, robot = layout.case.model, layout.robots[0]
    found = {} if model.actuators else {leg.name: ca.norm_2(leg.span) for leg in robot.legs}
    for quantity, values in zip(model.quantities, robot.quantities, strict=True):
        if model.actuators and quantity.name in ACTUATED:
            found |= {owner: values[k] for k, owner in enumerate(quantity.owners)}
    return {each.name: found[each.name] for each in driven_joints(model) if each.name in found}


def in_path_motion(case: Case) -> Case:
    """Return the case with a motion, so that powers along a path are claimed.

    The case is unchanged if its loads do not determine the actuator forces.
    """
    return case if statics_hindrance(case.model) else in_motion(case)


def speed_claims(case: Case) -> Iterator[Claim]:
    """Yield the claims about the speed of each actuator of a case, with its limits; a path defines the motion."""
    for k, joint in enumerate(driven_joints(case.model)):
        yield from _tightest(_speeds(case, k, joint))


def _tightest(claims: Iterable[Claim]) -> Iterator[Claim]:
    """Yield claims; of several claims with the same label, yield only the claim with the tightest limit."""
    found: dict[tuple[str, str], Claim] = {}
    for each in claims:
        known = found.setdefault(each.label, each)
        if each.limit is not None and (known.limit is None or each.sense.sign * (known.limit - each.limit) > 0):
            found[each.label] = each
    yield from found.values()


def _claims(case: Case) -> Iterator[Claim]:
    """Yield the claims about force, speed and power of each actuator: one for each limit, or one without a limit."""
    loading = case.loading
    for k, joint in enumerate(driven_joints(case.model) if loading.loads or loading.motion else ()):
        kinds = ActuatorForce, ActuatorPower
        forces, powers = (_limits(case, kind, joint.name) for kind in kinds)
        reading = Reading(dimension_of_force(joint))
        yield from _speeds(case, k, joint) if loading.motion is not None else ()
        for load in loading.cases:
            motor = Motor(ActuatorQuantity.FORCE, k, joint.name, load.name)
            for limit in forces:
                low, high = (limit.min, limit.max) if isinstance(limit, ActuatorForce) else (None, None)
                if low is None and high is not None:  # a largest force without a smallest one limits both directions
                    yield _claim(motor, " backwards", Sense.MIN, reading, limit, "max", -high)
                else:
                    yield _claim(motor, " smallest", Sense.MIN, reading, limit, "min", low)
                yield _claim(motor, "", Sense.MAX, reading, limit)
            for limit, part in itertools.product(powers if loading.motion is not None else (), ("", " backwards")):
                power = Motor(ActuatorQuantity.POWER, k, joint.name, load.name, is_backwards=bool(part))
                yield _claim(power, part, Sense.MAX, Reading(Dimension.POWER), limit)


def _speeds(case: Case, k: int, joint: DrivenJoint) -> Iterator[Claim]:
    """Yield the claim about the speed of an actuator for each of its limits, or without a limit."""
    for limit in _limits(case, ActuatorSpeed, joint.name):
        motor = Motor(ActuatorQuantity.SPEED, k, joint.name)
        yield _claim(motor, "", Sense.MAX, Reading(dimension_of_speed(joint)), limit)


def _limits(case: Case, kind: type[ActuatorLimit], actuator: str) -> list[ActuatorLimit | None]:
    """Return the limits of a kind that apply to an actuator; the list ``[None]`` if there are none."""
    found: list[ActuatorLimit | None] = []
    found += [each for each in case.limits if isinstance(each, kind) and each.actuator in ("", actuator)]
    return found or [None]


def _claim(
    motor: Motor,
    part: str,
    sense: Sense,
    reading: Reading,
    limit: ActuatorLimit | None,
    end: str = "max",
    value: float | None = None,
) -> Claim:
    """Return the claim about a quantity of an actuator; without a value, the bound of the case's limit is used."""
    if end == "max" and value is None:
        value = getattr(limit, "max", None)
    key = "" if limit is None or value is None else f"{limit.name}.{end}"
    name = f"actuator_{motor.number.value} actuator {motor.actuator}{part}"
    name = f"{name} load {motor.load}" if motor.load else name
    return Claim(name, sense, reading=reading, key=key, limit=value, kind=ClaimKind.MOTOR, motor=motor)

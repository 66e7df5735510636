"""Sentences about the joints of a robot given joint by joint: actuator rates, freedoms, singularities, assembly."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..units import Units, objective_unit, rate_unit
from .motionwording import motion_words, wrench_words
from .rounding import number, robot_size
from .text import Figure, Line, TextTable, Tone

if TYPE_CHECKING:
    from .jointdata import JointsData, SingularityData
    from .parts import RobotData

#: Change of F, as a part of it, from which on a convention is named: F is shown with seven digits.
_NAMED = 1e-6


def joint_lines(robot: RobotData, joints: JointsData, units: Units) -> Iterator[Line]:
    """Yield the rates of the actuators, whether the motion is possible, the freedoms, singularities and assembly."""
    task = robot.task
    if joints.actuators and task is not None:
        largest = max((abs(each.rate) for each in joints.actuators if each.rate is not None), default=1.0)
        # Where the task moves no actuator, all rates are rounding of the platform's velocity.
        reach = robot_size(robot)
        speed = math.hypot(*task.motion.twist[3:]) + reach * math.hypot(*task.motion.twist[:3])
        sizes = {"length": max(largest, speed), "angle": max(largest, speed / reach)}
        kinds = (Dimension.LENGTH, Dimension.ANGLE)
        units_of = {kind.value: rate_unit(task.motion.twist, units, kind) for kind in kinds}
        rates = (
            f"{each.name}: undetermined"
            if each.rate is None
            else f"{each.name}: {number(each.rate, sizes[each.kind], digits=6, signed=True)} {units_of[each.kind]}"
            for each in joints.actuators
        )
        yield Line(", ".join(rates), label="actuator rates")
        idle = [each.name for each in joints.actuators if each.rate is None]
        if idle:
            yield Line(idle_words(idle), label="note")
    if joints.constrained:
        part = number(100 * joints.constrained, 100.0, digits=3)
        words = f"the platform cannot make the task's motion exactly: constraints carry {part} % of F"
        yield Line(words, label="note")
    possible = ", among them the task's motion" if joints.feasible and robot.task_is_free is False else ""
    yield Line(f"{joints.freedoms} with free actuators{possible}", label="freedoms")
    for each in joints.singularities:
        yield from _singularity_lines(each, robot, units)
    for sentence in joints.assembly:
        yield Line(f"assembly: {sentence}", tone=Tone.CAUTION)


def idle_words(names: Sequence[str]) -> str:
    """Return the sentence about actuators whose rates the motion of the platform does not determine."""
    rates, who = ("rates of actuators", "they") if len(names) > 1 else ("rate of actuator", "it")
    words = f"the platform's motion does not determine the {rates} {', '.join(names)}"
    return f"{words}: {who} can move while the platform stands still"


def convention_lines(robot: RobotData) -> Iterator[Line]:
    """Yield remarks where F depends on the characteristic length, or on a centre that the joints do not determine."""
    slope = robot.length_dependence or 0.0
    if abs(slope) > _NAMED:
        words = f"F depends on robot.characteristic_length: 1 % more of it changes F by {slope:+.2g} %"
        yield Line(words, label="note")
    change = None if robot.joints is None else robot.joints.centre_dependence
    if change is not None and change > _NAMED:
        words = (
            "F depends on the place of a limb's centre on the axis of its last passive joint: one characteristic "
            f"length along it changes F by up to {100 * change:.2g} %; the limb's key centre sets it"
        )
        yield Line(words, label="note")


def limb_part_table(case: Case, robot: RobotData) -> TextTable | None:
    """Return F limb by limb, with the parts of actuation and constraints; None where these are not known."""
    parts = None if robot.joints is None else robot.joints.limb_parts
    if not parts or robot.task is None:
        return None
    unit = objective_unit([robot.task.motion.twist], case.units)
    total = sum(each.F for each in parts)
    rows = []
    for each in parts:
        share = 100 * each.constraints / total if total > 0 else 0.0
        cells = (number(each.F, total), number(each.actuation, total), number(each.constraints, total))
        rows.append((each.limb, *cells, Figure(f"{share:.3g}", share)))
    headers = ("limb", f"F\n{unit}", f"actuation\n{unit}", f"constraints\n{unit}", "constraints\n% of F")
    return TextTable(headers, tuple(rows), "actuation", "actuation and constraints by limb")


def _singularity_lines(each: SingularityData, robot: RobotData, units: Units) -> Iterator[Line]:
    """Yield a singularity, then the motions gained, or the wrenches that lock motions."""
    yield Line(f"singular: {each.words}", tone=Tone.CAUTION)
    size = robot_size(robot)
    for motion in each.gained or ():
        yield Line(f"  gained: {motion_words(motion, units, size)}")
    for wrench in each.locking or ():
        yield Line(f"  locked in addition: motions in which work is done by the {wrench_words(wrench, units, size)}")

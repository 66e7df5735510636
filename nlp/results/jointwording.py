"""Sentences about the joints of a robot given joint by joint: actuator rates, freedoms, singularities, assembly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..units import Units, rate_unit
from .rounding import number
from .text import Line, Tone

if TYPE_CHECKING:
    from .jointdata import JointsData
    from .parts import RobotData


def joint_lines(robot: RobotData, joints: JointsData, units: Units) -> Iterator[Line]:
    """Yield the rates of the actuators, whether the motion is possible, the freedoms, singularities and assembly."""
    task = robot.task
    if joints.actuators and task is not None:
        length = rate_unit(task.motion.twist, units)
        angle = f"rad{length.removeprefix(units.length)}"
        largest = max((abs(each.rate) for each in joints.actuators if each.rate is not None), default=1.0)
        rates = (
            f"{each.name}: "
            + (
                "none"
                if each.rate is None
                else f"{number(each.rate, largest, digits=6, signed=True)} {length if each.kind == 'length' else angle}"
            )
            for each in joints.actuators
        )
        yield Line(", ".join(rates), label="actuator rates")
    if joints.constrained:
        part = number(100 * joints.constrained, 100.0, digits=3)
        words = f"the platform cannot make the task's motion exactly: constraints carry {part} % of F"
        yield Line(words, label="note")
    yield Line(f"{joints.freedoms} with free actuators", label="freedoms")
    for sentence in joints.singularities:
        yield Line(f"singular: {sentence}", tone=Tone.CAUTION)
    for sentence in joints.assembly:
        yield Line(f"assembly: {sentence}", tone=Tone.CAUTION)

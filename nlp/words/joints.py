"""Motions and wrenches in words; sentences on actuator rates, degrees of freedom, singularities and assembly modes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..results.rounding import NOISE, robot_size, settled
from ..units import Units, objective_unit, rate_unit
from .numbers import number
from .text import Figure, Line, TextTable, Tone

if TYPE_CHECKING:
    from ..evidence.screwvalues import ScrewMotion, ScrewWrench
    from ..evidence.singularities import Singularity
    from ..results.joints import JointsData
    from ..results.parts import RobotData


def motion_words(motion: ScrewMotion, units: Units, size: float = 0.0, part: float = NOISE) -> str:
    """Return a motion in words: its axis, point and pitch.

    Args:
        motion: motion of the platform.
        units: units of the case.
        size: length to which the rounding errors of the motion's point and pitch are relative.
        part: error bound of the pitch, as a fraction of ``size``.
    """
    if motion.point is None or motion.pitch == "inf":
        return f"translation along {triple(motion.axis, 1.0)}"
    reach = reach_of(motion, size)
    return f"{screw_words(motion, units, reach, part)} through {triple(motion.point, reach)}"


def screw_words(motion: ScrewMotion, units: Units, size: float, part: float = NOISE) -> str:
    """Return kind, pitch and axis of a motion with rotation; for arguments see :func:`motion_words`."""
    pitch = settled(0.0 if motion.pitch == "inf" else motion.pitch, size, part)
    axis = triple(motion.axis, 1.0)
    return f"screw, pitch {pitch:.5g} {units.length}, axis {axis}," if pitch else f"rotation about {axis}"


def reach_of(motion: ScrewMotion, size: float) -> float:
    """Return the length to which rounding errors of a motion's point and pitch are relative: at least |v| / |omega|."""
    omega, v = math.hypot(*motion.twist[:3]), math.hypot(*motion.twist[3:])
    return max(size, v / omega if omega else 0.0)


def triple(values: Sequence[float], size: float) -> str:
    """Return three numbers in parentheses, 0 if they are rounding error relative to a size."""
    return f"({', '.join(number(value, size, digits=4) for value in values)})"


def wrench_words(wrench: ScrewWrench, units: Units, size: float) -> str:
    """Return a wrench in words; for arguments see :func:`motion_words`."""
    if wrench.point is None or wrench.pitch == "inf":
        return f"couple about {triple(wrench.axis, 1.0)}"
    pitch = settled(wrench.pitch, size)
    axis = triple(wrench.axis, 1.0)
    words = f"wrench, pitch {pitch:.5g} {units.length}, axis {axis}," if pitch else f"force along {axis}"
    return f"{words} through {triple(wrench.point, size)}"


#: Smallest relative change of F for which a note names a convention: F is shown with seven digits.
_NAMED = 1e-6


def joint_lines(robot: RobotData, joints: JointsData, units: Units) -> Iterator[Line]:
    """Yield actuator rates, the feasibility of the motion, degrees of freedom, singularities and the assembly mode."""
    task = robot.task
    if joints.actuators and task is not None:
        largest = max((abs(each.rate) for each in joints.actuators if each.rate is not None), default=1.0)
        # Where the task moves no actuator, all rates are rounding errors relative to the platform's velocity.
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
    yield from _unlimited_lines(robot, units)
    if joints.constrained:
        part = number(100 * joints.constrained, 100.0, digits=3)
        words = f"the platform cannot follow this motion exactly; {part} % of F is constraint wrenches, not actuation"
        yield Line(words, label="note")
    possible = ", including the task's motion" if joints.feasible and robot.task_is_free is False else ""
    yield Line(f"{joints.freedoms} with unlocked actuators{possible}", label="degrees of freedom")
    for each in joints.singularities:
        yield from _singularity_lines(each, robot, units)
    for sentence in joints.assembly:
        yield Line(f"assembly mode: {sentence}", tone=Tone.CAUTION)


def _unlimited_lines(robot: RobotData, units: Units) -> Iterator[Line]:
    """Yield the ranges of free actuator coordinates that the case does not limit."""
    groups: dict[tuple[float, float, str, str], list[str]] = {}
    for each in robot.free_joints or ():
        none = "no limits" if not (each.lower_is_limit or each.upper_is_limit) else "no upper limit"
        none = "no lower limit" if each.upper_is_limit else none
        if not (each.lower_is_limit and each.upper_is_limit):
            joints = groups.setdefault((each.lower, each.upper, each.kind, none), [])
            joints += [] if each.joint in joints else [each.joint]
    for (lower, upper, kind, none), names in groups.items():
        unit = units.label(Dimension(kind))
        who, have = ("joints", "have") if len(names) > 1 else ("joint", "has")
        searched = f"solve searches from {lower:.6g} to {upper:.6g} {unit}"
        yield Line(f"{who} {', '.join(names)} {have} {none}: {searched}; set limits in [limits.joint]", label="note")


def idle_words(names: Sequence[str]) -> str:
    """Return the sentence about actuators whose rates the motion of the platform does not determine."""
    rates, who = ("rates of actuators", "they") if len(names) > 1 else ("rate of actuator", "it")
    words = f"the platform's motion does not determine the {rates} {', '.join(names)}"
    return f"{words}: {who} can move while the platform stands still"


def convention_lines(robot: RobotData) -> Iterator[Line]:
    """Yield notes if F depends on the characteristic length, or on a limb centre that the joints do not determine."""
    slope = robot.length_dependence or 0.0
    if abs(slope) > _NAMED:
        words = f"F depends on robot.characteristic_length: 1 % more length changes F by {slope:+.2g} %"
        yield Line(words, label="note")
    change = None if robot.joints is None else robot.joints.centre_dependence
    if change is not None and change > _NAMED:
        words = (
            "F depends on where a limb's centre lies on the axis of its last passive joint: a shift by one "
            f"characteristic length changes F by up to {100 * change:.2g} %; set the centre by the limb's key centre"
        )
        yield Line(words, label="note")


def limb_part_table(case: Case, robot: RobotData) -> TextTable | None:
    """Return F by limb, split into actuation and constraint wrenches; None if the split is not known."""
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
    headers = (
        "limb",
        f"F\n{unit}",
        f"actuation\n{unit}",
        f"constraint wrenches\n{unit}",
        "constraint wrenches\n% of F",
    )
    return TextTable(headers, tuple(rows), "actuation", "F by limb: actuation and constraint wrenches")


def _singularity_lines(each: Singularity, robot: RobotData, units: Units) -> Iterator[Line]:
    """Yield a singularity, then the gained motions, or the wrenches that lock motions."""
    yield Line(f"singular: {each.words}", tone=Tone.CAUTION)
    size = robot_size(robot)
    for motion in each.gained or ():
        yield Line(f"  gained motion: {motion_words(motion, units, size)}")
    for wrench in each.locking or ():
        yield Line(f"  lost: every motion on which this wrench does work: {wrench_words(wrench, units, size)}")

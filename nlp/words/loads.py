"""Tables of actuator forces, powers and speeds, and of the constraint wrenches under loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..results.rounding import robot_size
from .numbers import number
from .text import TextTable

if TYPE_CHECKING:
    from ..evidence.loads import HeldLoad, TopSpeed
    from ..results.parts import RobotData


def loading_tables(case: Case, robot: RobotData) -> Iterator[TextTable]:
    """Yield actuator forces and powers, constraint wrenches, displacements, and actuator speeds."""
    data = robot.loading
    if data is None:
        return
    if data.loads is not None:
        yield _force_table(case, data.loads)
        yield from _constraint_table(case, data.loads, robot_size(robot))
        yield from _deflection_table(case, data.loads, robot_size(robot))
    if data.speeds is not None:
        size = max((each.value or 0.0 for each in data.speeds), default=0.0)
        rows = [(*_pose(each), each.actuator, _text(each.value, size), each.unit) for each in data.speeds]
        yield TextTable((*_pose_header(data.speeds), "actuator", "needed speed", "unit"), tuple(rows), "speeds")


def _force_table(case: Case, loads: Sequence[HeldLoad]) -> TextTable:
    """Return the force of every actuator under every load."""
    every = [row for load in loads for row in load.actuators]
    size = max((abs(row.value or 0.0) for row in every), default=0.0)
    has_range = any(row.smallest != row.largest for row in every)
    has_power = any(row.power is not None for row in every)
    rows = []
    for load in loads:
        for row in load.actuators:
            forces = (row.smallest, row.largest) if has_range else (row.value,)
            cells = [*(_text(force, size, signed=True) for force in forces), row.unit]
            cells += [_text(row.power)] if has_power else []
            rows.append((*_pose(load), load.name, row.actuator, *cells))
    columns = ["smallest force", "largest force"] if has_range else ["force"]
    power = [f"power\n{case.units.label(Dimension.POWER)}"] if has_power else []
    headers = (*_pose_header(loads), "load", "actuator", *columns, "unit", *power)
    return TextTable(headers, tuple(rows), "forces")


def _constraint_table(case: Case, loads: Sequence[HeldLoad], length: float) -> Iterator[TextTable]:
    """Yield a table of the constraint wrenches of the limbs under loads, if statics determines at least one of them.

    Constraint wrenches balance the part of a load that actuator forces do not balance. A force within the rounding
    error of the load is shown as 0, and so is a moment within the rounding error of the load times the robot's
    ``length``.
    """
    rows = []
    for load in loads:
        held = [(each.limb, each.wrench) for each in load.constraints or () if each.wrench is not None]
        wrenches = [load.wrench, *(wrench for _, wrench in held)]
        force = max(abs(part) for wrench in wrenches for part in wrench[:3])
        moment = max(length * force, *(abs(part) for wrench in wrenches for part in wrench[3:]))
        for limb, wrench in held:
            cells = [number(part, force, digits=6, signed=True) for part in wrench[:3]]
            cells += [number(part, moment, digits=6, signed=True) for part in wrench[3:]]
            rows.append((*_pose(load), load.name, limb, *cells))
    if rows:
        parts = [f"f_{axis}\n{case.units.label(Dimension.FORCE)}" for axis in "xyz"]
        parts += [f"m_{axis}\n{case.units.label(Dimension.TORQUE)}" for axis in "xyz"]
        headers = (*_pose_header(loads), "load", "limb", *parts)
        yield TextTable(headers, tuple(rows), "constraints", "constraint wrenches of the limbs on the platform")


def _deflection_table(case: Case, loads: Sequence[HeldLoad], length: float) -> Iterator[TextTable]:
    """Yield a table of the platform's displacements under every load, if the actuators' stiffness is known.

    A value is shown as 0 within the rounding error of the translation, or of the rotation times the robot's ``length``,
    whichever is larger.
    """
    rows = []
    for load in loads:
        if load.deflection is None:
            continue
        found, none = load.deflection, ("none",) * 3
        way, turn = (max(map(abs, part or ()), default=0.0) for part in (found.translation, found.rotation))
        of_turn = length * case.units.to_internal(
            1.0, Dimension.ANGLE
        )  # displacement at this arm by a rotation of 1 in the case's unit
        sizes = (max(way, turn * of_turn), max(turn, way / of_turn))
        parts = [
            none if part is None else tuple(number(each, size, digits=5, signed=True) for each in part)
            for part, size in zip((found.translation, found.rotation), sizes, strict=True)
        ]
        rows.append((*_pose(load), load.name, *parts[0], _text(found.largest), *parts[1]))
    if rows:
        names = [f"{name}\n{case.units.label(Dimension.LENGTH)}" for name in ("x", "y", "z", "largest")]
        names += [f"about {name}\n{case.units.label(Dimension.ANGLE)}" for name in "xyz"]
        title = "displacement of the platform by actuator compliance"
        yield TextTable((*_pose_header(loads), "load", *names), tuple(rows), "deflections", title)


def _text(value: float | None, size: float = 0.0, *, signed: bool = False) -> str:
    return "none" if value is None else number(value, size, digits=6, signed=signed)


def _pose(row: HeldLoad | TopSpeed) -> tuple[str, ...]:
    return () if row.pose is None else (str(row.pose),)


def _pose_header(rows: Sequence[HeldLoad | TopSpeed]) -> tuple[str, ...]:
    return ("pose",) if any(row.pose is not None for row in rows) else ()

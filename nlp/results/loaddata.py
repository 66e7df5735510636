"""Loads, and forces, speeds and powers of actuators, as data and as a table of text."""

from collections.abc import Iterator, Sequence

from ...models import Dimension, FloatArray
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.forces import dimension_of_force, dimension_of_speed
from ..evidence.loads import LoadState, loads_at
from ..evidence.state import RobotState, evaluate
from ..program.nlp import Nlp
from .jsondata import Absent, JsonObject, Vector6, finite_or_none, vector
from .rounding import number
from .text import TextTable


class ActuatorForceData(JsonObject):
    """Force of an actuator under a load, or torque of one that turns; null at a singular pose.

    Attributes:
        actuator: its name.
        value: the force of the largest size, positive in the sense of the actuator's rate.
        smallest: smallest force where the load is of any direction; the same value for others.
        largest: largest force.
        unit: of these numbers.
        power: largest size of the force times the largest speed; absent without motions.
    """

    actuator: str
    value: float | None
    smallest: float | None
    largest: float | None
    unit: str
    power: Absent[float]


class ConstraintWrenchData(JsonObject):
    """Wrench by which the constraints of a limb hold a load.

    Attributes:
        limb: its name.
        wrench: on the platform, force, then moment about the world origin; null where statics does not determine it,
            because limbs can load each other.
    """

    limb: str
    wrench: Vector6 | None


class LoadData(JsonObject):
    """A load and what holds it.

    Attributes:
        name: of the load.
        pose: number of the pose, from 1 on; absent where there is one.
        wrench: force, then moment about the world origin, without its part of any direction.
        actuators: forces of the actuators.
        constraints: wrenches of the limbs' constraints; absent for a robot without any.
    """

    name: str
    pose: Absent[int]
    wrench: Vector6
    actuators: tuple[ActuatorForceData, ...]
    constraints: Absent[tuple[ConstraintWrenchData, ...]]


class ActuatorSpeedData(JsonObject):
    """Largest speed of an actuator in the platform's fastest motions; null at a singular pose.

    Attributes:
        actuator: its name.
        pose: number of the pose, from 1 on; absent where there is one.
        value: the speed.
        unit: of the speed.
    """

    actuator: str
    pose: Absent[int]
    value: float | None
    unit: str


class LoadingData(JsonObject):
    """Forces and speeds of actuators at every pose.

    Attributes:
        loads: every load at every pose; absent without loads.
        speeds: every actuator at every pose; absent without motions.
    """

    loads: Absent[tuple[LoadData, ...]]
    speeds: Absent[tuple[ActuatorSpeedData, ...]]


def loading_data(nlp: Nlp, x: FloatArray, state: RobotState) -> LoadingData | None:
    """Return forces and speeds of the actuators at a point; None for a case without loads and motions.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there, at the first pose.
    """
    case = nlp.case
    if not (case.loading.loads or case.loading.motion):
        return None
    loads: list[LoadData] = []
    speeds: list[ActuatorSpeedData] = []
    joints = driven_joints(case.model)
    for k in range(len(nlp.program.robots)):
        found = loads_at(nlp, x, evaluate(nlp, x, k) if k else state, k)
        pose = k + 1 if len(nlp.program.robots) > 1 else None
        loads += [_load(case, each, found.speeds, pose) for each in found.loads]
        for joint, speed in zip(joints, found.speeds.tolist(), strict=False):
            dimension = dimension_of_speed(joint)
            shown = case.units.shown(speed, dimension)
            unit = case.units.label(dimension)
            speeds.append(ActuatorSpeedData(actuator=joint.name, pose=pose, value=finite_or_none(shown), unit=unit))
    return LoadingData(loads=tuple(loads) or None, speeds=tuple(speeds) or None)


def _load(case: Case, load: LoadState, speeds: FloatArray, pose: int | None) -> LoadData:
    """Return a load at a pose."""
    actuators = []
    for k, joint in enumerate(driven_joints(case.model)):
        low, high = float(load.smallest[k]), float(load.largest[k])
        actuators.append(
            ActuatorForceData(
                actuator=joint.name,
                value=finite_or_none(high if abs(high) >= abs(low) else low),
                smallest=finite_or_none(low),
                largest=finite_or_none(high),
                unit=case.units.label(dimension_of_force(joint)),
                power=finite_or_none(max(abs(low), abs(high)) * float(speeds[k])) if len(speeds) else None,
            )
        )
    held = tuple(
        ConstraintWrenchData(limb=limb, wrench=None if wrench is None else vector(wrench))
        for limb, wrench in load.constraints.items()
    )
    return LoadData(
        name=load.name, pose=pose, wrench=vector(load.wrench), actuators=tuple(actuators), constraints=held or None
    )


def loading_tables(case: Case, data: LoadingData | None) -> Iterator[TextTable]:
    """Yield the forces and powers of the actuators, the wrenches of constraints, and the speeds of the actuators."""
    if data is None:
        return
    if data.loads is not None:
        yield _force_table(case, data.loads)
        yield from _constraint_table(case, data.loads)
    if data.speeds is not None:
        size = max((each.value or 0.0 for each in data.speeds), default=0.0)
        rows = [(*_pose(each), each.actuator, _text(each.value, size), each.unit) for each in data.speeds]
        yield TextTable((*_pose_header(data.speeds), "actuator", "speed", "unit"), tuple(rows), "speeds")


def _force_table(case: Case, loads: Sequence[LoadData]) -> TextTable:
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


def _constraint_table(case: Case, loads: Sequence[LoadData]) -> Iterator[TextTable]:
    """Yield the wrenches by which the constraints of limbs hold the loads, where statics determines one of them."""
    rows = []
    for load in loads:
        held = [(each.limb, each.wrench) for each in load.constraints or () if each.wrench is not None]
        force = max((abs(part) for _, wrench in held for part in wrench[:3]), default=0.0)
        moment = max((abs(part) for _, wrench in held for part in wrench[3:]), default=0.0)
        for limb, wrench in held:
            cells = [number(part, force, digits=6, signed=True) for part in wrench[:3]]
            cells += [number(part, moment, digits=6, signed=True) for part in wrench[3:]]
            rows.append((*_pose(load), load.name, limb, *cells))
    if rows:
        parts = [f"f_{axis}\n{case.units.label(Dimension.FORCE)}" for axis in "xyz"]
        parts += [f"m_{axis}\n{case.units.label(Dimension.TORQUE)}" for axis in "xyz"]
        headers = (*_pose_header(loads), "load", "limb", *parts)
        yield TextTable(headers, tuple(rows), "constraints", "wrenches of the limbs' constraints on the platform")


def _text(value: float | None, size: float = 0.0, *, signed: bool = False) -> str:
    return "none" if value is None else number(value, size, digits=6, signed=signed)


def _pose(row: LoadData | ActuatorSpeedData) -> tuple[str, ...]:
    return () if row.pose is None else (str(row.pose),)


def _pose_header(rows: Sequence[LoadData | ActuatorSpeedData]) -> tuple[str, ...]:
    return ("pose",) if any(row.pose is not None for row in rows) else ()

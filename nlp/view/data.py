"""Data of a live page from a case: sliders, limits, loads, and the arrays of the module, in the case's units.

Values inside the module are in the units of computations, with angles in radians; ``factor`` converts them to the
case's units.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypedDict

import numpy as np

from ...models import Dimension, FloatArray, Parameter
from ...models.instance import length_of
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.excursions import in_world
from ..case.forces import dimension_of_force, dimension_of_speed
from ..case.pose import OverPoses, ends_of
from ..case.workspace import POSITION, TurnKind
from ..embedding.runtimelimits import run_time_limits
from ..program.nlp import Nlp
from ..program.places import FreeRotation, Place
from ..results.objective import unit_of_objective
from ..units import Units, rate_unit
from .functions import ViewFunctions
from .source import ViewSource

#: Range of the slider of a fixed value: part of the value, part of the robot's size, and angle.
_PART, _WAY, _TURN = 0.5, 0.25, math.radians(45)


class ArrayData(TypedDict):
    """Array of the module: number for its address, and its length."""

    name: str
    size: int


class SliderData(TypedDict):
    """Value with a slider; ``set`` is its name for ``--set``, empty for a component of a rotation.

    ``pose`` is the index of its stated pose, -1 for a dimension.

    ``vector`` and ``index`` are its place among the variables ``x`` or the fixed parameters ``p``. For ``turn``, the
    variable is the sine of half the shown angle.
    """

    name: str
    set: str
    group: str
    unit: str
    factor: float
    vector: str
    index: int
    low: float
    high: float
    start: float
    turn: bool
    pose: int


class ConeData(TypedDict):
    """Cones of the passive joints of a plate: number of joints, key of the half angle among the limits, and its value.

    The value is in radians, as the half angle of the case.
    """

    count: int
    key: str
    angle: float


class TravelData(TypedDict):
    """Poses of a workspace: index of the slider and ends of each coordinate, in the units of computations.

    For a rotation by a free axis, ``turn`` is its largest angle, 0 without one. ``notice`` names what is left out.
    """

    coordinates: list[tuple[int, float, float]]
    turn: float
    notice: str


class RotationData(TypedDict):
    """Rotation with a free axis: prefix of its names, and indices of the vector part of its quaternion."""

    prefix: str
    q: list[int]


class LimitData(TypedDict):
    """Limit that can be set: key below ``limits``, unit, value, and allowed values."""

    key: str
    unit: str
    factor: float
    value: float
    above: float | None
    most: float | None


class RowData(TypedDict):
    """Value of a limit: name, keys of both sides, indices of reading and constraint (-1 for none), bounds and unit."""

    name: str
    keys: list[str]
    reading: int
    constraint: int
    low: float | None
    high: float | None
    unit: str
    factor: float


class TaskData(TypedDict):
    """Task: name, sense, first index of its twist in ``p``, index of its weight (-1 for none), units of rates and F."""

    name: str
    sense: str
    twist: int
    weight: int
    unit: str
    F_unit: str


class ActuatorData(TypedDict):
    """Actuator: name, limb, units of its force and of its speed, and factor of the speed."""

    name: str
    limb: str
    force: str
    speed: str
    factor: float


class QuantityData(TypedDict):
    """Quantity of the robot: name, owners, unit and factor."""

    name: str
    owners: list[str]
    unit: str
    factor: float


class ViewData(TypedDict):
    """Everything that a live page needs besides its module and its drawing.

    ``is_mean`` says whether F of a task is the mean over its poses, instead of the sum. ``stated_poses`` has the index
    of the stated pose of each pose. ``pose_tasks`` has the index of its task if the
    dimensions or the pose change from task to task, and is empty otherwise.
    """

    arrays: list[ArrayData]
    blocks: Mapping[str, tuple[int, int]]
    sliders: list[SliderData]
    rotations: list[RotationData]
    inner: list[int]
    is_following: bool
    notice: str
    limits: list[LimitData]
    rows: list[RowData]
    tasks: list[TaskData]
    loads: list[str]
    actuators: list[ActuatorData]
    quantities: list[QuantityData]
    units: Mapping[str, str]
    F_unit: str
    sense: str
    poses: int
    is_mean: bool
    stated_poses: list[int]
    pose_tasks: list[int]
    limbs: list[str]
    row_limbs: list[str]
    seeds: int
    has_slopes: bool
    level: int
    turn_axes: list[list[float]]
    cones: list[ConeData]
    travel: TravelData | None
    checksum: str


def view_data(source: ViewSource) -> ViewData:
    """Return the data of the live page of a case."""
    nlp, functions = source.subject.nlp, source.functions
    case, program, units = nlp.case, nlp.program, nlp.case.units
    loading = "largest" in functions.blocks
    weights = program.places.weights or [-1] * len(case.tasks)
    twists = [each.start for each in program.places.twists]
    return {
        "arrays": arrays_of(nlp, functions),
        "blocks": functions.blocks,
        "sliders": [*_sliders(nlp)],
        "rotations": _rotations(nlp),
        "inner": _following(nlp),
        "is_following": bool(functions.followers),
        "notice": case.stated_pose_notice if case.limits_over else "",
        "limits": _limits(nlp),
        "rows": _rows(nlp, functions, units),
        "tasks": [
            {
                "name": task.name,
                "sense": task.sense.value,
                "twist": twist,
                "weight": int(weight),
                "unit": rate_unit(np.ravel(task.twist).tolist(), units) if task.is_stated else "",
                "F_unit": unit_of_objective(case, k),
            }
            for k, (task, twist, weight) in enumerate(zip(case.tasks, twists, weights, strict=False))
        ],
        "loads": [each.name for each in case.loading.cases] if loading else [],
        "actuators": _actuators(case),
        "quantities": [
            {
                "name": each.name,
                "owners": list(each.owners),
                "unit": units.label(each.dimension),
                "factor": units.shown(1.0, each.dimension),
            }
            for each in case.model.quantities
        ],
        "units": {"length": units.length, "angle": units.angle, "force": units.force},
        "F_unit": unit_of_objective(case, 0) if len(case.tasks) == 1 else unit_of_objective(case),
        "sense": nlp.sense.value,
        "poses": len(program.robots),
        "is_mean": case.over_poses is OverPoses.MEAN,
        "stated_poses": [each.pose for each in case.stations],
        "pose_tasks": list(program.places.tasks),
        "limbs": list(case.model.limbs),
        "row_limbs": [row.limb for row in case.model.frame_rows],
        "seeds": 16,
        "has_slopes": functions.slopes is not None,
        "level": -1 if program.places.epigraph is None else program.places.epigraph.level,
        "turn_axes": [
            np.ravel(pose.rotation.axis).tolist() if pose.rotation.axis is not None else [] for pose in case.poses
        ],
        "cones": [
            {"count": len(case.model.legs), "key": f"{each.key}.max", "angle": each.max} for each in functions.cones
        ],
        "travel": _travel(nlp),
        "checksum": source.checksum,
    }


def arrays_of(nlp: Nlp, functions: ViewFunctions) -> list[ArrayData]:
    """Return the arrays of the module in the order of ``place`` in ``view.c.in``."""
    n, p, c = nlp.n, len(nlp.program.arguments), len(nlp.program.constraints)
    limits = len(run_time_limits(nlp, "view").limits)
    readings, view = len(functions.readings.known), functions.view.numel_out(0)
    sizes = {"p": p, "x": n, "lower": n, "upper": n, "limits": limits, "F": 1, "gradient": n, "slopes": p, "g": c}
    sizes |= {"readings": readings, "view": view, "singular_values": 6, "solution": n, "solution_F": 1, "violation": 1}
    sizes |= {"residual": 1, "lower_multipliers": n, "upper_multipliers": n, "limit_multipliers": limits}
    sizes |= {"g_lower": c, "g_upper": c, "twist": 7, "case_lower": n, "case_upper": n}
    return [{"name": name, "size": size} for name, size in sizes.items()]


def _sliders(nlp: Nlp) -> Iterator[SliderData]:
    """Yield the sliders of dimensions and poses."""
    case, places = nlp.case, nlp.program.places
    parameters = [each.parameter for each in _dimensions(case)]
    size = length_of(case.model, _parameter_values(nlp))
    for k, ((name, dimension), place) in enumerate(zip(case.scalars.items(), places.numbers, strict=True)):
        parameter = parameters[k] if k < len(parameters) else None
        low, high, start = _range(nlp, place, dimension, size, parameter)
        factor = case.units.shown(1.0, dimension)
        yield {
            "name": name,
            "set": name,
            "group": "dimension" if parameter is not None else "pose",
            "unit": case.units.label(dimension),
            "factor": factor,
            "vector": place.vector,
            "index": place.index,
            "low": low,
            "high": high,
            "start": start,
            "turn": False,
            "pose": -1 if parameter is not None else _stated_pose(case, name),
        }
    for rotation, prefix in zip(places.rotations, case.pose_prefixes, strict=True):
        if not isinstance(rotation, FreeRotation):
            continue
        for index, letter in zip(rotation.q, "xyz", strict=True):
            yield {
                "name": f"{prefix}turn_{letter}",
                "set": "",
                "group": "pose",
                "unit": case.units.angle,
                "factor": case.units.shown(1.0, Dimension.ANGLE),
                "vector": "x",
                "index": index,
                "low": float(nlp.lower[index]),
                "high": float(nlp.upper[index]),
                "start": float(nlp.start[index]),
                "turn": True,
                "pose": _stated_pose(case, f"{prefix}turn"),
            }


def _stated_pose(case: Case, name: str) -> int:
    """Return the index of the stated pose of a coordinate by its name."""
    prefixes = case.pose_prefixes
    return next(k for k, prefix in enumerate(prefixes) if len(prefixes) == 1 or name.startswith(prefix))


class _Dimension(NamedTuple):
    """Component of a parameter, with the index of its task if it changes from task to task."""

    parameter: Parameter
    task: int | None


def _dimensions(case: Case) -> Iterator[_Dimension]:
    """Yield the components of the robot's parameters in the order of a program's numbers."""
    own = case.dimensions_per_task
    for item in case.model.parameters:
        for key in item.components:
            for task in range(len(case.tasks)) if key in own else (None,):
                yield _Dimension(item, task)


def _parameter_values(nlp: Nlp) -> list[float]:
    """Return the values of the robot's parameters at the start; those of the first task if they change with it."""
    vectors: Mapping[str, FloatArray] = {"x": nlp.start, "p": nlp.arguments}
    dimensions = [*_dimensions(nlp.case)]
    named = zip(dimensions, nlp.program.places.numbers[: len(dimensions)], strict=True)
    return [float(vectors[place.vector][place.index]) for each, place in named if each.task in (None, 0)]


def _range(
    nlp: Nlp, place: Place, dimension: Dimension, size: float, parameter: Parameter | None
) -> tuple[float, float, float]:
    """Return the ends of a slider and its start; a fixed value has a range about it."""
    if place.vector == "x":
        return float(nlp.lower[place.index]), float(nlp.upper[place.index]), float(nlp.start[place.index])
    value = float(nlp.arguments[place.index])
    if dimension is Dimension.ANGLE:
        half = _TURN
    elif dimension is Dimension.NUMBER:
        half = max(1.0, abs(value))
    elif parameter is not None and value:
        half = _PART * abs(value)
    else:
        half = _WAY * size
    return value - half, value + half, value


def _following(nlp: Nlp) -> list[int]:
    """Return the indices in ``x`` of joint coordinates from closed loops, and of the level of a worst case."""
    epigraph = nlp.program.places.epigraph
    return sorted([*nlp.program.places.inner, *([] if epigraph is None else [epigraph.level])])


def _rotations(nlp: Nlp) -> list[RotationData]:
    """Return the rotations with a free axis."""
    named = zip(nlp.program.places.rotations, nlp.case.pose_prefixes, strict=True)
    return [{"prefix": prefix, "q": list(each.q)} for each, prefix in named if isinstance(each, FreeRotation)]


def _travel(nlp: Nlp) -> TravelData | None:
    """Return the poses of the workspace of a case with one pose; None without a workspace or several poses."""
    case = nlp.case
    workspace = case.workspace
    if workspace is None or len(nlp.program.robots) > 1:
        return None
    workspace = in_world(workspace, case.poses[0])
    names, prefix = [each["set"] for each in _sliders(nlp)], case.pose_prefixes[0]
    found: list[tuple[int, float, float]] = []
    for letter, value in zip(POSITION, workspace.position, strict=True):
        if (name := f"{prefix}p_{letter}") in names:
            found.append((names.index(name), *ends_of(value)))
    turns, rotation = workspace.turns, nlp.program.places.rotations[0]
    low, high = ends_of(turns.angles[0])
    turn, notice = 0.0, ""
    if isinstance(rotation, FreeRotation) and turns.kind is TurnKind.ANY_AXIS:
        turn = high
    elif turns.kind is TurnKind.AXIS and f"{prefix}angle" in names and _has_axis(case, turns.axis):
        found.append((names.index(f"{prefix}angle"), low, high))
    elif any(ends_of(each) != (0.0, 0.0) for each in turns.angles):
        notice = "without the rotations of the workspace"
    if workspace.position_set is not None:
        notice = ", ".join(["over the box about its set of positions", *([notice] if notice else [])])
    return {"coordinates": found, "turn": turn, "notice": notice}


def _has_axis(case: Case, axis: Sequence[float]) -> bool:
    """Return whether the stated pose of a case turns about an axis."""
    own = case.poses[0].rotation.axis
    return own is not None and bool(np.allclose(np.ravel(own), axis, rtol=0, atol=1e-12))


def _limits(nlp: Nlp) -> list[LimitData]:
    """Return the limits that can be set in the module, in its order."""
    units = nlp.case.units
    return [
        {
            "key": each.key,
            "value": each.default,
            "above": _finite(each.above),
            "most": _finite(each.most),
            "unit": units.label(each.dimension),
            "factor": units.shown(1.0, each.dimension),
        }
        for each in run_time_limits(nlp, "view").limits
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _rows(nlp: Nlp, functions: ViewFunctions, units: Units) -> list[RowData]:
    """Return the values of limits."""
    readings, places = functions.readings, {id(each): k for k, each in enumerate(nlp.program.constraints)}
    found: list[RowData] = []
    for k, each in enumerate(readings.rows):
        reading = each.constraint.reading
        low, high = (float(reading.from_value(end)) if math.isfinite(end) else None for end in (each.lower, each.upper))
        found.append(
            {
                "name": each.constraint.name,
                "keys": list(each.constraint.keys),
                "reading": readings.known.index(k) if k in readings.known else -1,
                "constraint": places.get(id(each.constraint), -1),
                "low": low,
                "high": high,
                "unit": units.label(reading.dimension),
                "factor": units.shown(1.0, reading.dimension),
            }
        )
    return found


def _actuators(case: Case) -> list[ActuatorData]:
    """Return the actuators."""
    return [
        {
            "name": joint.name,
            "limb": joint.limb,
            "force": case.units.label(dimension_of_force(joint)),
            "speed": case.units.label(dimension_of_speed(joint)),
            "factor": case.units.shown(1.0, dimension_of_speed(joint)),
        }
        for joint in driven_joints(case.model)
    ]

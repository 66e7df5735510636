"""Robots of a comparison: reading, size, scaling, and placement in a case.

A robot is a name, a robot file, or a model. Its size is the largest distance between two of its points. In a case it is
scaled, has its home at the case's pose, and variable dimensions. Tasks, poses, workspace and limits are those of the
case, in a frame of the robot that is shifted without rotation, so that home is the starting value of the first pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, Displacement, FloatArray, Model, Parameter, Substitution, frozen_array, model_names
from ..case.case import Case
from ..case.limits.limit import Limit
from ..case.limits.limits import Limits
from ..case.pose import Free, Pose, Value
from ..case.robotfile import model_of_definition, read_definition
from ..case.robots import build_model
from ..case.settings import Expectation
from ..case.source import shipped_cases
from ..case.task import Task
from ..errors import CaseError, InputError, nearest
from ..evidence.kkt import close_equations
from ..evidence.state import evaluate
from ..program.formulation import formulate
from ..program.nlp import Nlp

#: Word for the robot of the case, which is compared unchanged.
OWN = "case"


@dataclass(frozen=True, eq=False)
class Contender:
    """Robot of a comparison.

    Attributes:
        label: name of the robot, or of its file, in tables.
        model: model of the robot; for ``case``, the model of the case.
        is_of_case: True for the unchanged robot of the case.
        file: robot file; None for a robot by name.
    """

    label: str
    model: Model
    is_of_case: bool = False
    file: Path | None = None


def read_robots(robots: Sequence[str | Path | Model], case: Case) -> list[Contender]:
    """Return the robots of a comparison.

    Args:
        robots: names of robots, paths of robot files, models, or the word ``case`` for the robot of the case.
        case: case of the comparison.

    Raises:
        InputError: there are fewer than two robots, a robot is unknown or given twice, or a robot file has an error.
    """
    if len(robots) < 2:
        raise InputError(f"compare: needs at least two robots, got {len(robots)}")
    found: list[Contender] = []
    for each in robots:
        contender = _read(each, case)
        for other in found:
            if contender.model is other.model or _is_same_file(contender, other):
                raise InputError(f"compare: {each if isinstance(each, str) else contender.label} is given twice")
            if contender.label == other.label:
                fault = "two robots have this name in tables; rename a file"
                raise InputError(f"compare: {contender.label}: {fault}")
        found.append(contender)
    return found


def _read(given: str | Path | Model, case: Case) -> Contender:
    """Return one robot; errors as for :func:`read_robots`."""
    if isinstance(given, Model):
        return Contender(given.name, given)
    text = str(given)
    if text == OWN:
        return Contender(OWN, case.model, is_of_case=True)
    names = model_names()
    if text in names:
        return Contender(text, build_model(text))
    path = Path(text)
    if path.is_file():
        try:
            return Contender(path.stem, model_of_definition(read_definition(text, Path()), text), file=path.resolve())
        except CaseError as error:
            raise (error if error.source else error.within(text)) from None
    if text.endswith(".toml"):
        raise InputError(f"compare: {text}: no such robot file")
    hint = "this is a case" if text in shipped_cases() else nearest(text, [*names, OWN])
    raise InputError(f"compare: {text or 'an empty name'}: no such robot, and no such robot file; {hint}")


def _is_same_file(one: Contender, other: Contender) -> bool:
    return one.file is not None and one.file == other.file


def size_of_home(model: Model) -> float:
    """Return the size of a robot at home with its typical dimensions, in the unit of these dimensions.

    Raises:
        InputError: the robot has no points, or they coincide.
    """
    parameters = model.typical
    # Joint coordinates of a robot defined by joints are 0 at home.
    unknowns = np.zeros(len(model.unknowns))
    size = _size(model, parameters, unknowns, np.eye(3), np.array(model.home))
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"compare: {model.name}: has no size, because all its points coincide")
    return size


def size_at(nlp: Nlp, x: FloatArray) -> float:
    """Return the size of the robot at a point (n,) of a nonlinear program, at the first pose.

    Raises:
        EvaluationError: the robot does not exist at the point.
    """
    model, state = nlp.program.model, evaluate(nlp, x)
    parameters = np.concatenate([np.zeros(0), *[state.parameters[item.name] for item in model.parameters]])
    unknowns = x[list(nlp.program.places.unknowns[0])]
    return _size(model, parameters, unknowns, state.rotation, state.position)


def size_at_start(case: Case) -> float:
    """Return the size of a case's robot at its first starting point.

    Raises:
        CaseError: the case contradicts itself.
        EvaluationError: the robot does not exist at that point.
    """
    nlp = formulate(case)
    return size_at(nlp, close_equations(nlp, nlp.start) if nlp.n else nlp.start)


def _size(
    model: Model, parameters: FloatArray, unknowns: FloatArray, rotation: FloatArray, position: FloatArray
) -> float:
    """Return the largest distance between points of a robot's drawing, including the platform's origin."""
    own = Substitution.identity(model)
    places = ca.horzcat(*[point.position for point in model.scene.points], SX(model.pose.position))
    function = ca.Function("points", own.all, [ca.densify(places)])
    points = np.array(function(parameters, unknowns, rotation, position)).T
    apart = points[:, np.newaxis] - points[np.newaxis]
    return float(np.sqrt(np.max(np.sum(apart**2, axis=2))))


@dataclass(frozen=True)
class LeftOut:
    """Limit of the case that does not apply to a robot.

    Attributes:
        key: key in ``[limits]``, or ``tolerance.joint_centre``.
        reason: reason as a clause.
        is_of_legs: True for a limit on legs between joint centres.
    """

    key: str
    reason: str
    is_of_legs: bool = False


@dataclass(frozen=True, eq=False)
class Placed:
    """Case with another robot in the place of its robot.

    Attributes:
        case: case with the new robot, in the robot's frame.
        offset: (3,) origin of this frame in the frame of the original case, length.
        left_out: omitted limits, because they do not apply to the robot.
    """

    case: Case
    offset: FloatArray
    left_out: tuple[LeftOut, ...]


def placed(case: Case, contender: Contender, factor: float, part: float, length: float) -> Placed:
    """Return a case with another robot in the place of its robot.

    Args:
        case: original case.
        contender: new robot.
        factor: scale factor of its typical lengths.
        part: relative range of each dimension about its typical value; 0 fixes the dimensions.
        length: characteristic length.

    Raises:
        CaseError: the case contradicts itself with this robot.
    """
    if contender.is_of_case:
        return Placed(case, np.zeros(3), ())
    model = contender.model
    start = np.array([value.first if isinstance(value, Free) else value for value in case.position])
    offset = start - factor * np.array(model.home)
    parameters = {item.name: _values(item, factor, part) for item in model.parameters}
    first, *further = (_moved_pose(pose, offset) for pose in case.poses)
    workspace = case.workspace
    if workspace is not None and not workspace.about_pose:
        positions = workspace.position_set
        positions = None if positions is None else positions.moved(-offset)
        position = _moved(workspace.position, offset) if positions is None else positions.box
        workspace = replace(workspace, position=position, position_set=positions)
    bare = replace(
        case,
        model=model,
        parameters=parameters,
        position=first.position,
        displacements=first.displacements,
        further=further,
        tasks=[_moved_task(task, offset) for task in case.tasks],
        limits=Limits(),
        joint_centre_tolerance=None,
        characteristic_length=length,
        workspace=workspace,
        expect=Expectation(),
        published=(),
        name=f"{case.name} with {contender.label}",
        title=contender.label,
    )
    limits, left_out = _limits(case, bare)
    try:
        found = replace(bare, limits=limits, joint_centre_tolerance=case.joint_centre_tolerance)
    except CaseError as error:
        left_out.append(LeftOut("tolerance.joint_centre", error.fault, is_of_legs=True))
        found = replace(bare, limits=limits)
    return Placed(found, frozen_array(offset, (3,)), tuple(left_out))


def _limits(case: Case, bare: Case) -> tuple[Limits, list[LeftOut]]:
    """Return the limits of a case that apply to another robot, and the omitted ones."""
    kept: list[Limit[Any]] = []
    left_out: list[LeftOut] = []
    for limit in case.limits:
        try:
            Limits(limit).check(bare.as_limited)
            own, other = (limit.ranges(each.model) for each in (case, bare))
            if [each.dimension for each in own.values()] != [each.dimension for each in other.values()]:
                raise CaseError(
                    f"limits.{limit.name}",
                    "cannot be compared: actuators of this robot have another unit (length or angle) "
                    "than those of the robot of the case",
                )
        except CaseError as error:
            left_out.append(LeftOut(f"limits.{limit.name}", error.fault, limit.needs_legs))
        else:
            kept.append(limit)
    return Limits(*kept), left_out


def _values(item: Parameter, factor: float, part: float) -> tuple[Value, ...]:
    """Return a value or a range of each component of a dimension; directions are fixed."""
    scale = factor if item.dimension is Dimension.LENGTH else 1.0
    starts = [scale * value for value in item.starter or item.typical]
    width = part * max(abs(value) for value in starts)
    if item.is_direction or width == 0:
        return tuple(starts)
    return tuple(_range(start, width, item) for start in starts)


def _range(start: float, width: float, item: Parameter) -> Value:
    """Return a range about a value within the domain of its dimension; the value if the range is empty."""
    lower, upper = max(start - width, item.lower), min(start + width, item.upper)
    return Free(lower, upper, min(max(start, lower), upper)) if lower < upper else start


def _moved(position: Sequence[Value], offset: FloatArray) -> tuple[Value, ...]:
    """Return a position in a frame with its origin at an offset (3,)."""
    found: list[Value] = []
    for value, shift in zip(position, offset.tolist(), strict=True):
        if isinstance(value, Free):
            start = None if value.start is None else value.start - shift
            found.append(Free(value.lower - shift, value.upper - shift, start))
        else:
            found.append(float(value) - shift)
    return tuple(found)


def _moved_pose(pose: Pose, offset: FloatArray) -> Pose:
    """Return a stated pose in a frame with its origin at an offset (3,)."""
    moves = tuple(
        Displacement.by(each.rotation, each.translation + each.rotation @ offset - offset)
        for each in pose.displacements
    )
    return Pose(_moved(pose.position, offset), pose.rotation, moves)


def _moved_task(task: Task, offset: FloatArray) -> Task:
    """Return a task in a frame with its origin at an offset (3,), where its velocity is measured."""
    twist = np.asarray(task.twist, dtype=np.float64)
    point = None if task.point is None else frozen_array(np.asarray(task.point, dtype=np.float64) - offset, (3,))
    moved = np.concatenate([twist[:3], twist[3:] + np.cross(twist[:3], offset)])
    return replace(task, twist=frozen_array(moved, (6,)), point=point)

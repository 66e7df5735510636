"""Robots of a comparison: found, measured, and put in the place of a case's own.

A robot is given by name, by robot file, or as a model. Its size is the largest distance between two of its points. In
the place of the case's robot it is scaled, with its home at the case's pose, and with free dimensions. The tasks, the
poses, the workspace and the limits stay those of the case. They are written in the robot's own frame, which is moved
without a rotation, so that the robot is at home at the start of the case's first pose.
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

#: Stands for the case's own robot, which takes part as the case states it.
OWN = "case"


@dataclass(frozen=True, eq=False)
class Contender:
    """A robot that takes part in a comparison.

    Attributes:
        label: name in tables: that of the robot, or of its file.
        model: the robot; the case's own for ``case``.
        is_own: whether it takes part as the case states it.
        file: the robot file; None for a robot by name.
    """

    label: str
    model: Model
    is_own: bool = False
    file: Path | None = None


def read_robots(robots: Sequence[str | Path | Model], case: Case) -> list[Contender]:
    """Return the robots of a comparison.

    Args:
        robots: names of robots, paths of robot files, models, or the word ``case`` for the case's own robot.
        case: the case.

    Raises:
        InputError: there are fewer than two robots, one is not found or given twice, or a robot file holds a fault.
    """
    if len(robots) < 2:
        raise InputError(f"compare: needs at least two robots, and {len(robots)} is given")
    found: list[Contender] = []
    for each in robots:
        contender = _read(each, case)
        for other in found:
            if contender.model is other.model or _is_same_file(contender, other):
                raise InputError(f"compare: {each if isinstance(each, str) else contender.label} is given twice")
            if contender.label == other.label:
                fault = "two robots have this name in tables: rename a file"
                raise InputError(f"compare: {contender.label}: {fault}")
        found.append(contender)
    return found


def _read(given: str | Path | Model, case: Case) -> Contender:
    """Return one robot; the errors are those of :func:`read_robots`."""
    if isinstance(given, Model):
        return Contender(given.name, given)
    text = str(given)
    if text == OWN:
        return Contender(OWN, case.model, is_own=True)
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
    """Return the size of a robot at home with its typical dimensions, in the unit of these.

    Raises:
        InputError: the robot has no points, or they coincide.
    """
    parameters = model.typical
    # Joints of a robot that is given joint by joint count from home.
    unknowns = np.zeros(len(model.unknowns))
    size = _size(model, parameters, unknowns, np.eye(3), np.array(model.home))
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"compare: {model.name}: has no points apart from each other, and so no size")
    return size


def size_at(nlp: Nlp, x: FloatArray) -> float:
    """Return the size of a program's robot at a point (n,), at the first pose.

    Raises:
        EvaluationError: the robot does not exist at the point.
    """
    model, state = nlp.program.model, evaluate(nlp, x)
    parameters = np.concatenate([np.zeros(0), *[state.parameters[item.name] for item in model.parameters]])
    unknowns = x[list(nlp.program.places.unknowns[0])]
    return _size(model, parameters, unknowns, state.rotation, state.position)


def size_at_start(case: Case) -> float:
    """Return the size of a case's robot where the first search begins.

    Raises:
        CaseError: the case contradicts itself.
        EvaluationError: the robot does not exist there.
    """
    nlp = formulate(case)
    return size_at(nlp, close_equations(nlp, nlp.start) if nlp.n else nlp.start)


def _size(
    model: Model, parameters: FloatArray, unknowns: FloatArray, rotation: FloatArray, position: FloatArray
) -> float:
    """Return the largest distance between two points of a robot's drawing and the platform's origin."""
    own = Substitution.identity(model)
    places = ca.horzcat(*[point.position for point in model.scene.points], SX(model.pose.position))
    function = ca.Function("points", own.all, [ca.densify(places)])
    points = np.array(function(parameters, unknowns, rotation, position)).T
    apart = points[:, np.newaxis] - points[np.newaxis]
    return float(np.sqrt(np.max(np.sum(apart**2, axis=2))))


@dataclass(frozen=True)
class LeftOut:
    """A limit of the case that a robot cannot have.

    Attributes:
        key: its key in ``[limits]``, or ``tolerance.joint_centre``.
        reason: a clause for people.
        is_of_legs: whether it speaks of legs between joint centres.
    """

    key: str
    reason: str
    is_of_legs: bool = False


@dataclass(frozen=True, eq=False)
class Placed:
    """A robot in the place of a case's own.

    Attributes:
        case: the case with this robot, in the robot's own frame.
        offset: (3,) origin of this frame in the case's own, length.
        left_out: limits of the case that this robot cannot have.
    """

    case: Case
    offset: FloatArray
    left_out: tuple[LeftOut, ...]


def placed(case: Case, contender: Contender, factor: float, part: float, length: float) -> Placed:
    """Return a robot in the place of a case's own.

    Args:
        case: the case.
        contender: the robot.
        factor: by which its typical lengths are multiplied.
        part: of a typical dimension by which it may be smaller or larger; 0 holds the dimensions fixed.
        length: characteristic length.

    Raises:
        CaseError: the case contradicts itself with this robot.
    """
    if contender.is_own:
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
        workspace = replace(workspace, position=_moved(workspace.position, offset), position_set=positions)
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
    """Return the limits of a case that another robot can have, and the others."""
    kept: list[Limit[Any]] = []
    left_out: list[LeftOut] = []
    for limit in case.limits:
        try:
            Limits(limit).check(bare.as_limited)
            own, other = (limit.ranges(each.model) for each in (case, bare))
            if [each.dimension for each in own.values()] != [each.dimension for each in other.values()]:
                raise CaseError(f"limits.{limit.name}", "is a number of another kind of actuators")
        except CaseError as error:
            left_out.append(LeftOut(f"limits.{limit.name}", error.fault, limit.needs_legs))
        else:
            kept.append(limit)
    return Limits(*kept), left_out


def _values(item: Parameter, factor: float, part: float) -> tuple[Value, ...]:
    """Return a value or a range of each component of a dimension; a direction stays fixed."""
    scale = factor if item.dimension is Dimension.LENGTH else 1.0
    starts = [scale * value for value in item.starter or item.typical]
    width = part * max(abs(value) for value in starts)
    if item.is_direction or width == 0:
        return tuple(starts)
    return tuple(_range(start, width, item) for start in starts)


def _range(start: float, width: float, item: Parameter) -> Value:
    """Return a range about a number within the domain of its dimension; the number where nothing is left."""
    lower, upper = max(start - width, item.lower), min(start + width, item.upper)
    return Free(lower, upper, min(max(start, lower), upper)) if lower < upper else start


def _moved(position: Sequence[Value], offset: FloatArray) -> tuple[Value, ...]:
    """Return a position in a frame whose origin is at an offset (3,)."""
    found: list[Value] = []
    for value, shift in zip(position, offset.tolist(), strict=True):
        if isinstance(value, Free):
            start = None if value.start is None else value.start - shift
            found.append(Free(value.lower - shift, value.upper - shift, start))
        else:
            found.append(float(value) - shift)
    return tuple(found)


def _moved_pose(pose: Pose, offset: FloatArray) -> Pose:
    """Return a stated pose in a frame whose origin is at an offset (3,)."""
    moves = tuple(
        Displacement.by(each.rotation, each.translation + each.rotation @ offset - offset)
        for each in pose.displacements
    )
    return Pose(_moved(pose.position, offset), pose.rotation, moves)


def _moved_task(task: Task, offset: FloatArray) -> Task:
    """Return a task in a frame whose origin is at an offset (3,): its velocity is that of this origin."""
    twist = np.asarray(task.twist, dtype=np.float64)
    point = None if task.point is None else frozen_array(np.asarray(task.point, dtype=np.float64) - offset, (3,))
    moved = np.concatenate([twist[:3], twist[3:] + np.cross(twist[:3], offset)])
    return replace(task, twist=frozen_array(moved, (6,)), point=point)

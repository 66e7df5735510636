"""Robots of a comparison, by name, by robot file, or as models, and their size: the largest distance of two points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, Model, Substitution, model_names
from ..case.case import Case
from ..case.robotfile import model_of_definition, read_definition
from ..case.robots import build_model
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
    hint = nearest(text, [*names, OWN])
    raise InputError(f"compare: {text or 'an empty name'}: no such robot, and no such robot file; {hint}")


def _is_same_file(one: Contender, other: Contender) -> bool:
    return one.file is not None and one.file == other.file


def size_of_home(model: Model) -> float:
    """Return the size of a robot at home with its typical dimensions, in the unit of these.

    Raises:
        InputError: the robot has no points, or they coincide.
    """
    parameters = np.array([value for item in model.parameters for value in item.typical])
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

"""The size of a robot: the largest distance between two points of it."""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, Model, Substitution
from ..case.case import Case
from ..errors import InputError
from ..evidence.kkt import close_equations
from ..evidence.state import evaluate
from ..program.formulation import formulate
from ..program.nlp import Nlp


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

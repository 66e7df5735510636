"""Starting points at which the robot's loops are closed, in the assembly of home.

Newton's method from home may end in another assembly where the pose is far from there. At the first starting point the
loops are therefore closed along a path from home. The other starting points take their unknowns from there; those of a
robot with free positions of driven joints, which are spread over their ranges, have each a path from home.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...models import FloatArray
from ..errors import EvaluationError
from ..program.nlp import Nlp
from .assembly import unknowns_from_home
from .kkt import close_equations
from .state import CLOSED, evaluate, loops_are_closed


def closed_start(nlp: Nlp, others: Iterable[FloatArray] = ()) -> FloatArray:
    """Return the first starting point (n,) of a program, with the robot's loops closed along a path from home.

    Args:
        nlp: the program.
        others: (n,) points of which the first takes its place at which the robot exists, where it does not.

    Raises:
        EvaluationError: the robot does not exist at any of these points.
    """
    fault: EvaluationError | None = None
    for x in (nlp.start, *others):
        try:
            return close_equations(nlp, _with_unknowns_from_home(nlp, x))
        except EvaluationError as error:
            fault = fault or error
    raise fault or EvaluationError("there is no starting point")


def closed_starts(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return starting points (k, n) of a program with the robot's loops closed.

    Raises:
        EvaluationError: the robot does not exist at any of these points.
    """
    home = closed_start(nlp, points)
    close = _closed_along_path if nlp.program.model.free_joints else close_near
    return np.array([close(nlp, home, x) for x in points])


def _closed_along_path(nlp: Nlp, first: FloatArray, x: FloatArray) -> FloatArray:
    """Return a point (n,) with the loops closed along a path from home; near those of another where it is no robot."""
    try:
        return close_equations(nlp, _with_unknowns_from_home(nlp, x))
    except EvaluationError:
        return close_near(nlp, first, x)


def closed_in_place(nlp: Nlp, x: FloatArray) -> FloatArray | None:
    """Return the point with a robot's dimensions and pose, and its joints as :func:`closed_start` has them there.

    Args:
        nlp: the program.
        x: (n,) point whose internal unknowns do not count.

    Returns:
        (n,) the point; None where the program's conditions do not hold there, home's working mode among them.
    """
    own, target = list(nlp.program.places.inner), x.copy()
    target[own] = nlp.start[own]
    try:
        found = close_equations(nlp, _with_unknowns_from_home(nlp, target), in_place=True)
    except EvaluationError:
        return None
    g = nlp.evaluate(found).g
    holds = (g >= nlp.g_lower - CLOSED) & (g <= nlp.g_upper + CLOSED)
    return found if bool(holds.all()) and loops_are_closed(nlp, found) else None


def close_near(nlp: Nlp, first: FloatArray, x: FloatArray) -> FloatArray:
    """Return the point, near a given one, at which the program's equations hold, with unknowns near those of another.

    Args:
        nlp: the program.
        first: (n,) point at which the equations hold.
        x: (n,) the point; its internal unknowns do not count.

    Returns:
        (n,) the point, as :func:`.kkt.close_equations` returns it.
    """
    own = list(nlp.program.places.inner)
    target = x.copy()
    target[own] = first[own]
    return close_equations(nlp, target)


def _with_unknowns_from_home(nlp: Nlp, x: FloatArray) -> FloatArray:
    """Return a point (n,) with the unknowns to which the path from home leads; unchanged where it ends early."""
    model, found = nlp.program.model, x.copy()
    if model.generic is None or not model.unknowns:
        return found
    for pose, own in enumerate(nlp.program.places.unknowns):
        state = evaluate(nlp, x, pose)
        parameters = np.concatenate([np.zeros(0), *[state.parameters[item.name] for item in model.parameters]])
        place = np.concatenate([state.angle * state.axis, state.position])
        unknowns = unknowns_from_home(model, parameters, place, x[list(own)])
        if unknowns is not None:
            found[list(own)] = unknowns
    return np.clip(found, nlp.lower, nlp.upper)

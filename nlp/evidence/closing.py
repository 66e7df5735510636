"""Starting points with closed loops, in the home assembly mode.

Newton's method may end in another assembly mode if the pose is far from home. At the first starting point the loops are
therefore closed along a path from home, and the other starting points take their unknowns from it. For a robot with
free actuator coordinates, which are spread over their ranges, each starting point has its own path from home.
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
    """Return the first starting point (n,) of a program, with the loops closed along a path from home.

    Args:
        nlp: the nonlinear program.
        others: (n,) further points. If the loops cannot be closed at the program's start, the first further point with
            closed loops replaces it.

    Raises:
        EvaluationError: the loops cannot be closed at any of these points.
    """
    fault: EvaluationError | None = None
    for x in (nlp.start, *others):
        try:
            return close_equations(nlp, _with_unknowns_from_home(nlp, x))
        except EvaluationError as error:
            fault = fault or error
    raise fault or EvaluationError("there is no starting point")


def closed_starts(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return starting points (k, n) of a program with closed loops.

    Raises:
        EvaluationError: the loops cannot be closed at any of these points.
    """
    home = closed_start(nlp, points)
    close = _closed_along_path if nlp.program.model.free_joints else close_near
    return np.array([close(nlp, home, x) for x in points])


def _closed_along_path(nlp: Nlp, first: FloatArray, x: FloatArray) -> FloatArray:
    """Return a point (n,) with the loops closed along a path from home, or near the first point if that fails."""
    try:
        return close_equations(nlp, _with_unknowns_from_home(nlp, x))
    except EvaluationError:
        return close_near(nlp, first, x)


def closed_in_place(nlp: Nlp, x: FloatArray) -> FloatArray | None:
    """Return a point with the given dimensions and pose, and with joints from the end of the path from home.

    Args:
        nlp: the nonlinear program.
        x: (n,) given point; its internal unknowns are not read.

    Returns:
        (n,) the point; None if a constraint of the program, such as the home working mode, is violated.
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
    """Return a point near ``x`` at which the equations hold, with unknowns close to those of ``first``.

    Args:
        nlp: the nonlinear program.
        first: (n,) point at which the equations hold.
        x: (n,) given point; its internal unknowns are not read.

    Returns:
        (n,) the point, as :func:`.kkt.close_equations` returns it.
    """
    own = list(nlp.program.places.inner)
    target = x.copy()
    target[own] = first[own]
    return close_equations(nlp, target)


def _with_unknowns_from_home(nlp: Nlp, x: FloatArray) -> FloatArray:
    """Return a point (n,) with the unknowns at the end of the path from home; unchanged if the path ends early."""
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

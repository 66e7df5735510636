"""Free pose of a path's frame as variables of a nonlinear program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, frozen_vector
from ..case.case import Case
from ..case.pathfile import PLACE
from ..case.pose import Free
from ..path.orientation import ORDERS, symbolic_rotation
from ..path.path import SymbolicPose
from ..program.nlp import Nlp
from ..program.places import Scalar


class Placement(NamedTuple):
    """Nonlinear program with the free coordinates of a path's frame as additional variables.

    Attributes:
        nlp: the nonlinear program.
        numbers: function that returns the pose (6,) of the frame at a point of the program or of an extended program.
        frame: frame as expressions; None if the frame is fixed.
    """

    nlp: Nlp
    numbers: Callable[[FloatArray], FloatArray]
    frame: SymbolicPose | None


def with_place(nlp: Nlp, case: Case) -> Placement:
    """Return a program with the free coordinates of the path's frame as additional variables."""
    place = () if case.path is None else case.path.place
    free = [k for k, value in enumerate(place) if isinstance(value, Free)]
    fixed = np.array([0.0 if isinstance(value, Free) else value for value in place])
    # The level of an epigraph remains the last variable.
    epigraph = nlp.program.places.epigraph
    first = nlp.n if epigraph is None else epigraph.level

    def numbers(x: FloatArray) -> FloatArray:
        found = fixed.copy()
        found[free] = x[first : first + len(free)]
        return found

    if not free:
        return Placement(nlp, numbers, None)
    symbols, every = SX.sym("place", len(free)), SX(fixed.tolist())
    every[free] = symbols
    # Two indices keep the column shape of an empty result.
    ranges = [value for value in place if isinstance(value, Free)]
    names, program = list(PLACE.items()), nlp.program
    added = [Scalar(f"path.place.{names[k][0]}", names[k][1]) for k in free]
    if epigraph is not None:
        epigraph = replace(epigraph, level=first + len(free))
    wide = replace(
        nlp,
        program=replace(
            program,
            variables=(*program.variables[:first], *added, *program.variables[first:]),
            x=ca.vertcat(program.x[:first, :], symbols, program.x[first:, :]),
            places=replace(program.places, epigraph=epigraph),
        ),
        lower=frozen_vector(np.insert(nlp.lower, first, [value.lower for value in ranges])),
        upper=frozen_vector(np.insert(nlp.upper, first, [value.upper for value in ranges])),
        start=frozen_vector(np.insert(nlp.start, first, [value.first for value in ranges])),
    )
    return Placement(wide, numbers, SymbolicPose(every[:3], symbolic_rotation(every[3:], ORDERS["rpy"])))

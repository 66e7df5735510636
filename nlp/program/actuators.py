"""Largest force, speed or power of the actuators as the objective, over loads, actuators and poses.

The objective is a minimised epigraph variable (:mod:`.epigraph`). Its square bounds the squares of the forces, speeds
or powers. The squares are smooth at a change of sign of a force, and a search over boxes bounds squares best.

The objective is in the unit of the case, such as degrees per second, and so are its bounds, slopes and multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models.statics import posed_statics
from ..case.case import Case
from ..case.forces import PosedForces, dimension_of_speed, forces_at
from ..case.limits.constraint import BoundedConstraint, Call, Form
from ..case.pose import Free
from ..case.task import Sense
from .epigraph import EpigraphBuilder, below_squared_level
from .layout import Layout, assemble
from .nlp import Nlp
from .sampling import starting_points

#: Number of points at which the size of the objective is evaluated.
_SIZE_POINTS = 32
#: Upper bound of the level, as a multiple of the median of these sizes.
_LEVEL_BOUND = 8.0


#: Suffix of the name of a squared force in the other sense.
OTHER_SENSE = ", other sense"


class Measured(NamedTuple):
    """Value (1, 1) of an actuator quantity, with its name."""

    name: str
    value: SX


def formulate_actuators(layout: Layout) -> Nlp:
    """Return the program that minimises the largest actuator force, speed or power.

    Args:
        layout: symbols of a case with one task, whose objective is an actuator quantity.

    Raises:
        CaseError: a limb has zero length at every point of the box.
    """
    values = list(_values(layout))
    size = _size(assemble(layout, layout.robots[0].F[0], Sense.MIN), [each.value for each in values])
    epigraph = EpigraphBuilder(layout, Free(0.0, _LEVEL_BOUND * size, size), size, power=2)
    for each in values:
        epigraph.add(each.name, Form(below_squared_level), each.value)
    return replace(epigraph.program(Sense.MIN), size=size)


def _values(layout: Layout) -> Iterator[Measured]:
    """Yield the squared values of all actuators, under each load case and at each pose."""
    case, robots = layout.case, layout.robots
    for k, robot in enumerate(robots):
        where = f" pose {k + 1}" if len(robots) > 1 else ""
        statics = posed_statics(case.model, robot)
        for each in squares_of(case, forces_at(case.model, statics, robot.rotation, case.loading, robot.size)):
            yield Measured(f"{each.name}{where}", each.value)


def squares_of(case: Case, forces: PosedForces) -> Iterator[Measured]:
    """Yield the squared values of all actuators at a pose, under each load case, in the case's unit."""
    measure = case.tasks[0].measure
    for k, joint in enumerate(forces.joints):
        name = f"{measure} actuator {joint.name}"
        if measure == "actuator_speed":
            # Only the objective is in degrees if the case is, so that all derived values are in degrees, too.
            unit = case.units.to_internal(1.0, dimension_of_speed(joint))
            yield Measured(name, (forces.speeds[k] / unit) ** 2)
            continue
        factor = forces.speeds[k] ** 2 if measure == "actuator_power" else SX(1)
        for each in forces.cases:
            for sense, square in zip(("", OTHER_SENSE), each.squares, strict=False):
                yield Measured(f"{name} load {each.case.name}{sense}", factor * square[k])


def signed_values(case: Case, forces: PosedForces) -> Iterator[Measured]:
    """Yield the values of all actuators at a pose in both senses, in the case's unit: the largest one is the objective.

    Unlike their squares, values are no larger than the objective, and their slopes do not vanish at 0.
    """
    measure = case.tasks[0].measure
    for k, joint in enumerate(forces.joints):
        name = f"{measure} actuator {joint.name}"
        if measure == "actuator_speed":
            yield Measured(name, forces.speeds[k] / case.units.to_internal(1.0, dimension_of_speed(joint)))
            continue
        factor = forces.speeds[k] if measure == "actuator_power" else SX(1)
        for each in forces.cases:
            yield Measured(f"{name} load {each.case.name}", factor * each.largest[k])
            yield Measured(f"{name} load {each.case.name}{OTHER_SENSE}", -factor * each.smallest[k])


def level_constraints(nlp: Nlp, forces: PosedForces, names: Collection[str], where: str) -> list[BoundedConstraint]:
    """Return the constraints by which the level of a program bounds actuator values at a further pose.

    Args:
        nlp: program that minimises the actuator values.
        forces: actuator forces at the pose.
        names: names of the bounded values.
        where: suffix of the names of the constraints.
    """
    epigraph, program = nlp.program.places.epigraph, nlp.program
    if epigraph is None:
        return []
    found = []
    for each in squares_of(nlp.case, forces):
        if each.name.removesuffix(OTHER_SENSE) in names:
            inputs = ca.vertcat(program.p[epigraph.ceiling], program.x[epigraph.level], each.value)
            call = Call(Form(below_squared_level), inputs)
            one = replace(epigraph.constraints[0], name=f"{each.name}{where}", expression=call.value, call=call)
            found.append(BoundedConstraint(one, 0.0, math.inf))
    return found


def _size(nlp: Nlp, values: list[SX]) -> float:
    """Return the typical magnitude of the objective: the median at a few points, from its squares; 1 if unknown."""
    program = nlp.program
    function = ca.Function("largest", [program.x, program.p], [ca.sqrt(ca.mmax(ca.vertcat(*values)))])
    found = np.array([float(function(x, nlp.arguments)) for x in starting_points(nlp, _SIZE_POINTS, 0)])
    known = found[np.isfinite(found) & (found > 0)]
    return float(np.median(known)) if len(known) else 1.0

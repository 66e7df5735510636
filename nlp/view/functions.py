"""Functions of a live view: drawing, Jacobian, quantities, actuator forces and speeds of a robot at one pose.

They depend on the robot only, so all poses of a case share their code. The derivatives of F by fixed parameters, and
the values of limits in the case's terms, complete what the C of a controller has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from ...models import RobotInstance, Substitution, homogenised
from ...models.statics import statics_hindrance, statics_of
from ..case.case import Case
from ..case.forces import forces_at
from ..embedding.calls import RobotValues
from ..program.nlp import Nlp
from ..program.program import Program
from .readings import LimitReadings, limit_readings

#: Number of operations of the derivatives by fixed parameters above which a module does without them.
_MOST_SLOPES = 40_000


@dataclass(frozen=True, eq=False)
class ViewFunctions:
    """Functions of a live view.

    Attributes:
        view: function of the robot's inputs at a pose; its only result is all blocks one below the other.
        blocks: first index and size of each block of the result, by name.
        inputs: function ``(x, p)`` to the robot's inputs at all poses.
        slopes: function ``(x, p, multipliers)`` to the derivatives of ``F - multipliers . closure`` by ``p``; None
            where F is not an expression of a pose, or too large.
        closure: indices of the constraints that determine the joint coordinates from closed loops.
        readings: values of the limits in the case's terms.
    """

    view: ca.Function
    blocks: Mapping[str, tuple[int, int]]
    inputs: ca.Function
    slopes: ca.Function | None
    closure: tuple[int, ...]
    readings: LimitReadings

    @property
    def all(self) -> tuple[ca.Function, ...]:
        """All functions."""
        found = (self.view, self.inputs, self.slopes, *self.readings.functions)
        return tuple(each for each in found if each is not None)


def view_functions(nlp: Nlp, prefix: str) -> ViewFunctions:
    """Return the functions of a live view, with names that begin with the prefix.

    The blocks of the result are ``points``, ``circles`` (centre, point and normal), ``directions`` (origin and vector),
    ``joints`` (position and axes), ``rotation`` (row by row), ``position``, ``rows`` (J with moments about the
    platform's origin, row by row), ``rates`` (row by row, one for each task), ``F``, ``quantities``, and where loads or
    a motion are given ``largest``, ``smallest`` (forces of each load case) and ``speeds``.
    """
    program = nlp.program
    inputs = SX.sym("inputs", program.robot.inputs.numel())
    robot = RobotValues(program.model, program.robot.reference).robot(inputs)
    parts = _drawing(program, inputs) | {
        "rotation": ca.vec(robot.rotation.T),
        "position": robot.position,
        "rows": ca.vec(ca.horzcat(*homogenised(robot.jacobian, robot.position, 1.0)).T),
        "rates": ca.vec(robot.rates.T),
        "F": robot.F,
        "quantities": ca.vertcat(SX(0, 1), *robot.quantities),
        **_loading(nlp.case, robot),
    }
    blocks, at = {}, 0
    for name, part in parts.items():
        blocks[name] = (at, part.numel())
        at += part.numel()
    view = ca.cse(ca.densify(ca.vertcat(*[ca.vec(part) for part in parts.values()])))
    everywhere = ca.densify(ca.veccat(*[each.inputs for each in program.robots]))
    closure = closure_rows(nlp)
    return ViewFunctions(
        ca.Function(f"{prefix}_view", [inputs], [view]),
        blocks,
        ca.Function(f"{prefix}_inputs", [program.x, program.p], [everywhere]),
        _slopes(program, closure, prefix),
        closure,
        limit_readings(nlp, prefix),
    )


def closure_rows(nlp: Nlp) -> tuple[int, ...]:
    """Return the indices of the equations that contain joint coordinates from closed loops."""
    program, inner = nlp.program, list(nlp.program.places.inner)
    if not inner:
        return ()
    equations = [int(k) for k in np.flatnonzero(nlp.g_lower == nlp.g_upper)]
    rows = ca.vertcat(SX(0, 1), *[program.constraints[k].expression for k in equations])
    depends = ca.sum2(ca.DM(ca.jacobian_sparsity(rows, program.x), 1)[:, inner]).full().ravel()
    return tuple(k for k, count in zip(equations, depends, strict=True) if count)


def _drawing(program: Program, inputs: SX) -> dict[str, SX]:
    """Return the expressions of the robot's drawing, three rows and a column for each vector."""
    scene, symbols = program.model.scene, Substitution.identity(program.model).all
    vectors = [expression for _, expression in scene.expressions]
    columns = ca.Function("scene", symbols, [ca.densify(ca.horzcat(SX(3, 0), *vectors))])
    at, given = 0, []
    for each in symbols:
        given.append(ca.reshape(inputs[at : at + each.numel()], each.shape))
        at += each.numel()
    (found,) = columns.call(given)
    counts = {
        "points": len(scene.points),
        "circles": 3 * len(scene.circles),
        "directions": 2 * len(scene.directions),
        "marks": sum(mark.kind.size for mark in scene.marks),
        "joints": sum(1 + len(joint.axes) for joint in scene.joints),
    }
    parts, at = {}, 0
    for name, count in counts.items():
        parts[name] = ca.vec(found[:, at : at + count])
        at += count
    del parts["marks"]
    return parts


def _loading(case: Case, robot: RobotInstance) -> dict[str, SX]:
    """Return forces and speeds of the actuators under the loads of a case; empty without any."""
    if statics_hindrance(case.model) or not (case.loading.cases or case.loading.motion):
        return {}
    statics = statics_of(case.model, robot.jacobian, robot.driven, robot.position)
    found = forces_at(case.model, statics, robot.rotation, case.loading, robot.size)
    return {
        "largest": ca.vertcat(SX(0, 1), *[each.largest for each in found.cases]),
        "smallest": ca.vertcat(SX(0, 1), *[each.smallest for each in found.cases]),
        "speeds": found.speeds,
    }


def _slopes(program: Program, closure: tuple[int, ...], prefix: str) -> ca.Function | None:
    """Return the function to the derivatives of F by fixed parameters; None for a level, or for too many operations."""
    if program.places.epigraph is not None or len(closure) != len(program.places.inner):
        return None
    multipliers = SX.sym("multipliers", len(closure))
    rows = ca.vertcat(SX(0, 1), *[program.constraints[k].expression for k in closure])
    total = program.objective - ca.dot(multipliers, rows)
    slopes = ca.cse(ca.densify(ca.gradient(total, program.p)))
    found = ca.Function(f"{prefix}_slopes", [program.x, program.p, multipliers], [slopes])
    return found if found.n_instructions() <= _MOST_SLOPES else None

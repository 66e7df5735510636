"""Functions of a live view: drawing, Jacobian, quantities, actuator forces and speeds of a robot at one pose.

They depend on the robot only, so all poses of a case share their code. The derivatives of F by fixed parameters, and
the values of limits in the case's terms, complete what the C of a controller has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from ...models import RobotInstance, Substitution, homogenised
from ...models.statics import statics_hindrance, statics_of
from ..case.case import Case
from ..case.forces import forces_at
from ..case.limits.joints import JointAngle
from ..embedding.calls import RobotValues
from ..program.nlp import Nlp
from ..program.places import FreeRotation
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
        slopes: function ``(x, p, multipliers)`` to the derivatives by ``p`` of the objective minus the multipliers
            times the constraints of ``closure`` and ``levels``; None if it has too many operations.
        closure: indices of the constraints that loops impose on joint coordinates and poses.
        levels: indices of the constraints that determine the level of a worst case; empty without a level.
        followers: indices in ``x`` of the coordinates of poses that follow when a closed loop moves another variable;
            empty where loops determine the joint coordinates only.
        cones: cones of the passive joints with a limit on their angle, in the order of their block.
        readings: values of the limits in the case's terms.
    """

    view: ca.Function
    blocks: Mapping[str, tuple[int, int]]
    inputs: ca.Function
    slopes: ca.Function | None
    closure: tuple[int, ...]
    levels: tuple[int, ...]
    followers: tuple[int, ...]
    cones: tuple[JointAngle, ...]
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
    platform's origin, row by row), ``rates`` (row by row, one for each task; only the
    task of the pose if dimensions or the pose change from task to task), ``F``, ``magnitude`` (bounds on F without
    cancellation), ``quantities``, ``cones`` (centre and unit axis of each joint with a limited angle), and where loads
    or a motion are given ``largest``, ``smallest`` (forces of each load case) and ``speeds``.
    """
    program = nlp.program
    inputs = SX.sym("inputs", program.robot.inputs.numel())
    robot = RobotValues(program.model, program.robot.reference).robot(inputs)
    cones = tuple(each for each in nlp.case.limits.items if isinstance(each, JointAngle))
    parts = _drawing(program, inputs) | {
        "rotation": ca.vec(robot.rotation.T),
        "position": robot.position,
        "rows": ca.vec(ca.horzcat(*homogenised(robot.jacobian, robot.position, 1.0)).T),
        "rates": ca.vec(robot.rates.T),
        "F": robot.F,
        "magnitude": robot.magnitude,
        "quantities": ca.vertcat(SX(0, 1), *robot.quantities),
        "cones": ca.vertcat(SX(0, 1), *[part for limit in cones for part in limit.cones(robot)]),
        **_loading(nlp.case, robot),
    }
    blocks, at = {}, 0
    for name, part in parts.items():
        blocks[name] = (at, part.numel())
        at += part.numel()
    view = ca.cse(ca.densify(ca.vertcat(*[ca.vec(part) for part in parts.values()])))
    everywhere = ca.densify(ca.veccat(*[each.inputs for each in program.robots]))
    closure, levels = closure_rows(nlp), level_rows(nlp)
    return ViewFunctions(
        ca.Function(f"{prefix}_view", [inputs], [view]),
        blocks,
        ca.Function(f"{prefix}_inputs", [program.x, program.p], [everywhere]),
        _slopes(program, (*closure, *levels), prefix),
        closure,
        levels,
        _pose_variables(nlp) if len(closure) > len(program.places.inner) else (),
        cones,
        limit_readings(nlp, prefix),
    )


def closure_rows(nlp: Nlp) -> tuple[int, ...]:
    """Return the indices of the equations of closed loops: those with joint coordinates, or with a pose only."""
    program, inner = nlp.program, list(nlp.program.places.inner)
    if not inner:
        return ()
    bounds = enumerate(nlp.g_lower == nlp.g_upper)
    equations = [k for k, is_equation in bounds if is_equation and not any(program.constraints[k].keys)]
    rows = ca.vertcat(SX(0, 1), *[program.constraints[k].expression for k in equations])
    involved = [*inner, *_pose_variables(nlp)]
    depends = ca.sum2(ca.DM(ca.jacobian_sparsity(rows, program.x), 1)[:, involved]).full().ravel()
    return tuple(k for k, count in zip(equations, depends, strict=True) if count)


def level_rows(nlp: Nlp) -> tuple[int, ...]:
    """Return the indices of the constraints that determine the level of a worst case; empty without a level."""
    epigraph, constraints = nlp.program.places.epigraph, nlp.program.constraints
    rows = () if epigraph is None else {id(each) for each in epigraph.constraints}
    return tuple(k for k, each in enumerate(constraints) if id(each) in rows)


def _pose_variables(nlp: Nlp) -> tuple[int, ...]:
    """Return the indices in ``x`` of the coordinates of the stated poses."""
    places = nlp.program.places
    found = {place.index for place in places.numbers[places.dimensions :] if place.vector == "x"}
    return tuple(sorted(found.union(*(each.q for each in places.rotations if isinstance(each, FreeRotation)))))


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


def _slopes(program: Program, equations: tuple[int, ...], prefix: str) -> ca.Function | None:
    """Return the function to the derivatives of F by fixed parameters; None for too many operations."""
    multipliers = SX.sym("multipliers", len(equations))
    rows = ca.vertcat(SX(0, 1), *[program.constraints[k].expression for k in equations])
    total = program.objective - ca.dot(multipliers, rows)
    slopes = ca.cse(ca.densify(ca.gradient(total, program.p)))
    found = ca.Function(f"{prefix}_slopes", [program.x, program.p, multipliers], [slopes])
    return found if found.n_instructions() <= _MOST_SLOPES else None

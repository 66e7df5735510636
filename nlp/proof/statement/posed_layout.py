"""A case over its workspace as expressions of the pose, and the program of one expression over it.

Some unknowns of a robot follow in closed form: then its limbs must reach every pose, and the case lacks these unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, Model, Substitution
from ....models.joints.closedform import ClosedForm, Reach
from ...case.case import Case
from ...case.limits.constraint import BoundedConstraint, Constraint, Reading
from ...case.pose import HERE, Free, Pose, Rotation, Value
from ...case.task import Sense
from ...program.assembly import assemble
from ...program.layout import Layout, StatedPoseSymbols, lay_out
from ...program.nlp import Nlp
from ...program.places import SymbolTable
from ...program.sampling import starting_points
from .claims import REACH, Claim

#: Number of points from which the size of an expression is taken.
_POINTS = 33
#: Poses at which an equation is tested, and its largest residual, of order 1, where it holds by itself.
_TESTS, _IDENTITY = 32, 1e-11
_SEED = 0


def at_one_pose(case: Case, position: Sequence[Value], rotation: Rotation) -> Case:
    """Return the exact machine of a case at one pose, without a workspace."""
    return replace(
        case,
        position=position,
        rotation=rotation,
        displacements=(HERE,),
        further=(),
        workspace=None,
        joint_centre_tolerance=None,
    )


class PoseCoordinates(NamedTuple):
    """Coordinates of the poses of a workspace.

    Attributes:
        values: three of position, and three of rotation: the range of the tangent of half an angle, or of a component
            of a Cayley vector, where it varies, and else the angle.
        rotation: returns the rotation (3, 3) with three coordinates (3, 1).
        ball: largest squared size of a Cayley vector; infinite where rotations are no ball.
    """

    values: Sequence[Value]
    rotation: Callable[[SX], SX]
    ball: float


def posed_layout(case: Case, at: PoseCoordinates) -> Layout:
    """Return a case, whose own poses are not used, as symbols of one pose in the coordinates of a search."""
    one = at_one_pose(case, tuple(at.values[:3]), Rotation(None, 0.0))

    def add_pose(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        placed, turns = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position)), []
        for k, value in enumerate(at.values[3:]):
            kind = Dimension.NUMBER if isinstance(value, Free) else Dimension.ANGLE
            symbol = table.add(f"{prefix}turn{k + 1}", kind, value).symbols
            turns.append(symbol if isinstance(value, Free) else ca.tan(symbol / 2))
        turn = ca.vertcat(*turns)
        ball = Constraint(f"{prefix}turn", ca.sumsqr(turn), Reading(Dimension.NUMBER))
        held = [BoundedConstraint(ball, -math.inf, at.ball)] if at.ball < math.inf else []
        return StatedPoseSymbols(at.rotation(turn), placed.symbols, placed.places, placed.symbols, None, held, (HERE,))

    return lay_out(one, one.tasks, add_pose)


def extreme_program(layout: Layout, expression: SX, sense: Sense) -> Nlp:
    """Return the program that maximises or minimises an expression over the poses, without the case's limits.

    Args:
        layout: from :func:`posed_layout`.
        expression: (1, 1) in its symbols.
        sense: whether the largest or the smallest value is sought.
    """
    bare = tuple(item for item in layout.constraints if not any(item.constraint.keys))
    program = assemble(replace(layout, constraints=bare, constant_limits=(), families=()), expression, sense)
    sizes = [abs(program.evaluate(x).F) for x in starting_points(program, _POINTS, _SEED)]
    size = max((each for each in sizes if np.isfinite(each)), default=1.0)
    return replace(program, size=size or 1.0)


def varies(layout: Layout, expressions: Sequence[SX]) -> list[bool]:
    """Return whether each expression depends on the pose."""
    x = layout.table.variables_vector
    return [bool(x.numel()) and any(ca.which_depends(each, x, 1, True)) for each in expressions]


def reach_claims(case: Case, closed: ClosedForm, at: PoseCoordinates) -> tuple[Layout, tuple[Claim, ...]]:
    """Return the claims that limbs reach every pose, one for each unknown in closed form, and the case they are about.

    The case is one of symbols of the pose, without loops and signs: where a limb does not reach, its loop has no value.
    """
    layout = design_layout(case, closed.model, at)
    return layout, reach_claims_on(layout, closed.reaches)


def reach_claims_on(layout: Layout, reaches: Sequence[Reach]) -> tuple[Claim, ...]:
    """Return the claims that limbs reach every pose in the symbols of a layout of their robot."""
    values, reading = _on(layout, [each.value for each in reaches]), Reading(Dimension.NUMBER)
    return tuple(
        Claim(f"reach limb {each.limb}", Sense.MIN, value, reading, REACH, 0.0)
        for each, value in zip(reaches, values, strict=True)
    )


def closed_layout(case: Case, closed: ClosedForm, at: PoseCoordinates) -> Layout:
    """Return a case as symbols of the pose, with unknowns in closed form: all of its limbs reach every pose.

    Loop equations that hold at every pose by themselves are left out; with unknowns all are kept. A Delta that is held
    without rotation is such a robot: the second rod of a limb closes with the first. A bound for a robot without an
    equation holds for the robot with it, too: it is one over more poses.
    """
    model = closed.model
    if not model.unknowns and model.closure:
        layout = design_layout(case, model, at)
        nlp = extreme_program(layout, SX(0), Sense.MIN)
        scaled = _on(layout, [ca.vertcat(*[each.scaled for each in model.closure])])
        function = ca.Function("closure", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in scaled])
        found = [function(x, nlp.arguments).full().ravel() for x in starting_points(nlp, _TESTS, _SEED)]
        # A limb that does not reach a pose has no value there.
        holds = np.nanmax(np.abs(found), axis=0, initial=0.0) <= _IDENTITY
        holds &= np.isfinite(found).sum(axis=0) >= _TESTS // 2
        model = replace(model, closure=tuple(each for each, kept in zip(model.closure, ~holds, strict=True) if kept))
    return posed_layout(replace(case, model=model), at)


def design_layout(case: Case, model: Model, at: PoseCoordinates) -> Layout:
    """Return the design, a case with a model without unknowns, as symbols of one pose: those of its machines.

    Equations of loops are left out, which hold at every pose by themselves: a bound without one is over more poses.
    """
    return posed_layout(replace(case, model=without_loops(model)), at)


def without_loops(model: Model) -> Model:
    """Return a robot without the equations and signs of its loops."""
    return replace(model, closure=(), loops=(), distances=(), signs=())


def _on(layout: Layout, expressions: list[SX]) -> list[SX]:
    """Return expressions of a model's symbols as those of a layout."""
    robot, own = layout.robots[0], Substitution.identity(layout.case.model)
    unknowns = ca.vertcat(
        SX(0, 1), *[layout.table.variables_vector[k] for at_pose in layout.places.unknowns for k in at_pose]
    )
    given = Substitution(robot.parameters, unknowns, robot.rotation, robot.position)
    return list(ca.Function("values", own.all, expressions).call(given.all))

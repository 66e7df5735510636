"""A case over its workspace as expressions of the pose, and the nonlinear program of one expression.

Closed forms replace some unknowns of a robot; they require that its limbs reach every pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, Model, Substitution
from ....models.joints.model.closedform import ClosedForm, Reach
from ....models.rotation import turn_about
from ...case.case import Case
from ...case.limits.constraint import Reading
from ...case.limits.limits import Limits
from ...case.pose import NO_DISPLACEMENT, Pose, Rotation, Value
from ...case.task import Sense
from ...case.workspace import TurnKind, Workspace
from ...program.layout import Layout, StatedPoseSymbols, assemble, lay_out
from ...program.nlp import Nlp
from ...program.places import SymbolTable
from ...program.sampling import starting_points
from .claims import REACH, Claim

#: Number of points at which the size of an expression is sampled.
_POINTS = 33
#: Number of poses at which an equation (scaled to values of about 1) is tested, and largest residual of an equation
#: that is satisfied at every pose.
_TESTS, _IDENTITY = 32, 1e-11
_SEED = 0


def at_one_pose(case: Case, position: Sequence[Value], rotation: Rotation) -> Case:
    """Return a case with one stated pose instead of its poses and its workspace."""
    return replace(
        case,
        position=position,
        rotation=rotation,
        displacements=(NO_DISPLACEMENT,),
        further=(),
        worst_everywhere=False,
        workspace=None,
        joint_centre_tolerance=None,
    )


def posed_layout(case: Case, workspace: Workspace) -> Layout:
    """Return a case with fixed dimensions as expressions of one pose of a workspace, instead of its stated poses."""
    turns = workspace.turns
    if turns.kind is not TurnKind.ROLL_PITCH_YAW:
        axis = turns.axis if turns.kind is TurnKind.AXIS else None
        one = at_one_pose(case, workspace.position, Rotation(axis, turns.angles[0]))
        return lay_out(one, one.tasks)
    one = at_one_pose(case, workspace.position, Rotation(None, 0.0))

    def add_turns(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        position = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
        angles = [
            table.add(f"{prefix}{name}", Dimension.ANGLE, value).symbols
            for name, value in zip(("roll", "pitch", "yaw"), turns.angles, strict=True)
        ]
        about = [turn_about(k, ca.cos(angle), ca.sin(angle)) for k, angle in enumerate(angles)]
        turned = about[2] @ about[1] @ about[0]
        return StatedPoseSymbols(
            turned, position.symbols, position.places, position.symbols, None, [], (NO_DISPLACEMENT,)
        )

    return lay_out(one, one.tasks, add_turns)


def extreme_program(layout: Layout, expression: SX, sense: Sense) -> Nlp:
    """Return the program that maximises or minimises an expression over the poses, without the case's limits.

    Args:
        layout: layout from :func:`posed_layout`.
        expression: (1, 1) expression in the symbols of the layout.
        sense: ``MAX`` for the largest value, ``MIN`` for the smallest.
    """
    bare = tuple(item for item in layout.constraints if not any(item.constraint.keys))
    program = assemble(replace(layout, constraints=bare, constant_limits=(), families=()), expression, sense)
    sizes = [abs(program.evaluate(x).F) for x in starting_points(program, _POINTS, _SEED)]
    size = max((each for each in sizes if np.isfinite(each)), default=1.0)
    return replace(program, size=size or 1.0)


def varies(layout: Layout, expressions: Sequence[SX]) -> list[bool]:
    """Return whether each expression depends on the pose coordinates of the layout."""
    x = layout.table.variables_vector
    return [bool(x.numel()) and any(ca.which_depends(each, x, 1, True)) for each in expressions]


def reach_claims(case: Case, closed: ClosedForm, workspace: Workspace) -> tuple[Layout, tuple[Claim, ...]]:
    """Return the case as expressions of the pose, and a claim for each closed form: the limb reaches every pose.

    The returned case has no loops, signs and limits, because a closed form has no value out of reach.
    """
    layout = _bare_layout(case, closed.model, workspace)
    return layout, reach_claims_on(layout, closed.reaches)


def reach_claims_on(layout: Layout, reaches: Sequence[Reach]) -> tuple[Claim, ...]:
    """Return the claims that limbs reach every pose, in the symbols of a layout of the robot."""
    values, reading = _on(layout, [each.value for each in reaches]), Reading(Dimension.NUMBER)
    return tuple(
        Claim(f"reach limb {each.limb}", Sense.MIN, value, reading, REACH, 0.0)
        for each, value in zip(reaches, values, strict=True)
    )


def closed_layout(case: Case, closed: ClosedForm, workspace: Workspace) -> Layout:
    """Return a case as expressions of the pose, with closed forms of unknowns; all limbs must reach every pose.

    If no unknown remains, loop equations that hold at every pose are left out. In a Delta robot without rotation, for
    example, the second rod of a limb closes with the first. A bound that omits an equation covers more poses, and so
    is also valid with the equation.
    """
    model = closed.model
    if not model.unknowns and model.closure:
        layout = _bare_layout(case, model, workspace)
        nlp = extreme_program(layout, SX(0), Sense.MIN)
        scaled = _on(layout, [ca.vertcat(*[each.scaled for each in model.closure])])
        function = ca.Function("closure", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in scaled])
        found = [function(x, nlp.arguments).full().ravel() for x in starting_points(nlp, _TESTS, _SEED)]
        # Out of reach, the closed form of a limb is NaN.
        holds = np.nanmax(np.abs(found), axis=0, initial=0.0) <= _IDENTITY
        holds &= np.isfinite(found).sum(axis=0) >= _TESTS // 2
        model = replace(model, closure=tuple(each for each, kept in zip(model.closure, ~holds, strict=True) if kept))
    return posed_layout(replace(case, model=model), workspace)


def _bare_layout(case: Case, model: Model, workspace: Workspace) -> Layout:
    """Return a case as expressions of the pose, without its limits."""
    return posed_layout(replace(case, model=without_loops(model), limits=Limits()), workspace)


def without_loops(model: Model) -> Model:
    """Return a robot without the equations and signs of its loops."""
    return replace(model, closure=(), loops=(), distances=(), signs=())


def _on(layout: Layout, expressions: list[SX]) -> list[SX]:
    """Return expressions of the model's symbols, rewritten in the symbols of a layout of the model."""
    robot, own = layout.robots[0], Substitution.identity(layout.case.model)
    unknowns = ca.vertcat(
        SX(0, 1), *[layout.table.variables_vector[k] for at_pose in layout.places.unknowns for k in at_pose]
    )
    given = Substitution(robot.parameters, unknowns, robot.rotation, robot.position)
    return list(ca.Function("values", own.all, expressions).call(given.all))

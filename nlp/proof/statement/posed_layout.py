"""A case over its workspace as expressions of the pose, and the program of one expression over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension
from ...case.case import Case
from ...case.pose import HERE, Pose, Rotation, Value
from ...case.task import Sense
from ...case.workspace import TurnKind, Workspace
from ...program.assembly import assemble
from ...program.layout import Layout, StatedPoseSymbols, lay_out
from ...program.nlp import Nlp
from ...program.places import SymbolTable
from ...program.sampling import starting_points

#: Number of points from which the size of an expression is taken.
_POINTS = 33
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


def posed_layout(case: Case, workspace: Workspace) -> Layout:
    """Return a case with fixed dimensions as symbols of one pose, which is any of a workspace.

    Args:
        case: the case; its own poses are not used.
        workspace: the poses.
    """
    turns = workspace.turns
    # The rotation of a workspace by roll, pitch and yaw is added below.
    rotation = Rotation(None, turns.angles[0] if turns.kind is TurnKind.ANY_AXIS else 0.0)
    if turns.kind is TurnKind.AXIS:
        rotation = Rotation(turns.axis, turns.angles[0])
    one = at_one_pose(case, workspace.position, rotation)

    def add_turns(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        """Add a pose whose rotation is by roll, pitch and yaw."""
        position = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
        angles = [
            table.add(f"{prefix}{name}", Dimension.ANGLE, value).symbols
            for name, value in zip(("roll", "pitch", "yaw"), turns.angles, strict=True)
        ]
        turned = _turn(2, angles[2]) @ _turn(1, angles[1]) @ _turn(0, angles[0])
        return StatedPoseSymbols(turned, position.symbols, position.places, position.symbols, None, [], (HERE,))

    return lay_out(one, one.tasks, add_turns if turns.kind is TurnKind.ROLL_PITCH_YAW else None)


def _turn(about: int, angle: SX) -> SX:
    """Return the rotation matrix (3, 3) about a coordinate axis."""
    i, j = (about + 1) % 3, (about + 2) % 3
    matrix = SX.eye(3)
    matrix[i, i] = matrix[j, j] = ca.cos(angle)
    matrix[j, i], matrix[i, j] = ca.sin(angle), -ca.sin(angle)
    return matrix


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

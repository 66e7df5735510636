"""A case over its workspace in the coordinates of a search, with errors of joint centres as variables."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Dimension
from ....case.case import Case
from ....case.limits.constraint import BoundedConstraint, Constraint, Reading
from ....case.pose import HERE, Free, Pose, Rotation
from ....program.layout import Layout, StatedPoseSymbols, lay_out
from ....program.places import SymbolTable
from ...statement.posed_layout import at_one_pose
from ..robot.pose_box import PoseBox, rotation_of
from ..robot.tolerance_model import BuiltModel, Family


def box_layout(case: Case, box: PoseBox) -> Layout:
    """Return a case with fixed dimensions as symbols of one pose, in the coordinates of a box.

    Args:
        case: the case; its own poses are not used.
        box: the poses.
    """
    middle = 0.5 * box.lower + 0.5 * box.upper
    position = tuple(
        Free(float(box.lower[k]), float(box.upper[k])) if k in box.free else float(middle[k]) for k in range(3)
    )
    one = at_one_pose(case, position, Rotation(None, 0.0))

    def add_pose(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        """Add a pose with the box's coordinates of its rotation."""
        placed = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
        turn = []
        for k in range(3, 6):
            value = Free(float(box.lower[k]), float(box.upper[k])) if k in box.free else float(middle[k])
            turn.append(table.add(f"{prefix}turn{k - 2}", Dimension.NUMBER, value).symbols)
        ball = Constraint(f"{prefix}turn", ca.sumsqr(ca.vertcat(*turn)), Reading(Dimension.NUMBER))
        held = [BoundedConstraint(ball, -np.inf, box.ball)] if box.ball < np.inf else []
        rotation = rotation_of(box, ca.vertcat(*turn))
        return StatedPoseSymbols(rotation, placed.symbols, placed.places, placed.symbols, None, held, (HERE,))

    return lay_out(one, one.tasks, add_pose)


def machine_layout(case: Case, built: BuiltModel, family: Family) -> Layout:
    """Return a case as symbols of one pose of one machine: the errors are variables, before the coordinates.

    Args:
        case: with fixed dimensions.
        built: its robot with errors of its joint centres.
        family: the machines.
    """
    own = Free(-family.tolerance, family.tolerance)
    parameters = {name: case.parameters[name] for name in case.parameters}
    errors = [item for item in built.model.parameters if item.name not in parameters]
    whole = parameters | {item.name: (own, own, own) for item in errors}
    limited = replace(case, model=built.model, parameters=whole, joint_centre_tolerance=None)
    return box_layout(limited, family.problem.box)


def in_family(layout: Layout, family: Family, expressions: SX) -> SX:
    """Return expressions (k, 1) of a layout of machines in the coordinates of their family."""
    table = layout.table
    function = ca.Function("numbers", [table.variables_vector, table.arguments_vector], [expressions])
    numbers = ca.vertcat(SX(0, 1), *[SX(each) for each in table.values])
    return function.call([ca.vertcat(family.errors, family.problem.z), numbers])[0]

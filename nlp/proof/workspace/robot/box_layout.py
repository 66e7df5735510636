"""A case as symbols of the coordinates of a box of poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .....models import Dimension
from ....case.case import Case
from ....case.pose import HERE, Free, Pose, Rotation, Value
from ....case.workspace import TurnKind
from ....program.layout import Layout, StatedPoseSymbols, lay_out
from ....program.places import SymbolTable
from ...statement.posed_layout import at_one_pose
from .pose_box import PoseBox


class _Quaternion(NamedTuple):
    """A quaternion of any size as expressions."""

    w: SX
    x: SX
    y: SX
    z: SX


def box_layout(case: Case, box: PoseBox, chosen: Sequence[int]) -> Layout:
    """Return a case as symbols of the chosen coordinates; the others are at the middle of the box."""
    middle = 0.5 * (box.lower + box.upper)
    values: list[Value] = [
        Free(float(box.lower[k]), float(box.upper[k])) if k in chosen else float(middle[k]) for k in range(6)
    ]
    one = at_one_pose(case, tuple(values[:3]), Rotation(None, 0.0))

    def add_pose(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        """Add a pose whose rotation is in the coordinates of the box."""
        position = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
        turns = [table.add(f"{prefix}turn_{k}", Dimension.NUMBER, value).symbols for k, value in enumerate(values[3:])]
        rotation = _rotation(_quaternion(box, turns))
        return StatedPoseSymbols(rotation, position.symbols, position.places, position.symbols, None, [], (HERE,))

    return lay_out(one, one.tasks, add_pose)


def _quaternion(box: PoseBox, turns: Sequence[SX]) -> _Quaternion:
    """Return the quaternion of coordinates of a rotation, as :meth:`.PoseBox.quaternion`."""
    a, b, c = turns
    if box.kind is TurnKind.ANY_AXIS:
        return _Quaternion(SX(1), a, b, c)
    if box.kind is TurnKind.AXIS:
        return _Quaternion(SX(1), *(a * float(part) for part in box.axis))
    return _Quaternion(1 + a * b * c, a - b * c, b + a * c, c - a * b)


def _rotation(quaternion: _Quaternion) -> SX:
    """Return the rotation matrix (3, 3) of a quaternion of any size."""
    w, x, y, z = quaternion
    vector = ca.vertcat(x, y, z)
    cross = ca.skew(vector)
    return SX.eye(3) + 2 / (w * w + ca.sumsqr(vector)) * (w * cross + cross @ cross)

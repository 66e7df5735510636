"""Signs that distinguish the assembly modes of a limb: of joints that hold together, and of the home working mode.

Loop equations also have solutions in which joints do not hold together, such as a hinge with opposite axes. Of the
solutions in which joints hold together, those of one *working mode* are connected without a singularity of the limb: an
elbow bent to one side. The sign of a mode is that of the determinant of the equations' derivatives with respect to the
limb's unknowns, which is zero only at such singularities:

* one unknown and one equation of each chain that depends on it, such as that of a rod: the sum of the derivatives;
* two unknowns of a planar limb: the derivatives of the point at the cut, and the plane's normal;
* three unknowns: the derivatives of the point at the cut.

Other limbs have no sign.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
from casadi import SX

from ...parts import AssemblySign, Unknown
from ..home.generic import PathFrame
from ..home.motion import AxisKind
from .opened import OpenedPath

#: Relative size of a mode's sign at home below which home is singular: rounding leaves 1e-16.
_SINGULAR = 1e-6


def joint_signs(limb: str, name: str, path: OpenedPath) -> list[AssemblySign]:
    """Return the signs of a chain's joints that the loop equations leave open; 1 where the joints hold together."""
    return [AssemblySign(f"sign {name} ({k + 1})", limb, 1 - each, is_mode=False) for k, each in enumerate(path.checks)]


def mode_signs(
    limb: str, paths: Sequence[OpenedPath], unknowns: Sequence[Unknown], frame: PathFrame
) -> list[AssemblySign]:
    """Return the sign of the home working mode of a limb; empty without unknowns or a known sign.

    Free actuator coordinates count as given.

    Args:
        limb: name of the limb.
        paths: opened chains of the limb.
        unknowns: unknowns of the limb.
        frame: common data of all chains of the robot.
    """
    every = ca.vertcat(SX(0, 1), *[item.symbol for item in unknowns])
    unknowns = [item for item in unknowns if not item.is_free]
    count, symbols = len(unknowns), ca.vertcat(SX(0, 1), *[item.symbol for item in unknowns])
    if count == 1:
        moved = [[each for each in path.equations if ca.depends_on(each.expression, symbols)] for path in paths]
        if any(len(own) != 1 for own in moved):
            return []
        value = sum((ca.jacobian(own.expression, symbols) for (own,) in moved), SX(0))
        largest = sum((own.size / unknowns[0].size for (own,) in moved), SX(0))
    elif len(paths) == 1 and count in (2, 3) and paths[0].cut.type and paths[0].rod is None:
        (path,) = paths
        normal = _normal(path, frame) if count == 2 else SX(3, 0)
        if normal is None:
            return []
        point = ca.vertcat(*[each.expression for each in path.equations[:3]])
        columns = ca.horzcat(ca.jacobian(point, symbols), normal)
        value = ca.det(columns)
        largest = ca.norm_2(columns[:, 0]) * ca.norm_2(columns[:, 1]) * ca.norm_2(columns[:, 2])
    else:
        return []
    at_home, most = (frame.value_at_home(each, every) for each in (value, largest))
    if not abs(at_home) > _SINGULAR * most:
        return []
    return [AssemblySign(f"working mode {limb}", limb, value / at_home, is_mode=True)]


def _normal(path: OpenedPath, frame: PathFrame) -> SX | None:
    """Return the current axis (3, 1) normal to all motions of a chain's unknowns; None without such an axis.

    There is such an axis if all rotations have one direction, and all slides are perpendicular to this direction.
    """
    cut = range(path.cut.first, path.cut.last + 1)
    pairs = [
        (axis, screw)
        for j, (joint, own) in enumerate(zip(path.joints, path.screws, strict=True))
        if j not in cut
        for axis, screw in zip(joint.axes, own, strict=True)
    ]
    turning = [(axis, screw) for axis, screw in pairs if axis.kind is AxisKind.ROTATION]
    if not turning or any(not axis.pitch.is_zero() for axis, _ in turning):
        return None
    across = [axis for axis, _ in pairs if axis.kind is AxisKind.TRANSLATION]
    if len(turning) + len(across) < len(pairs):
        return None
    first = turning[0][0].axis
    values = [ca.norm_2(ca.cross(first, axis.axis)) for axis, _ in turning[1:]]
    values += [ca.dot(first, axis.axis) for axis in across]
    return turning[0][1][:3] if all(map(frame.is_zero, values)) else None

"""Faults of a robot's geometry and remarks on it: coinciding axes and joints, and almost parallel axes.

The wrenches of a limb depend on axes that are exactly parallel or intersect exactly. Rounded decimals such as 0.866
break this, so almost parallel axes get a remark.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ..written.forms import RobotError
from .chain import HomeRobot, Joint, Limb
from .generic import INCIDENT, PathFrame
from .motion import AxisKind

#: Sine of the angle below which two axes are almost parallel, and distance, relative to the robot's size, below which
#: they almost intersect: decimals with three or more digits are nearer.
_ALMOST = 1e-3


class _Pair(NamedTuple):
    """Distance or angle (1, 1) between two axes or joints; 0 if they coincide.

    Attributes:
        place: place in the robot file (limb and joint), for messages.
        measure: sine of an angle, or length relative to the robot's size.
        fault: clause for a measure that is zero for all dimensions; empty if this is allowed.
        remark: clause for a measure that is almost zero; empty if this needs no remark.
    """

    place: str
    measure: SX
    fault: str = ""
    remark: str = ""


def examine_geometry(frame: PathFrame) -> list[str]:
    """Return remarks on axes that are almost parallel or almost intersect; refuse degenerate joints.

    Raises:
        RobotError: the axes of a universal joint are parallel, a parallelogram is flat, or a rod has no length.
    """
    robot = frame.robot
    groups: dict[int, Limb] = {}
    for limb in robot.limbs:
        groups.setdefault(limb.group, limb)
    pairs: list[_Pair] = []
    for limb in groups.values():
        for path in limb.paths:
            pairs += [*_joint_faults(robot, path), *_rods(robot, path), *_axes(robot, path)]
    for joint in () if robot.graph is None else robot.joints:
        pairs += _joint_faults(robot, (joint,))
    remarks: list[str] = []
    if pairs:
        measures = ca.vertcat(*[each.measure for each in pairs])
        values = np.abs(np.vstack([frame.typical_value(measures).T, frame.sampled(measures)]))
        for pair, largest in zip(pairs, values.max(axis=0), strict=True):
            if pair.fault and largest < INCIDENT:
                raise RobotError(pair.place, pair.fault)
            if pair.remark and INCIDENT <= largest < _ALMOST:
                remarks.append(f"{pair.place}: {pair.remark.format(f'{largest:.1g}')}")
    return list(dict.fromkeys(remarks))


def _joint_faults(robot: HomeRobot, path: Sequence[Joint]) -> list[_Pair]:
    """Return the distances and angles within single joints of a chain."""
    found = []
    for joint in path:
        if joint.type == "U":
            first, second = (each.axis for each in joint.axes)
            sine = ca.norm_2(ca.cross(first, second))
            fault = "are parallel; two different directions are needed"
            remark = "are almost parallel (sine {}); give perpendicular axes if a usual universal joint is intended"
            found.append(_Pair(f"{joint.place}, axes", sine, fault, remark))
        if joint.type == "Pa":
            (axis,) = joint.axes
            rod = axis.rod / robot.size
            found.append(
                _Pair(f"{joint.place}, to", ca.norm_2(rod), 'is the same point as "at"; a rod needs a nonzero length')
            )
            across = ca.norm_2(ca.cross(rod, axis.axis))
            fault = 'is parallel to the rod from "at" to "to"'
            fault += "; give the axis of its hinges, which is perpendicular to the rod"
            found.append(_Pair(f"{joint.place}, axis", across, fault))
    return found


def _rods(robot: HomeRobot, path: Sequence[Joint]) -> list[_Pair]:
    """Return the lengths of a chain's rods: between two spherical joints, or a spherical and a universal joint."""
    found = []
    for one, other in pairwise(path):
        if {one.type, other.type} in ({"S"}, {"S", "U"}):
            length = ca.norm_2(one.point - other.point) / robot.size
            fault = f"is also the point of the preceding joint {one.type}; a rod between them needs a length"
            found.append(_Pair(f"{other.place}, at", length, fault))
    return found


def _axes(robot: HomeRobot, path: Sequence[Joint]) -> list[_Pair]:
    """Return the angles between all rotation axes of a chain, and the distances of successive rotation axes."""
    axes = [
        (joint, axis) for joint in path for axis in joint.axes if joint.type != "S" and axis.kind is AxisKind.ROTATION
    ]
    found = []
    for k, (one, a) in enumerate(axes):
        for m, (other, b) in enumerate(axes[k + 1 :], k + 1):
            if one is other:
                continue
            normal = ca.cross(a.axis, b.axis)
            whose = f"and the axis of {_short(one)} are"
            words = f"{whose} almost parallel (sine {{}}); if they must be parallel, write both with the same numbers"
            found.append(_Pair(f"{other.place}, axis", ca.norm_2(normal), remark=words))
            if m == k + 1:
                # For parallel axes this distance has no meaning, and is about 1.
                apart = ca.dot(b.point - a.point, normal) / (robot.size * ca.norm_2(normal))
                meeting = ca.if_else(ca.norm_2(normal) < _ALMOST, 1, apart)
                words = (
                    f"{whose} {{}} of the robot's size apart; if they must intersect, write both with the same numbers"
                )
                found.append(_Pair(f"{other.place}, axis", meeting, remark=words))
    return found


def _short(joint: Joint) -> str:
    """Return a joint without its limb, for messages."""
    return joint.place.rpartition(", ")[2]

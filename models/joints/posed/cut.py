"""Joint at which a limb's loop is opened, chosen so that few joint coordinates become unknowns.

The coordinates of the joint at the cut, and of the joints of a rod, never become unknowns. A rod is a passive spherical
joint next to a passive universal or spherical joint, or with one actuated slide between them: its length follows from
the two points, or is driven by the actuator.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from casadi import SX

from ..home.chain import Joint
from ..home.generic import PathFrame, meeting_point
from ..home.motion import UNIT_VECTORS, AxisKind, JointAxis


class Cut(NamedTuple):
    """Place at which a chain of joints is opened: joints ``first`` to ``last`` belong to neither side.

    Attributes:
        type: letter of the joint at the cut; empty if no joint is cut.
        joint: index of the joint at the cut.
        first, last: first and last joint between the two sides; ``last`` is below ``first`` if no joint is cut.
        far: index of the joint at the other end of the rod; None without a rod.
        slide: index of the actuated slide of the rod; None for a rod of constant length.
    """

    type: str
    joint: int
    first: int
    last: int
    far: int | None = None
    slide: int | None = None


def simplified(frame: PathFrame, joints: Sequence[Joint]) -> list[Joint]:
    """Return joints with concurrent passive rotations merged: three into a spherical joint, two into a universal one.

    Rotations are merged if they follow each other directly and successive axes are not parallel.
    """
    found = list(joints)
    for count, kind in ((3, "S"), (2, "U")):
        end = len(found)
        while end > 0:
            start = _window(found, end, count)
            if start is not None and end - start > 1:
                point = _common_point(frame, [axis for each in found[start:end] for axis in each.axes])
                if point is not None:
                    found[start:end] = [_merged(found[start:end], kind, point)]
                    end = start
                    continue
            end -= 1
    return found


def _window(joints: Sequence[Joint], end: int, count: int) -> int | None:
    """Return the index from which the joints before ``end`` have exactly ``count`` axes.

    The result is None if these joints are not all passive revolute or universal joints.
    """
    start, left = end, count
    while start > 0 and left > 0:
        joint = joints[start - 1]
        if joint.type not in ("R", "U") or joint.actuated:
            return None
        start, left = start - 1, left - len(joint.axes)
    return start if left == 0 else None


def _common_point(frame: PathFrame, axes: Sequence[JointAxis]) -> SX | None:
    if any(frame.are_parallel(one.axis, other.axis) for one, other in itertools.pairwise(axes)):
        return None
    return meeting_point(frame, [(axis.point, axis.axis) for axis in axes])


def _merged(joints: Sequence[Joint], kind: str, point: SX) -> Joint:
    axes = tuple(axis for joint in joints for axis in joint.axes)
    if kind == "S":
        axes = tuple(JointAxis(AxisKind.ROTATION, each, point) for each in UNIT_VECTORS)
    parts = tuple(part for joint in joints for part in joint.parts or (joint,))
    return Joint(joints[0].place, kind, point, axes, actuated=False, parts=parts)


def choose_cut(joints: Sequence[Joint], stem: int, *, with_rods: bool = True) -> Cut:
    """Return the place at which a chain is opened.

    The cut is at the passive spherical joint nearest the platform; without a spherical joint at a universal joint;
    without either at the revolute joint with the most equal numbers of coordinates on both sides.

    Args:
        joints: joints from base to platform.
        stem: number of joints from the base on that are shared with other chains, and stay on the base side.
        with_rods: If true, a whole rod may be the cut.
    """
    spherical = [j for j in range(stem, len(joints)) if joints[j].type == "S"]
    if spherical:
        j = spherical[-1]
        rod = _rod(joints, stem, j) if with_rods else None
        return Cut("S", j, j, j) if rod is None else rod
    for kind in ("U", "R"):
        found = [j for j in range(stem, len(joints)) if joints[j].type == kind and not joints[j].actuated]
        if found:
            j = min(found, key=lambda each: (_imbalance(joints, each, each + 1), -each))
            return Cut(kind, j, j, j)
    first = min(range(stem, len(joints) + 1), key=lambda each: (_imbalance(joints, each, each), -each))
    return Cut("", first, first, first - 1)


def _imbalance(joints: Sequence[Joint], first: int, behind: int) -> int:
    """Return the difference between the numbers of coordinates before ``first`` and from ``behind`` on."""
    before, after = (sum(len(joint.axes) for joint in part) for part in (joints[:first], joints[behind:]))
    return abs(before - after)


def _rod(joints: Sequence[Joint], stem: int, j: int) -> Cut | None:
    """Return the cut at a rod that ends at the spherical joint j; None without a rod."""
    for step in (-1, 1):
        far, slide = j + step, None
        if stem <= far < len(joints) and joints[far].type == "P" and joints[far].actuated:
            far, slide = far + step, far
        if stem <= far < len(joints) and joints[far].type in ("U", "S") and not joints[far].actuated:
            return Cut("S", j, min(j, far), max(j, far), far, slide)
    return None

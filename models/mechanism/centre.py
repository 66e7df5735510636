"""Centre of a member: reference point of its couples, by the rules of robots given joint by joint.

In this order: the mean of several passive joints on the platform; the passive spherical joint, or the common point of
three successive passive hinges, nearest the platform; the common point of two hinges; the point of the last passive
joint; without a passive joint, the point of the last joint. A nested loop between two hinges ends their sequence.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import FloatArray
from .decomposition import MemberGraph
from .graph import Mechanism, MechanismJoint
from .motions import size_of
from .topology import Classes, bridges_between

#: Distance of intersecting axes, relative to the mechanism's size, and sine of the angle of parallel ones: rounding
#: leaves 1e-15, also after Newton's method.
_MEET = 1e-9


class CentreRule(NamedTuple):
    """Joints that determine a member's centre.

    Attributes:
        joints: indices of the joints.
        is_meeting: True if the centre is the intersection of two axes; False if it is the mean of the joints' points.
    """

    joints: tuple[int, ...]
    is_meeting: bool = False


def centre_of(mechanism: Mechanism, rule: CentreRule) -> FloatArray:
    """Return the centre (3,) in the world frame, length."""
    joints = [mechanism.joints[k] for k in rule.joints]
    if not rule.is_meeting:
        return np.asarray(np.mean([joint.point for joint in joints], axis=0))
    return meeting_point(*joints)


def meeting_point(one: MechanismJoint, other: MechanismJoint) -> FloatArray:
    """Return the point (3,) of the first axis that is nearest to the second, non-parallel axis."""
    normal = np.cross(one.axis, other.axis)
    along = float(np.cross(other.point - one.point, other.axis) @ normal) / float(normal @ normal)
    return np.asarray(one.point + along * one.axis)


def centre_rule(mechanism: Mechanism, member: MemberGraph) -> CentreRule:
    """Return the joints that determine the centre of a member."""
    if len(member.on_platform) > 1:
        return CentreRule(member.on_platform)
    joints = mechanism.joints
    rows = _rows(mechanism, member)
    chain = [k for row in rows for k in row]
    size = size_of(mechanism)
    found: list[tuple[int, CentreRule]] = []
    for count in (3, 2):
        if count == 3:
            found += [(place, CentreRule((k,))) for place, k in enumerate(chain) if joints[k].kind == "S"]
        before = 0
        for row in rows:
            for k in range(len(row) - count + 1):
                own = row[k : k + count]
                if _meet([joints[each] for each in own], size):
                    found.append((before + k + count - 1, CentreRule((own[0], own[1]), is_meeting=True)))
            before += len(row)
        if found:
            return max(found, key=lambda each: each[0])[1]
    return CentreRule((chain[-1],) if chain else member.on_platform or _last(mechanism, member))


class _Ends(NamedTuple):
    """Bodies of base and platform, and the two bodies of each joint of a member."""

    base: str
    platform: str
    edges: list[tuple[str, str]]


def _ends(mechanism: Mechanism, member: MemberGraph) -> _Ends:
    """Return the bodies of a member, with welded links merged."""
    welds = [(joint.inner, joint.outer) for joint in mechanism.joints if joint.kind == "weld"]
    classes = Classes([link.name for link in mechanism.links], welds)
    own = [mechanism.joints[k] for k in member.joints]
    edges = [(classes.find(joint.inner), classes.find(joint.outer)) for joint in own]
    return _Ends(classes.find(mechanism.base), classes.find(mechanism.platform), edges)


def _last(mechanism: Mechanism, member: MemberGraph) -> tuple[int, ...]:
    """Return the last joint common to all paths from base to platform.

    Without such a joint, return all joints on the platform.
    """
    base, platform, edges = _ends(mechanism, member)
    common = bridges_between(base, platform, edges).bridges[-1:]
    return tuple(member.joints[k] for k in common or [k for k, edge in enumerate(edges) if platform in edge])


def _rows(mechanism: Mechanism, member: MemberGraph) -> list[list[int]]:
    """Return the passive joints common to all paths from base to platform, in groups of successive joints."""
    base, platform, edges = _ends(mechanism, member)
    path = bridges_between(base, platform, edges)
    rows: list[list[int]] = [[]]
    for number, k in enumerate(path.bridges):
        follows = number > 0 and bool(set(edges[k]) & set(edges[path.bridges[number - 1]]))
        if not follows:
            rows.append([])
        if member.joints[k] in member.passive:
            rows[-1].append(member.joints[k])
        else:
            rows.append([])
    return rows


def _meet(joints: Sequence[MechanismJoint], size: float) -> bool:
    """Return True if the axes of hinges intersect in one point."""
    if any(joint.kind != "R" for joint in joints):
        return False
    if float(np.linalg.norm(np.cross(joints[0].axis, joints[1].axis))) < _MEET:
        return False
    point = meeting_point(joints[0], joints[1])
    apart = [float(np.linalg.norm(np.cross(point - joint.point, joint.axis))) for joint in joints]
    return max(apart) < _MEET * size

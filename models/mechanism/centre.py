"""Centre of a member: the point about which its couples are measured, by the rules of robots given joint by joint.

In this order: the mean of the passive joints on the platform where there are several; the passive spherical joint, or
the common point of three passive hinges that follow each other, nearest the platform; that of two hinges; the point of
the last passive joint. A nested loop between two hinges ends their row.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import FloatArray
from .graph import Mechanism, MechanismJoint
from .members import MemberGraph
from .motions import size_of
from .topology import Classes, bridges_between

#: Axes meet where their distance, in parts of the mechanism's size, or the sine of their angle, is below this: rounding
#: leaves 1e-15, also at configurations that Newton's method closed.
_MEET = 1e-9


def centre_of(mechanism: Mechanism, member: MemberGraph) -> FloatArray:
    """Return the centre (3,) of a member in the world frame, length."""
    joints = mechanism.joints
    if len(member.on_platform) > 1:
        return np.asarray(np.mean([joints[k].point for k in member.on_platform], axis=0))
    rows = _rows(mechanism, member)
    chain = [joint for row in rows for joint in row]
    size = size_of(mechanism)
    found: list[tuple[int, FloatArray]] = []
    for count in (3, 2):
        if count == 3:
            found += [(k, joint.point) for k, joint in enumerate(chain) if joint.kind == "S"]
        before = 0
        for row in rows:
            for k in range(len(row) - count + 1):
                point = _meeting_point(row[k : k + count], size)
                if point is not None:
                    found.append((before + k + count - 1, point))
            before += len(row)
        if found:
            return max(found, key=lambda each: each[0])[1]
    last = chain[-1:] or [joints[k] for k in (*member.on_platform, *reversed(member.joints))]
    return last[0].point


def _rows(mechanism: Mechanism, member: MemberGraph) -> list[list[MechanismJoint]]:
    """Return the passive joints that every path from base to platform has, in rows that follow each other directly."""
    classes = Classes([link.name for link in mechanism.links])
    for joint in mechanism.joints:
        if joint.kind == "weld":
            classes.merge(joint.inner, joint.outer)
    own = [mechanism.joints[k] for k in member.joints]
    edges = [(classes.find(joint.inner), classes.find(joint.outer)) for joint in own]
    path = bridges_between(classes.find(mechanism.base), classes.find(mechanism.platform), edges)
    passive = {mechanism.joints[k].name for k in member.passive}
    rows: list[list[MechanismJoint]] = [[]]
    for number, k in enumerate(path.bridges):
        follows = number > 0 and bool(set(edges[k]) & set(edges[path.bridges[number - 1]]))
        if not follows:
            rows.append([])
        if own[k].name in passive:
            rows[-1].append(own[k])
        else:
            rows.append([])
    return rows


def _meeting_point(joints: Sequence[MechanismJoint], size: float) -> FloatArray | None:
    """Return the point (3,) where the axes of hinges meet; None where they do not, or are parallel."""
    if any(joint.kind != "R" for joint in joints):
        return None
    one, other = joints[0], joints[1]
    normal = np.cross(one.axis, other.axis)
    if float(np.linalg.norm(normal)) < _MEET:
        return None
    along = float(np.cross(other.point - one.point, other.axis) @ normal) / float(normal @ normal)
    point = one.point + along * one.axis
    apart = [float(np.linalg.norm(np.cross(point - joint.point, joint.axis))) for joint in joints]
    return np.asarray(point) if max(apart) < _MEET * size else None

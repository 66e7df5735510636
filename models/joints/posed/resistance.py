"""Rows of J and members of a chain of joints: the chain's wrenches on the platform with locked actuators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...member import Member
from ...wrench import Wrench, force_along
from ..home.chain import Joint
from ..home.generic import PathFrame, free_screws, generic_rank
from ..home.motion import UNIT_VECTORS, AxisKind, Motion
from .cut import Cut
from .opened import OpenedPath


class Ranks(NamedTuple):
    """Ranks of a chain at almost all dimensions and joint coordinates.

    Attributes:
        passive: rank of the screws of the passive joints.
        all: rank of the screws of all joints.
        pinned: rank of the velocities that the other passive joints give to the centre of the spherical joint at the
            cut; None without such a joint.
    """

    passive: int
    all: int
    pinned: int | None


class Centre(NamedTuple):
    """Centre of a chain: point (3, 1) at home on the body after a joint.

    If ``slides`` is true, the centre is arbitrary along the joint's axis.
    """

    point: SX
    behind: int
    slides: bool = False


def path_ranks(frame: PathFrame, joints: Sequence[Joint], cut: Cut) -> Ranks:
    """Return the ranks of a chain of joints."""
    values = SX.sym("q", sum(len(joint.axes) for joint in joints))
    screws = free_screws(joints, values)
    passive = [j for j, joint in enumerate(joints) if not joint.actuated]

    def rank(columns: list[SX], rows: int = 6) -> int:
        return generic_rank(frame, joints, ca.horzcat(SX(rows, 0), *columns), values)

    pinned = None
    if cut.type == "S":
        at, k = Motion.none(), 0
        for joint in joints[: cut.joint]:
            for axis in joint.axes:
                at = at.after(axis.motion(values[k]))
                k += 1
        centre = at.point(joints[cut.joint].point)
        others = [screw for j in passive if j != cut.joint for screw in screws[j]]
        pinned = rank([_velocity(screw, centre) for screw in others], 3)
    return Ranks(
        passive=rank([screw for j in passive for screw in screws[j]]),
        all=rank([screw for own in screws for screw in own]),
        pinned=pinned,
    )


def resistance(limb: str, path: OpenedPath, ranks: Ranks, given: SX | None) -> tuple[list[Wrench], Member | None]:
    """Return the rows of J of a chain, and its member; no member if the chain resists by a few single rows.

    Args:
        limb: name of the limb.
        path: the chain.
        ranks: ranks of the chain.
        given: (3, 1) centre given by the user at home, length; None for the centre that a rule determines.
    """
    if ranks.pinned is not None and given is None:
        return _pinned(limb, path, ranks.pinned)
    if ranks.passive == 6:
        return [], None
    screws = [screw for joint, own in zip(path.joints, path.screws, strict=True) if not joint.actuated for screw in own]
    centre = _centre_of(path.joints, given)
    body = path.behind[centre.behind]
    joint = path.joints[centre.behind]
    is_cut = centre.behind == path.cut.joint and centre.point is joint.point and joint.type in ("R", "U")
    # In a closed loop the point of the joint at the cut is the same on both sides: the shorter expression is used.
    place = path.points[centre.behind] if body is None or is_cut else body.point(centre.point)
    axis = joint.axes[-1]
    slides = centre.slides and axis.kind is not AxisKind.PARALLELOGRAM  # whose point is that of its rods
    slide = axis.direction(path.screws[centre.behind][-1]) if slides else None
    return [], Member(limb, place, ca.horzcat(SX(6, 0), *screws), ranks.passive, (), slide=slide)


def _pinned(limb: str, path: OpenedPath, rank: int) -> tuple[list[Wrench], Member | None]:
    """Return the rows or the member of a chain with a spherical joint at the cut: forces through its centre."""
    centre = path.points[path.cut.joint]
    if rank == 3:
        return [], None
    if path.rod is not None:
        return [force_along(limb, centre, path.rod)], None
    others = [
        (axis.is_hinge, screw)
        for j, (joint, own) in enumerate(zip(path.joints, path.screws, strict=True))
        if not joint.actuated and j != path.cut.joint
        for axis, screw in zip(joint.axes, own, strict=True)
    ]
    velocities = [_velocity(screw, centre) for _, screw in others]
    if rank == 0:
        return [force_along(limb, centre, each) for each in UNIT_VECTORS], None
    if rank == 2 and len(others) == 2:
        return [force_along(limb, centre, ca.cross(velocities[0], velocities[1]))], None
    if rank == 1 and len(others) == 1 and others[0][0]:
        # The velocity w x d of a rotation about w is perpendicular to w.
        direction = others[0][1][:3]
        rows = [force_along(limb, centre, ca.cross(velocities[0], direction)), force_along(limb, centre, direction)]
        return rows, None
    screws = ca.horzcat(SX(6, 0), *[screw for _, screw in others])
    return [], Member(limb, centre, screws, rank, (), is_pinned=True)


def _centre_of(joints: Sequence[Joint], given: SX | None) -> Centre:
    """Return the centre of a chain without a spherical joint at the cut.

    In this order: the user's centre; the intersection of two successive passive rotations nearest the platform; the
    point of the last passive joint.

    Args:
        joints: joints from base to platform, with two intersecting rotations merged into a universal joint.
        given: (3, 1) centre given by the user at home, length; None for the centre that a rule determines.
    """
    passive = [j for j, joint in enumerate(joints) if not joint.actuated]
    last = passive[-1] if passive else len(joints) - 1
    if given is not None:
        return Centre(given, last)
    for j in reversed(passive):
        if joints[j].type == "U":  # two rotations that meet are a universal joint already
            return Centre(joints[j].point, j)
    return Centre(joints[last].point, last, slides=True)


def _velocity(screw: SX, point: SX) -> SX:
    """Return the velocity (3, 1) that a twist (6, 1) gives to a point (3, 1)."""
    return screw[3:] + ca.cross(screw[:3], point)

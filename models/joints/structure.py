"""Structure of a path of joints for people: its joints, the place where its loop is opened, and its numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import casadi as ca
from casadi import SX

from ..parts import Closure, JointScrews, PathStructure
from .chain import Joint
from .opened import OpenedPath
from .resistance import Ranks

#: A member with so many wrenches resists nearly every motion alike.
_MANY_WRENCHES = 5


def structure_of(limb: str, name: str, path: OpenedPath, ranks: Ranks, unknowns: int) -> PathStructure:
    """Return the structure of a path, whose loop equations count as kept.

    Args:
        limb: name of the limb.
        name: of the path: that of the limb, with the number of the branch where there are several.
        path: the path.
        ranks: of its screws.
        unknowns: number of its joint variables that are unknowns and that no path before it has.
    """
    written = [part for joint in path.joints for part in (joint.parts or (joint,))]
    count = len(path.equations)
    return PathStructure(
        limb=limb,
        name=name,
        joints=" ".join(f"{joint.type}*" if joint.actuated else joint.type for joint in written),
        opened=_opened(path),
        wrenches=6 - ranks.passive,
        constraints=6 - ranks.all,
        unknowns=unknowns,
        equations=count,
        kept=count,
    )


def joint_screws(limb: str, path: OpenedPath, ranks: Ranks, labels: Mapping[int, str]) -> JointScrews | None:
    """Return the current screws of a path's joints; None where those of a joint are not known.

    Args:
        limb: name of the limb.
        path: the path.
        ranks: of its screws.
        labels: of the joints as they are written, by identity.
    """
    if any(len(own) != len(joint.axes) for joint, own in zip(path.joints, path.screws, strict=True)):
        return None
    names = [name for joint in path.joints for name in _column_labels(joint, labels)]
    driven = [joint.actuated for joint in path.joints for _ in joint.axes]
    screws = ca.horzcat(SX(6, 0), *[screw for own in path.screws for screw in own])
    indices = tuple(k for k, is_driven in enumerate(driven) if is_driven)
    return JointScrews(limb, tuple(names), screws, indices, ranks.passive, ranks.all)


def _column_labels(joint: Joint, labels: Mapping[int, str]) -> list[str]:
    """Return the label of the joint of each axis; the three axes of a ball joint are along those of the world."""
    written = joint.parts or (joint,)
    if joint.type == "S" and len(written) > 1:
        return [f"{labels[id(written[0])]} to {labels[id(written[-1])]}"] * len(joint.axes)
    return [labels[id(part)] for part in written for _ in part.axes]


def with_kept(structures: Iterable[PathStructure], kept: Collection[Closure]) -> tuple[PathStructure, ...]:
    """Return structures with the numbers of their loop equations among those that a program keeps."""
    names = {each.name for each in kept}
    return tuple(
        replace(each, kept=sum(f"loop {each.name} ({k + 1})" in names for k in range(each.equations)))
        for each in structures
    )


def member_remarks(structures: Sequence[PathStructure]) -> list[str]:
    """Return remarks on members of so many wrenches, or so few members, that F says little about the robot.

    F is a sum over members of orthonormal wrenches: within one member it has no conditioning.
    """
    members = [each for each in structures if each.wrenches > 0]
    if len(members) == 1:
        text = (
            "the robot has one member only, so F says little: within a member F does not tell good directions from bad"
        )
        return [text]
    names = [each.name for each in members if each.wrenches >= _MANY_WRENCHES]
    if not names:
        return []
    who = f"member {names[0]} resists" if len(names) == 1 else f"members {', '.join(names)} resist"
    words = f"{who} with {_MANY_WRENCHES} wrenches or more, so that part of F says little"
    return [f"{words}: within a member F does not tell good directions from bad"]


def _opened(path: OpenedPath) -> str:
    """Return the place at which a path is opened, in words, with the numbers of its joints as they are written."""
    first: list[int] = [1]
    for joint in path.joints:
        first.append(first[-1] + (len(joint.parts) or 1))
    cut = path.cut
    if cut.far is not None:
        start, end = sorted((cut.far, cut.joint))
        words = "driven rod" if cut.slide is not None else "rod"
        return f"{words} between joints {first[start]} and {first[end]}"
    if not cut.type:
        return f"behind joint {first[cut.first] - 1}"
    last = first[cut.joint + 1] - 1
    joints = f"joint {last}" if last == first[cut.joint] else f"joints {first[cut.joint]} to {last}"
    return f"{joints} ({cut.type})"

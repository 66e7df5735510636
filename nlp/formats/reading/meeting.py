"""Merging of joints: coaxial hinges, three intersecting hinges (spherical joint), and pairs of joints.

In the tables of a robot file, two intersecting hinges become a universal joint, and a hinge and a slide along its axis
become a cylindrical joint. Joints are merged only if their axes meet to rounding, because the wrenches of a limb depend
on that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....models.mechanism import Mechanism, MechanismJoint
from ....models.mechanism.centre import meeting_point
from ...errors import listing
from .description import common_name
from .elements import SAME_POINT

#: Distance, relative to the robot's size, or sine of the angle, below which axes almost meet or are almost parallel:
#: rounding of values with three digits is smaller.
ALMOST = 1e-3
#: Smallest volume spanned by three unit axes of a spherical joint. Below it the axes are nearly in one plane, and the
#: stated configuration is a wrist singularity.
_FLAT = 1e-3
#: Largest number of names in a note.
_MOST_NAMES = 12


def with_meeting_joints(given: Mechanism, size: float) -> tuple[Mechanism, list[str]]:
    """Return a mechanism with coaxial passive hinges merged, and three intersecting ones as a spherical joint.

    Only adjacent hinges without couplings are merged.

    Args:
        given: the mechanism.
        size: characteristic size of the robot, length.

    Returns:
        Mechanism, and notes about the merged joints.
    """
    hinges: list[str] = []
    while (joined := _same_axis(given, size)) is not None:
        given, words = joined
        hinges.append(words)
    balls: list[str] = []
    while (joined := _ball(given, size)) is not None:
        given, words = joined
        balls.append(words)
    notes = [f"coaxial hinges were merged: {_some(hinges)}"] if hinges else []
    notes += [f"three intersecting hinges were merged to a spherical joint: {_some(balls)}"] if balls else []
    return given, notes


def _some(words: list[str]) -> str:
    """Return the first few texts as a list."""
    return listing(words[:_MOST_NAMES]) + (f" and {len(words) - _MOST_NAMES} more" if len(words) > _MOST_NAMES else "")


def chains_of(given: Mechanism) -> list[list[MechanismJoint]]:
    """Return the chains of joints between branching links; base and platform count as branching links."""
    of_link = _joints_of_links(given)
    ends = {name for name, joints in of_link.items() if len(joints) != 2} | {given.base, given.platform}
    found: list[list[MechanismJoint]] = []
    seen: set[str] = set()
    for link in [each.name for each in given.links if each.name in ends]:
        for joint in of_link.get(link, []):
            if joint.name in seen:
                continue
            chain, at, step = [joint], _other(joint, link), joint
            seen.add(joint.name)
            while at not in ends:
                step = next(each for each in of_link[at] if each.name != step.name)
                chain.append(step)
                seen.add(step.name)
                at = _other(step, at)
            found.append(chain)
    return found


def axes_gap(one: MechanismJoint, other: MechanismJoint) -> tuple[float, float]:
    """Return the distance between two axes, and the sine of their angle."""
    normal = np.cross(one.axis, other.axis)
    sine, apart = float(np.linalg.norm(normal)), other.point - one.point
    if sine < ALMOST:
        return float(np.linalg.norm(np.cross(one.axis, apart))), sine
    return abs(float(apart @ normal)) / sine, sine


def _joints_of_links(given: Mechanism) -> dict[str, list[MechanismJoint]]:
    found: dict[str, list[MechanismJoint]] = {}
    for joint in given.joints:
        found.setdefault(joint.inner, []).append(joint)
        found.setdefault(joint.outer, []).append(joint)
    return found


def _other(joint: MechanismJoint, link: str) -> str:
    return joint.outer if joint.inner == link else joint.inner


def _runs(given: Mechanism, length: int) -> list[list[MechanismJoint]]:
    """Return all sequences of ``length`` adjacent passive hinges without couplings."""
    coupled = {name for each in given.couplings for name, _ in each.factors}
    found = []
    for chain in chains_of(given):
        for start in range(len(chain) - length + 1):
            run = chain[start : start + length]
            if all(each.kind == "R" and not each.actuated and each.name not in coupled for each in run):
                found.append(run)
    return found


def _same_axis(given: Mechanism, size: float) -> tuple[Mechanism, str] | None:
    """Return the mechanism with two coaxial hinges merged, and a note; None if there are none."""
    for one, other in _runs(given, 2):
        distance, sine = axes_gap(one, other)
        if sine < SAME_POINT and distance < SAME_POINT * size:
            merged = _replaced(given, [one, other], replace(one, range=None))
            return merged, f"{one.name} with {other.name}"
    return None


def _ball(given: Mechanism, size: float) -> tuple[Mechanism, str] | None:
    """Return the mechanism with three intersecting hinges merged, and a note; None if there are none."""
    for run in _runs(given, 3):
        one, two, _ = run
        if abs(float(np.linalg.det(np.array([each.axis for each in run])))) < _FLAT:
            continue
        point = meeting_point(one, two)
        off = [np.linalg.norm(np.cross(each.axis, point - each.point)) for each in run]
        if max(off) < SAME_POINT * size:
            common = common_name([each.name for each in run])
            is_unique = common and not any(each.name.startswith(common) for each in given.joints if each not in run)
            ball = replace(
                one,
                name=common if is_unique else run[0].name,
                kind="S",
                point=point,
                axis=np.zeros(3),
                range=None,
            )
            return _replaced(given, run, ball), ball.name
    return None


def _replaced(given: Mechanism, run: list[MechanismJoint], joint: MechanismJoint) -> Mechanism:
    """Return a mechanism with several adjacent joints replaced by one joint, without the links between them."""
    counts: dict[str, int] = {}
    for each in run:
        for link in (each.inner, each.outer):
            counts[link] = counts.get(link, 0) + 1
    inside = {link for link, count in counts.items() if count == 2}
    inner, outer = (link for link, count in counts.items() if count == 1)
    if run[0].inner == outer or run[-1].outer == inner:
        inner, outer = outer, inner
    # The axis is reversed if inner and outer link are exchanged, so that the joint coordinate keeps its sign.
    turned = joint.kind == "R" and joint.inner != inner
    new = replace(joint, inner=inner, outer=outer, axis=-joint.axis if turned else joint.axis)
    names = {each.name for each in run}
    first = next(each.name for each in given.joints if each.name in names)
    return replace(
        given,
        links=tuple(each for each in given.links if each.name not in inside),
        joints=tuple(
            new if each.name == first else each for each in given.joints if each.name == first or each.name not in names
        ),
    )


def with_universal_joints(tables: Mapping[str, Any], size: float) -> dict[str, Any]:
    """Return the tables of a robot file with pairs of passive joints merged to joints ``U`` or ``C``.

    Args:
        tables: tables of the robot file, with numbers; a file with links and joints is not changed.
        size: characteristic size of the robot, length.
    """
    if "limb" not in tables:
        return dict(tables)
    return {**tables, "limb": [_limb(limb, size) for limb in tables["limb"]]}


def _limb(limb: Mapping[str, Any], size: float) -> dict[str, Any]:
    """Return a limb with pairs of joints merged, separately before and after a branching."""
    found = dict(limb)
    if "joints" in limb:
        found["joints"] = _paired(limb["joints"], size)
    if "branch" in limb:
        found["branch"] = [{**branch, "joints": _paired(branch["joints"], size)} for branch in limb["branch"]]
    return found


def _paired(joints: Sequence[Mapping[str, Any]], size: float) -> list[dict[str, Any]]:
    """Return joints with pairs of neighbouring joints merged."""
    found: list[dict[str, Any]] = []
    rest = [dict(joint) for joint in joints]
    while rest:
        first = rest.pop(0)
        pair = None if not rest else _pair(first, rest[0], size)
        if pair is not None:
            rest.pop(0)
        found.append(pair or first)
    return found


def _pair(one: Mapping[str, Any], other: Mapping[str, Any], size: float) -> dict[str, Any] | None:
    """Return the joint equivalent to two joints; None if there is none."""
    kinds = one["type"], other["type"]
    if one.get("actuated") or other.get("actuated") or kinds not in (("R", "R"), ("R", "P"), ("P", "R")):
        return None
    first, second = (
        MechanismJoint("", each["type"], "", "", np.array(each["at"]), np.array(each["axis"])) for each in (one, other)
    )
    named = {"name": one["name"]} if "name" in one else {}
    distance, sine = axes_gap(first, second)
    if kinds == ("R", "R"):
        if sine < ALMOST or distance > SAME_POINT * size:
            return None
        meeting = meeting_point(first, second)
        at = one["at"] if float(np.linalg.norm(meeting - first.point)) <= SAME_POINT * size else meeting.tolist()
        return {"type": "U", **named, "at": at, "axes": [one["axis"], other["axis"]]}
    if sine > SAME_POINT:
        return None
    hinge = one if kinds[0] == "R" else other
    return {"type": "C", **named, "at": hinge["at"], "axis": hinge["axis"]}

"""Joints that stand for one: hinges about one axis, three hinges through one point, which are a ball, and pairs.

In the tables of a robot file two crossing hinges are a universal joint, and a hinge and a slide along it are a ``C``.
The wrenches of a limb depend on axes that meet exactly. Joints are replaced only where they do.
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

#: Axes whose distance, in parts of the robot's size, or whose sine is below this almost meet or are almost parallel:
#: decimals that are typed with three digits are nearer.
ALMOST = 1e-3
#: Smallest volume that three unit axes span as a ball joint. Below it they are nearly in one plane, and the stated
#: configuration is the singular one of a wrist.
_FLAT = 1e-3
#: Most names that a note lists.
_MOST_NAMES = 12


def with_meeting_joints(given: Mechanism, size: float) -> tuple[Mechanism, list[str]]:
    """Return a mechanism with passive hinges about one axis as one hinge, and three through one point as a ball.

    Only hinges with nothing else between them are replaced, and none that a coupling names. Notes say which.

    Args:
        given: the mechanism.
        size: of the robot.
    """
    hinges: list[str] = []
    while (joined := _same_axis(given, size)) is not None:
        given, words = joined
        hinges.append(words)
    balls: list[str] = []
    while (joined := _ball(given, size)) is not None:
        given, words = joined
        balls.append(words)
    notes = [f"hinges about one axis were read as one hinge: {_some(hinges)}"] if hinges else []
    notes += [f"three hinges through one point were read as a ball joint: {_some(balls)}"] if balls else []
    return given, notes


def _some(words: list[str]) -> str:
    """Return the first of many words as a list."""
    return listing(words[:_MOST_NAMES]) + (f" and {len(words) - _MOST_NAMES} more" if len(words) > _MOST_NAMES else "")


def chains_of(given: Mechanism) -> list[list[MechanismJoint]]:
    """Return the sequences of joints between links that have more than two joints, or are base or platform."""
    own = _joints_of_links(given)
    ends = {name for name, joints in own.items() if len(joints) != 2} | {given.base, given.platform}
    found: list[list[MechanismJoint]] = []
    seen: set[str] = set()
    for link in [each.name for each in given.links if each.name in ends]:
        for joint in own.get(link, []):
            if joint.name in seen:
                continue
            chain, at, step = [joint], _other(joint, link), joint
            seen.add(joint.name)
            while at not in ends:
                step = next(each for each in own[at] if each.name != step.name)
                chain.append(step)
                seen.add(step.name)
                at = _other(step, at)
            found.append(chain)
    return found


def axes_gap(one: MechanismJoint, other: MechanismJoint) -> tuple[float, float]:
    """Return the distance of two axes, and the sine of their angle."""
    normal = np.cross(one.axis, other.axis)
    sine, apart = float(np.linalg.norm(normal)), other.point - one.point
    if sine < ALMOST:
        return float(np.linalg.norm(np.cross(one.axis, apart))), sine
    return abs(float(apart @ normal)) / sine, sine


def _joints_of_links(given: Mechanism) -> dict[str, list[MechanismJoint]]:
    own: dict[str, list[MechanismJoint]] = {}
    for joint in given.joints:
        own.setdefault(joint.inner, []).append(joint)
        own.setdefault(joint.outer, []).append(joint)
    return own


def _other(joint: MechanismJoint, link: str) -> str:
    return joint.outer if joint.inner == link else joint.inner


def _runs(given: Mechanism, length: int) -> list[list[MechanismJoint]]:
    """Return all sequences of so many passive hinges that follow each other."""
    coupled = {name for each in given.couplings for name, _ in each.factors}
    found = []
    for chain in chains_of(given):
        for start in range(len(chain) - length + 1):
            run = chain[start : start + length]
            if all(each.kind == "R" and not each.actuated and each.name not in coupled for each in run):
                found.append(run)
    return found


def _same_axis(given: Mechanism, size: float) -> tuple[Mechanism, str] | None:
    """Return the mechanism with two hinges about one axis as one; None where there are none."""
    for one, other in _runs(given, 2):
        distance, sine = axes_gap(one, other)
        if sine < SAME_POINT and distance < SAME_POINT * size:
            merged = _replaced(given, [one, other], replace(one, range=None))
            return merged, f"{one.name} with {other.name}"
    return None


def _ball(given: Mechanism, size: float) -> tuple[Mechanism, str] | None:
    """Return the mechanism with three hinges through one point as a ball; None where there are none."""
    for run in _runs(given, 3):
        one, two, _ = run
        if abs(float(np.linalg.det(np.array([each.axis for each in run])))) < _FLAT:
            continue
        point = meeting_point(one, two)
        off = [np.linalg.norm(np.cross(each.axis, point - each.point)) for each in run]
        if max(off) < SAME_POINT * size:
            common = common_name([each.name for each in run])
            is_own = common and not any(each.name.startswith(common) for each in given.joints if each not in run)
            ball = replace(
                one,
                name=common if is_own else run[0].name,
                kind="S",
                point=point,
                axis=np.zeros(3),
                range=None,
            )
            return _replaced(given, run, ball), ball.name
    return None


def _replaced(given: Mechanism, run: list[MechanismJoint], joint: MechanismJoint) -> Mechanism:
    """Return a mechanism with one joint in the place of several that follow each other, without the links between."""
    counts: dict[str, int] = {}
    for each in run:
        for link in (each.inner, each.outer):
            counts[link] = counts.get(link, 0) + 1
    inside = {link for link, count in counts.items() if count == 2}
    inner, outer = (link for link, count in counts.items() if count == 1)
    if run[0].inner == outer or run[-1].outer == inner:
        inner, outer = outer, inner
    # The axis of a hinge that was read from its other side is turned over, so that its coordinate keeps its sign.
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
    """Return the tables of a robot file with limbs, with pairs of passive joints as one joint ``U`` or ``C``.

    Args:
        tables: of the robot file, with numbers; one with links and joints stays as it is.
        size: of the robot.
    """
    if "limb" not in tables:
        return dict(tables)
    return {**tables, "limb": [_limb(limb, size) for limb in tables["limb"]]}


def _limb(limb: Mapping[str, Any], size: float) -> dict[str, Any]:
    """Return a limb with its joints paired; those before and behind a branching are paired apart."""
    found = dict(limb)
    if "joints" in limb:
        found["joints"] = _paired(limb["joints"], size)
    if "branch" in limb:
        found["branch"] = [{**branch, "joints": _paired(branch["joints"], size)} for branch in limb["branch"]]
    return found


def _paired(joints: Sequence[Mapping[str, Any]], size: float) -> list[dict[str, Any]]:
    """Return joints with pairs as one."""
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
    """Return two joints as one; None where they are not."""
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

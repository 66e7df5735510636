"""The links of a path as segments between the centres of joints, for distances between links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import casadi as ca
from casadi import SX

from ..limbjoints import LimbLink
from .generic import INCIDENT
from .opened import OpenedPath, PathFrame
from .states import is_zero


def limb_links(path: OpenedPath, labels: Mapping[int, str], frame: PathFrame) -> list[LimbLink]:
    """Return the links of a path, from the base on.

    Of joints that have one centre at home, the one nearest the base is an end of links. A slide along the line between
    its neighbours is no end: the link is then as long as the slide makes it.

    Args:
        path: the path.
        labels: of the joints, by identity.
        frame: values that all paths of the robot share.
    """
    ends: list[int] = []
    for j, joint in enumerate(path.joints):
        if not any(is_zero(joint.point - path.joints[k].point, frame) for k in ends[-1:]):
            ends.append(j)
    ends = [
        j for i, j in enumerate(ends) if not (0 < i < len(ends) - 1 and _is_along(path, ends[i - 1 : i + 2], frame))
    ]
    links = []
    for one, other in pairwise(ends):
        names = [labels[id((path.joints[j].parts or (path.joints[j],))[0])] for j in (one, other)]
        start = _place(path, one)
        links.append(LimbLink(" to ".join(names), frozenset(names), start, _place(path, other) - start))
    return links


def _place(path: OpenedPath, j: int) -> SX:
    """Return the current place (3, 1) of a joint on the body behind it: that of a slide moves."""
    behind = path.behind[j]
    return path.points[j] if behind is None else behind.point(path.joints[j].point)


def _is_along(path: OpenedPath, joints: Sequence[int], frame: PathFrame) -> bool:
    """Return whether the second of three joints is a slide along the line between the others."""
    before, slide, behind = (path.joints[j] for j in joints)
    if slide.type != "P":
        return False
    axis = slide.axes[0].axis
    off = ca.vertcat(ca.cross(slide.point - before.point, axis), ca.cross(behind.point - slide.point, axis))
    return all(value < INCIDENT for value in frame.sampled(ca.norm_2(off) / frame.size))


def with_shared_places(paths: Sequence[tuple[OpenedPath, list[LimbLink]]], frame: PathFrame) -> tuple[LimbLink, ...]:
    """Return the links of all paths, with one name for joints of the base, or of the platform, that have one centre.

    Args:
        paths: each path with its links.
        frame: values that all paths of the robot share.
    """
    found = [link for _, links in paths for link in links]
    names: dict[str, str] = {}
    for side in (0, -1):
        known: list[tuple[str, SX]] = []
        for path, links in paths:
            if not links:
                continue
            label = links[side].name.split(" to ")[side]
            point = path.joints[side].point
            same = next((name for name, other in known if is_zero(point - other, frame)), None)
            known += [] if same else [(label, point)]
            names.setdefault(label, same or label)
    unique = {link.name: link for link in found}
    return tuple(
        LimbLink(link.name, frozenset(names.get(end, end) for end in link.ends), link.start, link.span)
        for link in unique.values()
    )

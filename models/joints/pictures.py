"""The drawing of a robot given joint by joint: its joints' places, lines along limbs, and the platform's outline."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from casadi import SX

from ..drawing import Body, Link, Point, Scene
from ..parts import PoseSymbols
from .opened import OpenedPath, PathFrame

#: Joints nearer to each other than this part of the robot's size are at one point.
_APART = 1e-6


def scene_of(paths: Sequence[tuple[str, OpenedPath]], pose: PoseSymbols, frame: PathFrame) -> Scene:
    """Return the drawing of paths with the names of their limbs, at a pose."""
    points: list[Point] = []
    links: list[Link] = []
    ends: list[tuple[str, str]] = []
    for k, (limb, path) in enumerate(paths):
        several = sum(name == limb for name, _ in paths) > 1
        own = f"{limb}.{sum(name == limb for name, _ in paths[: k + 1])}" if several else limb
        shown = _places(path, frame)
        names = [f"{own}:{j + 1}" for j, _ in shown]
        bodies = [Body.BASE, *[Body.LIMB] * (len(shown) - 2), Body.PLATFORM][: len(shown)]
        points += [Point(name, place, body) for name, (_, place), body in zip(names, shown, bodies, strict=True)]
        if len(names) == 1:
            links.append(Link(names[0], "P", Body.LIMB, limb))
        links += [Link(one, other, Body.LIMB, limb) for one, other in itertools.pairwise(names)]
        if len(names) > 1:
            ends.append((names[0], names[-1]))
    points.append(Point("P", pose.position, Body.PLATFORM))
    for side, body in ((0, Body.BASE), (1, Body.PLATFORM)):
        outline = list(dict.fromkeys(end[side] for end in ends))
        following = outline[1:] + outline[:1]
        if len(outline) > 2:
            links += [Link(one, other, body) for one, other in zip(outline, following, strict=True)]
    return Scene(tuple(points), tuple(links))


def _places(path: OpenedPath, frame: PathFrame) -> list[tuple[int, SX]]:
    """Return index and place of each joint that the picture shows.

    A joint at the place of the one before it, and the slide of a rod, add no corner to the limb. The joints of a
    spherical limb, all at one point, are shown along their axes.
    """
    home = [frame.typical_value(joint.point) for joint in path.joints]
    size = frame.typical_value(frame.size).item()

    def apart(one: int, other: int) -> bool:
        return float(np.abs(home[one] - home[other]).max()) > _APART * size

    turning = all(joint.type in ("R", "U") for joint in path.joints)
    if turning and not any(apart(0, j) for j in range(len(home))) and all(path.screws):
        return [
            (j, place + frame.size * own[0][:3])
            for j, (place, own) in enumerate(zip(path.points, path.screws, strict=True))
        ]
    kept = [0]
    for j in range(1, len(home)):
        if j != path.cut.slide and apart(kept[-1], j):
            kept.append(j)
    return [(j, path.points[j]) for j in kept]

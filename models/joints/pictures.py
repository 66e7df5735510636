"""The drawing of a robot given joint by joint: its joints' places, lines along limbs, and the platform's outline."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from ..drawing import Body, Link, Point, Scene
from ..parts import PoseSymbols
from .opened import OpenedPath


def scene_of(paths: Sequence[tuple[str, OpenedPath]], pose: PoseSymbols) -> Scene:
    """Return the drawing of paths with the names of their limbs, at a pose."""
    points: list[Point] = []
    links: list[Link] = []
    ends: list[tuple[str, str]] = []
    for k, (limb, path) in enumerate(paths):
        several = sum(name == limb for name, _ in paths) > 1
        own = f"{limb}.{sum(name == limb for name, _ in paths[: k + 1])}" if several else limb
        last = len(path.points) - 1
        names = []
        for j, place in enumerate(path.points):
            body = Body.BASE if j == 0 else Body.PLATFORM if j == last else Body.LIMB
            names.append(f"{own}:{j + 1}")
            points.append(Point(names[-1], place, body))
        links += [Link(one, other, Body.LIMB, limb) for one, other in itertools.pairwise(names)]
        ends.append((names[0], names[-1]))
    points.append(Point("P", pose.position, Body.PLATFORM))
    for side, body in ((0, Body.BASE), (1, Body.PLATFORM)):
        outline = list(dict.fromkeys(end[side] for end in ends))
        following = outline[1:] + outline[:1]
        if len(outline) > 2:
            links += [Link(one, other, body) for one, other in zip(outline, following, strict=True)]
    return Scene(tuple(points), tuple(links))

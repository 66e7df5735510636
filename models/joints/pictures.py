"""The drawing of a robot given joint by joint: its joints' places, lines along limbs, and outlines of both plates."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from casadi import SX

from ..arrays import FloatArray
from ..drawing import Body, Link, Point, Scene
from ..parts import PoseSymbols
from .opened import OpenedPath, PathFrame

#: Joints nearer to each other than this part of the robot's size are at one point.
_APART = 1e-6


class _Corner(NamedTuple):
    """A joint that the picture shows: its index, its place (3, 1), and its place (3,) at home; length."""

    joint: int
    place: SX
    home: FloatArray


def scene_of(paths: Sequence[tuple[str, OpenedPath]], pose: PoseSymbols, frame: PathFrame) -> Scene:
    """Return the drawing of paths with the names of their limbs, at a pose."""
    points: list[Point] = []
    links: list[Link] = []
    ends: list[tuple[str, str]] = []
    home: dict[str, FloatArray] = {}
    for k, (limb, path) in enumerate(paths):
        several = sum(name == limb for name, _ in paths) > 1
        own = f"{limb}.{sum(name == limb for name, _ in paths[: k + 1])}" if several else limb
        corners = _corners(path, frame)
        names = [f"{own}:{corner.joint + 1}" for corner in corners]
        home |= {name: corner.home for name, corner in zip(names, corners, strict=True)}
        bodies = [Body.BASE, *[Body.LIMB] * (len(names) - 2), Body.PLATFORM][: len(names)]
        points += [Point(name, corner.place, body) for name, corner, body in zip(names, corners, bodies, strict=True)]
        links += [Link(one, other, Body.LIMB, limb) for one, other in itertools.pairwise(names)]
        if len(names) == 1:
            links.append(Link(names[0], "P", Body.LIMB, limb))
        else:
            ends.append((names[0], names[-1]))
    points.append(Point("P", pose.position, Body.PLATFORM))
    for side, body in ((0, Body.BASE), (1, Body.PLATFORM)):
        outline = _around([end[side] for end in ends], home)
        if len(outline) > 2:
            links += [Link(one, other, body) for one, other in itertools.pairwise([*outline, outline[0]])]
    return Scene(tuple(points), tuple(links))


def _around(names: Sequence[str], home: dict[str, FloatArray]) -> list[str]:
    """Return names of points in their order around the point in their middle, at home."""
    away = np.array([home[name] for name in names]).reshape(-1, 3)
    away = away - (away.mean(axis=0) if len(away) else 0.0)
    axes = np.linalg.svd(away)[2]
    angles = np.arctan2(away @ axes[1], away @ axes[0])
    return [names[int(k)] for k in np.argsort(angles, kind="stable")]


def _corners(path: OpenedPath, frame: PathFrame) -> list[_Corner]:
    """Return the joints of a path that the picture shows.

    A joint at the place of the one before it, and the slide of a rod, add no corner to the limb. The joints of a
    spherical limb, all at one point, are shown along their axes.
    """
    home = [frame.typical_value(joint.point).ravel() for joint in path.joints]
    size = frame.typical_value(frame.size).item()

    def apart(one: int, other: int) -> bool:
        return float(np.abs(home[one] - home[other]).max()) > _APART * size

    turning = all(joint.type in ("R", "U") for joint in path.joints) and all(path.screws)
    if turning and not any(apart(0, j) for j in range(len(home))):
        ends = zip(path.joints, path.points, path.screws, strict=True)
        return [
            _Corner(
                j, place + frame.size * own[0][:3], home[j] + size * frame.typical_value(joint.axes[0].axis).ravel()
            )
            for j, (joint, place, own) in enumerate(ends)
        ]
    kept = [0]
    for j in range(1, len(home)):
        if j != path.cut.slide and apart(kept[-1], j):
            kept.append(j)
    return [_Corner(j, path.points[j], home[j]) for j in kept]

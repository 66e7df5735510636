"""Lines and sizes with which a link is shown, and placeholders of its mass: the robot's model has neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ....models import FloatArray
from ....models.drawing import outline
from ....models.mechanism import Mechanism

#: Joints nearer to each other than this part of the robot's size are at one place.
_NEAR = 1e-9
#: Radii of a link's lines and of the mark of a joint, and half the length of a hinge's mark, in parts of the size.
ROD, MARK, PIN = 0.008, 0.014, 0.02
#: Mass of a link, and of a link without extent, such as a universal joint's cross: placeholders.
MASS, SMALL_MASS = 1.0, 0.05
#: Radius of gyration of a link in parts of the robot's size: a placeholder.
_GYRATION = 0.1


@dataclass(frozen=True, eq=False)
class Shape:
    """A link as it is shown.

    Attributes:
        points: (3,) each, different places of its joints in the world, length.
        lines: pairs of indices of the points.
        mass: placeholder.
        inertia: placeholder, about every axis through the middle of the points: mass times length squared.
    """

    points: tuple[FloatArray, ...]
    lines: tuple[tuple[int, int], ...]
    mass: float
    inertia: float


def extent(mechanism: Mechanism) -> float:
    """Return the diagonal of the box around all joints, or 1 where all are at one place, length."""
    points = np.array([joint.point for joint in mechanism.joints])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def joint_centres(mechanism: Mechanism, link: str, size: float) -> list[tuple[FloatArray, list[str]]]:
    """Return the different places (3,) of a link's joints in the world, each with the names of the joints there."""
    found: list[tuple[FloatArray, list[str]]] = []
    for joint in mechanism.joints:
        if link in (joint.inner, joint.outer):
            known = (names for point, names in found if np.linalg.norm(joint.point - point) <= _NEAR * size)
            names = next(known, None)
            found.append((joint.point, [joint.name])) if names is None else names.append(joint.name)
    return found


def shape_of(mechanism: Mechanism, link: str, size: float) -> Shape:
    """Return a link as it is shown: the line between two joints, or the outline of more with lines to those inside.

    Args:
        mechanism: the mechanism.
        link: name of the link.
        size: the robot's.
    """
    points = [point for point, _ in joint_centres(mechanism, link, size)]
    lines = _lines(points)
    mass = MASS if lines else SMALL_MASS
    return Shape(tuple(points), tuple(lines), mass, mass * (_GYRATION * size) ** 2)


def _lines(points: Sequence[FloatArray]) -> list[tuple[int, int]]:
    """Return the lines of an outline, and from points inside to the nearest corner."""
    if len(points) < 2:
        return []
    corners = outline(np.array(points))
    if len(corners) == 2:
        ordered = sorted(range(len(points)), key=lambda k: float(np.linalg.norm(points[k] - points[corners[0]])))
        return list(pairwise(ordered))
    lines = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    inside = [k for k in range(len(points)) if k not in corners]
    return lines + [(k, min(corners, key=lambda c: float(np.linalg.norm(points[c] - points[k])))) for k in inside]

"""Displayed lines of links, and placeholders of their masses, which the model of a robot does not define."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ....models import FloatArray
from ....models.drawing import outline
from ....models.mechanism import Mechanism

#: Distance, relative to the robot's size, below which joint centres coincide.
_NEAR = 1e-9
#: Radii of lines and of joint marks, and half length of a hinge's mark, relative to the robot's size.
ROD, MARK, PIN = 0.008, 0.014, 0.02
#: Placeholders: mass of a link, and of a link without extent, such as the cross of a universal joint.
MASS, SMALL_MASS = 1.0, 0.05
#: Placeholder: radius of gyration of a link relative to the robot's size.
_GYRATION = 0.1


@dataclass(frozen=True, eq=False)
class Shape:
    """Displayed shape of a link.

    Attributes:
        points: (3,) each, different joint centres of the link in the world frame, length.
        lines: pairs of indices of the points that are connected by a line.
        mass: placeholder of the mass.
        inertia: placeholder of the moment of inertia about every axis through the mean of the points.
    """

    points: tuple[FloatArray, ...]
    lines: tuple[tuple[int, int], ...]
    mass: float
    inertia: float


def extent(mechanism: Mechanism) -> float:
    """Return the diagonal of the box around all joint centres, length; 1 if all coincide."""
    points = np.array([joint.point for joint in mechanism.joints])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def joint_centres(mechanism: Mechanism, link: str, size: float) -> list[tuple[FloatArray, list[str]]]:
    """Return the different joint centres (3,) of a link in the world frame, each with the names of its joints.

    Args:
        mechanism: the mechanism.
        link: name of the link.
        size: characteristic size of the robot, length.
    """
    found: list[tuple[FloatArray, list[str]]] = []
    for joint in mechanism.joints:
        if link in (joint.inner, joint.outer):
            known = (names for point, names in found if np.linalg.norm(joint.point - point) <= _NEAR * size)
            names = next(known, None)
            found.append((joint.point, [joint.name])) if names is None else names.append(joint.name)
    return found


def shape_of(mechanism: Mechanism, link: str, size: float) -> Shape:
    """Return the displayed shape of a link: a line between two joints, or an outline with lines to inner joints.

    Args:
        mechanism: the mechanism.
        link: name of the link.
        size: characteristic size of the robot, length.
    """
    points = [point for point, _ in joint_centres(mechanism, link, size)]
    lines = _lines(points)
    mass = MASS if lines else SMALL_MASS
    return Shape(tuple(points), tuple(lines), mass, mass * (_GYRATION * size) ** 2)


def _lines(points: Sequence[FloatArray]) -> list[tuple[int, int]]:
    """Return the lines of the outline of points, and a line from each inner point to the nearest corner."""
    if len(points) < 2:
        return []
    corners = outline(np.array(points))
    if len(corners) == 2:
        ordered = sorted(range(len(points)), key=lambda k: float(np.linalg.norm(points[k] - points[corners[0]])))
        return list(pairwise(ordered))
    lines = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    inside = [k for k in range(len(points)) if k not in corners]
    return lines + [(k, min(corners, key=lambda c: float(np.linalg.norm(points[c] - points[k])))) for k in inside]

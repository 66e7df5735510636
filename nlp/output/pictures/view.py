"""Parallel projection of a robot, which keeps proportions, and the order in which lines cover each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....models import FloatArray, LinkKind
from .drawing import Drawing

#: Azimuths that are tried for a view, and its elevation, in degrees.
_AZIMUTHS = range(-170, 190, 10)
_ELEVATION = 18.0
#: A robot given joint by joint that is lower than this part of its size is seen from above, x to the right.
_FLAT = 0.1
#: Part of the axis z, in parts of the robot's size, that limbs should not cover.
_SHOWN_Z = 0.12
#: Places on a link, in parts of its length, whose distances on paper are compared.
_PARTS = (0.2, 0.35, 0.5, 0.65, 0.8)
#: Two lines that cross on paper nearer to an end than this part of their lengths are joined there, and do not cross.
_JOINED = 0.02


@dataclass(frozen=True)
class View:
    """A parallel projection along a direction, z upwards on paper.

    Attributes:
        azimuth: angle of the eye about z, from x towards y, degrees.
        elevation: angle of the eye above the plane of x and y, degrees.
    """

    azimuth: float
    elevation: float = _ELEVATION

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: the direction to the right on paper, upwards on paper, and towards the eye."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array(
            [
                [-math.sin(a), math.cos(a), 0.0],
                [-math.sin(e) * math.cos(a), -math.sin(e) * math.sin(a), math.cos(e)],
                [math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)],
            ]
        )

    def project(self, points: FloatArray) -> FloatArray:
        """Return the places on paper (..., 2) of points (..., 3), in the points' own unit."""
        return np.asarray(points @ self.axes[:2].T)

    def depth(self, points: FloatArray) -> FloatArray:
        """Return how near points (..., 3) are to the eye: their coordinate towards it."""
        return np.asarray(points @ self.axes[2])


#: The view of a flat robot.
_FROM_ABOVE = View(-90.0, 62.0)


def clearest_view(drawing: Drawing) -> View:
    """Return the view in which limbs stand farthest apart on paper and the task's axis is least foreshortened."""
    if drawing.model.scene.joints and np.ptp(drawing.posture.points, axis=0)[2] < _FLAT * drawing.size:
        return _FROM_ABOVE
    return max((View(float(azimuth)) for azimuth in _AZIMUTHS), key=lambda view: _clearness(view, drawing))


def _clearness(view: View, drawing: Drawing) -> float:
    """Return a score: least and mean distance on paper between points of limbs, and the visible part of the axis."""
    points = drawing.posture.points
    if drawing.model.scene.joints:
        return _clearness_of_joints(view, drawing)
    middles = [
        view.project(points[start] + part * (points[end] - points[start]))
        for start, end, link in drawing.links
        if link.limb is not None
        for part in (0.35, 0.65)
    ]
    apart = [float(np.linalg.norm(a - b)) for i, a in enumerate(middles) for b in middles[:i]]
    shown = min(apart, default=0.0) / drawing.size + 0.2 * float(np.mean(apart or [0.0])) / drawing.size
    if drawing.motion is not None:
        seen = np.linalg.norm(view.project(drawing.motion.axis))
        shown += 0.5 * float(seen)
    return shown


def _clearness_of_joints(view: View, drawing: Drawing) -> float:
    """Return the same score for a robot given joint by joint, whose limbs have several links.

    Rods of one limb, such as those of a parallelogram, are near to each other in every view: they do not count.
    """
    links = [(a, b, link) for a, b, link in drawing.links if link.limb is not None and link.kind is not LinkKind.RAIL]
    points, parts = drawing.posture.points, np.array(_PARTS)[:, None, None]
    starts, ends = points[[each[0] for each in links]], points[[each[1] for each in links]]
    places = view.project(starts + parts * (ends - starts)).reshape(-1, 2)
    limbs = np.tile([str(link.limb) for *_, link in links], len(_PARTS))
    rods = np.tile([link.kind is LinkKind.ROD for *_, link in links], len(_PARTS))
    own = np.tile(np.arange(len(links)), len(_PARTS))
    counts = np.where(limbs[:, None] == limbs, ~(rods[:, None] | rods) & (own[:, None] != own), True)
    counts &= np.tri(len(places), k=-1, dtype=np.bool_)
    apart = np.linalg.norm(places[:, None] - places, axis=2)[counts]
    frame = view.project(np.array([0.0, 0.0, _SHOWN_Z * drawing.size]))
    apart = np.append(apart, np.linalg.norm(places - frame, axis=1))
    shown = (float(apart.min()) + 0.2 * float(apart.mean())) / drawing.size
    if drawing.motion is not None:
        shown += 0.5 * float(np.linalg.norm(view.project(drawing.motion.axis)))
    return shown


def painting_order(view: View, lines: Sequence[FloatArray]) -> list[int]:
    """Return the order in which to paint straight lines, (2, 3) each: the nearer of two that cross comes later."""
    depths = [float(np.mean(view.depth(line))) for line in lines]
    order = sorted(range(len(lines)), key=lambda i: depths[i])
    for _ in lines:
        # A line that must come before an earlier one moves ahead of it; as many rounds as there are lines are enough.
        for place, i in enumerate(order):
            later = [k for k in order[:place] if _covers(view, lines[k], lines[i])]
            if later:
                order.remove(i)
                order.insert(order.index(later[0]), i)
                break
        else:
            break
    return order


def _covers(view: View, one: FloatArray, other: FloatArray) -> bool:
    """Return whether two lines, (2, 3) each, cross on paper and the first is nearer to the eye there."""
    (a, b), (c, d) = view.project(one), view.project(other)
    matrix = np.column_stack([b - a, c - d])
    if abs(np.linalg.det(matrix)) <= 1e-12 * float(np.abs(matrix).max()) ** 2:
        return False
    s, t = np.linalg.solve(matrix, c - a)
    if not (_JOINED < s < 1 - _JOINED and _JOINED < t < 1 - _JOINED):
        return False
    near, far = view.depth(one), view.depth(other)
    return bool(near[0] + s * (near[1] - near[0]) > far[0] + t * (far[1] - far[0]))

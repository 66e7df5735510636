"""Parallel projection of a robot, which keeps proportions, and the order in which lines cover each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....models import FloatArray, JointKind, LinkKind
from .drawing import Drawing, Motion

#: Azimuths that are tried for a view, its elevation, and what is added to it where motions cannot be seen, in degrees.
_AZIMUTHS = range(-170, 190, 10)
_ELEVATION, _HIGHER = 18.0, (0.0, 14.0, 28.0)
#: Least part of the length of a motion's axis, and of the width of its path, that a view shows.
_LEAST_LENGTH, _LEAST_WIDTH = 0.5, 0.3
#: Score of a motion that is not seen at all, beside which that of limbs that stand apart is small.
_HIDDEN = 10.0
#: Directions that differ by less are parallel.
_PARALLEL = 1e-6
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


def clearest_view(*drawings: Drawing, elevation: float = _ELEVATION, width: float = _LEAST_WIDTH) -> View:
    """Return one view of drawings in which limbs stand farthest apart on paper and every motion can be seen.

    A robot that moves in the plane of x and y is seen from above, x to the right; in an upright plane, from its side.
    Others are seen from the elevation stated, or from higher where an axis would be seen from its end, or a path from
    its edge: narrower than a part of its own width.
    """
    planes = [_face_on(drawing) for drawing in drawings]
    if planes[0] is not None and all(view == planes[0] for view in planes):
        return planes[0]
    motions = [motion for each in drawings for motion in (each.motion, *each.free) if motion is not None]

    def score(view: View) -> float:
        clear = sum(_clearness(view, drawing) for drawing in drawings) / len(drawings)
        return clear - _HIDDEN * _hidden(view, motions, width)

    tried = [[View(float(azimuth), elevation + more) for azimuth in _AZIMUTHS] for more in _HIGHER]
    low = next((views for views in tried if any(_hidden(view, motions, width) == 0 for view in views)), None)
    return max(low or [view for views in tried for view in views], key=score)


def _face_on(drawing: Drawing) -> View | None:
    """Return the view at right angles to the plane that a robot moves in; None for a robot that moves in space.

    All hinges of a planar robot are parallel, and its slides are at right angles to them.
    """
    turning: list[FloatArray] = []
    sliding: list[FloatArray] = []
    for joint, (_, *axes) in zip(drawing.model.scene.joints, drawing.posture.joints, strict=True):
        if joint.kind not in (JointKind.REVOLUTE, JointKind.PARALLELOGRAM, JointKind.PRISMATIC) or not axes:
            return None
        (sliding if joint.kind is JointKind.PRISMATIC else turning).extend(axes)
    if not turning:
        return None
    normal = turning[0]
    apart = [float(np.linalg.norm(np.cross(normal, each))) for each in turning]
    if max([*apart, *(abs(float(normal @ each)) for each in sliding)]) > _PARALLEL:
        return None
    if abs(normal[2]) > 1 - _PARALLEL:
        return View(-90.0, 90.0)
    if abs(normal[2]) > _PARALLEL:
        return None
    # Of both sides of an upright plane the one from which x points to the right.
    x, y = normal[:2] if normal[1] < -_PARALLEL or (normal[1] <= _PARALLEL and normal[0] > 0) else -normal[:2]
    return View(math.degrees(math.atan2(y, x)), 0.0)


def _hidden(view: View, motions: Sequence[Motion], width: float) -> float:
    """Return by how much axes of motions are too short on paper, and their paths too narrow; 0 where all are seen."""
    missing = 0.0
    for motion in motions:
        missing += max(0.0, _LEAST_LENGTH - float(np.linalg.norm(view.project(motion.axis))))
        if motion.has_path:
            # A circle about the axis is as wide on paper as the axis points towards the eye.
            missing += max(0.0, width - abs(float(view.depth(motion.axis))))
    return missing


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

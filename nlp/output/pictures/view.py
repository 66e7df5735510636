"""Parallel projection of a robot, and painting order of lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....models import FloatArray, JointKind, LinkKind
from .drawing import Drawing, Motion

#: Candidate azimuths of a view, its elevation, and increments of the elevation for motions that are hidden, degrees.
_AZIMUTHS = range(-170, 190, 10)
_ELEVATION, _HIGHER = 18.0, (0.0, 14.0, 28.0)
#: Least visible fraction of the length of a motion's axis, and of the width of its path.
_LEAST_LENGTH, _LEAST_WIDTH = 0.5, 0.3
#: Penalty of a hidden motion, large relative to the score of the distances of limbs.
_HIDDEN = 10.0
#: Difference below which directions are parallel.
_PARALLEL = 1e-6
#: Length of the axis z, as a fraction of the robot's size, that limbs should not cover.
_SHOWN_Z = 0.12
#: Points on a link, as fractions of its length, whose projected distances are compared.
_PARTS = (0.2, 0.35, 0.5, 0.65, 0.8)
#: Distance from the end of a line, as a fraction of its length, below which a projected crossing is a common joint.
_JOINED = 0.02


@dataclass(frozen=True)
class View:
    """Parallel projection along a direction, with z upwards in the picture.

    Attributes:
        azimuth: angle of the viewing direction about z, from x towards y, degrees.
        elevation: angle of the viewing direction above the plane of x and y, degrees.
    """

    azimuth: float
    elevation: float = _ELEVATION

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: directions to the right and upwards in the picture, and towards the viewer."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array(
            [
                [-math.sin(a), math.cos(a), 0.0],
                [-math.sin(e) * math.cos(a), -math.sin(e) * math.sin(a), math.cos(e)],
                [math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)],
            ]
        )

    def project(self, points: FloatArray) -> FloatArray:
        """Return the projections (..., 2) of points (..., 3), in the unit of the points."""
        return np.asarray(points @ self.axes[:2].T)

    def depth(self, points: FloatArray) -> FloatArray:
        """Return the coordinates of points (..., 3) towards the viewer."""
        return np.asarray(points @ self.axes[2])


def clearest_view(*drawings: Drawing, elevation: float = _ELEVATION, width: float = _LEAST_WIDTH) -> View:
    """Return one view of drawings with the largest projected distances of limbs and visible motions.

    A planar robot in the plane of x and y is seen from above, with x to the right; in a vertical plane, from its side.
    Other robots are seen at the given elevation, or higher if an axis would be seen from its end, or the circle of a
    path from its edge.
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
    """Return the view normal to the plane of a planar robot; None for a spatial robot.

    All hinges of a planar robot are parallel, and its slides are perpendicular to them.
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
    # For a vertical plane, the side from which x points to the right.
    x, y = normal[:2] if normal[1] < -_PARALLEL or (normal[1] <= _PARALLEL and normal[0] > 0) else -normal[:2]
    return View(math.degrees(math.atan2(y, x)), 0.0)


def _hidden(view: View, motions: Sequence[Motion], width: float) -> float:
    """Return a measure of hidden motions: axes too short and paths too narrow in projection; 0 if all are visible."""
    missing = 0.0
    for motion in motions:
        missing += max(0.0, _LEAST_LENGTH - float(np.linalg.norm(view.project(motion.axis))))
        if motion.has_path:
            # The projected width of a circle about the axis is the axis' component towards the viewer.
            missing += max(0.0, width - abs(float(view.depth(motion.axis))))
    return missing


def _clearness(view: View, drawing: Drawing) -> float:
    """Return a score: least and mean projected distance of points of limbs, and visible fraction of the axis."""
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
    """Return the score of :func:`_clearness` for a robot defined by joints, whose limbs have several links.

    Rods of one limb, as in a parallelogram, are close together in every view, and are ignored.
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
    """Return the painting order of straight lines, (2, 3) each: of two crossing lines, the nearer is later."""
    depths = [float(np.mean(view.depth(line))) for line in lines]
    order = sorted(range(len(lines)), key=lambda i: depths[i])
    for _ in lines:
        # A line that must precede an earlier one moves before it; the number of rounds is at most the number of lines.
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
    """Return whether two lines, (2, 3) each, cross in projection, and the first is nearer to the viewer there."""
    (a, b), (c, d) = view.project(one), view.project(other)
    matrix = np.column_stack([b - a, c - d])
    if abs(np.linalg.det(matrix)) <= 1e-12 * float(np.abs(matrix).max()) ** 2:
        return False
    s, t = np.linalg.solve(matrix, c - a)
    if not (_JOINED < s < 1 - _JOINED and _JOINED < t < 1 - _JOINED):
        return False
    near, far = view.depth(one), view.depth(other)
    return bool(near[0] + s * (near[1] - near[0]) > far[0] + t * (far[1] - far[0]))

"""Detection of circles and symmetries in a robot file, as candidates for dimensions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ....models.arrays import FloatArray
from ..frames import rotation_about

#: Difference, relative to the robot's size, below which points and directions are equal: values with six digits differ
#: by at most 1e-6.
SAME = 1e-5
#: Difference below which an axis is rounded to a coordinate axis, and a coordinate to 0, relative to the size.
_ROUND = 1e-5


@dataclass(frozen=True, eq=False)
class CircleOffer:
    """Circle of joints, whose radius can become a dimension.

    Attributes:
        name: name of the circle for ``--free``.
        joints: names of the joints on the circle.
        points: (n, 3) centres of the joints.
        centre: (3,) centre of the circle.
        axis: (3,) unit direction of the circle's axis.
        radius: radius of the circle.
        deviation: largest distance of a joint from the circle, length.
    """

    name: str
    joints: tuple[str, ...]
    points: FloatArray
    centre: FloatArray
    axis: FloatArray
    radius: float
    deviation: float


@dataclass(frozen=True, eq=False)
class FoldOffer:
    """Rotational symmetry: limbs that are copies of each other by rotation about an axis.

    Attributes:
        name: name of the symmetry for ``--free``.
        count: number of copies of each limb.
        orbits: indices of the limbs that are copies of each other, in the order of their angles.
        centre: (3,) point on the axis of rotation.
        axis: (3,) unit direction of the axis of rotation.
        deviation: largest distance between joints of a rotated limb and its copy, or difference of axes times the size.
    """

    name: str
    count: int
    orbits: tuple[tuple[int, ...], ...]
    centre: FloatArray
    axis: FloatArray
    deviation: float


class Mirror(NamedTuple):
    """Mirror symmetry of the robot: point and normal of the plane, and largest deviation."""

    point: FloatArray
    normal: FloatArray
    deviation: float


class Offers(NamedTuple):
    """Detected circles and symmetries.

    Attributes:
        circles: circles of joints.
        fold: rotational symmetry; None if there is none.
        mirrors: mirror symmetries.
    """

    circles: tuple[CircleOffer, ...]
    fold: FoldOffer | None
    mirrors: tuple[Mirror, ...]


@dataclass(frozen=True, eq=False)
class _LimbNumbers:
    """Points and axes of a limb, in the order of the file.

    Attributes:
        index: index of the limb in the file.
        shape: types, actuation and branches of the joints; only limbs of equal shape can be copies.
        names: names of the joints.
        points: (n, 3) centres of the joints.
        axes: (m, 3) axes of the joints.
        driven: True for each axis of an actuated joint, whose sign matters.
    """

    index: int
    shape: tuple[Any, ...]
    names: tuple[str, ...]
    points: FloatArray
    axes: FloatArray
    driven: tuple[bool, ...]


def offers_of(tables: Mapping[str, Any], size: float) -> Offers:
    """Return the circles and symmetries of a robot file with numbers only.

    Args:
        tables: tables of the robot file; files with links and joints give no circles and symmetries.
        size: characteristic size of the robot, length.
    """
    limbs = _limbs_in_numbers(tables)
    circles = _circles(limbs, size)
    fold = next((found for circle in circles if (found := _fold(limbs, circle, size)) is not None), None)
    mirrors = _mirrors(limbs, circles[0], size) if circles else []
    return Offers(tuple(circles), fold, tuple(mirrors))


def _groups(limbs: list[_LimbNumbers]) -> list[list[_LimbNumbers]]:
    """Return groups of limbs with equal shapes."""
    shapes: dict[tuple[Any, ...], list[_LimbNumbers]] = {}
    for limb in limbs:
        shapes.setdefault(limb.shape, []).append(limb)
    return list(shapes.values())


def _circles(limbs: list[_LimbNumbers], size: float) -> list[CircleOffer]:
    """Return the circles through the corresponding joints of all limbs with equal shapes."""
    found: list[CircleOffer] = []
    for group in _groups(limbs):
        for k in range(len(group[0].names)):
            points = np.array([limb.points[k] for limb in group])
            known = any(
                len(each.points) == len(points) and np.allclose(each.points, points, rtol=0, atol=0) for each in found
            )
            circle = None if known or len(points) < 3 else _circle_through(points, size)
            if circle is None:
                continue
            centre, axis, radius = circle
            radial = _radial(points, centre, axis)
            off = np.linalg.norm(points - centre - radial, axis=1)
            deviation = float(np.hypot(np.linalg.norm(radial, axis=1) - radius, off).max())
            even = len(points) > 3 or _is_even(radial, radius)
            if deviation < SAME * size and even:
                names = tuple(limb.names[k] for limb in group)
                found.append(CircleOffer(f"circle{len(found) + 1}", names, points, centre, axis, radius, deviation))
    return found


def _is_even(radial: FloatArray, radius: float) -> bool:
    """Return whether three points on a circle are evenly spaced; any three points are on a circle."""
    return bool(np.linalg.norm(radial.sum(axis=0)) < SAME * radius)


def _radial(points: FloatArray, centre: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the perpendicular vectors (n, 3) from an axis to points."""
    apart = points - centre
    return np.asarray(apart - np.outer(apart @ axis, axis))


def _circle_through(points: FloatArray, size: float) -> tuple[FloatArray, FloatArray, float] | None:
    """Return centre, axis and radius of the least-squares circle of points (n, 3); None for collinear points."""
    middle = points.mean(axis=0)
    _, values, rows = np.linalg.svd(points - middle)
    if values[1] < SAME * size:
        return None
    axis = _rounded_direction(rows[2])
    plane = rows[:2]
    flat = (points - middle) @ plane.T
    # |p|^2 = 2 c.p + (r^2 - |c|^2) is linear in the centre c and in the expression in brackets.
    system = np.column_stack([2 * flat, np.ones(len(flat))])
    solution = np.linalg.lstsq(system, (flat**2).sum(axis=1), rcond=None)[0]
    centre = middle + solution[:2] @ plane
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
    centre = np.where(np.abs(centre) < _ROUND * size, 0.0, centre)
    return (centre, axis, radius) if radius > SAME * size else None


def _rounded_direction(axis: FloatArray) -> FloatArray:
    """Return a direction with positive largest component, rounded to a coordinate axis if it is near one."""
    axis = axis * np.sign(axis[int(np.argmax(np.abs(axis)))])
    nearest = np.eye(3)[int(np.argmax(axis))]
    return nearest if float(np.linalg.norm(axis - nearest)) < _ROUND else axis


def _turned(limb: _LimbNumbers, other: _LimbNumbers, matrix: FloatArray, centre: FloatArray, size: float) -> float:
    """Return the largest deviation of a mapped limb from another limb; infinity for different shapes.

    The map is orthogonal, about a point. A reflection also reverses axes of rotation, so that signs of axes do not
    matter then.
    """
    if limb.shape != other.shape:
        return float("inf")
    apart = (limb.points - centre) @ matrix.T + centre - other.points
    found = [0.0, *np.linalg.norm(apart, axis=1)]
    axes = limb.axes @ matrix.T
    proper = np.linalg.det(matrix) > 0
    for axis, target, driven in zip(axes, other.axes, limb.driven, strict=True):
        same, opposite = np.linalg.norm(axis - target), np.linalg.norm(axis + target)
        found.append(size * float(same if driven and proper else min(same, opposite)))
    return float(max(found))


def _fold(limbs: list[_LimbNumbers], circle: CircleOffer, size: float) -> FoldOffer | None:
    """Return the rotational symmetry of the robot about a circle's axis; None if there is none."""
    most = min(len(group) for group in _groups(limbs))
    for count in range(most, 1, -1):
        turn = rotation_about(circle.axis, 2 * np.pi / count)
        images: dict[int, int] = {}
        deviation = 0.0
        for limb in limbs:
            gaps = [_turned(limb, other, turn, circle.centre, size) for other in limbs]
            nearest = int(np.argmin(gaps))
            images[limb.index] = limbs[nearest].index
            deviation = max(deviation, gaps[nearest])
        if deviation >= SAME * size or len(set(images.values())) < len(limbs):
            continue
        orbits = _orbits(images)
        if all(len(orbit) == count for orbit in orbits):
            return FoldOffer("fold", count, orbits, circle.centre, circle.axis, deviation)
    return None


def _orbits(images: Mapping[int, int]) -> tuple[tuple[int, ...], ...]:
    """Return the cycles of a permutation, each starting at its smallest index."""
    found, seen = [], set[int]()
    for start in sorted(images):
        if start in seen:
            continue
        orbit = [start]
        while (step := images[orbit[-1]]) != start:
            orbit.append(step)
        seen |= set(orbit)
        found.append(tuple(orbit))
    return tuple(found)


def _mirrors(limbs: list[_LimbNumbers], circle: CircleOffer, size: float) -> list[Mirror]:
    """Return the mirror symmetries of the robot with planes through a circle's axis."""
    radial = _radial(circle.points, circle.centre, circle.axis)
    found: list[Mirror] = []
    for way in [radial[0] - each for each in radial[1:]] + [np.cross(circle.axis, radial[0])]:
        length = float(np.linalg.norm(way))
        if length < SAME * size:
            continue
        normal = _rounded_direction(way / length)
        if any(np.linalg.norm(np.cross(each.normal, normal)) < _ROUND for each in found):
            continue
        matrix = np.eye(3) - 2 * np.outer(normal, normal)
        gaps = [min(_turned(limb, other, matrix, circle.centre, size) for other in limbs) for limb in limbs]
        if max(gaps) < SAME * size:
            found.append(Mirror(circle.centre, normal, max(gaps)))
    return found


def joints_of_limb(limb: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the tables of all joints of a limb: the common joints, then those of each branch."""
    return [*limb.get("joints", []), *(joint for branch in limb.get("branch", []) for joint in branch["joints"])]


def joints_of(tables: Mapping[str, Any]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield limb index and table of each joint; the index is 0 in a file without limbs."""
    for joint in tables.get("joint", []):
        if "at" in joint:
            yield 0, joint
    for index, limb in enumerate(tables.get("limb", [])):
        for joint in joints_of_limb(limb):
            yield index, joint


def _limbs_in_numbers(tables: Mapping[str, Any]) -> list[_LimbNumbers]:
    """Return the points and axes of the limbs of a robot file with numbers only."""
    found = []
    for index, limb in enumerate(tables.get("limb", [])):
        joints = joints_of_limb(limb)
        shape = (
            tuple((joint["type"], bool(joint.get("actuated"))) for joint in joints),
            len(limb.get("joints", [])),
            tuple(len(branch["joints"]) for branch in limb.get("branch", [])),
        )
        points = [point for joint in joints for point in (joint["at"], *([joint["to"]] if "to" in joint else []))]
        axes = [(axis, bool(joint.get("actuated"))) for joint in joints for axis in _axes(joint)]
        names = tuple(name for joint in joints for name in [joint.get("name", "")] * (2 if "to" in joint else 1))
        found.append(
            _LimbNumbers(
                index,
                shape,
                names,
                np.array(points, dtype=np.float64).reshape(-1, 3),
                np.array([axis for axis, _ in axes], dtype=np.float64).reshape(-1, 3),
                tuple(driven for _, driven in axes),
            )
        )
    return found


def _axes(joint: Mapping[str, Any]) -> list[Any]:
    """Return the axes of a joint."""
    return [joint["axis"]] if "axis" in joint else list(joint.get("axes", []))

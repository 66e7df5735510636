"""Base and platform as flat plates: joint centres in the plane of their plate, and their distances from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....models import Dimension, FloatArray
from ....models.joints.outline import outline
from ....models.mechanism import Mechanism
from ...system.csvtext import csv_text
from ...units import Units
from .numbers import number

#: Extents of points across a plane, sines of angles, and distances in parts of the robot's size, that count as zero.
_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Plate:
    """A plate with the centres of the joints on it.

    Attributes:
        name: of the link.
        joints: names of the joints at each centre.
        origin: (3,) origin of the drawing in the frame of the link, length: the foot of that frame's origin.
        axes: (3, 3) x, y and normal of the drawing as columns, in the frame of the link.
        places: (n, 2) centres in the drawing, length.
        offsets: (n,) distances of the centres from the plane, along its normal, length.
        corners: indices of the centres that are corners of the outline, in order.
    """

    name: str
    joints: tuple[tuple[str, ...], ...]
    origin: FloatArray
    axes: FloatArray
    places: FloatArray
    offsets: FloatArray
    corners: tuple[int, ...]

    def is_flat(self, size: float) -> bool:
        """Return whether all centres are in the plane."""
        return float(np.abs(self.offsets).max(initial=0.0)) <= _FLAT * size


def plate_of(mechanism: Mechanism, link: str, size: float) -> Plate:
    """Return a link as a plate in the plane of least squares of its joints' centres.

    The normal has a positive part along the z axis of the link's frame; the plane of a line or a point is as near as
    possible to its xy plane. The drawing's x axis is that of the frame, projected.

    Args:
        mechanism: the mechanism.
        link: name of the link.
        size: the robot's.
    """
    frame = next(each for each in mechanism.links if each.name == link)
    centres: list[FloatArray] = []
    names: list[list[str]] = []
    for joint in mechanism.joints:
        if link in (joint.inner, joint.outer):
            place = frame.rotation.T @ (joint.point - frame.position)
            same = [k for k, one in enumerate(centres) if np.linalg.norm(one - place) <= _FLAT * size]
            if same:
                names[same[0]].append(joint.name)
            else:
                centres.append(place)
                names.append([joint.name])
    points = np.array(centres).reshape(-1, 3)
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    normal = _normal(points - middle, size)
    x = np.eye(3)[0] - normal * normal[0]
    if float(np.linalg.norm(x)) < _FLAT:
        x = np.eye(3)[1] - normal * normal[1]
    x = x / np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(normal, x), normal])
    origin = normal * float(middle @ normal)
    flat = (points - origin) @ axes
    corners = tuple(outline(points)) if len(points) else ()
    return Plate(link, tuple(map(tuple, names)), origin, axes, flat[:, :2], flat[:, 2], corners)


def _normal(points: FloatArray, size: float) -> FloatArray:
    """Return the unit normal (3,) of the plane of least squares of points (n, 3) about their mean."""
    up = np.array([0.0, 0.0, 1.0])
    _, extents, axes = np.linalg.svd(np.vstack([points, np.zeros((3, 3))]))
    rank = int(np.sum(extents > _FLAT * size))
    if rank < 2:
        across = up - axes[0] * axes[0, 2] if rank else up
        length = float(np.linalg.norm(across))
        return np.asarray(across / length if length > _FLAT else np.eye(3)[0])
    normal = axes[2]
    if float(np.linalg.norm(np.cross(normal, up))) < _FLAT:
        return up
    first = next(value for value in normal[::-1] if abs(value) > _FLAT)
    return np.asarray(normal if first > 0 else -normal)


def plates_csv(plates: tuple[Plate, ...], units: Units) -> str:
    """Return the joint centres of plates in their drawings, with their distances from the plane."""
    length = units.label(Dimension.LENGTH)
    head = ["plate", "joints", f"x in drawing [{length}]", f"y in drawing [{length}]", f"offset from plane [{length}]"]
    rows = [
        [plate.name, " ".join(names), *map(number, place), number(offset)]
        for plate in plates
        for names, place, offset in zip(plate.joints, plate.places, plate.offsets, strict=True)
    ]
    return csv_text(head, rows)

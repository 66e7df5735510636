"""Base and platform as flat plates: joint centres in the plane of their plate, and their distances from it.

Drawings of plates are written in DXF by ezdxf: joint centres, outline and names.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ....models import Dimension, FloatArray
from ....models.drawing import outline
from ....models.mechanism import Mechanism
from ...system.csvtext import csv_text
from ...units import Units
from ..extra import required
from .numbers import number
from .shapes import joint_centres

#: Extents of points across a plane, sines of angles, and distances in parts of the robot's size, that count as zero.
_FLAT = 1e-9
#: Codes of length units in DXF's header by the label of a case; 0, no unit, for all others.
_UNITS: Mapping[str, int] = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13, "dm": 14}
#: Radius of a joint's circle and height of letters, in parts of the plate's extent.
_CIRCLE, _LETTERS = 0.02, 0.025


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
    frame, centres = mechanism.link(link), joint_centres(mechanism, link, size)
    points = np.array([frame.local(point) for point, _ in centres]).reshape(-1, 3)
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
    return Plate(link, tuple(tuple(names) for _, names in centres), origin, axes, flat[:, :2], flat[:, 2], corners)


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


def required_dxf() -> Any:  # noqa: ANN401 - a module
    """Return the library that writes drawings.

    Raises:
        InputError: it is not installed.
    """
    return required("ezdxf", "drawings in DXF")


def dxf_text(plate: Plate, unit: str) -> str:
    """Return the drawing of a plate: the same text for the same plate.

    Args:
        plate: the plate.
        unit: label of the length unit.

    Raises:
        InputError: ezdxf is not installed.
    """
    ezdxf, alignment = required_dxf(), import_module("ezdxf.enums").TextEntityAlignment
    # Dates and identifiers of the document would make two drawings of one plate differ.
    fixed = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        document = ezdxf.new("R2010")
        document.units = _UNITS.get(unit, 0)
        for name, colour in (("OUTLINE", 7), ("JOINTS", 1), ("NAMES", 3), ("FRAME", 5)):
            document.layers.add(name, color=colour)
        space = document.modelspace()
        extent = float(np.ptp(plate.places, axis=0).max(initial=0.0)) if len(plate.places) else 0.0
        extent = extent or 1.0
        corners = [tuple(plate.places[k]) for k in plate.corners]
        if len(corners) > 1:
            space.add_lwpolyline(corners, close=len(corners) > 2, dxfattribs={"layer": "OUTLINE"})
        for names, place in zip(plate.joints, plate.places, strict=True):
            x, y = (float(value) for value in place)
            space.add_circle((x, y), _CIRCLE * extent, dxfattribs={"layer": "JOINTS"})
            space.add_point((x, y), dxfattribs={"layer": "JOINTS"})
            label = space.add_text(" ".join(names), height=_LETTERS * extent, dxfattribs={"layer": "NAMES"})
            label.set_placement((x + 1.5 * _CIRCLE * extent, y), align=alignment.MIDDLE_LEFT)
        for end, name in (((0.15 * extent, 0.0), "x"), ((0.0, 0.15 * extent), "y")):
            space.add_line((0.0, 0.0), end, dxfattribs={"layer": "FRAME"})
            letter = space.add_text(name, height=_LETTERS * extent, dxfattribs={"layer": "FRAME"})
            letter.set_placement(end, align=alignment.BOTTOM_LEFT)
        # ezdxf would add the classes of a set, whose order differs from process to process.
        for name in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(name)
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()

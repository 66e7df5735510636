"""Links as flat plates: joint centres in the plane of least squares, with their distances from it, as CSV and DXF.

The library ezdxf writes the DXF drawings, with joint centres, outline and names.
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

#: Relative rounding error: of extents and distances, relative to the robot's size, and of sines of angles.
_FLAT = 1e-9
#: Codes of length units in the DXF header; 0 (no unit) for all others.
_UNITS: Mapping[str, int] = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13, "dm": 14}
#: Radius of a joint's circle and height of letters, relative to the plate's extent.
_CIRCLE, _LETTERS = 0.02, 0.025


@dataclass(frozen=True, eq=False)
class Plate:
    """Plate with its joint centres.

    Attributes:
        name: name of the link.
        joints: names of the joints at each centre.
        origin: (3,) origin of the drawing in the frame of the link, length: projection of the frame's origin.
        axes: (3, 3) x axis, y axis and normal of the drawing as columns, in the frame of the link.
        places: (n, 2) joint centres in the drawing, length.
        offsets: (n,) signed distances of the joint centres from the plane, length.
        corners: indices of the joint centres at corners of the outline, in order.
    """

    name: str
    joints: tuple[tuple[str, ...], ...]
    origin: FloatArray
    axes: FloatArray
    places: FloatArray
    offsets: FloatArray
    corners: tuple[int, ...]

    def is_flat(self, size: float) -> bool:
        """Return whether all joint centres are in the plane."""
        return float(np.abs(self.offsets).max(initial=0.0)) <= _FLAT * size


def plate_of(mechanism: Mechanism, link: str, size: float) -> Plate:
    """Return a link as a plate in the plane of least squares of its joint centres.

    The normal has a positive component along the z axis of the link's frame. For collinear joint centres, the plane is
    as near as possible to the xy plane of the frame. The x axis of the drawing is the projected x axis of the frame.

    Args:
        mechanism: the mechanism.
        link: name of the link.
        size: characteristic size of the robot, length.
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
    """Return a CSV table of the joint centres of plates in their drawings, with distances from the plane."""
    length = units.label(Dimension.LENGTH)
    head = ["plate", "joints", f"x in drawing [{length}]", f"y in drawing [{length}]", f"offset from plane [{length}]"]
    rows = [
        [plate.name, " ".join(names), *map(number, place), number(offset)]
        for plate in plates
        for names, place, offset in zip(plate.joints, plate.places, plate.offsets, strict=True)
    ]
    return csv_text(head, rows)


def required_dxf() -> Any:  # noqa: ANN401 - a module
    """Return the library ezdxf.

    Raises:
        InputError: ezdxf is not installed.
    """
    return required("ezdxf", "drawings in DXF")


def dxf_text(plate: Plate, unit: str) -> str:
    """Return the DXF drawing of a plate; equal plates have equal texts.

    Args:
        plate: the plate.
        unit: name of the length unit.

    Raises:
        InputError: ezdxf is not installed.
    """
    ezdxf, alignment = required_dxf(), import_module("ezdxf.enums").TextEntityAlignment
    # Without this option, ezdxf writes dates and random identifiers.
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
        # ezdxf adds these classes in the order of a set, which differs between processes.
        for name in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(name)
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()

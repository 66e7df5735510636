"""A plate as a drawing in DXF, written by ezdxf: joint centres, outline and names."""

from __future__ import annotations

import io
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from ...errors import InputError
from .plates import Plate

#: Codes of length units in DXF's header by the label of a case; 0, no unit, for all others.
_UNITS: Mapping[str, int] = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13, "dm": 14}
#: Radius of a joint's circle and height of letters, in parts of the plate's extent.
_CIRCLE, _LETTERS = 0.02, 0.025


def check_dxf() -> None:
    """Check that ezdxf is installed.

    Raises:
        InputError: it is not installed.
    """
    if find_spec("ezdxf") is None:
        raise InputError("drawings in DXF need ezdxf, which is not installed: pip install 'screwsynth[robots]'")


def dxf_text(plate: Plate, unit: str) -> str:
    """Return the drawing of a plate, the same text for the same plate.

    Args:
        plate: the plate.
        unit: label of the length unit.

    Raises:
        InputError: ezdxf is not installed.
    """
    check_dxf()
    # Only drawings need the library, whose names are not exported for type checkers.
    ezdxf: Any = import_module("ezdxf")
    alignment: Any = import_module("ezdxf.enums").TextEntityAlignment
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
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()

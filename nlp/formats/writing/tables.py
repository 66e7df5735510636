"""CSV tables of a mechanism: joints in four frames, and frames of links."""

from __future__ import annotations

from collections.abc import Iterable

from ....models import Dimension
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink
from ...system.csvtext import csv_text
from ...units import Units
from ..solved.words import ExportedJoint
from .numbers import number

_COORDINATES = ("x", "y", "z")


def joints_csv(mechanism: Mechanism, joints: Iterable[ExportedJoint], units: Units) -> str:
    """Return a CSV table of all joints, with centre and axis in the frames of base, platform and the joint's two links.

    Args:
        mechanism: the mechanism.
        joints: joints with their names in the case; other joints have empty cells.
        units: units of the table.
    """
    words = {joint.name: joint for joint in joints}
    frames = ("base", "platform", "inner", "outer")
    length = units.label(Dimension.LENGTH)
    head = ["joint", "kind", "inner link", "outer link", "joint of the robot file", "actuator"]
    head += ["from home", "range min", "range max", "unit of these", f"pitch [{length}/rad]"]
    for frame in frames:
        head += [f"{c} in {frame} [{length}]" for c in _COORDINATES] + [f"axis {c} in {frame}" for c in _COORDINATES]
    rows = []
    for joint in mechanism.joints:
        known = words.get(joint.name)
        row = [joint.name, joint.kind, joint.inner, joint.outer]
        row += ["", ""] if known is None else [known.label, known.actuator]
        row += _coordinates(joint, None if known is None else known.coordinate, units)
        row.append(number(joint.pitch) if joint.kind == "H" else "")
        for frame in (mechanism.base, mechanism.platform, joint.inner, joint.outer):
            row += _place(joint, mechanism.link(frame))
        rows.append(row)
    return csv_text(head, rows)


def links_csv(mechanism: Mechanism, units: Units) -> str:
    """Return a CSV table of the frames of all links in the base frame: origin and axes."""
    length = units.label(Dimension.LENGTH)
    base = mechanism.link(mechanism.base)
    head = ["link", *(f"{c} [{length}]" for c in _COORDINATES)]
    head += [f"{axis} axis {c}" for axis in _COORDINATES for c in _COORDINATES]
    rows = []
    for link in mechanism.links:
        origin = base.local(link.position)
        axes = base.rotation.T @ link.rotation
        rows.append([link.name, *map(number, origin), *map(number, axes.T.ravel())])
    return csv_text(head, rows)


def _coordinates(joint: MechanismJoint, coordinate: float | None, units: Units) -> list[str]:
    """Return the cells of a joint's coordinate from home, its range from the exported pose, and their unit."""
    if joint.kind in ("S", "weld"):
        return ["", "", "", ""]
    dimension = Dimension.LENGTH if joint.kind == "P" else Dimension.ANGLE
    ends = (None, None) if joint.range is None else joint.range
    shown = ["" if value is None else number(units.shown(value, dimension)) for value in (coordinate, *ends)]
    return [*shown, units.label(dimension)]


def _place(joint: MechanismJoint, link: MechanismLink) -> list[str]:
    """Return the cells of a joint's centre and axis in the frame of a link; spherical joints have no axis."""
    axis: list[str] = [""] * 3
    if joint.kind not in ("S", "weld"):
        axis = [number(value) for value in link.rotation.T @ joint.axis]
    return [*(number(value) for value in link.local(joint.point)), *axis]

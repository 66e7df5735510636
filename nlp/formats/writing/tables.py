"""A mechanism as tables of comma-separated values: joints in four frames, and frames of links."""

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
    """Return the centres and axes of all joints in the frames of base, platform, and the two links of each.

    Args:
        mechanism: the mechanism.
        joints: its joints in the words of the case; those that are missing have none.
        units: of the table.
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
        said = words.get(joint.name)
        row = [joint.name, joint.kind, joint.inner, joint.outer]
        row += ["", ""] if said is None else [said.label, said.actuator]
        row += _coordinates(joint, None if said is None else said.coordinate, units)
        row.append(number(joint.pitch) if joint.kind == "H" else "")
        for frame in (mechanism.base, mechanism.platform, joint.inner, joint.outer):
            row += _place(joint, mechanism.link(frame))
        rows.append(row)
    return csv_text(head, rows)


def links_csv(mechanism: Mechanism, units: Units) -> str:
    """Return the frames of all links in the frame of the base: origin, and axes."""
    length = units.label(Dimension.LENGTH)
    base = mechanism.link(mechanism.base)
    head = ["link", *(f"{c} [{length}]" for c in _COORDINATES)]
    head += [f"{own} axis {c}" for own in _COORDINATES for c in _COORDINATES]
    rows = []
    for link in mechanism.links:
        origin = base.local(link.position)
        axes = base.rotation.T @ link.rotation
        rows.append([link.name, *map(number, origin), *map(number, axes.T.ravel())])
    return csv_text(head, rows)


def _coordinates(joint: MechanismJoint, coordinate: float | None, units: Units) -> list[str]:
    """Return the coordinate from home, the range from the exported pose, and their unit."""
    if joint.kind in ("S", "weld"):
        return ["", "", "", ""]
    dimension = Dimension.LENGTH if joint.kind == "P" else Dimension.ANGLE
    ends = (None, None) if joint.range is None else joint.range
    shown = ["" if value is None else number(units.shown(value, dimension)) for value in (coordinate, *ends)]
    return [*shown, units.label(dimension)]


def _place(joint: MechanismJoint, link: MechanismLink) -> list[str]:
    """Return the centre and the axis of a joint in the frame of a link; no axis for a ball."""
    axis: list[str] = [""] * 3
    if joint.kind not in ("S", "weld"):
        axis = [number(value) for value in link.rotation.T @ joint.axis]
    return [*(number(value) for value in link.local(joint.point)), *axis]

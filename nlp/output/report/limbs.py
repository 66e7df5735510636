"""Data of limbs and joints in the page's 3-D view: lines, symbols, rows, and a measure of each limb."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from ....models import JointSymbol, WrenchKind
from ...units import Units
from ..pictures.drawing import Drawing
from ..pictures.posture import Posture


class LinkData(TypedDict):
    """A line between two points, by their indices; ``row`` is the index of the row that colours it."""

    ends: list[int]
    limb: str | None
    body: str
    kind: str
    row: int | None


class JointData(TypedDict):
    """A joint's symbol: its kind, and its words for people."""

    kind: str
    words: str
    actuated: bool


class MeasureData(TypedDict):
    """The measure of a limb that stands beside each row: its words, and its unit in each row."""

    words: str
    units: list[str]


class RowData(TypedDict):
    """A row of the Jacobian: its limb and member, and the index of the point that joins the limb to the platform."""

    limb: str
    member: str
    kind: str
    at: int | None


def link_data(drawing: Drawing) -> list[LinkData]:
    """Return the lines with the rows that colour them."""
    rows = drawing.limb_rows()
    found: list[LinkData] = []
    for start, end, link in drawing.links:
        own = drawing.link_row(link)
        row = rows.get(link.limb or "") if own is None else own
        kind = link.kind.value
        found.append({"ends": [start, end], "limb": link.limb, "body": link.body.value, "kind": kind, "row": row})
    return found


def row_data(drawing: Drawing) -> list[RowData]:
    """Return the rows; a couple beside others of its limb has no place, because only their plane has a meaning."""
    couples = [row.limb for row in drawing.rows if row.kind is WrenchKind.COUPLE]
    return [
        {
            "limb": row.limb,
            "member": row.member,
            "kind": row.kind.value,
            "at": None if couples.count(row.limb) > 1 else drawing.attachment(row.limb),
        }
        for row in drawing.rows
    ]


def joint_data(drawing: Drawing) -> list[JointData]:
    """Return the joints of the drawing."""
    joints = drawing.model.scene.joints
    return [{"kind": each.kind.value, "words": _joint_words(each), "actuated": each.is_actuated} for each in joints]


def _joint_words(joint: JointSymbol) -> str:
    """Return a joint in words: its name, kind, and whether an actuator drives it."""
    return f"joint {joint.name}: {joint.kind.words}{', actuated' if joint.is_actuated else ''}"


def measure_data(drawing: Drawing, units: Units) -> MeasureData:
    """Return the measure of limbs: the length of a leg; for a robot given joint by joint, the way of its actuator."""
    rows = drawing.model.rows
    if not drawing.model.scene.joints:
        return {"words": "length", "units": [units.length] * len(rows)}
    kinds = {each.limb: each.dimension for each in reversed(drawing.model.actuators)}
    found = [kinds.get(row.limb) for row in rows]
    return {"words": "actuator", "units": ["" if each is None else units.label(each) for each in found]}


def measured_values(drawing: Drawing, posture: Posture, units: Units) -> list[float | None]:
    """Return the measure of each row's limb.

    It is the robot's own measure of a leg's length, or else the length of the limb's lines; for a robot given joint by
    joint, the way of the limb's first actuator from home, None without one.
    """
    lengths: dict[str, float] = {}
    if drawing.model.scene.joints:
        for item, values in zip(drawing.model.quantities, posture.quantities, strict=True):
            shown = [units.shown(float(value), item.dimension) for value in values]
            lengths |= dict(zip(item.owners, shown, strict=True))
        first = {each.limb: each.name for each in reversed(drawing.model.actuators)}
        return [lengths.get(first.get(row.limb, "")) for row in drawing.model.rows]
    for start, end, link in drawing.links:
        if link.limb is not None:
            part = float(np.linalg.norm(posture.points[end] - posture.points[start]))
            lengths[link.limb] = lengths.get(link.limb, 0.0) + part
    for item, values in zip(drawing.model.quantities, posture.quantities, strict=True):
        if item.name == "leg_length":
            lengths |= dict(zip(item.owners, map(float, values), strict=True))
    return [lengths.get(row.limb, 0.0) for row in drawing.model.rows]

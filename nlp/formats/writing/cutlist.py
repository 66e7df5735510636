"""Cut list of a mechanism: distances of joint centres on each link, and strokes of prismatic joints.

Equal parts are listed once. Base and platform are plates, with separate tables and drawings of their joint centres.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....models import Dimension
from ....models.mechanism import Mechanism
from ...system.csvtext import csv_text
from ...units import Units
from ..solved.words import Travel
from .numbers import number
from .shapes import joint_centres

#: Difference, relative to the robot's size, below which lengths are equal.
_SAME = 1e-9


class _Row(NamedTuple):
    """Row of the cut list without the number of parts; parts with equal item, kinds and lengths are equal.

    Attributes:
        item: kind of the row, such as ``link``.
        part: name of the link or joint.
        ends: names of the joints at both ends.
        kinds: kinds of these joints.
        lengths: lengths of the row; None for an empty cell.
    """

    item: str
    part: str
    ends: tuple[str, str]
    kinds: str
    lengths: tuple[float | None, ...]


def drawn_links(mechanism: Mechanism, size: float) -> tuple[str, ...]:
    """Return the names of the links between base and platform with two or more different joint centres."""
    ends = (mechanism.base, mechanism.platform)
    names = (link.name for link in mechanism.links if link.name not in ends)
    return tuple(name for name in names if len(joint_centres(mechanism, name, size)) > 1)


def cut_list_csv(mechanism: Mechanism, travels: Iterable[Travel], size: float, units: Units) -> str:
    """Return the cut list as CSV: distances of joint centres on links, and lengths and strokes of prismatic joints.

    Args:
        mechanism: the mechanism.
        travels: travel of each prismatic joint.
        size: characteristic size of the robot, length.
        units: units of the table.
    """
    parts = [_distances(mechanism, name, size) for name in drawn_links(mechanism, size)]
    parts += [[_stroke(each)] for each in travels]
    unit = units.label(Dimension.LENGTH)
    head = ["item", "parts", "quantity", "from joint", "to joint"]
    columns = ("length", "smallest used", "largest used", "stroke used", "smallest allowed", "largest allowed")
    head += [f"{name} [{unit}]" for name in (*columns, "stroke allowed")]
    rows = []
    for equal in _grouped(parts, size):
        names = list(dict.fromkeys(part[0].part for part in equal))
        for row in equal[0]:
            lengths = ["" if each is None else number(each) for each in row.lengths]
            rows.append([row.item, " ".join(names), str(len(names)), *row.ends, *lengths])
    return csv_text(head, rows)


def _distances(mechanism: Mechanism, link: str, size: float) -> list[_Row]:
    """Return a row for the distance of each pair of joint centres of a link."""
    kinds = {joint.name: joint.kind for joint in mechanism.joints}
    rows = []
    for (one, at_one), (other, at_other) in combinations(joint_centres(mechanism, link, size), 2):
        words = " ".join(kinds[name] for name in (*at_one, *at_other))
        apart = float(np.linalg.norm(other - one))
        rows.append(_Row("link", link, (" ".join(at_one), " ".join(at_other)), words, (apart, *[None] * 6)))
    return rows


def _stroke(travel: Travel) -> _Row:
    """Return the row of a prismatic joint: length or displacement at the pose, over all poses and within limits."""
    lengths = (travel.value, *travel.used, travel.used[1] - travel.used[0], *travel.allowed, travel.stroke)
    return _Row("length of a leg" if travel.is_leg else "way from home", travel.joint, ("", ""), "", lengths)


def _grouped(parts: Sequence[Sequence[_Row]], size: float) -> list[list[Sequence[_Row]]]:
    """Return groups of equal parts, in the order of their first parts."""
    groups: list[list[Sequence[_Row]]] = []
    for part in parts:
        same = next((group for group in groups if _are_equal(group[0], part, size)), None)
        groups.append([part]) if same is None else same.append(part)
    return groups


def _are_equal(one: Sequence[_Row], other: Sequence[_Row], size: float) -> bool:
    """Return whether two parts have the same kinds of joints at the same distances, in the same order."""
    if [(row.item, row.kinds) for row in one] != [(row.item, row.kinds) for row in other]:
        return False
    pairs = [pair for a, b in zip(one, other, strict=True) for pair in zip(a.lengths, b.lengths, strict=True)]
    return all((a is None and b is None) if a is None or b is None else abs(a - b) <= _SAME * size for a, b in pairs)

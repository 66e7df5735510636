"""Inverse kinematics of many poses in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...models.statics import driven_joints
from ..case.case import Case
from ..evidence.inverse import InversePoses
from .lines import counted, title_line
from .numbers import number
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from numpy.typing import NDArray


def inverse_summary(case: Case, found: InversePoses, file: str, rows: Sequence[int]) -> Iterator[Line | TextTable]:
    """Yield the numbers of poses without a solution and of singular poses, and the ranges of the actuators.

    Args:
        case: the case.
        found: joint coordinates at the poses.
        file: name of the file of poses.
        rows: row numbers of the poses in the file.
    """
    yield title_line(case)
    if found.held:
        several = len(found.held) > 1
        who = f"driven joint{'s' * several} {', '.join(found.held)}"
        words = f"{who} held at home: the pose does not determine {'their positions' if several else 'its position'}"
        yield Line(words, label="note")
    total, closed = len(rows), int(found.closed.sum())
    if closed == total:
        where = "the pose" if total == 1 else f"all {total} poses"
        yield Line(f"solved at {where}", label="inverse kinematics", tone=Tone.HOLDS)
    else:
        words = f"no solution at {total - closed} of {counted(total, 'pose')}"
        yield Line(words, label="inverse kinematics", tone=Tone.FAULT, after=_first(~found.closed, file, rows))
    if found.dependent:
        yield Line(
            ", ".join(found.dependent),
            label="dependent coordinates",
            after=", determined by the other coordinates of each pose",
        )
    if found.singular.any():
        words = f"{int(found.singular.sum())} of {counted(total, 'pose')}"
        yield Line(words, label="singular", tone=Tone.CAUTION, after=_first(found.singular, file, rows))
    if closed:
        smallest, largest = (each(found.coordinates, axis=0) for each in (np.nanmin, np.nanmax))
        ends = []
        for k, joint in enumerate(driven_joints(case.model)):
            shown = [case.units.shown(float(each[k]), joint.dimension) for each in (smallest, largest)]
            cells = [number(each, max(map(abs, shown))) for each in shown]
            ends.append((joint.name, found.measures[k], *cells, case.units.label(joint.dimension)))
        yield TextTable(("actuator", "quantity", "smallest", "largest", "unit"), tuple(ends), "actuators")


def _first(chosen: NDArray[np.bool_], file: str, rows: Sequence[int]) -> str:
    first = rows[int(np.argmax(chosen))]
    return f": row {first} of {file}" if chosen.sum() == 1 else f", the first in row {first} of {file}"

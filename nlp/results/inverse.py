"""Inverse kinematics of many poses in words, and as comma-separated values in the case's units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension, FloatArray
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.workspace import POSITION, TURNS
from ..evidence.inverse import InversePoses
from ..system.csvtext import csv_text
from .rounding import number
from .text import Line, TextTable, Tone
from .wording import title_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TWIST = ("omega_x", "omega_y", "omega_z", "v_x", "v_y", "v_z")
_WRENCH = ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z")


def inverse_summary(case: Case, found: InversePoses, file: str, rows: Sequence[int]) -> Iterator[Line | TextTable]:
    """Yield how many poses are closed or singular, the first row of those that need attention, and the coordinates.

    Args:
        case: the case.
        found: the joints at its poses.
        file: name of the file of poses.
        rows: number of each pose's row in it.
    """
    yield title_line(case)
    if found.held:
        several = len(found.held) > 1
        who = f"driven joint{'s' * several} {', '.join(found.held)}"
        words = f"{who} held at home: the pose does not determine {'their positions' if several else 'its position'}"
        yield Line(words, label="note")
    total, closed = len(rows), int(found.closed.sum())
    if closed == total:
        yield Line("the pose is closed" if total == 1 else f"all {total} poses are closed", tone=Tone.HOLDS)
    else:
        yield Line(f"{_of(total - closed, total)} not closed", tone=Tone.FAULT, after=_first(~found.closed, file, rows))
    if found.dependent:
        yield Line(", ".join(found.dependent), label="follow", after=" from the other coordinates of each pose")
    if found.singular.any():
        yield Line(
            f"{_of(int(found.singular.sum()), total)} singular",
            tone=Tone.CAUTION,
            after=_first(found.singular, file, rows),
        )
    if closed:
        smallest, largest = (each(found.coordinates, axis=0) for each in (np.nanmin, np.nanmax))
        ends = []
        for k, joint in enumerate(driven_joints(case.model)):
            shown = [case.units.shown(float(each[k]), joint.dimension) for each in (smallest, largest)]
            cells = [number(each, max(map(abs, shown))) for each in shown]
            ends.append((joint.name, found.measures[k], *cells, case.units.label(joint.dimension)))
        yield TextTable(("actuator", "quantity", "smallest", "largest", "unit"), tuple(ends), "actuators")


def _of(count: int, total: int) -> str:
    return f"{count} of {total} pose{'s' if total > 1 else ''} {'is' if count == 1 else 'are'}"


def _first(chosen: NDArray[np.bool_], file: str, rows: Sequence[int]) -> str:
    first = rows[int(np.argmax(chosen))]
    return f": row {first} of {file}" if chosen.sum() == 1 else f", the first in row {first} of {file}"


def inverse_csv(case: Case, found: InversePoses, rows: Sequence[int], *, derivatives: bool) -> str:
    """Return a row for each pose: whether it is closed and singular, then numbers, which are empty where not closed.

    Args:
        case: the case.
        found: the joints at its poses.
        rows: number of each pose's row in its file.
        derivatives: whether the rates of the actuators and J follow, in radians and the case's unit of length.
    """
    head = ["row", "closed", "singular", *found.dependent]
    head += [f"{measure} {name}" for measure, name in zip(found.measures, found.actuators, strict=True)]
    head += found.joints
    dimensions = [each.dimension for each in driven_joints(case.model)]
    dimensions += [each.dimension for each in case.model.unknowns]
    following = [_coordinate(found, name) for name in found.dependent]
    shown = [Dimension.LENGTH if name in POSITION else Dimension.ANGLE for name in found.dependent]
    columns = np.stack(following, axis=1) if following else np.zeros((len(rows), 0))
    parts = [_in_units(case, np.hstack([columns, found.coordinates, found.unknowns]), [*shown, *dimensions])]
    if derivatives:
        head += [f"rate {name} {part}" for name in found.actuators for part in _TWIST]
        head += [f"J {k + 1} {part}" for k in range(found.jacobian.shape[1]) for part in _WRENCH]
        parts += [each.reshape(len(rows), -1) for each in (found.rates, found.jacobian)]
    words = ("no", "yes")
    return csv_text(
        head,
        (
            (row, words[closed], words[singular], *(values if closed else [None] * len(values)))
            for row, closed, singular, values in zip(
                rows, found.closed.tolist(), found.singular.tolist(), np.hstack(parts).tolist(), strict=True
            )
        ),
    )


def _coordinate(found: InversePoses, name: str) -> FloatArray:
    """Return a coordinate (N,) of the poses: of the position, or roll, pitch or yaw, radians."""
    if name in POSITION:
        return found.positions[:, POSITION.index(name)]
    R = found.rotations
    angles = np.arctan2(R[:, 2, 1], R[:, 2, 2]), np.arcsin(-R[:, 2, 0]), np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.asarray(angles[TURNS.index(name)])


def _in_units(case: Case, values: FloatArray, dimensions: Sequence[Dimension]) -> FloatArray:
    """Return numbers (N, k) in the case's units."""
    return values / [case.units.to_internal(1.0, each) for each in dimensions]

"""Inverse kinematics of many poses as comma-separated values in the case's units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models import Dimension, FloatArray
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.workspace import POSITION, TURNS
from ..evidence.inverse import InversePoses
from ..system.csvtext import csv_text

_TWIST = ("omega_x", "omega_y", "omega_z", "v_x", "v_y", "v_z")
_WRENCH = ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z")


def inverse_csv(case: Case, found: InversePoses, rows: Sequence[int], *, derivatives: bool) -> str:
    """Return a row for each pose: closed, singular, and coordinates, which are empty if the loops are not closed.

    Args:
        case: the case.
        found: joint coordinates at the poses.
        rows: row number of each pose in its file.
        derivatives: If true, actuator rates and J follow, in radians and the case's unit of length.
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
    """Return a coordinate (N,) of the poses: x, y or z, or roll, pitch or yaw in radians."""
    if name in POSITION:
        return found.positions[:, POSITION.index(name)]
    R = found.rotations
    angles = np.arctan2(R[:, 2, 1], R[:, 2, 2]), np.arcsin(-R[:, 2, 0]), np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.asarray(angles[TURNS.index(name)])


def _in_units(case: Case, values: FloatArray, dimensions: Sequence[Dimension]) -> FloatArray:
    """Return values (N, k) in the case's units."""
    return values / [case.units.to_internal(1.0, each) for each in dimensions]

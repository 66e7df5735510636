"""Rotations as numbers, in the rotation form of the case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension
from ..case.pose import RotationForm
from ..case.workspace import TurnKind

if TYPE_CHECKING:
    from ..case.case import Case


def rotation_form(case: Case) -> RotationForm:
    """Return the rotation form for poses of a case: that of the workspace, the path, or the stated pose."""
    if case.workspace is not None:
        is_rpy = case.workspace.turns.kind is TurnKind.ROLL_PITCH_YAW
        return RotationForm.RPY if is_rpy else RotationForm.AXIS_ANGLE
    return RotationForm.RPY if case.path is not None else case.rotation.form


def rotation_numbers(case: Case, axis: Sequence[float], angle: float, form: RotationForm) -> dict[str, list[float]]:
    """Return the numbers of a rotation in a form, by the names of ``--set``.

    Args:
        case: the case.
        axis: (3,) unit axis.
        angle: angle about the axis, in the case's unit.
        form: form of the numbers.
    """
    if form is RotationForm.AXIS_ANGLE:
        turns = None if case.workspace is None else case.workspace.turns
        # About an axis that the case states, the angle has a sign.
        is_back = turns is not None and turns.kind is TurnKind.AXIS and np.dot(axis, turns.axis) < 0
        sign = -1.0 if is_back else 1.0
        return {"axis": [sign * each for each in axis], "angle": [sign * angle]}
    from ..path.orientation import roll_pitch_yaw  # noqa: PLC0415 - few cases state such rotations

    half = case.units.to_internal(angle, Dimension.ANGLE) / 2
    quaternion = [math.cos(half), *(math.sin(half) * each for each in axis)]
    if form is RotationForm.QUATERNION:
        return {form.value: quaternion}
    angles = roll_pitch_yaw(np.array([quaternion]))[0].tolist()
    return {form.value: [case.units.shown(each, Dimension.ANGLE) for each in angles]}

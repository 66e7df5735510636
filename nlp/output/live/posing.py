"""Poses of a path as variables of a live view: a case with a free pose, and the places of its coordinates."""

from __future__ import annotations

import math
from dataclasses import replace

from ....models import FloatArray
from ...case.case import Case
from ...case.pose import Free, Rotation
from ...errors import InputError
from ...program.nlp import Nlp
from ...program.places import FreeRotation

#: Room around the path in its box of positions, as a fraction of the robot's size, and of the rotations, radians.
_ROOM, _TURN = 0.05, 0.2
#: Largest rotation, radians: a case with a free axis allows 179 degrees.
HALF_TURN = math.radians(178.9)


def with_free_pose(case: Case, positions: FloatArray, largest: float, size: float) -> Case:
    """Return a case at one pose, whose range contains the poses of a path, and without the path.

    Args:
        case: the case.
        positions: (N, 3) positions of the path.
        largest: largest rotation of the path, radians.
        size: size of the robot, length.
    """
    room, angle = _ROOM * size, min(largest + _TURN, HALF_TURN)
    position = [
        Free(float(low) - room, float(high) + room)
        for low, high in zip(positions.min(axis=0), positions.max(axis=0), strict=True)
    ]
    return replace(
        case,
        position=position,
        rotation=Rotation(axis=None, angle=Free(-angle, angle)),
        displacements=case.displacements[:1],
        further=(),
        workspace=None,
        path=None,
        worst_everywhere=False,
    )


def pose_places(nlp: Nlp) -> list[int]:
    """Return the indices in ``x`` of position and rotation: three coordinates, then the quaternion's vector part."""
    numbers = dict(zip(nlp.case.scalars, nlp.program.places.numbers, strict=True))
    (rotation,) = nlp.program.places.rotations
    if not isinstance(rotation, FreeRotation):
        raise InputError("the rotation of the platform has no variables")
    return [*(numbers[f"p_{letter}"].index for letter in "xyz"), *rotation.q]

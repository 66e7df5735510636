"""Motions and wrenches as data: a screw's six coordinates, with its axis, point and pitch."""

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...models import axis_from_screw
from .jsondata import JsonObject, Vector3, Vector6, vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class MotionData(JsonObject):
    """An instantaneous motion of the platform.

    Attributes:
        twist: angular velocity, then velocity at the world origin.
        axis: unit direction of the screw axis.
        point: the axis's point nearest to the world origin; null for a translation.
        pitch: length per radian; "inf" for a translation.
    """

    twist: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


class WrenchData(JsonObject):
    """A wrench of unit force, or a unit couple.

    Attributes:
        wrench: force, then moment about the world origin.
        axis: unit direction of the screw axis.
        point: the axis's point nearest to the world origin; null for a couple.
        pitch: moment along the axis per unit of force, length; "inf" for a couple.
    """

    wrench: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


def motion_data(twist: "ArrayLike") -> MotionData:
    """Return a twist (6,) with its axis, point and pitch; a pure translation has no point."""
    screw = axis_from_screw(twist)
    translation = math.isinf(screw.pitch)
    return MotionData(
        twist=vector(np.asarray(twist, dtype=np.float64)),
        axis=vector(screw.axis),
        point=None if translation else vector(screw.point),
        pitch="inf" if translation else screw.pitch,
    )


def wrench_data(wrench: "ArrayLike") -> WrenchData:
    """Return a wrench (6,) with its axis, point and pitch; a pure couple has no point."""
    screw = axis_from_screw(wrench)
    couple = math.isinf(screw.pitch)
    return WrenchData(
        wrench=vector(np.asarray(wrench, dtype=np.float64)),
        axis=vector(screw.axis),
        point=None if couple else vector(screw.point),
        pitch="inf" if couple else screw.pitch,
    )

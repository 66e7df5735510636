"""Motions and wrenches in results: six coordinates, with the axis, the point and the pitch of their screw."""

import math
from typing import TYPE_CHECKING, Literal, TypedDict

import numpy as np

from ...models import axis_from_screw
from ..system.jsonvalues import JsonObject, Vector3, Vector6, vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class ScrewMotion(JsonObject):
    """An instantaneous motion of the platform.

    Attributes:
        twist: angular velocity, then velocity at the world origin.
        axis: unit direction of the screw axis.
        point: point of the axis nearest to the world origin; null for a translation.
        pitch: length per radian; "inf" for a translation.
    """

    twist: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


class ScrewWrench(JsonObject):
    """A wrench of unit force, or a unit couple without a force.

    Attributes:
        wrench: force, then moment about the world origin.
        axis: unit direction of the screw axis.
        point: point of the axis nearest to the world origin; null for a couple.
        pitch: moment along the axis per unit of force, length; "inf" for a couple.
    """

    wrench: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


def motion_of(twist: "ArrayLike") -> ScrewMotion:
    """Return a twist (6,) with its axis, point and pitch; a pure translation has no point."""
    return ScrewMotion(twist=vector(np.asarray(twist, dtype=np.float64)), **_axis_of(twist))


def wrench_of(wrench: "ArrayLike") -> ScrewWrench:
    """Return a wrench (6,) with its axis, point and pitch; a pure couple has no point."""
    return ScrewWrench(wrench=vector(np.asarray(wrench, dtype=np.float64)), **_axis_of(wrench))


class _Axis(TypedDict):
    """Axis, point and pitch of a screw."""

    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


def _axis_of(coordinates: "ArrayLike") -> _Axis:
    """Return axis, point and pitch of a screw (6,); a screw of infinite pitch has no point."""
    screw = axis_from_screw(coordinates)
    infinite = math.isinf(screw.pitch)
    point = None if infinite else vector(screw.point)
    return {"axis": vector(screw.axis), "point": point, "pitch": "inf" if infinite else screw.pitch}

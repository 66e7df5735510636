"""Numbers of every machine as expressions of the pose: that of the design, and the change by errors of joint centres.

With the derivatives g_j by the error of centre j, a number of a machine within the tolerance t is at most

    g + t sum_j |g_j| + rest

at each pose, and at least ``g - t sum_j |g_j| - rest``. The rest bounds terms of second order over the workspace.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ....case.limits.constraint import Reading
from ....case.workspace import TurnKind
from ...statement.machine import INSIDE, CentreErrors
from ...statement.tolerance_bound import Worst
from ..robot.pose_box import PoseBox, PoseNumbers
from ..robot.tolerance_model import Family
from .second_order_change import second_order_change

#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Poses from whose first-order changes the size is taken beside which terms of second order are small.
_POSES = 32
_SEED = 0


class Place(NamedTuple):
    """Expressions of one pose: (n,) coordinates of a family in the symbols of a layout of the exact machine."""

    family: Family
    z: SX


def worst_number(place: Place, number: SX, reading: Reading, sign: float) -> Worst | None:
    """Return the largest (sign 1) or smallest (sign -1) value of a number over all machines; None without a bound.

    Args:
        place: the machines, none of whose coordinates follows from others.
        number: (1, 1) in their coordinates, smooth.
        reading: how it reads.
        sign: which end is meant.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    family, e = place.family, place.family.errors
    machine = _Machine(family, number, reading, sign)
    poses = family.problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(family.problem.free)]
    first = max((machine.first_order_change(z) for z in poses), default=0.0)
    rest = second_order_change(family, number, first)
    if not math.isfinite(rest):
        return None
    gradient = ca.gradient(number, e)
    parts = [gradient[3 * j : 3 * j + 3] for j in range(len(family.names))]
    change = sum((ca.norm_2(each) for each in parts if each.nnz()), SX(0))
    whole = number + sign * (family.tolerance * change + rest) * _OUTWARDS
    function = ca.Function("worst", [family.problem.z, e], [whole])
    expression = function.call([place.z, SX.zeros(e.numel())])[0]
    return Worst(expression=expression, machine=machine.worst)


class _Machine:
    """A number of single machines.

    Args:
        family, number, reading, sign: as for :func:`worst_number`.
    """

    def __init__(self, family: Family, number: SX, reading: Reading, sign: float) -> None:
        self._family, self._reading, self._sign = family, reading, sign
        slopes = ca.densify(ca.gradient(number, family.errors))
        self._function = ca.Function("number", [family.coordinates], [number, slopes])

    def first_order_change(self, z: FloatArray) -> float:
        """Return the first-order change at a pose (n,), of derivatives that are defined."""
        slopes = self._slopes(z)
        return self._family.tolerance * float(np.nan_to_num(np.linalg.norm(slopes, axis=1)).sum())

    def worst(self, pose: PoseNumbers) -> tuple[CentreErrors, float]:
        """Return the errors that are worst at a pose to first order, and the number, as people read it, with them."""
        family = self._family
        z = coordinates_of(family.problem.box, pose)[list(family.problem.free)]
        slopes = self._slopes(z)
        sizes = np.linalg.norm(slopes, axis=1, keepdims=True)
        unit = np.divide(slopes, sizes, out=np.zeros_like(slopes), where=sizes > 0)
        whole = np.concatenate([z, (self._sign * INSIDE * family.tolerance * unit).ravel()])
        return family.errors_of(whole), self._reading.from_value(float(self._function(whole)[0]))

    def _slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (m, 3) by the errors of the design at a pose (n,)."""
        return np.array(self._function(self._family.exact(z))[1].full().reshape(-1, 3))


def coordinates_of(box: PoseBox, pose: PoseNumbers) -> FloatArray:
    """Return the coordinates (6,) of a pose of a box: the inverse of :meth:`PoseBox.pose`."""
    R = pose.rotation
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
        pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
        turn = np.array([roll, pitch, yaw])
        return np.concatenate([pose.position, np.tan(turn / 2)])
    vector = math.tan(pose.angle / 2) * np.asarray(pose.axis)
    if box.kind is TurnKind.AXIS:
        vector = np.array([float(vector @ box.axis), 0.0, 0.0])
    return np.concatenate([pose.position, vector])

"""Rows of six legs over boxes of poses, as polynomials of the coordinates.

A row is used without division: with ``s > 0`` the scale of the rotation's coordinates and ``u = s R a``, the row of a
leg from ``b`` on the base to ``a`` on the platform is

    (s (p - b) + u,  u x (p - b)):     s times the leg's vector, and s times its moment about the platform's origin.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser, Forms
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox, polynomial_rotation


class LegRows:
    """Forms of the rows.

    Args:
        legs: joint centres.
        box: the whole box, for the kind of its coordinates.
    """

    def __init__(self, legs: Legs, box: PoseBox) -> None:
        y, rows = SX.sym("y", 6), []
        turned, scale = polynomial_rotation(box, y[3:])
        for base, platform in zip(legs.base.tolist(), legs.platform.tolist(), strict=True):
            u, d = turned @ SX(platform), y[:3] - SX(base)
            rows.append(ca.vertcat(scale * d + u, ca.cross(u, d)))
        self._encloser = Encloser(y, ca.vertcat(*rows))

    def over(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return the rows (B, 6, 6) over boxes (B, 6), rests with the terms of second order.

        Linear parts are (B, 6, 6, 6), the last index that of the coordinate.
        """
        c, a, Q, r = self._encloser.second(lower.T, upper.T)
        count = len(lower)
        rest = (r + np.abs(Q).sum(axis=2)).reshape(count, 6, 6)
        return Forms(c.reshape(count, 6, 6), a.reshape(count, 6, 6, 6), rest)


def rows_at(legs: Legs, box: PoseBox, points: FloatArray) -> FloatArray:
    """Return the rows (K, 6, 6) at points (K, 6) without the scale: vectors of the legs, and their moments."""
    arm = np.einsum("kij,lj->kli", box.rotations(points), legs.platform)
    span = points[:, None, :3] - legs.base + arm
    return np.concatenate([span, np.cross(arm, span)], axis=2)

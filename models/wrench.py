"""Rows of the Jacobian: the wrenches that limbs apply to the platform."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import casadi as ca
from casadi import SX


class WrenchKind(enum.Enum):
    """What a limb applies to the platform along one row of the Jacobian."""

    FORCE = "force"
    COUPLE = "couple"


@dataclass(frozen=True, eq=False)
class Wrench:
    """One row of the Jacobian: the wrench that a limb applies to the platform, before it is made a unit wrench.

    The unit wrench is ``(force, moment) / sqrt(square)``. Rows are kept in this form because
    ``(m . omega + f . v)^2 / square`` is smoother and has a tighter interval enclosure than the product of unit
    vectors.

    Attributes:
        limb: name of the limb that applies it.
        kind: a force along a line, or a constraint couple.
        force: (3, 1) in world coordinates; zero for a couple.
        moment: (3, 1) about the world origin; the direction of the couple for a couple.
        square: (1, 1) squared length of ``force``, or of ``moment`` for a couple.
    """

    limb: str
    kind: WrenchKind
    force: SX
    moment: SX
    square: SX

    def rate(self, twist: SX) -> SX:
        """Reciprocal product ``m . omega + f . v`` with a (6, 1) twist, not yet divided by ``sqrt(square)``."""
        return ca.dot(self.moment, twist[:3]) + ca.dot(self.force, twist[3:])


def force_along(limb: str, point: SX, direction: SX) -> Wrench:
    """Row of a limb that pushes the platform along a line.

    Args:
        limb: name of the limb.
        point: (3, 1) any point of the line in the world frame, length.
        direction: (3, 1) along the line towards the platform, of any length but zero.
    """
    return Wrench(limb, WrenchKind.FORCE, direction, ca.cross(point, direction), ca.sumsqr(direction))


def couple_about(limb: str, direction: SX) -> Wrench:
    """Row of a limb that keeps the platform from turning about a direction.

    Args:
        limb: name of the limb.
        direction: (3, 1) in world coordinates, of any length but zero.
    """
    return Wrench(limb, WrenchKind.COUPLE, SX.zeros(3), direction, ca.sumsqr(direction))

"""Rows of the Jacobian: the wrenches that limbs apply to the platform."""

from __future__ import annotations

import enum
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .values import dataclass


class WrenchKind(enum.Enum):
    """Kind of wrench of a row of the Jacobian."""

    FORCE = "force"
    COUPLE = "couple"
    WRENCH = "wrench"


class RowLabel(NamedTuple):
    """Label of a row of the Jacobian.

    Attributes:
        limb: name of the limb that applies the wrench.
        kind: kind of the wrench.
        member: name of the member that applies the wrench: the limb's name, with a number if the limb has several
            members.
    """

    limb: str
    kind: WrenchKind
    member: str


@dataclass(frozen=True, eq=False)
class Wrench:
    """One row of the Jacobian before normalisation: the wrench that a limb applies to the platform.

    The unit wrench is ``(force, moment) / sqrt(square)``. Rows have this form because
    ``(m . omega + f . v)^2 / square`` is smoother and has a tighter interval enclosure than the product of unit
    vectors.

    Attributes:
        limb: name of the limb that applies the wrench.
        kind: force along a line, or constraint couple; rows of other kinds belong to members.
        force: (3, 1) force in world coordinates, of any length but zero; zero for a couple.
        moment: (3, 1) moment about the world origin; direction of a couple.
        square: (1, 1) squared length of ``force``, or of ``moment`` for a couple.
        member: name of the member that applies the wrench, if the limb has several; empty for the limb itself.
    """

    limb: str
    kind: WrenchKind
    force: SX
    moment: SX
    square: SX
    member: str = ""

    @property
    def label(self) -> RowLabel:
        """Label of the row."""
        return RowLabel(self.limb, self.kind, self.member or self.limb)

    def rate(self, twist: SX) -> SX:
        """Return the reciprocal product ``m . omega + f . v``, (1, 1), with a twist (6, 1).

        The product is not divided by ``sqrt(square)``.
        """
        return ca.dot(self.moment, twist[:3]) + ca.dot(self.force, twist[3:])


def force_along(limb: str, point: SX, direction: SX) -> Wrench:
    """Return the row of a limb that applies a force along a line.

    Args:
        limb: name of the limb.
        point: (3, 1) any point of the line in the world frame, length.
        direction: (3, 1) direction along the line towards the platform in the world frame, of any length but zero.
    """
    return Wrench(limb, WrenchKind.FORCE, direction, ca.cross(point, direction), ca.sumsqr(direction))


def couple_about(limb: str, direction: SX) -> Wrench:
    """Return the row of a limb that applies a couple, which resists rotation about a direction.

    Args:
        limb: name of the limb.
        direction: (3, 1) direction of the couple in world coordinates, of any length but zero.
    """
    return Wrench(limb, WrenchKind.COUPLE, SX.zeros(3), direction, ca.sumsqr(direction))


def reason_for_zero_row(row: Wrench) -> str:
    """Return the reason why a row has zero direction and so no unit wrench, as a clause for messages."""
    if row.kind is WrenchKind.COUPLE:
        return f"the couple of limb {row.limb!r} has no direction: the two axes that it must be normal to coincide"
    return f"limb {row.limb!r} has zero length: its two joints coincide"

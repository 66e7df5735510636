"""Matrices whose full column rank means that a robot has no motion that nothing resists.

With actuators locked, the platform's twist x is resisted unless each row ``L`` of a limb does no work in it, ``L.x =
0``, and it is a motion of the passive joints of each member: ``x - sum_j w_j S_j = 0`` with rates ``w``. Together these
are ``M (x, w) = 0`` with entries that are rows and screws themselves, neither normalised nor made orthogonal. J has
full rank, and the passive screws of every member are independent, exactly where M has full column rank.

With free actuators of rates ``u``, each row and member sees ``x - A u`` in the place of x, with the screws ``A`` of
those actuators that move its member; and the relations of rates that loops demand are rows of their own. The null space
of this matrix N has as many dimensions as the robot has freedoms and rates of actuators without a motion, more only
where the constraint wrenches lose their rank, or passive screws theirs.

The screws of members with nested loops follow from ``L q = 0`` with the rank that L has at almost all poses. They would
not tell a pose at which L loses it, and the member resists less. So both matrices have, as blocks of their own, as many
rows of L as its rank, transposed: full column rank means that L keeps its rank too.

Twists are ``(v, length omega)`` with the velocity v of the platform's origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
from casadi import SX

from .....models import Actuator, Member, Wrench, WrenchKind, rate_relations


@dataclass(frozen=True, eq=False)
class RankMatrix:
    """A matrix of expressions whose rank is judged.

    Attributes:
        matrix: (m, c) sparse: the first six columns are the platform's twist.
        nullity: dimension of its null space at almost all poses: 0, or the robot's freedoms and idle rates.
    """

    matrix: SX
    nullity: int


@dataclass(frozen=True, eq=False)
class Limbs:
    """Rows and members of a robot at a pose, with its actuators.

    Attributes:
        wrenches: rows.
        members: members; those columns of each that are independent.
        actuators: actuated joints.
        loops: (m, k) each, the equations of nested loops in the rates of a member's passive joints.
        position: (3, 1) the platform's origin, length.
        length: by which rotations are multiplied.
    """

    wrenches: Sequence[Wrench]
    members: Sequence[Member]
    actuators: Sequence[Actuator]
    loops: Sequence[SX]
    position: SX
    length: float

    def reduced(self, columns: Sequence[Sequence[int]], rows: Sequence[Sequence[int]], length: float) -> Limbs:
        """Return the limbs with some of the screws and loop equations of each member, and another length.

        Args:
            columns: indices of the screws that are kept.
            rows: indices of the equations that are kept.
            length: by which rotations are multiplied.
        """
        members = [
            replace(each, screws=each.screws[:, list(kept)], groups=())
            for each, kept in zip(self.members, columns, strict=True)
        ]
        loops = [each[list(kept), :] for each, kept in zip(self.loops, rows, strict=True)]
        return replace(self, members=members, loops=loops, length=length)

    def about_platform(self, row: Wrench) -> SX:
        """Return the force and the moment (1, 6) of a row about the platform's origin, divided by the length."""
        return ca.horzcat(row.force.T, (row.moment - ca.cross(self.position, row.force)).T / self.length)

    def twists(self, screws: SX) -> SX:
        """Return twists (6, k), angular velocity, then velocity at the world's origin, as ``(v, length omega)``."""
        found = [
            ca.vertcat(screws[3:, j] + ca.cross(screws[:3, j], self.position), self.length * screws[:3, j])
            for j in range(screws.shape[1])
        ]
        return ca.horzcat(SX(6, 0), *found)


def locked_matrix(limbs: Limbs) -> SX:
    """Return M, with the actuators locked."""
    return _matrix(limbs, [])


def free_matrix(limbs: Limbs) -> SX:
    """Return N, with the actuators free; of a robot given by its rows the couples alone, which are its constraints."""
    if limbs.actuators:
        return _matrix(limbs, limbs.actuators)
    couples = [row for row in limbs.wrenches if row.kind is WrenchKind.COUPLE]
    return _matrix(replace(limbs, wrenches=couples, members=(), loops=()), [])


def _matrix(limbs: Limbs, driven: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), sparse, with one column for each driven joint at its end."""
    # What rows and members see of the platform's twist, and the passive screws that they see it less.
    parts = [(row.label.member, limbs.about_platform(row), SX(6, 0)) for row in limbs.wrenches]
    for member in limbs.members:
        # A pinned member sees the velocity of its centre alone: v + omega x (centre - p).
        arm = (member.centre - limbs.position) / limbs.length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if member.is_pinned else SX.eye(6)
        parts.append((member.label, seen, member.screws))
    by_drives = [
        ca.horzcat(SX(seen.shape[0], 0), *[_rate(limbs, seen, each.screw_in(label)) for each in driven])
        for label, seen, _ in parts
    ]
    motions = ca.horzcat(
        ca.vertcat(SX(0, 6), *[seen for _, seen, _ in parts]),
        ca.diagcat(SX(0, 0), *[-seen @ limbs.twists(screws) for _, seen, screws in parts]),
        ca.vertcat(SX(0, len(driven)), *by_drives),
    )
    relations = rate_relations(driven)
    motions = ca.vertcat(motions, ca.horzcat(SX(relations.shape[0], motions.shape[1] - len(driven)), relations))
    return ca.sparsify(ca.diagcat(motions, *[each.T for each in limbs.loops if each.shape[0]]))


def _rate(limbs: Limbs, seen: SX, screw: SX | None) -> SX:
    """Return the column (k, 1) of a driven joint; zeros where it does not move what is seen."""
    return SX(seen.shape[0], 1) if screw is None else -seen @ limbs.twists(screw)

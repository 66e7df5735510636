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
        length: by which rotations are multiplied, length.
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


def locked_matrix(limbs: Limbs) -> SX:
    """Return M, with the actuators locked."""
    return _matrix(limbs, [])


def free_matrix(limbs: Limbs) -> SX:
    """Return N, with the actuators free; of a robot given by its rows the couples alone, which are its constraints."""
    if limbs.actuators:
        return _matrix(limbs, limbs.actuators)
    couples = [row for row in limbs.wrenches if row.kind is WrenchKind.COUPLE]
    return _matrix(Limbs(couples, (), (), (), limbs.position, limbs.length), [])


def _matrix(limbs: Limbs, driven: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), sparse, with one column for each driven joint at its end."""
    p, length = limbs.position, limbs.length
    rates = sum(member.screws.shape[1] for member in limbs.members)
    columns, blocks, at = 6 + rates + len(driven), [], 6
    for row in limbs.wrenches:
        moment = row.moment - ca.cross(p, row.force)
        left = ca.horzcat(row.force.T, moment.T / length)
        block = SX(1, columns)
        block[0, :6] = left
        for k, actuator in enumerate(driven):
            screw = actuator.screw_in(row.label.member)
            if screw is not None:
                block[0, 6 + rates + k] = -left @ _twist(screw, p, length)
        blocks.append(block)
    for member in limbs.members:
        screws = member.screws
        count = screws.shape[1]
        own = [_twist(screws[:, j], p, length) for j in range(count)]
        # A pinned member sees the velocity of its centre alone: v + omega x (centre - p).
        arm = (member.centre - p) / length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if member.is_pinned else SX.eye(6)
        block = SX(member.size, columns)
        block[:, :6] = seen
        for j, twist in enumerate(own):
            block[:, at + j] = -seen @ twist
        for k, actuator in enumerate(driven):
            screw = actuator.screw_in(member.label)
            if screw is not None:
                block[:, 6 + rates + k] = -seen @ _twist(screw, p, length)
        blocks.append(block)
        at += count
    relations = rate_relations(driven)
    blocks.append(ca.horzcat(SX(relations.shape[0], columns - len(driven)), relations))
    return ca.sparsify(ca.diagcat(ca.vertcat(*blocks), *[each.T for each in limbs.loops if each.shape[0]]))


def _twist(screw: SX, position: SX, length: float) -> SX:
    """Return a twist (6, 1), angular velocity, then velocity at the world's origin, as ``(v, length omega)``."""
    omega, v = screw[:3], screw[3:]
    return ca.vertcat(v + ca.cross(omega, position), length * omega)

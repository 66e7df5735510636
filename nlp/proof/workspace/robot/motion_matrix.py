"""Matrices whose full column rank means that a robot has no motion that nothing resists.

With actuators locked, the platform's twist x is resisted unless each row ``L`` of a limb does no work in it, ``L.x =
0``, and it is a motion of the passive joints of each member: ``x - sum_j w_j S_j = 0`` with rates ``w``. Together these
are ``M (x, w) = 0`` with entries that are rows and screws themselves, neither normalised nor made orthogonal. J has
full rank, and the passive screws of every member are independent, exactly where M has full column rank.

With free actuators of rates ``u``, each row and member sees ``x - A u`` in the place of x, with the screws ``A`` of
those actuators that move its member. The null space of this matrix N has as many dimensions as the robot has freedoms
and rates of actuators without a motion, more only where the constraint wrenches lose their rank, or passive screws
theirs.

A member with nested loops has the motions ``S_p w + S_a u`` of all its joints along a tree of links as columns, and its
loops as rows ``L_p w + L_a u = 0``: screws of the platform that follow from the loops have the rank of almost all
configurations, also where the loops lose theirs. Rates w with which nothing but the member itself moves, such as the
spin of a rod between two ball joints, are further dimensions of both null spaces.

Twists are ``(v, length omega)`` with the velocity v of the platform's origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
from casadi import SX

from .....models import Actuator, JointScrews, Member, Wrench, WrenchKind


@dataclass(frozen=True, eq=False)
class RankMatrix:
    """A matrix of expressions whose rank is judged.

    Attributes:
        matrix: (m, c) sparse: the first six columns are the platform's twist.
        nullity: dimension of its null space at almost all poses: of the robot's freedoms and idle rates.
    """

    matrix: SX
    nullity: int


@dataclass(frozen=True, eq=False)
class Limbs:
    """Rows and members of a robot at a pose, with its actuators.

    Attributes:
        wrenches: rows.
        members: members; those columns of each that are independent.
        nested: members with nested loops.
        actuators: actuated joints.
        position: (3, 1) the platform's origin, length.
        length: by which rotations are multiplied, length.
    """

    wrenches: Sequence[Wrench]
    members: Sequence[Member]
    nested: Sequence[JointScrews]
    actuators: Sequence[Actuator]
    position: SX
    length: float

    @property
    def idle(self) -> int:
        """Dimension of the rates of passive joints without a motion of the platform, at almost all poses."""
        return sum(each.idle for each in self.nested)

    @property
    def simple(self) -> list[Member]:
        """Members without nested loops."""
        names = {each.member for each in self.nested}
        return [each for each in self.members if each.label not in names]

    def reduced(self, columns: Sequence[Sequence[int]], length: float) -> Limbs:
        """Return the limbs with some of the screws of each member without nested loops, and another length.

        Args:
            columns: indices of the screws that are kept.
            length: by which rotations are multiplied.
        """
        members = [
            replace(each, screws=each.screws[:, list(kept)], groups=())
            for each, kept in zip(self.simple, columns, strict=True)
        ]
        return replace(self, members=members, length=length)


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
    rates = sum(each.screws.shape[1] for each in limbs.members) + sum(len(each.passive) for each in limbs.nested)
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
    places = {(each.limb, each.name): 6 + rates + k for k, each in enumerate(driven)}
    for path in limbs.nested:
        own = {j: at + k for k, j in enumerate(path.passive)}
        at += len(own)
        own |= {j: places[path.limb, path.actuator(j)] for j in path.driven if driven}
        block, loops = SX(6, columns), SX(path.loops.shape[0], columns)
        block[:, :6] = SX.eye(6)
        for j, column in own.items():
            block[:, column] = -_twist(path.all[:, j], p, length)
            loops[:, column] = path.loops[:, j]
        blocks += [block, *[row for row in ca.vertsplit(ca.sparsify(loops)) if row.nnz()]]
    return ca.sparsify(ca.vertcat(SX(0, columns), *blocks))


def _twist(screw: SX, position: SX, length: float) -> SX:
    """Return a twist (6, 1), angular velocity, then velocity at the world's origin, as ``(v, length omega)``."""
    omega, v = screw[:3], screw[3:]
    return ca.vertcat(v + ca.cross(omega, position), length * omega)

"""Wrenches of a mechanism of any topology on its platform: members, rows of J, F, rates and ranks.

A member resists a twist with ``r_k = P_k x``, where ``x = (v + w x c, l w)`` is the twist in scaled coordinates about
the member's centre, and ``P_k`` projects orthogonally on the complement of the twists ``T_k`` that its passive joints
allow. ``F = sum |r_k|^2``, as for robots given limb by limb (:mod:`screwsynth.models.member`). Here ``T_k`` is the
platform part of the null space of the member's loop equations, so that loops may be nested and joints coupled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..actuation import drive_of
from ..arrays import FloatArray
from ..basis import basis_of_member
from ..rows import RANK_TOLERANCE, rank_of
from ..wrench import WrenchKind
from .centre import centre_of, centre_rule
from .decomposition import MemberGraph, robot_graph
from .graph import Mechanism, check_mechanism
from .mobility import Mobility


def scaled_twists(twists: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return twists (6, n) in scaled coordinates ``(v + w x c, l w)`` about a centre (3,) with a length."""
    return np.vstack([twists[3:] + np.cross(twists[:3].T, centre).T, length * twists[:3]])


@dataclass(frozen=True, eq=False)
class MemberWrenches:
    """Wrenches and allowed twists of a member with locked actuators.

    Attributes:
        limb: number of the member's limb, from 1.
        joints: names of the passive joints.
        actuators: names of the actuated joints of the limb on which the member depends.
        centre: (3,) centre of the member in the world frame, length.
        projector: (6, 6) projector ``P_k`` in scaled coordinates about the centre.
        actuation: (6, a) ``rho``: resisted component of each actuator's screw, in scaled coordinates.
        relations: (r, a) equations that the member's loops impose on actuator rates only.
        rows: (d, 6) orthonormal basis of the member's wrenches as rows of ``J``, with work rate ``row . (v, w)``;
            constraint wrenches first.
        kinds: kind of each row.
        twists: (6, t) basis of ``T_k``, the platform twists that the member allows with locked actuators.
        all_rank: number of independent platform twists that the member allows with unlocked actuators.
        length: characteristic length of scaled coordinates.
    """

    limb: int
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    centre: FloatArray
    projector: FloatArray
    actuation: FloatArray
    relations: FloatArray
    rows: FloatArray
    kinds: tuple[WrenchKind, ...]
    twists: FloatArray
    all_rank: int
    length: float

    @property
    def wrenches(self) -> int:
        """Dimension of the space ``W_k`` of the member's wrenches."""
        return len(self.rows)

    @property
    def constraints(self) -> int:
        """Dimension of the space ``C_k`` of constraint wrenches, which do no work in actuated joints."""
        return 6 - self.all_rank

    def resisted(self, twist: FloatArray) -> FloatArray:
        """Return the resisted part ``r_k`` (6,), in scaled coordinates, of a twist (6,) about the world origin."""
        return np.asarray(self.projector @ scaled_twists(twist[:, None], self.centre, self.length)[:, 0])


@dataclass(frozen=True)
class RobotRanks:
    """Ranks of a robot at a configuration.

    Attributes:
        passive: dimension of each member's ``T_k``, the twists that it allows with locked actuators.
        all: dimension of the twists that each member allows with unlocked actuators.
        jacobian: rank of J, of all rows.
        constraints: rank of the constraint wrenches of all limbs.
    """

    passive: tuple[int, ...]
    all: tuple[int, ...]
    jacobian: int
    constraints: int

    @property
    def freedoms(self) -> int:
        """Degrees of freedom of the platform with unlocked actuators."""
        return 6 - self.constraints

    @property
    def locked(self) -> int:
        """Degrees of freedom of the platform with locked actuators."""
        return 6 - self.jacobian


@dataclass(frozen=True, eq=False)
class RobotWrenches:
    """Wrenches of a mechanism on its platform at its configuration.

    Attributes:
        members: members of the mechanism.
        ranks: ranks at the configuration.
        units: rate of each actuated joint, by name, that moves the platform with a velocity of about 1.
        feasible: (6, f) basis of the platform twists with unlocked actuators.
    """

    members: tuple[MemberWrenches, ...]
    ranks: RobotRanks
    units: Mapping[str, float]
    feasible: FloatArray

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of all actuated joints."""
        return tuple(self.units)

    @property
    def jacobian(self) -> FloatArray:
        """All rows (m, 6): force, then moment about the world origin; couples times the characteristic length."""
        return np.vstack([np.zeros((0, 6)), *[member.rows for member in self.members]])

    def objective(self, twist: Sequence[float] | FloatArray) -> float:
        """Return F in a twist (6,): angular velocity, then velocity of the platform point at the world origin."""
        chi = np.asarray(twist, dtype=np.float64)
        return float(sum(float(np.sum(member.resisted(chi) ** 2)) for member in self.members))

    def rates(self, twist: Sequence[float] | FloatArray) -> Mapping[str, float]:
        """Return the actuator rates for a twist (6,), by least squares over the resisted components of all limbs.

        A rate is infinite for an actuator that cannot drive the platform, and NaN if the twist does not determine it.
        The fit is exact for a possible platform twist.
        """
        chi = np.asarray(twist, dtype=np.float64)
        found = dict.fromkeys(self.units, float("inf"))
        for limb in {member.limb for member in self.members}:
            own = [member for member in self.members if member.limb == limb]
            names = list(dict.fromkeys(name for member in own for name in member.actuators))
            driven, relations = [np.zeros((0, len(names)))], [np.zeros((0, len(names)))]
            for member in own:
                columns = [names.index(name) for name in member.actuators]
                for part, rows in ((driven, member.actuation), (relations, member.relations)):
                    part.append(np.zeros((len(rows), len(names))))
                    part[-1][:, columns] = rows
            drive = drive_of(
                np.vstack(driven), np.vstack(relations), np.array([self.units[name] for name in names]), 1.0
            )
            values = drive.rates(np.concatenate([member.resisted(chi) for member in own]))
            found |= {name: float(value) for name, value in zip(names, values, strict=True)}
        return found


def wrenches_of(mechanism: Mechanism, length: float = 1.0) -> RobotWrenches:
    """Return the wrenches of a mechanism with closed loops.

    Args:
        mechanism: mechanism at its configuration; see :func:`.closing.close`.
        length: characteristic length, unit of couples per force.

    Raises:
        MechanismError: the mechanism is inconsistent.
    """
    check_mechanism(mechanism)
    graph, mobility = robot_graph(mechanism), Mobility(mechanism)
    members = tuple(_member(mechanism, mobility, each, length) for each in graph.members)
    constraints = [np.zeros((0, 6))]
    for limb in graph.limbs:
        allowed = mobility.allowed(limb, limb)
        constraints.append(_reciprocal(mobility, allowed.twists))
    stacked = np.vstack(constraints)
    rows = [np.zeros((0, 6)), *[_reciprocal(mobility, member.twists) for member in members]]
    _, values, right = np.linalg.svd(stacked, full_matrices=True)
    rank = rank_of(values, 1.0)
    ranks = RobotRanks(
        passive=tuple(member.twists.shape[1] for member in members),
        all=tuple(member.all_rank for member in members),
        jacobian=rank_of(np.linalg.svd(np.vstack(rows), compute_uv=False), 1.0),
        constraints=rank,
    )
    units = {each.name: 1 / mobility.angle(each) for each in mechanism.joints if each.actuated}
    return RobotWrenches(members, ranks, units, mobility.unscaled(right[rank:].T))


def _reciprocal(mobility: Mobility, twists: FloatArray) -> FloatArray:
    """Return an orthonormal basis (d, 6) of the complement of twists, in the mechanism's scale."""
    left, _, _ = np.linalg.svd(mobility.scaled(twists), full_matrices=True)
    return np.asarray(left[:, twists.shape[1] :].T)


def _member(mechanism: Mechanism, mobility: Mobility, graph: MemberGraph, length: float) -> MemberWrenches:
    centre = centre_of(mechanism, centre_rule(mechanism, graph))
    locked = mobility.allowed(graph.joints, graph.passive)
    free = mobility.allowed(graph.joints, graph.joints)
    scaled = scaled_twists(locked.twists, centre, length)
    left, _, _ = np.linalg.svd(scaled, full_matrices=True)
    basis = left[:, locked.twists.shape[1] :]
    projector = basis @ basis.T
    driven = [k for k in graph.joints if mechanism.joints[k].actuated]
    own = np.array([free.columns.index(k) for k in driven], dtype=np.intp)
    weights = np.array([mobility.angle(mechanism.joints[k]) / mobility.size for k in driven])
    # In each motion with unlocked actuators the resisted component is rho times the actuator rates, because a motion
    # without such rates is not resisted. The relations exclude actuator rates that occur in no motion.
    rates = free.rates[own] * weights[:, None]
    actuation = projector @ scaled_twists(free.platform, centre, length) @ np.linalg.pinv(rates, rcond=RANK_TOLERANCE)
    left, values, _ = np.linalg.svd(rates)
    relations = left[:, rank_of(values, 1.0) :].T * weights
    actuation = actuation * weights
    # Rounding errors of actuation at a serial singularity must not count as directions.
    kept = np.linalg.norm(actuation, axis=0) > RANK_TOLERANCE * max(length, mobility.size)
    found = basis_of_member(projector, actuation[:, kept], basis.shape[1])
    forces = found.rows[:, :3]
    rows = np.hstack([forces, np.cross(centre, forces) + length * found.rows[:, 3:]])
    return MemberWrenches(
        limb=graph.limb + 1,
        joints=tuple(mechanism.joints[k].name for k in graph.passive),
        actuators=tuple(mechanism.joints[k].name for k in driven),
        centre=centre,
        projector=projector,
        actuation=actuation,
        relations=relations,
        rows=rows,
        kinds=found.kinds,
        twists=locked.twists,
        all_rank=free.twists.shape[1],
        length=length,
    )

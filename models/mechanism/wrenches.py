"""The wrenches with which a mechanism of any topology resists its platform: members, rows of J, F, rates and ranks.

A member resists a twist with ``r_k = P_k x``, where ``x = (v + w x c, l w)`` is the twist in scaled coordinates about
the member's centre, and ``P_k`` projects orthogonally on the complement of the twists ``T_k`` that its passive joints
allow. ``F = sum |r_k|^2``, as for robots given limb by limb (:mod:`screwsynth.models.member`); here ``T_k`` is the
platform's part of the null space of the member's loop equations, so that loops may be nested and joints coupled.
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
from .freedoms import Freedoms
from .graph import Mechanism, check_mechanism


def scaled_twists(twists: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return twists (6, n) in scaled coordinates ``(v + w x c, l w)`` about a centre (3,) with a length."""
    return np.vstack([twists[3:] + np.cross(twists[:3].T, centre).T, length * twists[:3]])


@dataclass(frozen=True, eq=False)
class MemberWrenches:
    """A member with its actuators locked.

    Attributes:
        limb: number of its limb, from 1.
        joints: names of its passive joints.
        actuators: names of the actuated joints of its limb that it depends on.
        centre: (3,) in the world frame, length.
        projector: (6, 6) ``P_k`` in scaled coordinates about the centre.
        actuation: (6, a) ``rho``: resisted part of the screw of each actuator, in the same coordinates.
        relations: (r, a) equations that its loops demand of the rates of these actuators alone.
        rows: (d, 6) orthonormal basis of its wrenches as rows of ``J``: a twist's work rate is ``row . (v, w)``. Those
            that do no work in its actuators are first.
        kinds: kind of each row.
        twists: (6, t) basis of ``T_k``, the platform's twists that it allows with locked actuators.
        all_rank: number of independent twists that it allows with free actuators.
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
        """Dimension of ``W_k``."""
        return len(self.rows)

    @property
    def constraints(self) -> int:
        """Dimension of ``C_k``: of the wrenches that do no work in its actuated joints."""
        return 6 - self.all_rank

    def resisted(self, twist: FloatArray) -> FloatArray:
        """Return ``r_k`` (6,) of a twist (6,): angular velocity, then velocity at the world origin."""
        return np.asarray(self.projector @ scaled_twists(twist[:, None], self.centre, self.length)[:, 0])


@dataclass(frozen=True)
class RobotRanks:
    """Ranks of a robot at a configuration.

    Attributes:
        passive: dimension of ``T_k`` of each member.
        all: the same with free actuators.
        jacobian: rank of all rows.
        constraints: rank of the constraints of all limbs.
    """

    passive: tuple[int, ...]
    all: tuple[int, ...]
    jacobian: int
    constraints: int

    @property
    def freedoms(self) -> int:
        """Freedoms of the platform with free actuators."""
        return 6 - self.constraints

    @property
    def locked(self) -> int:
        """Freedoms of the platform with locked actuators."""
        return 6 - self.jacobian


@dataclass(frozen=True, eq=False)
class RobotWrenches:
    """A mechanism's resistance at its configuration.

    Attributes:
        members: its members.
        ranks: its ranks.
        units: rates of all actuated joints by name that move the platform with velocities of order 1.
        feasible: (6, f) basis of the platform's twists with free actuators.
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
        """Return F in a twist (6,): angular velocity, then velocity of the platform's point at the world origin."""
        chi = np.asarray(twist, dtype=np.float64)
        return float(sum(float(np.sum(member.resisted(chi) ** 2)) for member in self.members))

    def rates(self, twist: Sequence[float] | FloatArray) -> Mapping[str, float]:
        """Return the rates of the actuators that leave least of what each limb resists in a twist (6,).

        They are infinite where an actuator cannot drive the platform, and not a number where the twist does not
        determine them. For a twist that the platform can make with free actuators nothing is left.
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
    """Return the resistance of a mechanism with closed loops.

    Args:
        mechanism: the mechanism at its configuration; see :func:`.closing.close`.
        length: characteristic length, by which couples are measured.

    Raises:
        MechanismError: the mechanism contradicts itself.
    """
    check_mechanism(mechanism)
    graph, freedoms = robot_graph(mechanism), Freedoms(mechanism)
    members = tuple(_member(mechanism, freedoms, each, length) for each in graph.members)
    constraints = [np.zeros((0, 6))]
    for limb in graph.limbs:
        allowed = freedoms.allowed(limb, limb)
        constraints.append(_reciprocal(freedoms, allowed.twists))
    stacked = np.vstack(constraints)
    rows = [np.zeros((0, 6)), *[_reciprocal(freedoms, member.twists) for member in members]]
    _, values, right = np.linalg.svd(stacked, full_matrices=True)
    rank = rank_of(values, 1.0)
    ranks = RobotRanks(
        passive=tuple(member.twists.shape[1] for member in members),
        all=tuple(member.all_rank for member in members),
        jacobian=rank_of(np.linalg.svd(np.vstack(rows), compute_uv=False), 1.0),
        constraints=rank,
    )
    units = {each.name: 1 / freedoms.angle(each) for each in mechanism.joints if each.actuated}
    return RobotWrenches(members, ranks, units, freedoms.unscaled(right[rank:].T))


def _reciprocal(freedoms: Freedoms, twists: FloatArray) -> FloatArray:
    """Return an orthonormal basis (d, 6) of what is orthogonal to twists in the mechanism's own scale."""
    left, _, _ = np.linalg.svd(freedoms.scaled(twists), full_matrices=True)
    return np.asarray(left[:, twists.shape[1] :].T)


def _member(mechanism: Mechanism, freedoms: Freedoms, graph: MemberGraph, length: float) -> MemberWrenches:
    """Return the wrenches of a member."""
    centre = centre_of(mechanism, centre_rule(mechanism, graph))
    locked = freedoms.allowed(graph.joints, graph.passive)
    free = freedoms.allowed(graph.joints, graph.joints)
    scaled = scaled_twists(locked.twists, centre, length)
    left, _, _ = np.linalg.svd(scaled, full_matrices=True)
    basis = left[:, locked.twists.shape[1] :]
    projector = basis @ basis.T
    driven = [k for k in graph.joints if mechanism.joints[k].actuated]
    own = np.array([free.columns.index(k) for k in driven], dtype=np.intp)
    weights = np.array([freedoms.angle(mechanism.joints[k]) / freedoms.size for k in driven])
    # In every motion with free actuators the resisted part is rho times the rates of the actuators, since a motion
    # without such rates is not resisted. Rates that no motion has are those in which the relations do work.
    rates = free.rates[own] * weights[:, None]
    actuation = projector @ scaled_twists(free.platform, centre, length) @ np.linalg.pinv(rates, rcond=RANK_TOLERANCE)
    left, values, _ = np.linalg.svd(rates)
    relations = left[:, rank_of(values, 1.0) :].T * weights
    actuation = actuation * weights
    # Rows of actuation that are rounding errors of a serial singularity must not count as directions.
    kept = np.linalg.norm(actuation, axis=0) > RANK_TOLERANCE * max(length, freedoms.size)
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

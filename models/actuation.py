"""Rates of actuators: the equations ``J chi = D qdot`` and ``B qdot = 0`` of a limb of any topology.

Each row of ``J`` has a work rate in the platform's twist ``chi``, and one in a unit rate of each actuator: ``D``. Loops
that more actuators drive than they have freedoms demand ``B qdot = 0`` of the actuators alone. The limb lets the
platform make the twists for which both equations have a solution: with ``Z`` a basis of the rates that ``B`` allows,
those in which the wrenches ``n'J`` with ``n'D Z = 0`` do no work. They are the constraints. The rates are the least
squares solution of the first equation among those of the second. Where both have a solution of no motion, the rates of
the actuators that take part in it are undetermined.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .arrays import FloatArray
from .member import pseudo_inverse
from .parts import Dimension, JointScrews
from .rows import RANK_TOLERANCE, rank_of
from .values import dataclass

if TYPE_CHECKING:
    from .model import Model

Flags: TypeAlias = NDArray[np.bool_]

#: Rates below this part of the largest are rounding errors of a solution: such an actuator takes no part.
_TAKES_PART = 1e-6


class Velocities(NamedTuple):
    """Numbers of a robot's velocity equations.

    Attributes:
        jacobian: (m, 6) ``J``: the rows of a :class:`~.instance.RobotInstance`, force, then moment about the origin.
        driven: (m, a) ``D``: work rate of each row for a unit rate of each actuator.
        relations: (r, a) ``B``.
    """

    jacobian: FloatArray
    driven: FloatArray
    relations: FloatArray


@dataclass(frozen=True, eq=False)
class Drive:
    """The actuators of a limb at a point, with rates of order 1: those of angles are times a length of the robot's.

    Attributes:
        works: (m, a) ``D`` on the rates that ``B`` allows, and 0 on those orthogonal to them.
        driving: (r, m) orthonormal combinations of rows by which the actuators drive.
        constraints: (k, m) the others, which do no work in the actuated joints.
        idle: (a, d) orthonormal rates of no motion.
        is_zero: (a,) whether an actuator can move while the platform and all other actuators stand still.
    """

    works: FloatArray
    driving: FloatArray
    constraints: FloatArray
    idle: FloatArray
    is_zero: Flags
    _unit: FloatArray
    _inverse: FloatArray

    def rates(self, resisted: FloatArray) -> FloatArray:
        """Return the rates (a,) that leave least of the work rates (m,) of the rows.

        They are infinite for an actuator that cannot drive the platform, and otherwise not a number where they are
        undetermined.
        """
        found = self._unit * (self._inverse @ resisted)
        found[self.is_undetermined] = np.nan
        return np.where(self.is_zero, np.inf, found)

    @property
    def is_undetermined(self) -> Flags:
        """Whether each actuator (a,) has a rate of no motion."""
        return np.asarray(np.linalg.norm(self.idle, axis=1) > _TAKES_PART)

    def driven_part(self, resisted: FloatArray) -> FloatArray:
        """Return the part (m,) of the rows' work rates that the actuators can move with."""
        return np.asarray(self.driving.T @ (self.driving @ resisted))


def drive_of(driven: FloatArray, relations: FloatArray, unit: FloatArray, size: float) -> Drive:
    """Return the actuators of a limb.

    Args:
        driven: (m, a) ``D``.
        relations: (r, a) ``B``; rows of zeros say nothing.
        unit: (a,) rates that move the platform with a velocity of order 1.
        size: of the rows, for unit forces 1: smaller work rates are measured by it.
    """
    scaled = relations * unit
    sizes = np.linalg.norm(scaled, axis=1, keepdims=True)
    scaled = np.divide(scaled, sizes, out=np.zeros_like(scaled), where=sizes > 0)
    _, values, right = np.linalg.svd(scaled)
    kept = right[: rank_of(values, 1.0)]
    works = driven * unit
    works = works - (works @ kept.T) @ kept
    left, values, right = np.linalg.svd(works)
    rank = rank_of(values, size)
    inverse = (right[:rank].T / values[:rank]) @ left[:, :rank].T
    _, every, right = np.linalg.svd(np.vstack([works / size, kept]))
    idle = right[rank_of(every, 1.0) :].T
    is_zero = np.linalg.norm(driven * unit, axis=0) <= RANK_TOLERANCE * size
    is_zero = is_zero & (np.linalg.norm(kept, axis=0) <= RANK_TOLERANCE)
    return Drive(works, left[:, :rank].T, left[:, rank:].T, idle, is_zero, unit, inverse)


class PathScrews(NamedTuple):
    """A path of joints with its screws (6, k), loops (m, k) and the centre (3,) of its member, length, at a point."""

    path: JointScrews
    screws: FloatArray
    loops: FloatArray
    centre: FloatArray


def expressions_of_paths(paths: Sequence[JointScrews]) -> list[SX]:
    """Return the expressions of paths, from the values of which :func:`paths_of` makes them at a point."""
    return [ca.densify(part) for each in paths for part in (each.all, each.loops, each.centre)]


def paths_of(paths: Sequence[JointScrews], values: Sequence[FloatArray]) -> list[PathScrews]:
    """Return paths at a point from the values of their expressions."""
    thirds = zip(paths, values[::3], values[1::3], values[2::3], strict=True)
    return [PathScrews(path, screws, loops, np.ravel(centre)) for path, screws, loops, centre in thirds]


def with_loops(model: Model, velocities: Velocities, paths: Sequence[PathScrews], length: float) -> Velocities:
    """Return velocity equations with the loops of nested members as they are at the point.

    With ``L_p`` the loops' columns of passive joints, and ``L_a`` of actuators, ``B`` is what ``L_p`` cannot close of
    ``L_a``. The expressions of a model have the rank of ``L_p`` at almost all points. Where it is smaller at the point,
    the loops demand more of the actuators, and a rate may be determined that others leave free. The expressions of the
    member's rows are 0 / 0 there: the rows follow from the motions that the loops allow at the point instead.

    Args:
        model: the robot.
        velocities: at the point.
        paths: members of nested loops.
        length: characteristic length.
    """
    names = [(each.limb, each.name) for each in model.actuators]
    nested = {each.limb for each, *_ in paths}
    if not paths:
        return velocities
    jacobian, driven, relations = (part.copy() for part in velocities)
    relations[:, [k for k, (limb, _) in enumerate(names) if limb in nested]] = 0.0
    found = [relations]
    for each, screws, loops, centre in paths:
        own = [names.index((each.limb, each.joints[k].removeprefix(f"{each.limb}:"))) for k in each.driven]
        rows = [k for k, row in enumerate(model.frame_rows) if row.member == each.member]
        passive = each.passive
        left, values, right = np.linalg.svd(loops[:, passive])
        rank = rank_of(values)
        if rank < each.loop_rank and rows:
            jacobian[rows] = _resisting_rows(screws[:, passive], right[rank:].T, centre, length)
        by_actuators = loops[:, each.driven]
        closing = right[:rank].T @ ((left[:, :rank].T @ by_actuators) / values[:rank, None])
        motions = screws[:, each.driven] - screws[:, passive] @ closing
        driven[np.ix_(rows, own)] = jacobian[rows] @ np.vstack([motions[3:], motions[:3]])
        demanded = np.zeros((len(left) - rank, len(names)))
        demanded[:, own] = left[:, rank:].T @ by_actuators
        least = np.zeros(len(names))
        least[own] = RANK_TOLERANCE * np.abs(by_actuators).max(axis=0, initial=0.0)
        found.append(np.where(np.abs(demanded) > least, demanded, 0.0))
    return Velocities(jacobian, driven, np.vstack(found))


def _resisting_rows(screws: FloatArray, rates: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return the rows (6, 6) of a member's projector: force, then moment about the world origin.

    Args:
        screws: (6, k) of its passive joints.
        rates: (k, n) orthonormal rates of these that its loops allow.
        centre: (3,) of the member, length.
        length: characteristic length.
    """
    velocities = screws[3:] + np.cross(screws[:3].T, centre).T
    reach = float(np.linalg.norm(velocities, axis=0).max(initial=0.0)) or 1.0
    scaled = np.vstack([velocities / reach, screws[:3]])
    left, values, _ = np.linalg.svd(scaled @ rates)
    allowed = left[:, : rank_of(values, 1.0)] * np.array([reach] * 3 + [length] * 3)[:, None]
    basis = np.linalg.qr(allowed)[0]
    unit, none = np.eye(3), np.zeros((3, 3))
    rows = np.block([[unit, np.cross(unit, centre).T], [none, length * unit]])
    return np.asarray(rows - basis @ (basis.T @ rows))


class LimbDrive(NamedTuple):
    """The actuators of a limb of a model: indices of its rows and of its actuators, and how these drive it."""

    rows: list[int]
    actuators: list[int]
    drive: Drive


def limb_drive(model: Model, velocities: Velocities, centre: FloatArray, limb: str) -> LimbDrive:
    """Return the actuators of a limb of a model.

    Args:
        model: the robot.
        velocities: at a point.
        centre: (3,) the platform's origin there, length.
        limb: name of the limb.
    """
    J = velocities.jacobian
    moments = J[:, 3:] - np.cross(np.ravel(centre), J[:, :3])
    reach = float(np.abs(moments[np.isfinite(moments)]).max(initial=0.0)) or 1.0
    rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
    own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
    unit = np.array([1.0 if model.actuators[k].dimension is Dimension.LENGTH else 1.0 / reach for k in own])
    size = float(np.abs(np.hstack([J[rows, :3], moments[rows] / reach])).max(initial=0.0)) or 1.0
    drive = drive_of(velocities.driven[np.ix_(rows, own)], velocities.relations[:, own], unit, size)
    return LimbDrive(rows, own, drive)


def rates_expression(driven: SX, relations: SX, resisted: SX) -> SX:
    """Return the rates (a, n) of a limb's actuators for work rates (m, n) of its rows, where they are determined.

    Args:
        driven: (m, a) ``D``.
        relations: (r, a) ``B`` of full rank.
        resisted: (m, n).
    """
    if not relations.shape[0]:
        return ca.inv_minor(driven.T @ driven) @ (driven.T @ resisted)
    r, a = relations.shape
    works = driven - driven @ (pseudo_inverse(relations, r) @ relations)
    return pseudo_inverse(works, a - r) @ resisted

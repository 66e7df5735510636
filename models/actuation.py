"""Velocity equations of the actuators, ``J chi = D qdot`` and ``B qdot = 0``, of a limb of any topology.

``D`` holds the work rate of each row of ``J`` for a unit rate of each actuator. Nested loops with more actuators than
degrees of freedom add equations ``B qdot = 0`` on the actuator rates alone. With ``Z`` a basis of the null space of
``B``, the constraint wrenches are the combinations ``n'J`` with ``n'D Z = 0``. The actuator rates are the least-squares
solution of the first equation subject to the second. The rates are undetermined if ``D qdot = 0`` and ``B qdot = 0``
have a common nonzero solution.
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

#: Relative rate below which an entry of the null-space basis is a rounding error.
_TAKES_PART = 1e-6


class Velocities(NamedTuple):
    """Matrices of a robot's velocity equations ``J chi = D qdot`` and ``B qdot = 0``.

    Attributes:
        jacobian: (m, 6) ``J``: the rows of a :class:`~.instance.RobotInstance`, force, then moment about the origin.
        driven: (m, a) ``D``: work rate of each row for a unit rate of each actuator.
        relations: (r, a) ``B``: coefficients of the equations that loops impose on the actuator rates alone.
    """

    jacobian: FloatArray
    driven: FloatArray
    relations: FloatArray


@dataclass(frozen=True, eq=False)
class Drive:
    """Actuation of a limb at a point, in scaled actuator rates (rates of angles times a length of the robot).

    Attributes:
        works: (m, a) ``D`` restricted to the rates that ``B`` allows; 0 for orthogonal rates.
        driving: (r, m) orthonormal combinations of rows in which the actuators do work.
        constraints: (k, m) orthonormal combinations of rows that do no work in the actuated joints.
        idle: (a, d) orthonormal actuator rates with which the platform does not move.
        is_zero: (a,) True for an actuator that can move while the platform and all other actuators stand still.
    """

    works: FloatArray
    driving: FloatArray
    constraints: FloatArray
    idle: FloatArray
    is_zero: Flags
    _unit: FloatArray
    _inverse: FloatArray

    def rates(self, resisted: FloatArray) -> FloatArray:
        """Return the actuator rates (a,) that best fit the work rates (m,) of the rows, by least squares.

        A rate is infinite for an actuator that cannot drive the platform, and NaN where it is undetermined.
        """
        rates = self._unit * (self._inverse @ resisted)
        rates[self.is_undetermined] = np.nan
        return np.where(self.is_zero, np.inf, rates)

    @property
    def is_undetermined(self) -> Flags:
        """True for each actuator (a,) whose rate is undetermined."""
        return np.asarray(np.linalg.norm(self.idle, axis=1) > _TAKES_PART)

    def driven_part(self, resisted: FloatArray) -> FloatArray:
        """Return the component (m,) of the rows' work rates that the actuators can produce."""
        return np.asarray(self.driving.T @ (self.driving @ resisted))


def drive_of(driven: FloatArray, relations: FloatArray, unit: FloatArray, size: float) -> Drive:
    """Return the actuation of a limb.

    Args:
        driven: (m, a) ``D``, work rates of the rows for unit actuator rates.
        relations: (r, a) ``B``; rows of zeros have no effect.
        unit: (a,) actuator rates that each move the platform with a velocity of about 1.
        size: magnitude of the rows, 1 for unit forces; the rank tolerance is relative to it.
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
    """Screws of a chain of joints at a point.

    Attributes:
        path: symbolic screws of the chain.
        screws: (6, k) screws of the chain's joints.
        loops: (m, k) matrix of the chain's loop equations.
        centre: (3,) centre of the chain's member, length.
    """

    path: JointScrews
    screws: FloatArray
    loops: FloatArray
    centre: FloatArray


def expressions_of_paths(paths: Sequence[JointScrews]) -> list[SX]:
    """Return the expressions of chains of joints, whose values are the argument of :func:`paths_of`."""
    return [ca.densify(part) for each in paths for part in (each.all, each.loops, each.centre)]


def paths_of(paths: Sequence[JointScrews], values: Sequence[FloatArray]) -> list[PathScrews]:
    """Return the screws of chains of joints at a point, from the values of :func:`expressions_of_paths`."""
    thirds = zip(paths, values[::3], values[1::3], values[2::3], strict=True)
    return [PathScrews(path, screws, loops, np.ravel(centre)) for path, screws, loops, centre in thirds]


def with_loops(model: Model, velocities: Velocities, paths: Sequence[PathScrews], length: float) -> Velocities:
    """Return velocity equations in which the equations of nested loops are evaluated at the point.

    Let ``L_p`` and ``L_a`` be the columns of passive and of actuated joints in the loop equations. ``B`` is the
    component of ``L_a`` outside the column space of ``L_p``. The expressions of a model assume the rank that ``L_p``
    has at almost all points. Where the rank is smaller, ``B`` has more rows, so further actuator rates may be
    determined. The expressions of the member's rows are 0 / 0 there, so these rows are computed from the motions that
    the loops allow at the point.

    Args:
        model: the robot.
        velocities: velocity equations at the point.
        paths: screws of the members with nested loops.
        length: characteristic length.
    """
    names = [(each.limb, each.name) for each in model.actuators]
    nested = {each.limb for each, *_ in paths}
    if not paths:
        return velocities
    jacobian, driven, relations = (part.copy() for part in velocities)
    relations[:, [k for k, (limb, _) in enumerate(names) if limb in nested]] = 0.0
    blocks = [relations]
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
        blocks.append(np.where(np.abs(demanded) > least, demanded, 0.0))
    return Velocities(jacobian, driven, np.vstack(blocks))


def _resisting_rows(screws: FloatArray, rates: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return the rows (6, 6) of a member's projector: force, then moment about the world origin.

    Args:
        screws: (6, k) screws of the passive joints of the member.
        rates: (k, n) orthonormal rates of these joints that the loops allow.
        centre: (3,) centre of the member, length.
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
    """Actuation of a limb of a model.

    Attributes:
        rows: indices of the rows of the limb.
        actuators: indices of the actuators of the limb.
        drive: actuation of the limb.
    """

    rows: list[int]
    actuators: list[int]
    drive: Drive


def limb_drive(model: Model, velocities: Velocities, centre: FloatArray, limb: str) -> LimbDrive:
    """Return the actuation of a limb of a model.

    Args:
        model: the robot.
        velocities: velocity equations at a point.
        centre: (3,) origin of the platform frame at that point, length.
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
    """Return the actuator rates (a, n) of a limb for work rates (m, n) of its rows, if these rates are determined.

    Args:
        driven: (m, a) ``D``, work rates of the rows for unit actuator rates.
        relations: (r, a) ``B``, of full rank.
        resisted: (m, n) work rates of the rows in n twists.
    """
    if not relations.shape[0]:
        return ca.inv_minor(driven.T @ driven) @ (driven.T @ resisted)
    r, a = relations.shape
    works = driven - driven @ (pseudo_inverse(relations, r) @ relations)
    return pseudo_inverse(works, a - r) @ resisted

"""A robot with fixed dimensions over a workspace: loop equations and matrices in the coordinates of a search.

The coordinates z are those numbers of a :class:`~.pose_box.PoseBox` that vary, then the robot's unknowns. Equations
that follow from others in this workspace are left out. Of the coordinates as many are *dependent* as there are
equations: all unknowns, and numbers of the pose that a robot with fewer freedoms has no choice of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, JointScrews, Member, Model, WrenchKind, frozen_array, jacobian
from .....models.member import scaled_twists
from .....models.rows import independent_rows
from ....case.case import Case
from .closed_loops import Loops, closed_from_home
from .motion_matrix import Limbs, RankMatrix, free_matrix, locked_matrix
from .pose_box import PoseBox
from .posed_model import PosedModel, polynomial_rows, posed_model

#: Points of the workspace at which the equations that are needed are found, beside its middle, and the part of the
#: workspace, about its middle, in which they lie.
_POINTS, _SPREAD = 4, 0.5
#: Singular values below this part of the largest are zero at the middle of the workspace.
_ZERO = 1e-9
#: Residual up to which a loop is closed; equations are of order 1.
CLOSED = 1e-9
_SEED = 0


class NotJudgedError(ValueError):
    """Error of a robot whose loops or limbs are singular where a search begins; the message is a clause."""


class ScaledRows(NamedTuple):
    """J as rows divided by their sizes, moments about the platform's origin in parts of a length.

    The row of a leg times its length is a polynomial of the pose, and so nearer to a linear function than the unit row.

    Attributes:
        rows: (m, 6) rows of any size.
        sizes: (m, 1) positive.
    """

    rows: SX
    sizes: SX

    @property
    def jacobian(self) -> SX:
        """J, (m, 6)."""
        return self.rows / ca.repmat(self.sizes, 1, 6)


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot over a workspace.

    Attributes:
        box: the poses.
        z: (n,) symbols of the coordinates.
        free: indices of the pose's numbers, among the six of the box, that are the first coordinates.
        size: (n,) by which coordinates are comparable: of the order of their ranges.
        equations: (k, 1) that hold where the loops are closed.
        independent, dependent: indices of the coordinates, ``n - k`` and k.
        start: (n,) closed loops at the middle of the workspace, or near it.
        locked: rows and members with the actuators locked.
        unactuated: the same with free actuators; None for a robot without constraints.
        scaled: J, moments divided by ``length``.
        length: of the order of the robot's, length.
        needed: indices of the equations among those of the model.
        columns: indices of the screws of each member that are kept.
        rows: indices of the equations of each member's nested loops that are kept.
    """

    box: PoseBox
    z: SX
    free: tuple[int, ...]
    size: FloatArray
    equations: SX
    independent: tuple[int, ...]
    dependent: tuple[int, ...]
    start: FloatArray
    locked: RankMatrix
    unactuated: RankMatrix | None
    scaled: ScaledRows
    length: float
    needed: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]
    rows: tuple[tuple[int, ...], ...]

    def pose_of(self, z: FloatArray) -> FloatArray:
        """Return the six coordinates of the pose (..., 6) at points (..., n)."""
        y = np.broadcast_to(0.5 * self.box.lower + 0.5 * self.box.upper, (*z.shape[:-1], 6)).copy()
        y[..., list(self.free)] = z[..., : len(self.free)]
        return y


def build_problem(case: Case, model: Model, box: PoseBox) -> Problem:
    """Return a robot over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions.
        box: the poses.

    Raises:
        NotJudgedError: no closed loops are found in the middle of the workspace, or they leave a joint free.
    """
    posed = posed_model(case, model, box)
    count = len(posed.free)
    loops = Loops(posed.z, posed.closure, posed.every, posed.signs, posed.size)
    middle = np.concatenate([(0.5 * (box.lower + box.upper))[list(posed.free)], np.zeros(posed.z.numel() - count)])
    start = closed_from_home(loops, middle, count)
    if start is None:
        raise NotJudgedError("the loops are not found closed, in the assembly of home, in the middle of the workspace")
    needed = _needed(loops, start, count, posed)
    equations = posed.closure[needed] if needed else SX(0, 1)
    counted = Loops(posed.z, equations, posed.every, posed.signs, posed.size)
    dependent = _dependent(counted, start, count)
    independent = tuple(k for k in range(posed.z.numel()) if k not in dependent)
    # Where numbers of the pose follow from others, the closed loops that were found may be beside a narrow box.
    middle[list(dependent)] = start[list(dependent)]
    moved = counted.all_closed(middle[:, None], list(dependent))[:, 0]
    start = moved if counted.is_closed(moved) else start
    length = _length(posed, start, case, model)
    columns = tuple(_independent_screws(each, posed, start, length) for each in posed.limbs.members)
    nested = zip(posed.limbs.loops, model.nested, strict=True)
    rows = tuple(_independent_loops(each, path, posed.z, start) for each, path in nested)
    limbs = posed.limbs.reduced(columns, rows, length)
    return Problem(
        box=box,
        z=posed.z,
        free=posed.free,
        size=posed.size,
        equations=equations,
        independent=independent,
        dependent=dependent,
        start=frozen_array(start, start.shape),
        locked=locked_rows(posed, columns, rows, length),
        unactuated=_unactuated(model, limbs, posed.z, start),
        scaled=scaled_rows(posed, length, case.characteristic_length),
        length=length,
        needed=tuple(needed),
        columns=columns,
        rows=rows,
    )


def _needed(loops: Loops, start: FloatArray, count: int, posed: PosedModel) -> list[int]:
    """Return the indices of the equations that do not follow from others in the workspace."""
    if not loops.count:
        return []
    rng = np.random.default_rng(_SEED)
    slopes = [loops.slopes(start[:, None])[0] * posed.size]
    for _ in range(_POINTS):
        z = start.copy()
        z[:count] += _SPREAD * posed.size[:count] * rng.uniform(-1, 1, count)
        found = loops.closed(z, list(range(count, len(z)))) if len(z) > count else z
        if found is None or not loops.is_closed(found):
            found = loops.closed(z, list(range(len(z))))
        if found is not None and loops.is_closed(found):
            slopes.append(loops.slopes(found[:, None])[0] * posed.size)
    if not any(np.abs(each).max() > _ZERO for each in slopes):
        return []
    return sorted(independent_rows(slopes))


def _dependent(loops: Loops, start: FloatArray, count: int) -> tuple[int, ...]:
    """Return the coordinates that the equations determine: all unknowns, then numbers of the pose.

    Raises:
        NotJudgedError: the equations leave an unknown free.
    """
    n, k = len(start), loops.count
    unknowns = list(range(count, n))
    if k < len(unknowns):
        raise NotJudgedError("the loops leave a passive joint free")
    if not k:
        return ()
    slopes = loops.slopes(start[:, None])[0] * loops.size
    own = np.linalg.svd(slopes[:, unknowns], compute_uv=True) if unknowns else None
    left = slopes[:, :count]
    if own is not None:
        basis, values, _ = own
        if not values[-1] > _ZERO * values[0]:
            raise NotJudgedError("the loops leave a passive joint free in the middle of the workspace")
        left = basis[:, len(unknowns) :].T @ left
    order = sorted(independent_rows([left.T])) if k > len(unknowns) else []
    if len(order) != k - len(unknowns):
        raise NotJudgedError("the loops are singular in the middle of the workspace")
    return (*order, *unknowns)


def _length(posed: PosedModel, start: FloatArray, case: Case, model: Model) -> float:
    """Return a length of the order of the robot's: the median arm of its rows and screws about the platform."""
    p, pairs = posed.limbs.position, []
    pairs += [(ca.norm_2(r.moment - ca.cross(p, r.force)), ca.norm_2(r.force)) for r in posed.limbs.wrenches]
    for member in posed.limbs.members:
        for j in range(member.screws.shape[1]):
            omega, v = member.screws[:3, j], member.screws[3:, j]
            pairs.append((ca.norm_2(v + ca.cross(omega, p)), ca.norm_2(omega)))
    function = ca.Function("arms", [posed.z], [ca.densify(ca.horzcat(*[ca.vertcat(*each) for each in pairs]))])
    values = function(start).full()
    arms = [a / b for a, b in values.T if a > _ZERO and b > _ZERO]
    home = float(np.linalg.norm(model.home))
    return float(np.median(arms)) if arms else home or case.characteristic_length


def _independent_screws(member: Member, posed: PosedModel, start: FloatArray, length: float) -> tuple[int, ...]:
    """Return the indices of as many screws of a member as have its rank: they span the others if independent.

    Raises:
        NotJudgedError: its screws have another rank in the middle of the workspace.
    """
    if member.rank == member.screws.shape[1]:
        return tuple(range(member.rank))
    columns = scaled_twists(member.screws, member.centre, SX(length), member.size)
    values = ca.Function("screws", [posed.z], [ca.densify(columns)])(start).full()
    # Screws that loops hold still are rounding alone.
    chosen = independent_rows([values.T]) if member.rank else ()
    if len(chosen) != member.rank:
        raise NotJudgedError(f"the passive joints of limb {member.label} are singular in the middle of the workspace")
    return tuple(sorted(chosen))


def _independent_loops(loops: SX, path: JointScrews, z: SX, start: FloatArray) -> tuple[int, ...]:
    """Return the indices of as many equations of a member's nested loops as have their rank.

    Raises:
        NotJudgedError: they have another rank in the middle of the workspace.
    """
    chosen = independent_rows([ca.Function("loops", [z], [ca.densify(loops)])(start).full()]) if path.loop_rank else ()
    if len(chosen) != path.loop_rank:
        raise NotJudgedError(f"the nested loops of limb {path.member} are singular in the middle of the workspace")
    return tuple(sorted(chosen))


def locked_rows(
    posed: PosedModel, columns: Sequence[Sequence[int]], rows: Sequence[Sequence[int]], length: float
) -> RankMatrix:
    """Return the matrix with locked actuators, rows that are linear in the rotation without a division.

    Args:
        posed: the robot.
        columns: indices of the screws of each member that are kept.
        rows: indices of the equations of the nested loops of each that are kept.
        length: by which rotations are multiplied.
    """
    plain, turned = (locked_matrix(each.reduced(columns, rows, length)) for each in (posed.limbs, posed.turned))
    return RankMatrix(polynomial_rows(plain, turned, posed), 0)


def scaled_rows(posed: PosedModel, length: float, characteristic_length: float) -> ScaledRows:
    """Return J as rows that are linear in the rotation without a division, and their sizes.

    Args:
        posed: the robot.
        length: by which moments are divided.
        characteristic_length: by which couples are multiplied in J.
    """

    def wrenches(limbs: Limbs) -> SX:
        """Return the rows of forces and couples, and 1 in a last column: the factor that makes them polynomials."""
        rows = [
            ca.horzcat(row.force.T, (row.moment - ca.cross(limbs.position, row.force)).T / length, 1)
            for row in limbs.wrenches
        ]
        return ca.vertcat(SX(0, 7), *rows)

    limbs, L = posed.limbs, SX(characteristic_length)
    rows = ca.densify(polynomial_rows(wrenches(limbs), wrenches(posed.turned), posed))
    sizes = [
        rows[i, 6] * ca.sqrt(row.square) / (L if row.kind is WrenchKind.COUPLE else 1)
        for i, row in enumerate(limbs.wrenches)
    ]
    of_members = jacobian([], L, limbs.members)
    moments = [
        ca.horzcat(row[:3], (row[3:] - ca.cross(limbs.position, row[:3].T).T) / length)
        for row in (of_members[i, :] for i in range(of_members.shape[0]))
    ]
    ones = SX.ones(of_members.shape[0])
    return ScaledRows(ca.vertcat(rows[:, :6], *moments), ca.vertcat(SX(0, 1), *sizes, ones))


def _unactuated(model: Model, limbs: Limbs, z: SX, start: FloatArray) -> RankMatrix | None:
    """Return rows and members with free actuators; None for a robot without constraints."""
    if model.generic is not None and model.generic.constraints == 0:
        return None
    if not limbs.actuators and model.members:
        return None
    matrix = free_matrix(limbs)
    if not matrix.numel():
        return None
    values = np.linalg.svd(ca.Function("free", [z], [ca.densify(matrix)])(start).full(), compute_uv=False)
    rank = int(np.count_nonzero(values > _ZERO * values[0]))
    freedoms, idle = matrix.shape[1] - rank, 0
    if model.generic is not None:
        freedoms, idle = 6 - model.generic.constraints, model.generic.idle
    return RankMatrix(matrix, freedoms + idle) if 0 < freedoms < 6 else None

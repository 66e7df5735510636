"""Rows of the Jacobian in results: each member has an orthonormal basis of its wrenches instead of a projector.

The scaled coordinates of a wrench about a member's centre are its force, and its moment about the centre divided by the
characteristic length. The basis begins with the constraint wrenches: pure couples, then forces through the centre, then
the rest. The actuation wrenches follow. The basis of each space depends only on the space, so that results depend
neither on rounding nor on the unit of length.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .actuation import Flags, Velocities, limb_drive
from .arrays import FloatArray, first_largest
from .instance import homogenised
from .model import Model
from .rows import rank_of
from .wrench import WrenchKind

#: Value below which components of unit wrenches are zero; rounding errors of a nearly singular limb are about 1e-12.
_ZERO = 1e-9


class Basis(NamedTuple):
    """Orthonormal basis (d, size) of a member's wrenches in scaled coordinates, with the kind of each wrench."""

    rows: FloatArray
    kinds: tuple[WrenchKind, ...]


def basis_of_member(projector: FloatArray, actuation: FloatArray, dimension: int) -> Basis:
    """Return a basis of a member's wrenches.

    Args:
        projector: (size, size) projector on the wrenches, or (size, k) matrix with the same column space.
        actuation: (size, a) components of the actuated joints' screws that the member resists, in scaled coordinates.
        dimension: dimension of the space of wrenches.
    """
    space = np.linalg.svd(projector)[0][:, :dimension].T
    driven = _span(actuation.T @ space.T @ space) if actuation.size else np.zeros((0, space.shape[1]))
    works = driven @ actuation
    if works.size:
        # The sign of an actuation wrench is such that it does positive work in the joint that drives it most.
        most = np.take_along_axis(works, first_largest(np.abs(works))[:, None], axis=1)
        driven = driven * np.where(most < 0, -1.0, 1.0)
    constraints = space - (space @ driven.T) @ driven
    constraints = np.linalg.svd(constraints)[2][: dimension - len(driven)]
    couples, rest = _split(constraints, slice(0, 3))
    forces, others = _split(rest, slice(3, None)) if space.shape[1] > 3 else (rest, rest[:0])
    if space.shape[1] == 3:
        couples, forces = constraints[:0], constraints
    rows = np.vstack([*(settled_basis(each) for each in (couples, forces, others)), driven])
    return Basis(rows, tuple(_kind(row) for row in rows))


def reporting_matrix(model: Model, velocities: Velocities, centre: FloatArray) -> FloatArray:
    """Return the matrix (r, m) that converts the rows of a :class:`~.instance.RobotInstance` to the rows of results.

    The rows of single wrenches stay unchanged; the rows of a member's projector become a basis.

    Args:
        model: the robot.
        velocities: velocity equations at a point.
        centre: (3,) origin of the platform frame at that point, length.
    """
    count = len(model.wrenches)
    matrix = np.zeros((len(model.rows), len(velocities.jacobian)))
    matrix[:count, :count] = np.eye(count)
    row, column = count, count
    drives = {limb: limb_drive(model, velocities, centre, limb) for limb in {each.limb for each in model.members}}
    for member in model.members:
        limb, own = drives[member.limb], slice(column, column + member.size)
        works = limb.drive.works[[limb.rows.index(k) for k in range(own.start, own.stop)]]
        basis = basis_of_member(velocities.jacobian[own], works, len(member.kinds)).rows
        matrix[row : row + len(basis), own] = basis
        row, column = row + len(basis), own.stop
    return matrix


def constraint_rows(model: Model, velocities: Velocities, centre: FloatArray) -> FloatArray:
    """Return the constraint wrenches (k, 6) of all limbs, which do no work in actuated joints.

    The arguments are those of :func:`reporting_matrix`.
    """
    found = [np.zeros((0, 6))]
    for limb in model.limbs:
        rows, _, drive = limb_drive(model, velocities, centre, limb)
        found.append(drive.constraints @ velocities.jacobian[rows])
    return np.vstack(found)


def rank_of_rows(rows: FloatArray, centre: FloatArray, length: float) -> int:
    """Return the rank of wrenches (m, 6), with moments about a centre (3,) divided by a length."""
    if not len(rows):
        return 0
    values = np.linalg.svd(np.array(homogenised(rows, centre, length)), compute_uv=False)
    return rank_of(values, max(1.0, float(values[0])))


def is_apart(rows: FloatArray, of_limb: Flags, centre: FloatArray, length: float) -> bool:
    """Return True if a limb's wrenches are independent of those of all other limbs, so that statics determines them.

    Args:
        rows: (m, 6) wrenches of all limbs.
        of_limb: (m,) True for each wrench of the limb.
        centre: (3,) reference point of moments, length.
        length: divisor of the moments.
    """
    parts = [rank_of_rows(rows[each], centre, length) for each in (of_limb, ~of_limb)]
    return sum(parts) == rank_of_rows(rows, centre, length)


def _split(rows: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal bases of the row combinations with zero components in ``part``, and of their complement."""
    if not len(rows):
        return rows, rows
    left, values, _ = np.linalg.svd(rows[:, part])
    nonzero = int(np.count_nonzero(values > _ZERO))
    turned = left.T @ rows
    return turned[nonzero:], turned[:nonzero]


def _span(rows: FloatArray) -> FloatArray:
    _, values, right = np.linalg.svd(rows)
    return settled_basis(right[: int(np.count_nonzero(values > _ZERO * max(1.0, float(values.max(initial=0.0)))))])


def settled_basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis (k, n) of the span of orthonormal rows (k, n) that depends on the span only.

    Each vector is the projection of the coordinate axis nearest to the remaining space; ties take the first axis.
    """
    projector, found = rows.T @ rows, np.zeros(rows.shape)
    for vector in found:
        k = int(first_largest(np.diag(projector)[None])[0])
        vector[:] = projector[k] / np.linalg.norm(projector[k])
        projector = projector - np.outer(vector, vector)
    return found


def _kind(row: FloatArray) -> WrenchKind:
    if len(row) == 3 or not np.abs(row[3:]).max() > _ZERO:
        return WrenchKind.FORCE
    return WrenchKind.WRENCH if np.abs(row[:3]).max() > _ZERO else WrenchKind.COUPLE

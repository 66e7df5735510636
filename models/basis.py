"""Rows of the Jacobian as results state them: an orthonormal basis of each member's wrenches, not its projector.

Scaled coordinates of a wrench about a member's centre are its force, then its moment about the centre in parts of the
characteristic length. The basis has the wrenches that do no work in the member's actuated joints first: pure couples,
then forces through the centre, then the others. Behind them are those by which the actuators drive the platform. Each
of these spaces has a basis that follows from the space alone: another one would follow from rounding, and differ from
one unit of length to another.
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

#: Components of unit wrenches below this are zero: rounding leaves about 1e-12 of a limb that is nearly singular.
_ZERO = 1e-9


class Basis(NamedTuple):
    """An orthonormal basis (d, size) of a member's wrenches in scaled coordinates, and the kind of each."""

    rows: FloatArray
    kinds: tuple[WrenchKind, ...]


def basis_of_member(projector: FloatArray, actuation: FloatArray, dimension: int) -> Basis:
    """Return a basis of a member's wrenches.

    Args:
        projector: (size, size) or, with columns in other coordinates, (size, k) of the same column space.
        actuation: (size, a) parts of the actuated joints' screws that the member resists, in scaled coordinates.
        dimension: of the space.
    """
    space = np.linalg.svd(projector)[0][:, :dimension].T
    driven = _span(actuation.T @ space.T @ space) if actuation.size else np.zeros((0, space.shape[1]))
    works = driven @ actuation
    if works.size:
        # A wrench of actuation does positive work in the joint that it drives most.
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
    """Return the matrix (r, m) that turns the rows of a :class:`~.instance.RobotInstance` into those of results.

    The rows of the robot's wrenches stay as they are; those of a member's projector become a basis.

    Args:
        model: the robot.
        velocities: at a point.
        centre: (3,) the platform's origin there, length.
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
    """Return wrenches (k, 6) of all limbs that do no work in their actuated joints: constraints on a free robot.

    The arguments are those of :func:`reporting_matrix`.
    """
    found = [np.zeros((0, 6))]
    for limb in model.limbs:
        rows, _, drive = limb_drive(model, velocities, centre, limb)
        found.append(drive.constraints @ velocities.jacobian[rows])
    return np.vstack(found)


def rank_of_rows(rows: FloatArray, centre: FloatArray, length: float) -> int:
    """Return the rank of wrenches (m, 6) with moments about a centre (3,) in parts of a length."""
    if not len(rows):
        return 0
    values = np.linalg.svd(np.array(homogenised(rows, centre, length)), compute_uv=False)
    return rank_of(values, max(1.0, float(values[0])))


def is_apart(rows: FloatArray, own: Flags, centre: FloatArray, length: float) -> bool:
    """Return whether the wrenches of a limb are independent of all others, so that statics determines them.

    Args:
        rows: (m, 6) wrenches of all limbs.
        own: (m,) whether each is of the limb.
        centre: (3,) of moments, which count in parts of the length.
        length: the length.
    """
    parts = [rank_of_rows(rows[each], centre, length) for each in (own, ~own)]
    return sum(parts) == rank_of_rows(rows, centre, length)


def _split(rows: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal bases of the combinations of rows in which some components are zero, and of the rest."""
    if not len(rows):
        return rows, rows
    left, values, _ = np.linalg.svd(rows[:, part])
    nonzero = int(np.count_nonzero(values > _ZERO))
    turned = left.T @ rows
    return turned[nonzero:], turned[:nonzero]


def _span(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the span of rows."""
    _, values, right = np.linalg.svd(rows)
    return settled_basis(right[: int(np.count_nonzero(values > _ZERO * max(1.0, float(values.max(initial=0.0)))))])


def settled_basis(rows: FloatArray) -> FloatArray:
    """Return the orthonormal basis (k, n) that follows from the space of orthonormal rows (k, n) alone.

    Each vector is the coordinate axis nearest to the rest of the space, projected into it: the first of equally near
    ones.
    """
    projector, found = rows.T @ rows, np.zeros(rows.shape)
    for vector in found:
        k = int(first_largest(np.diag(projector)[None])[0])
        vector[:] = projector[k] / np.linalg.norm(projector[k])
        projector = projector - np.outer(vector, vector)
    return found


def _kind(row: FloatArray) -> WrenchKind:
    """Return the kind of a wrench in scaled coordinates."""
    if len(row) == 3 or not np.abs(row[3:]).max() > _ZERO:
        return WrenchKind.FORCE
    return WrenchKind.WRENCH if np.abs(row[:3]).max() > _ZERO else WrenchKind.COUPLE

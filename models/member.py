"""Wrench space of a limb member with locked actuators, and the projector onto it.

With all actuators locked, a member allows platform motions in the span of its passive joint screws. It resists all
other motions with the wrenches reciprocal to these screws. In *scaled coordinates* about the member's centre ``c``,
with a length ``l``, a twist is ``x = (v + w x c, l w)`` and a wrench ``y = (f, (m - c x f)/l)``; their work rate is
``y . x``. With ``P`` the orthogonal projector on the complement of the passive screws, ``|P x|^2`` is the sum of
squared work rates of any orthonormal basis of the wrenches, so that no basis is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .rows import ColumnGroup
from .values import dataclass
from .wrench import WrenchKind


@dataclass(frozen=True, eq=False)
class Member:
    """Part of a limb that resists the platform with all wrenches reciprocal to its passive screws.

    Attributes:
        limb: name of the limb.
        centre: (3, 1) centre of the member in the world frame, length; reference point of scaled coordinates.
        screws: (6, n) current screws of the passive joints as twists about the world origin; without the spherical
            joint at the centre of a pinned member.
        rank: rank of the screws, for almost all dimensions and poses; for a pinned member, of their velocities of the
            centre.
        kinds: kind of each wrench of a basis, for almost all dimensions and poses: ``6 - rank`` wrenches, or ``3 -
            rank`` of a pinned member.
        is_pinned: True if a spherical joint at the centre transmits only forces through the centre.
        slide: (3, 1) current unit axis of the last passive joint, if the centre is an arbitrary point of this axis;
            None for a centre that the joints or the user determine.
        name: name of the member if the limb has several; empty for the name of the limb.
        groups: groups of dependent screws, processed one after the other; empty to process all at once.
    """

    limb: str
    centre: SX
    screws: SX
    rank: int
    kinds: tuple[WrenchKind, ...]
    is_pinned: bool = False
    slide: SX | None = None
    name: str = ""
    groups: tuple[ColumnGroup, ...] = ()

    @property
    def label(self) -> str:
        """Name of the member; name of the limb if it has no other member."""
        return self.name or self.limb

    @property
    def size(self) -> int:
        """Number of scaled coordinates: 3 for a pinned member (forces through its centre), else 6."""
        return 3 if self.is_pinned else 6

    @property
    def kind(self) -> WrenchKind:
        """Kind of the rows of the member's projector."""
        return WrenchKind.FORCE if self.is_pinned else WrenchKind.WRENCH


class _Powers(NamedTuple):
    """Faddeev-LeVerrier recursion after a number of steps equal to the rank.

    Attributes:
        last, before: (m, m) matrices of the last step and of the preceding step.
        coefficient: (1, 1) the last coefficient.
        scale: (1, 1) divisor of ``A A'``.
    """

    last: SX
    before: SX
    coefficient: SX
    scale: SX


def _powers(matrix: SX, rank: int) -> _Powers:
    """Return the Faddeev-LeVerrier recursion for ``A A'`` of a matrix (m, n) of given rank."""
    gram = matrix @ matrix.T
    scale = ca.trace(gram)  # the trace keeps the coefficients of order 1
    gram = gram / scale
    size = gram.shape[0]
    last, before, coefficient = SX.eye(size), SX.eye(size), SX(1)
    for k in range(1, rank + 1):
        before, product = last, gram @ last
        coefficient = -ca.trace(product) / k
        last = product + coefficient * SX.eye(size)
    return _Powers(last, before, coefficient, scale)


def pseudo_inverse(matrix: SX, rank: int) -> SX:
    """Return the pseudo-inverse (n, m) of a matrix (m, n) whose rank does not change.

    Decell's formula ``A^+ = -A' N_(r-1)/c_r`` with the Faddeev-LeVerrier recursion for ``A A'`` (H. P. Decell, "An
    application of the Cayley-Hamilton theorem to generalized matrix inversion", SIAM Review 7 (1965) 526). One step ``X
    (2 I - A X)`` of Newton's method squares the relative error; a single row needs none.
    """
    if rank == 0:
        return SX(matrix.shape[1], matrix.shape[0])
    powers = _powers(matrix, rank)
    found = -matrix.T @ powers.before / (powers.coefficient * powers.scale)
    return found if matrix.shape[0] == 1 else 2 * found - found @ (matrix @ found)


def scaled_twists(twists: SX, centre: SX, length: SX, size: int) -> SX:
    """Return twists in scaled coordinates about a centre, (size, n).

    Args:
        twists: (6, n) angular velocity, then velocity at the world origin.
        centre: (3, 1) reference point, length.
        length: (1, 1) characteristic length.
        size: 6, or 3 for only the velocity of the centre.
    """
    columns = []
    for k in range(twists.shape[1]):
        omega, v = twists[:3, k], twists[3:, k]
        velocity = v + ca.cross(omega, centre)
        columns.append(velocity if size == 3 else ca.vertcat(velocity, length * omega))
    return ca.horzcat(SX(size, 0), *columns)


def resisted_parts(columns: SX, rank: int, vectors: SX, groups: Sequence[ColumnGroup] = ()) -> SX:
    """Return the components (size, k) of vectors (size, k) orthogonal to the span of columns (size, n).

    Independent columns are orthogonalised one by one without square roots, and their components subtracted from the
    vectors: a difference of squares would lose small results. Dependent columns use the projector ``P = N_r / c_r`` of
    the Faddeev-LeVerrier recursion for ``M = sum a a'``, which selects no columns: ``N_0 = I``, ``c_k = -tr(M
    N_(k-1))/k``, ``N_k = M N_(k-1) + c_k I``. It is exact for constant rank, but its relative error is up to that of
    rounding over ``c_r``, the product of the squared relative singular values. Groups with ranks that add up are
    therefore orthogonalised one after the other.

    Args:
        columns: (size, n) spanning vectors.
        rank: rank of the columns.
        vectors: (size, k) vectors.
        groups: groups of columns with ranks that add up to the total rank; if empty, independent columns are processed
            one by one, dependent columns all at once.
    """
    n, k = columns.shape[1], vectors.shape[1]
    if not groups:
        groups = [ColumnGroup((j,), 1) for j in range(n)] if rank == n else [ColumnGroup(tuple(range(n)), rank)]
    parts = ca.horzcat(vectors, columns)
    for group in groups:
        own = parts[:, [k + j for j in group.columns]]
        if not group.rank:
            # The columns vanish, except where their loops lose rank; there the components have no value.
            parts -= own @ (own.T @ parts)
        elif len(group.columns) == 1:
            square = ca.sumsqr(own)
            parts = ca.horzcat(*[each - own * (ca.dot(own, each) / square) for each in ca.horzsplit(parts)])
        else:
            powers = _powers(own, group.rank)
            parts = powers.last @ parts / powers.coefficient
    return parts[:, :k]


def resistance(member: Member, twists: SX, length: SX) -> SX:
    """Return the components ``P x``, (size, n), of twists (6, n) that a member resists."""
    if member.is_pinned:
        velocities = (scaled_twists(each, member.centre, length, member.size) for each in (member.screws, twists))
        return resisted_parts(next(velocities), member.rank, next(velocities), member.groups)
    # Divided by the length, rotation axes have the same components in every unit of length. The magnitude of a
    # translation has no effect on the span.
    columns = [
        ca.vertcat(column[:3] if column[3:].is_zero() else column[:3] / length, column[3:])
        for column in ca.horzsplit(scaled_twists(member.screws, member.centre, SX(1), member.size))
    ]
    vectors = scaled_twists(twists, member.centre, SX(1), member.size)
    parts = ca.vertcat(vectors[:3, :] / length, vectors[3:, :])
    return length * resisted_parts(ca.horzcat(SX(6, 0), *columns), member.rank, parts, member.groups)

"""Members: parts of a limb that resist the platform with a whole space of wrenches, and the projector on that space.

With all actuators locked, a member lets the platform move in the span of the screws of its passive joints, and resists
every other motion with the wrenches reciprocal to these screws. In *scaled coordinates* about the member's centre
``c``, with a length ``l``, a twist is ``x = (v + w x c, l w)`` and a wrench ``y = (f, (m - c x f)/l)``, so that their
work rate is the plain product ``y . x``. A member resists a twist with ``r = P x``, where ``P`` projects orthogonally
on the complement of the passive screws: ``|r|^2`` is the sum of the squared work rates of any orthonormal basis of the
member's wrenches, and no basis is needed.
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
    """A part of a limb that resists the platform with the wrenches reciprocal to passive screws.

    Attributes:
        limb: name of the limb.
        centre: (3, 1) its centre in the world frame, length: rotations about it cost only as ``l`` times their rate.
        screws: (6, n) current screws of its passive joints as twists, the world's origin as reference; those of the
            spherical joint at the centre are left out of a pinned member.
        rank: of the screws, for almost all dimensions and poses. In a pinned member, of their velocities of the centre.
        kinds: kind of each wrench of a basis, for almost all dimensions and poses: ``6 - rank`` of them, or
            ``3 - rank`` of a pinned member.
        is_pinned: whether a spherical joint at the centre leaves forces through the centre only.
        slide: (3, 1) current unit axis along which the centre could as well lie elsewhere, because it is any point of
            the last passive joint's; None for a centre that the joints or the user determine.
        name: its name where the limb has several members; empty for the limb's.
        groups: of dependent screws, one after the other; without any they are taken all at once.
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
        """Its name; that of the limb where the limb has no other member."""
        return self.name or self.limb

    @property
    def size(self) -> int:
        """Number of scaled coordinates: 3 for a pinned member, whose wrenches are forces through its centre, else 6."""
        return 3 if self.is_pinned else 6

    @property
    def kind(self) -> WrenchKind:
        """Kind of the rows of its projector."""
        return WrenchKind.FORCE if self.is_pinned else WrenchKind.WRENCH


class _Powers(NamedTuple):
    """The recursion of Faddeev and LeVerrier after as many steps as a matrix has ranks.

    Attributes:
        last, before: (m, m) its matrices after the last step, and before it.
        coefficient: (1, 1) the last coefficient.
        scale: (1, 1) of ``A A'``, which is divided by it.
    """

    last: SX
    before: SX
    coefficient: SX
    scale: SX


def _powers(matrix: SX, rank: int) -> _Powers:
    """Return the recursion for ``A A'`` of a matrix (m, n) of a rank."""
    gram = matrix @ matrix.T
    scale = ca.trace(gram)  # a multiple of the identity's size keeps the coefficients of order 1
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

    It is Decell's formula ``A^+ = -A' N_(r-1)/c_r`` with the recursion of Faddeev and LeVerrier for ``A A'`` (H. P.
    Decell, "An application of the Cayley-Hamilton theorem to generalized matrix inversion", SIAM Review 7 (1965) 526).
    One step ``X (2 I - A X)`` of Newton's method squares its relative error, which one row does not have.
    """
    if rank == 0:
        return SX(matrix.shape[1], matrix.shape[0])
    powers = _powers(matrix, rank)
    found = -matrix.T @ powers.before / (powers.coefficient * powers.scale)
    return found if matrix.shape[0] == 1 else 2 * found - found @ (matrix @ found)


def scaled_twists(twists: SX, centre: SX, length: SX, size: int) -> SX:
    """Return twists in scaled coordinates about a centre, (size, n).

    Args:
        twists: (6, n) angular velocity, then velocity at the world's origin.
        centre: (3, 1) length.
        length: (1, 1) characteristic length.
        size: 6, or 3 for the velocity of the centre alone.
    """
    columns = []
    for k in range(twists.shape[1]):
        omega, v = twists[:3, k], twists[3:, k]
        velocity = v + ca.cross(omega, centre)
        columns.append(velocity if size == 3 else ca.vertcat(velocity, length * omega))
    return ca.horzcat(SX(size, 0), *columns)


def resisted_parts(columns: SX, rank: int, vectors: SX, groups: Sequence[ColumnGroup] = ()) -> SX:
    """Return the parts (size, k) of vectors (size, k) that are orthogonal to the span of columns (size, n).

    Independent columns are made orthogonal one after the other without square roots, and their parts subtracted from
    the vectors themselves: the difference of two squares would lose a small result. Dependent columns have the
    projector ``P = N_r / c_r`` of Faddeev and LeVerrier's recursion for ``M = sum a a'``, which chooses no columns:
    ``N_0 = I``, ``c_k = -tr(M N_(k-1))/k``, ``N_k = M N_(k-1) + c_k I``. It is exact for every rank that does not
    change, but its relative error is up to that of rounding over ``c_r``, the product of the squared singular values in
    parts of the largest one. So groups whose ranks add up are made orthogonal one after the other too.

    Args:
        columns: (size, n) spanning vectors.
        rank: of the columns.
        vectors: (size, k).
        groups: of the columns, with ranks that add up to that of all; if left out, independent columns are taken one by
            one, and dependent ones all at once.
    """
    n, k = columns.shape[1], vectors.shape[1]
    if not groups:
        groups = [ColumnGroup((j,), 1) for j in range(n)] if rank == n else [ColumnGroup(tuple(range(n)), rank)]
    parts = ca.horzcat(vectors, columns)
    for group in groups:
        own = parts[:, [k + j for j in group.columns]]
        if not group.rank:
            # The columns are 0, but where loops from which they follow lose their rank: there the parts have no value.
            parts -= own @ (own.T @ parts)
        elif len(group.columns) == 1:
            square = ca.sumsqr(own)
            parts = ca.horzcat(*[each - own * (ca.dot(own, each) / square) for each in ca.horzsplit(parts)])
        else:
            powers = _powers(own, group.rank)
            parts = powers.last @ parts / powers.coefficient
    return parts[:, :k]


def resistance(member: Member, twists: SX, length: SX) -> SX:
    """Return ``P x``, (size, n), of a member for twists (6, n)."""
    if member.is_pinned:
        velocities = (scaled_twists(each, member.centre, length, member.size) for each in (member.screws, twists))
        return resisted_parts(next(velocities), member.rank, next(velocities), member.groups)
    # In parts of the length, axes of rotations have the same components in every unit of length, and cancel alike. The
    # size of a translation means nothing for the span.
    columns = [
        ca.vertcat(column[:3] if column[3:].is_zero() else column[:3] / length, column[3:])
        for column in ca.horzsplit(scaled_twists(member.screws, member.centre, SX(1), member.size))
    ]
    vectors = scaled_twists(twists, member.centre, SX(1), member.size)
    parts = ca.vertcat(vectors[:3, :] / length, vectors[3:, :])
    return length * resisted_parts(ca.horzcat(SX(6, 0), *columns), member.rank, parts, member.groups)

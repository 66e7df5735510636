"""Expansion of the rows of six legs about the centre of a box of poses.

A row is used without division: with ``s > 0`` the scale of the rotation's coordinates and ``u = s R a``, the row of a
leg from ``b`` on the base to ``a`` on the platform is

    (s (p - b) + u,  u x (p - b)):     s times the leg's vector, and s times its moment about the platform's origin.

It is a polynomial in the coordinates, of first order in the position. The rank is that of J where no leg has zero
length, and is less than full where one has. Its expansion has the centre's matrix, 6 matrices of first order and 15 of
second; all others are bounded together, entry by entry. The C kernel has the same formulas.

In a machine whose joint centres are off by vectors e on the base and f on the platform, turned into the world frame,
the row differs by

    (s (f - e),  s f x (p - b) - u x e - s f x e),

which is bounded entry by entry for all e and f within the tolerance: a component of ``f x d`` is at most |f| times the
size of the two other components of d.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox

#: Part of the sum of the sizes of all terms by which an entry may be off. A term has fewer than 100 roundings of 2^-53.
ROUNDING = 1e-13
#: Part of itself by which the bound of the rows' change by errors of joint centres moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Pairs of rotation coordinates of the monomials of second order.
FIRST, SECOND = np.array([0, 0, 0, 1, 1, 2]), np.array([0, 1, 2, 1, 2, 2])
#: Numbers of matrices of an expansion, and of monomials in three coordinates up to the second order.
TERMS, _TURNS = 22, 10
#: Factor of each monomial of the scaled rotation: 1 for the constant and for squares, else 2.
_TWICE = np.array([1.0, 2.0, 2.0, 2.0, *np.where(FIRST == SECOND, 1.0, 2.0)])
#: Indices of the components of a vector after each one: the next, and the last.
_AFTER, _LAST = [1, 2, 0], [2, 0, 1]


class Expansion(NamedTuple):
    """Rows over B boxes.

    Attributes:
        terms: (B, 6, 22, 6) for each leg the matrices' rows: centre, first order (6), second order in the rotation (6)
            and mixed (9, position faster).
        rest: (B, 6, 6) bound of the size of all other terms, of rounding, and of the change by joint centres that are
            off by the legs' tolerance.
    """

    terms: FloatArray
    rest: FloatArray


class TurnForm(NamedTuple):
    """``s R`` (nine entries) and ``s`` about the centres of B boxes.

    Attributes:
        terms: (B, 10, 10) monomials, then entries.
        rest: (B, 10) bound of the terms of higher order.
        most: (B,) bound of the sum of sizes of all terms of an entry.
    """

    terms: FloatArray
    rest: FloatArray
    most: FloatArray


def expand(legs: Legs, box: PoseBox, centre: FloatArray, half: FloatArray) -> Expansion:
    """Return the rows over boxes.

    Args:
        legs: joint centres.
        box: the whole box, for the kind of its coordinates.
        centre: (B, 6) centres of the boxes.
        half: (B, 6) half widths.
    """
    turn, wide = centre[:, 3:], half[:, 3:]
    form = turn_form(box, turn, wide)
    count = len(centre)
    d = centre[:, None, :3] - legs.base
    arm = np.abs(d) + half[:, None, :3]
    matrices = form.terms[:, :, :9].reshape(count, _TURNS, 3, 3)
    u = np.einsum("btij,lj->blti", matrices, legs.platform)
    terms = np.empty((count, 6, TERMS, 6))
    scale = form.terms[:, None, :, 9, None]
    places = [0, *range(4, 13)]
    terms[:, :, places, :3] = scale * d[:, :, None] + u
    terms[:, :, places, 3:] = _cross(u, d[:, :, None])
    unit = np.eye(3)
    for t in range(4):
        first = 1 if t == 0 else 10 + 3 * t
        terms[:, :, first : first + 3, :3] = form.terms[:, t, 9, None, None, None] * unit
        terms[:, :, first : first + 3, 3:] = _cross(u[:, :, t, None], unit)
    weight = wide[:, FIRST] * wide[:, SECOND]
    thirds = (weight * np.abs(form.terms[:, 4:, 9])).sum(axis=1)[:, None, None]
    rests = np.einsum("bt,blti->bli", weight, np.abs(u[:, :, 4:]))
    size = np.einsum("bij,lj->bli", form.rest[:, :9].reshape(count, 3, 3), np.abs(legs.platform))
    far = (np.abs(centre[:, None, :3]) + np.abs(legs.base) + half[:, None, :3]).sum(axis=2)
    reach = np.abs(legs.platform).sum(axis=1)
    rounding = ROUNDING * form.most[:, None]
    rest = np.empty((count, 6, 6))
    rest[:, :, :3] = thirds * half[:, None, :3] + form.rest[:, 9, None, None] * arm + size
    rest[:, :, :3] += (rounding * (far + reach))[:, :, None]
    rest[:, :, 3:] = _largest_moment(rests, half[:, None, :3]) + _largest_moment(size, arm)
    rest[:, :, 3:] += (rounding * reach * far)[:, :, None]
    if legs.tolerance > 0:
        scales = np.abs(form.terms[:, :, 9])
        most_scale = scales[:, 0] + (scales[:, 1:4] * wide).sum(axis=1) + (scales[:, 4:] * weight).sum(axis=1)
        most_scale += form.rest[:, 9]
        sizes = np.abs(u[:, :, 0]) + np.einsum("bt,blti->bli", wide, np.abs(u[:, :, 1:4])) + rests + size
        rest += built_change(legs.tolerance, most_scale, sizes, arm)
    return Expansion(terms, rest)


def built_change(tolerance: float, scale: FloatArray, u: FloatArray, arm: FloatArray) -> FloatArray:
    """Return bounds (B, 6, 6) of the change of the rows by errors of the joint centres.

    Args:
        tolerance: largest error of each joint centre, length.
        scale: (B,) largest scale of the rotation's coordinates.
        u: (B, 6, 3) largest sizes of the components of ``s R a``.
        arm: (B, 6, 3) largest sizes of the components of ``p - b``.
    """
    s = scale[:, None, None]
    moment = s * (np.hypot(arm[..., _AFTER], arm[..., _LAST]) + tolerance) + np.hypot(u[..., _AFTER], u[..., _LAST])
    force = np.broadcast_to(2 * s, moment.shape)
    return np.concatenate([force, moment], axis=2) * (tolerance * _OUTWARDS)


def turn_form(box: PoseBox, turn: FloatArray, wide: FloatArray) -> TurnForm:
    """Return the scaled rotations over boxes.

    Args:
        box: the whole box, for the kind of its coordinates.
        turn: (B, 3) centres of the rotations' coordinates.
        wide: (B, 3) half widths.
    """
    return _roll_pitch_yaw(turn, wide) if box.kind is TurnKind.ROLL_PITCH_YAW else _cayley(box, turn, wide)


def _largest_moment(u: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the largest sizes of the components of a cross product of vectors with components up to these sizes."""
    return np.asarray(u[..., _AFTER] * arm[..., _LAST] + u[..., _LAST] * arm[..., _AFTER])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return cross products of vectors; NumPy's own function takes several times as long for few vectors."""
    return np.asarray(a[..., _AFTER] * b[..., _LAST] - a[..., _LAST] * b[..., _AFTER])


def _cayley(box: PoseBox, turn: FloatArray, wide: FloatArray) -> TurnForm:
    """Return ``(1 - r.r) I + 2 [r]x + 2 r r'`` and ``1 + r.r``, with ``r = sum_k y_k D_k``."""
    D = np.zeros((3, 3))
    D[0] = box.axis
    if box.kind is TurnKind.ANY_AXIS:
        D = np.eye(3)
    count = len(turn)
    a, b = np.empty((count, _TURNS, 3)), np.empty((count, _TURNS, 3))
    a[:, 0] = turn @ D
    b[:, :4] = a[:, :1]
    a[:, 1:4], a[:, 4:], b[:, 4:] = D, D[FIRST], D[SECOND]
    product = _TWICE * (a * b).sum(axis=2)
    outer = a[:, :, :, None] * b[:, :, None, :]
    matrix = _TWICE[:, None, None] * (outer + outer.transpose(0, 1, 3, 2)) - product[:, :, None, None] * np.eye(3)
    matrix[:, 0] += np.eye(3)
    matrix[:, :4] += 2 * _cross_matrices(a[:, :4])
    product[:, 0] += 1
    terms = np.concatenate([matrix.reshape(count, _TURNS, 9), product[:, :, None]], axis=2)
    size = 1 + ((np.abs(turn) + wide) @ np.abs(D)).sum(axis=1)
    return TurnForm(terms, np.zeros((count, 10)), 2 * size * size)


def _cross_matrices(v: FloatArray) -> FloatArray:
    """Return ``[v]x``, (B, T, 3, 3), of vectors (B, T, 3)."""
    found = np.zeros((*v.shape, 3))
    found[..., 0, 1], found[..., 0, 2], found[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return found - found.transpose(0, 1, 3, 2)


def _roll_pitch_yaw(turn: FloatArray, wide: FloatArray) -> TurnForm:
    """Return ``s Rz(yaw) Ry(pitch) Rx(roll)`` and ``s``, the product of ``1 + t^2`` of the three tangents ``t``."""
    count = len(turn)
    places = {(0, 0, 0): 0, (1, 0, 0): 1, (0, 1, 0): 2, (0, 0, 1): 3, (2, 0, 0): 4, (1, 1, 0): 5, (1, 0, 1): 6}
    places |= {(0, 2, 0): 7, (0, 1, 1): 8, (0, 0, 2): 9}
    matrices, scales = zip(*(_single_turn(k, turn[:, k]) for k in range(3)), strict=True)
    terms, rest = np.zeros((count, _TURNS, 10)), np.zeros((count, 10))
    for x, y, z in np.ndindex(3, 3, 3):
        product = matrices[2][z] @ matrices[1][y] @ matrices[0][x]
        whole = np.concatenate(
            [product.reshape(count, 9), (scales[2][z] * scales[1][y] * scales[0][x])[:, None]], axis=1
        )
        if (x, y, z) in places:
            terms[:, places[x, y, z]] = whole
        else:
            rest += (wide[:, 0] ** x * wide[:, 1] ** y * wide[:, 2] ** z)[:, None] * np.abs(whole)
    return TurnForm(terms, rest, 2 * ((1 + np.abs(turn) + wide) ** 2).prod(axis=1))


def _single_turn(about: int, t: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the coefficients of ``(1 + t^2) R`` about a coordinate axis, and of ``1 + t^2``, of order 0, 1 and 2."""
    i, j = (about + 1) % 3, (about + 2) % 3
    one = np.ones_like(t)
    matrices, scales = [], [1 + t * t, 2 * t, one]
    for cosine, sine, scale in zip((1 - t * t, -2 * t, -one), (2 * t, 2 * one, 0 * one), scales, strict=True):
        matrix = np.zeros((len(t), 3, 3))
        matrix[:, i, i] = matrix[:, j, j] = cosine
        matrix[:, j, i], matrix[:, i, j], matrix[:, about, about] = sine, -sine, scale
        matrices.append(matrix)
    return matrices, scales

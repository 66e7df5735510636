"""Singular poses of six straight legs by signs of determinants, which are computed without rounding.

The workspace is connected, and convex in its coordinates: where the determinant of the rows has one sign at the centre
of a box and the other at that of another, it is 0 at a pose of the segment between the two.

Within a tolerance on joint centres a machine may be singular although the exact one is not. With X the inverse of the
rows of the exact machine, errors of the joint centres change the logarithm of the determinant to first order by
``sum_i dJ_i . X_i`` over rows i and columns X_i. For each joint centre that is the product of its error with a vector,
so that the errors which bring the determinant nearest to 0 are along these vectors. Where the determinant of such a
machine has the other sign than that of the exact one, a machine between the two is singular.

Exact signs: the coordinates of a pose and the joint centres are doubles, hence fractions of whole numbers. The rows,
without a division, are polynomials in them, so that the sign of their determinant is computed with whole numbers. They
are built here from a quaternion and not from the formulas of the search.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .....models import FloatArray, frozen_array
from ....case.workspace import TurnKind
from ...statement.machine import INSIDE, JointErrors, Legs
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import Problem
from .krawczyk import inverses
from .loop_boxes import Examined
from .singular_pose import Singular

#: Change of the logarithm of the determinant to first order from which a change of sign is looked for, and the number
#: of poses at which it is looked for in one call: exact determinants take a while.
_WORTH, _POSES = 0.5, 4
#: Number of poses of each sign that are computed without rounding in one call.
_TRIED = 4
#: Before the search: number of random poses, of those from which others are looked for, of steps, and the distance of
#: poses from which derivatives are taken, in parts of the workspace.
_SAMPLES, _KEPT, _STEPS, _APART, _SEED = 256, 8, 6, 1e-4, 0
#: Halvings between two poses or machines: more than a double has digits.
_HALVINGS = 60


class SignRefuter:
    """Search for two poses with determinants of opposite signs, or for a machine with another sign than the exact one.

    Args:
        legs: joint centres.
        problem: the robot over a workspace.
    """

    def __init__(self, legs: Legs, problem: Problem) -> None:
        self._legs, self._problem, self._box = legs, problem, problem.box
        self._points: dict[int, FloatArray] = {}
        self._is_sampled = False

    def look(self, found: Examined, boxes: int) -> Singular | None:  # noqa: ARG002 - every block is looked at
        """Return a singular pose from random ones, from this block of boxes and from earlier ones."""
        box, y = self._box, self._problem.pose_of(found.boxes.centre)
        if not self._is_sampled:
            self._is_sampled = True
            points = self._near_singular()
            self._confirm(points, np.sign(self._determinants(points)))
        self._confirm(y, np.where((y[:, 3:] ** 2).sum(axis=1) <= box.ball, found.signs, 0))
        if len(self._points) == 2:
            sides = frozen_array([self._points[1], self._points[-1]], (2, 6))
            return Singular(frozen_array(singular_between(self._legs, box, *sides), (6,)), sides=sides)
        return singular_machine(self._legs, box, y[~found.is_regular]) if self._legs.tolerance else None

    def _confirm(self, points: FloatArray, signs: FloatArray) -> None:
        """Keep a pose of each sign, without rounding, among points (K, 6) with computed signs (K,)."""
        for sign in {-1, 1} - self._points.keys():
            for k in np.flatnonzero(signs == sign)[:_TRIED]:
                if self._box.holds(points[k]) and determinant_sign(self._legs, self._box, points[k]) == sign:
                    self._points[sign] = points[k]
                    break

    def _near_singular(self) -> FloatArray:
        """Return poses (K, 6) with the smallest and the largest determinants that a few steps from random ones find.

        The determinant changes little but linearly over a box: each step tries corners that its derivatives point to.
        """
        box = self._box
        width, parts = box.upper - box.lower, np.array([1.0, 0.5, 0.25])[:, None, None]
        every = box.random(_SAMPLES, np.random.default_rng(_SEED))
        values = self._determinants(every)
        found = []
        for sign in (-1.0, 1.0):
            y = every[np.argsort(sign * values)[:_KEPT]]
            for _ in range(_STEPS):
                moved = y[None] + _APART * width * np.eye(6)[:, None]
                slopes = sign * (self._determinants(moved.reshape(-1, 6)).reshape(6, -1) - self._determinants(y)).T
                end = np.where(slopes > 0, box.lower, box.upper)
                if box.ball < np.inf:
                    size = np.linalg.norm(slopes[:, 3:], axis=1, keepdims=True)
                    end[:, 3:] = -slopes[:, 3:] / np.maximum(size, np.finfo(float).tiny) * np.sqrt(box.ball)
                tried = np.concatenate([y[None], y + parts * (end - y)])
                tried = box.clipped(tried.reshape(-1, 6)).reshape(tried.shape)
                best = np.argmin(sign * self._determinants(tried.reshape(-1, 6)).reshape(4, -1), axis=0)
                y = tried[best, np.arange(len(y))]
            found.append(y)
        return np.concatenate(found)

    def _determinants(self, points: FloatArray) -> FloatArray:
        """Return the determinants (K,) of unit rows at points (K, 6): computed numbers."""
        rows = rows_at(self._legs, self._box, points)
        return np.asarray(np.linalg.det(rows) / np.linalg.norm(rows[:, :, :3], axis=2).prod(axis=1))


def singular_machine(legs: Legs, box: PoseBox, points: FloatArray) -> Singular | None:
    """Return a machine within the legs' tolerance that is singular at one of a few poses (K, 6); None without one."""
    exact, rotation = legs._replace(tolerance=0.0), box.rotations(points)
    X = inverses(rows_at(exact, box, points))
    force, moment = X[:, :3].transpose(0, 2, 1), X[:, 3:].transpose(0, 2, 1)
    arm = np.einsum("kij,lj->kli", rotation, legs.platform)
    along_platform = force + np.cross(points[:, None, :3] - legs.base, moment)
    along_base = -force - np.cross(moment, arm)
    sizes = [np.linalg.norm(each, axis=2, keepdims=True) for each in (along_base, along_platform)]
    change = legs.tolerance * (sizes[0] + sizes[1]).sum(axis=(1, 2))
    for k in np.argsort(-np.nan_to_num(change))[:_POSES]:
        if not (change[k] > _WORTH and box.holds(points[k])):
            continue
        base, turned = (
            -legs.tolerance * INSIDE * each[k] / np.maximum(size[k], np.finfo(float).tiny)
            for each, size in zip((along_base, along_platform), sizes, strict=True)
        )
        found = _between(exact, box, points[k], JointErrors(base, turned @ rotation[k]))
        if found is not None:
            return Singular(frozen_array(points[k], (6,)), errors=found)
    return None


def _between(legs: Legs, box: PoseBox, y: FloatArray, errors: JointErrors) -> JointErrors | None:
    """Return the part of errors at which the determinant changes its sign at a pose (6,); None where it does not."""

    def part(share: float) -> JointErrors:
        return JointErrors(share * errors.base, share * errors.platform)

    sign = determinant_sign(legs, box, y)
    low, high = 0.0, 1.0
    if determinant_sign(errors.applied(legs), box, y) == sign:
        return None
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if determinant_sign(part(middle).applied(legs), box, y) == sign:
            low = middle
        else:
            high = middle
    return part(high)


def rows_at(legs: Legs, box: PoseBox, points: FloatArray) -> FloatArray:
    """Return the rows (K, 6, 6) at points (K, 6) without the scale: vectors of the legs, and their moments."""
    arm = np.einsum("kij,lj->kli", box.rotations(points), legs.platform)
    span = points[:, None, :3] - legs.base + arm
    return np.concatenate([span, np.cross(arm, span)], axis=2)


def determinant_sign(legs: Legs, box: PoseBox, y: FloatArray) -> int:
    """Return the sign of the determinant of the rows at a point (6,), without rounding."""
    return _sign_of_determinant(_rows(legs, box, y))


def singular_between(legs: Legs, box: PoseBox, positive: FloatArray, negative: FloatArray) -> FloatArray:
    """Return the point (6,) of a segment at which the determinant changes its sign, to the last digits.

    Args:
        legs: joint centres.
        box: the whole box.
        positive: (6,) a point at which the determinant is positive.
        negative: (6,) one at which it is negative.
    """
    for _ in range(_HALVINGS):
        middle = 0.5 * positive + 0.5 * negative
        sign = determinant_sign(legs, box, middle)
        if sign == 0 or (middle == positive).all() or (middle == negative).all():
            return middle
        if sign > 0:
            positive = middle
        else:
            negative = middle
    return 0.5 * positive + 0.5 * negative


def _rows(legs: Legs, box: PoseBox, y: FloatArray) -> list[list[int]]:
    """Return the scaled rows at a point (6,), each column times a positive number."""
    w, i, j, k = _quaternion(box, y[3:])
    scale = w * w + i * i + j * j + k * k
    turn = (
        (w * w + i * i - j * j - k * k, 2 * (i * j - w * k), 2 * (i * k + w * j)),
        (2 * (i * j + w * k), w * w - i * i + j * j - k * k, 2 * (j * k - w * i)),
        (2 * (i * k - w * j), 2 * (j * k + w * i), w * w - i * i - j * j + k * k),
    )
    lengths = _whole([*y[:3].tolist(), *legs.base.ravel().tolist(), *legs.platform.ravel().tolist()])[1:]
    position, base, platform = lengths[:3], lengths[3:21], lengths[21:]
    rows = []
    for leg in range(0, 18, 3):
        a, d = platform[leg : leg + 3], [p - b for p, b in zip(position, base[leg : leg + 3], strict=True)]
        u = [sum(each * part for each, part in zip(row, a, strict=True)) for row in turn]
        moment = [u[1] * d[2] - u[2] * d[1], u[2] * d[0] - u[0] * d[2], u[0] * d[1] - u[1] * d[0]]
        rows.append([*(scale * part + each for part, each in zip(d, u, strict=True)), *moment])
    return rows


_Quaternion = tuple[int, int, int, int]


def _whole(values: Sequence[float]) -> list[int]:
    """Return the least common denominator of doubles, then their numerators."""
    ratios = [each.as_integer_ratio() for each in values]
    common = max(denominator for _, denominator in ratios)
    return [common, *(numerator * (common // denominator) for numerator, denominator in ratios)]


def _quaternion(box: PoseBox, turn: FloatArray) -> _Quaternion:
    """Return a quaternion in whole numbers, of any size, of the rotation with these coordinates."""
    one, a, b, c = _whole(turn.tolist())
    if box.kind is TurnKind.ANY_AXIS:
        return one, a, b, c
    if box.kind is TurnKind.AXIS:
        whole, x, y, z = _whole(box.axis.tolist())
        return one * whole, a * x, a * y, a * z
    return _product(_product((one, 0, 0, c), (one, 0, b, 0)), (one, a, 0, 0))


def _product(p: _Quaternion, q: _Quaternion) -> _Quaternion:
    """Return the product of two quaternions, w first."""
    a, b, c, d = p
    e, f, g, h = q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def _sign_of_determinant(rows: Sequence[Sequence[int]]) -> int:
    """Return the sign of a determinant, by elimination in whole numbers (Bareiss)."""
    whole = [list(row) for row in rows]
    sign, before = 1, 1
    for k in range(len(whole) - 1):
        pivot = next((i for i in range(k, len(whole)) if whole[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            whole[k], whole[pivot], sign = whole[pivot], whole[k], -sign
        for i in range(k + 1, len(whole)):
            for j in range(k + 1, len(whole)):
                whole[i][j] = (whole[i][j] * whole[k][k] - whole[i][k] * whole[k][j]) // before
        before = whole[k][k]
    last = whole[-1][-1]
    return sign * ((last > 0) - (last < 0))

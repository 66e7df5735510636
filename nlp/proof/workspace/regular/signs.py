"""Singular poses of six straight legs by signs of determinants, which are computed without rounding.

The workspace is connected, and convex in its coordinates: where the determinant of the rows has one sign at the centre
of a box and the other at that of another, it is 0 at a pose of the segment between the two.

Within a tolerance on joint centres a machine may be singular although the exact one is not. With X the inverse of the
rows of the exact machine, errors of the joint centres change the logarithm of the determinant to first order by
``sum_i dJ_i . X_i`` over rows i and columns X_i. For each joint centre that is the product of its error with a vector,
so that the errors which bring the determinant nearest to 0 are along these vectors. Where the determinant of such a
machine has the other sign than that of the exact one, a machine between the two is singular.
"""

from __future__ import annotations

import numpy as np

from .....models import FloatArray, frozen_array
from ...statement.machine import INSIDE, JointErrors, Legs
from ..ranks.krawczyk import inverses
from ..ranks.loop_boxes import Examined
from ..ranks.singular_pose import Singular
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import Problem
from .exact import determinant_sign, singular_between
from .rows import rows_at

#: Change of the logarithm of the determinant to first order from which a change of sign is looked for, and the number
#: of poses at which it is looked for in one call: exact determinants take a while.
_WORTH, _POSES = 0.5, 4
#: Number of poses of each sign that are computed without rounding in one call.
_TRIED = 4
#: Before the search: number of random poses, of those from which others are looked for, of steps, and the distance of
#: poses from which derivatives are taken, in parts of the workspace.
_SAMPLES, _KEPT, _STEPS, _APART, _SEED = 256, 8, 6, 1e-4, 0
#: Halvings between two machines: more than a double has digits.
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

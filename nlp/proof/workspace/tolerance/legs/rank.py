"""Machines within a tolerance on joint centres that are singular at a pose.

With X the inverse of the rows of the exact machine, errors of the joint centres change the logarithm of the determinant
to first order by ``sum_i dJ_i . X_i`` over rows i and columns X_i. For each joint centre that is the product of its
error with a vector, so that the errors which bring the determinant nearest to 0 are along these vectors. Where the
determinant of such a machine has the other sign than that of the exact one, both computed without rounding, a machine
between the two is singular.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ......models import FloatArray
from ....statement.machine import INSIDE, JointErrors, Legs
from ...regular.exact import determinant_sign
from ...regular.inverse import inverses
from ...regular.rows import expand, turn_form
from ...robot.pose_box import PoseBox

#: Change of the logarithm of the determinant to first order from which a change of sign is looked for, and the number
#: of poses at which it is looked for in one call: exact determinants take a while.
_WORTH, _POSES = 0.5, 4
#: Halvings between two machines: more than a double has digits.
_HALVINGS = 60


class SingularMachine(NamedTuple):
    """A pose (6,) in the coordinates of a box, and the errors of a machine that is singular there."""

    y: FloatArray
    errors: JointErrors


def singular_machine(legs: Legs, box: PoseBox, points: FloatArray) -> SingularMachine | None:
    """Return a machine within the legs' tolerance that is singular at one of a few poses (K, 6); None without one."""
    if not len(points):
        return None
    exact = legs._replace(tolerance=0.0)
    X = inverses(expand(exact, box, points, np.zeros_like(points)).terms[:, :, 0])
    form = turn_form(box, points[:, 3:], np.zeros((len(points), 3))).terms[:, 0]
    scaled, s = form[:, :9].reshape(-1, 3, 3), form[:, 9, None, None]
    force, moment = X[:, :3].transpose(0, 2, 1), X[:, 3:].transpose(0, 2, 1)
    u = np.einsum("kij,lj->kli", scaled, legs.platform)
    along_platform = s * (force + np.cross(points[:, None, :3] - legs.base, moment))
    along_base = -s * force - np.cross(moment, u)
    sizes = [np.linalg.norm(each, axis=2, keepdims=True) for each in (along_base, along_platform)]
    change = legs.tolerance * (sizes[0] + sizes[1]).sum(axis=(1, 2))
    for k in np.argsort(-np.nan_to_num(change))[:_POSES]:
        if not (change[k] > _WORTH and box.holds(points[k])):
            continue
        base, turned = (
            -legs.tolerance * INSIDE * each[k] / np.maximum(size[k], np.finfo(float).tiny)
            for each, size in zip((along_base, along_platform), sizes, strict=True)
        )
        found = _between(exact, box, points[k], JointErrors(base, turned @ (scaled[k] / form[k, 9])))
        if found is not None:
            return SingularMachine(points[k], found)
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

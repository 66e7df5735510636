"""A model over a box of poses as expressions of the coordinates of a search.

Rotations are quotients of polynomials of their coordinates, ``R = (s R) / s``. Rows of J that are linear in the
rotation, such as those of straight legs, lose the division by s when they are multiplied by it: their forms over a box
are then exact but for terms of third order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model, Substitution, jacobian
from .....models.instance import sizes_at
from ....case.case import Case
from ....case.pose import Free
from ....case.workspace import TurnKind
from .motion_matrix import Limbs
from .pose_box import PoseBox


def rotation_of(box: PoseBox, turn: SX) -> SX:
    """Return the rotation (3, 3) with coordinates (3, 1) of a box."""
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        about = [_turn(k, turn[k]) for k in range(3)]
        return about[2] @ about[1] @ about[0]
    r = turn if box.kind is TurnKind.ANY_AXIS else turn[0] * SX(box.axis.tolist())
    scaled = 2 / (1 + ca.sumsqr(r)) * r
    return SX.eye(3) + ca.skew(scaled) + ca.skew(scaled) @ ca.skew(r)


def polynomial_rotation(box: PoseBox, turn: SX) -> tuple[SX, SX]:
    """Return ``s R`` (3, 3) and ``s`` (1, 1), polynomials of the coordinates (3, 1) of a rotation R, ``s > 0``."""
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        turned, scale = SX.eye(3), SX(1)
        for k in range(3):
            one = 1 + turn[k] ** 2
            i, j = (k + 1) % 3, (k + 2) % 3
            single = SX.eye(3) * one
            single[i, i] = single[j, j] = 1 - turn[k] ** 2
            single[j, i], single[i, j] = 2 * turn[k], -2 * turn[k]
            turned, scale = single @ turned, one * scale
        return turned, scale
    r = turn if box.kind is TurnKind.ANY_AXIS else turn[0] * SX(box.axis.tolist())
    square = ca.sumsqr(r)
    return (1 - square) * SX.eye(3) + 2 * (r @ r.T) + 2 * ca.skew(r), 1 + square


def _turn(about: int, tangent: SX) -> SX:
    """Return the rotation about a coordinate axis by an angle, from the tangent of its half."""
    i, j = (about + 1) % 3, (about + 2) % 3
    factor = 2 / (1 + tangent * tangent)
    matrix = SX.eye(3)
    matrix[i, i] = matrix[j, j] = factor - 1
    matrix[j, i], matrix[i, j] = factor * tangent, -factor * tangent
    return matrix


@dataclass(frozen=True, eq=False)
class PosedModel:
    """A model as expressions of the coordinates: Substitution's numbers put in.

    Attributes:
        z: (n, 1) symbols.
        free: indices of the pose's numbers.
        size: (n,) of the coordinates.
        closure: equations, of order 1.
        every: all equations of loops, and signs that must be positive.
        signs: (s, 1) numbers that are positive in home's assembly.
        limbs: rows, members and actuators.
        jacobian: (rows, 6) J, couples times the characteristic length of the case.
        turned: the limbs with ``inverse * s R`` as the rotation.
        inverse: (1, 1) symbol of ``1 / s``.
        scale: (1, 1) ``s``.
    """

    z: SX
    free: tuple[int, ...]
    size: FloatArray
    closure: SX
    every: SX
    signs: SX
    limbs: Limbs
    jacobian: SX
    turned: Limbs
    inverse: SX
    scale: SX


def posed_model(case: Case, model: Model, box: PoseBox, *, z: SX | None = None, errors: SX | None = None) -> PosedModel:
    """Return a model as expressions of the coordinates.

    Args:
        case: with fixed dimensions.
        model: its robot; its parameters may be followed by errors of joint centres.
        box: the poses.
        z: (n, 1) symbols of the coordinates; new ones if left out.
        errors: (3 m, 1) symbols in the place of the errors.
    """
    free = box.free
    y = [SX(float(each)) for each in 0.5 * box.lower + 0.5 * box.upper]
    own = [SX.sym(f"y{k}") for k in free] if z is None else ca.vertsplit(z)[: len(free)]
    for k, symbol in zip(free, own, strict=True):
        y[k] = symbol
    unknowns = [SX.sym(item.name) for item in model.unknowns] if z is None else ca.vertsplit(z)[len(free) :]
    errors = SX(0, 1) if errors is None else errors
    rotation, position = rotation_of(box, ca.vertcat(*y[3:])), ca.vertcat(*y[:3])
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    symbols = Substitution.identity(model)
    numbers = ca.vertcat(SX(0, 1), *values, errors)
    given = Substitution(numbers, ca.vertcat(SX(0, 1), *unknowns), rotation, position)
    every = (*model.closure, *model.loops)
    outputs = [
        *[part for row in model.wrenches for part in (row.force, row.moment, row.square)],
        *[part for member in model.members for part in (member.centre, member.screws)],
        *[part for each in model.actuators for part in (each.screws, each.relations)],
        *[each.loops[:, each.passive] for each in model.nested],
        *[each.value for each in model.signs],
        *[each.expression for each in every],
    ]
    function = ca.Function("model", symbols.all, outputs)

    def limbs_of(following: Iterator[SX]) -> Limbs:
        """Return the limbs from the first outputs."""
        rows = [
            replace(row, force=next(following), moment=next(following), square=next(following))
            for row in model.wrenches
        ]
        members = [replace(each, centre=next(following), screws=next(following), slide=None) for each in model.members]
        driven = [replace(each, screws=next(following), relations=next(following)) for each in model.actuators]
        loops = [next(following) for _ in model.nested]
        return Limbs(rows, members, driven, loops, position, 1.0)

    following = iter(function.call(given.all))
    limbs = limbs_of(following)
    polynomial, scale = polynomial_rotation(box, ca.vertcat(*y[3:]))
    inverse = SX.sym("inverse")
    turned = limbs_of(iter(function.call([given.parameters, given.unknowns, inverse * polynomial, position])))
    signs = ca.vertcat(SX(0, 1), *[next(following) for _ in model.signs])
    sizes = sizes_at(
        model, (*every, *model.unknowns), (*values, *[0.0] * errors.numel()), SX.ones(len(every) + len(model.unknowns))
    )
    scaled = [next(following) / sizes[k] for k in range(len(every))]
    ranges = (0.5 * (box.upper - box.lower))[list(free)]
    own_sizes = np.array(ca.DM(sizes[len(every) :, :])).ravel()
    return PosedModel(
        z=ca.vertcat(SX(0, 1), *[y[k] for k in free], *unknowns),
        free=free,
        size=np.concatenate([ranges, own_sizes]),
        closure=ca.vertcat(SX(0, 1), *scaled[: len(model.closure)]),
        every=ca.vertcat(SX(0, 1), *scaled),
        signs=signs,
        limbs=limbs,
        jacobian=jacobian(limbs.wrenches, SX(case.characteristic_length), limbs.members),
        turned=turned,
        inverse=inverse,
        scale=scale,
    )


def polynomial_rows(matrix: SX, turned: SX, posed: PosedModel) -> SX:
    """Return a matrix whose rows that are linear in the rotation are multiplied by its scale, without a division.

    Args:
        matrix: (m, c).
        turned: the same from ``posed.turned``.
        posed: the robot.
    """
    slopes = ca.reshape(ca.jacobian(ca.densify(turned), posed.inverse), *turned.shape)
    constant = ca.substitute(turned, posed.inverse, 0)
    rows = [
        matrix[i, :] if ca.depends_on(slopes[i, :], posed.inverse) else constant[i, :] * posed.scale + slopes[i, :]
        for i in range(matrix.shape[0])
    ]
    return ca.sparsify(ca.vertcat(*rows))

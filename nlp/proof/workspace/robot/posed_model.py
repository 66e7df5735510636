"""Matrices whose full column rank means that a robot has no motion that nothing resists.

With actuators locked, the platform's twist x is resisted unless each row ``L`` of a limb does no work in it, ``L.x =
0``, and it is a motion of the passive joints of each member: ``x - sum_j w_j S_j = 0`` with rates ``w``. Together these
are ``M (x, w) = 0`` with entries that are rows and screws themselves, neither normalised nor made orthogonal. J has
full rank, and the passive screws of every member are independent, exactly where M has full column rank.

With free actuators of rates ``u``, each row and member sees ``x - A u`` in the place of x, with the screws ``A`` of
those actuators that move its member; and the relations of rates that loops demand are rows of their own. The null space
of this matrix N has as many dimensions as the robot has freedoms and rates of actuators without a motion, more only
where the constraint wrenches lose their rank, or passive screws theirs.

The screws of members with nested loops follow from ``L q = 0`` with the rank that L has at almost all poses. They would
not tell a pose at which L loses it, and the member resists less. So both matrices have, as blocks of their own, as many
rows of L as its rank, transposed: full column rank means that L keeps its rank too.

Twists are ``(v, length omega)`` with the velocity v of the platform's origin.

Rows that are linear in the rotation R, such as those of straight legs, are multiplied by the s of ``R = (s R) / s`` and
so lose the division: their forms over a box are then exact but for terms of third order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Actuator, FloatArray, Member, Model, Substitution, Wrench, WrenchKind, jacobian, rate_relations
from .....models.instance import homogenised, sizes_at
from ....case.case import Case
from ....case.pose import Free
from .closed_loops import Loops
from .pose_box import PoseBox, polynomial_rotation, rotation_of


@dataclass(frozen=True, eq=False)
class RankMatrix:
    """A matrix of expressions whose rank is judged.

    Attributes:
        matrix: (m, c) sparse: the first six columns are the platform's twist.
        nullity: dimension of its null space at almost all poses: 0, or the robot's freedoms and idle rates.
    """

    matrix: SX
    nullity: int


@dataclass(frozen=True, eq=False)
class Limbs:
    """Rows and members of a robot at a pose, with its actuators.

    Attributes:
        wrenches: rows.
        members: members; those columns of each that are independent.
        actuators: actuated joints.
        loops: (m, k) each, the equations of nested loops in the rates of a member's passive joints.
        position: (3, 1) the platform's origin, length.
        length: by which rotations are multiplied.
    """

    wrenches: Sequence[Wrench]
    members: Sequence[Member]
    actuators: Sequence[Actuator]
    loops: Sequence[SX]
    position: SX
    length: float

    def reduced(self, columns: Sequence[Sequence[int]], rows: Sequence[Sequence[int]], length: float) -> Limbs:
        """Return the limbs with some of the screws and loop equations of each member, and another length.

        Args:
            columns: indices of the screws that are kept.
            rows: indices of the equations that are kept.
            length: by which rotations are multiplied.
        """
        members = [
            replace(each, screws=each.screws[:, list(kept)], groups=())
            for each, kept in zip(self.members, columns, strict=True)
        ]
        loops = [each[list(kept), :] for each, kept in zip(self.loops, rows, strict=True)]
        return replace(self, members=members, loops=loops, length=length)

    def about_platform(self, row: Wrench) -> SX:
        """Return the force and the moment (1, 6) of a row about the platform's origin, divided by the length."""
        return ca.horzcat(row.force.T, (row.moment - ca.cross(self.position, row.force)).T / self.length)

    def twists(self, screws: SX) -> SX:
        """Return twists (6, k), angular velocity, then velocity at the world's origin, as ``(v, length omega)``."""
        found = [
            ca.vertcat(screws[3:, j] + ca.cross(screws[:3, j], self.position), self.length * screws[:3, j])
            for j in range(screws.shape[1])
        ]
        return ca.horzcat(SX(6, 0), *found)


def locked_matrix(limbs: Limbs) -> SX:
    """Return M, with the actuators locked."""
    return _matrix(limbs, [])


def free_matrix(limbs: Limbs) -> SX:
    """Return N, with the actuators free; of a robot given by its rows the couples alone, which are its constraints."""
    if limbs.actuators:
        return _matrix(limbs, limbs.actuators)
    couples = [row for row in limbs.wrenches if row.kind is WrenchKind.COUPLE]
    return _matrix(replace(limbs, wrenches=couples, members=(), loops=()), [])


def _matrix(limbs: Limbs, driven: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), sparse, with one column for each driven joint at its end."""
    # What rows and members see of the platform's twist, and the passive screws that they see it less.
    parts = [(row.label.member, limbs.about_platform(row), SX(6, 0)) for row in limbs.wrenches]
    for member in limbs.members:
        # A pinned member sees the velocity of its centre alone: v + omega x (centre - p).
        arm = (member.centre - limbs.position) / limbs.length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if member.is_pinned else SX.eye(6)
        parts.append((member.label, seen, member.screws))
    by_drives = [
        ca.horzcat(SX(seen.shape[0], 0), *[_rate(limbs, seen, each.screw_in(label)) for each in driven])
        for label, seen, _ in parts
    ]
    motions = ca.horzcat(
        ca.vertcat(SX(0, 6), *[seen for _, seen, _ in parts]),
        ca.diagcat(SX(0, 0), *[-seen @ limbs.twists(screws) for _, seen, screws in parts]),
        ca.vertcat(SX(0, len(driven)), *by_drives),
    )
    relations = rate_relations(driven)
    motions = ca.vertcat(motions, ca.horzcat(SX(relations.shape[0], motions.shape[1] - len(driven)), relations))
    return ca.sparsify(ca.diagcat(motions, *[each.T for each in limbs.loops if each.shape[0]]))


def _rate(limbs: Limbs, seen: SX, screw: SX | None) -> SX:
    """Return the column (k, 1) of a driven joint; zeros where it does not move what is seen."""
    return SX(seen.shape[0], 1) if screw is None else -seen @ limbs.twists(screw)


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


class Chosen(NamedTuple):
    """What is kept of a model where the rest follows from it.

    Attributes:
        equations: indices of the closure's equations.
        columns: indices of the screws of each member.
        rows: indices of the equations of each member's nested loops.
        length: by which rotations are multiplied, of the order of the robot's.
    """

    equations: Sequence[int]
    columns: Sequence[Sequence[int]]
    rows: Sequence[Sequence[int]]
    length: float


@dataclass(frozen=True, eq=False)
class PosedModel:
    """A model as expressions of the coordinates: Substitution's numbers put in.

    Attributes:
        loops: equations of order 1 in the coordinates.
        free: indices of the pose's numbers, which are the first coordinates.
        limbs: rows, members and actuators.
        characteristic_length: by which couples are multiplied in J.
        turned: the limbs with ``inverse * s R`` as the rotation.
        inverse: symbol that stands for ``1 / s``.
        scale: ``s``, a polynomial.
    """

    loops: Loops
    free: tuple[int, ...]
    limbs: Limbs
    characteristic_length: float
    turned: Limbs
    inverse: SX
    scale: SX

    @property
    def z(self) -> SX:
        """Symbols (n, 1) of the coordinates."""
        return self.loops.z

    def values(self, expression: SX, z: FloatArray) -> FloatArray:
        """Return a matrix of expressions at a point (n,)."""
        return np.asarray(ca.Function("values", [self.z], [ca.densify(expression)])(z).full())

    def reduced(self, chosen: Chosen) -> PosedModel:
        """Return the model with the equations and screws that are chosen."""
        limbs, turned = (each.reduced(*chosen[1:]) for each in (self.limbs, self.turned))
        return replace(self, loops=self.loops.some(chosen.equations), limbs=limbs, turned=turned)

    @property
    def locked(self) -> RankMatrix:
        """The matrix with locked actuators, rows that are linear in the rotation without a division."""
        return RankMatrix(self.polynomial(locked_matrix(self.limbs), locked_matrix(self.turned)), 0)

    @property
    def scaled(self) -> ScaledRows:
        """J with moments about the platform's origin divided by the length of the limbs."""

        def wrenches(limbs: Limbs) -> SX:
            """Return rows of forces and couples, and 1 in a last column: the factor that makes them polynomials."""
            rows = [ca.horzcat(limbs.about_platform(row), 1) for row in limbs.wrenches]
            return ca.vertcat(SX(0, 7), *rows)

        L, limbs = SX(self.characteristic_length), self.limbs
        rows = ca.densify(self.polynomial(wrenches(limbs), wrenches(self.turned)))
        factors = [L if row.kind is WrenchKind.COUPLE else SX(1) for row in limbs.wrenches]
        sizes = [rows[i, 6] * ca.sqrt(row.square) / factors[i] for i, row in enumerate(limbs.wrenches)]
        of_members = ca.horzcat(*homogenised(jacobian([], L, limbs.members), limbs.position, limbs.length))
        ones = SX.ones(of_members.shape[0])
        return ScaledRows(ca.vertcat(rows[:, :6], of_members), ca.vertcat(SX(0, 1), *sizes, ones))

    def polynomial(self, plain: SX, turned: SX) -> SX:
        """Return a matrix whose rows that are linear in the rotation are multiplied by its scale, without a division.

        Args:
            plain: (m, c).
            turned: the same with ``inverse * s R`` as the rotation.
        """
        slopes = ca.reshape(ca.jacobian(ca.densify(turned), self.inverse), *turned.shape)
        constant = ca.substitute(turned, self.inverse, 0)
        found = [
            plain[i, :] if ca.depends_on(slopes[i, :], self.inverse) else constant[i, :] * self.scale + slopes[i, :]
            for i in range(plain.shape[0])
        ]
        return ca.sparsify(ca.vertcat(SX(0, plain.shape[1]), *found))


def posed_model(case: Case, model: Model, box: PoseBox, z: SX | None = None, errors: SX | None = None) -> PosedModel:
    """Return a model as expressions of the coordinates.

    Args:
        case: with fixed dimensions.
        model: its robot; its parameters may be followed by errors of joint centres.
        box: the poses.
        z: (n, 1) symbols of the coordinates; new ones if left out.
        errors: (3 m, 1) symbols in the place of the errors.
    """
    free, errors = box.free, SX(0, 1) if errors is None else errors
    if z is None:
        z = ca.vertcat(SX(0, 1), *[SX.sym(f"y{k}") for k in free], *[SX.sym(item.name) for item in model.unknowns])
    y = box.symbols(z)
    position, turn = y[:3], y[3:]
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    numbers = ca.vertcat(SX(0, 1), *values, errors)
    given = Substitution(numbers, z[len(free) :], rotation_of(box, turn), position)
    every = (*model.closure, *model.loops)
    outputs = [
        *[part for row in model.wrenches for part in (row.force, row.moment, row.square)],
        *[part for member in model.members for part in (member.centre, member.screws)],
        *[part for each in model.actuators for part in (each.screws, each.relations)],
        *[each.loops[:, each.passive] for each in model.nested],
        *[each.value for each in model.signs],
        *[each.expression for each in every],
    ]
    function = ca.Function("model", Substitution.identity(model).all, outputs)

    def limbs_of(following: Iterator[SX]) -> Limbs:
        """Return the limbs from the first outputs."""
        rows = [
            replace(row, force=next(following), moment=next(following), square=next(following))
            for row in model.wrenches
        ]
        members = [replace(each, centre=next(following), screws=next(following), slide=None) for each in model.members]
        driven = [replace(each, screws=next(following), relations=next(following)) for each in model.actuators]
        return Limbs(rows, members, driven, [next(following) for _ in model.nested], position, 1.0)

    following = iter(function.call(given.all))
    limbs, signs = limbs_of(following), [next(following) for _ in model.signs]
    polynomial, scale = polynomial_rotation(box, turn)
    inverse = SX.sym("inverse")
    turned = replace(given, rotation=inverse * polynomial)
    ones = SX.ones(len(every) + len(model.unknowns))
    sizes = sizes_at(model, (*every, *model.unknowns), (*values, *[0.0] * errors.numel()), ones)
    scaled = [next(following) / sizes[k] for k in range(len(every))]
    ranges = (0.5 * (box.upper - box.lower))[list(free)]
    size = np.concatenate([ranges, np.array(ca.DM(sizes[len(every) :, :])).ravel()])
    whole = ca.vertcat(SX(0, 1), *scaled)
    return PosedModel(
        loops=Loops(z, whole[: len(model.closure)], whole, ca.vertcat(SX(0, 1), *signs), size),
        free=free,
        limbs=limbs,
        characteristic_length=case.characteristic_length,
        turned=limbs_of(iter(function.call(turned.all))),
        inverse=inverse,
        scale=scale,
    )

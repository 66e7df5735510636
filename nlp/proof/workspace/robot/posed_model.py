"""Matrices that have full column rank exactly where the limbs of a robot resist every motion of the platform.

With locked actuators, a platform twist x is possible only under two conditions. Each row ``L`` of a limb does no work
in the twist: ``L.x = 0``. The passive joints of each member can follow the twist: ``x - sum_j w_j S_j = 0`` with rates
``w``. Together these equations are ``M (x, w) = 0``. The entries of M are rows and screws, neither normalised nor
orthogonalised. J has full rank, and the passive screws of every member are independent, exactly where M has full
column rank.

With unlocked actuators of rates ``u``, ``x - A u`` replaces x for each row and member. ``A`` has the screws of the
actuators that move the member. Relations between actuator rates that loops impose are additional rows. The dimension of
the null space of this matrix N is the number of degrees of freedom plus the number of idle actuator rates. The
dimension is larger only where the constraint wrenches, or the passive screws, lose rank.

The screws of members with nested loops follow from ``L q = 0`` with the generic rank of L. These screws do not reveal
a pose at which L loses rank and the member resists less. So both matrices also contain independent rows of L,
transposed, as separate blocks: full column rank means that L keeps its rank too.

Twists are ``(v, length omega)`` with the velocity v of the platform's origin.

Rows that are linear in the rotation R, such as rows of straight legs, are multiplied by the scale s of ``R = (s R) /
s``, to avoid the division. The forms of these rows over a box are then exact up to terms of third order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Actuator, FloatArray, Member, Model, Substitution, Wrench, WrenchKind, jacobian, rate_relations
from .....models.instance import homogenised
from .....models.member import scaled_twists
from ....case.case import Case
from ....case.pose import ends_of
from ....evidence.closed_loops import Loops
from ....evidence.dependent import loop_system
from .pose_box import PoseBox, polynomial_rotation, rotation_of


@dataclass(frozen=True, eq=False)
class RankMatrix:
    """A matrix of expressions with the dimension of its null space at almost all poses.

    Attributes:
        matrix: (m, c) sparse matrix; the first six columns are the platform's twist.
        nullity: dimension of the null space at almost all poses: 0, or the number of degrees of freedom and idle rates.
    """

    matrix: SX
    nullity: int


@dataclass(frozen=True, eq=False)
class Limbs:
    """Robot at a pose: the rows of J, the members with their screws, and the actuators.

    Attributes:
        wrenches: rows of J.
        members: members, with independent screws.
        actuators: actuated joints.
        loops: for each member, matrix (m, k) of its nested-loop equations in the rates of its passive joints.
        position: (3, 1) origin of the platform, length.
        length: factor of rotations in scaled twists (v, length omega), similar to the robot's size.
    """

    wrenches: Sequence[Wrench]
    members: Sequence[Member]
    actuators: Sequence[Actuator]
    loops: Sequence[SX]
    position: SX
    length: float

    def reduced(self, columns: Sequence[Sequence[int]], rows: Sequence[Sequence[int]], length: float) -> Limbs:
        """Return the limbs with only some screws and loop equations of each member, and with another length.

        Args:
            columns: indices of the kept screws of each member.
            rows: indices of the kept loop equations of each member.
            length: factor of rotations in scaled twists, length.
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
        """Convert twists (6, k) from (angular velocity, velocity at the world's origin) to ``(v, length omega)``.

        v is the velocity of the platform's origin.
        """
        return scaled_twists(screws, self.position, SX(self.length), 6)


def free_matrix(limbs: Limbs) -> SX:
    """Return the matrix N with unlocked actuators.

    A robot given by its rows contributes only its couples, which are its constraints.
    """
    if limbs.actuators:
        return _matrix(limbs, limbs.actuators)
    couples = [row for row in limbs.wrenches if row.kind is WrenchKind.COUPLE]
    return _matrix(replace(limbs, wrenches=couples, members=(), loops=()), [])


def _matrix(limbs: Limbs, driven: Sequence[Actuator]) -> SX:
    """Return the sparse matrix (m, c) of rows and members; its last columns belong to the driven joints."""
    # For each row and member: the map of the platform's twist, and the map of the passive rates to subtract.
    parts = [(row.label.member, limbs.about_platform(row), SX(6, 0)) for row in limbs.wrenches]
    for member in limbs.members:
        # A pinned member constrains only the velocity of its centre: v + omega x (centre - p).
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
    """Return the column (k, 1) of a driven joint in the equations of one row or member.

    The column is zero if the joint does not move this row or member.
    """
    return SX(seen.shape[0], 1) if screw is None else -seen @ limbs.twists(screw)


class ScaledRows(NamedTuple):
    """J as rows divided by norms, with moments about the platform's origin divided by a length.

    The product of a leg's row and length is a polynomial of the pose, and so nearer to a linear function than the unit
    row.

    Attributes:
        rows: (m, 6) rows of any norm.
        sizes: (m, 1) positive norms.
    """

    rows: SX
    sizes: SX

    @property
    def jacobian(self) -> SX:
        """J, (m, 6)."""
        return self.rows / ca.repmat(self.sizes, 1, 6)


class Chosen(NamedTuple):
    """Independent equations and screws of a model.

    Attributes:
        equations: indices of the kept loop equations.
        columns: indices of the kept screws of each member.
        rows: indices of the kept equations of each member's nested loops.
        length: factor of rotations in scaled twists, similar to the robot's size.
    """

    equations: Sequence[int]
    columns: Sequence[Sequence[int]]
    rows: Sequence[Sequence[int]]
    length: float


@dataclass(frozen=True, eq=False)
class PosedModel:
    """A model as expressions of the coordinates of a search, with values for its parameters.

    Attributes:
        loops: loop equations, scaled to values of about 1.
        free: indices of the varying pose coordinates; they are the first coordinates of the search.
        limbs: rows, members and actuators, with symbols for the rotation.
        characteristic_length: length that multiplies couples in J.
        rotation: (3, 3) symbols for the rotation R.
        turned: R, ``s R`` and the polynomial ``s`` as expressions of the coordinates.
    """

    loops: Loops
    free: tuple[int, ...]
    limbs: Limbs
    characteristic_length: float
    rotation: SX
    turned: tuple[SX, SX, SX]

    @property
    def z(self) -> SX:
        """Symbols (n, 1) of the coordinates."""
        return self.loops.z

    def plain(self, expression: SX) -> SX:
        """Return an expression of ``limbs``, rewritten as an expression of the search's coordinates."""
        return ca.substitute(expression, self.rotation, self.turned[0])

    def values(self, expression: SX, z: FloatArray) -> FloatArray:
        """Return the value of a matrix of the limbs at a point (n,); for points (n, P), the values side by side."""
        return np.asarray(ca.Function("values", [self.z], [ca.densify(self.plain(expression))])(z).full())

    def reduced(self, chosen: Chosen) -> PosedModel:
        """Return the model with the chosen equations and screws."""
        return replace(self, loops=self.loops.some(chosen.equations), limbs=self.limbs.reduced(*chosen[1:]))

    @property
    def locked(self) -> RankMatrix:
        """The matrix M with locked actuators, without a division in rows that are linear in the rotation."""
        return RankMatrix(self.polynomial(_matrix(self.limbs, [])), 0)

    @property
    def unlocked(self) -> SX:
        """The matrix N with unlocked actuators."""
        return ca.sparsify(self.plain(free_matrix(self.limbs)))

    @property
    def driven_rows(self) -> tuple[SX, SX]:
        """Matrices A (m, n) and D (m, a) of the rate equations ``A y = D u``.

        Here u has the rates of the actuators; y has the platform's twist, then any rates of passive joints. If the
        robot states no actuators, the legs are the actuators: each force row has the rate of one leg.
        """
        limbs = self.limbs
        if limbs.actuators:
            whole = self.polynomial(_matrix(replace(limbs, loops=()), limbs.actuators))
            return whole[:, : -len(limbs.actuators)], -whole[:, -len(limbs.actuators) :]
        legs = [k for k, row in enumerate(limbs.wrenches) if row.kind is WrenchKind.FORCE]
        return self.scaled.rows, ca.diag(self.scaled.sizes)[:, legs]

    @cached_property
    def scaled(self) -> ScaledRows:
        """J with moments about the platform's origin, divided by the length in :class:`Limbs`."""
        L, limbs = SX(self.characteristic_length), self.limbs
        # Rows of forces and couples. The last column is 1, for the factor that turns the rows into polynomials.
        wrenches = [ca.horzcat(limbs.about_platform(row), 1) for row in limbs.wrenches]
        rows = ca.densify(self.polynomial(ca.vertcat(SX(0, 7), *wrenches)))
        factors = [L if row.kind is WrenchKind.COUPLE else SX(1) for row in limbs.wrenches]
        sizes = [rows[i, 6] * ca.sqrt(self.plain(row.square)) / factors[i] for i, row in enumerate(limbs.wrenches)]
        of_members = ca.horzcat(*homogenised(jacobian([], L, limbs.members), limbs.position, limbs.length))
        of_members = self.plain(of_members)
        ones = SX.ones(of_members.shape[0])
        return ScaledRows(ca.vertcat(rows[:, :6], of_members), ca.vertcat(SX(0, 1), *sizes, ones))

    def polynomial(self, matrix: SX) -> SX:
        """Return a matrix (m, c) of the limbs as expressions of the search's coordinates.

        Rows that are linear in the rotation are multiplied by the scale of the rotation, to avoid the division.
        """
        (_, turned, scale), inverse, plain = self.turned, SX.sym("1 / s"), self.plain(matrix)
        whole = ca.substitute(matrix, self.rotation, inverse * turned)
        slopes = ca.reshape(ca.jacobian(ca.densify(whole), inverse), *whole.shape)
        constant = ca.substitute(whole, inverse, 0)
        found = [
            plain[i, :] if ca.depends_on(slopes[i, :], inverse) else constant[i, :] * scale + slopes[i, :]
            for i in range(plain.shape[0])
        ]
        return ca.sparsify(ca.vertcat(SX(0, plain.shape[1]), *found))


def posed_model(case: Case, model: Model, box: PoseBox, z: SX | None = None, errors: SX | None = None) -> PosedModel:
    """Return a model as expressions of the coordinates.

    Args:
        case: case whose dimensions are fixed, or change along the path.
        model: robot of the case; joint-centre errors may follow its parameters.
        box: box of poses.
        z: (n, 1) symbols of the coordinates; new ones if left out.
        errors: (3 m, 1) symbols of the joint-centre errors.
    """
    free, errors = box.free, SX(0, 1) if errors is None else errors
    if z is None:
        z = ca.vertcat(SX(0, 1), *[SX.sym(f"y{k}") for k in free], *[SX.sym(item.name) for item in model.unknowns])
    y = box.symbols(z)
    position, turn = y[:3], y[3 : box.of_pose]
    changing = {name: box.of_pose + k for k, name in enumerate(box.settings)}
    stated = [
        (name, v)
        for item in case.model.parameters
        for name, v in zip(item.components, case.components(item.name), strict=True)
    ]
    # Dimensions that change along the path are coordinates, in the order of the robot's parameters.
    numbers = ca.vertcat(
        SX(0, 1), *[y[changing[name]] if name in changing else SX(sum(ends_of(v)) / 2) for name, v in stated], errors
    )
    values = [sum(ends_of(v)) / 2 for _, v in stated]
    own = Substitution.identity(model)
    given = replace(own, parameters=numbers, unknowns=z[len(free) :], position=position)
    outputs = [
        *[part for row in model.wrenches for part in (row.force, row.moment, row.square)],
        *[part for member in model.members for part in (member.centre, member.screws)],
        *[part for each in model.actuators for part in (each.screws, each.relations)],
        *[each.loops[:, each.passive] for each in model.nested],
    ]
    following = iter(ca.Function("model", own.all, outputs).call(given.all))
    rows = [
        replace(row, force=next(following), moment=next(following), square=next(following)) for row in model.wrenches
    ]
    members = [replace(each, centre=next(following), screws=next(following), slide=None) for each in model.members]
    driven = [replace(each, screws=next(following), relations=next(following)) for each in model.actuators]
    nested = [next(following) for _ in model.nested]
    limbs = Limbs(rows, members, driven, nested, position, 1.0)
    system = loop_system(model, given, (*values, *[0.0] * errors.numel()))
    size = np.concatenate([(0.5 * (box.upper - box.lower))[list(free)], system.sizes])
    turned = rotation_of(box, turn), *polynomial_rotation(box, turn)
    every, positive = (ca.substitute(each, own.rotation, turned[0]) for each in (system.every, system.signs))
    return PosedModel(
        loops=Loops(z, every[: len(model.closure), :], every, positive, size),
        free=free,
        limbs=limbs,
        characteristic_length=case.characteristic_length,
        rotation=own.rotation,
        turned=turned,
    )

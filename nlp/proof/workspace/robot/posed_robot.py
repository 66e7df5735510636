"""A robot with fixed dimensions over a workspace: loop equations and matrices in the coordinates of a search.

The coordinates z are those numbers of a :class:`~.pose_box.PoseBox` that vary, then the robot's unknowns. Equations
that follow from others in this workspace are left out. Of the coordinates as many are *dependent* as there are
equations: all unknowns, and numbers of the pose that a robot with fewer freedoms has no choice of.

Rows that are linear in the rotation R, such as those of straight legs, are multiplied by the s of ``R = (s R) / s`` and
so lose the division: their forms over a box are then exact but for terms of third order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model, Substitution, WrenchKind, frozen_array, jacobian
from .....models.instance import homogenised, sizes_at
from .....models.member import scaled_twists
from .....models.rows import independent_rows
from ....case.case import Case
from ....case.pose import Free
from .closed_loops import Loops, closed_from_home
from .motion_matrix import Limbs, RankMatrix, free_matrix, locked_matrix
from .pose_box import PoseBox, polynomial_rotation, rotation_of

#: Points of the workspace at which the equations that are needed are found, beside its middle, and the part of the
#: workspace, about its middle, in which they lie.
_POINTS, _SPREAD = 4, 0.5
#: Singular values below this part of the largest are zero at the middle of the workspace.
_ZERO = 1e-9
_SEED = 0


class NotJudgedError(ValueError):
    """Error of a robot whose loops or limbs are singular where a search begins; the message is a clause."""


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
        characteristic_length: by which couples are multiplied in J.
        turned: the limbs with ``inverse * s R`` as the rotation.
        inverse: (1, 1) symbol of ``1 / s``.
        scale: (1, 1) ``s``.
        symbols: those of the model.
        given: expressions in their place, and those with ``inverse * s R`` as the rotation.
    """

    z: SX
    free: tuple[int, ...]
    size: FloatArray
    closure: SX
    every: SX
    signs: SX
    limbs: Limbs
    characteristic_length: float
    turned: Limbs
    inverse: SX
    scale: SX
    symbols: list[SX]
    given: tuple[list[SX], list[SX]]

    def loops(self, equations: SX) -> Loops:
        """Return some of the equations as functions of the coordinates."""
        return Loops(self.z, equations, self.every, self.signs, self.size)

    def scaled(self, length: float) -> ScaledRows:
        """Return J with moments about the platform's origin divided by a length."""

        def wrenches(limbs: Limbs) -> SX:
            """Return rows of forces and couples, and 1 in a last column: the factor that makes them polynomials."""
            rows = [
                ca.horzcat(row.force.T, (row.moment - ca.cross(limbs.position, row.force)).T / length, 1)
                for row in limbs.wrenches
            ]
            return ca.vertcat(SX(0, 7), *rows)

        L, limbs = SX(self.characteristic_length), self.limbs
        rows = ca.densify(self.polynomial(wrenches(limbs), wrenches(self.turned)))
        factors = [L if row.kind is WrenchKind.COUPLE else SX(1) for row in limbs.wrenches]
        sizes = [rows[i, 6] * ca.sqrt(row.square) / factors[i] for i, row in enumerate(limbs.wrenches)]
        of_members = ca.horzcat(*homogenised(jacobian([], L, limbs.members), limbs.position, length))
        ones = SX.ones(of_members.shape[0])
        return ScaledRows(ca.vertcat(rows[:, :6], of_members), ca.vertcat(SX(0, 1), *sizes, ones))

    def scaled_points(self, points: SX) -> tuple[SX, SX]:
        """Return points (3 k, 1) in the symbols of the model as expressions of the coordinates, and these times s."""
        function = ca.Function("points", self.symbols, [points])
        plain, turned = (ca.horzcat(function.call(each)[0], SX.ones(points.shape[0])) for each in self.given)
        rows = self.polynomial(plain, turned)
        scaled = [rows[i, 0] * (self.scale if rows[i, 1].is_one() else 1) for i in range(rows.shape[0])]
        return plain[:, 0], ca.vertcat(SX(0, 1), *scaled)

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

    def locked_rows(
        self, columns: tuple[tuple[int, ...], ...], rows: tuple[tuple[int, ...], ...], length: float
    ) -> RankMatrix:
        """Return the matrix with locked actuators, rows that are linear in the rotation without a division.

        Args:
            columns: indices of the screws of each member that are kept.
            rows: indices of the equations of the nested loops of each that are kept.
            length: by which rotations are multiplied.
        """
        plain, turned = (locked_matrix(each.reduced(columns, rows, length)) for each in (self.limbs, self.turned))
        return RankMatrix(self.polynomial(plain, turned), 0)


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot over a workspace.

    Attributes:
        box: the poses.
        z: (n,) symbols of the coordinates.
        free: indices of the pose's numbers, among the six of the box, that are the first coordinates.
        size: (n,) by which coordinates are comparable: of the order of their ranges.
        equations: (k, 1) that hold where the loops are closed.
        independent, dependent: indices of the coordinates, ``n - k`` and k.
        start: (n,) closed loops at the middle of the workspace, or near it.
        locked: rows and members with the actuators locked.
        unactuated: the same with free actuators; None for a robot without constraints.
        scaled: J, moments divided by ``length``.
        length: of the order of the robot's, length.
        needed: indices of the equations among those of the model.
        columns: indices of the screws of each member that are kept.
        rows: indices of the equations of each member's nested loops that are kept.
    """

    box: PoseBox
    z: SX
    free: tuple[int, ...]
    size: FloatArray
    equations: SX
    independent: tuple[int, ...]
    dependent: tuple[int, ...]
    start: FloatArray
    locked: RankMatrix
    unactuated: RankMatrix | None
    scaled: ScaledRows
    length: float
    needed: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]
    rows: tuple[tuple[int, ...], ...]

    @property
    def loops(self) -> Loops:
        """Equations as functions of the coordinates."""
        return Loops(self.z, self.equations, self.equations, SX(0, 1), self.size)

    def pose_of(self, z: FloatArray) -> FloatArray:
        """Return the six coordinates of the pose (..., 6) at points (..., n)."""
        y = np.broadcast_to(0.5 * self.box.lower + 0.5 * self.box.upper, (*z.shape[:-1], 6)).copy()
        y[..., list(self.free)] = z[..., : len(self.free)]
        return y


def build_problem(case: Case, model: Model, box: PoseBox) -> Problem:
    """Return a robot over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions.
        box: the poses.

    Raises:
        NotJudgedError: no closed loops are found in the middle of the workspace, or they leave a joint free.
    """
    posed = posed_model(case, model, box)
    count, loops = len(posed.free), posed.loops(posed.closure)
    middle = np.concatenate([(0.5 * (box.lower + box.upper))[list(posed.free)], np.zeros(posed.z.numel() - count)])
    start = closed_from_home(loops, middle, count)
    if start is None:
        raise NotJudgedError("the loops are not found closed, in the assembly of home, in the middle of the workspace")
    needed = _needed(loops, start, count)
    equations = posed.closure[needed] if needed else SX(0, 1)
    counted = posed.loops(equations)
    dependent = _dependent(counted, start, count)
    # Where numbers of the pose follow from others, the closed loops that were found may be beside a narrow box.
    middle[list(dependent)] = start[list(dependent)]
    moved = counted.all_closed(middle[:, None], list(dependent))[:, 0]
    start = moved if counted.is_closed(moved) else start

    def at_start(expression: SX) -> FloatArray:
        """Return the values of a matrix of expressions."""
        return np.asarray(ca.Function("start", [posed.z], [ca.densify(expression)])(start).full())

    length = _length(posed.limbs, at_start) or float(np.linalg.norm(model.home)) or case.characteristic_length
    # Screws that span the others where they are independent. Those that loops hold still are rounding alone.
    columns = tuple(
        tuple(range(each.rank))
        if each.rank == each.screws.shape[1]
        else _independent(
            at_start(scaled_twists(each.screws, each.centre, SX(length), each.size)).T,
            each.rank,
            f"the passive joints of limb {each.label}",
        )
        for each in posed.limbs.members
    )
    rows = tuple(
        _independent(at_start(each), path.loop_rank, f"the nested loops of limb {path.member}")
        for each, path in zip(posed.limbs.loops, model.nested, strict=True)
    )
    return Problem(
        box=box,
        z=posed.z,
        free=posed.free,
        size=posed.size,
        equations=equations,
        independent=tuple(k for k in range(posed.z.numel()) if k not in dependent),
        dependent=dependent,
        start=frozen_array(start, start.shape),
        locked=posed.locked_rows(columns, rows, length),
        unactuated=_unactuated(model, posed.limbs.reduced(columns, rows, length), at_start),
        scaled=posed.scaled(length),
        length=length,
        needed=tuple(needed),
        columns=columns,
        rows=rows,
    )


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
    position, turn = ca.vertcat(*y[:3]), ca.vertcat(*y[3:])
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    numbers = ca.vertcat(SX(0, 1), *values, errors)
    given = Substitution(numbers, ca.vertcat(SX(0, 1), *unknowns), rotation_of(box, turn), position)
    every = (*model.closure, *model.loops)
    outputs = [
        *[part for row in model.wrenches for part in (row.force, row.moment, row.square)],
        *[part for member in model.members for part in (member.centre, member.screws)],
        *[part for each in model.actuators for part in (each.screws, each.relations)],
        *[each.loops[:, each.passive] for each in model.nested],
        *[each.value for each in model.signs],
        *[each.expression for each in every],
    ]
    symbols = Substitution.identity(model).all
    function = ca.Function("model", symbols, outputs)

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
    polynomial, scale = polynomial_rotation(box, turn)
    inverse = SX.sym("inverse")
    turned = replace(given, rotation=inverse * polynomial)
    signs = ca.vertcat(SX(0, 1), *[next(following) for _ in model.signs])
    sizes = sizes_at(
        model, (*every, *model.unknowns), (*values, *[0.0] * errors.numel()), SX.ones(len(every) + len(model.unknowns))
    )
    scaled = [next(following) / sizes[k] for k in range(len(every))]
    ranges = (0.5 * (box.upper - box.lower))[list(free)]
    return PosedModel(
        z=ca.vertcat(SX(0, 1), *[y[k] for k in free], *unknowns),
        free=free,
        size=np.concatenate([ranges, np.array(ca.DM(sizes[len(every) :, :])).ravel()]),
        closure=ca.vertcat(SX(0, 1), *scaled[: len(model.closure)]),
        every=ca.vertcat(SX(0, 1), *scaled),
        signs=signs,
        limbs=limbs,
        characteristic_length=case.characteristic_length,
        turned=limbs_of(iter(function.call(turned.all))),
        inverse=inverse,
        scale=scale,
        symbols=symbols,
        given=(given.all, turned.all),
    )


def _needed(loops: Loops, start: FloatArray, count: int) -> list[int]:
    """Return the indices of the equations that do not follow from others in the workspace."""
    if not loops.count:
        return []
    rng = np.random.default_rng(_SEED)
    slopes = [loops.slopes(start[:, None])[0] * loops.size]
    for _ in range(_POINTS):
        z = start.copy()
        z[:count] += _SPREAD * loops.size[:count] * rng.uniform(-1, 1, count)
        found = loops.closed(z, list(range(count, len(z)))) if len(z) > count else z
        if found is None or not loops.is_closed(found):
            found = loops.closed(z, list(range(len(z))))
        if found is not None and loops.is_closed(found):
            slopes.append(loops.slopes(found[:, None])[0] * loops.size)
    if not any(np.abs(each).max() > _ZERO for each in slopes):
        return []
    return sorted(independent_rows(slopes))


def _dependent(loops: Loops, start: FloatArray, count: int) -> tuple[int, ...]:
    """Return the coordinates that the equations determine: all unknowns, then numbers of the pose.

    Raises:
        NotJudgedError: the equations leave an unknown free.
    """
    n, k = len(start), loops.count
    unknowns = list(range(count, n))
    if k < len(unknowns):
        raise NotJudgedError("the loops leave a passive joint free")
    if not k:
        return ()
    slopes = loops.slopes(start[:, None])[0] * loops.size
    left = slopes[:, :count]
    if unknowns:
        basis, values, _ = np.linalg.svd(slopes[:, unknowns])
        if not values[-1] > _ZERO * values[0]:
            raise NotJudgedError("the loops leave a passive joint free in the middle of the workspace")
        left = basis[:, len(unknowns) :].T @ left
    return (*_independent(left.T, k - len(unknowns), "the loops"), *unknowns)


def _independent(values: FloatArray, rank: int, what: str) -> tuple[int, ...]:
    """Return the indices of as many rows of a matrix as have its rank.

    Raises:
        NotJudgedError: they have another rank.
    """
    chosen = independent_rows([values]) if rank else ()
    if len(chosen) != rank:
        raise NotJudgedError(f"{what} are singular in the middle of the workspace")
    return tuple(sorted(chosen))


def _length(limbs: Limbs, at_start: Callable[[SX], FloatArray]) -> float:
    """Return the median arm of rows and screws about the platform's origin; 0 where they have none."""
    p = limbs.position
    pairs = [(ca.norm_2(r.moment - ca.cross(p, r.force)), ca.norm_2(r.force)) for r in limbs.wrenches]
    for member in limbs.members:
        for j in range(member.screws.shape[1]):
            omega, v = member.screws[:3, j], member.screws[3:, j]
            pairs.append((ca.norm_2(v + ca.cross(omega, p)), ca.norm_2(omega)))
    values = at_start(ca.horzcat(*[ca.vertcat(*each) for each in pairs]))
    arms = [a / b for a, b in values.T if a > _ZERO and b > _ZERO]
    return float(np.median(arms)) if arms else 0.0


def _unactuated(model: Model, limbs: Limbs, at_start: Callable[[SX], FloatArray]) -> RankMatrix | None:
    """Return rows and members with free actuators; None for a robot without constraints."""
    if (model.generic is not None and model.generic.constraints == 0) or (not limbs.actuators and model.members):
        return None
    matrix = free_matrix(limbs)
    if not matrix.numel():
        return None
    values = np.linalg.svd(at_start(matrix), compute_uv=False)
    freedoms, idle = matrix.shape[1] - int(np.count_nonzero(values > _ZERO * values[0])), 0
    if model.generic is not None:
        freedoms, idle = 6 - model.generic.constraints, model.generic.idle
    return RankMatrix(matrix, freedoms + idle) if 0 < freedoms < 6 else None

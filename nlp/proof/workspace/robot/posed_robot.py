"""A robot with fixed dimensions over a workspace: loop equations and matrices in the coordinates of a search.

The coordinates z are those numbers of a :class:`~.pose_box.PoseBox` that vary, then the robot's unknowns. Equations
that follow from others in this workspace are left out. Of the coordinates as many are *dependent* as there are
equations: all unknowns, and some numbers of the pose of a robot with fewer freedoms.

Where every machine within a tolerance on joint centres is meant, the errors of each centre are three further
coordinates, with the design's choice of equations and screws. They are never bisected: an expression's linear part in
the error of a centre, a vector, changes it by at most the vector's length times the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model, frozen_array
from .....models.member import scaled_twists
from .....models.rows import independent_rows
from ....case.case import Case
from ....case.workspace import TurnKind
from ....evidence.closed_loops import DEPENDENT, Loops, closed_from_home
from ....program.layout import robot_length
from ...statement.machine import INSIDE, JointErrors
from ...statement.tolerance import BuiltModel
from .path_cover import PathCover
from .pose_box import PoseBox
from .posed_model import Chosen, PosedModel, RankMatrix, posed_model

#: Points of the workspace at which the equations that are needed are found, beside its middle, and number of machines
#: in which those that were left out are tested.
_POINTS = 4
#: Part of the workspace, about its middle, in which these points lie, and errors of the machines in parts of the
#: robot's length.
_SPREAD, _OFF = 0.5, 1e-2
#: Largest residual of an equation of order 1 that follows from others.
_CLOSED = 1e-9
#: Singular values below this part of the largest are zero.
_ZERO = 1e-9
_SEED = 0
#: Parts of a length, or radians, by which a number of the pose is moved at most where an equation that was left out is
#: tested, and the largest change of its left side then: several roundings.
_NEAR, _ROUNDING = 1e-3, 1e-12


class NotJudgedError(ValueError):
    """Error of a robot whose loops or limbs are singular where a search begins; the message is a clause."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot over a workspace: the design, or every machine within a tolerance.

    Attributes:
        box: the poses.
        loops: k equations in the coordinates; errors are the last ones.
        free: indices of the pose's numbers, among those of the box, that are the first coordinates.
        independent, dependent: indices of the coordinates of the design, of which k are dependent.
        start: (n,) closed loops of the design at the middle of the workspace, or near it.
        locked: rows and members with the actuators locked.
        unactuated: the same with free actuators; None for a robot without constraints.
        posed: its limbs, with the loops of the design or of the machines.
        chosen: what is kept of the model.
        names: of the m joint centres whose errors are coordinates.
        tolerance: largest size of each error, length.
        design: the design alone, of all machines.
        cover: of the path that is meant; None for the whole box.
        rates: indices of the coordinates that are rates, by seconds, of the pose in the path's motion: those of
            :attr:`rated`, or none.
        resting: the design without rates, of a design with them.
    """

    box: PoseBox
    loops: Loops
    free: tuple[int, ...]
    independent: tuple[int, ...]
    dependent: tuple[int, ...]
    start: FloatArray
    locked: RankMatrix
    unactuated: RankMatrix | None
    posed: PosedModel = field(repr=False)
    chosen: Chosen
    names: tuple[str, ...] = ()
    tolerance: float = 0.0
    design: Problem | None = field(default=None, repr=False)
    cover: PathCover | None = None
    rates: tuple[int, ...] = ()
    resting: Problem | None = field(default=None, repr=False)

    @property
    def problem(self) -> Problem:
        """The design alone."""
        return self.design or self

    @property
    def has_following(self) -> bool:
        """Whether numbers of the pose follow from others, so that each machine has its own."""
        return bool(self.box.dependent)

    @property
    def stated(self) -> list[int]:
        """Indices of the coordinates that are independent ones of the pose."""
        return [j for j, k in enumerate(self.free) if k not in self.box.dependent]

    @property
    def length(self) -> float:
        """A length of the order of the robot's."""
        return self.chosen.length

    @property
    def z(self) -> SX:
        """Symbols (n, 1) of the coordinates."""
        return self.loops.z

    @property
    def size(self) -> FloatArray:
        """Sizes (n,) by which coordinates are comparable: of the order of their ranges."""
        return self.loops.size

    @property
    def equations(self) -> SX:
        """Equations (k, 1) that hold where the loops are closed."""
        return self.loops.equations

    @property
    def of_errors(self) -> list[int]:
        """Indices of the errors among the coordinates."""
        return list(range(len(self.start) - 3 * len(self.names), len(self.start)))

    @property
    def errors(self) -> SX:
        """Symbols (3 m, 1) of the errors."""
        # With both indices a column stays one where it is empty.
        return self.z[len(self.start) - 3 * len(self.names) :, :]

    @property
    def rated(self) -> list[int]:
        """Rates that a path has, among those of :meth:`.path_cover.PathCover.rates`."""
        stated = [self.free[j] for j in self.stated]
        turns = [k for k in stated if k >= 3]
        if turns and self.box.kind is not TurnKind.ROLL_PITCH_YAW:
            turns = [3, 4, 5]
        return [k for k in stated if k < 3] + turns

    @property
    def of_path(self) -> list[int]:
        """Indices of the coordinates that a place of a path determines."""
        return [*self.stated, *self.rates]

    def path_boxes(
        self, cover: PathCover, pieces: FloatArray, within: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, c) of these coordinates over pieces (B, 3) of a path; see :meth:`.PathCover.boxes`."""
        low, high = (each[:, [self.free[j] for j in self.stated]] for each in cover.boxes(pieces, within))
        if self.rates:
            slow, fast = (each[:, self.rated] for each in cover.rates(pieces))
            low, high = np.hstack([low, slow]), np.hstack([high, fast])
        return low, high

    def path_points(self, cover: PathCover, pieces: FloatArray, part: float) -> FloatArray:
        """Return these coordinates (B, c) at computed points of pieces."""
        s = pieces[:, 1] + part * (pieces[:, 2] - pieces[:, 1])
        low, high = self.path_boxes(cover, np.stack([pieces[:, 0], s, s], axis=1), pieces)
        return 0.5 * low + 0.5 * high

    def pose_of(self, z: FloatArray) -> FloatArray:
        """Return all coordinates of the pose (..., c) at points (..., n)."""
        y = np.broadcast_to(0.5 * self.box.lower + 0.5 * self.box.upper, (*z.shape[:-1], len(self.box.lower))).copy()
        y[..., list(self.free)] = z[..., : len(self.free)]
        return y

    def exact(self, z: FloatArray) -> FloatArray:
        """Return the coordinates (..., n) of the design at points of the design alone."""
        return np.concatenate([z, np.zeros((*z.shape[:-1], len(self.of_errors)))], axis=-1)

    def errors_of(self, z: FloatArray) -> JointErrors:
        """Return the errors of the machine at a point (n,)."""
        own = z[self.of_errors].reshape(-1, 3)
        return JointErrors(self.names, frozen_array(own, own.shape))

    def with_errors(self, z: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return points (P, n) with errors as large as the tolerance along derivatives (P, 3 m)."""
        z = z.copy()
        z[:, self.of_errors] = steepest(slopes.reshape(len(z), -1, 3), self.tolerance).reshape(len(z), -1)
        return z

    def within(self, z: FloatArray) -> FloatArray:
        """Return points (..., n) with the pose moved into the workspace, and the errors into the tolerance."""
        z = z.copy()
        y = self.pose_of(z)
        y = self.box.clipped(y.reshape(-1, y.shape[-1])).reshape(y.shape)
        z[..., : len(self.free)] = y[..., list(self.free)]
        errors = z[..., self.of_errors].reshape(*z.shape[:-1], len(self.names), 3)
        sizes, most = np.linalg.norm(errors, axis=-1, keepdims=True), INSIDE * self.tolerance
        inside = errors * np.minimum(1.0, most / np.maximum(sizes, max(most, np.finfo(float).tiny)))
        z[..., self.of_errors] = inside.reshape(*z.shape[:-1], len(self.of_errors))
        return z


def build_problem(
    case: Case,
    model: Model,
    box: PoseBox,
    at: FloatArray | None = None,
    near: Callable[[], FloatArray | None] = lambda: None,
) -> Problem:
    """Return a robot over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions.
        box: the poses.
        at: (c,) coordinates of the pose at which closed loops are looked for; the middle of the workspace if left out.
        near: returns positions of the unknowns there, in the assembly of home; None where they are not known. It is
            called where the straight way from those at home does not lead there.

    Raises:
        NotJudgedError: no closed loops are found there, or they leave a joint free.
    """
    posed = posed_model(case, model, box)
    loops, count = posed.loops, len(posed.free)
    at = 0.5 * (box.lower + box.upper) if at is None else at
    middle = np.concatenate([at[list(posed.free)], np.zeros(len(loops.size) - count)])
    start = closed_from_home(loops, middle, count)
    if start is None and (unknowns := near()) is not None:
        middle[count:] = unknowns
        start = loops.all_closed(middle[:, None], range(count, len(middle)), zero=DEPENDENT)[:, 0]
        start = start if loops.is_closed(start) else None
    if start is None:
        raise NotJudgedError("the loops could not be closed in the assembly of home in the middle of the workspace")
    needed = _needed(loops, start, count)
    loops = loops.some(needed)
    dependent = _dependent(loops, start, posed.free, box)
    # Where numbers of the pose follow from others, the closed loops that were found may be beside a narrow box.
    middle[list(dependent)] = start[list(dependent)]
    moved = loops.all_closed(middle[:, None], dependent)[:, 0]
    start = moved if loops.is_closed(moved) else start
    size = robot_length(case)
    _check_left_out(loops, start, dependent, box, size)
    chosen = _chosen(posed, model, start, needed, size)
    posed = posed.reduced(chosen)
    return Problem(
        box=box,
        loops=posed.loops,
        free=posed.free,
        independent=tuple(k for k in range(len(start)) if k not in dependent),
        dependent=dependent,
        start=frozen_array(start, start.shape),
        locked=posed.locked,
        unactuated=_unactuated(model, posed, start),
        posed=posed,
        chosen=chosen,
    )


def _check_left_out(loops: Loops, start: FloatArray, dependent: tuple[int, ...], box: PoseBox, length: float) -> None:
    """Refuse a robot with a loop equation that was left out and does not hold where a number of the pose moves.

    An equation of a number that hardly changes in a narrow workspace counts as one that follows from others.

    Raises:
        NotJudgedError: an equation does not hold.
    """
    own = [j for j in range(len(box.free)) if j not in dependent]
    if loops.every.numel() == loops.count or not own:
        return
    # Each number alone, to both ends of its range, or so near that the loops stay in their assembly.
    points = np.repeat(start[:, None], 2 * len(own), axis=1)
    for k, j in enumerate(own):
        at, near = box.free[j], _NEAR * (length if box.free[j] < 3 else 1.0)
        points[j, 2 * k : 2 * k + 2] = np.clip([box.lower[at], box.upper[at]], start[j] - near, start[j] + near)
    moved = loops.all_closed(points, dependent) if dependent else points
    # Constants of a robot that should be 0 may be rounding of its numbers.
    if (np.abs(loops.every_value(moved) - loops.every_value(start[:, None])) > _ROUNDING).any():
        raise NotJudgedError("its loops do not close all over the workspace: the platform cannot move in all numbers")


def family_of(case: Case, built: BuiltModel, design: Problem, tolerance: float) -> Problem:
    """Return all machines within a tolerance on joint centres; the design as the only one where there are no errors.

    Args:
        case: with fixed dimensions.
        built: its robot with errors.
        design: its robot over a workspace.
        tolerance: largest error of each joint centre, length.

    Raises:
        NotJudgedError: the machines do not have the freedoms that the design has over the workspace.
    """
    errors = ca.vertcat(SX(0, 1), *[SX.sym(f"e{k}", 3) for k in range(len(built.names))])
    whole = posed_model(case, built.model, design.box, design.z, errors)
    posed, free = whole.reduced(design.chosen), design.unactuated
    loops, size = posed.loops, np.concatenate([design.size, np.full(errors.numel(), tolerance)])
    family = replace(
        design,
        loops=Loops(ca.vertcat(design.z, errors), loops.equations, loops.every, loops.signs, size),
        start=np.concatenate([design.start, np.zeros(errors.numel())]),
        locked=posed.locked,
        unactuated=None if free is None else RankMatrix(posed.unlocked, free.nullity),
        posed=posed,
        names=built.names,
        tolerance=tolerance,
        design=design,
    )
    if built.names:
        _check_freedoms(family, whole)
    return family


def _check_freedoms(family: Problem, whole: PosedModel) -> None:
    """Refuse machines in which equations or screws that were left out do not follow from the others.

    Raises:
        NotJudgedError: they do not follow at random errors.
    """
    loops, own, errors = family.loops, list(family.independent), family.of_errors
    members = [each for each in whole.limbs.members if each.rank < each.screws.shape[1]]
    columns = [whole.plain(scaled_twists(each.screws, each.centre, SX(family.length), each.size)) for each in members]
    function = ca.Function("every", [family.z], [ca.densify(each) for each in (loops.every, *columns)])
    rng = np.random.default_rng(_SEED)
    for _ in range(_POINTS):
        # At home every machine closes, whatever its errors.
        z = family.start.copy()
        z[own] += _SPREAD * family.size[own] * rng.uniform(-1, 1, len(own))
        z[errors] = _OFF * family.length * rng.uniform(-1, 1, len(errors))
        found = loops.all_closed(z[:, None], family.dependent)[:, 0]
        if not np.isfinite(found).all():
            raise NotJudgedError("the loops do not close with errors of joint centres in the middle of the workspace")
        every, *screws = (np.array(each) for each in function.call([ca.DM(found)]))
        if float(np.abs(every).max(initial=0.0)) > _CLOSED:
            fault = "with errors of joint centres the robot does not have the poses of the workspace exactly"
            raise NotJudgedError(f"{fault}: state ranges for its dependent numbers of the pose")
        if any(_rank_of(values) != member.rank for member, values in zip(members, screws, strict=True)):
            raise NotJudgedError("errors of joint centres take freedoms from the robot: its limbs change")


def _needed(loops: Loops, start: FloatArray, count: int) -> tuple[int, ...]:
    """Return the indices of the equations that do not follow from others in the workspace."""
    if not loops.count:
        return ()
    rng = np.random.default_rng(_SEED)
    slopes = [loops.slopes(start[:, None])[0] * loops.size]
    for _ in range(_POINTS):
        z = start[:, None].copy()
        z[:count, 0] += _SPREAD * loops.size[:count] * rng.uniform(-1, 1, count)
        every = (loops.all_closed(z, range(begin, len(z)), zero=DEPENDENT) for begin in (count, 0))
        found = next((each for each in every if loops.is_closed(each[:, 0])), None)
        slopes += [] if found is None else [loops.slopes(found)[0] * loops.size]
    if not any(np.abs(each).max() > _ZERO for each in slopes):
        return ()
    return tuple(sorted(independent_rows(slopes)))


def _dependent(loops: Loops, start: FloatArray, free: Sequence[int], box: PoseBox) -> tuple[int, ...]:
    """Return the coordinates that the equations determine: dependent ones of the pose, and all unknowns.

    Raises:
        NotJudgedError: the equations leave an unknown free, or determine other coordinates of the pose.
    """
    count = len(free)
    unknowns, k = list(range(count, len(start))), loops.count
    following = [j for j, index in enumerate(free) if index in box.dependent]
    if k < len(unknowns):
        raise NotJudgedError("the pose does not determine every joint")
    if k != len(unknowns) + len(following):
        raise NotJudgedError("the platform cannot choose all coordinates of the pose that are stated")
    if not k:
        return ()
    slopes = loops.slopes(start[:, None])[0] * loops.size
    if unknowns:
        values = np.linalg.svd(slopes[:, unknowns], compute_uv=False)
        if not values[-1] > _ZERO * values[0]:
            raise NotJudgedError("the pose does not determine every joint in the middle of the workspace")
    values = np.linalg.svd(slopes[:, [*following, *unknowns]], compute_uv=False)
    if not values[-1] > _ZERO * values[0]:
        raise NotJudgedError("the loops are singular in the middle of the workspace")
    return (*following, *unknowns)


def _chosen(posed: PosedModel, model: Model, start: FloatArray, needed: tuple[int, ...], otherwise: float) -> Chosen:
    """Return what is kept with some equations: screws that span the others where they are independent, and a length.

    Screws that loops hold still are rounding alone.

    Raises:
        NotJudgedError: the screws or the nested loops of a limb are singular at the start.
    """
    length = _length(posed, start, otherwise) or float(np.linalg.norm(model.home)) or otherwise
    columns, rows = [], []
    for each in posed.limbs.members:
        kept = tuple(range(each.rank))
        if each.rank < each.screws.shape[1]:
            values = posed.values(scaled_twists(each.screws, each.centre, SX(length), each.size), start)
            kept = _independent(values.T, each.rank, f"the passive joints of limb {each.label}")
        columns.append(kept)
    for equations, path in zip(posed.limbs.loops, model.nested, strict=True):
        values = posed.values(equations, start)
        rows.append(_independent(values, path.loop_rank, f"the nested loops of limb {path.member}"))
    return Chosen(needed, columns, rows, length)


def _independent(values: FloatArray, rank: int, what: str) -> tuple[int, ...]:
    """Return the indices of as many rows of a matrix as have its rank.

    Raises:
        NotJudgedError: they have another rank.
    """
    chosen = independent_rows([values]) if rank else ()
    if len(chosen) != rank:
        raise NotJudgedError(f"{what} are singular in the middle of the workspace")
    return tuple(sorted(chosen))


def _length(posed: PosedModel, start: FloatArray, size: float) -> float:
    """Return the median arm of rows and screws about the platform's origin; 0 where they have none beside a size."""
    lines = [(row.force, row.moment) for row in posed.limbs.wrenches]
    lines += [(screw[:3], screw[3:]) for each in posed.limbs.members for screw in ca.horzsplit(each.screws)]
    pairs = [
        ca.vertcat(ca.norm_2(moment - ca.cross(posed.limbs.position, along)), ca.norm_2(along))
        for along, moment in lines
    ]
    values = posed.values(ca.horzcat(SX(2, 0), *pairs), start)
    directions = _ZERO * float(values[1].max(initial=0.0))
    arms = [a / b for a, b in values.T if b > directions and a > _ZERO * size * b]
    return float(np.median(arms)) if arms else 0.0


def _unactuated(model: Model, posed: PosedModel, start: FloatArray) -> RankMatrix | None:
    """Return rows and members with free actuators; None for a robot without constraints."""
    generic, limbs = model.generic, posed.limbs
    if (generic is not None and generic.constraints == 0) or (not limbs.actuators and model.members):
        return None
    matrix = posed.unlocked
    if not matrix.numel():
        return None
    if generic is not None:
        freedoms, idle = 6 - generic.constraints, generic.idle
    else:
        # Any pose of a robot given by rows is closed, and the middle may be singular.
        away = np.random.default_rng(_SEED).uniform(-_SPREAD, _SPREAD, (_POINTS, len(start))) * (not model.unknowns)
        every = posed.values(matrix, (start + away * posed.loops.size).T)
        freedoms, idle = matrix.shape[1] - max(map(_rank_of, np.hsplit(every, _POINTS))), 0
    return RankMatrix(matrix, freedoms + idle) if 0 < freedoms < 6 else None


def _rank_of(values: FloatArray) -> int:
    """Return the rank of a matrix of numbers."""
    sizes = np.linalg.svd(values, compute_uv=False)
    return int(np.count_nonzero(sizes > _ZERO * sizes[0]))


def steepest(slopes: FloatArray, tolerance: float) -> FloatArray:
    """Return errors (..., 3) as large as a tolerance along derivatives by them; none along derivatives of zero."""
    sizes = np.linalg.norm(slopes, axis=-1, keepdims=True)
    # A sum with zero has no negative zero.
    return np.asarray(INSIDE * tolerance * slopes / np.maximum(sizes, np.finfo(float).tiny) + 0.0)

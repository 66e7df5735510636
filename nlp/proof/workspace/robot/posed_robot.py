"""A robot with fixed dimensions over a workspace: loop equations and matrices in the coordinates of a search.

The coordinates z are the varying coordinates of a :class:`~.pose_box.PoseBox`, then the robot's unknowns. Equations
that follow from others in this workspace are left out. Each remaining equation determines one *dependent* coordinate.
The dependent coordinates are all unknowns and, if the robot has fewer than six degrees of freedom, some coordinates of
the pose.

For all robots within the joint-centre tolerance, three errors of each centre are additional coordinates, with the
nominal robot's choice of equations and screws. Errors are never bisected: with the gradient g with respect to the error
of one joint centre, this error changes an expression by at most ``|g|`` times the tolerance.
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
from ...statement.fixed_robot import INSIDE, JointErrors
from ...statement.tolerance import BuiltModel
from .path_cover import PathCover
from .pose_box import PoseBox
from .posed_model import Chosen, PosedModel, RankMatrix, posed_model

#: Number of points of the workspace, besides its centre, at which independent equations are chosen; and number of
#: robots with joint-centre errors for which the omitted equations are tested.
_POINTS = 4
#: Fraction of the workspace, about its centre, that contains these points; and joint-centre errors relative to the
#: robot's size.
_SPREAD, _OFF = 0.5, 1e-2
#: Largest residual of a dependent equation; equations are scaled to values of about 1.
_CLOSED = 1e-9
#: Relative singular value that counts as zero.
_ZERO = 1e-9
_SEED = 0
#: Largest change of a pose coordinate (relative to a length, or radians) in the test of an omitted equation; and
#: largest change of the left side of this equation: several roundings.
_NEAR, _ROUNDING = 1e-3, 1e-12


class NotJudgedError(ValueError):
    """Error of a robot that cannot be judged, for example because its loops are singular at the start.

    The message is a clause.
    """


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot over a workspace: the nominal robot, or all robots within the tolerance.

    Attributes:
        box: box of poses.
        loops: k loop equations as expressions of the coordinates; joint-centre errors are the last coordinates.
        free: indices, in the box, of the varying pose coordinates; they are the first coordinates of the problem.
        independent, dependent: indices of the independent and of the k dependent coordinates of the nominal robot.
        start: (n,) point of the nominal robot with closed loops, at or near the middle of the workspace.
        locked: matrix that has full column rank where J has full rank: rows of J, and screws of the passive joints.
        unactuated: the same matrix with screws of the actuated joints, too: its rank shows whether the constraint
            wrenches keep their rank. None for a robot without constraints.
        posed: limbs and loop equations of the nominal robot, or of the robots within the tolerance.
        chosen: independent equations and screws of the model.
        names: names of the m joint centres whose errors are coordinates.
        tolerance: largest norm of each joint-centre error, length.
        design: the nominal robot, if this problem covers all robots within the tolerance; None otherwise.
        cover: boxes of the path; None for a box of poses.
        rates: indices of the coordinates that are rates of the pose along the path, per second, see :attr:`rated`;
            empty without rates.
        resting: the same robot without rates as coordinates, if this problem has rates; None otherwise.
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
        """The nominal robot."""
        return self.design or self

    @property
    def has_following(self) -> bool:
        """Whether the pose has dependent coordinates, which differ between robots within the tolerance."""
        return bool(self.box.dependent)

    @property
    def stated(self) -> list[int]:
        """Indices of the independent coordinates of the pose."""
        return [j for j, k in enumerate(self.free) if k not in self.box.dependent]

    @property
    def length(self) -> float:
        """Characteristic size of the robot, length."""
        return self.chosen.length

    @property
    def z(self) -> SX:
        """Symbols (n, 1) of the coordinates."""
        return self.loops.z

    @property
    def size(self) -> FloatArray:
        """Scales (n,) of the coordinates: about the width of their ranges."""
        return self.loops.size

    @property
    def equations(self) -> SX:
        """Loop equations (k, 1): expressions that are 0 where the loops are closed."""
        return self.loops.equations

    @property
    def of_errors(self) -> list[int]:
        """Indices of the errors among the coordinates."""
        return list(range(len(self.start) - 3 * len(self.names), len(self.start)))

    @property
    def errors(self) -> SX:
        """Symbols (3 m, 1) of the errors."""
        # Both indices keep an empty column a column.
        return self.z[len(self.start) - 3 * len(self.names) :, :]

    @property
    def rated(self) -> list[int]:
        """Indices, in :meth:`.path_cover.PathCover.rates`, of the rates that vary along a path."""
        stated, of_pose = [self.free[j] for j in self.stated], self.box.of_pose
        turns, settings = [k for k in stated if 3 <= k < of_pose], [6 + k - of_pose for k in stated if k >= of_pose]
        if turns and self.box.kind is not TurnKind.ROLL_PITCH_YAW:
            turns = [3, 4, 5]
        return [k for k in stated if k < 3] + turns + settings

    @property
    def of_settings(self) -> list[int]:
        """Indices of the coordinates that are dimensions which change along a path."""
        return [j for j, k in enumerate(self.free) if k >= self.box.of_pose]

    @property
    def of_path(self) -> list[int]:
        """Indices of the coordinates that a place on a path determines."""
        return [*self.stated, *self.rates]

    def path_boxes(
        self, cover: PathCover, pieces: FloatArray, within: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, c) of :attr:`of_path` over pieces (B, 3) of a path; see :meth:`.PathCover.boxes`."""
        low, high = (each[:, [self.free[j] for j in self.stated]] for each in cover.boxes(pieces, within))
        if self.rates:
            slow, fast = (each[:, self.rated] for each in cover.rates(pieces))
            low, high = np.hstack([low, slow]), np.hstack([high, fast])
        return low, high

    def path_points(self, cover: PathCover, pieces: FloatArray, part: float) -> FloatArray:
        """Return the coordinates :attr:`of_path`, (B, c), at computed points of pieces."""
        s = pieces[:, 1] + part * (pieces[:, 2] - pieces[:, 1])
        low, high = self.path_boxes(cover, np.stack([pieces[:, 0], s, s], axis=1), pieces)
        return 0.5 * low + 0.5 * high

    def pose_of(self, z: FloatArray) -> FloatArray:
        """Return all coordinates of the pose (..., c) at points (..., n)."""
        y = np.broadcast_to(0.5 * self.box.lower + 0.5 * self.box.upper, (*z.shape[:-1], len(self.box.lower))).copy()
        y[..., list(self.free)] = z[..., : len(self.free)]
        return y

    def exact(self, z: FloatArray) -> FloatArray:
        """Return points (..., n) of this problem with errors of 0, from points of the nominal robot."""
        return np.concatenate([z, np.zeros((*z.shape[:-1], len(self.of_errors)))], axis=-1)

    def errors_of(self, z: FloatArray) -> JointErrors:
        """Return the joint-centre errors at a point (n,)."""
        own = z[self.of_errors].reshape(-1, 3)
        return JointErrors(self.names, frozen_array(own, own.shape))

    def with_errors(self, z: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return points (P, n) with joint-centre errors along derivatives (P, 3 m), with the tolerance as norm."""
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
    """Return the nominal robot of a case over a workspace, with closed loops at the start pose.

    Args:
        case: case with fixed dimensions.
        model: robot of the case; some unknowns may be replaced by closed forms.
        box: box of poses.
        at: (c,) coordinates of the start pose, where the loops are closed: the first pose of a path; the centre of the
            workspace if left out.
        near: function that returns the unknowns at the start pose in the home assembly mode; None if they are not
            known. The function is called if the straight motion from home does not reach the start pose.

    Raises:
        NotJudgedError: the loops do not close at the start pose, or leave a joint free.
    """
    posed = posed_model(case, model, box)
    loops, count = posed.loops, len(posed.free)
    where = "workspace centre" if at is None else "first pose of the path"
    at = box.middle if at is None else at
    middle = np.concatenate([at[list(posed.free)], np.zeros(len(loops.size) - count)])
    start = closed_from_home(loops, middle, count)
    if start is None and (unknowns := near()) is not None:
        middle[count:] = unknowns
        start = loops.all_closed(middle[:, None], range(count, len(middle)), zero=DEPENDENT)[:, 0]
        start = start if loops.is_closed(start) else None
    if start is None:
        raise NotJudgedError(f"found no solution of the loop equations in the home assembly mode at the {where}")
    needed = _needed(loops, start, count)
    loops = loops.some(needed)
    dependent = _dependent(loops, start, posed.free, box)
    # With dependent coordinates of the pose, the start point may lie outside of a narrow box.
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
    """Check that omitted loop equations stay satisfied when pose coordinates move.

    In a narrow workspace, an equation whose coordinate hardly changes looks as if it depended on other equations.

    Raises:
        NotJudgedError: an equation does not hold.
    """
    own = [j for j in range(len(box.free)) if j not in dependent]
    if loops.every.numel() == loops.count or not own:
        return
    # Each coordinate by itself, to both ends of its range, or so near that the assembly mode stays the same.
    points = np.repeat(start[:, None], 2 * len(own), axis=1)
    for k, j in enumerate(own):
        at, near = box.free[j], _NEAR * (length if box.free[j] < 3 else 1.0)
        points[j, 2 * k : 2 * k + 2] = np.clip([box.lower[at], box.upper[at]], start[j] - near, start[j] + near)
    moved = loops.all_closed(points, dependent) if dependent else points
    # Constants of a robot that should be 0 may be rounding errors.
    if (np.abs(loops.every_value(moved) - loops.every_value(start[:, None])) > _ROUNDING).any():
        raise NotJudgedError(
            "the robot's loops do not close at every pose of the workspace: "
            "the robot cannot choose all pose coordinates with ranges independently"
        )


def family_of(case: Case, built: BuiltModel, design: Problem, tolerance: float) -> Problem:
    """Return all robots within the joint-centre tolerance over a workspace; the nominal robot if there are no errors.

    Args:
        case: case with fixed dimensions.
        built: robot of the case with joint-centre errors.
        design: nominal robot of the case over the workspace.
        tolerance: largest error of each joint centre, length.

    Raises:
        NotJudgedError: joint-centre errors remove degrees of freedom that the nominal robot has over the workspace.
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
    """Check that omitted equations and screws also depend on the kept ones with joint-centre errors.

    Raises:
        NotJudgedError: omitted equations or screws are independent for random joint-centre errors.
    """
    loops, own, errors = family.loops, list(family.independent), family.of_errors
    members = [each for each in whole.limbs.members if each.rank < each.screws.shape[1]]
    columns = [whole.plain(scaled_twists(each.screws, each.centre, SX(family.length), each.size)) for each in members]
    function = ca.Function("every", [family.z], [ca.densify(each) for each in (loops.every, *columns)])
    rng = np.random.default_rng(_SEED)
    for _ in range(_POINTS):
        # At home the loops close with any errors.
        z = family.start.copy()
        z[own] += _SPREAD * family.size[own] * rng.uniform(-1, 1, len(own))
        z[errors] = _OFF * family.length * rng.uniform(-1, 1, len(errors))
        found = loops.all_closed(z[:, None], family.dependent)[:, 0]
        if not np.isfinite(found).all():
            raise NotJudgedError(
                "with joint-centre errors, the loops of the robot do not close at the workspace centre"
            )
        every, *screws = (np.array(each) for each in function.call([ca.DM(found)]))
        if float(np.abs(every).max(initial=0.0)) > _CLOSED:
            fault = "with joint-centre errors the robot does not reach the poses of the workspace exactly"
            raise NotJudgedError(f"{fault}: state ranges for its dependent coordinates")
        if any(_rank_of(values) != member.rank for member, values in zip(members, screws, strict=True)):
            raise NotJudgedError("joint-centre errors remove degrees of freedom from this overconstrained robot")


def _needed(loops: Loops, start: FloatArray, count: int) -> tuple[int, ...]:
    """Return the indices of loop equations that are independent in the workspace."""
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
    """Return the indices of the dependent coordinates: dependent coordinates of the pose, and all unknowns.

    Raises:
        NotJudgedError: the equations leave an unknown free, or determine a coordinate of the pose that has a stated
            range.
    """
    count = len(free)
    unknowns, k = list(range(count, len(start))), loops.count
    following = [j for j, index in enumerate(free) if index in box.dependent]
    if k < len(unknowns):
        raise NotJudgedError("the pose does not determine every joint coordinate")
    if k != len(unknowns) + len(following):
        raise NotJudgedError("the robot cannot choose all pose coordinates with ranges independently")
    if not k:
        return ()
    slopes = loops.slopes(start[:, None])[0] * loops.size
    if unknowns:
        values = np.linalg.svd(slopes[:, unknowns], compute_uv=False)
        if not values[-1] > _ZERO * values[0]:
            raise NotJudgedError("the pose does not determine every joint coordinate at the workspace centre")
    values = np.linalg.svd(slopes[:, [*following, *unknowns]], compute_uv=False)
    if not values[-1] > _ZERO * values[0]:
        raise NotJudgedError("the loop equations are singular at the workspace centre")
    return (*following, *unknowns)


def _chosen(posed: PosedModel, model: Model, start: FloatArray, needed: tuple[int, ...], otherwise: float) -> Chosen:
    """Return the given equations, independent screws, independent equations of nested loops, and a reference length.

    Screws of joints that loops hold still are only rounding errors.

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
    """Return the indices of independent rows of a matrix, as many as its expected rank.

    Raises:
        NotJudgedError: the matrix has another rank.
    """
    chosen = independent_rows([values]) if rank else ()
    if len(chosen) != rank:
        raise NotJudgedError(f"{what} are singular at the workspace centre")
    return tuple(sorted(chosen))


def _length(posed: PosedModel, start: FloatArray, size: float) -> float:
    """Return the median moment arm of rows and screws about the platform's origin; 0 if all are small."""
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
    """Return the matrix of rows and members with unlocked actuators; None for a robot without constraints."""
    generic, limbs = model.generic, posed.limbs
    if (generic is not None and generic.constraints == 0) or (not limbs.actuators and model.members):
        return None
    matrix = posed.unlocked
    if not matrix.numel():
        return None
    if generic is not None:
        freedoms, idle = 6 - generic.constraints, generic.idle
    else:
        # A robot given by rows has no loops, and the middle may be singular.
        away = np.random.default_rng(_SEED).uniform(-_SPREAD, _SPREAD, (_POINTS, len(start))) * (not model.unknowns)
        every = posed.values(matrix, (start + away * posed.loops.size).T)
        freedoms, idle = matrix.shape[1] - max(map(_rank_of, np.hsplit(every, _POINTS))), 0
    return RankMatrix(matrix, freedoms + idle) if 0 < freedoms < 6 else None


def _rank_of(values: FloatArray) -> int:
    """Return the rank of a matrix, computed in floating point."""
    sizes = np.linalg.svd(values, compute_uv=False)
    return int(np.count_nonzero(sizes > _ZERO * sizes[0]))


def steepest(slopes: FloatArray, tolerance: float) -> FloatArray:
    """Return joint-centre errors (..., 3) in the directions of derivatives, with the tolerance as norm.

    The errors are zero where the derivatives are zero.
    """
    sizes = np.linalg.norm(slopes, axis=-1, keepdims=True)
    # Adding zero removes negative zeros.
    return np.asarray(INSIDE * tolerance * slopes / np.maximum(sizes, np.finfo(float).tiny) + 0.0)

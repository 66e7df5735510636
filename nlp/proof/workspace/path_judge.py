"""Verdicts on a programmed path: regular, and within limits, at every point of every segment.

The claims are those about a workspace. Their boxes are those that cover pieces of the path, halved along it, and values
are those of its points. Every machine within the case's tolerance on joint centres is meant.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import casadi as ca
import numpy as np

from ....models import FloatArray, frozen_array
from ....models.joints.closedform import ClosedForm
from ....models.statics import statics_hindrance
from ...case.case import Case
from ...case.checks import check_determined_joints
from ...case.motors import MotorNumber
from ...case.pose import Free, Value, ends_of
from ...case.task import Sense
from ...case.workspace import LARGEST_TURN, TurnKind, Turns, Workspace
from ...errors import CaseError, InputError, UncoveredError
from ...evidence.dependent import dependent_of, robot_size
from ...interruption import is_requested, one_call, one_search, within
from ...path.arcs import PLANES
from ...path.path import ProgrammedPath
from ...program.layout import robot_length
from ..boxes.search import TOO_SMALL, Effort, Order, joined, some
from ..enclosure.engine import kernel
from ..statement.claims import ACTUATED, CONSTRAINTS, REGULAR, Claim, dependent_claims, searched_claims
from ..statement.motors import in_motion, motor_claims
from ..statement.tolerance import Directions
from .numbers.bound_search import Minimum
from .numbers.expressions import Expressions
from .numbers.extremes import Extreme, extreme_of
from .numbers.machines import Machines
from .numbers.motors import Motors
from .numbers.searched import Subject, motor_extremes, searched_extremes
from .numbers.strokes import with_strokes
from .path_closing import closed_form_along, unknowns_at
from .path_faults import Fault, first_faults, pose_at, refuted
from .path_knots import Knots, Sampling, knots_of
from .path_motion import speeds_on_path
from .ranks.loop_boxes import APART, LoopBoxes, loop_boxes_of
from .ranks.ranks import RankRule
from .ranks.singular_pose import DeterminantSigns, SingularPose
from .robot.long_turns import turns_of_path
from .robot.path_cover import PathCover, Place, place_in
from .robot.pose_box import PoseBox, PoseNumbers, pose_box
from .robot.posed_model import RankMatrix
from .robot.posed_robot import NotJudgedError, Problem, build_problem
from .verdict import EVERYWHERE, Outcome

#: Seconds after which a judgement stops where the caller does not say.
TIME_LIMIT = 600.0
#: Part of the time that is left that a search takes at most, and gap of a number without a limit, as a part of it.
_PART, GAP = 0.5, 1e-3
#: Part of the robot's size, or of the sizes of positions, by which the box of all poses is wider than a path that stays
#: at one.
_ROOM = 1e-9
#: Parts of a robot's size, or angle, by which a coordinate moves that stands still but for rounding.
_STILL = 1e-9
#: Singular value, in parts of the largest, that counts as 0 at a point of a path, steps in the search of it, and powers
#: of two of a piece's width at which it begins.
_SINGULAR, _STEPS, _FAR = 1e-9, 80, 16
#: Parts of a way over which rows must have values.
_PARTS = 64
#: Parts of each segment at which a change of sign is looked for.
_SAMPLES = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True, eq=False)
class RankOnPath:
    """Verdict on the claim that J, or the constraint wrenches, keep their rank along a path.

    Attributes:
        name: of the claim.
        outcome: the verdict.
        place: of a singular pose where the claim is refuted, and of an open piece where it is open; else None.
        pose: there.
        boxes: number of boxes examined.
        seconds: wall time.
        reason: for an open verdict, or how a singular pose was found; else empty.
    """

    name: str
    outcome: Outcome
    place: Place | None
    pose: PoseNumbers | None
    boxes: int
    seconds: float
    reason: str


@dataclass(frozen=True, eq=False)
class PathJudgement:
    """Verdicts on a machine along a path; with a tolerance on joint centres, on every machine within it.

    Attributes:
        case: the case, its dimensions fixed.
        path: the path.
        ranks: of J, and of the constraint wrenches of a robot that has them.
        extremes: of reach, limits, actuators and loads.
        faults: the first known point that refutes a limit, by name and sense of the claim, where it is before the one
            of the worst value.
        knots: places of the path with the joints of the design there; None where none are asked for.
        dependent: names of the coordinates of the pose that follow from the others.
    """

    case: Case
    path: ProgrammedPath
    ranks: tuple[RankOnPath, ...]
    extremes: tuple[Extreme, ...]
    faults: Mapping[tuple[str, Sense], Fault] = field(default_factory=dict)
    knots: Knots | None = None
    dependent: tuple[str, ...] = ()

    @property
    def is_proved(self) -> bool:
        """Whether all ranks and limits are proved, and the distance that knots are to keep."""
        if self.knots is not None and self.knots.reason:
            return False
        return all(each.outcome is Outcome.PROVED for each in self.ranks) and not any(
            each.fails for each in self.extremes
        )


@one_call
def judge_path(
    case: Case,
    path: ProgrammedPath,
    *,
    gap: float = GAP,
    time_limit: float | None = TIME_LIMIT,
    sampling: Sampling | None = None,
    limits_alone: bool = False,
    progress: Callable[[str], None] | None = None,
) -> PathJudgement:
    """Judge a machine at every point of a path.

    Args:
        case: the machine, whose own poses and workspace are not used.
        path: in the case's unit of length.
        gap: largest relative gap of a number without a limit.
        time_limit: seconds of all searches.
        sampling: what knots of the path are to keep; None for no knots.
        limits_alone: whether numbers of actuators without a limit are left out.
        progress: called with what is done next.

    Raises:
        CaseError: a dimension of the robot is free, or limits need a motion that neither the case nor the path states.
        InputError: the path has rotations that are not covered, there is no C kernel, or knots are too many, or of a
            robot of which the positions of actuators are not known.
    """
    cover, box, workspace = covered(path, robot_length(case))
    case = replace(case, workspace=workspace)
    case.fixed_parameters("a path is judged with fixed dimensions")
    check_determined_joints(case.model, "path", case.source)
    if not path.is_timed:
        case.require_motion(", or a path that states times")
    stated, case = case, in_motion(case) if case.without_motion else case
    kernel()
    report = progress or (lambda _: None)
    with within(time_limit, _PART):
        knots = None
        if sampling is not None:
            report("knots")
            knots = knots_of(case, path, cover, workspace, sampling)
        closed = closed_form_along(case, path)
        try:
            box, workspace = _with_dependent(case, box, workspace)
            stated, case = replace(stated, workspace=workspace), replace(case, workspace=workspace)
            design = _design(case, closed, box, cover)
            machines = Machines(case, closed, design)
        except NotJudgedError as error:
            rank = RankOnPath(REGULAR, Outcome.OPEN, None, None, 0, 0.0, str(error))
            return PathJudgement(stated, path, (rank,), (), knots=knots)
        family = machines.family
        ranks = []
        for name, matrix in ((REGULAR, family.locked), (CONSTRAINTS, family.unactuated)):
            if matrix is not None:
                report(name)
                at_start = case.model.rank < 6 and name == REGULAR
                ranks.append(_at_start(family, matrix, cover) if at_start else _rank(family, matrix, name, cover))
        report("limits")
        asked = () if limits_alone else (*ACTUATED, "leg_length")
        names = [item.name for item in case.model.quantities if item.name in asked]
        reaches, claims = machines.symbols.claims(names, with_objective=False)
        claims += dependent_claims(machines.symbols.layout.robots[0], workspace)
        found: list[Extreme] = []
        faults: dict[tuple[str, Sense], Fault] = {}
        for group in (reaches, claims):
            searched = _searched(machines, group, gap)
            found += searched
            wrong = refuted(group, searched).values()
            if wrong:
                numbers = Expressions(machines.family, ca.vertcat(*[machines.number(claim) for claim, _ in wrong]))
                faults |= first_faults(numbers, dict(enumerate(wrong)), cover)
        lengths = [each.bound for each in found if each.name.startswith("leg_length limb ")]
        subject = Subject(case, closed.model, family, "", min(lengths, default=0.0))
        found = with_strokes(subject, found, partial(_finer, machines, claims))
        numbers_of_jacobian = list(searched_extremes(subject, (), gap=gap))
        found += numbers_of_jacobian
        faults |= _searched_faults(subject, numbers_of_jacobian, cover)
        report("actuators")
        found += _of_actuators(subject, machines, cover, gap, faults, is_timed=path.is_timed, with_all=not limits_alone)
    return PathJudgement(stated, path, tuple(ranks), tuple(found), faults, knots, workspace.dependent_names)


def _of_actuators(
    subject: Subject,
    machines: Machines,
    cover: PathCover,
    gap: float,
    faults: dict[tuple[str, Sense], Fault],
    *,
    is_timed: bool,
    with_all: bool,
) -> list[Extreme]:
    """Return the numbers of actuators along a path, in its own motion where that is known; adds faults of speeds."""
    if not is_timed:
        found = list(motor_extremes(subject, with_all=with_all))
        faults |= _motor_faults(subject, found, cover)
        return found
    # Powers are those in the path's motion, whether the case states another one or none.
    speeds, case = speeds_on_path(machines, cover, gap), subject.case
    moving = case if statics_hindrance(case.model) else in_motion(case)  # forces that are not known have no power
    bounds = {each.motor.actuator: each.bound for each in speeds.extremes if each.motor}
    unknown: list[Extreme] = []
    if speeds.number is not None:
        subject = replace(subject, case=moving, machines=speeds.number.problem)
        faults |= first_faults(speeds.number, refuted(speeds.claims, speeds.extremes), cover)
    else:
        powers = [each for each in motor_claims(moving) if each.motor and each.motor.number is MotorNumber.POWER]
        unknown = [
            extreme_of(each, Minimum(reason=speeds.extremes[0].reason)) for each in powers if each.limit is not None
        ]
        subject = replace(subject, case=replace(moving, loading=moving.loading._replace(motion=None)))
    found = [*motor_extremes(subject, speeds=bounds, with_all=with_all), *unknown]
    faults |= _motor_faults(subject, found, cover)
    return [*speeds.extremes, *found]


def _searched_faults(subject: Subject, found: Sequence[Extreme], cover: PathCover) -> dict[tuple[str, Sense], Fault]:
    """Return the first known points at which singular values, condition numbers and clearances break their limits."""
    faults: dict[tuple[str, Sense], Fault] = {}
    for pair in refuted(list(searched_claims(subject.case)), found).values():
        faults |= first_faults(subject.number(pair[0]), {0: pair}, cover)
    return faults


def _motor_faults(subject: Subject, found: Sequence[Extreme], cover: PathCover) -> dict[tuple[str, Sense], Fault]:
    """Return the first known points at which forces, powers and speeds in any direction are beyond their limits."""
    wrong = {(each.name, each.sense): each for each in found if each.outcome is Outcome.REFUTED}
    claims = [each for each in motor_claims(subject.case) if (each.name, each.sense) in wrong]
    faults: dict[tuple[str, Sense], Fault] = {}
    for _, group in itertools.groupby(claims, lambda claim: claim.motor and claim.motor.place):
        own = list(group)
        if subject.machines is not None:
            pairs = {k: (each, wrong[each.name, each.sense]) for k, each in enumerate(own)}
            faults |= first_faults(Motors(subject.machines, subject.case, own), pairs, cover)
    return faults


def _searched(machines: Machines, claims: Sequence[Claim], gap: float) -> list[Extreme]:
    """Return the extremes of numbers; those without rules are open."""
    covered, reason = [claim for claim in claims if machines.is_covered(claim)], "the check has no rule for it"
    found = dict[Claim, Extreme]()
    try:
        found = dict(zip(covered, machines.searched(covered, gap) if covered else [], strict=True))
        # A number that cannot be decided ends the search of all.
        limited = [each for each in covered if each.limit is not None and len(covered) > 1]
        for claim in (each for each in limited if found[each].reason == TOO_SMALL):
            (found[claim],) = machines.searched([claim], gap)
    except UncoveredError as error:  # of an equation of loops
        reason = str(error)
    return [found.get(claim) or extreme_of(claim, Minimum(reason=reason)) for claim in claims]


def _finer(
    machines: Machines, claims: Sequence[Claim], leg: int, sense: Sense, gap: float, about: Directions | None
) -> Extreme | None:
    """Return a length of a leg, proved more finely; None where the work is to stop, and for errors along directions."""
    if is_requested() or about is not None:
        return None
    claim = next(each for each in claims if each.legs == (leg,) and each.sense is sense)
    return machines.searched([claim], gap, is_enough=False)[0]


def covered(path: ProgrammedPath, size: float) -> tuple[PathCover, PoseBox, Workspace]:
    """Return the boxes of a path, the box of all its poses, and a workspace about it.

    Args:
        path: the path.
        size: characteristic size of the robot, length.

    Raises:
        InputError: it has no motion, or its rotations are not covered.
    """
    if not len(path):
        raise InputError(f"{path.source}: has no motion")
    turns = turns_of_path(path)
    arcs, axes = np.full((len(path), 6), np.nan), np.zeros((len(path), 3), dtype=np.intp)
    k = path.arc_segments
    arcs[k] = path.arcs
    axes[k] = [PLANES[plane] for plane in path.planes.tolist()] if len(k) else np.zeros((0, 3), dtype=np.intp)
    seconds = np.where(np.isfinite(path.durations), path.durations, np.inf)
    cover = PathCover(path.knots[:, :3], arcs, axes, turns, seconds, path.frame)
    lower, upper = cover.boxes(cover.pieces)
    low, high = lower.min(axis=0), upper.max(axis=0)
    if not (high > low).any():  # a path that stays at one pose
        room = _ROOM * max(float(np.abs(path.knots[:, :3]).max()), size)
        low[0], high[0] = low[0] - room, high[0] + room
    box = PoseBox(
        turns.kind,
        frozen_array((0, 0, 1), (3,)),
        frozen_array(low, low.shape),
        frozen_array(high, high.shape),
        math.inf,
        turns.reference,
    )
    about = Turns(TurnKind.ANY_AXIS, (Free(-LARGEST_TURN, LARGEST_TURN),))
    if turns.kind is TurnKind.ROLL_PITCH_YAW:
        about = Turns(turns.kind, tuple(_values(2 * np.arctan(low[3:]), 2 * np.arctan(high[3:]))))
    return cover, box, Workspace(_values(low[:3], high[:3]), about)


def _design(case: Case, closed: ClosedForm, box: PoseBox, cover: PathCover) -> Problem:
    """Return the design along a path.

    Raises:
        NotJudgedError: it is not judged, or its loops are not closed at the first point.
    """
    first = cover.points(cover.pieces[:1], 0.0)[0]
    near = partial(unknowns_at, case, closed, box.pose(first))
    design = replace(build_problem(case, closed.model, box, first, near), cover=cover)
    # An equation of a number that hardly changes counts as one that follows from others, but must hold.
    if not np.array_equal(design.start[design.stated], first[[design.free[j] for j in design.stated]]):
        raise NotJudgedError("its loops could not be closed at the first point of the path")
    return design


def _with_dependent(case: Case, box: PoseBox, workspace: Workspace) -> tuple[PoseBox, Workspace]:
    """Return the box of a path, and the workspace about it, with the coordinates that the robot cannot choose.

    Raises:
        NotJudgedError: the path moves one of these, or its rotations are not those of three angles.
    """
    if workspace.turns.kind is not TurnKind.ROLL_PITCH_YAW:
        return box, workspace
    try:
        found = dependent_of(case, workspace)
    except CaseError as error:
        raise NotJudgedError(error.fault) from None
    places = [each.index for each in found.dependent]
    if not places:
        return box, workspace
    stated, angle = (*workspace.position, *workspace.turns.angles), _STILL
    length = _STILL * robot_size(case, [sum(ends_of(each)) / 2 for each in workspace.position])
    moved = [k for k in places if np.ptp(ends_of(stated[k])) > (length if k < 3 else angle)]
    if moved:
        names, chosen = (
            " and ".join(found.names[k] for k in which) for which in (moved, [k for k in range(6) if k not in places])
        )
        raise NotJudgedError(f"the path moves {names}, which this robot cannot choose: of the pose it chooses {chosen}")
    wide = pose_box(found)
    lower, upper = box.lower.copy(), box.upper.copy()
    lower[places], upper[places] = wide.lower[places], wide.upper[places]
    lower, upper = frozen_array(lower, (6,)), frozen_array(upper, (6,))
    # Ranges of rounding are no limits.
    still = [sum(ends_of(each)) / 2 if k in places else each for k, each in enumerate(stated)]
    found = replace(found, position=still[:3], turns=replace(found.turns, angles=tuple(still[3:])))
    return replace(box, lower=lower, upper=upper, dependent=tuple(places)), found


def _values(low: FloatArray, high: FloatArray) -> list[Value]:
    """Return ranges, or fixed numbers where both ends are one."""
    return [Free(a, b) if b > a else a for a, b in zip(low.tolist(), high.tolist(), strict=True)]


def _rank(problem: Problem, matrix: RankMatrix, name: str, cover: PathCover) -> RankOnPath:
    """Return the verdict on the rank of a matrix along a path."""
    place = _sign_change(problem, matrix, cover)
    if place is not None:
        return RankOnPath(name, Outcome.REFUTED, place, pose_at(problem, cover, place), 0, 0.0, "")
    effort = Effort()
    try:
        with one_search():
            rule = RankRule(problem, matrix, None, lambda *_: None)
            search = rule.search(Order.NEWEST)
            # One piece that is too small leaves the claim open or refutes it, however many others there are.
            reason = effort.run(search, lambda: TOO_SMALL if search.state.small else None)
    except UncoveredError as error:
        return RankOnPath(name, Outcome.OPEN, None, None, 0, effort.seconds, str(error))
    left = search.state.left
    if not left:
        reason = reason or ("" if rule.is_one_assembly() else APART)
        outcome = Outcome.OPEN if reason else Outcome.PROVED
        return RankOnPath(name, outcome, None, None, search.boxes, effort.seconds, reason)
    boxes = joined(search.state.small or left)
    pieces = boxes.more.along
    first = np.lexsort(pieces.T[[1, 0]])[:1]
    place, value = _most_singular(problem, matrix, cover, pieces[first[0]], loop_boxes_of(some(boxes, first)))
    is_singular = value <= _SINGULAR
    words = f"its smallest singular value is {value:.1e} of the largest there"
    words = words if math.isfinite(value) else reason
    outcome = Outcome.REFUTED if is_singular else Outcome.OPEN
    return RankOnPath(name, outcome, place, pose_at(problem, cover, place), search.boxes, effort.seconds, words)


def _at_start(problem: Problem, matrix: RankMatrix, cover: PathCover) -> RankOnPath:
    """Return the verdict on the rank of J of a structure that is singular everywhere, as at the first point."""
    place = Place(int(cover.pieces[0, 0]), 0.0)
    is_singular = SingularPose(problem, matrix).smallest(problem.start) <= _SINGULAR
    outcome = Outcome.REFUTED if is_singular else Outcome.OPEN
    return RankOnPath(REGULAR, outcome, place, pose_at(problem, cover, place), 0, 0.0, EVERYWHERE)


def _sign_change(problem: Problem, matrix: RankMatrix, cover: PathCover) -> Place | None:
    """Return the first place between whose neighbours the determinant is proved to have opposite signs.

    The rows surely have values all the way between them.
    """
    if matrix.matrix.shape != (6, 6) or matrix.nullity or problem.dependent or problem.names:
        return None
    signs, free, every = DeterminantSigns(problem, matrix), list(problem.free), cover.pieces
    for rows in cover.blocks():
        pieces = every[rows]
        points = [cover.points(pieces, part)[:, free] for part in _SAMPLES]
        values = np.stack([np.sign(signs.computed(each)) for each in points], axis=1)
        for k, j in np.argwhere(values[:, :-1] * values[:, 1:] < 0).tolist():
            low, high = _SAMPLES[j], _SAMPLES[j + 1]
            if signs.proved(points[j][k]) * signs.proved(points[j + 1][k]) >= 0:
                continue
            ends = np.linspace(low, high, _PARTS + 1)
            ends = pieces[k, 1] + ends * (pieces[k, 2] - pieces[k, 1])
            boxes = cover.boxes(np.stack([np.full(_PARTS, pieces[k, 0]), ends[:-1], ends[1:]], axis=1))
            if not signs.has_values(*(each[:, free] for each in boxes)):
                continue
            for _ in range(_STEPS):
                middle = 0.5 * (low + high)
                sign = np.sign(signs.computed(cover.points(pieces[k : k + 1], middle)[:, free])[0])
                low, high = (middle, high) if sign == values[k, j] else (low, middle)
            return place_in(pieces[k], high)
    return None


def _most_singular(
    problem: Problem, matrix: RankMatrix, cover: PathCover, piece: FloatArray, box: LoopBoxes
) -> tuple[Place, float]:
    """Return the place in a piece with its box, and near it, with the smallest singular value, and the value."""
    newton, stated = SingularPose(problem, matrix), problem.stated
    chosen = [problem.free[j] for j in stated]

    def at(s: float) -> float:
        z = box.near[0].copy()
        z[stated] = cover.points(np.array([[piece[0], s, s]]), 0.0)[0, chosen]
        if problem.dependent:
            z = problem.loops.all_closed(z[:, None], list(problem.dependent))[:, 0]
        return newton.smallest(z) if np.isfinite(z).all() else math.inf

    # Where the value falls with the square of the distance, pieces are left far from the least one too.
    wide, middle = piece[2] - piece[1], 0.5 * (piece[1] + piece[2])
    away = wide * 2.0 ** np.arange(_FAR)
    near = np.clip(np.concatenate([[middle], middle - away, middle + away]), 0.0, 1.0)
    best = float(near[int(np.argmin([at(each) for each in near.tolist()]))])
    wide += abs(best - middle)
    low, high = max(best - wide, 0.0), min(best + wide, 1.0)
    for _ in range(_STEPS):
        s = np.linspace(low, high, 5)
        values = [at(each) for each in s.tolist()]
        k = int(np.argmin(values))
        low, high = float(s[max(k - 1, 0)]), float(s[min(k + 1, 4)])
    middle = 0.5 * (low + high)
    return Place(int(piece[0]), middle), at(middle)

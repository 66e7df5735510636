"""Knots of a path, at equal steps or so that actuators that move linearly between them keep the platform near it.

Pieces of the path are divided until the bounds of :mod:`.path_tubes` are within the distance, about as few as they can
be: a bound falls with the square of a piece's length.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray
from ....models.joints.model.closedform import closed_form
from ....models.statics import driven_joints
from ...case.case import Case
from ...case.pose import Free, ends_of
from ...case.workspace import DependentCoordinate, TurnKind, Workspace
from ...errors import InputError, UncoveredError
from ...evidence.dependent import independent_coordinates, with_dependent
from ...evidence.inverse import InversePoses, inverse
from ...interruption import is_requested, one_search, why_stopped
from ...path.path import ProgrammedPath
from ..boxes.search import joined, some
from .numbers.within_tolerance import RobotsWithinTolerance
from .path_motion import coordinates_of
from .path_tubes import Tubes
from .ranks.krawczyk import ROUNDING
from .ranks.loop_boxes import LoopBoxes, whole_workspace
from .robot.path_cover import PathCover
from .robot.pose_box import pose_box
from .robot.posed_robot import NotJudgedError, Problem, build_problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Parts of the size of positions, and angle, by which the box of all poses is larger than the path.
_ROOM = 0.01
#: Errors of the coordinates in a table, in parts of the robot's length, or radians: those of loops are closed to 1e-10.
_NOISE = 1e-9
#: Room of the box about a piece beyond what is first found to be needed.
_WIDER = 1.1
#: Largest number of parts of a piece at once, factor of their number, and least length of a piece in its parameter.
_PARTS, _MORE, _LEAST = 4, 1.02, 2.0**-30
#: Number of pieces that are examined at once, and of those of which nothing is known; and largest number of knots.
_BLOCK, _FEW, _MOST = 2048, 128, 5_000_000
#: Number of knots whose joints are computed at once.
_JOINTS = 2**16
#: Number of steps of a path without a stated one.
_STEPS = 1000
#: Largest turn between two knots at steps of lengths, radians: that of each angle.
_TURN = np.radians(1.0)


class Knots(NamedTuple):
    """Places of a path in its order: the beginning of the first segment, then at least the end of each.

    Attributes:
        segments: (K,) segments that end at, or hold, each place.
        parameters: (K,) along them.
        coordinates: (K, a) of the actuators there, radians or length; NaN where the machine does not reach the pose.
            Those that turn have no jumps.
        actuators, measures: (a,) their names, and the quantities that the coordinates are.
        within: largest distance asked for of the platform's origin from the path; None where none is.
        deviation: proven largest distance of the platform's origin from the path while actuators move linearly between
            the knots; None where none is asked for, or proved.
        reason: for which none is proved; else empty.
    """

    segments: NDArray[np.intp]
    parameters: FloatArray
    coordinates: FloatArray
    actuators: tuple[str, ...]
    measures: tuple[str, ...]
    within: float | None = None
    deviation: float | None = None
    reason: str = ""

    @property
    def turning(self) -> NDArray[np.bool_]:
        """Whether each actuator turns (a,)."""
        return np.array([each == "actuator_angle" for each in self.measures])


class Sampling(NamedTuple):
    """What knots are to keep, of which one is given; else the steps are a thousandth of the path.

    Attributes:
        step: largest length of the way of the position between two knots, at turns of at most one degree.
        within: largest distance, length, of the platform's origin from the path while actuators move linearly.
    """

    step: float | None = None
    within: float | None = None


def knots_of(case: Case, path: ProgrammedPath, cover: PathCover, workspace: Workspace, sampling: Sampling) -> Knots:
    """Return knots of a path.

    Args:
        case: with fixed dimensions.
        path: the path.
        cover: its boxes.
        workspace: that holds it.
        sampling: what they are to keep.

    Raises:
        InputError: there are too many.
    """
    if sampling.within is not None:
        return knots_within(case, path, cover, workspace, sampling.within)
    return stepped_knots(case, path, sampling.step or float(path.lengths.sum()) / _STEPS or 1.0)


def stepped_knots(case: Case, path: ProgrammedPath, step: float) -> Knots:
    """Return knots at equal steps along each segment.

    Args:
        case: with fixed dimensions.
        path: the path.
        step: largest length of the way of the position between two knots. The three angles change by at most one
            degree each.

    Raises:
        InputError: there are too many.
    """
    turns = np.abs(np.diff(path.knots[:, 3:], axis=0)).max(axis=1)
    parts = np.maximum(np.ceil(np.maximum(path.lengths / step, turns / _TURN) * (1 - 1e-12)), 1.0)
    if not parts.sum() <= _MOST:
        raise InputError(
            f"{path.source}: steps of {step:g} make {parts.sum():.3g} knots; at most {_MOST:,} are written"
        )
    count = parts.astype(int)
    segments = np.repeat(np.arange(len(path)), count)
    place = np.arange(len(segments)) - np.repeat(np.cumsum(count) - count, count) + 1
    return _with_joints(case, path, segments, place / np.repeat(count, count))


def _with_joints(case: Case, path: ProgrammedPath, segments: NDArray[np.intp], ends: FloatArray) -> Knots:
    """Return knots at the beginning and at the ends (P,) of pieces."""
    segments, ends = np.concatenate([segments[:1], segments]), np.concatenate([[0.0], ends])
    # Each pose is reached from the one before. Where formulas close the loops, a part of them needs less memory.
    block = len(ends) if closed_form(case.model).model.unknowns else _JOINTS
    found = list[InversePoses]()
    q = np.zeros((0, 0))
    for begin in range(0, len(ends), block):
        rows = slice(max(begin - 1, 0), begin + block)
        found = [inverse(case, *path.poses_at(segments[rows], ends[rows]), follow="previous")]
        turning = [each == "actuator_angle" for each in found[0].measures]
        own = found[0].coordinates
        if begin:
            turns = np.where(turning, np.round((q[-1] - own[0]) / (2 * np.pi)) * 2 * np.pi, 0.0)
            own = np.concatenate([q, (own + np.nan_to_num(turns))[1:]])
        q = np.asarray(own)
    return Knots(segments, ends, q, found[0].actuators, found[0].measures)


def knots_within(case: Case, path: ProgrammedPath, cover: PathCover, workspace: Workspace, within: float) -> Knots:
    """Return knots so that linear motions of the actuators between them keep the platform's origin near the path.

    Args:
        case: with fixed dimensions.
        path: the path.
        cover: its boxes.
        workspace: that holds it.
        within: the largest distance, length.
    """
    every, pieces, reason = cover.pieces, None, ""
    try:
        with one_search():
            division = _Division(*_robot_about(case, cover, workspace), cover, within, path.lines, _are_turning(case))
            pieces, reason = division.run()
    except (NotJudgedError, UncoveredError) as error:
        reason = str(error)
    every = cover.pieces if pieces is None else pieces.along
    knots = _with_joints(case, path, every[:, 0].astype(int), every[:, 2])._replace(within=within)
    if pieces is None or reason:
        return knots._replace(reason=reason)
    if not division.has_joints(pieces, knots):
        return knots._replace(reason="the joints at the knots are not surely those of the motion between them")
    return knots._replace(deviation=float(pieces.far.max()))


def _robot_about(case: Case, cover: PathCover, workspace: Workspace) -> tuple[Problem, SX]:
    """Return the design about a path, whose pose may leave it in every direction, and its actuators' coordinates.

    Raises:
        NotJudgedError: they are not known, or not as many as the platform's freedoms.
    """
    if workspace.turns.kind is not TurnKind.ROLL_PITCH_YAW:
        raise NotJudgedError("its rotations are not roll, pitch and yaw below 149 degrees that change linearly")
    ends = [ends_of(value) for value in (*workspace.position, *workspace.turns.angles)]
    size = max(abs(end) for pair in ends[:3] for end in pair)
    rooms = [_ROOM * (size or 1.0)] * 3 + [_ROOM] * 3
    free = [Free(low - room, high + room) for (low, high), room in zip(ends, rooms, strict=True)]
    opened = replace(workspace, position=free[:3], turns=replace(workspace.turns, angles=tuple(free[3:])))
    # Independent ones are those that the path moves, and not those with the narrowest rooms.
    chosen = independent_coordinates(case, workspace) or range(6)
    others = (DependentCoordinate(k, free[k].lower, free[k].upper) for k in range(6) if k not in chosen)
    opened = with_dependent(case, replace(opened, dependent=tuple(others)))
    case = replace(case, workspace=opened, joint_centre_tolerance=None)
    closed, first = closed_form(case.model), cover.points(cover.pieces[:1], 0.0)[0]
    problem = replace(build_problem(case, closed.model, pose_box(opened), first), cover=cover)
    robots = RobotsWithinTolerance(case, closed, problem)
    coordinates = coordinates_of(robots)
    if coordinates.numel() != len(problem.independent):
        freedoms = len(problem.independent)
        raise NotJudgedError(
            f"it has {coordinates.numel()} actuators for {freedoms} freedoms, so that these do not agree"
        )
    return problem, coordinates


def _are_turning(case: Case) -> NDArray[np.bool_]:
    """Return whether the coordinate of each actuator (a,) is an angle."""
    return np.array([each.dimension is Dimension.ANGLE for each in driven_joints(case.model)], dtype=bool)


class _Pieces(NamedTuple):
    """B pieces of a path.

    Attributes:
        along: (B, 3) their segments, and the ends of the parameter.
        near: (B, n) closed points near them.
        lower, upper: (B, k) ends between which each pose has one closed point only; NaN where none are known.
        far: (B,) proven distance of the platform from the path; infinite without one.
    """

    along: FloatArray
    near: FloatArray
    lower: FloatArray
    upper: FloatArray
    far: FloatArray


class _Proved(NamedTuple):
    """Pieces that are proved, and which ones of those examined they are."""

    which: NDArray[np.intp]
    pieces: _Pieces


class _Division:
    """Pieces of a path, divided until the platform stays near all of them.

    Args:
        problem: the machine about the path.
        coordinates: of its actuators.
        cover: of the path.
        within: the largest distance.
        lines: (N,) of the program, of the segments.
        turning: (a,) whether the coordinate of each actuator is an angle.
    """

    def __init__(
        self,
        problem: Problem,
        coordinates: SX,
        cover: PathCover,
        within: float,
        lines: NDArray[np.int32],
        turning: NDArray[np.bool_],
    ) -> None:
        self._tubes, self._within, self._lines = Tubes(problem, coordinates, cover), within, lines
        self._own, self._D = list(problem.independent), list(problem.dependent)
        self._noise = _NOISE * np.where(turning, 1.0, problem.length)
        self._start = self._unproved(cover.pieces, whole_workspace(problem).near)

    def _unproved(self, along: FloatArray, near: FloatArray) -> _Pieces:
        """Return pieces of which nothing is known."""
        unknown = np.full((len(along), len(self._D)), np.nan)
        return _Pieces(along, near, unknown, unknown, np.full(len(along), np.inf))

    def run(self) -> tuple[_Pieces, str]:
        """Return all pieces in order, and why some are not proved, or nothing."""
        waiting, found, reason = [self._start], [some(self._start, np.arange(0))], ""
        while waiting and not reason:
            pieces, *rest = _cut(waiting.pop(), _BLOCK)
            waiting += rest
            proved, near, lost = self._examined(pieces)
            found.append(proved)
            # Of those where nothing is known, some come first: where nothing can be known, they soon are too short.
            waiting += [each for each in (near, *reversed(_cut(lost, _FEW))) if len(each.far)]
            along = np.concatenate([near.along, lost.along])
            lengths = along[:, 2] - along[:, 1]
            if is_requested():
                reason = why_stopped()
            elif lengths.min(initial=1.0) < _LEAST:
                k, s = along[int(np.argmin(lengths)), :2].tolist()
                where = f"in line {self._lines[int(k)]}, {s:.7g} of its segment"
                reason = f"it is not proved {where}, however near each other knots are"
            elif sum(len(each.far) for each in (*found, *waiting)) > _MOST:
                reason = f"more than {_MOST:,} knots are needed"
        every = joined([*found, *waiting])
        return some(every, np.lexsort(every.along.T[[1, 0]])), reason

    def _examined(self, pieces: _Pieces) -> tuple[_Pieces, _Pieces, _Pieces]:
        """Return the pieces that are proved, and parts of the others: of those with a distance, and those without."""
        along, tubes = pieces.along, self._tubes
        with np.errstate(all="ignore"):
            boxes = tubes.boxes(along, pieces.near)
            h = (along[:, 2] - along[:, 1])[:, None]
            middle, half = (each * (h * h / 8) for each in tubes.bends(along, boxes))
            errors = middle, half + ROUNDING * (np.abs(middle) + half) + self._noise
            moved = tubes.moved(boxes, *errors)
            parts = _WIDER * _distance(moved) / self._within
            proved = self._proved(along, boxes, moved, errors, np.flatnonzero(parts <= 1))
        is_left = np.ones(len(along), dtype=bool)
        is_left[proved.which] = False
        found = []
        for is_known in (True, False):
            left = np.flatnonzero(is_left & (np.isfinite(parts) == is_known))
            count = np.ceil(_MORE * np.sqrt(parts[left])) if is_known else np.full(len(left), 2)
            found.append(self._divided(along[left], boxes.near[left], np.clip(count, 2, _PARTS).astype(int)))
        return proved.pieces, found[0], found[1]

    def _proved(
        self,
        along: FloatArray,
        boxes: LoopBoxes,
        moved: FloatArray,
        errors: tuple[FloatArray, FloatArray],
        close: NDArray[np.intp],
    ) -> _Proved:
        """Return the pieces that are proved.

        Args:
            along: (B, 3) the pieces.
            boxes: that hold them.
            moved: (B, n) how far coordinates move in these boxes.
            errors: middles and half widths (B, a) of those of the actuators' coordinates.
            close: those that may be proved.
        """
        D = self._D
        if not close.size:
            return _Proved(close, self._unproved(along[close], boxes.near[close]))
        # The platform moves about the piece, in a box with room for it.
        room = _WIDER * moved[close][:, self._own]
        wide = self._tubes.boxes(along[close], boxes.near[close], room)
        moved = self._tubes.moved(wide, *(each[close] for each in errors))
        far = _distance(moved)
        good = (moved[:, self._own] < room).all(axis=1) & (far <= self._within)
        kept = close[good]
        lower = np.maximum(boxes.lower[kept][:, D], wide.lower[good][:, D])
        upper = np.minimum(boxes.upper[kept][:, D], wide.upper[good][:, D])
        return _Proved(kept, _Pieces(along[kept], boxes.near[kept], lower, upper, far[good]))

    def _divided(self, along: FloatArray, near: FloatArray, count: NDArray[np.intp]) -> _Pieces:
        """Return as many equal parts of each piece as are given."""
        which = np.repeat(np.arange(len(along)), count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        k, low, high = along[which].T
        ends = [np.where(p == n, high, low + (high - low) * (p / n)) for p, n in _both(place, count[which])]
        return self._unproved(np.stack([k, *ends], axis=1), near[which])

    def has_joints(self, pieces: _Pieces, knots: Knots) -> bool:
        """Return whether the coordinates at knots are those of the machine that is meant at the ends of all pieces."""
        # The end of each piece, and the beginning of the first.
        ends = np.concatenate([pieces.along[:1, [0, 1, 1]], pieces.along[:, [0, 2, 2]]])
        near = np.concatenate([pieces.near[:1], pieces.near])
        turns: FloatArray | None = None
        for begin in range(0, len(ends), _BLOCK):
            rows = slice(begin, begin + _BLOCK)
            boxes = self._tubes.boxes(ends[rows], near[rows])
            low, high = boxes.lower[:, self._D], boxes.upper[:, self._D]
            # Each knot's closed point is that of the pieces on its both sides.
            places = np.arange(len(ends))[rows]
            for side in (np.maximum(places - 1, 0), np.minimum(places, len(pieces.far) - 1)):
                if not ((pieces.lower[side] <= low) & (high <= pieces.upper[side])).all():
                    return False
            low, high = self._tubes.values(boxes)
            q = knots.coordinates[rows]
            if turns is None:
                turns = np.where(knots.turning, np.round((q - low)[0] / (2 * np.pi)) * 2 * np.pi, 0.0)
            off = np.maximum(q - turns - low, high - (q - turns))
            if not (boxes.is_known.all() and (off <= self._noise).all()):
                return False
        return True


def _cut(pieces: _Pieces, count: int) -> list[_Pieces]:
    """Return so many pieces, and the others, if there are any."""
    every = np.arange(len(pieces.far))
    return [some(pieces, each) for each in (every[:count], every[count:]) if len(each)]


def _both(place: NDArray[np.intp], count: NDArray[np.intp]) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return the numbers of the parts' beginnings and of their ends, with those of all parts."""
    return [(place, count), (place + 1, count)]


def _distance(moved: FloatArray) -> FloatArray:
    """Return the distances (B,) that the platform's origin moves, the first three of coordinates (B, n)."""
    return np.asarray(np.sqrt((moved[:, :3] ** 2).sum(axis=1)) * (1 + ROUNDING))

"""Knots of a tool path: at equal steps, or so close that linear actuator motion stays within a distance of the path.

Pieces of the path are divided until the bounds of :mod:`.path_tubes` are within the distance. A bound falls with the
square of a piece's length, which gives the number of parts.
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

#: Margin of the box of all poses about the path, relative to the position, or as an angle.
_ROOM = 0.01
#: Errors of tabulated coordinates, relative to the robot's length, or in radians; loops are closed to 1e-10.
_NOISE = 1e-9
#: Factor of the margin of the box about a piece over the first estimate.
_WIDER = 1.1
#: Largest number of parts into which a piece is divided at once, factor of the estimated number, and least length of a
#: piece in its parameter.
_PARTS, _MORE, _LEAST = 4, 1.02, 2.0**-30
#: Number of pieces examined at once: of all pieces, and of pieces without a bound; and largest number of knots.
_BLOCK, _FEW, _MOST = 2048, 128, 5_000_000
#: Number of knots whose joints are computed at once.
_JOINTS = 2**16
#: Number of steps of a path if no step is given.
_STEPS = 1000
#: Largest change of each angle between two knots at equal steps, radians.
_TURN = np.radians(1.0)


class Knots(NamedTuple):
    """Knots of a path in order: points at the start of the first segment and at least at the end of every segment.

    Attributes:
        segments: (K,) index of the segment that ends at, or contains, each knot.
        parameters: (K,) parameter, from 0 to 1, of each knot on its segment.
        coordinates: (K, a) actuator coordinates, radians or length, without jumps by full turns; NaN where the robot
            does not reach the pose.
        actuators, measures: (a,) names of the actuators, and names of their coordinates' quantities.
        within: requested largest distance of the platform's origin from the path; None without a request.
        deviation: proved largest distance of the platform's origin from the path while actuators move linearly between
            the knots; None if no distance is requested or proved.
        reason: reason why the distance is not proved; otherwise empty.
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
        """Whether each actuator is revolute (a,)."""
        return np.array([each == "actuator_angle" for each in self.measures])


class Sampling(NamedTuple):
    """Rule for knots: a step or a distance; without both, the step is a thousandth of the path.

    Attributes:
        step: largest path length of the position between two knots; the angles change by at most one degree each.
        within: largest distance of the platform's origin from the path, length, while actuators move linearly.
    """

    step: float | None = None
    within: float | None = None


def knots_of(case: Case, path: ProgrammedPath, cover: PathCover, workspace: Workspace, sampling: Sampling) -> Knots:
    """Return knots of a path.

    Args:
        case: case with fixed dimensions.
        path: the tool path.
        cover: boxes of the path.
        workspace: box that contains the path.
        sampling: rule for the knots.

    Raises:
        InputError: there are too many knots, or a distance is requested while dimensions change along the path.
    """
    if sampling.within is not None and path.settings.names:
        name = case.parameter_name(path.settings.names[0])
        raise InputError(f"--within: is not proved while {name} changes along the path; use --step")
    if sampling.within is not None:
        return knots_within(case, path, cover, workspace, sampling.within)
    return stepped_knots(case, path, sampling.step or float(path.lengths.sum()) / _STEPS or 1.0)


def stepped_knots(case: Case, path: ProgrammedPath, step: float) -> Knots:
    """Return knots at equal steps along each segment.

    Args:
        case: case with fixed dimensions.
        path: the tool path.
        step: largest path length of the position between two knots. The angles change by at most one degree each.

    Raises:
        InputError: there are too many knots.
    """
    turns = np.abs(np.diff(path.knots[:, 3:], axis=0)).max(axis=1)
    parts = np.maximum(np.ceil(np.maximum(path.lengths / step, turns / _TURN) * (1 - 1e-12)), 1.0)
    if not parts.sum() <= _MOST:
        raise InputError(
            f"{path.source}: steps of {step:g} give {parts.sum():.3g} knots; at most {_MOST:,} are allowed"
        )
    count = parts.astype(int)
    segments = np.repeat(np.arange(len(path)), count)
    place = np.arange(len(segments)) - np.repeat(np.cumsum(count) - count, count) + 1
    return _with_joints(case, path, segments, place / np.repeat(count, count))


def _with_joints(case: Case, path: ProgrammedPath, segments: NDArray[np.intp], ends: FloatArray) -> Knots:
    """Return knots with joint positions: the start of the path, and the ends (P,) of pieces."""
    segments, ends = np.concatenate([segments[:1], segments]), np.concatenate([[0.0], ends])
    # Loops are closed from one pose to the next. With closed forms, blocks of poses need less memory.
    block = len(ends) if closed_form(case.model).model.unknowns else _JOINTS
    found = list[InversePoses]()
    q = np.zeros((0, 0))
    for begin in range(0, len(ends), block):
        rows = slice(max(begin - 1, 0), begin + block)
        at = segments[rows], ends[rows]
        found = [inverse(case, *path.poses_at(*at), follow="previous", changing=path.settings.by_name(*at))]
        turning = [each == "actuator_angle" for each in found[0].measures]
        own = found[0].coordinates
        if begin:
            turns = np.where(turning, np.round((q[-1] - own[0]) / (2 * np.pi)) * 2 * np.pi, 0.0)
            own = np.concatenate([q, (own + np.nan_to_num(turns))[1:]])
        q = np.asarray(own)
    return Knots(segments, ends, q, found[0].actuators, found[0].measures)


def knots_within(case: Case, path: ProgrammedPath, cover: PathCover, workspace: Workspace, within: float) -> Knots:
    """Return knots between which linear actuator motion keeps the platform's origin within a distance of the path.

    Args:
        case: case with fixed dimensions.
        path: the tool path.
        cover: boxes of the path.
        workspace: box that contains the path.
        within: largest distance of the platform's origin from the path, length.
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
        return knots._replace(reason="not proved: the joint positions at the knots belong to the motion between knots")
    return knots._replace(deviation=float(pieces.far.max()))


def _robot_about(case: Case, cover: PathCover, workspace: Workspace) -> tuple[Problem, SX]:
    """Return the nominal robot near a path, with all six coordinates of the pose, and its actuator coordinates.

    Raises:
        NotJudgedError: the actuator coordinates are not known, or there are not as many as degrees of freedom.
    """
    if workspace.turns.kind is not TurnKind.ROLL_PITCH_YAW:
        raise NotJudgedError(
            "rotations of the path must be roll, pitch and yaw that change linearly and stay below 149 degrees"
        )
    ends = [ends_of(value) for value in (*workspace.position, *workspace.turns.angles)]
    size = max(abs(end) for pair in ends[:3] for end in pair)
    rooms = [_ROOM * (size or 1.0)] * 3 + [_ROOM] * 3
    free = [Free(low - room, high + room) for (low, high), room in zip(ends, rooms, strict=True)]
    opened = replace(workspace, position=free[:3], turns=replace(workspace.turns, angles=tuple(free[3:])))
    # Independent coordinates are chosen among those that the path moves.
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
            f"the robot has {coordinates.numel()} actuators for {freedoms} degrees of freedom; "
            "these numbers must be equal"
        )
    return problem, coordinates


def _are_turning(case: Case) -> NDArray[np.bool_]:
    """Return whether the coordinate of each actuator (a,) is an angle."""
    return np.array([each.dimension is Dimension.ANGLE for each in driven_joints(case.model)], dtype=bool)


class _Pieces(NamedTuple):
    """B pieces of a path.

    Attributes:
        along: (B, 3) segment of each piece, and both ends of the parameter.
        near: (B, n) points with closed loops near the pieces.
        lower, upper: (B, k) box in which the loops close at exactly one point for each pose; NaN if no box is known.
        far: (B,) proved distance of the platform from the path; infinite without a proof.
    """

    along: FloatArray
    near: FloatArray
    lower: FloatArray
    upper: FloatArray
    far: FloatArray


class _Proved(NamedTuple):
    """Pieces with a proved distance, and their indices among the examined pieces."""

    which: NDArray[np.intp]
    pieces: _Pieces


class _Division:
    """Division of a path into pieces on which the platform provably stays within a distance of the path.

    Args:
        problem: the robot near the path.
        coordinates: (a, 1) actuator coordinates.
        cover: boxes of the path.
        within: largest distance, length.
        lines: (N,) line of the G-code program of each segment.
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
        """Return pieces without any proved bound."""
        unknown = np.full((len(along), len(self._D)), np.nan)
        return _Pieces(along, near, unknown, unknown, np.full(len(along), np.inf))

    def run(self) -> tuple[_Pieces, str]:
        """Return all pieces in order, and the reason for unproved pieces; the reason is empty without such pieces."""
        waiting, found, reason = [self._start], [some(self._start, np.arange(0))], ""
        while waiting and not reason:
            pieces, *rest = _cut(waiting.pop(), _BLOCK)
            waiting += rest
            proved, near, lost = self._examined(pieces)
            found.append(proved)
            # Some pieces without a bound come first: if no bound exists there, they soon become too short.
            waiting += [each for each in (near, *reversed(_cut(lost, _FEW))) if len(each.far)]
            along = np.concatenate([near.along, lost.along])
            lengths = along[:, 2] - along[:, 1]
            if is_requested():
                reason = why_stopped()
            elif lengths.min(initial=1.0) < _LEAST:
                k, s = along[int(np.argmin(lengths)), :2].tolist()
                where = f"in line {self._lines[int(k)]}, {s:.7g} of its segment"
                reason = f"the distance from the path cannot be proved {where}, however close the knots are"
            elif sum(len(each.far) for each in (*found, *waiting)) > _MOST:
                reason = f"more than {_MOST:,} knots are needed"
        every = joined([*found, *waiting])
        return some(every, np.lexsort(every.along.T[[1, 0]])), reason

    def _examined(self, pieces: _Pieces) -> tuple[_Pieces, _Pieces, _Pieces]:
        """Return the proved pieces, parts of unproved pieces with a bound, and parts of pieces without a bound."""
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
        """Return the proved pieces.

        Args:
            along: (B, 3) pieces.
            boxes: boxes that contain the pieces.
            moved: (B, n) largest motion of the coordinates in these boxes.
            errors: middles and half widths (B, a) of errors of the actuator coordinates.
            close: indices of the pieces that may be proved.
        """
        D = self._D
        if not close.size:
            return _Proved(close, self._unproved(along[close], boxes.near[close]))
        # The box about the piece needs room for the motion of the platform.
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
        """Return equal parts of pieces; ``count`` has the number of parts of each piece."""
        which = np.repeat(np.arange(len(along)), count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        k, low, high = along[which].T
        ends = [np.where(p == n, high, low + (high - low) * (p / n)) for p, n in _both(place, count[which])]
        return self._unproved(np.stack([k, *ends], axis=1), near[which])

    def has_joints(self, pieces: _Pieces, knots: Knots) -> bool:
        """Return whether the actuator coordinates at all knots belong to the proved assembly mode.

        Knots are the ends of the pieces.
        """
        # The end of each piece, and the start of the first.
        ends = np.concatenate([pieces.along[:1, [0, 1, 1]], pieces.along[:, [0, 2, 2]]])
        near = np.concatenate([pieces.near[:1], pieces.near])
        turns: FloatArray | None = None
        for begin in range(0, len(ends), _BLOCK):
            rows = slice(begin, begin + _BLOCK)
            boxes = self._tubes.boxes(ends[rows], near[rows])
            low, high = boxes.lower[:, self._D], boxes.upper[:, self._D]
            # The pieces on both sides of a knot must have the same joint positions there.
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
    """Divide pieces into the first ``count`` pieces and the remaining pieces; a group without pieces is left out."""
    every = np.arange(len(pieces.far))
    return [some(pieces, each) for each in (every[:count], every[count:]) if len(each)]


def _both(place: NDArray[np.intp], count: NDArray[np.intp]) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return the places of the starts and of the ends of parts, each with ``count``.

    A place is the number of equal steps, of ``count`` in a piece, from its start.
    """
    return [(place, count), (place + 1, count)]


def _distance(moved: FloatArray) -> FloatArray:
    """Return the displacements (B,) of the platform's origin, from displacements (B, n) of all coordinates."""
    return np.asarray(np.sqrt((moved[:, :3] ** 2).sum(axis=1)) * (1 + ROUNDING))

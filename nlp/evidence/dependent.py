"""Independent and dependent coordinates of the pose over a workspace.

A robot with fewer than six degrees of freedom controls as many coordinates of its pose as it has degrees of freedom;
the others follow from the loop equations. Independent coordinates are chosen at the middle of the workspace among those
with ranges, where they span the largest volume of feasible directions; fixed coordinates complete them. A coordinate
that keeps its stated value over the whole workspace, such as a rotation of a Delta robot, is a constant.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, Model, Substitution
from ...models.arrays import values_at
from ...models.instance import sizes_at
from ...models.rotation import matrix_from_cayley, turn_about
from ..case.case import Case
from ..case.pose import Free, Value, ends_of
from ..case.workspace import DependentCoordinate, TurnKind, Turns, Workspace
from ..errors import CaseError
from .closed_loops import Loops, closed_from_home

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Singular values below this fraction of the largest are zero; a relative change below the second number is rounding.
_ZERO, _STILL = 1e-9, 1e-9
#: Smallest component of a feasible direction, as a fraction of the largest, at which a coordinate counts as moving.
_MOVES = 1e-6
#: Number of random poses for dependent coordinates, largest number of corners, steps to each pose, and the seed.
_POSES, _MOST_CORNERS, _WAY, _SEED = 12, 32, 8, 0
#: Margin of the working range of a dependent coordinate on each side: part of the computed range, and smallest part of
#: the robot's size, or angle.
_WIDER, _LEAST = 0.5, 1e-2
#: Volumes with a smaller relative difference are equal: the first is taken. A fixed coordinate that comes first is
#: taken if its volume exceeds the second fraction of the largest volume.
_TIE, _ENOUGH = 1e-9, 0.2
#: Weight of a direction of the position, divided by the robot's size, relative to a rotation in radians: most tasks
#: are positioning tasks.
_POSITION = 3.0


class LoopSystem(NamedTuple):
    """Equations of a robot's closed loops, in which expressions replace the symbols of pose and unknowns.

    Attributes:
        equations: (k, 1) independent equations, divided by their sizes.
        every: (e, 1) all equations, divided by their sizes.
        signs: (s, 1) expressions that are positive in the home assembly mode.
        sizes: (u,) sizes of the unknowns.
    """

    equations: SX
    every: SX
    signs: SX
    sizes: FloatArray


def loop_system(model: Model, given: Substitution, values: Sequence[float]) -> LoopSystem:
    """Return the loop equations of a robot.

    Args:
        model: model of the robot.
        given: expressions that replace the symbols of the model.
        values: parameters of the robot, at which the sizes are taken.
    """
    own, every = Substitution.identity(model), (*model.closure, *model.loops)
    outputs = [*(each.expression for each in every), *(each.value for each in model.signs)]
    found = ca.Function("loops", own.all, outputs).call(given.all) if outputs else []
    ones = SX.ones(len(every) + len(model.unknowns))
    sizes = sizes_at(model, (*every, *model.unknowns), tuple(values), ones)
    scaled = [found[k] / sizes[k] for k in range(len(every))]
    whole = ca.vertcat(SX(0, 1), *scaled)
    signs = ca.vertcat(SX(0, 1), *found[len(every) :])
    unknowns = np.array(ca.DM(sizes[len(every) :, :]), dtype=np.float64).ravel()
    return LoopSystem(whole[: len(model.closure), :], whole, signs, unknowns)


def with_dependent(case: Case, workspace: Workspace) -> Workspace:
    """Return a workspace with its dependent coordinates; refuse ranges that the robot cannot control.

    Raises:
        CaseError: the robot controls no coordinate that has a range, or :func:`dependent_of` refuses the workspace.
    """
    found = dependent_of(case, workspace)
    if not found.independent and found.dependent:
        ranged = " and ".join(found.names[k] for k, _ in found.ranged)
        chosen = ", ".join(found.names[k] for k in independent_coordinates(case, found) or ())
        fault = f"this robot cannot control {ranged}: give a range to one or more of {chosen}"
        raise CaseError("workspace", fault, source=case.source)
    return found


def dependent_of(case: Case, workspace: Workspace) -> Workspace:
    """Return a workspace with its dependent coordinates and their working ranges.

    Existing dependent coordinates are kept, with new working ranges. If the loops cannot be closed at the centre of the
    workspace, the workspace is returned unchanged.

    Args:
        case: case with fixed dimensions.
        workspace: box of poses.

    Raises:
        CaseError: a coordinate that never changes is stated with another value; or a rotation about one axis is stated,
            but the platform rotates about other axes too.
    """
    if not _may_depend(case.model):
        return workspace
    chart = _Chart(case, workspace)
    middle = chart.closed_middle()
    if middle is None:
        return workspace
    before = [each.index for each in workspace.dependent]
    independent = [k for k in range(6) if k not in before] if before else chart.independent(middle)
    closed = chart.points(middle, independent)
    if closed is None:
        return workspace
    points = closed[:, :6]
    fixed = np.abs(points - chart.middle[:6]) <= _STILL * chart.size[:6]
    is_still = chart.is_still(closed)
    for k in (k for k in range(6) if k not in (*independent, *chart.ranged, *before) and is_still[k]):
        if not fixed[:, k].all():
            raise _misstated(case, workspace, k, *(float(chart.ends(each)[k]) for each in (chart.middle, points[0])))
    found = [
        k for k in range(6) if k not in independent and (k in before or k in chart.ranged or not fixed[:, k].all())
    ]
    if workspace.turns.kind is TurnKind.AXIS and any(k > 3 for k in found):
        return dependent_of(case, workspace.by_three_angles())
    low, high = points.min(axis=0), points.max(axis=0)
    room = _WIDER * (high - low) + _LEAST * chart.size[:6]
    ends = chart.ends(low - room), chart.ends(high + room)
    dependent = tuple(DependentCoordinate(k, float(ends[0][k]), float(ends[1][k])) for k in found)
    shaped = workspace.position_set
    if shaped is not None and any(k in shaped.coordinates for k in found):
        names = ", ".join(workspace.names[k] for k in found if k in shaped.coordinates)
        fault = (
            f"restricts {names}, which this robot cannot choose independently; "
            f"give ranges in workspace.position, or a plane shape without {names}"
        )
        raise CaseError(f"workspace.position.{shaped.kind.value}", fault, source=case.source)
    return replace(workspace, dependent=dependent, held=tuple(k for k in independent if k not in chart.ranged))


def robot_size(case: Case, position: Sequence[float] | None = None) -> float:
    """Return the largest distance between points of a robot's drawing, with unknown joints at home; 1 for one point.

    Args:
        case: case with fixed dimensions.
        position: (3,) position of the platform, without rotation; the home position of the model if left out.
    """
    model = case.model
    parts = [value for name in case.parameters for value in case.components(name)]
    places = ca.horzcat(*[point.position for point in model.scene.points], SX(model.pose.position))
    function = ca.Function("points", Substitution.identity(model).all, [ca.densify(places)])
    at = model.home if position is None else position
    points = np.array(function(np.array(parts), np.zeros(len(model.unknowns)), np.eye(3), np.array(at))).T
    size = float(np.linalg.norm(points[:, None] - points[None], axis=2).max())
    return size if 0 < size < np.inf else 1.0


def _misstated(case: Case, workspace: Workspace, k: int, stated: float, true: float) -> CaseError:
    """Return the error for a stated coordinate that this robot cannot have."""
    dimension, units = (Dimension.LENGTH if k < 3 else Dimension.ANGLE), case.units
    one, other = (f"{units.shown(each, dimension):.6g} {units.label(dimension)}".rstrip() for each in (stated, true))
    key = f"workspace.position[{k}]" if k < 3 else "workspace.rotation"
    return CaseError(
        key, f"{workspace.names[k]} = {one}: this robot keeps this coordinate at {other}", source=case.source
    )


def independent_coordinates(case: Case, workspace: Workspace) -> list[int] | None:
    """Return the indices of the pose coordinates that the robot controls independently over a workspace.

    For a robot with six degrees of freedom, these are all six; None if the loops cannot be closed at the centre.
    """
    if not _may_depend(case.model):
        return list(range(6))
    chart = _Chart(case, workspace)
    middle = chart.closed_middle()
    return None if middle is None else chart.independent(middle)


class CompletedPoses(NamedTuple):
    """Poses that a robot can take.

    Attributes:
        positions: (N, 3) origins of the platform frame, length.
        rotations: (N, 3, 3) platform to world coordinates.
        dependent: names of the dependent coordinates, whose values may differ from the given values.
    """

    positions: FloatArray
    rotations: FloatArray
    dependent: tuple[str, ...]


def completed(
    case: Case, positions: FloatArray, rotations: FloatArray, which: NDArray[np.bool_]
) -> CompletedPoses | None:
    """Return poses with their dependent coordinates computed; None if all coordinates are independent.

    Args:
        case: case with fixed dimensions.
        positions: (N, 3) origins of the platform frame, length.
        rotations: (N, 3, 3) platform to world coordinates.
        which: (N,) True for poses whose dependent coordinates are computed; poses with open loops stay unchanged.
    """
    if not _may_depend(case.model) or not which.any():
        return None
    angles = np.array([_angles(each) for each in rotations])
    y = np.hstack([positions, angles])
    lower, upper = y[which].min(axis=0), y[which].max(axis=0)
    values: list[Value] = [Free(a, b) if b > a else a for a, b in zip(lower.tolist(), upper.tolist(), strict=True)]
    workspace = Workspace(values[:3], Turns(TurnKind.ROLL_PITCH_YAW, tuple(values[3:])))
    chart = _Chart(case, workspace)
    middle = chart.closed_middle()
    if middle is None:
        return None
    chosen = chart.independent(middle)
    to = np.hstack([y[which, :3], np.tan(0.5 * y[which, 3:])])
    closed = chart.reached(middle, chosen, to)
    found, kept = closed[:, :6], np.isfinite(closed).all(axis=1)
    # A constant coordinate, such as the height of a planar robot, cannot have another value.
    off = np.abs(found - to) > _STILL * chart.size[:6]
    kept &= ~(off & chart.is_still(closed)).any(axis=1)
    y = np.hstack([positions, np.tan(0.5 * angles)])
    rows = np.flatnonzero(which)[kept]
    y[rows] = found[kept]
    turn = SX.sym("turn", 3)
    function = ca.Function("rotation", [turn], [ca.densify(_rotation(workspace.turns, turn))])
    rotations = rotations.copy()
    rotations[rows] = values_at(function, y[rows, 3:])[0]
    moved = np.abs(found[kept] - to[kept]).max(axis=0, initial=0.0) > _STILL * chart.size[:6]
    return CompletedPoses(y[:, :3], rotations, tuple(workspace.names[k] for k in range(6) if moved[k]))


def _angles(R: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation (3, 3), radians."""
    return math.atan2(R[2, 1], R[2, 2]), math.asin(min(max(-R[2, 0], -1.0), 1.0)), math.atan2(R[1, 0], R[0, 0])


def _may_depend(model: Model) -> bool:
    """Return whether a robot has fewer than six degrees of freedom, and loop equations for the other coordinates."""
    return model.generic is not None and model.generic.constraints > 0 and bool(model.closure)


class _Chart:
    """Loop equations of a robot as functions of six pose coordinates, then the unknowns.

    Rotations are the tangents of half of roll, pitch and yaw, or the components of a Cayley vector: along the axis of
    a rotation about one axis, and across it.

    Attributes:
        middle: (6 + u,) middle of the workspace, with unknowns of 0.
        half: (6,) half ranges of the coordinates; 0 for fixed coordinates.
        ranged: indices of the coordinates whose ranges are wider than rounding.
        size: (6 + u,) sizes that make coordinates comparable.
    """

    def __init__(self, case: Case, workspace: Workspace) -> None:
        self._kind, model = workspace.turns.kind, case.model
        numbers = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
        y, u = SX.sym("y", 6), SX.sym("u", len(model.unknowns))
        given = replace(
            Substitution.identity(model),
            parameters=SX(ca.DM(numbers)),
            unknowns=u,
            rotation=_rotation(workspace.turns, y[3:]),
            position=y[:3],
        )
        system = loop_system(model, given, numbers)
        values: list[Value] = [*workspace.position, *workspace.turns.angles, 0.0, 0.0][:6]
        if self._kind is TurnKind.ANY_AXIS:
            most = max(map(abs, ends_of(workspace.turns.angles[0])))
            values[3:] = [Free(-most, most)] * 3
        ends = np.array([ends_of(each) for each in values])
        ends[3:] = np.tan(0.5 * ends[3:])
        self.half = 0.5 * (ends[:, 1] - ends[:, 0])
        self.middle = np.concatenate([workspace.middle, ends[3:].mean(axis=1), np.zeros(u.numel())])
        length = robot_size(case, self.middle[:3].tolist())
        self.size = np.concatenate([[length] * 3, np.ones(3), system.sizes])
        self.ranged: list[int] = np.flatnonzero(self.half > _STILL * self.size[:6]).tolist()
        constraints = 0 if model.generic is None else model.generic.constraints
        self._mobility = 6 - constraints
        self.loops = Loops(ca.vertcat(y, u), system.equations, system.every, system.signs, self.size)

    def ends(self, y: FloatArray) -> FloatArray:
        """Return coordinates (6,) as lengths and angles, radians."""
        return np.concatenate([y[:3], 2 * np.arctan(y[3:6])])

    def closed_middle(self) -> FloatArray | None:
        """Return closed loops (6 + u,) in the home assembly mode near the middle of the workspace, or None."""
        return closed_from_home(self.loops, self.middle, 6)

    def independent(self, z: FloatArray) -> list[int]:
        """Return the indices of independent pose coordinates at a closed point, one for each degree of freedom."""
        moves = self._moves(z)
        ranged, weighted = self.ranged, moves * np.repeat([_POSITION, 1.0], 3)[:, None]
        chosen = _largest(weighted, ranged, [], min(_rank(moves[ranged]), self._mobility))
        # A case with one range of a tilt mostly wants all tilts; a case without one wants positions.
        turns_first = any(k >= 3 for k in ranged)
        others = sorted((k for k in range(6) if k not in ranged), key=lambda k: ((k < 3) == turns_first, k))
        count = min(self._mobility, _rank(moves)) - len(chosen)
        return sorted(_largest(weighted, others, chosen, count, enough=_ENOUGH))

    def points(self, z: FloatArray, independent: list[int]) -> FloatArray | None:
        """Return closed loops (P, 6 + u) at the middle, corners and random points of the workspace, or None.

        Args:
            z: (6 + u,) closed point near the middle.
            independent: indices of the independent coordinates.
        """
        ranged = [k for k in independent if k in self.ranged]
        sides = np.array(list(itertools.islice(itertools.product((-1, 1), repeat=len(ranged)), _MOST_CORNERS)))
        inside = np.random.default_rng(_SEED).uniform(-1, 1, (_POSES, len(ranged)))
        parts = np.vstack([np.zeros((1, len(ranged))), sides, inside])
        to = np.tile(self.middle, (len(parts), 1))
        to[:, ranged] += parts * self.half[ranged]
        found = self.reached(z, independent, to)
        return found[np.isfinite(found).all(axis=1)] if np.isfinite(found[0]).all() else None

    def reached(self, z: FloatArray, independent: list[int], to: FloatArray) -> FloatArray:
        """Return closed loops (P, 6 + u) at the ends of paths from a closed point; NaN where a path ends early.

        Args:
            z: (6 + u,) the closed point.
            independent: indices of the independent coordinates.
            to: (P, 6 or more) target poses, of which only the independent coordinates are read.
        """
        moving = [k for k in range(len(z)) if k not in independent]
        points, way = np.tile(z, (len(to), 1)), (to[:, independent] - z[independent])
        for left in range(_WAY - 1, -1, -1):
            points[:, independent] = to[:, independent] - left / _WAY * way
            points = self.loops.all_closed(points.T, moving, zero=_ZERO).T
        points[~np.isfinite(points).all(axis=1)] = np.nan
        return points

    def is_still(self, z: FloatArray) -> NDArray[np.bool_]:
        """Return whether each pose coordinate (6,) is constant at and about closed points (P, 6 + u)."""
        z = z[np.isfinite(z).all(axis=1)]
        moves = np.max([np.linalg.norm(self._moves(each), axis=1) for each in z], axis=0, initial=0.0)
        spread = np.ptp(z[:, :6], axis=0) if len(z) else np.zeros(6)
        return np.asarray((moves <= _MOVES) & (spread <= _STILL * self.size[:6]))

    def _moves(self, z: FloatArray) -> FloatArray:
        """Return a basis (6, m) of the feasible pose directions at a closed point, in scaled coordinates."""
        _, values, right = np.linalg.svd(self.loops.slopes(z[:, None])[0] * self.size)
        rank = int(np.count_nonzero(values > _ZERO * values.max(initial=0.0)))
        return np.asarray(right[rank:, :6].T)


def _largest(
    moves: FloatArray, among: Sequence[int], chosen: list[int], count: int, enough: float = 1 - _TIE
) -> list[int]:
    """Return the chosen rows of a matrix and ``count`` more rows, so that all rows span the largest volume.

    Among several choices, the first with at least the fraction ``enough`` of the largest volume is taken.
    """
    every = [[*chosen, *more] for more in itertools.combinations(among, max(count, 0))]
    squares = [max(float(np.linalg.det(moves[rows] @ moves[rows].T)), 0.0) for rows in every]
    least = enough * enough * max(squares)
    return next(rows for rows, square in zip(every, squares, strict=True) if square >= least)


def _rank(moves: FloatArray) -> int:
    """Return the number of independent directions in which coordinates move."""
    values = np.linalg.svd(moves, compute_uv=False) if len(moves) else np.zeros(0)
    return int(np.count_nonzero(values > _MOVES))


def _rotation(turns: Turns, y: SX) -> SX:
    """Return the rotation (3, 3) as a function of three rotation coordinates (3, 1)."""
    if turns.kind is TurnKind.ROLL_PITCH_YAW:
        factors = [2 / (1 + y[k] * y[k]) for k in range(3)]
        about = [turn_about(k, factor - 1, factor * y[k]) for k, factor in enumerate(factors)]
        return about[2] @ about[1] @ about[0]
    r = y
    if turns.kind is TurnKind.AXIS:
        across = np.linalg.svd(np.array([turns.axis]))[2][1:]
        r = SX(np.column_stack([turns.axis, *across]).tolist()) @ y
    return matrix_from_cayley(r)

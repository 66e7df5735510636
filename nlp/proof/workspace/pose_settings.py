"""Existence of settings: at every pose of a workspace some value of the settings satisfies all limits.

A box of poses is proved with one value of the settings, which samples suggest, and the search of a workspace proves;
otherwise the box is halved. The result is piecewise constant: settings jump between boxes, so they are reset at a
standstill. A pose refutes the claim if at this pose no value of the whole range satisfies the limits. This is proved by
enclosures over the range, which is halved until each part violates one limit with all of its values.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.joints.model.closedform import ClosedForm, closed_form
from ...case.case import Case
from ...case.pose import Free, Value, ends_of
from ...case.task import Sense
from ...case.workspace import TurnKind, Turns, Workspace
from ...errors import CaseError
from ...interruption import is_requested, one_call, why_stopped, within
from ...program.layout import Layout
from ..boxes.tree import TreeRecord, keys_of
from ..checker.tree import Node, TreeReader, halves
from ..enclosure.engine import kernel
from ..statement.chosen_settings import part_of, ranges_of_settings, with_settings
from ..statement.claims import Claim, claims_of
from ..statement.fixed_robot import workspace_of_case
from ..statement.posed_layout import extreme_program, posed_layout, reach_claims_on, without_loops
from ..statement.tolerance import coordinate_layout
from .judge import TIME_LIMIT, judge_workspace
from .numbers.extremes import NumberSearch, prove_extreme
from .robot.pose_box import PoseBox, PoseNumbers, pose_box, pose_coordinates
from .verdict import Outcome, slack_of

#: Numbers of values of each setting in the first grid, by the number of settings; and refinements of the best value.
_GRID = {1: 49, 2: 13, 3: 7}
_REFINEMENTS = 3
#: Number of random poses of a box beside its corners and its middle.
_SAMPLES, _SEED = 32, 0
#: Gap of the enclosures of a refutation, and smallest part of a range, relative to the range.
_GAP, _SMALLEST = 1e-4, 1e-6
#: Largest number of boxes of poses.
MOST_BOXES = 20_000


class SettingBox(NamedTuple):
    """Box of poses with settings that satisfy all limits at each of its poses.

    Attributes:
        workspace: the box.
        values: value of each setting, in the order of the names.
    """

    workspace: Workspace
    values: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class SettingsProof:
    """Verdict on the claim that at every pose some value of the settings satisfies all limits.

    Attributes:
        case: the case.
        names: names of the settings.
        outcome: outcome of the claim.
        workspace: the workspace.
        boxes: proved boxes; together they are the workspace if the claim is proved. They are then in the order of the
            tree.
        pose: pose at which no setting works, if the claim is refuted; middle of an open box if it is open.
        parts: number of parts of the range that were excluded at the pose, for a refuted claim.
        examined: number of examined boxes.
        open: number of open boxes.
        reason: reason for an open outcome; otherwise empty.
        tree: tree of the cuts of the workspace, as bytes; empty if the claim is not proved.
    """

    case: Case
    names: tuple[str, ...]
    workspace: Workspace
    outcome: Outcome
    boxes: tuple[SettingBox, ...]
    pose: PoseNumbers | None = None
    parts: int = 0
    examined: int = 0
    open: int = 0
    reason: str = ""
    tree: bytes = b""

    @property
    def is_proved(self) -> bool:
        """Whether settings exist at every pose."""
        return self.outcome is Outcome.PROVED


@one_call
def prove_settings(
    case: Case, *, time_limit: float | None = TIME_LIMIT, progress: Callable[[int, int], None] | None = None
) -> SettingsProof:
    """Prove that at every pose of the workspace some value of the settings satisfies all limits, or refute this.

    Args:
        case: case with settings for every pose, and other dimensions fixed.
        time_limit: seconds; None for no limit.
        progress: function that is called with the numbers of proved and of remaining boxes.

    Raises:
        CaseError: another dimension is free, the positions are a set, or there are more than three settings.
        InputError: the C kernel was not built.
    """
    search = _Existence(case)
    kernel()
    with within(time_limit):
        return search.run(progress)


class _Existence:
    """Search for settings over boxes of poses."""

    def __init__(self, case: Case) -> None:
        self._case = case
        self._names, self._ranges = _ranges_of(case)
        first = workspace_of_case(_with_values(case, self._names, [each.first for each in self._ranges]))
        if first.position_set is not None:
            raise CaseError("workspace.position", "must be three coordinates with settings = 'any'", source=case.source)
        self._workspace = case.world_workspace or first
        self._fixed = frozenset(each.index for each in first.dependent)
        self._tree = TreeRecord()
        closed = closed_form(case.model)
        self._samples = None if closed.model.unknowns or first.dependent else self._sampled(closed)
        self._closed = closed

    def _sampled(self, closed: ClosedForm) -> _Samples:
        """Return the violations as functions of settings and pose; catalogue values are points of their range."""
        ranges = [Free(each.lower, each.upper) for each in self._ranges]
        return _Samples(_with_values(self._case, self._names, ranges), closed, self._workspace)

    def run(self, progress: Callable[[int, int], None] | None) -> SettingsProof:
        """Return the verdict; the box with the worst sample comes first, so that a refuting pose is found early."""
        proved, examined, reason = list[SettingBox](), 0, ""
        refuted = self._refuted(self._workspace)
        open_boxes = [self._workspace] if refuted is None else []
        if refuted is not None:
            return self._result(Outcome.REFUTED, (), refuted[0], refuted[1], 1, 0)
        while open_boxes:
            if is_requested() or examined >= MOST_BOXES:
                reason = why_stopped() if is_requested() else f"stopped after {MOST_BOXES:,} boxes"
                break
            box = open_boxes.pop()
            examined += 1
            values = self._values(box)
            if values is not None:
                proved.append(SettingBox(box, values))
            else:
                found = self._refuted(box)
                if found is not None:
                    return self._result(
                        Outcome.REFUTED, tuple(proved), found[0], found[1], examined, len(open_boxes) + 1
                    )
                halves = self._halves(box)
                if not halves:
                    open_boxes.append(box)
                    reason = "the remaining box has only a rotation about any axis, which is not halved"
                    break
                open_boxes += halves
            if progress is not None:
                progress(len(proved), len(open_boxes))
        if not open_boxes:
            tree = self._tree.tree(with_open=True)
            return replace(
                self._result(Outcome.PROVED, _in_order(tree, proved, self._workspace), None, 0, examined, 0), tree=tree
            )
        left = pose_box(open_boxes[-1])
        pose = left.pose(0.5 * left.lower + 0.5 * left.upper)
        return self._result(Outcome.OPEN, tuple(proved), pose, 0, examined, len(open_boxes), reason)

    def _result(
        self,
        outcome: Outcome,
        boxes: tuple[SettingBox, ...],
        pose: PoseNumbers | None,
        parts: int,
        examined: int,
        left: int,
        reason: str = "",
    ) -> SettingsProof:
        return SettingsProof(
            self._case, self._names, self._workspace, outcome, boxes, pose, parts, examined, left, reason
        )

    def _values(self, workspace: Workspace) -> tuple[float, ...] | None:
        """Return settings with which every pose of a box is proved; None if those that were tried are not proved."""
        if self._samples is None:
            tries = _spread(self._ranges)
        else:
            best, violation = self._samples.best(workspace, self._ranges)
            tries = [best] if violation <= 0 else []
        for values in tries:
            if is_requested():
                return None
            case = _with_values(self._case, self._names, values)
            if judge_workspace(case, workspace=workspace, with_objective=False, until_fault=True).is_proved:
                return tuple(values)
        return None

    def _refuted(self, workspace: Workspace) -> tuple[PoseNumbers, int] | None:
        """Return a pose of a box at which no setting works, with the number of parts of the range; None if unknown."""
        if self._samples is None:
            return None
        pose = self._samples.hopeless(workspace, self._ranges)
        parts = None if pose is None else _excluded(self._case, self._closed, self._names, self._ranges, pose)
        return None if pose is None or parts is None else (pose, parts)

    def _halves(self, workspace: Workspace) -> list[Workspace]:
        """Return the halves of a box across its widest independent coordinate, relative to the whole workspace."""
        turns, whole = workspace.turns, [*self._workspace.position, *self._workspace.turns.angles]
        values = [*workspace.position, *turns.angles]
        shares = {
            k: (value.upper - value.lower) / (of.upper - of.lower)
            for k, (value, of) in enumerate(zip(values, whole, strict=True))
            if isinstance(value, Free) and isinstance(of, Free) and k not in self._fixed
            if k < 3 or turns.kind is not TurnKind.ANY_AXIS
        }
        if not shares:
            return []
        k = max(shares, key=shares.__getitem__)
        lower, upper = _ends_of(workspace)
        parts = halves(lower[0], upper[0], k)
        if not lower[0, k] < parts[0][1][k] < upper[0, k]:
            return []
        self._tree.cuts(lower, upper, np.array([k]))
        return [part_of(workspace, (low.tolist(), high.tolist())) for low, high in parts]


def _in_order(tree: bytes, boxes: Sequence[SettingBox], whole: Workspace) -> tuple[SettingBox, ...]:
    """Return boxes in the order of the leaves of a tree."""
    lower, upper = _ends_of(whole)
    leaves = TreeReader(tree).walk(lower[0], upper[0], frozenset({Node.CUT}))
    every = {keys_of(*_ends_of(each.workspace))[0]: each for each in boxes}
    return tuple(every[keys_of(low[None], high[None])[0]] for _, _, low, high in leaves)


class _Samples:
    """Largest violation of the limits at sampled poses, as a function of settings and pose.

    The violation of a limit is relative to its size, and positive if a value violates the limit.
    """

    def __init__(self, case: Case, closed: ClosedForm, workspace: Workspace) -> None:
        box = pose_box(workspace)
        model = without_loops(closed.model)
        layout = coordinate_layout(replace(case, model=model), pose_coordinates(box))
        claims = [*reach_claims_on(layout, closed.reaches), *claims_of(layout, with_objective=False)]
        limited = [each for each in claims if each.limit is not None]
        beyond = [
            -each.sense.sign
            * ((each.limit or 0.0) - each.expression)
            / each.reading.size(each.limit or 0.0, case.characteristic_length)
            for each in limited
        ]
        worst = ca.mmax(ca.vertcat(ca.SX(-1.0), *beyond))
        nlp = extreme_program(layout, ca.SX(0), Sense.MIN)
        function = ca.Function("violation", [nlp.program.x, nlp.program.p], [worst])
        self._function, self._arguments = function, nlp.arguments
        self._free = list(box.free)

    def _violations(self, settings: FloatArray, points: FloatArray) -> FloatArray:
        """Return the violations (S, P) for settings (S, k) at points (P, 6) of a box."""
        own = points[:, self._free]
        rows = [np.hstack([np.repeat(s[None], len(own), axis=0), own]) for s in settings]
        values = np.asarray(self._function(np.concatenate(rows).T, self._arguments).full()).reshape(
            len(settings), len(own)
        )
        return np.where(np.isfinite(values), values, np.inf)

    def _points(self, box: PoseBox) -> FloatArray:
        """Return the corners of a box, its middle, and random points (P, 6)."""
        free = list(box.free)
        middle = 0.5 * box.lower + 0.5 * box.upper
        corners = np.repeat(middle[None], 2 ** len(free), axis=0)
        corners[:, free] = list(itertools.product(*((box.lower[k], box.upper[k]) for k in free)))
        inside = box.random(_SAMPLES, np.random.default_rng(_SEED))
        return np.concatenate([box.clipped(corners), middle[None], inside])

    def best(self, workspace: Workspace, ranges: Sequence[Free]) -> tuple[tuple[float, ...], float]:
        """Return the settings with the smallest violation at the samples of a box, and this violation."""
        points, axes = self._points(pose_box(workspace)), _grid(ranges)
        for step in range(_REFINEMENTS + 1):
            settings = np.array(list(itertools.product(*axes)), dtype=np.float64)
            worst = self._violations(settings, points).max(axis=1)
            k = int(worst.argmin())
            best, violation = settings[k], float(worst[k])
            if step < _REFINEMENTS:
                axes = [
                    axis if each.values else _around(axis, value, each)
                    for axis, value, each in zip(axes, best, ranges, strict=True)
                ]
        return tuple(best.tolist()), violation

    def hopeless(self, workspace: Workspace, ranges: Sequence[Free]) -> PoseNumbers | None:
        """Return the sampled pose at which the best settings violate a limit most; None without such a pose."""
        box = pose_box(workspace)
        points = self._points(box)
        settings = np.array(list(itertools.product(*_grid(ranges))), dtype=np.float64)
        least = self._violations(settings, points).min(axis=0)
        least[~box.holds(points)] = -np.inf
        k = int(least.argmax())
        return box.pose(points[k]) if least[k] > 0 else None


def _ranges_of(case: Case) -> tuple[tuple[str, ...], tuple[Free, ...]]:
    """Return the names and ranges of the settings that are not fixed.

    Raises:
        CaseError: there are more than three settings.
    """
    found = ranges_of_settings(case)
    if len(found) > max(_GRID):
        fault = f"supports at most {max(_GRID)} settings with 'any', and this case has {len(found)}"
        raise CaseError("workspace.settings", fault, source=case.source)
    return tuple(found), tuple(found.values())


def _with_values(case: Case, names: Sequence[str], values: Sequence[Value]) -> Case:
    """Return a case with other values of its settings."""
    return with_settings(case, dict(zip(names, values, strict=True)))


def _ends_of(workspace: Workspace) -> tuple[FloatArray, FloatArray]:
    """Return the ends (1, 3 + a) of position and angles of a box."""
    lower, upper = np.array([ends_of(each) for each in (*workspace.position, *workspace.turns.angles)]).T
    return lower[None], upper[None]


def _excluded(
    case: Case, closed: ClosedForm, names: Sequence[str], ranges: Sequence[Free], pose: PoseNumbers
) -> int | None:
    """Return the number of parts of the settings' range that limits exclude at a pose; None if a part remains.

    At the fixed pose the settings are the variables: the smallest value of a quantity with a largest allowed value, and
    vice versa, is bounded over a part of the range.
    """
    x, y, z = pose.axis.tolist()
    at = Workspace(tuple(pose.position.tolist()), Turns(TurnKind.AXIS, (float(pose.angle),), (x, y, z)))
    model, search = without_loops(closed.model), NumberSearch(_GAP, 1)
    parts, done = list(_listed(ranges)), 0
    while parts:
        if is_requested():
            return None
        part = parts.pop()
        layout = posed_layout(replace(_with_values(case, names, part), model=model), at)
        claims = list(reach_claims_on(layout, closed.reaches))
        # Beyond the reach of a limb its other quantities have no value.
        claims += [] if closed.reaches else claims_of(layout, with_objective=False)
        bound_of = partial(_bound, layout, search)
        if any(_is_violated(claim, bound_of) for claim in claims):
            done += 1
            continue
        halves = _halved(part, ranges)
        if halves is None:
            return None
        parts += halves
    return done


def _bound(layout: Layout, search: NumberSearch, claim: Claim) -> float:
    """Return the proved bound of a quantity over the settings of a layout."""
    return prove_extreme(layout, claim, search).bound


def _is_violated(claim: Claim, bound_of: Callable[[Claim], float]) -> bool:
    """Return whether every value of a part violates a limit: the best value is bounded beyond the limit."""
    if claim.limit is None:
        return False
    turned = replace(claim, sense=Sense.MAX if claim.sense is Sense.MIN else Sense.MIN, limit=None, key="")
    bound, limit = bound_of(turned), claim.reading.from_value(claim.limit)
    # The bound is in the unit of results, which increases with the expression.
    beyond = limit - bound if claim.sense is Sense.MIN else bound - limit
    return math.isfinite(bound) and beyond > slack_of(limit)


def _listed(ranges: Sequence[Free]) -> Iterator[tuple[Value, ...]]:
    """Yield the first parts of the settings' range: one for each combination of catalogue values."""
    return itertools.product(*(each.values or (each,) for each in ranges))


def _halved(part: Sequence[Value], ranges: Sequence[Free]) -> list[tuple[Value, ...]] | None:
    """Return the halves of a part across its widest setting, relative to the range; None for too small a part."""
    shares = [
        (value.upper - value.lower) / (of.upper - of.lower) if isinstance(value, Free) else 0.0
        for value, of in zip(part, ranges, strict=True)
    ]
    k = int(np.argmax(shares))
    if shares[k] < _SMALLEST:
        return None
    low, high = ends_of(part[k])
    middle = low + (high - low) / 2
    return [(*part[:k], half, *part[k + 1 :]) for half in (Free(low, middle), Free(middle, high))]


def _grid(ranges: Sequence[Free]) -> list[FloatArray]:
    """Return the values of each setting in the first grid."""
    count = _GRID[max(len(ranges), 1)]
    return [np.array(each.values) if each.values else np.linspace(each.lower, each.upper, count) for each in ranges]


def _around(axis: FloatArray, value: float, within_range: Free) -> FloatArray:
    """Return values around the best one, between its neighbours on an axis."""
    step = float(axis[1] - axis[0]) if len(axis) > 1 else 0.0
    return np.clip(np.linspace(value - step, value + step, 9), within_range.lower, within_range.upper)


def _spread(ranges: Sequence[Free]) -> list[tuple[float, ...]]:
    """Return combinations of a few values of each setting, those in the middle first."""
    axes = [each.values or tuple(np.linspace(each.lower, each.upper, 5)) for each in ranges]
    middle = [(each.lower + each.upper) / 2 for each in ranges]
    spans = [each.upper - each.lower for each in ranges]
    found = [tuple(map(float, values)) for values in itertools.product(*axes)]
    return sorted(
        found,
        key=lambda values: max((abs(v - m) / s for v, m, s in zip(values, middle, spans, strict=True)), default=0),
    )

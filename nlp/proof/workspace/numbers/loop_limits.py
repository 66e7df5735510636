"""Limits of a robot whose loops have no closed form, over a workspace, in the assembly of home.

Loop equations as conditions hold in every assembly of the joints. Here the closed loops of the assembly in the middle
of the workspace are followed over boxes (:mod:`..ranks.loop_boxes`), and each number with a limit is bounded over these
boxes: by its form, in which the dependent coordinates are replaced by their relation to the independent ones. A box is
bisected while its bound of some number is beyond the limit, or, where a value is known beyond it, beyond this value by
more than the gap.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import one_search
from ...boxes.rows import Boxes, joined, some
from ...boxes.search import TOO_SMALL, Effort, Order, Search, Verdicts
from ...enclosure.forms import Encloser, Forms
from ...enclosure.tape import compile_tape
from ...statement.claims import claims_of
from ...statement.posed_layout import reach_claims_on
from ...statement.tolerance import coordinate_layout
from ..ranks.krawczyk import ROUNDING, Coordinates, Relation, relation_of, with_relation
from ..ranks.loop_boxes import APART, Examiner, Followed, LoopBoxes, LoopRule, are_between, coordinates_to_split
from ..ranks.rank_rule import RankTest
from ..robot.pose_box import PoseBox, pose_coordinates
from ..robot.posed_robot import NotJudgedError, Problem, build_problem
from ..verdict import Outcome
from .extremes import CLOSE, ON_LIMIT, Extreme

#: Boxes examined at once.
_BLOCK = 128
#: Widths of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24
#: Derivative, as a part of the largest, that is rounding error and points to no end of a box.
_FLAT = 1e-9
#: Smallest size of a number that gaps are parts of.
_NEAR_ZERO = 1e-6


class Ranges(NamedTuple):
    """Ranges of R expressions over B boxes.

    Attributes:
        lower, upper: (B, R) smallest and largest values; infinite where nothing is known.
        slopes: (B, R, f) derivatives by the f independent coordinates, times their half widths.
    """

    lower: FloatArray
    upper: FloatArray
    slopes: FloatArray


class Enclosed(NamedTuple):
    """Results for B boxes: the relation of dependent coordinates, and ranges of the reach of limbs and of numbers."""

    relation: Relation
    reach: Ranges
    numbers: Ranges


class LimitValues:
    """Reach of limbs and numbers with a limit over boxes.

    The numbers are those of the claims times their signs, so that all limits are largest values.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        problem: this robot over the workspace.

    Raises:
        UncoveredError: a loop equation, or the reach of a limb, holds an operation without a rule.
    """

    def __init__(self, case: Case, closed: ClosedForm, problem: Problem) -> None:
        self._of = Coordinates(list(problem.independent), list(problem.dependent), [])
        layout = coordinate_layout(replace(case, model=closed.model), pose_coordinates(problem.box))
        # The variables of the layout are those of the problem, in its order.
        given = [problem.z, SX(ca.DM(layout.table.values))]
        own = [layout.table.variables_vector, layout.table.arguments_vector]
        reach = [claim.expression for claim in reach_claims_on(layout, closed.reaches)]
        claims = [claim for claim in claims_of(layout, with_objective=False) if claim.limit is not None]
        values = ca.Function("values", own, [*reach, *(claim.expression for claim in claims)]).call(given)
        self._reaches, uncovered = len(reach), dict[str, None]()
        pairs = list(zip(claims, values[len(reach) :], strict=True))
        for claim, value in pairs:
            try:
                compile_tape(ca.Function("number", [problem.z], [ca.densify(value)]))
            except UncoveredError:
                uncovered[claim.key] = None
        kept = [(claim, value) for claim, value in pairs if claim.key not in uncovered]
        #: The claims whose numbers have bounds, and keys of those that hold an operation without a rule.
        self.claims, self.uncovered = tuple(claim for claim, _ in kept), tuple(uncovered)
        signs = [1.0 if claim.sense is Sense.MAX else -1.0 for claim in self.claims]
        #: (K,) signs of the claims.
        self.sign = np.array(signs)
        bounds = np.array([claim.limit or 0.0 for claim in self.claims])
        #: (K,) largest values allowed of the numbers, with room for rounding.
        self.limit = self.sign * bounds + ON_LIMIT * np.abs(bounds)
        numbers = ca.vertcat(SX(0, 1), *[sign * value for sign, (_, value) in zip(signs, kept, strict=True)])
        # A last entry that is not used, for a robot without any.
        entries = ca.vertcat(SX(0, 1), problem.equations, *values[: len(reach)], numbers, problem.z[0])
        self._encloser = Encloser(problem.z, entries)
        self._function = ca.Function("numbers", [problem.z], [ca.densify(numbers)])

    def enclosed(self, boxes: LoopBoxes) -> Enclosed:
        """Return ranges over boxes (B,) whose dependent coordinates are known."""
        k, reaches = len(self._of.dependent), self._reaches
        forms = self._encloser(boxes.lower.T, boxes.upper.T)
        relation = relation_of(forms.part(slice(0, k)), self._of)
        found = with_relation(forms.part(slice(k, -1)), relation, self._of)
        return Enclosed(relation, _ranges(found.part(slice(0, reaches))), _ranges(found.part(slice(reaches, None))))

    def values(self, z: FloatArray) -> FloatArray:
        """Return the numbers (K, P) at points (P, n); not finite where a limb does not reach."""
        with np.errstate(all="ignore"):
            return np.asarray(self._function(z.T).full().reshape(len(self.claims), len(z)))


def _ranges(forms: Forms) -> Ranges:
    """Return the ranges of expressions."""
    with np.errstate(all="ignore"):
        half = (np.abs(forms.a).sum(axis=2) + forms.r) * (1 + ROUNDING) + ROUNDING * np.abs(forms.c)
        lower, upper = forms.c - half, forms.c + half
    known = np.isfinite(lower) & np.isfinite(upper)
    return Ranges(np.where(known, lower, -np.inf), np.where(known, upper, np.inf), forms.a)


def loop_extremes(
    case: Case,
    closed: ClosedForm,
    box: PoseBox,
    *,
    gap: float,
) -> list[Extreme]:
    """Return the extremes of numbers with a limit, in the assembly of home; none of a robot without open loops.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        box: the poses.
        gap: allowed distance of a bound from a value beyond its limit, as a part of the value.
    """
    if not closed.model.unknowns:
        return []
    with one_search():
        effort = Effort()
        try:
            problem = build_problem(case, closed.model, box)
            values = LimitValues(case, closed, problem)
            if not values.claims:
                return []
            rule = _LimitsRule(problem, values, gap)
        except (NotJudgedError, UncoveredError):
            return []
        search = Search(rule, rule.root, whole=rule.whole, least=_LEAST_WIDTHS, order=Order.NEWEST)

        def ending() -> str | None:
            if search.state.small:
                return TOO_SMALL
            return None if search.is_open or rule.is_one_assembly() else APART

        reason = effort.run(search, ending)
        return rule.extremes(reason, search.boxes, effort.seconds)


class _Best(NamedTuple):
    """Largest values (K,) that are known of K numbers, -inf without one, and the points (K, n) that have them."""

    value: FloatArray
    z: FloatArray


class _LimitsRule(LoopRule):
    """Rule of K numbers."""

    block = _BLOCK

    def __init__(self, problem: Problem, values: LimitValues, gap: float) -> None:
        examiner = Examiner(problem, RankTest(problem.locked, problem.z, problem.start))
        super().__init__(problem, examiner)
        self._values, self._gap, self._dependent = values, gap, list(problem.dependent)
        count, n = len(values.claims), len(problem.start)
        self._best = _Best(np.full(count, -np.inf), np.full((count, n), np.nan))
        self._bound = np.full(count, -np.inf)

    def examine(self, boxes: Boxes[Followed]) -> Verdicts[Followed]:
        """Return the boxes on which a number is not decided."""
        found = self.examined(boxes)
        known = found.boxes.is_known
        shares, is_left, rows = found.shares.copy(), np.ones(len(known), dtype=bool), np.flatnonzero(known)
        if rows.size:
            own = some(found.boxes, rows)
            enclosed = self._values.enclosed(own)
            upper = enclosed.numbers.upper
            self._add_points(own, enclosed)
            is_open = upper > self._least
            is_left[rows] = is_open.any(axis=1)
            closed = ~is_left[rows]
            self._bound = np.maximum(self._bound, upper[closed].max(axis=0, initial=-np.inf))
            size = np.nan_to_num(upper - enclosed.numbers.lower, nan=1.0, posinf=1.0)
            parts = np.abs(enclosed.numbers.slopes) * is_open[:, :, None] / np.maximum(size, 1e-300)[:, :, None]
            shares[rows] = np.nan_to_num(parts).sum(axis=1)
        left = some(found._replace(shares=shares), np.flatnonzero(is_left))
        split = coordinates_to_split(left.shares, self.widths(left))
        return Verdicts(self.boxes_of(left, np.zeros(len(split)), split), 0.0, len(known))

    def is_one_assembly(self) -> bool:
        """Return whether all boxes surely have the assembly of the middle."""
        if not self._roots:
            return True
        roots, start = joined(self._roots), self._problem.start
        inside = (roots.lower <= start) & (roots.upper >= start)
        here, same = inside[:, self._independent].all(axis=1), inside[:, self._dependent].all(axis=1)
        return bool((same | ~here).all()) and super().is_one_assembly()

    @property
    def _least(self) -> FloatArray:
        """(K,) bounds up to which a number is decided."""
        best = self._best.value
        size = np.maximum(np.abs(best), _NEAR_ZERO)
        with np.errstate(invalid="ignore"):
            beyond = best + self._gap * size
        return np.asarray(np.where(best > self._values.limit, beyond, self._values.limit))

    def _add_points(self, boxes: LoopBoxes, enclosed: Enclosed) -> None:
        """Try the middles of boxes, and for each number the end of the box with the largest bound."""
        upper, slopes = enclosed.numbers.upper, np.nan_to_num(enclosed.numbers.slopes)
        best = np.argmax(upper, axis=0)
        rows = np.concatenate([np.arange(len(boxes.lower)), best])
        own = slopes[best, np.arange(len(best))]
        own = np.where(np.abs(own) > _FLAT * np.abs(own).max(axis=1, keepdims=True, initial=0.0), own, 0.0)
        ends = np.concatenate([np.zeros((len(boxes.lower), len(self._independent))), np.sign(own)])
        z, half = boxes.centre[rows], 0.5 * (boxes.upper - boxes.lower)[rows]
        z[:, self._independent] += half[:, self._independent] * ends
        off, T, _, _ = (each[rows] for each in enclosed.relation)
        z[:, self._dependent] += half[:, self._dependent] * (off - (T @ ends[:, :, None])[:, :, 0])
        free, count = list(self._problem.free), len(self._problem.free)
        inside = self._problem.box.clipped(self._problem.pose_of(z))[:, free]
        own = [k for k in self._independent if k < count]
        z[:, own] = inside[:, own]
        z = self._examiner.loops.all_closed(z.T, self._dependent).T
        z[~are_between(z, some(boxes, rows), self._dependent)] = np.nan
        numbers = self._values.values(z)
        y = self._problem.pose_of(np.nan_to_num(z))
        held = np.array([self._problem.box.holds(each) for each in y]) & np.isfinite(z).all(axis=1)
        numbers = np.where(held & np.isfinite(numbers), numbers, -np.inf)
        place = np.argmax(numbers, axis=1)
        value = numbers[np.arange(len(place)), place]
        better = value > self._best.value
        self._best = _Best(np.where(better, value, self._best.value), np.where(better[:, None], z[place], self._best.z))

    def extremes(self, reason: str, boxes: int, seconds: float) -> list[Extreme]:
        """Return the extremes of the numbers; with a reason for stopping before the end nothing is bounded."""
        found, values = [], self._values
        for k, claim in enumerate(values.claims):
            sign, read = float(values.sign[k]), claim.reading.from_value
            best = float(self._best.value[k])
            bound = math.inf if reason else max(float(self._bound[k]), best)
            pose = None
            if math.isfinite(best):
                pose = self._problem.box.pose(self._problem.pose_of(self._best.z[k]))
            outcome = Outcome.PROVED if bound <= values.limit[k] else Outcome.OPEN
            outcome = Outcome.REFUTED if best > values.limit[k] else outcome
            found.append(
                Extreme(
                    name=claim.name,
                    sense=claim.sense,
                    dimension=claim.reading.dimension,
                    key=claim.key,
                    limit=read(claim.limit or 0.0),
                    bound=read(sign * bound) if math.isfinite(bound) else sign * math.inf,
                    reached=read(sign * best) if math.isfinite(best) else math.nan,
                    pose=pose,
                    outcome=outcome,
                    boxes=boxes,
                    seconds=seconds,
                    reason="" if outcome is not Outcome.OPEN else reason or CLOSE,
                )
            )
        return found

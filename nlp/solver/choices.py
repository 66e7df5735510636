"""Search over combinations of listed parameter values, each of which is solved as a case.

A few combinations are solved one by one. Many combinations are searched by branch and bound: a part is solved with the
parameters free between their smallest and largest values, and skipped if the result is no better than the best
combination. Every solve is local, from the case's starting points; the proof is in :mod:`.certified_choices`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..case.case import Case
from ..case.choices import CatalogueDimension, Ranges, all_values, catalogue_dimensions, within_ranges
from ..errors import EvaluationError, NoRobotError
from ..interruption import is_requested, one_call
from .solution import Choice, ChoicePart, Solution, interrupted
from .status import Status

#: Largest number of combinations that are all solved: bounds of parts would need about as many solves.
_FEW = 16
#: Smallest relative improvement over the best combination for which a part is searched: two solves of one program
#: differ by less.
_BETTER = 1e-9


@one_call
def solve_choices(case: Case, solve_fixed: Callable[[Case], Solution], most: float = math.inf) -> Solution:
    """Solve a case for the best combination of its listed parameter values.

    Args:
        case: the case.
        solve_fixed: function that solves a case without listed values.
        most: largest number of solves, after which the search ends with the best known combination.

    Returns:
        The solution of the best combination, with the given case; it has no answer if no combination has an answer.
    """
    return _Search(case, solve_fixed, most).run()


def cost_of(solution: Solution) -> float:
    """Return the objective of a solution as a cost to be minimised; infinite without an answer."""
    if not solution.status.is_answer:
        return math.inf
    combination, decided = solution.combination, solution.decided_by
    value = solution.outcomes[0].own.F if combination is None else combination.value
    return math.inf if value is None or decided is None else decided.nlp.sign * value


class _Part:
    """An open group of combinations: index ranges of values, and a solution with the parameters free.

    In this solution, each parameter may lie anywhere between the smallest and the largest value of its range.

    The solution is None if the robot's loops cannot be closed at any starting point.
    """

    def __init__(self, ranges: Ranges, relaxed: Solution | None) -> None:
        self.ranges, self.relaxed = ranges, relaxed
        # Without an answer, or where a better point is known, the solve gives no bound.
        self.bound = -math.inf
        if relaxed is not None and relaxed.status.is_answer and relaxed.status is not Status.LOCAL:
            self.bound = cost_of(relaxed)

    @property
    def open_numbers(self) -> int:
        """Number of parameters with several values."""
        return sum(behind - first > 1 for first, behind in self.ranges)


class _Search:
    """The search over the combinations of a case; the arguments are those of :func:`solve_choices`."""

    def __init__(self, case: Case, solve_fixed: Callable[[Case], Solution], most: float) -> None:
        self._case, self._solve, self._most = case, solve_fixed, most
        self._numbers = catalogue_dimensions(case)
        self._solved: dict[Ranges, Solution] = {}
        self._cut: dict[Ranges, Solution] = {}
        self._relaxed = 0
        self._costs: dict[Ranges, float] = {}
        self._closed: list[Ranges] = []
        self._best: Solution | None = None
        self._chosen: Ranges = ()

    def run(self) -> Solution:
        """Search all combinations, or as many as the time and the number of solves allow."""
        everything = all_values(self._numbers)
        count = math.prod(len(each.values) for each in self._numbers)
        open_parts = self._solve_all(everything) if count <= _FEW else self._bisect(everything)
        best = self._best
        if best is None:
            # No combination has an answer: return a solved one, with the limits that would have to be relaxed.
            known = {**self._solved, **self._cut}
            self._chosen = next(iter(known), next(combinations_of(everything)))
            best = known[self._chosen] if known else self._solve_combination(self._chosen)
        parts = tuple(ChoicePart(ranges, self._costs.get(ranges)) for ranges in [*self._closed, *open_parts])
        if open_parts and (self._cut or is_requested()):
            best = interrupted(best)
        choice = Choice(count, len(self._solved), self._relaxed, not open_parts, parts, self._chosen)
        return replace(best, case=self._case, choice=choice)

    def _solve_all(self, everything: Ranges) -> list[Ranges]:
        """Solve one combination after the other until a stop is requested; return the combinations that are left."""
        left = [each for each in combinations_of(everything) if self._exists(each)]
        while left and not is_requested():
            self._solve_combination(left[0])
            if left[0] not in self._solved:
                break
            self._closed.append(left.pop(0))
        return left

    def _bisect(self, everything: Ranges) -> list[Ranges]:
        """Split the combinations into parts until all are solved or skipped; return the parts that are still open."""
        root = self._relax(everything)
        # Rounding gives a first answer, by which many parts can be skipped.
        if self._exists(nearest := self._nearest(root)):
            self._solve_combination(nearest)
        parts, cut = [root], list[Ranges]()
        while parts and not is_requested() and len(self._solved) + self._relaxed < self._most:
            # Without an answer, begin with the parts that are nearest to a combination.
            is_first = self._best is None
            part = min(parts, key=lambda each: (each.open_numbers if is_first else 0, each.bound))
            parts.remove(part)
            if self._is_no_better(part):
                self._closed.append(part.ranges)
                continue
            for ranges in self._divided(part):
                if all(behind - first == 1 for first, behind in ranges):
                    if not self._exists(ranges):
                        continue
                    self._solve_combination(ranges)
                    (self._closed if ranges in self._solved else cut).append(ranges)
                    continue
                child = self._relax(ranges)
                if child.relaxed is not None and child.relaxed.status is Status.INFEASIBLE:
                    self._closed.append(ranges)
                else:
                    parts.append(child)
        return [*cut, *(each.ranges for each in parts)]

    def _exists(self, ranges: Ranges) -> bool:
        """Return whether the robot's loops can be closed with the values of a combination."""
        return exists(self._case, self._numbers, ranges)

    def _is_no_better(self, part: _Part) -> bool:
        """Return whether the bound of a group excludes a combination better than the best one."""
        best = math.inf if self._best is None else cost_of(self._best)
        return math.isfinite(best) and part.bound >= best - _BETTER * abs(best)

    def _relax(self, ranges: Ranges) -> _Part:
        """Solve a case with the listed parameters free between their smallest and largest values."""
        self._relaxed += 1
        try:
            return _Part(ranges, self._solve_within(ranges))
        except EvaluationError:
            return _Part(ranges, None)

    def _solve_combination(self, ranges: Ranges) -> Solution:
        """Solve a combination once, and store it if it is the best so far.

        An interrupted solve is incomplete: it may still be the best one, and its combination stays open.
        """
        if ranges in self._solved:
            return self._solved[ranges]
        found = self._solve_within(ranges)
        if found.status is Status.INTERRUPTED:
            self._cut[ranges] = found
            return found
        self._solved[ranges] = found
        if math.isfinite(cost_of(found)) and (self._best is None or cost_of(found) < cost_of(self._best)):
            self._best, self._chosen = found, ranges
        return found

    def _solve_within(self, ranges: Ranges) -> Solution:
        """Solve a case with the listed parameters within ranges, and store its objective."""
        found = self._solve(within_ranges(self._case, self._numbers, ranges))
        if math.isfinite(cost_of(found)):
            self._costs[ranges] = cost_of(found)
        return found

    def _nearest(self, part: _Part) -> Ranges:
        """Return the combination nearest to the solved values of a group."""
        ranges = []
        for number, (first, behind) in zip(self._numbers, part.ranges, strict=True):
            at = _value_of(part.relaxed, number)
            places = range(first, behind)
            place = min(places, key=lambda k, at=at, number=number: abs(number.values[k] - at))  # type: ignore[misc]
            ranges.append((place, place + 1))
        return tuple(ranges)

    def _divided(self, part: _Part) -> tuple[Ranges, Ranges]:
        """Return two halves of a group of combinations.

        The split is in the dimension whose solved value is relatively farthest from every value of the catalogue.
        """
        farthest, cut = -1.0, (0, 1)
        for k, (number, (first, behind)) in enumerate(zip(self._numbers, part.ranges, strict=True)):
            if behind - first > 1:
                values, at = np.array(number.values[first:behind]), _value_of(part.relaxed, number)
                place = int(np.clip(np.searchsorted(values, at, side="right"), 1, behind - first - 1))
                apart = float(np.min(np.abs(values - at)) / (values[-1] - values[0]))
                if apart > farthest:
                    farthest, cut = apart, (k, first + place)
        k, middle = cut
        first, behind = part.ranges[k]
        low, high = ((*part.ranges[:k], each, *part.ranges[k + 1 :]) for each in ((first, middle), (middle, behind)))
        return low, high


def exists(case: Case, numbers: Sequence[CatalogueDimension], ranges: Ranges) -> bool:
    """Return whether the robot's loops can be closed with the values of a combination."""
    try:
        within_ranges(case, numbers, ranges)
    except NoRobotError:
        return False
    return True


def combinations_of(ranges: Ranges) -> Iterator[Ranges]:
    """Yield every combination within ranges; the values of the last parameter change first."""
    counts = [behind - first for first, behind in ranges]
    for index in np.ndindex(*counts):
        yield tuple((first + k, first + k + 1) for (first, _), k in zip(ranges, index, strict=True))


def _value_of(solution: Solution | None, number: CatalogueDimension) -> float:
    """Return the value of a listed parameter at a solution; without a robot, the middle of the listed values."""
    state = None if solution is None else solution.outcomes[number.task or 0].state
    if state is None:
        return (number.values[0] + number.values[-1]) / 2
    return float(np.ravel(state.parameters[number.parameter])[number.component])

"""Checks of cases against expected and published values.

Three kinds of value are kept apart: those that this program **computes**, those that the case **expects**, with a
tolerance of its own, and those that the literature prints (**published**). A published number is *reproduced* by one of
two rules, and no other:

* ``digits``: the computed number is within half a unit of the last printed digit, in every component;
* ``flat``: for an argument of the optimum, F at the printed point is within 1e-5 of the best F with this argument free
  and the other printed arguments held fixed. Where F is flat, or best on a whole set, fewer digits of an argument are
  significant than are printed.

A number that a case marks reproduced and that is not, or the other way round, is *newly changed*, and fails the check.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ...models import component_names
from ..case.case import Case
from ..case.overrides import Settings
from ..case.reader import load_case
from ..case.settings import Published, Search
from ..case.source import shipped_cases
from ..errors import CaseError, EvaluationError, InputError
from ..interruption import Milestone, is_requested, reached
from ..program.formulation import formulate_each
from ..solver.multistart import solve_program
from ..solver.solve import solve
from ..system.jsonvalues import JsonValue, json_data
from .data import CaseResult
from .parts import RobotData
from .result import result_of

#: A result as JSON's own types.
JsonData: TypeAlias = dict[str, JsonValue]
#: Relative difference of F within which an argument of a flat optimum counts as reproduced.
FLAT = 1e-5
#: Starting points for the search over a single argument.
_STARTS = 8


@dataclass(frozen=True)
class ExpectedCheck:
    """A computed number beside the one that the case expects."""

    quantity: str
    expected: float | bool | str
    computed: JsonValue
    tolerance: float
    passed: bool


@dataclass(frozen=True)
class PublishedCheck:
    """A published number beside the computed one.

    Attributes:
        published: the printed number, and how the case marks it.
        computed: components of the computed number, empty when there is none.
        reproduced: whether a rule finds it reproduced.
        rule: the rule that decided, with its figures.
    """

    published: Published
    computed: tuple[float, ...]
    reproduced: bool
    rule: str

    @property
    def passed(self) -> bool:
        """Whether the number is reproduced where the case marks it so, and only there."""
        return self.reproduced == self.published.reproduced

    @property
    def verdict(self) -> str:
        """``reproduced``, ``not reproduced``, or ``newly changed``."""
        if not self.passed:
            return "newly changed"
        return "reproduced" if self.reproduced else "not reproduced"


@dataclass(frozen=True)
class CaseCheck:
    """Checks of a case.

    Attributes:
        name: name of the case.
        title: its title.
        expected: checks of its expected numbers.
        published: checks of its published numbers.
        seconds: wall time of the solve.
    """

    name: str
    title: str
    expected: tuple[ExpectedCheck, ...]
    published: tuple[PublishedCheck, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether everything holds."""
        return all(row.passed for row in self.expected) and all(row.passed for row in self.published)


def check(names: Sequence[str] | None = None) -> list[CaseCheck]:
    """Solve cases and check their expected and published values; a case that others refer to is solved once.

    Where the work is requested to stop, the cases that are checked by then are returned.

    Args:
        names: paths of case files, or bare names of shipped cases; left out, all shipped cases.

    Raises:
        InputError: a case, or one that it refers to, cannot be read.
    """
    solved: dict[str, CaseResult] = {}
    checks: list[CaseCheck] = []
    for name in names or shipped_cases():
        found = check_case(name, solved)
        if is_requested():  # an interrupted solve is no check
            break
        checks.append(found)
        reached(Milestone.CASE)
    return checks


def check_case(name: str, solved: dict[str, CaseResult] | None = None) -> CaseCheck:
    """Solve a case and check it.

    Args:
        name: path of a case file, or the bare name of a shipped case.
        solved: results of cases by name, for cases that refer to each other; new results are added.

    Raises:
        InputError: the case, or one that it refers to, cannot be read.
    """
    began = time.perf_counter()
    solved = {} if solved is None else solved
    case = load_case(name)
    result = _result_for(name, solved, case)
    data = json_data(result)
    return CaseCheck(
        name=case.name,
        title=case.title,
        expected=tuple(_check_expected(case, result, data)),
        published=tuple(_check_published(name, case, row, result, data, solved) for row in case.published),
        seconds=time.perf_counter() - began,
    )


def _result_for(name: str, solved: dict[str, CaseResult], case: Case | None = None) -> CaseResult:
    """Return the result of a case by name; each case is solved once.

    Args:
        name: of the case.
        solved: results by name; a new result is added.
        case: the case, where it is read already.
    """
    if name not in solved:
        case = case or load_case(name)
        solved[name] = result_of(solve(case))
    return solved[name]


def _check_expected(case: Case, result: CaseResult, data: JsonData) -> list[ExpectedCheck]:
    """Return the expected numbers of a case beside the computed ones, its status first."""
    expect = case.expect
    rows = [ExpectedCheck("status", "an answer", result.status.value, 0.0, result.status.is_answer)]
    if expect.F is not None:
        F = _number(data, "F")
        off = math.inf if F is None else abs(F - expect.F)
        rows.append(ExpectedCheck("F", expect.F, F, expect.tolerance, off <= expect.tolerance * (abs(expect.F) or 1.0)))
    if expect.singular is not None:
        singular = _lookup(data, "singular" if "F" in data else "combined.singular")
        rows.append(ExpectedCheck("singular", expect.singular, singular, 0.0, singular == expect.singular))
    for row in expect.values:
        value = _lookup(data, row.quantity)
        near = isinstance(value, float | int) and abs(value - row.value) <= row.within
        rows.append(ExpectedCheck(row.quantity, row.value, value, row.within, near))
    return rows


def _lookup(data: JsonValue, path: str) -> JsonValue:
    """Return the value at a dotted path of JSON data, where a number is an index in a list; None without one."""
    found = data
    for part in path.split("."):
        if isinstance(found, dict):
            found = found.get(part)
        elif isinstance(found, list) and part.isdigit() and int(part) < len(found):
            found = found[int(part)]
        else:
            return None
    return found


def _number(data: JsonValue, path: str) -> float | None:
    """Return the number at a dotted path of JSON data, or None where there is none."""
    found = _lookup(data, path)
    return float(found) if isinstance(found, float | int) else None


def _numbers(data: JsonValue, path: str) -> tuple[float, ...]:
    """Return the number, or the list of numbers, at a dotted path of JSON data; empty where there is neither."""
    found = _lookup(data, path)
    parts = found if isinstance(found, list) else [found]
    numbers = tuple(float(part) for part in parts if isinstance(part, float | int))
    return numbers if len(numbers) == len(parts) else ()


def _check_published(
    name: str, case: Case, row: Published, result: CaseResult, data: JsonData, solved: dict[str, CaseResult]
) -> PublishedCheck:
    """Return a published number beside the computed one, with the rule that decided.

    Raises:
        CaseError: the quantity is no number of the result, or has another number of components.
    """
    if row.over is None:
        computed = _numbers(data, row.quantity)
    else:
        over, F = _number(json_data(_result_for(row.over, solved)), "F"), _number(data, "F")
        computed = (100 * (F - over) / over,) if F is not None and over else ()
    if not result.status.is_answer:
        return PublishedCheck(row, (), False, f"the case has no answer: it is {result.status.value}")
    if len(computed) != len(row.value):
        source = case.source or name
        fault = f"is no number of this result with {len(row.value)} components"
        raise CaseError(f"published: {row.quantity}", fault, source=source)
    halves = [0.5 * 10.0 ** -(decimals_of(value) if row.decimals is None else row.decimals) for value in row.value]
    off = max(abs(c - v) / h for c, v, h in zip(computed, row.value, halves, strict=True))
    if off <= 1 + 1e-9:
        return PublishedCheck(row, computed, True, "digits")
    flat = _flat_difference(name, case, row, result)
    if flat is None:
        return PublishedCheck(row, computed, False, "digits")
    return PublishedCheck(row, computed, flat <= FLAT, f"flat: F is off its best by {flat:.1e}")


def decimals_of(value: float) -> int:
    """Return the number of digits behind the point of the shortest text of a number."""
    text = f"{value:.15g}"
    if "e" in text:
        return 15
    return len(text.partition(".")[2])


def _flat_difference(name: str, case: Case, row: Published, result: CaseResult) -> float | None:
    """Return the relative difference of F between the printed point and the best with this argument free.

    None when the number is no argument of F, or the printed point is no robot.
    """
    printed: dict[str, float | list[float]] = {}
    for each in case.published:
        printed.update(_argument_settings(case, each.quantity, each.value))
    own, robot = _argument_settings(case, row.quantity, row.value), result.robot
    if not own or robot is None:
        return None
    settings = {**_computed_settings(case, robot), **printed}
    try:
        at_printed = _best_objectives(load_case(name, settings))
        best = _best_objectives(load_case(name, {key: value for key, value in settings.items() if key not in own}))
    except (InputError, EvaluationError):
        return None
    differences = []
    for (F, size), (G, _) in zip(at_printed, best, strict=True):
        zero = max(F, G) <= FLAT**2 * size
        differences.append(0.0 if zero else abs(F - G) / max(F, G))
    return max(differences)


def _argument_settings(case: Case, quantity: str, value: Sequence[float]) -> Settings:
    """Return an argument of F as settings of the case; empty for another quantity."""
    path = quantity.removeprefix("combined.")
    if path == "pose.position":
        return dict(zip(component_names("p", 3), value, strict=True))
    if path in ("pose.angle", "pose.axis"):
        return {path.removeprefix("pose."): list(value) if path == "pose.axis" else value[0]}
    name = path.removeprefix("parameters.")
    if path.startswith("parameters.") and name in case.parameters:
        return {case.parameter_name(name): value[0] if len(value) == 1 else list(value)}
    return {}


def _computed_settings(case: Case, robot: RobotData) -> Settings:
    """Return the computed point as settings of the case."""
    settings: dict[str, float | list[float]] = {
        case.parameter_name(name): list(value) if isinstance(value, tuple) else value
        for name, value in robot.parameters.items()
    }
    settings |= dict(zip(component_names("p", 3), robot.pose.position, strict=True))
    settings["angle"] = robot.pose.angle
    settings["axis"] = list(robot.pose.axis) if case.axis is None else case.axis.tolist()
    return settings


def _best_objectives(case: Case) -> list[tuple[float, float]]:
    """Return the best F of each task over the numbers that are still free, and its size without cancellation."""
    values = []
    for nlp in formulate_each(case):
        solution = solve_program(nlp, Search(starts=_STARTS))
        if solution.state is None or not solution.status.is_answer:
            raise EvaluationError(f"no optimum: {solution.status.value}")
        values.append((solution.F, solution.state.size))
    return values

"""Checks of cases against expected and published values.

A case **expects** values of its result, with tolerances, and states values that the literature prints (**published**).
A published value is *reproduced* by one of two rules:

* ``digits``: the computed value is within half a unit of the last printed digit, in every component;
* ``flat``: for an argument of the optimum, F at the printed point is within 1e-5 of the best F with this argument free
  and the other printed arguments fixed. Where F is flat, fewer digits of an argument are significant than are printed.

A value is *newly changed*, and fails the check, where the case states the opposite about its reproduction.
"""

import math
import time
from collections.abc import Sequence
from typing import Annotated, TypeAlias

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
from ..system.jsonvalues import JsonObject, JsonValue, Key, Vector, json_data
from .data import CaseResult
from .parts import SCHEMA, RobotData, SchemaVersion
from .result import result_of

#: A result as JSON's own types.
JsonData: TypeAlias = dict[str, JsonValue]
#: Relative difference of F within which an argument of a flat optimum counts as reproduced.
FLAT = 1e-5
#: Starting points for the search over a single argument.
_STARTS = 8


class ExpectedCheck(JsonObject):
    """Comparison of a computed value with the value that the case expects.

    Attributes:
        quantity: dotted path in the case's result.
        expected: expected value.
        computed: value in the result; null if the result has none.
        tolerance: allowed difference.
        passed: If true, the values agree.
    """

    quantity: str
    expected: float | bool | str
    computed: object
    tolerance: float
    passed: bool


class PublishedCheck(JsonObject):
    """Comparison of a published value with the computed value.

    Attributes:
        quantity: dotted path in the case's result, or gain.
        value: printed value.
        source: place in the literature.
        reproduced: If true, the case states that the value is reproduced.
        because: reason why the value is not reproduced; empty if it is reproduced.
        decimals: number of printed decimals, if the value has trailing zeros.
        over: name of the reference case of a gain.
        computed: computed value; empty if there is none.
        verdict: verdict of the check.
        rule: rule of the verdict, with its computed difference.
        passed: If true, the check confirms the statement of the case.
    """

    quantity: str
    value: Vector
    source: str
    reproduced: bool
    because: str
    decimals: int | None
    over: str | None
    computed: Vector
    verdict: str
    rule: str
    passed: bool

    @property
    def is_reproduced(self) -> bool:
        """True if a rule finds the value reproduced."""
        return self.passed == self.reproduced


class CaseCheck(JsonObject):
    """Checks of one case.

    Attributes:
        name: name of the case.
        title: title of the case.
        passed: If true, all values are as expected.
        seconds: wall time.
        expected: comparisons with expected values.
        published: comparisons with published values.
    """

    name: Annotated[str, Key("case")]
    title: str
    passed: bool
    seconds: float
    expected: tuple[ExpectedCheck, ...]
    published: tuple[PublishedCheck, ...]


class ChecksResult(JsonObject):
    """Result of checking cases.

    Attributes:
        schema: version of the result's keys.
        passed: If true, all values are as expected.
        cases: checks of each case.
    """

    schema: SchemaVersion
    passed: bool
    cases: tuple[CaseCheck, ...]


def checks_of(checks: Sequence[CaseCheck]) -> ChecksResult:
    """Return the checks of several cases."""
    return ChecksResult(schema=SCHEMA, passed=all(check.passed for check in checks), cases=tuple(checks))


def check(names: Sequence[str] | None = None) -> list[CaseCheck]:
    """Solve cases and check their expected and published values; a case to which other cases refer is solved once.

    After a request to stop, the cases that are checked so far are returned.

    Args:
        names: paths of case files, or names of shipped cases; None for all shipped cases.

    Raises:
        InputError: a case, or a case to which it refers, cannot be read.
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
        name: path of a case file, or name of a shipped case.
        solved: results of cases by name, for cases that refer to each other; new results are added.

    Raises:
        InputError: the case, or a case to which it refers, cannot be read.
    """
    began = time.perf_counter()
    solved = {} if solved is None else solved
    case = load_case(name)
    result = _result_for(name, solved, case)
    data = json_data(result)
    expected = tuple(_check_expected(case, result, data))
    published = tuple(_check_published(name, case, row, result, data, solved) for row in case.published)
    return CaseCheck(
        name=case.name,
        title=case.title,
        passed=all(row.passed for row in expected) and all(row.passed for row in published),
        seconds=time.perf_counter() - began,
        expected=expected,
        published=published,
    )


def _result_for(name: str, solved: dict[str, CaseResult], case: Case | None = None) -> CaseResult:
    """Return the result of a case by name; each case is solved once.

    Args:
        name: name of the case.
        solved: results by name; a new result is added.
        case: the case; None to read it first.
    """
    if name not in solved:
        case = case or load_case(name)
        solved[name] = result_of(solve(case))
    return solved[name]


def _check_expected(case: Case, result: CaseResult, data: JsonData) -> list[ExpectedCheck]:
    """Return the comparisons with the expected values of a case, its status first."""
    expect, rows = case.expect, list[ExpectedCheck]()

    def add(quantity: str, expected: float | bool | str, computed: object, tolerance: float, *, passed: bool) -> None:
        rows.append(
            ExpectedCheck(quantity=quantity, expected=expected, computed=computed, tolerance=tolerance, passed=passed)
        )

    add("status", "an answer", result.status.value, 0.0, passed=result.status.is_answer)
    if expect.F is not None:
        F = _number(data, "F")
        off = math.inf if F is None else abs(F - expect.F)
        add("F", expect.F, F, expect.tolerance, passed=off <= expect.tolerance * (abs(expect.F) or 1.0))
    if expect.singular is not None:
        singular = _lookup(data, "singular" if "F" in data else "combined.singular")
        add("singular", expect.singular, singular, 0.0, passed=singular == expect.singular)
    for row in expect.values:
        value = _lookup(data, row.quantity)
        near = isinstance(value, float | int) and abs(value - row.value) <= row.within
        add(row.quantity, row.value, value, row.within, passed=near)
    return rows


def _lookup(data: JsonValue, path: str) -> JsonValue:
    """Return the value at a dotted path of JSON data, or None; a number in the path is an index in a list."""
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
    """Return the number at a dotted path of JSON data, or None if there is none."""
    found = _lookup(data, path)
    return float(found) if isinstance(found, float | int) else None


def _numbers(data: JsonValue, path: str) -> tuple[float, ...]:
    """Return the number, or the list of numbers, at a dotted path of JSON data; empty if there is neither."""
    found = _lookup(data, path)
    parts = found if isinstance(found, list) else [found]
    numbers = tuple(float(part) for part in parts if isinstance(part, float | int))
    return numbers if len(numbers) == len(parts) else ()


def _check_published(
    name: str, case: Case, row: Published, result: CaseResult, data: JsonData, solved: dict[str, CaseResult]
) -> PublishedCheck:
    """Return the comparison with a published value, and the rule that decided.

    Raises:
        CaseError: the quantity is no value of the result, or has another number of components.
    """
    if row.over is None:
        computed = _numbers(data, row.quantity)
    else:
        over, F = _number(json_data(_result_for(row.over, solved)), "F"), _number(data, "F")
        computed = (100 * (F - over) / over,) if F is not None and over else ()
    if not result.status.is_answer:
        return _published(row, (), f"the case has no answer: it is {result.status.value}", found=False)
    if len(computed) != len(row.value):
        source = case.source or name
        fault = f"must name a quantity of the result, with {len(row.value)} component{'s' * (len(row.value) != 1)}"
        raise CaseError(f"published: {row.quantity}", fault, source=source)
    halves = [0.5 * 10.0 ** -(decimals_of(value) if row.decimals is None else row.decimals) for value in row.value]
    off = max(abs(c - v) / h for c, v, h in zip(computed, row.value, halves, strict=True))
    if off <= 1 + 1e-9:
        return _published(row, computed, "digits", found=True)
    flat = _flat_difference(name, case, row, result)
    if flat is None:
        return _published(row, computed, "digits", found=False)
    return _published(
        row, computed, f"flat: F at the printed value is off the best F by {flat:.1e}", found=flat <= FLAT
    )


def _published(row: Published, computed: tuple[float, ...], rule: str, *, found: bool) -> PublishedCheck:
    """Return the check of a published value that a rule finds reproduced or not."""
    passed = found == row.reproduced
    verdict = "newly changed" if not passed else "reproduced" if found else "not reproduced"
    return PublishedCheck.of(row, computed=computed, verdict=verdict, rule=rule, passed=passed)


def decimals_of(value: float) -> int:
    """Return the number of decimals of the shortest text of a number."""
    text = f"{value:.15g}"
    if "e" in text:
        return 15
    return len(text.partition(".")[2])


def _flat_difference(name: str, case: Case, row: Published, result: CaseResult) -> float | None:
    """Return the relative difference of F between the printed value of a variable and its optimal value.

    None if the printed value is not a variable of F, or the robot cannot be assembled at the printed point.
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
    """Return the best F of each task over the remaining variables, and the sum of the magnitudes of its terms."""
    values = []
    for nlp in formulate_each(case):
        solution = solve_program(nlp, Search(starts=_STARTS))
        if solution.state is None or not solution.status.is_answer:
            raise EvaluationError(f"no optimum: {solution.status.value}")
        values.append((solution.F, solution.state.size))
    return values

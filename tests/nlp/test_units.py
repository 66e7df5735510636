"""Results are the same in every unit of length: each number up to its power of the unit, and each word."""

from __future__ import annotations

import copy
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import pytest

from screwsynth.models import Dimension, Model, robot_function
from screwsynth.models.catalog import SHIPPED, gallery_names
from screwsynth.nlp import Case, case_from_tables, json_data, result_of, solve
from screwsynth.nlp.case.starter import starter_case
from screwsynth.nlp.evidence import state
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.program.formulation import formulate_each
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.results.evaluation import evaluation_of
from screwsynth.nlp.results.summary import case_summary, evaluation_summary
from screwsynth.nlp.results.text import Line, TextTable
from screwsynth.nlp.results.workspace import workspace_of
from screwsynth.nlp.results.workspacewording import workspace_summary

Tables = dict[str, Any]
Make = Callable[[Case], tuple[object, Iterable[Line | TextTable]]]

#: Lengths of each unit in a metre.
UNITS = {"m": 1.0, "mm": 1e3, "inch": 1 / 0.0254, "um": 1e6}
ROBOTS = (*SHIPPED, *gallery_names())
#: Numbers that no unit changes, but time and rounding do.
EFFORT = re.compile(r"(^|\.)(seconds|boxes|open|share|iterations)$|\.(case|screwsynth|versions)\.?")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)")


def tables_of(model: Model, unit: str) -> Tables:
    """The starter of a robot, whose lengths are metres, in another unit."""
    tables, f = tomllib.loads(starter_case(model)), UNITS[unit]
    tables["units"]["length"] = unit
    tables["solve"]["starts"] = 4
    for item in model.parameters:
        if item.dimension is Dimension.LENGTH:
            tables["robot"]["parameters"][item.name] = times(tables["robot"]["parameters"][item.name], f)
    if model.has_couples:
        tables["robot"]["characteristic_length"] *= f
    tables["pose"]["position"] = times(tables["pose"]["position"], f)
    for task in tables["task"]:
        task["point"], task["pitch"] = times(task["point"], f), times(task["pitch"], f)
    return tables


def times(value: Any, factor: float) -> Any:  # noqa: ANN401 - a part of a table
    if isinstance(value, dict):
        return {key: times(each, factor) for key, each in value.items()}
    return [times(each, factor) for each in value] if isinstance(value, list) else value * factor


def leaves(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict | list | tuple):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, each in items:
            yield from leaves(each, f"{path}.{key}")
    elif not EFFORT.search(path):
        yield path, value


def words(text: str, unit: str) -> str:
    """A text without its numbers and its unit of length."""
    text = re.sub(rf"(?<![A-Za-z]){unit}(?![A-Za-z_])", "LENGTH", text)
    return " ".join(NUMBER.sub("#", text).split())


def lines(items: Iterable[Line | TextTable], unit: str) -> list[str]:
    found = []
    for item in items:
        if isinstance(item, Line):
            found.append(f"{item.label}: {item.words}")
            continue
        rows = [item.headers, *item.rows]
        found += [" | ".join(each.words if isinstance(each, Line) else str(each) for each in row) for row in rows]
        found.append(f"{item.title} {item.folded}")
    return [words(each, unit) for each in found if not each.startswith(("evidence:", "starts:", "  time"))]


def check(model: Model, make: Make, units: Iterable[str], within: float = 1e-5) -> None:
    found = {}
    for unit in ("m", *units):
        case = case_from_tables(tables_of(model, unit), name=model.name, source=model.name)
        data, text = make(case)
        found[unit] = dict(leaves(data)), lines(text, unit)
    for unit in units:
        (first, text), (other, other_text), f = found["m"], found[unit], UNITS[unit]
        assert other_text == text
        assert other.keys() == first.keys()
        for key, a in first.items():
            b = other[key]
            if isinstance(a, str) and isinstance(b, str):
                assert words(b, unit) == words(a, "m"), key
            elif a is None or isinstance(a, bool) or isinstance(b, str):
                assert a == b, key
            elif not (abs(a) < 1e-8 and abs(b) < 1e-8 * f**2):
                assert a * b > 0, key
                power = round(math.log(b / a) / math.log(f))
                assert b == pytest.approx(a * f**power, rel=within), key
                assert abs(power) <= 4, key


def evaluated(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
    programs = formulate_each(case)
    x = closed_start(programs[0])
    found = evaluation_of(programs, x, [state.evaluate(each, x) for each in programs])
    return json_data(found), evaluation_summary(case, found)


def solved(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
    found = result_of(solve(case))
    return json_data(found), case_summary(case, found)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_point_is_the_same_in_every_unit(name: str) -> None:
    check(robot_function(name)(), evaluated, ["mm", "um"])


#: The optima of this robot's starter are a set, of which rounding chooses a point.
@pytest.mark.slow
@pytest.mark.parametrize("name", [each for each in ROBOTS if each != "tripteron"])
def test_a_solve_is_the_same_in_every_unit(name: str) -> None:
    check(robot_function(name)(), solved, ["mm", "inch", "um"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "half", "angle"), [("delta", 0.05, None), ("stewart-gough", 1.0, 5), ("hexapod", 1.0, 5)]
)
def test_a_workspace_is_the_same_in_every_unit(name: str, half: float, angle: float | None) -> None:
    model = robot_function(name)()

    def judged(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
        tables, f = tables_of(model, case.units.length), UNITS[case.units.length]
        tables = copy.deepcopy(tables)
        middle = [(each["min"] + each["max"]) / 2 for each in tables["pose"]["position"]]
        for key, value in tables["robot"]["parameters"].items():
            several = value if isinstance(value, list) else [value]
            fixed = [(each["min"] + each["max"]) / 2 if isinstance(each, dict) else each for each in several]
            tables["robot"]["parameters"][key] = fixed if isinstance(value, list) else fixed[0]
        tables["pose"] = {"position": middle}
        tables["workspace"] = {"position": [{"min": each - half * f, "max": each + half * f} for each in middle]}
        if angle is not None:
            tables["workspace"]["rotation"] = {"angle": {"min": -angle, "max": angle}}
            tables["limits"] = {"leg_length": {"min": 20 * f, "max": 50 * f}, "leg_clearance": {"min": 0.1 * f}}
        held = case_from_tables(tables, name=name, source=name)
        found = workspace_of(judge_workspace(held))
        assert found.regular.outcome.name == "PROVED"
        data = json_data(found)
        for each in data["extremes"]:
            # Of poses that are images of each other, rounding chooses one.
            each.pop("pose", None)
        return data, workspace_summary(held, found)

    # Bounds are proved up to a gap, within which the boxes' rounding chooses.
    check(model, judged, ["mm", "um"], within=1e-3)

"""Designs in round numbers: the best neighbours that keep every limit, found by brute force too, and proved again."""

import itertools
import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import Run, case_from, output_of, refusal_of, saved, shipped_tables, unbroken

from screwsynth.nlp import Solution, certify, result_of, round_design, solve
from screwsynth.nlp.case.writer import case_text
from screwsynth.nlp.results.schema import result_schema

#: Dimensions that a solve leaves off the round numbers, one by a bound, and one by a limit.
FREE = {
    "x1": {"min": 6, "max": 14.3},
    "x2": {"min": 5, "max": 9.5},
    "x3": {"min": 20, "max": 28.5},
    "x4": {"min": 0, "max": 30},
}


def tables_with(free: dict[str, Any], **tables: object) -> dict[str, Any]:
    found = {**shipped_tables("paper-4.1-helical-axis-z"), **tables}
    found["robot"]["parameters"] |= free
    found["solve"] = {"starts": 4}
    return found


def dimensions(solution: Solution) -> dict[str, float]:
    robot = result_of(solution).robot
    assert robot is not None
    return {name: float(value) for name, value in robot.parameters.items() if not isinstance(value, tuple)}


@pytest.mark.parametrize("step", [1.0, 0.1])
def test_the_best_of_all_neighbours_is_found(step: float) -> None:
    tables = tables_with(FREE, limits={"leg_length": {"max": 46.87}})
    before = solve(case_from(tables))
    found = round_design(before, step)
    assert found.status.is_answer
    assert found.rounding is not None
    assert found.rounding.farther == 0
    own = dimensions(before)
    near = []
    for name, value in own.items():
        low, high = FREE[name]["min"], FREE[name]["max"]
        steps = {math.floor(value / step + 1e-9), math.ceil(value / step - 1e-9)}
        near.append([float(f"{k * step:.6f}") for k in steps if low - 1e-9 <= k * step <= high + 1e-9])
    every = {}
    for combination in itertools.product(*near):
        tables["robot"]["parameters"] |= dict(zip(own, combination, strict=True))
        solution = solve(case_from(tables))
        if solution.status.is_answer:
            every[combination] = solution.F
    best = max(every, key=every.__getitem__)
    assert pytest.approx(every[best], rel=1e-9) == found.F
    assert tuple(dimensions(found).values()) == pytest.approx(best, rel=1e-14)
    result = result_of(found)
    assert result.rounding is not None
    assert result.rounding.loss == pytest.approx(before.F - every[best], rel=1e-6)
    assert result.rounding.loss > 0
    lengths = result.robot.quantities["leg_length"]
    assert max(lengths.values()) <= 46.87 * (1 + 1e-9)
    certified = certify(found)
    assert certified.is_proved
    assert certified.certificate is not None
    assert "with the rounded dimensions" in certified.certificate.statement
    assert certified.certificate.bound == pytest.approx(found.F, rel=1.1e-4)
    assert step < 1 or certified.certificate.bound < before.F


def test_farther_multiples_are_tried_where_the_nearest_break_a_limit() -> None:
    # x1 is at most 10.1, or between 11.2 and 11.8, where F is larger: 11 and 12 break the limit.
    relation = "(x1 - 10.1) * (x1 - 11.2) * (x1 - 11.8) <= 0"
    free = {"x1": {"min": 6, "max": 14}, "x2": 8, "x3": 30, "x4": 8}
    before = solve(case_from(tables_with(free, limits={"custom": [relation]})))
    assert dimensions(before)["x1"] == pytest.approx(11.8)
    found = round_design(before, 1)
    assert found.status.is_answer
    assert dimensions(found)["x1"] == 10
    assert found.rounding is not None
    assert found.rounding.farther == 1


def test_none_is_found_and_refusals_are_one_sentence(tmp_path: Path, cli: Run) -> None:
    free = {"x1": {"min": 6, "max": 14}, "x2": 8, "x3": 30, "x4": 8}
    path = saved(tmp_path / "case.toml", case_text(case_from(tables_with(free, limits={"custom": ["x1 == 7.5"]}))))
    status, said, _ = cli("solve", str(path), "--round", "1")
    assert status == 1
    assert "rounded  to multiples of 1 cm: no multiples within 4 steps were found that keep all limits" in unbroken(
        said
    )
    sentence = "--round 20: robot.parameters.x1 has no multiple of it between 6 and 14 cm"
    refusal_of(cli("solve", str(path), "--round", "20"), sentence)
    refusal_of(cli("solve", str(path), "--round", "-1"), "--round -1: must be positive and finite")
    refusal_of(cli("solve", str(path), "--round", "x"), "--round x: must be a number")
    fixed = "--round 1: the case has no free length or angle of the robot to round"
    refusal_of(cli("solve", "paper-4.1-helical", "--round", "1"), fixed)


def test_round_numbers_alone_are_called_the_largest(tmp_path: Path, cli: Run) -> None:
    tables = tables_with({"x1": {"min": 6, "max": 11.3}}, pose={"position": [0, 0, 30]})
    said = output_of(cli("solve", str(saved(tmp_path / "case.toml", case_text(case_from(tables)))), "--round", "1"))
    tables["robot"]["parameters"]["x1"] = 11
    assert f"largest F = {solve(case_from(tables)).F:.7g} (cm/rad)²   (rounded)" in said


def test_the_result_says_what_was_rounded_and_lost(tmp_path: Path, cli: Run) -> None:
    values = {"x1": {"values": [9, 11.5]}, "x2": {"min": 5, "max": 9.4}, "x3": 30, "x4": {"min": 0, "max": 30}}
    path = saved(tmp_path / "case.toml", case_text(case_from(tables_with(values))))
    target = tmp_path / "result.json"
    said = output_of(cli("solve", str(path), "--round", "0.5", "--json", str(target)))
    assert "values  x1 = 11.5 cm: the best of 2 combinations" in said
    assert "rounded  to multiples of 0.5 cm and 0.5 deg: the best of " in said
    result = json.loads(target.read_text(encoding="utf-8"))
    jsonschema.validate(result, result_schema())
    numbers = {each["name"]: each for each in result["rounding"]["numbers"]}
    assert list(numbers) == ["x2", "x4"]
    for name, each in numbers.items():
        assert np.mod(each["value"], 0.5) == pytest.approx(0)
        assert result["parameters"][name] == pytest.approx(each["value"])
        assert abs(each["value"] - each["before"]) < 0.5
    assert result["rounding"]["before"] - result["F"] == pytest.approx(result["rounding"]["loss"])
    assert result["rounding"]["relative_loss"] == pytest.approx(
        result["rounding"]["loss"] / result["rounding"]["before"]
    )

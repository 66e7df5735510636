"""The shipped hexapod machine tool: what its limits cost, and limits that cannot all hold; designs in round numbers."""

from __future__ import annotations

import copy
import itertools
import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import Array, Run, case_from, output_of, refusal_of, saved, shipped_tables, unbroken
from measures import leg_measures, placed_joints

from screwsynth.nlp import Search, Solution, Status, certify, formulate, json_data, result_of, round_design, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.writer import case_text
from screwsynth.nlp.evidence.tolerance import BuiltRobot
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.compromise import solution_of_one_task
from screwsynth.nlp.solver.multistart import solve_program
from screwsynth.nlp.words.numbers import key_words

TABLES = tomllib.loads(find_case("hexapod-machining").read_text(encoding="utf-8"))


def changed(*path: str | int, to: Any) -> dict[str, Any]:  # noqa: ANN401 - whatever TOML can hold
    """The tables of the case with one thing changed."""
    tables = copy.deepcopy(TABLES)
    place: Any = tables
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = to
    return tables


@pytest.fixture(scope="module")
def limited() -> Solution:
    return solve(case_from(TABLES, "machine"))


def again(tables: dict[str, Any], near: Solution) -> Solution:
    case = case_from(tables, "machine")
    return solution_of_one_task(case, solve_program(formulate(case), Search(starts=1), first=[near.x]))


def slacks(result: dict[str, Any]) -> dict[str, float]:
    """How far inside each limit of the case a design is, by NumPy alone."""
    limits = TABLES["limits"]
    b, a, _ = placed_joints(result)
    R, p = np.array(result["pose"]["rotation_matrix"]), np.array(result["pose"]["position"])
    at_home = np.array(limits["home"]["position"]) + a - b
    squares = np.array(result["rates"]) ** 2
    found = leg_measures(b, a, R, p, at_home, at_home @ R.T) | {"rate_share.max": squares.max() / squares.sum()}
    inside = {}
    for key, value in found.items():
        name, side = key.split(".")
        shown = math.degrees(value) if "angle" in name else value
        inside[key] = (shown - limits[name][side]) * (1 if side == "min" else -1)
    return inside


def test_the_limited_design_keeps_every_limit_and_is_found_from_many_starts(limited: Solution) -> None:
    assert limited.status is Status.OPTIMAL
    assert len(limited.starts) == 64
    # Screening finds several optima, most of which Ipopt passes by: its barrier leads nearly every start to the best.
    assert limited.optima[0].count >= 0.4 * 64
    by_ipopt = solve(replace(limited.case, search=replace(limited.case.search, starts=16, screen=False)))
    assert by_ipopt.optima[0].count >= 0.9 * 16
    assert pytest.approx(limited.F, rel=1e-9) == by_ipopt.F
    result = json_data(result_of(limited))
    found = slacks(result)
    assert set(found) == {row["key"] for row in result["limits"]}
    assert min(found.values()) >= -1e-8
    for row in result["limits"]:
        assert row["margin"] == pytest.approx(found[row["key"]], abs=1e-7)


def test_the_unlimited_optimum_cannot_be_built(limited: Solution) -> None:
    tables = copy.deepcopy(TABLES)
    del tables["limits"]
    free = solve(case_from(tables, "machine"))
    assert free.F > limited.F
    violated = [key for key, slack in slacks(json_data(result_of(free))).items() if slack < -0.01]
    assert len(violated) >= 3, violated


KEYS = [("joint_spacing", "min"), ("footprint", "base"), ("footprint", "platform"), ("leg_length", "min")]
KEYS += [("leg_length", "max"), ("rate_share", "max")]


@pytest.mark.parametrize("key", KEYS, ids=".".join)
def test_each_cost_is_what_moving_the_limit_does(limited: Solution, key: tuple[str, str]) -> None:
    number = TABLES["limits"][key[0]][key[1]]
    row = next(row for row in json_data(result_of(limited))["limits"] if row["key"] == ".".join(key))
    assert row["active"]
    step = 1e-4 * number
    high, low = (again(changed("limits", *key, to=number + s * step), limited) for s in (1, -1))
    assert high.status is low.status is Status.OPTIMAL
    assert row["cost"] == pytest.approx((high.F - low.F) / (2 * step), rel=0.01)


IMPOSSIBLE = {
    # The platform's circle is at most 12.5 in: six joints 13 in apart do not fit on it.
    "spacing": (("joint_spacing", "min"), 13.0, {"joint_spacing.min", "footprint.platform"}),
    # The platform stands at least 16 in above the base.
    "short": (("leg_length", "max"), 15.0, {"leg_length.max"}),
    # Six rates that are each less than a tenth of F do not add up to F.
    "shares": (("rate_share", "max"), 0.1, {"rate_share.max"}),
    # Joints of neighbouring legs are no farther apart than the platform's circle lets them be.
    "clearance": (("leg_clearance", "min"), 13.0, {"leg_clearance.min", "footprint.platform"}),
    # Footprints that exclude the smallest radii that the case allows.
    "base": (("footprint", "base"), 18.0, {"footprint.base"}),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_an_impossible_variant_names_the_limit_and_by_how_much(name: str) -> None:
    key, number, culprits = IMPOSSIBLE[name]
    tables = changed("limits", *key, to=number)
    tables["solve"]["starts"] = 4
    if key == ("leg_length", "max"):
        del tables["limits"]["leg_length"]["min"]
    solution = solve(case_from(tables, "machine"))
    assert solution.status is Status.INFEASIBLE
    assert not json_data(result_of(solution))["F"]
    moved = {row.key: row for row in solution.relaxation}
    assert moved
    assert set(moved) <= culprits
    # With what is said to be needed there is a design, and with a little less there is none.
    for part, status in ((1.001, Status.OPTIMAL), (0.98, Status.INFEASIBLE)):
        relaxed = copy.deepcopy(tables)
        for row in moved.values():
            limit, side = row.key.split(".")
            relaxed["limits"][limit][side] = row.limit + part * (row.needed - row.limit)
        assert solve(case_from(relaxed, "machine")).status is status, part


def test_the_command_says_what_would_make_it_possible(cli: Run, tmp_path: Path) -> None:
    text = find_case("hexapod-machining").read_text(encoding="utf-8")
    path = saved(tmp_path / "small.toml", text.replace("base = 28", "base = 18"))
    code, out, _ = cli("solve", str(path), "--starts", "2")
    assert code == 1
    assert "would be feasible with footprint.base = 20 in instead of 18 in" in out
    code, out, _ = cli("solve", str(path), "--starts", "2", "--json", "-")
    result = json.loads(out)
    assert (code, result["status"], result["F"]) == (1, "infeasible", None)
    (row,) = result["relaxation"]
    assert (row["key"], row["needed"]) == ("footprint.base", pytest.approx(20, abs=1e-3))
    assert all(row["cost"] is None for row in result["margins"])


#: The machine with a few of its dimensions fixed, and with them as they are.
FIXED = {"x1": 27.0, "x4": 9.5}


def test_sensitivities_are_what_moving_a_fixed_number_does() -> None:
    def tables_at(name: str = "", step: float = 0.0) -> dict[str, Any]:
        tables = copy.deepcopy(TABLES)
        tables["solve"]["starts"] = 8
        moved = FIXED | {"p_z": 20.0}
        moved[name] = moved.get(name, 0.0) + step
        tables["robot"]["parameters"] |= {key: moved[key] for key in FIXED}
        tables["pose"]["position"][2] = moved["p_z"]
        return tables

    solution = solve(case_from(tables_at(), "machine"))
    rows = {row["name"]: row for row in json_data(result_of(solution))["sensitivity"]}
    assert {name: row["value"] for name, row in rows.items()} == pytest.approx(FIXED | {"p_z": 20.0})
    for name, row in rows.items():
        high, low = (again(tables_at(name, step), solution).F for step in (1e-4, -1e-4))
        assert row["derivative"] == pytest.approx((high - low) / 2e-4, rel=0.01, abs=1e-4), name


def F_of(b: Array, ends: Array, twist: Array) -> float:  # noqa: N802 - the objective's name
    forces = (ends - b) / np.linalg.norm(ends - b, axis=1, keepdims=True)
    rates = np.cross(b, forces) @ twist[:3] + forces @ twist[3:]
    return float(rates @ rates)


def test_the_loss_by_inexact_joints_is_the_worst_that_sampling_finds(limited: Solution) -> None:
    result = json_data(result_of(limited))
    b, a, _ = placed_joints(result)
    R, p = np.array(result["pose"]["rotation_matrix"]), np.array(result["pose"]["position"])
    twist, tolerance = np.array(result["task"]["twist"]), TABLES["tolerance"]["joint_centre"]
    exact = F_of(b, p + a @ R.T, twist)
    random = np.random.default_rng(5)
    gradients = np.array([row["gradient"] for row in result["tolerance"]["joints"]])
    uphill = gradients / np.linalg.norm(gradients, axis=1, keepdims=True)
    losses = []
    for spread in (0.0, 0.1, 0.5, *np.full(300, np.inf)):
        errors = random.normal(size=(12, 3)) if spread == np.inf else -uphill + spread * random.normal(size=(12, 3))
        errors *= tolerance / np.linalg.norm(errors, axis=1, keepdims=True)
        losses.append(exact - F_of(b + errors[::2], p + (a + errors[1::2]) @ R.T, twist))
    loss = result["tolerance"]["loss"]
    assert losses[0] == pytest.approx(result["tolerance"]["loss_there"], rel=1e-6)
    assert max(losses) == losses[0]
    assert losses[0] == pytest.approx(loss, rel=2e-3)
    assert max(losses[3:]) > 0.2 * loss


@pytest.mark.parametrize("axes", ["tsai", "limb", "free"])
def test_joint_errors_of_a_robot_with_couples_are_those_of_moved_joints(axes: str) -> None:
    tables = {
        "robot": {"model": "three-upu", "axes": axes, "parameters": {"base_radius": 50, "platform_radius": 25}},
        "pose": {"position": [{"min": -5, "max": 5}, 2, 60], "rotation": {"axis": [1, 1, 0], "angle": 10}},
        "task": [{"sense": "max", "axis": [1, 2, 3], "point": [4, 0, 10], "pitch": 2}],
        "solve": {"starts": 2},
    }
    if axes != "tsai":
        for k in range(3):
            c, s = math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3)
            tables["robot"]["parameters"] |= {f"u1_{k + 1}": [c, s, 0.0]}
            if axes == "free":
                tables["robot"]["parameters"] |= {f"u2_{k + 1}": [-s, c, 0.0]}
    nlp = formulate(case_from(tables, "machine"))
    x = np.array([1.5])
    robot = BuiltRobot(nlp, x)
    exact, (gradient,) = robot.evaluate(np.zeros((6, 3)))
    assert exact == pytest.approx(nlp.evaluate(x)[0], rel=1e-12)
    # A larger base circle moves every base joint outwards.
    radial = np.zeros((6, 3))
    for k in range(3):
        radial[2 * k, :2] = math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3)
    ends = []
    for radius in (50 + 1e-4, 50 - 1e-4):
        tables["robot"]["parameters"]["base_radius"] = radius
        ends.append(formulate(case_from(tables, "machine")).evaluate(x)[0])
    assert float((gradient * radial).sum()) == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-5)


#: Dimensions that a solve leaves off the round numbers, one by a bound, and one by a limit.
RANGES = {"x1": {"min": 6, "max": 14.3}, "x2": {"min": 5, "max": 9.5}, "x3": {"min": 20, "max": 28.5}}
RANGES |= {"x4": {"min": 0, "max": 30}}
#: One free radius.
ONE = {"x1": {"min": 6, "max": 14}, "x2": 8, "x3": 30, "x4": 8}


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
    tables = tables_with(RANGES, limits={"leg_length": {"max": 46.87}})
    before = solve(case_from(tables))
    found = round_design(before, step)
    assert found.status.is_answer
    assert found.rounding is not None
    assert found.rounding.farther == 0
    own = dimensions(before)
    near = []
    for name, value in own.items():
        low, high = RANGES[name]["min"], RANGES[name]["max"]
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
    before = solve(case_from(tables_with(ONE, limits={"custom": [relation]})))
    assert dimensions(before)["x1"] == pytest.approx(11.8)
    found = round_design(before, 1)
    assert found.status.is_answer
    assert dimensions(found)["x1"] == 10
    assert found.rounding is not None
    assert found.rounding.farther == 1


def test_none_is_found_and_refusals_are_one_sentence(tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / "case.toml", case_text(case_from(tables_with(ONE, limits={"custom": ["x1 == 7.5"]}))))
    status, said, _ = cli("solve", str(path), "--round", "1")
    assert status == 1
    none = "rounded  to multiples of 1 cm: no multiples within 4 steps were found that satisfy all limits"
    assert none in unbroken(said)
    sentence = "--round 20: robot.parameters.x1 has no multiple of the step between 6 and 14 cm"
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
    assert "chosen values  x1 = 11.5 cm: the best of 2 combinations" in said
    assert "rounded  to multiples of 0.5 cm and 0.5 deg: the best of " in said
    result = json.loads(target.read_text(encoding="utf-8"))
    jsonschema.validate(result, result_schema())
    numbers = {each["name"]: each for each in result["rounding"]["numbers"]}
    assert list(numbers) == ["x2", "x4"]
    for name, each in numbers.items():
        assert np.mod(each["value"], 0.5) == pytest.approx(0)
        assert result["parameters"][name] == pytest.approx(each["value"])
        assert abs(each["value"] - each["before"]) < 0.5
    loss, before = (result["rounding"][key] for key in ("loss", "before"))
    assert before - result["F"] == pytest.approx(loss)
    assert result["rounding"]["relative_loss"] == pytest.approx(loss / before)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("limits.leg_length.max", "maximum leg length"),
        ("smallest leg_length.max", "smallest maximum leg length"),
        ("limits.footprint.base", "footprint base"),
        ("task.pitch", "task pitch"),
        ("x1", "x1"),
        ("F of drill of 3.5 mm", "F of drill of 3.5 mm"),
    ],
)
def test_keys_of_axes_and_headings_are_words(text: str, words: str) -> None:
    assert key_words(text) == words

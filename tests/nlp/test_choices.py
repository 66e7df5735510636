"""Values from a catalogue: the best combination is that of brute force over cases with these values fixed."""

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import Run, case_from, case_tables, output_of, refusal_of, saved, shipped_tables, unbroken

from screwsynth.nlp import CaseError, Free, certify, load_case, report, result_of, solve
from screwsynth.nlp.case.writer import case_text
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.solution import Choice, ChoicePart

#: Angles are degrees: layouts whose platform turns about z alone, so that proofs are quick.
CASE = "paper-4.1-helical-axis-z"


def tables_with(values: dict[str, list[float]], sense: str = "max", **tables: object) -> dict[str, Any]:
    """The paper's case with values of some dimensions to choose from."""
    found = case_tables(CASE, solve={"starts": 4}, **tables)
    found["task"][0]["sense"] = sense
    found["robot"]["parameters"] |= {name: {"values": each} for name, each in values.items()}
    return found


def brute_force(values: dict[str, list[float]], tables: dict[str, Any]) -> dict[tuple[float, ...], float]:
    """The optimum of every combination that has one, each solved as a case with these numbers fixed."""
    found = {}
    for combination in itertools.product(*values.values()):
        tables["robot"]["parameters"] |= dict(zip(values, combination, strict=True))
        solution = solve(case_from(tables))
        if solution.status.is_answer:
            value = solution.F if solution.combination is None else solution.combination.value
            found[combination] = float(value or 0.0)
    return found


FEW = {"x1": [14.0, 10, 12], "x4": [4.0, 20]}
MANY = {"x1": [9.0, 11, 12, 14], "x2": [6.0, 9, 8], "x4": [3.0, 14, 22]}


@pytest.mark.parametrize(("sense", "values"), [("max", FEW), ("min", FEW), ("max", MANY)])
def test_the_best_combination_is_that_of_brute_force_and_is_proved(sense: str, values: dict[str, list[float]]) -> None:
    tables = tables_with(values, sense)
    case = case_from(tables)
    every = brute_force(values, tables)
    best = max(every, key=every.__getitem__) if sense == "max" else min(every, key=every.__getitem__)
    solution = solve(case)
    assert solution.choice.is_complete
    assert solution.choice.combinations == len(every) == np.prod([len(each) for each in values.values()])
    if values is MANY:
        assert solution.choice.solved + solution.choice.relaxed < len(every) / 2
    result = result_of(solution)
    assert [result.robot.parameters[name] for name in values] == pytest.approx(best)
    assert pytest.approx(every[best], rel=1e-9) == solution.F
    certified = certify(solution)
    assert certified.is_proved
    beyond = np.array(list(every.values())) - certified.certificate.bound
    assert (beyond <= 0).all() if sense == "max" else (beyond >= 0).all()
    assert certified.certificate.bound == pytest.approx(every[best], rel=1.1e-4)
    assert f"any of the {len(every)} combinations of values" in certified.certificate.statement
    assert pytest.approx(every[best], rel=1e-9) == certified.solution.F


@pytest.mark.parametrize("cost", [None, -1e9, -1.0])
def test_a_proof_finds_the_best_combination_where_the_solve_did_not(cost: float | None) -> None:
    # The first combination is said to be the best, and nothing or something wrong to be known of all others together.
    case = case_from(tables_with(FEW))
    solution = solve(case)
    first = ChoicePart(((0, 1), (0, 1)), cost)
    misled = Choice(6, 1, 1, True, (ChoicePart(((0, 3), (0, 2)), cost), first), first.ranges)
    certified = certify(replace(solution, choice=misled))
    assert certified.is_proved
    assert certified.certificate.was_beaten
    assert certified.certificate.incumbent == pytest.approx(solution.F, rel=1e-9)
    assert solution.F <= certified.certificate.bound <= solution.F * (1 + 1.1e-4)
    assert certified.solution.choice.chosen == solution.choice.chosen


def test_a_value_that_f_is_above_is_proved_for_every_combination() -> None:
    tables = tables_with(FEW, "min")
    case = case_from(tables)
    least = min(brute_force(FEW, tables).values())
    assert certify(case, above=0.99 * least).is_proved
    refused = certify(case, above=1.01 * least).certificate
    assert refused.statement.startswith("refused: F is ")


def test_limits_leave_combinations_out_and_may_leave_none() -> None:
    tables = tables_with({"x1": [10.0, 14]}, limits={"custom": ["x1 <= 12"]})
    solution = solve(case_from(tables))
    assert solution.status.is_answer
    assert solution.outcomes[0].own.nlp.case.parameters["x1"] == (10.0,)
    proved = certify(solution)
    assert proved.is_proved  # with 14 there is no point within the limits
    tables["limits"]["custom"] = ["x1 <= 9"]
    none = solve(case_from(tables))
    assert not none.status.is_answer
    found = result_of(none).choice
    assert found.statement == "none of 2 combinations of values, each solved from 4 starts, gave an answer"
    empty = certify(none).certificate
    assert empty.statement.startswith("proved: no point of the box satisfies all limits with any of the 2 combinations")


def test_several_tasks_are_combined_for_each_combination() -> None:
    tables = shipped_tables("paper-4.2")
    values = {"x1": [8.0, 11], "x2": [7.0, 5]}
    tables["robot"]["parameters"] |= {name: {"values": each} for name, each in values.items()}
    tables |= {"combine": {"method": "weighted-sum"}, "solve": {"starts": 4}}
    case = case_from(tables)
    every = brute_force(values, tables)
    solution = solve(case)
    decided = solution.decided_by
    best = min(every, key=lambda each: decided.nlp.sign * every[each])
    fixed = decided.nlp.case.parameters
    assert tuple(fixed[name][0] for name in values) == best
    assert solution.combination.value == pytest.approx(every[best], rel=1e-8)
    choice = result_of(solution).choice
    assert choice.solved == 4
    tables["combine"] = {"method": "average"}
    tables["robot"]["parameters"] |= {name: {"values": each} for name, each in values.items()}
    with pytest.raises(CaseError, match="an average of catalogue values need not be a catalogue value"):
        case_from(tables)


def test_what_is_chosen_is_shown_and_a_result_is_taken_up(tmp_path: Path, cli: Run) -> None:
    case = case_from(tables_with(FEW))
    path, target = saved(tmp_path / "case.toml", case_text(case)), tmp_path / "result.json"
    again = load_case(str(path))
    assert again.parameters["x1"] == (Free.among([10.0, 12.0, 14.0]),)
    assert again.parameters["x4"] == case.parameters["x4"]
    said = output_of(cli("solve", str(path), "--json", str(target)))
    assert "x1 = 14 cm, x4 = 20 deg: the best of 6 combinations of values, each solved from 4 starts" in unbroken(said)
    assert "10, 12 or 14" in said
    result = json.loads(target.read_text(encoding="utf-8"))
    jsonschema.validate(result, result_schema())
    assert result["choice"]["numbers"][0] == {"name": "x1", "value": 14.0, "unit": "cm", "values": [10.0, 12.0, 14.0]}
    output_of(cli("export", str(path), "--of", str(target), "--format", "csv", "--out", str(tmp_path / "robot")))
    assert "the best of 6 combinations of values" in report(solve(case))
    for command in (("evaluate",), ("codegen", "--out", str(tmp_path / "c"))):
        refusal_of(
            cli(command[0], str(path), *command[1:]), "robot.parameters.x1: has catalogue values, and only solve"
        )
    refusal_of(cli("solve", str(path), "--set", "x1.min=3"), "x1 has catalogue values and no bounds")
    proof = ("--proof", str(tmp_path / "proof"))
    refusal_of(cli("certify", str(path), *proof), "--proof: each combination of listed values")


def test_a_choice_among_values_alone_is_called_the_largest(tmp_path: Path, cli: Run) -> None:
    tables = tables_with({"x1": [9, 11.5], "x2": [7, 9]})
    tables["pose"] = {"position": [0, 0, 30]}
    path = saved(tmp_path / "case.toml", case_text(case_from(tables)))
    best = max(brute_force({"x1": [9, 11.5], "x2": [7, 9]}, tables).values())
    target = tmp_path / "result.json"
    said = output_of(cli("solve", str(path), "--json", str(target)))
    assert f"largest F = {best:.7g} (cm/rad)²   (chosen)" in said
    assert json.loads(target.read_text(encoding="utf-8"))["status"] == "evaluated"


def test_a_search_that_is_stopped_says_that_not_all_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    case = case_from(tables_with(FEW))
    calls = iter([False] * 2 + [True] * 50)
    monkeypatch.setattr("screwsynth.nlp.solver.choices.is_requested", lambda: next(calls))
    solution = solve(case)
    assert solution.status.value == "interrupted"
    assert (solution.choice.solved, solution.choice.is_complete) == (2, False)
    result = result_of(solution)
    assert result.F is None
    assert result.choice.statement == (
        "stopped after 2 of 6 combinations of values, solved from 4 starts; not all others are searched"
    )


@pytest.mark.slow
def test_limits_over_a_workspace_hold_for_the_chosen_values() -> None:
    case = load_case("hexapod-workspace")
    # With the smaller value no design keeps the limits.
    solution = solve(replace(case, parameters={**case.parameters, "x1": Free.among([24, 28])}), starts=1)
    assert solution.workspace.is_proved
    assert solution.keeps_limits
    alone = solve(replace(case, parameters={**case.parameters, "x1": 28.0}), starts=1)
    assert pytest.approx(alone.F, rel=1e-8) == solution.F
    assert solution.workspace.judgement.case.parameters["x1"] == (28.0,)


def test_numbers_in_python_are_checked_too() -> None:
    case = load_case(CASE)
    with pytest.raises(CaseError, match=r"x1\.values: must not have a value twice, got 12"):
        replace(case, parameters={**case.parameters, "x1": Free.among([12, 12, 14])})
    with pytest.raises(CaseError, match=r"x3\.values\[1\] = .* must be between 0 deg and 30 deg"):
        replace(case, parameters={**case.parameters, "x3": Free.among([0.1, 2.0])})

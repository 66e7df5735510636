"""Every command on robots given joint by joint: six of the gallery, in the case that ``new`` begins with."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, case_from, soaked, starter, starter_tables, starter_text

from screwsynth.nlp import (
    Case,
    Free,
    Limits,
    Method,
    OverPoses,
    Pose,
    QuantityLimit,
    RateShare,
    Search,
    Sense,
    Status,
    Task,
    evaluate,
    formulate,
    sensitivities,
    solve,
)
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.sensitivity import Hindrance
from screwsynth.nlp.evidence.state import loops_are_closed

SIX = ("3-rps", "6-rus", "delta", "delta-parallelogram", "3-upu", "planar-3-rrr")


def narrow(case: Case) -> Case:
    """The case with its free numbers in a fifth of their ranges, where every robot stays in its own assembly."""

    def less(value: float | Free) -> float | Free:
        if not isinstance(value, Free):
            return value
        middle, half = (value.lower + value.upper) / 2, (value.upper - value.lower) / 10
        return Free(middle - half, middle + half)

    parameters = {name: [less(value) for value in case.components(name)] for name in case.parameters}
    rotation = replace(case.rotation, angle=less(case.rotation.angle))
    return replace(case, parameters=parameters, position=[less(value) for value in case.position], rotation=rotation)


def test_evaluate_writes_json_and_csv_with_the_values_of_the_program(tmp_path: Path, cli: Run) -> None:
    for name in SIX:
        path, data_file, csv_file = (tmp_path / f"{name}.{end}" for end in ("toml", "json", "csv"))
        path.write_text(starter_text(name), encoding="utf-8")
        status, out, err = cli("evaluate", str(path), "--json", str(data_file), "--csv", str(csv_file))
        assert (status, err) == (0, ""), name
        data = json.loads(data_file.read_text(encoding="utf-8"))
        nlp = formulate(case_from(path.read_text(encoding="utf-8")))
        state = evaluate(nlp, closed_start(nlp))
        assert data["F"] == pytest.approx(state.F, rel=1e-12)
        assert len(data["jacobian"]) == len(data["limbs"]) == len(nlp.program.model.rows)
        assert np.sum(np.square(data["rates"])) == pytest.approx(state.F, rel=1e-12)
        assert data["joints"]["assembly"] == []
        assert "rank of J  6" in out
        rows = list(csv.reader(csv_file.read_text(encoding="utf-8").splitlines()))
        assert len(rows) > 5


@pytest.mark.parametrize("names", soaked([SIX[:1], SIX[1:]], [SIX[:1]]), ids=["one", "others"])
def test_tasks_poses_and_limits_together(names: tuple[str, ...]) -> None:
    for name in names:
        case = narrow(starter(name))
        quantity, largest = case.model.quantities[0], 3.0
        (own,) = case.tasks
        both = replace(
            case,
            tasks=[own, replace(own, name="second", sense=Sense.MAX, twist=np.array([0, 0, 0, 0, 0, 1.0]))],
            further=[Pose(case.position, case.rotation)],
            over_poses=OverPoses.MEAN,
            method=Method.AVERAGE,
            limits=Limits(RateShare(0.95), QuantityLimit(quantity.name, min=-largest, max=largest)),
            search=Search(starts=2),
        )
        solution = solve(both)
        assert solution.status.is_answer, name
        for outcome in solution.outcomes:
            found = outcome.own
            assert found.status is Status.OPTIMAL, name
            assert loops_are_closed(found.nlp, found.x)
            F = np.mean([evaluate(found.nlp, found.x, pose).F for pose in range(2)])
            assert pytest.approx(F, rel=1e-12) == found.F


@pytest.mark.parametrize("names", soaked([SIX[:1], SIX[1:]], [SIX[:1]]), ids=["one", "others"])
def test_sensitivities_are_those_of_solved_neighbours(names: tuple[str, ...]) -> None:
    for name in names:
        case = replace(narrow(starter(name)), search=Search(starts=1))
        fixed = next(item.name for item in case.model.parameters if not isinstance(case.components(item.name)[0], Free))
        value = float(case.components(fixed)[0])
        own = solve(case).outcomes[0].own
        (found,) = [each for each in sensitivities(own.nlp, own.x) if each.name == fixed]
        step = 1e-5 * value

        def best(number: float, case: Case = case, fixed: str = fixed) -> float:
            return solve(replace(case, parameters={**case.parameters, fixed: number})).F

        slope = (best(value + step) - best(value - step)) / (2 * step)
        assert found.derivative == pytest.approx(slope, rel=1e-4, abs=1e-5 * abs(own.F / value)), name


def test_a_number_that_the_robot_has_no_choice_of_has_no_sensitivity() -> None:
    # A Delta does not turn: no sum of changes of the other numbers closes its loops where it is turned.
    tables = starter_tables("delta")
    tables["pose"]["rotation"] = {"axis": [0, 0, 1], "angle": 0}
    tables["solve"]["starts"] = 1
    solution = solve(case_from(tables, "delta"))
    rows = {row.name: row for row in sensitivities(solution.nlp, solution.x)}
    assert {name for name, row in rows.items() if row.derivative is None} == {"angle"}
    assert rows["angle"].hindrance is Hindrance.NO_CHOICE
    assert "fixed: the robot has no choice of it" in solution.table(width=120)
    # The planar robot has the choice of its rotation.
    tables = starter_tables("planar-3-rrr")
    tables["pose"]["rotation"] = {"axis": [0, 0, 1], "angle": 3}
    tables["solve"]["starts"] = 1
    solution = solve(case_from(tables, "planar"))
    rows = {row.name: row for row in sensitivities(solution.nlp, solution.x)}
    assert rows["angle"].derivative


def test_report_and_check_and_codegen_write_what_they_say(tmp_path: Path, cli: Run) -> None:
    name = "delta"
    path, page, folder = tmp_path / "delta.toml", tmp_path / "page.html", tmp_path / "c"
    path.write_text(starter_text(name), encoding="utf-8")
    assert cli("report", str(path), "--out", str(page), "--starts", "2")[0] == 0
    text = page.read_text(encoding="utf-8")
    assert "another way" not in text
    # Joint positions that close the loops are no numbers of the case.
    assert "4 numbers are free: rb, p_x, p_y, p_z. Everything else is fixed." in text
    assert cli("codegen", str(path), "--no-measure", "--out", str(folder))[0] == 0
    assert any(folder.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["3-rps", "6-rus", "delta", "planar-3-rrr"])  # the others compile for a minute
def test_c_has_the_values_of_the_program(name: str, embed: Callable[[Case], Any]) -> None:
    case = starter(name)
    c, nlp = embed(case, "-O0"), formulate(case)
    p, n, count = np.ascontiguousarray(nlp.arguments), nlp.n, len(nlp.program.constraints)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    F, gradient, g, dg = np.zeros(1), np.zeros(n), np.zeros(count), np.zeros((count, n))
    assert c.call("prepare", p, k, work) == 0
    rng = np.random.default_rng(3)
    for _ in range(100):
        x = nlp.start + 0.2 * nlp.scale * rng.uniform(-1, 1, n)
        assert c.call("F_gradient", x, k, F, gradient, work) == c.call("limits", x, k, g, dg, work) == 0
        value, slope, constraint, constraint_slope = nlp.program.kernels.derivatives(x, p)
        for got, wanted in ((F, value.ravel()), (gradient, slope.ravel()), (g, constraint.ravel())):
            assert np.max(np.abs(got - wanted)) <= 1e-14 * max(1.0, float(np.max(np.abs(wanted)))), name
        assert np.max(np.abs(dg - constraint_slope)) <= 1e-14 * max(1.0, float(np.max(np.abs(constraint_slope))))


def test_a_case_of_the_gallery_is_written_and_read_again() -> None:
    for name in SIX:
        case = starter(name)
        again = case_from(case.to_toml(), name)
        assert again.model.name == name
        assert formulate(again).evaluate(formulate(again).start).F == formulate(case).evaluate(formulate(case).start).F
    assert isinstance(case.tasks[0], Task)

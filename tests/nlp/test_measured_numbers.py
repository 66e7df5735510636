"""Singular values and condition numbers are one number everywhere: the measured one, and not the program's estimate."""

import itertools
import json
import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import EACH_KIND, FEW_KINDS, Array, Run, case_from, edited, saved, soaked, starter_tables, unbroken
from measures import circle_joints

from screwsynth.nlp import Case, evaluate, formulate, solve
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.results.point import violations
from screwsynth.nlp.solver.status import Status

#: A symmetric pose, at which two eigenvalues are smallest and the estimate is furthest off.
CASE = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 10, x2 = 6, x3 = 30, x4 = 0 }
[pose]
position = [0, 0, 9]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
condition_number = { max = LIMIT, length = 5 }
"""
CONDITION = "condition_number"


def jacobian(height: float) -> Array:
    base, platform = circle_joints({"x1": 10.0, "x2": 6.0, "x3": math.radians(30), "x4": 0.0})
    span = platform + np.array([0.0, 0.0, height]) - base
    n = span / np.linalg.norm(span, axis=1, keepdims=True)
    return np.hstack([n, np.cross(platform, n) / 5])


def estimate(case: Case) -> float:
    """The condition number that the program's constraint reads."""
    nlp = formulate(case)
    (constraint,) = [each.constraint for each in (*nlp.constant_limits, *())] or nlp.program.constraints
    value = ca.Function("g", [nlp.program.x, nlp.program.p], [constraint.expression])(nlp.start, nlp.arguments)
    return constraint.reading.from_value(float(value))


def test_a_limit_between_the_number_and_its_estimate_is_kept(cli: Run, tmp_path: Path) -> None:
    true = float(np.linalg.cond(jacobian(9.0)))
    loose = case_from(edited(CASE, ("LIMIT", "100")))
    estimated = estimate(loose)
    assert 1.002 * true < estimated < 1.02 * true
    between = 0.5 * (true + estimated)
    for limit, status in ((between, 0), (true * (1 - 1e-6), 1)):
        path, target = saved(tmp_path / "case.toml", edited(CASE, ("LIMIT", repr(limit)))), tmp_path / "r.json"
        code, out, err = cli("evaluate", str(path), "--json", str(target))
        assert (code, err) == (status, "")
        result = json.loads(target.read_text(encoding="utf-8"))
        (row,) = result["limits"]
        assert row["value"] == pytest.approx(true, rel=1e-12)
        assert bool(row["violated"]) == bool(status)
        assert [each["value"] for each in result["violated"]] == [pytest.approx(true, rel=1e-12)] * status
        assert ("violated" in unbroken(out)) == bool(status)
        solved = solve(case_from(path.read_text(encoding="utf-8")))
        assert solved.status is (Status.INFEASIBLE if status else Status.EVALUATED)


def test_the_sentence_and_the_table_have_one_number(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "case.toml", edited(CASE, ("LIMIT", "1.5")))
    true = f"{np.linalg.cond(jacobian(9.0)):.6g}"
    _, out, _ = cli("evaluate", str(path), "--all")
    assert unbroken(out).count(true) >= 2
    assert f"violated: {CONDITION} = {true}, must be at most 1.5" in unbroken(out)
    page = tmp_path / "page.html"
    assert true in unbroken(cli("solve", str(path))[1])
    cli("report", str(path), "--out", str(page))
    assert true in page.read_text(encoding="utf-8")


def test_a_feasible_design_that_only_the_estimate_refuses_is_not_called_infeasible() -> None:
    """One free height, and limits just above and just below the least condition number of all heights."""
    least = min(float(np.linalg.cond(jacobian(h))) for h in np.linspace(5, 14, 4001))
    for part, status in ((1.0005, Status.NOT_CONVERGED), (0.999, Status.INFEASIBLE), (1.02, Status.OPTIMAL)):
        text = edited(CASE, ("LIMIT", repr(part * least)), ("[0, 0, 9]", "[0, 0, { min = 5, max = 14 }]"))
        found = solve(case_from(text), starts=8)
        assert found.status is status
        assert (np.linalg.cond(jacobian(float(found.x[0]))) <= part * least) == (status is not Status.INFEASIBLE)
        assert bool(violations(found.nlp, found.x)) == (status is Status.INFEASIBLE)


@pytest.mark.parametrize("key", [CONDITION, "smallest_singular_value"])
@pytest.mark.parametrize("name", soaked(EACH_KIND, FEW_KINDS))
def test_margins_and_violations_are_those_of_the_jacobian(name: str, key: str) -> None:
    tables = starter_tables(name)
    tables["limits"] = {key: {"max": 1.001, "length": 0.37} if key == CONDITION else {"min": 10, "length": 0.37}}
    nlp = formulate(case_from(tables))
    x = closed_start(nlp)
    state = evaluate(nlp, x)
    force, moment = state.jacobian[:, :3], state.jacobian[:, 3:] - np.cross(state.position, state.jacobian[:, :3])
    values = np.linalg.svd(np.hstack([force, moment / 0.37]), compute_uv=False)
    expected = values[0] / values[-1] if key == CONDITION else values[-1]
    for rows in (margins_of(nlp, x, optimal=False), violations(nlp, x)):
        found = [each.value for each in rows if each.name.startswith(key)]
        assert found == [pytest.approx(expected, rel=1e-9)]


def test_clearances_that_are_violated_are_distances(cli: Run, tmp_path: Path) -> None:
    """The program limits a bounded function of a distance, which is no distance far from the limit."""
    text = edited(CASE, (f"{CONDITION} = {{ max = LIMIT, length = 5 }}", "leg_clearance = { min = 30 }"))
    base, platform = circle_joints({"x1": 10.0, "x2": 6.0, "x3": math.radians(30), "x4": 0.0})
    target = tmp_path / "r.json"
    cli("evaluate", str(saved(tmp_path / "case.toml", text)), "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    shown = {each["name"]: each["value"] for each in result["violated"]}
    by_table = {each["name"]: each["value"] for each in result["margins"]}
    assert len(shown) == len(list(itertools.combinations(base, 2)))
    for each, value in shown.items():
        assert value == pytest.approx(by_table[each], rel=1e-9, abs=1e-9)
    assert np.isfinite(platform).all()

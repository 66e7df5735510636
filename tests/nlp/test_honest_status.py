"""Statuses that claim no more than is known: margins of an exchange, cut searches, refuted designs, open points.

The robots are octahedral hexapods, whose leg lengths are measured from their joints alone.
"""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_from, saved, turn_about, unbroken
from measures import circle_joints

from screwsynth.nlp import Case, SolverResult, StopReason, certify, interruption, result_of, round_design, solve
from screwsynth.nlp.case.settings import Search
from screwsynth.nlp.case.toml import toml_document
from screwsynth.nlp.interruption import within
from screwsynth.nlp.program.nlp import Nlp
from screwsynth.nlp.solver import semi_infinite
from screwsynth.nlp.solver.ipopt import ipopt
from screwsynth.nlp.solver.solution import Solution
from screwsynth.nlp.solver.status import Status
from screwsynth.nlp.sweeps.engines import row_of_solution

#: A limit that the best design at the stated pose exceeds at others, and that others keep.
BETWEEN = 1228.0


def edge_tables(longest: float, **keys: object) -> dict[str, Any]:
    """A hexapod whose legs have hardly any room below a limit over its workspace."""
    side, turn = {"min": -40, "max": 40}, {"min": -5, "max": 5}
    return {
        "units": {"length": "mm"},
        "robot": {
            "model": "stewart-gough",
            "layout": "octahedral",
            "parameters": {"x1": {"min": 800, "max": 1200}, "x2": {"min": 350, "max": 700}, "x3": 10, "x4": 5},
        },
        "pose": {"position": [0, 0, 1000]},
        "task": [{"name": "t", "sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "limits": {"over": "workspace", "leg_length": {"max": longest}},
        "workspace": {
            "position": [side, side, {"min": 970, "max": 1030}],
            "rotation": {"axis": [0, 0, 1], "angle": turn},
        },
        "solve": {"starts": 4},
    } | keys


def longest_leg(x1: float, x2: float) -> float:
    """The longest leg of a design at poses of the box, its corners among them: lengths are convex in the position."""
    base, platform = circle_joints({"x1": x1, "x2": x2, "x3": math.radians(10), "x4": math.radians(5)})
    lengths = [
        np.linalg.norm(np.array(position) + platform @ turn_about((0, 0, 1), angle).T - base, axis=1).max()
        for position in itertools.product((-40, 40), (-40, 40), (970, 1030))
        for angle in np.radians(np.linspace(-5, 5, 21))
    ]
    return float(max(lengths))


def design(solution: Solution) -> Array:
    """x1 and x2 of a solution."""
    state = solution.outcomes[0].state
    return np.array([float(np.ravel(state.parameters[name])[0]) for name in ("x1", "x2")])  # type: ignore[union-attr]


def test_a_margin_is_no_verdict_on_a_case() -> None:
    least = min(longest_leg(800, x2) for x2 in np.linspace(350, 700, 141))
    for room in (3e-3, 3e-4, 2e-5):
        limit = least * (1 + room)
        solution = solve(case_from(edge_tables(limit)))
        assert (solution.status, solution.keeps_limits) == (Status.OPTIMAL, True), room
        assert longest_leg(*design(solution)) <= limit
        assert solution.workspace is not None
        # Of a squared length, twice the room is the most that a design can keep.
        assert 0 < solution.workspace.tighter < max(2 * room, 1e-3)


def test_a_case_is_infeasible_where_no_design_keeps_its_limits_as_they_are(tmp_path: Path, cli: Run) -> None:
    least = min(longest_leg(800, x2) for x2 in np.linspace(350, 700, 141))
    limit = round(0.99 * least, 3)
    path, target = saved(tmp_path / "case.toml", toml_document(edge_tables(limit))), tmp_path / "result.json"
    code, out, err = cli("solve", str(path), "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, err, result["status"], result["F"]) == (1, "", "infeasible", None)
    (row,) = result["relaxation"]
    # It is what a few poses need, and so no more than what all need.
    assert limit < row["needed"] <= least
    assert f"infeasible over the workspace unless leg_length.max = {row['needed']:.5g}"[:-1] in unbroken(out)
    # Violated limits are those of the case.
    assert all(side["limit"] == pytest.approx(limit, rel=1e-12) for side in result["reached"]["violated"])
    assert "would be feasible" not in out


def steps() -> float:
    """The time of the tests' clock, which searches over workspaces move."""
    return float(interruption.time.perf_counter())


def cut(case: Case, part: float, whole: float) -> Solution:
    """A solve that gets a part of its time."""
    with within(part * whole):
        return solve(case, jobs=1)


PARTS = (0.0, 0.4, 0.75, 0.9)


def test_a_combination_of_catalogue_values_that_is_cut_is_not_solved() -> None:
    tables = edge_tables(BETWEEN, solve={"starts": 1})
    tables["robot"]["parameters"]["x4"] = {"values": [5, 6]}
    case = case_from(tables)
    began = steps()
    best = solve(case, jobs=1)
    whole = steps() - began
    assert (best.status, best.choice.solved) == (Status.OPTIMAL, 2)  # type: ignore[union-attr]
    cuts = 0
    for part in PARTS:
        found = cut(case, part, whole)
        choice, result = found.choice, result_of(found)
        assert choice is not None
        if found.status.is_answer:
            assert choice.is_complete
            assert pytest.approx(best.F, rel=1e-9) == found.F
            continue
        cuts += 1
        assert (found.status, result.F, result.status) == (Status.INTERRUPTED, None, Status.INTERRUPTED)
        assert (choice.is_complete, choice.solved < 2) == (False, True)
        assert result.choice is not None
        words = f"stopped after {choice.solved} of 2" if choice.solved else "stopped in the first of 2"
        assert result.choice.statement.startswith(f"{words} combinations of values")
        assert {part.ranges for part in choice.parts} == {((k, k + 1),) for k in range(2)}
    assert cuts == len(PARTS)
    # What a bound is proved for in no time is no answer either.
    with within(0.7 * whole):
        certified = certify(case_from(tables | {"objective": {"over": "workspace"}}), jobs=1)
    assert not certified.is_proved
    assert not certified.solution.status.is_answer


def test_a_rounding_that_is_cut_gives_no_answer() -> None:
    case = case_from(edge_tables(BETWEEN, solve={"starts": 1}))
    before = solve(case, jobs=1)
    began = steps()
    best = round_design(before, 50, jobs=1)
    whole = steps() - began
    assert best.status.is_answer
    for part in PARTS:
        with within(part * whole):
            found = round_design(before, 50, jobs=1)
        if found.status.is_answer:
            assert found.rounding.after == pytest.approx(best.rounding.after, rel=1e-9)  # type: ignore[union-attr]
        else:
            assert found.status is Status.INTERRUPTED
            statement = result_of(found).rounding.statement  # type: ignore[union-attr]
            assert "stopped" in statement
            assert "no multiples" not in statement


def test_an_exchange_that_is_cut_says_so(tmp_path: Path, cli: Run) -> None:
    case = case_from(edge_tables(BETWEEN, solve={"starts": 1}))
    began = steps()
    best = solve(case, jobs=1)
    whole = steps() - began
    assert best.status is Status.OPTIMAL
    statuses = set()
    for part in PARTS:
        found = cut(case, part, whole)
        statuses.add(found.status)
        assert (
            found.status.is_answer == found.keeps_limits == (found.status is Status.OPTIMAL) or found.workspace is None
        )
        assert result_of(found).status is found.status
    assert Status.INTERRUPTED in statuses
    path, target = saved(tmp_path / "case.toml", case.to_toml()), tmp_path / "result.json"
    code, out, _ = cli("solve", str(path), "--jobs", "1", "--time", f"{0.5 * whole}", "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, result["status"], result["F"]) == (1, "interrupted", None)
    assert "stopped before the end" in out
    assert "(optimal" not in out
    code, _, err = cli("evaluate", str(path), "--of", str(target))
    assert (code, "holds no answer" in err) == (2, True)


def test_a_design_that_is_refuted_at_the_end_is_no_answer(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(semi_infinite, "MOST_EXCHANGES", 1)
    case = case_from(edge_tables(BETWEEN, solve={"starts": 1}))
    found = solve(case)
    assert longest_leg(*design(found)) > BETWEEN
    assert (found.status, found.keeps_limits) == (Status.NOT_PROVED, False)
    path, target = saved(tmp_path / "case.toml", case.to_toml()), tmp_path / "result.json"
    code, out, _ = cli("solve", str(path), "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, result["status"], result["F"]) == (1, "not proved", None)
    assert result["workspace"]["proved"] is False
    assert "not proved over the workspace: the best design found has F = " in unbroken(out)
    assert "(optimal" not in out
    row = row_of_solution(found, 0, 0.0)
    assert (row.status, row.F, row.note) == ("not proved", None, "not proved over the workspace")


#: One leg's rate over an angle has an optimum at each end of the range.
TWO_ENDS = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 26.5, x2 = 11.543, x3 = 0, x4 = 5 }
[pose]
position = [4, 3, 20]
rotation = { axis = [0, 0, 1], angle = { min = -75, max = 60 } }
[[task]]
sense = "max"
axis = [1, 0, 0]
pitch = inf
[solve]
starts = 2
"""


def test_a_better_point_that_did_not_converge_is_a_note_and_the_optimum_stays(tmp_path: Path, cli: Run) -> None:
    case = case_from(TWO_ENDS)
    angles = np.radians(np.linspace(-75, 60, 271))
    whole = solve(case)
    F = np.array([whole.nlp.evaluate(np.array([each]))[0] for each in angles])
    ends = sorted([0, len(F) - 1], key=lambda k: F[k])
    open_at = int(np.argmin(np.where(F[ends[0]] + 1e-3 < F, np.abs(F - F[ends[0]]), np.inf)))
    assert F[ends[0]] < F[open_at] < F[ends[1]]

    def one_of_two(nlp: Nlp, search: Search, points: Array, count: int) -> Any:  # noqa: ANN401 - as of a solver
        """Searches of which the first ends at the worse optimum, and the second is stopped at a better point."""
        calls = itertools.count()
        real = ipopt(nlp, search, points, 1)[0]

        def search_one(_: Array) -> SolverResult:
            if next(calls) % 2 == 0:
                return real(angles[[ends[0]]] * 0.99)
            x, zeros = angles[[open_at]], np.zeros(len(nlp.program.constraints))
            return SolverResult(x, np.zeros(1), zeros, StopReason.ITERATION_LIMIT, 1)

        return [search_one] * count

    found = solve(case, solver=one_of_two)
    assert found.status is Status.LOCAL
    assert pytest.approx(F[ends[0]], rel=1e-9) == found.F
    result = result_of(found)
    assert pytest.approx(found.F) == result.F
    assert result.starts.better == pytest.approx(F[open_at])  # type: ignore[union-attr]
    assert result.starts.converged == 1  # type: ignore[union-attr]
    text = found.table()
    assert "local maximum F = " in text
    assert "(locally optimal" in text
    assert "1 of 2 searches converged, the best at F = " in unbroken(text)
    assert "a search that did not converge reached" in unbroken(text)
    assert "largest F" not in text
    path, target = saved(tmp_path / "case.toml", TWO_ENDS), tmp_path / "result.json"
    target.write_text(json.dumps(found.to_dict()), encoding="utf-8")
    code, _, err = cli("evaluate", str(path), "--of", str(target))
    assert (code, err) == (0, "")


#: A payload on six legs that may be 30 long: the most upright ones carry it with the least force.
PAYLOAD = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 20, max = 30 }, x2 = { min = 8, max = 12 }, x3 = 10, x4 = 5 }
[pose]
position = [{ min = -5, max = 5 }, { min = -4, max = 6 }, { min = 15, max = 40 }]
rotation = { axis = [0, 0, 1], angle = { min = -40, max = 30 } }
[objective]
minimise = "actuator_force"
[[load]]
name = "payload"
point = [0, 0, 0]
force = [0, 0, -100]
[limits]
leg_length = { max = 30 }
[solve]
starts = 4
"""


@pytest.mark.parametrize("screen", [True, False])
def test_a_symmetric_optimum_on_more_sides_than_variables_converges(screen: bool) -> None:
    """Six equal forces and six equal lengths hold seven variables, and their normals depend on each other."""
    case = case_from(PAYLOAD)
    found = solve(replace(case, search=replace(case.search, screen=screen)))
    assert [each.status.name for each in found.starts] == ["CONVERGED"] * 4
    x1, x2, *position, angle, force = found.x
    assert (x1, x2) == pytest.approx((20, 12))
    assert [*position[:2], angle] == pytest.approx([0, 0, 0], abs=1e-9)
    # Each leg carries a sixth of the payload along z.
    assert force == pytest.approx(100 / 6 * 30 / position[2], rel=1e-9)

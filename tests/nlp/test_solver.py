"""Solver: random robots, degenerate minima, statuses that claim no more than is known."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Patch, Run, case_file, case_from, output_of, saved, soaked, turn_about, unbroken
from measures import circle_joints

import screwsynth.nlp as sn
from screwsynth.models import stewart_gough, three_upu
from screwsynth.nlp.interruption import within
from screwsynth.nlp.program import formulation
from screwsynth.nlp.program.layout import Layout, lay_out
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.solver import multistart, semi_infinite, starts
from screwsynth.nlp.solver.interface import LocalSearch
from screwsynth.nlp.solver.ipopt import ipopt
from screwsynth.nlp.sweeps.engines import row_of_solution


def random_case(seed: int, sense: str) -> sn.Case:
    generator = np.random.default_rng(seed)
    x1, x2 = (float(value) for value in generator.uniform(3, 10, 2))
    axis, point, pitch = generator.normal(size=3), 10 * generator.normal(size=3), generator.normal()
    task = sn.Task.screw(sense, axis=axis, point=point, pitch=pitch)
    return sn.Case(
        model=stewart_gough(layout="octahedral" if seed % 2 else "aligned"),
        parameters={
            "x1": sn.Free(x1, 2 * x1),
            "x2": x2,
            "x3": sn.Free(0, math.radians(30)),
            "x4": sn.Free(0, math.radians(30)),
        },
        position=[sn.Free(-10, 10), sn.Free(-10, 10), sn.Free(5, 50)],
        rotation=sn.Rotation(axis=None, angle=sn.Free(-0.8, 0.8)),
        tasks=[task],
    )


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("seed", range(6))
def test_starts_on_random_robots_converge_and_no_random_point_is_better(seed: int, sense: str) -> None:
    case = random_case(seed, sense)
    solution = sn.solve(case, starts=12)
    assert solution.status is sn.Status.OPTIMAL
    assert sum(start.status is sn.StartStatus.CONVERGED for start in solution.starts) >= 11
    nlp = sn.formulate(case)
    sampled = [nlp.evaluate(x)[0] for x in starting_points(nlp, 500, 1)]
    assert max(sampled) <= solution.F if sense == "max" else min(sampled) >= solution.F


def test_minima_at_zero_are_reached_to_rounding_error() -> None:
    # These robots can reach F = 0 on manifolds that touch bounds, where an interior-point method stops short.
    for seed in (3, 7, 15, 19):
        solution = sn.solve(random_case(seed, "min"), starts=12)
        assert solution.status is sn.Status.OPTIMAL
        if solution.state.is_zero:
            assert 1e-20 * solution.state.size >= solution.F
            assert solution.state.is_singular


def test_starting_points_are_stratified_and_inside_the_ball() -> None:
    case = sn.load_case("paper-4.1-helical")
    moved = replace(case, position=[sn.Free(-10, 10, 7.0), *case.position[1:]])
    assert starting_points(sn.formulate(moved), 5, 0)[0, 0] == 7.0, "the user's start is the first"
    nlp = sn.formulate(case)
    np.testing.assert_array_equal(starting_points(nlp, 9, 4), starting_points(nlp, 9, 4))
    assert not np.array_equal(starting_points(nlp, 9, 4), starting_points(nlp, 9, 5))
    points = starting_points(nlp, 401, 3)
    assert np.all(points >= nlp.lower)
    assert np.all(points <= nlp.upper)
    radii = np.linalg.norm(points[1:, 3:], axis=1)
    outer = math.sin(math.radians(15))
    assert radii.max() <= outer
    # Uniform in the ball: half of the points lie outside of 2^(-1/3) of the radius; the radius is stratified.
    assert np.count_nonzero(radii > outer * 0.5 ** (1 / 3)) == pytest.approx(200, abs=1)
    # A Latin hypercube has one point in each of 400 strata of every other variable.
    strata = np.floor((points[1:, 0] - nlp.lower[0]) / (nlp.upper[0] - nlp.lower[0]) * 400).astype(int)
    assert sorted(strata) == list(range(400))


def test_a_fixed_angle_about_a_free_axis_and_a_range_without_zero_are_kept() -> None:
    solution = sn.solve(sn.load_case("paper-4.1-helical", {"angle": 12}), starts=8)
    assert solution.status is sn.Status.OPTIMAL
    assert math.degrees(solution.state.angle) == pytest.approx(12, abs=1e-9)
    assert solution.F < 407.2107
    case = sn.load_case("paper-4.1-helical")
    far = replace(case, rotation=sn.Rotation(axis=None, angle=sn.Free(math.radians(25), math.radians(30))))
    solution = sn.solve(far, starts=8)
    assert math.degrees(solution.state.angle) == pytest.approx(25, abs=1e-9)
    angle = next(side for side in solution.evidence.active if side.name == "angle")
    assert (angle.bound, angle.value) == ("min", pytest.approx(math.radians(25)))
    # A case with nothing free is evaluated.
    point = {"p_x": -10, "p_y": -10, "p_z": 50, "axis": [0, 0, 1], "angle": -13.5}
    solution = sn.solve(sn.load_case("paper-4.1-helical", point))
    assert solution.status is sn.Status.EVALUATED
    assert pytest.approx(407.1167, abs=5e-5) == solution.F
    assert solution.starts == ()


def test_the_multiplier_of_the_rotation_angle_is_the_slope_of_the_optimum() -> None:
    case = sn.load_case("paper-4.1-rotation")

    def best(degrees: float) -> float:
        limited = replace(
            case, rotation=sn.Rotation(axis=None, angle=sn.Free(-math.radians(degrees), math.radians(degrees)))
        )
        return sn.solve(limited, starts=2).F

    solution = sn.solve(case, starts=2)
    angle = next(side for side in solution.evidence.active if side.name == "angle")
    slope = (best(30.01) - best(29.99)) / math.radians(0.02)
    assert angle.multiplier == pytest.approx(slope, rel=1e-4)


def test_stopping_early_is_not_an_optimum(monkeypatch: pytest.MonkeyPatch) -> None:
    case = sn.load_case("paper-4.1-helical")
    hurried = replace(case, search=sn.Search(starts=4, max_iterations=1))
    solution = sn.solve(hurried)
    assert solution.status is sn.Status.NOT_CONVERGED
    assert {start.status for start in solution.starts} == {sn.StartStatus.ITERATION_LIMIT}
    with pytest.raises(sn.EvaluationError, match="not converged"):
        _ = solution.F
    # Progress is told after every start.
    seen: list[tuple[int, int]] = []
    sn.solve(sn.load_case("paper-4.3"), starts=3, progress=lambda _name, done, total, _best: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
    # The winner is examined once.
    seen: list[bytes] = []

    def counted(nlp: sn.Nlp, x: np.ndarray) -> sn.Evidence:
        seen.append(np.asarray(x).tobytes())
        return sn.examine(nlp, x)

    monkeypatch.setattr(multistart, "examine", counted)
    monkeypatch.setattr(starts, "examine", counted)
    solution = sn.solve(sn.load_case("paper-4.1-helical"), starts=6)
    assert solution.evidence is solution.optima[0].evidence
    assert len(seen) == len(set(seen)) == len(solution.optima)


def test_an_infeasible_case_names_what_cannot_hold() -> None:
    # Two components of at least 0.9 cannot belong to a unit vector.
    ranges: dict[str, object] = {f"u{j}_{i}": [sn.Free(-1, 1)] * 3 for i in (1, 2, 3) for j in (1, 2)}
    ranges |= {"base_radius": 50, "platform_radius": 25, "u1_1": [sn.Free(0.9, 1), sn.Free(0.9, 1), 0]}
    case = sn.Case(
        model=three_upu(),
        parameters=ranges,  # type: ignore[arg-type]
        position=[0, 0, 50],
        tasks=[sn.Task.screw("max", axis=[1, 0, 0], point=[0, 0, 100], pitch=0)],
        search=sn.Search(starts=4),
    )
    solution = sn.solve(case)
    assert solution.status is sn.Status.INFEASIBLE
    assert solution.optima == ()
    result = sn.json_data(sn.result_of(solution))
    assert result["F"] is None
    assert [side["name"] for side in result["reached"]["violated"]] == ["|u1_1|"]
    assert result["reached"]["violated"][0]["value"] == pytest.approx(math.sqrt(1.62), abs=1e-6)


def idle(nlp: sn.Nlp, search: sn.Search, points: np.ndarray, count: int) -> list[LocalSearch]:
    """A solver that stays where it starts and says that it succeeded."""
    assert len(points) == search.starts
    zeros = np.zeros(nlp.n), np.zeros(len(nlp.program.constraints))
    return [lambda x: sn.SolverResult(x, *zeros, sn.StopReason.SUCCEEDED, 0)] * count


def test_a_solver_is_not_believed() -> None:
    solution = sn.solve(replace(random_case(1, "max"), rotation=sn.Rotation()), starts=8, solver=idle)
    for start in solution.starts:
        at = sn.examine(solution.nlp, start.x)
        assert (start.status is sn.StartStatus.CONVERGED) == at.kind.is_optimum
    assert any(start.status is sn.StartStatus.STALLED for start in solution.starts)
    assert solution.status is sn.Status.NOT_CONVERGED


def test_a_case_is_formulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    case = sn.load_case("paper-4.1-helical")
    counts: list[str] = []

    def counted(*arguments: object) -> Layout:
        counts.append("formulated")
        return lay_out(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(formulation, "lay_out", counted)
    solution = sn.solve(case, starts=4)
    assert len(counts) == 1
    sn.certify(solution, gap=1e-2)
    assert len(counts) == 1
    sn.certify(case, gap=1e-2, starts=4)
    assert len(counts) == 2


#: A limit that the best design at the stated pose exceeds at others, and that others keep.
BETWEEN = 1228.0


def edge_tables(longest: float, **keys: object) -> dict[str, Any]:
    """A hexapod whose legs have hardly any room below a limit over its workspace."""
    side, turn = {"min": -40, "max": 40}, {"min": -5, "max": 5}
    own = {"x1": {"min": 800, "max": 1200}, "x2": {"min": 350, "max": 700}, "x3": 10, "x4": 5}
    place = {"position": [side, side, {"min": 970, "max": 1030}], "rotation": {"axis": [0, 0, 1], "angle": turn}}
    return {
        "units": {"length": "mm"},
        "robot": {"model": "stewart-gough", "layout": "octahedral", "parameters": own},
        "pose": {"position": [0, 0, 1000]},
        "task": [{"name": "t", "sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "limits": {"over": "workspace", "leg_length": {"max": longest}},
        "workspace": place,
        "solve": {"starts": 4},
    } | keys


def steps() -> float:
    """The time of the tests' clock, which searches over workspaces move."""
    return float(sn.interruption.time.perf_counter())


@cache
def between() -> tuple[sn.Case, sn.Solution, float]:
    """A case with that limit, its solution from one start, and the time of the solve."""
    case = case_from(edge_tables(BETWEEN, solve={"starts": 1}))
    began = steps()
    return case, sn.solve(case, jobs=1), steps() - began


def longest_leg(x1: float, x2: float) -> float:
    """The longest leg of a design at poses of the box, its corners among them: lengths are convex in the position."""
    base, platform = circle_joints({"x1": x1, "x2": x2, "x3": math.radians(10), "x4": math.radians(5)})
    lengths = [
        np.linalg.norm(np.array(position) + platform @ turn_about((0, 0, 1), angle).T - base, axis=1).max()
        for position in itertools.product((-40, 40), (-40, 40), (970, 1030))
        for angle in np.radians(np.linspace(-5, 5, 21))
    ]
    return float(max(lengths))


def design(solution: sn.Solution) -> Array:
    """x1 and x2 of a solution."""
    state = solution.outcomes[0].state
    return np.array([float(np.ravel(state.parameters[name])[0]) for name in ("x1", "x2")])  # type: ignore[union-attr]


@cache
def least() -> float:
    """The smallest length of the longest leg over the workspace, of any design."""
    return min(longest_leg(800, x2) for x2 in np.linspace(350, 700, 141))


@pytest.mark.parametrize("room", soaked((3e-3, 3e-4, 2e-5), (3e-3, 2e-5)))
def test_a_margin_is_no_verdict_on_a_case(room: float) -> None:
    limit = least() * (1 + room)
    solution = sn.solve(case_from(edge_tables(limit)))
    assert (solution.status, solution.keeps_limits) == (sn.Status.OPTIMAL, True)
    assert longest_leg(*design(solution)) <= limit
    # Of a squared length, twice the room is the most that a design can keep.
    assert 0 < solution.workspace.tighter < max(2 * room, 1e-3)


def test_a_case_is_infeasible_where_no_design_keeps_its_limits_as_they_are(tmp_path: Path, cli: Run) -> None:
    limit = round(0.99 * least(), 3)
    path, target = case_file(tmp_path, edge_tables(limit)), tmp_path / "result.json"
    code, out, err = cli("solve", str(path), "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, err, result["status"], result["F"]) == (1, "", "infeasible", None)
    (row,) = result["relaxation"]
    # It is what a few poses need, and so no more than what all need.
    assert limit < row["needed"] <= least()
    assert f"infeasible over the workspace unless leg_length.max = {row['needed']:.5g}"[:-1] in unbroken(out)
    # Violated limits are those of the case.
    assert all(side["limit"] == pytest.approx(limit, rel=1e-12) for side in result["reached"]["violated"])
    assert "would be feasible" not in out


def cut(case: sn.Case, part: float, whole: float) -> sn.Solution:
    """A solve that gets a part of its time."""
    with within(part * whole):
        return sn.solve(case, jobs=1)


PARTS = (0.0, 0.4, 0.75, 0.9)


def test_a_combination_of_catalogue_values_that_is_cut_is_not_solved() -> None:
    tables = edge_tables(BETWEEN, solve={"starts": 1})
    tables["robot"]["parameters"]["x4"] = {"values": [5, 6]}
    case = case_from(tables)
    began = steps()
    best = sn.solve(case, jobs=1)
    whole = steps() - began
    assert (best.status, best.choice.solved) == (sn.Status.OPTIMAL, 2)  # type: ignore[union-attr]
    cuts = 0
    for part in PARTS:
        found = cut(case, part, whole)
        choice, result = found.choice, sn.result_of(found)
        assert choice is not None
        if found.status.is_answer:
            assert choice.is_complete
            assert pytest.approx(best.F, rel=1e-9) == found.F
            continue
        cuts += 1
        assert (found.status, result.F, result.status) == (sn.Status.INTERRUPTED, None, sn.Status.INTERRUPTED)
        assert (choice.is_complete, choice.solved < 2) == (False, True)
        assert result.choice is not None
        words = f"stopped after {choice.solved} of 2" if choice.solved else "stopped in the first of 2"
        assert result.choice.statement.startswith(f"{words} combinations of values")
        assert {part.ranges for part in choice.parts} == {((k, k + 1),) for k in range(2)}
    assert cuts == len(PARTS)
    # What a bound is proved for in no time is no answer either.
    with within(0.7 * whole):
        certified = sn.certify(case_from(tables | {"objective": {"over": "workspace"}}), jobs=1)
    assert not certified.is_proved
    assert not certified.solution.status.is_answer


def test_a_rounding_that_is_cut_gives_no_answer() -> None:
    _, before, _ = between()
    began = steps()
    best = sn.round_design(before, 50, jobs=1)
    whole = steps() - began
    assert best.status.is_answer
    for part in PARTS:
        with within(part * whole):
            found = sn.round_design(before, 50, jobs=1)
        if found.status.is_answer:
            assert found.rounding.after == pytest.approx(best.rounding.after, rel=1e-9)  # type: ignore[union-attr]
        else:
            assert found.status is sn.Status.INTERRUPTED
            statement = sn.result_of(found).rounding.statement  # type: ignore[union-attr]
            assert "stopped" in statement
            assert "no multiples" not in statement


def test_an_exchange_that_is_cut_says_so(tmp_path: Path, cli: Run) -> None:
    case, best, whole = between()
    assert best.status is sn.Status.OPTIMAL
    statuses = set()
    for part in PARTS:
        found = cut(case, part, whole)
        statuses.add(found.status)
        is_optimal = found.status is sn.Status.OPTIMAL
        assert found.status.is_answer == found.keeps_limits == is_optimal or found.workspace is None
        assert sn.result_of(found).status is found.status
    assert sn.Status.INTERRUPTED in statuses
    path, target = saved(tmp_path / "case.toml", case.to_toml()), tmp_path / "result.json"
    code, out, _ = cli("solve", str(path), "--jobs", "1", "--time", f"{0.5 * whole}", "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, result["status"], result["F"]) == (1, "interrupted", None)
    assert "stopped before the end" in out
    assert "(optimal" not in out
    code, _, err = cli("evaluate", str(path), "--of", str(target))
    assert (code, "contains no answer" in err) == (2, True)


def test_a_design_that_is_refuted_at_the_end_is_no_answer(tmp_path: Path, cli: Run, monkeypatch: Patch) -> None:
    monkeypatch.setattr(semi_infinite, "MOST_EXCHANGES", 1)
    case, _, _ = between()
    found = sn.solve(case)
    assert longest_leg(*design(found)) > BETWEEN
    assert (found.status, found.keeps_limits) == (sn.Status.NOT_PROVED, False)
    path, target = saved(tmp_path / "case.toml", case.to_toml()), tmp_path / "result.json"
    code, out, _ = cli("solve", str(path), "--json", str(target))
    result = json.loads(target.read_text(encoding="utf-8"))
    assert (code, result["status"], result["F"]) == (1, "not proved", None)
    assert result["workspace"]["proved"] is False
    assert "not proved over the workspace: the best design has F = " in unbroken(out)
    assert "(optimal" not in out
    row = row_of_solution(found, 0, 0.0)
    assert (row.status, row.F, row.note) == ("not proved", None, "not proved over the workspace")


#: One leg's rate over an angle has an optimum at each end of the range.
TWO_ENDS = """
robot = { model = "stewart-gough", layout = "octahedral", parameters = { x1 = 26.5, x2 = 11.543, x3 = 0, x4 = 5 } }
pose = { position = [4, 3, 20], rotation = { axis = [0, 0, 1], angle = { min = -75, max = 60 } } }
task = [{ sense = "max", axis = [1, 0, 0], pitch = inf }]
solve = { starts = 2 }
"""


def test_a_better_point_that_did_not_converge_is_a_note_and_the_optimum_stays(tmp_path: Path, cli: Run) -> None:
    case = case_from(TWO_ENDS)
    angles = np.radians(np.linspace(-75, 60, 271))
    whole = sn.solve(case)
    F = np.array([whole.nlp.evaluate(np.array([each]))[0] for each in angles])
    ends = sorted([0, len(F) - 1], key=lambda k: F[k])
    open_at = int(np.argmin(np.where(F[ends[0]] + 1e-3 < F, np.abs(F - F[ends[0]]), np.inf)))
    assert F[ends[0]] < F[open_at] < F[ends[1]]

    def one_of_two(nlp: sn.Nlp, search: sn.Search, points: Array, count: int) -> Any:  # noqa: ANN401 - as of a solver
        """Searches of which the first ends at the worse optimum, and the second is stopped at a better point."""
        calls = itertools.count()
        real = ipopt(nlp, search, points, 1)[0]

        def search_one(_: Array) -> sn.SolverResult:
            if next(calls) % 2 == 0:
                return real(angles[[ends[0]]] * 0.99)
            x, zeros = angles[[open_at]], np.zeros(len(nlp.program.constraints))
            return sn.SolverResult(x, np.zeros(1), zeros, sn.StopReason.ITERATION_LIMIT, 1)

        return [search_one] * count

    found = sn.solve(case, solver=one_of_two)
    assert found.status is sn.Status.LOCAL
    assert pytest.approx(F[ends[0]], rel=1e-9) == found.F
    result = sn.result_of(found)
    assert pytest.approx(found.F) == result.F
    assert result.starts.better == pytest.approx(F[open_at])  # type: ignore[union-attr]
    assert result.starts.converged == 1  # type: ignore[union-attr]
    text = unbroken(found.table())
    for words in ("local maximum F = ", "(locally optimal", "1 of 2 searches converged, the best at F = "):
        assert words in text
    assert "an unconverged search reached F = " in text
    assert "largest F" not in text
    path, target = saved(tmp_path / "case.toml", TWO_ENDS), tmp_path / "result.json"
    target.write_text(json.dumps(found.to_dict()), encoding="utf-8")
    output_of(cli("evaluate", str(path), "--of", str(target)))


#: A payload on six legs that may be 30 long: the most upright ones carry it with the least force.
PAYLOAD = """
load = [{ name = "payload", point = [0, 0, 0], force = [0, 0, -100] }]
objective = { minimise = "actuator_force" }
limits = { leg_length = { max = 30 } }
solve = { starts = 4 }
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 20, max = 30 }, x2 = { min = 8, max = 12 }, x3 = 10, x4 = 5 }
[pose]
position = [{ min = -5, max = 5 }, { min = -4, max = 6 }, { min = 15, max = 40 }]
rotation = { axis = [0, 0, 1], angle = { min = -40, max = 30 } }
"""


@pytest.mark.parametrize("screen", [True, False])
def test_a_symmetric_optimum_on_more_sides_than_variables_converges(screen: bool) -> None:
    """Six equal forces and six equal lengths hold seven variables, and their normals depend on each other."""
    case = case_from(PAYLOAD)
    found = sn.solve(replace(case, search=replace(case.search, screen=screen)))
    assert [each.status.name for each in found.starts] == ["CONVERGED"] * 4
    x1, x2, *position, angle, force = found.x
    assert (x1, x2) == pytest.approx((20, 12))
    assert [*position[:2], angle] == pytest.approx([0, 0, 0], abs=1e-9)
    # Each leg carries a sixth of the payload along z.
    assert force == pytest.approx(100 / 6 * 30 / position[2], rel=1e-9)

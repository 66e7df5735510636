"""The solver on random robots, at degenerate minima, and where there is no answer."""

import math
from dataclasses import replace

import numpy as np
import pytest

from screwsynth.models import stewart_gough, three_upu
from screwsynth.nlp import (
    Case,
    EvaluationError,
    Evidence,
    Free,
    Nlp,
    Rotation,
    Search,
    SolverResult,
    StartStatus,
    Status,
    StopReason,
    Task,
    certify,
    examine,
    formulate,
    json_data,
    load_case,
    result_of,
    solve,
)
from screwsynth.nlp.program import formulation
from screwsynth.nlp.program.layout import Layout, lay_out
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.solver import multistart, starts
from screwsynth.nlp.solver.interface import LocalSearch


def random_case(seed: int, sense: str) -> Case:
    generator = np.random.default_rng(seed)
    x1, x2 = (float(value) for value in generator.uniform(3, 10, 2))
    return Case(
        model=stewart_gough(layout="octahedral" if seed % 2 else "aligned"),
        parameters={"x1": Free(x1, 2 * x1), "x2": x2, "x3": Free(0, math.radians(30)), "x4": Free(0, math.radians(30))},
        position=[Free(-10, 10), Free(-10, 10), Free(5, 50)],
        rotation=Rotation(axis=None, angle=Free(-0.8, 0.8)),
        tasks=[
            Task.screw(
                sense, axis=generator.normal(size=3), point=10 * generator.normal(size=3), pitch=generator.normal()
            )
        ],
    )


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("seed", range(6))
def test_starts_on_random_robots_converge_and_no_random_point_is_better(seed: int, sense: str) -> None:
    case = random_case(seed, sense)
    solution = solve(case, starts=12)
    assert solution.status is Status.OPTIMAL
    assert sum(start.status is StartStatus.CONVERGED for start in solution.starts) >= 11
    nlp = formulate(case)
    sampled = [nlp.evaluate(x)[0] for x in starting_points(nlp, 500, 1)]
    if sense == "max":
        assert max(sampled) <= solution.F
    else:
        assert min(sampled) >= solution.F


@pytest.mark.parametrize("seed", [3, 7, 15, 19])
def test_minima_at_zero_are_reached_to_rounding_error(seed: int) -> None:
    # These robots can reach F = 0 on manifolds that touch bounds, where an interior-point method stops short.
    solution = solve(random_case(seed, "min"), starts=12)
    assert solution.status is Status.OPTIMAL
    assert solution.state is not None
    if solution.state.is_zero:
        assert 1e-20 * solution.state.size >= solution.F
        assert solution.state.is_singular


def test_the_users_start_is_the_first() -> None:
    case = load_case("paper-4.1-helical")
    moved = replace(case, position=[Free(-10, 10, 7.0), *case.position[1:]])
    points = starting_points(formulate(moved), 5, 0)
    assert points[0, 0] == 7.0


def test_starting_points_are_stratified_and_inside_the_ball() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
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


def test_same_seed_same_points_other_seed_others() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    np.testing.assert_array_equal(starting_points(nlp, 9, 4), starting_points(nlp, 9, 4))
    assert not np.array_equal(starting_points(nlp, 9, 4), starting_points(nlp, 9, 5))


def test_a_case_with_nothing_free_is_evaluated() -> None:
    case = load_case("paper-4.1-helical", {"p_x": -10, "p_y": -10, "p_z": 50, "axis": [0, 0, 1], "angle": -13.5})
    solution = solve(case)
    assert solution.status is Status.EVALUATED
    assert pytest.approx(407.1167, abs=5e-5) == solution.F
    assert solution.starts == ()


def test_a_free_axis_with_a_fixed_angle_turns_by_just_that_angle() -> None:
    case = load_case("paper-4.1-helical", {"angle": 12})
    solution = solve(case, starts=8)
    assert solution.status is Status.OPTIMAL
    assert math.degrees(solution.state.angle) == pytest.approx(12, abs=1e-9)
    assert solution.F < 407.2107


def test_an_angle_range_without_zero_keeps_its_distance() -> None:
    case = load_case("paper-4.1-helical")
    far = replace(case, rotation=Rotation(axis=None, angle=Free(math.radians(25), math.radians(30))))
    solution = solve(far, starts=8)
    assert math.degrees(solution.state.angle) == pytest.approx(25, abs=1e-9)
    angle = next(side for side in solution.evidence.active if side.name == "angle")
    assert (angle.bound, angle.value) == ("min", pytest.approx(math.radians(25)))


def test_the_multiplier_of_the_rotation_angle_is_the_slope_of_the_optimum() -> None:
    case = load_case("paper-4.1-rotation")

    def best(degrees: float) -> float:
        limited = replace(case, rotation=Rotation(axis=None, angle=Free(-math.radians(degrees), math.radians(degrees))))
        return solve(limited, starts=2).F

    solution = solve(case, starts=2)
    angle = next(side for side in solution.evidence.active if side.name == "angle")
    slope = (best(30.01) - best(29.99)) / math.radians(0.02)
    assert angle.multiplier == pytest.approx(slope, rel=1e-4)


def test_stopping_early_is_not_an_optimum() -> None:
    case = load_case("paper-4.1-helical")
    hurried = replace(case, search=Search(starts=4, max_iterations=1))
    solution = solve(hurried)
    assert solution.status is Status.NOT_CONVERGED
    assert {start.status for start in solution.starts} == {StartStatus.ITERATION_LIMIT}
    with pytest.raises(EvaluationError, match="not converged"):
        _ = solution.F


def test_progress_is_told_after_every_start() -> None:
    seen: list[tuple[int, int]] = []
    solve(load_case("paper-4.3"), starts=3, progress=lambda _name, done, total, _best: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_an_infeasible_case_names_what_cannot_hold() -> None:
    # Two components of at least 0.9 cannot belong to a unit vector.
    ranges: dict[str, object] = {f"u{j}_{i}": [Free(-1, 1)] * 3 for i in (1, 2, 3) for j in (1, 2)}
    ranges |= {"base_radius": 50, "platform_radius": 25, "u1_1": [Free(0.9, 1), Free(0.9, 1), 0]}
    case = Case(
        model=three_upu(),
        parameters=ranges,  # type: ignore[arg-type]
        position=[0, 0, 50],
        tasks=[Task.screw("max", axis=[1, 0, 0], point=[0, 0, 100], pitch=0)],
        search=Search(starts=4),
    )
    solution = solve(case)
    assert solution.status is Status.INFEASIBLE
    assert solution.optima == ()
    result = json_data(result_of(solution))
    assert result["F"] is None
    assert [side["name"] for side in result["reached"]["violated"]] == ["|u1_1|"]
    assert result["reached"]["violated"][0]["value"] == pytest.approx(math.sqrt(1.62), abs=1e-6)


def idle(nlp: Nlp, search: Search, points: np.ndarray, count: int) -> list[LocalSearch]:
    """A solver that stays where it starts and says that it succeeded."""
    assert len(points) == search.starts
    zeros = np.zeros(nlp.n), np.zeros(len(nlp.program.constraints))
    return [lambda x: SolverResult(x, *zeros, StopReason.SUCCEEDED, 0)] * count


def test_a_solver_is_not_believed() -> None:
    solution = solve(replace(random_case(1, "max"), rotation=Rotation()), starts=8, solver=idle)
    for start in solution.starts:
        at = examine(solution.nlp, start.x)
        assert (start.status is StartStatus.CONVERGED) == at.kind.is_optimum
    assert any(start.status is StartStatus.STALLED for start in solution.starts)
    assert solution.status is Status.NOT_CONVERGED


def test_the_winner_is_examined_once(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bytes] = []

    def counted(nlp: Nlp, x: np.ndarray) -> Evidence:
        seen.append(np.asarray(x).tobytes())
        return examine(nlp, x)

    monkeypatch.setattr(multistart, "examine", counted)
    monkeypatch.setattr(starts, "examine", counted)
    solution = solve(load_case("paper-4.1-helical"), starts=6)
    assert solution.evidence is solution.optima[0].evidence
    assert len(seen) == len(set(seen)) == len(solution.optima)


def test_a_case_is_formulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    case = load_case("paper-4.1-helical")
    counts: list[str] = []

    def counted(*arguments: object) -> Layout:
        counts.append("formulated")
        return lay_out(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(formulation, "lay_out", counted)
    solution = solve(case, starts=4)
    assert len(counts) == 1
    certify(solution, gap=1e-2)
    assert len(counts) == 1
    certify(case, gap=1e-2, starts=4)
    assert len(counts) == 2

"""Starts that the search in C screens: nothing is lost, Ipopt has the last word, and threads change nothing."""

from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from builders import case_of, starter

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Nlp, ProgramSolution, Search, Task, formulate, load_case, shipped_cases, solve
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.evidence.kkt import FEASIBLE, STATIONARY, linearise, multipliers
from screwsynth.nlp.program.formulation import formulate_each
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.screening import screening
from screwsynth.nlp.screening.screening import can_screen, extension, screen
from screwsynth.nlp.solver import screened
from screwsynth.nlp.solver.interface import SolverResult, StopReason
from screwsynth.nlp.solver.ipopt import Confirmation, constraint_sizes, ipopt
from screwsynth.nlp.solver.multistart import solve_program
from screwsynth.nlp.solver.solve import solve_programs
from screwsynth.nlp.solver.starts import StartStatus
from screwsynth.nlp.solver.status import Status

pytestmark = pytest.mark.skipif(extension() is None, reason="no C compiler when the package was installed")

#: Cases that a fast run compares: several optima, a ball, limits, connected optima, loops, poses.
FEW = ("camera-mount", "drilling-spindle", "haptic-device", "paper-4.1-helical", "paper-4.2-rotation", "paper-4.4-max")


def programs(case: Case, *, screen: bool, jobs: int | None = 1) -> list[ProgramSolution]:
    """Return the solution of each task's program and of the combined one."""
    solution = solve_programs(case, formulate_each(case), replace(case.search, screen=screen), jobs=jobs)
    own = [outcome.own for outcome in solution.outcomes]
    combined = None if solution.combination is None else solution.combination.combined
    return own if combined is None else [*own, combined]


def compare(case: Case) -> None:
    """Assert that a screened solve is as good as Ipopt from each start, and that it finds as many optima."""
    for ours, theirs in zip(programs(case, screen=True), programs(case, screen=False), strict=True):
        assert ours.status is theirs.status
        assert len(ours.starts) == len(theirs.starts)
        assert len(ours.optima) >= len(theirs.optima)
        if theirs.optima:
            loss = ours.nlp.sign * (ours.optima[0].F - theirs.optima[0].F)
            assert loss <= 1e-9 * ours.nlp.objective_scale
            assert ours.optima[0].evidence.kind.is_optimum
            # A best start is one that Ipopt confirmed, or found.
            best = [start for start in ours.starts if np.array_equal(start.x, ours.optima[0].x)]
            assert "ipopt" in {start.solver for start in best}


@pytest.mark.parametrize("name", FEW)
def test_screening_loses_no_optimum(name: str) -> None:
    case = load_case(name)
    compare(replace(case, search=replace(case.search, starts=min(case.search.starts, 8))))


@pytest.mark.soak
@pytest.mark.parametrize(
    "name", [name for name in shipped_cases() if name not in {"hexapod-workspace", "paper-4.4-snu"}]
)
def test_screening_loses_no_optimum_of_a_shipped_case(name: str) -> None:
    compare(load_case(name))


def test_loops_are_closed_by_the_search_too() -> None:
    case = starter("3-rps")
    compare(replace(case, search=replace(case.search, starts=8)))


@pytest.mark.slow
def test_screening_finds_optima_that_ipopt_misses() -> None:
    """An interior point's path begins in the middle of the box, whatever its start: few paths reach this optimum."""
    case = load_case("paper-4.1-helical")
    random, count, k = np.random.default_rng(7), 10_000, 1432
    axes, points = random.normal(size=(count, 3)), random.uniform(-10, 10, (count, 3))
    pitch = float(random.uniform(-3, 3, count)[k])
    task = Task.screw("max", axis=axes[k].tolist(), point=points[k].tolist(), pitch=pitch)
    (ours,), (theirs,) = (programs(replace(case, tasks=[task]), screen=screen) for screen in (True, False))
    assert ours.F > 1.03 * theirs.F


def points_of(nlp: Nlp, count: int = 24) -> tuple[FloatArray, FloatArray]:
    points = starting_points(nlp, count, 3)
    return points, constraint_sizes(nlp, points)


@pytest.mark.parametrize("name", ["paper-4.1-helical", "drilling-spindle"])
def test_ends_are_optima_by_the_programs_own_conditions(name: str) -> None:
    nlp = formulate(load_case(name))
    points, sizes = points_of(nlp)
    found = screen(nlp, points, sizes, 500, 1)
    assert found.converged.sum() >= 20
    for k in np.flatnonzero(found.converged):
        at = linearise(nlp, found.x[k])
        assert at.violation <= FEASIBLE
        assert multipliers(at, at.active()).residual <= STATIONARY
        # The multipliers are those of the scaled Lagrangian, by which Ipopt begins.
        n, (F, gradient, _, rows) = nlp.n, nlp.program.kernels.derivatives(found.x[k], nlp.arguments)
        left = nlp.sign / nlp.objective_scale * gradient.ravel() + rows.T @ found.multipliers[k, n:]
        assert np.abs(left * nlp.scale + found.multipliers[k, :n]).max() <= 1e-7
        assert np.isfinite(F)


def test_threads_and_neighbours_change_nothing() -> None:
    nlp = formulate(load_case("drilling-spindle"))
    points, sizes = points_of(nlp)
    one, three = (screen(nlp, points, sizes, 500, jobs) for jobs in (1, 3))
    for a, b in zip(one, three, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(one.x[5:6], screen(nlp, points[5:6], sizes, 500, 1).x)
    solutions = [solve(load_case("camera-mount"), starts=6, jobs=jobs) for jobs in (1, 2)]
    first, second = ([(start.F, start.status, start.solver) for start in each.starts] for each in solutions)
    assert first == second


def test_each_start_says_which_solver_ended_it() -> None:
    case = load_case("paper-4.1-helical")
    ours, theirs = (solve(replace(case, search=Search(starts=8, screen=screen))) for screen in (True, False))
    assert Counter(start.solver for start in ours.starts) == {"ipopt": 1, "sqp": 7}
    assert {start.solver for start in theirs.starts} == {"ipopt"}
    assert all(start.iterations > 0 for start in ours.starts)


def test_what_the_search_does_not_end_goes_to_ipopt(monkeypatch: pytest.MonkeyPatch) -> None:
    def half(nlp: Nlp, points: FloatArray, *arguments: object) -> screening.Screened:
        found = screen(nlp, points, *arguments)  # type: ignore[arg-type]
        found.converged[::2] = False
        return found

    case = load_case("paper-4.1-helical")
    monkeypatch.setattr(screened, "screen", half)
    solution = solve(case, starts=9, jobs=2)
    assert [start.solver for start in solution.starts[::2]] == ["ipopt"] * 5
    assert {start.status for start in solution.starts} == {StartStatus.CONVERGED}
    assert solution.optima[0].count == 9


def test_a_search_that_lies_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Points that are no optima go to Ipopt, which leaves them; then its point counts, as from any start."""

    def lie(nlp: Nlp, points: FloatArray, *_: object) -> screening.Screened:
        n, c, count = nlp.n, len(nlp.program.constraints), len(points)
        return screening.Screened(
            points.copy(), np.zeros((count, n + c)), np.ones(count, dtype=bool), np.ones(count, dtype=np.intc)
        )

    monkeypatch.setattr(screened, "screen", lie)
    solution = solve(load_case("paper-4.1-helical"), starts=4)
    assert solution.status is Status.OPTIMAL
    assert pytest.approx(407.2107, abs=5e-5) == solution.F
    assert {start.solver for start in solution.starts} == {"ipopt"}


def test_ipopt_leaves_an_optimum_where_it_is() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    points, sizes = points_of(nlp, 4)
    found, n = screen(nlp, points, sizes, 500, 1), nlp.n
    confirm = Confirmation(nlp, Search(), sizes)
    for x, u in zip(found.x, found.multipliers, strict=True):
        result = confirm(SolverResult(x, u[:n], u[n:], StopReason.SUCCEEDED, 0))
        assert result.reason is StopReason.SUCCEEDED
        assert np.abs((result.x - x) / nlp.scale).max() <= 1e-6
        assert result.iterations <= 2


def test_programs_that_are_too_large_and_other_solvers_are_not_screened(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("screened")

    case = load_case("paper-4.3")
    monkeypatch.setattr(screened, "screen", refuse)
    assert solve(case, starts=2, solver=partial(ipopt)).status is Status.OPTIMAL
    assert solve_program(formulate(case), Search(starts=2, screen=False)).status is Status.OPTIMAL
    monkeypatch.setattr(screening, "_MOST_VARIABLES", 6)
    assert not can_screen(formulate(case))
    assert solve(case, starts=2).status is Status.OPTIMAL


def test_without_the_extension_or_casadis_function_ipopt_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    nlp = formulate(load_case("paper-4.3"))
    for name in ("extension", "evaluator"):
        with monkeypatch.context() as patched:
            patched.setattr(screening, name, lambda: None)
            assert not can_screen(nlp)
            assert solve_program(nlp, Search(starts=2)).status is Status.OPTIMAL


def test_the_case_file_has_the_switch() -> None:
    assert load_case("paper-4.3").search.screen
    case = case_of("paper-4.3", solve={"screen": False})
    assert not case.search.screen
    assert "screen = false" in case.to_toml()
    assert not case.search.but(4, 1).screen


def test_the_extension_is_made_of_the_generated_search() -> None:
    """One source: a folder's files are those of the extension but for the prefix, with the same constants."""
    files = generate_c(load_case("paper-4.2-rotation"))
    folder = Path(screening.__file__).parents[1] / "embedding" / "c"
    prefix = next(name for name in files if name.endswith("-sqp.h")).removesuffix("-sqp.h")
    for name in ("-sqp.h", "-search.h", "-sqp.c", "-step.c", "-restore.c", "-qp.c"):
        own = (folder / f"screwsynth{name}").read_text(encoding="utf-8")
        assert files[prefix + name] == own.replace("screwsynth", prefix).replace("SCREWSYNTH", prefix.upper())


def test_wrong_arrays_are_refused_and_not_written_to() -> None:
    module = extension()
    assert module is not None
    with pytest.raises(TypeError):
        module.search_each(1, 2, 3)
    nlp = formulate(load_case("paper-4.3"))
    points, sizes = points_of(nlp, 2)
    packed = screening._Program(nlp, sizes, screening.evaluator() or 0, 5).packed
    found = (points, np.zeros(3), np.zeros(2, dtype=np.intc), np.zeros(2, dtype=np.intc))
    before = points.copy()
    with pytest.raises(ValueError, match="another size"):
        module.search_each(packed, found, np.zeros(1, dtype=np.intc), 2, 0, 2)
    with pytest.raises(ValueError, match="inconsistent sizes"):
        module.search_each(packed, found, np.zeros(1, dtype=np.intc), 2, 1, 3)
    np.testing.assert_array_equal(points, before)

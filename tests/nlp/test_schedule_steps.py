"""C of the next step along a path: it keeps the limits where the best step at each point alone runs into them."""

import ctypes
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_of, output_of, refusal_of
from generated import COMPILERS, STRICT, made, needs_compiler, run

from screwsynth.nlp import CaseError, load_case
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.schedulec import FORBIDDEN, StepTables, schedule_c, step_tables
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.schedule.problem import ScheduleProblem

NAME = "hexapod-yaw"
#: The best mean F of all schedules, and the bound of its cells.
BEST = 1.691330


@pytest.fixture(scope="module")
def problem() -> ScheduleProblem:
    """F and limits at the points of the shipped path."""
    return schedule_problem(load_case(NAME))


@pytest.fixture(scope="module")
def tables(problem: ScheduleProblem) -> StepTables:
    """Tables of the shipped path."""
    return step_tables(problem)


#: Points and degrees by which a controller is disturbed there.
DISTURBED = [
    (40, 3.0),
    *(pytest.param(*each, marks=pytest.mark.soak) for each in ((40, -1.0), (100, 5.0), (150, -2.0))),
]


class Steps:
    """The C of the steps, compiled and loaded."""

    def __init__(self, folder: Path) -> None:
        self.prefix = identifier(NAME)
        for name, text in schedule_c(load_case(NAME), "").items():
            (folder / name).write_text(text, encoding="utf-8")
        flags = (*STRICT.split(), "-O1", "-shared", "-fPIC")
        run(COMPILERS[0], *flags, f"{self.prefix}-schedule.c", "-o", "s.so", where=folder)
        library = ctypes.CDLL(str(folder / "s.so"))
        self._step, self._best = library[f"{self.prefix}_step"], library[f"{self.prefix}_best"]
        self._ahead = library[f"{self.prefix}_ahead"]
        self._ahead.restype = ctypes.c_double

    def step(self, point: int, last: float, period: float) -> tuple[int, float]:
        """Whether the step to a point is forbidden, and its setting."""
        found = ctypes.c_double()
        code = self._step(point, ctypes.c_double(last), ctypes.c_double(period), ctypes.byref(found))
        return code, found.value

    def best(self, point: int, low: float, high: float) -> tuple[int, float]:
        """Whether a range of settings is forbidden at a point, and the best of its settings."""
        found = ctypes.c_double()
        code = self._best(point, ctypes.c_double(low), ctypes.c_double(high), ctypes.byref(found))
        return code, found.value

    def ahead(self, point: int, setting: float) -> float:
        """Value of a setting at a point with its best continuation."""
        value: float = self._ahead(point, ctypes.c_double(setting))
        return value

    def followed(self, problem: ScheduleProblem, first: int, start: float) -> tuple[Array, int]:
        """Settings from a point to the end of the path, and the number of forbidden steps."""
        found, faults = [start], 0
        for i in range(first + 1, len(problem.points)):
            code, s = self.step(i, found[-1], float(problem.points.seconds[i - 1]))
            faults += code
            found.append(s)
        return np.array(found), faults


@pytest.fixture(scope="module")
def steps(tmp_path_factory: pytest.TempPathFactory) -> Steps:
    """The C of the shipped path."""
    return Steps(tmp_path_factory.mktemp("steps"))


def greedy_end(problem: ScheduleProblem, start: float) -> int:
    """Point at which no reachable setting keeps the limits, if each step goes to the best reachable setting."""
    last, (setting,) = start, problem.settings
    for i in range(1, len(problem.points)):
        reach = problem.steps[i - 1, 0]
        tried = np.linspace(max(last - reach, setting.lower), min(last + reach, setting.upper), 201)
        values = problem.at(np.zeros(0), tried[:, None], [i] * len(tried))
        kept = np.where((values.excess <= 0).all(axis=1), problem.combined(values.objective), -np.inf)
        if not np.isfinite(kept).any():
            return i
        last = float(tried[kept.argmax()])
    return len(problem.points)


@needs_compiler
def test_a_look_ahead_keeps_the_limits_where_greedy_steps_fail(problem: ScheduleProblem, steps: Steps) -> None:
    (setting,) = problem.settings
    code, start = steps.best(0, setting.lower, setting.upper)
    s, faults = steps.followed(problem, 0, start)
    assert (code, faults) == (0, 0)
    assert (problem.at(np.zeros(0), s[:, None]).excess <= 0).all()
    assert (np.abs(np.diff(s)) <= problem.steps[:, 0] * (1 + 1e-12)).all()
    value = problem.value(np.zeros(0), s[:, None])
    assert BEST - 5e-4 < value <= BEST + 1e-6
    # The same start, and a look at the present point alone: the last points are out of reach.
    assert 150 < greedy_end(problem, start) < len(problem.points)


@needs_compiler
@pytest.mark.parametrize(("point", "degrees"), DISTURBED)
def test_a_disturbed_controller_still_ends_within_the_limits(
    problem: ScheduleProblem, tables: StepTables, steps: Steps, point: int, degrees: float
) -> None:
    start = float(tables.schedule[point] + np.radians(degrees))
    is_allowed = steps.ahead(point, start) > FORBIDDEN
    assert is_allowed
    s, faults = steps.followed(problem, point, start)
    assert faults == 0
    which = list(range(point, len(problem.points)))
    assert (problem.at(np.zeros(0), s[:, None], which).excess <= 1e-6).all()
    assert (np.abs(np.diff(s)) <= problem.steps[point:, 0] * (1 + 1e-12)).all()


def test_tables_have_the_value_of_the_best_continuation(problem: ScheduleProblem, tables: StepTables) -> None:
    found = problem.value(np.zeros(0), tables.schedule[:, None])
    assert tables.mean == pytest.approx(found, rel=1e-12)
    assert found <= BEST + 1e-6
    # No random walk on the grid that keeps the limits is better than the table says.
    rng, m = np.random.default_rng(0), len(tables.values)
    reach = np.floor(problem.steps[:, 0] / (tables.values[1] - tables.values[0])).astype(int)
    for _ in range(50):
        walk = [int(rng.integers(m))]
        for w in reach.tolist():
            walk.append(int(np.clip(walk[-1] + rng.integers(-w, w + 1), 0, m - 1)))
        s = tables.values[walk]
        own = problem.at(np.zeros(0), s[:, None])
        value = problem.value(np.zeros(0), s[:, None]) if (own.excess <= 0).all() else -np.inf
        assert value <= tables.ahead[0, walk[0]] + 1e-12


@needs_compiler
def test_the_step_says_when_nothing_is_allowed(problem: ScheduleProblem, steps: Steps) -> None:
    (setting,) = problem.settings
    last = len(problem.points) - 1
    assert steps.ahead(last, setting.upper) == FORBIDDEN
    assert steps.step(last, setting.upper, 0.0) == (1, setting.upper)
    assert steps.ahead(-1, 0.0) == steps.ahead(last + 1, 0.0) == steps.ahead(0, np.nan) == FORBIDDEN


@needs_compiler
def test_the_folder_tests_itself(cli: Run, tmp_path: Path) -> None:
    folder = tmp_path / "steps"
    assert "6 files" in output_of(cli("codegen", NAME, "--out", str(folder)))
    assert "self-test passed: 200 steps" in made(folder, "test")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x1": {"min": 20, "max": 30}}, "x1: is free, and codegen of a schedule needs fixed dimensions"),
        ({"x1": {"min": 20, "max": 30, "per": "path", "rate": 1}}, "one value that changes along the path"),
    ],
)
def test_other_schedules_are_refused(change: dict[str, Any], words: str) -> None:
    path = load_case(NAME).path
    assert path is not None
    parameters = {"x1": 26.5, "x2": 11.543, "x3": 0, "x4": 5} | change
    case = case_of(NAME, robot={"model": "stewart-gough", "layout": "octahedral", "parameters": parameters})
    assert case.path is not None
    with pytest.raises(CaseError) as found:
        step_tables(schedule_problem(replace(case, path=replace(case.path, folder=path.folder))))
    assert words in str(found.value)


def test_a_narrow_range_without_any_schedule_is_refused(cli: Run, tmp_path: Path) -> None:
    ended = cli("codegen", NAME, "--set", "turn.min=70", "--out", str(tmp_path / "steps"))
    refusal_of(ended, "turn", "no schedule on a grid")
    assert not (tmp_path / "steps").exists()

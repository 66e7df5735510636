"""Generated C says what is so, judged by formulas that are not the program's: those of ``bench/soak``."""

from __future__ import annotations

import importlib
import re
import sys
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from generated import COMPILERS, written

from screwsynth.models import robot_function
from screwsynth.nlp import Case, CompiledCase, case_from_tables, load_case, load_compiled, shipped_cases
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.starter import starter_case

BENCH = Path(__file__).parents[2] / "bench" / "soak"
OK, NOT_CONVERGED, INFEASIBLE, BAD_INPUT, BUDGET, OTHER_ASSEMBLY, RANGE_END = range(7)

Compiled = Callable[[str], CompiledCase]


def case_of(name: str) -> Case:
    """A shipped case, or the starter of a robot."""
    if name in shipped_cases():
        return load_case(name)
    return case_from_tables(tomllib.loads(starter_case(robot_function(name)())), name=name, source=name)


@pytest.fixture(scope="module")
def ticks() -> ModuleType:
    sys.path.append(str(BENCH))
    return importlib.import_module("ticks")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")

    @cache
    def made(name: str) -> CompiledCase:
        return load_compiled(written(case_of(name), tmp_path_factory.mktemp("honest")))

    return made


def tasks(own: CompiledCase, count: int, seed: int) -> np.ndarray:
    """Fixed numbers with random twists."""
    p = np.tile([each.default for each in own.parameters], (count, 1))
    twists = [i for i, each in enumerate(own.parameters) if each.name.startswith("twist")]
    p[:, twists] = np.random.default_rng(seed).normal(size=(count, len(twists)))
    return p


def ranges(own: CompiledCase) -> tuple[np.ndarray, np.ndarray]:
    return np.array([each.lower for each in own.variables]), np.array([each.upper for each in own.variables])


@pytest.mark.parametrize("name", ["camera-mount", "delta", "3-rps"])
def test_a_short_soak_finds_no_fault(name: str, compiled: Compiled, ticks: ModuleType) -> None:
    robot = ticks.Robot(compiled(name), 1.0)
    statuses, faults, places = ticks.soak(robot, 2000, 200, 5)
    assert not faults, places
    assert statuses["ok"] > 1000
    assert all(statuses[word] > 20 for word in ("infeasible", "bad input", "budget"))


def test_the_judgement_of_a_soak_sees_what_is_wrong(compiled: Compiled, ticks: ModuleType) -> None:
    robot = ticks.Robot(compiled("camera-mount"), 1.0)
    rng = np.random.default_rng(2)
    first = robot.compiled.solve()
    tick = ticks.next_tick(robot, np.tile(first.x, (200, 1)), np.tile(robot.defaults, (200, 1)), rng)
    found = ticks.solved(robot, tick)
    found.F[:] *= 1.01
    found.x[:, 0] = 0.3
    faults = {name: rows.sum() for name, rows in ticks.judged(robot, tick, found).items()}
    assert min(faults["wrong F"], faults["outside the bounds"], faults["outside the limits"]) > 50
    found.status[:] = INFEASIBLE
    assert ticks.judged(robot, tick, found)["false infeasible"].sum() > 20


@pytest.mark.parametrize("name", ["camera-mount", pytest.param("flight-simulator", marks=pytest.mark.slow)])
def test_the_worst_case_of_other_tasks_is_theirs(name: str, compiled: Compiled, ticks: ModuleType) -> None:
    own = compiled(name)
    robot, p = ticks.Robot(own, 1.0), tasks(own, 60, 3) * 10 ** np.linspace(-3, 3, 60)[:, None]
    p[:, [i for i in range(p.shape[1]) if i not in robot.twists]] = np.delete(robot.defaults, robot.twists)
    found = own.solve(p=p)
    assert found.status.tolist() == [OK] * 60
    state = robot.state(found.x, p)
    assert pytest.approx(robot.objective(state, p), rel=1e-9) == found.F
    assert robot.excess(state, np.tile(robot.limits, (60, 1))).max() <= 1e-7
    # No random point, however near, is better.
    lower, upper = (each[robot.free] for each in ranges(own))
    rng, best = np.random.default_rng(1), np.zeros(60)
    for radius in (1.0, 0.1, 1e-2, 1e-3, 1e-4):
        for _ in range(300):
            x = found.x.copy()
            x[:, robot.free] = np.clip(
                x[:, robot.free] + radius * rng.uniform(-1, 1, (60, len(lower))) * (upper - lower), lower, upper
            )
            near = robot.state(x, p)
            keeps = robot.excess(near, np.tile(robot.limits, (60, 1))) <= 0
            best = np.where(keeps, np.fmax(best, robot.objective(near, p)), best)
    assert (best <= found.F * (1 + 1e-9)).all()
    # The other sense of a worst case is none: nothing bounds its level.
    assert own.solve(sense="min").status.tolist() == [BAD_INPUT]


def test_the_largest_of_other_tasks_to_be_minimised_is_theirs(tmp_path: Path, ticks: ModuleType) -> None:
    tables = tomllib.loads(Path(find_case("camera-mount")).read_text(encoding="utf-8"))
    for task in tables["task"]:
        task["sense"] = "min"
    del tables["expect"]
    own = load_compiled(written(case_from_tables(tables, name="camera-mount", source="c.toml"), tmp_path))
    robot, p = ticks.Robot(own, -1.0), tasks(own, 40, 4)
    p[:, robot.twists] *= 10
    found = own.solve(p=p)
    assert found.status.tolist() == [OK] * 40
    assert pytest.approx(robot.objective(robot.state(found.x, p), p), rel=1e-9) == found.F


def test_a_delta_held_at_its_last_answer_is_there(compiled: Compiled) -> None:
    own = compiled("delta")
    p, (lower, upper) = tasks(own, 200, 7), ranges(own)
    last = own.solve(p=p, seeds=2)
    assert last.status.tolist() == [OK] * 200
    for half in (0.0, 1e-13, 1e-12, 1e-10):
        room = half * (upper - lower) / 2
        low, high = np.maximum(lower, last.x - room), np.minimum(upper, last.x + room)
        held = own.solve(last.x, tasks(own, 200, 8), lower=low, upper=high, seeds=0)
        assert held.status.tolist() == [OK] * 200, half
        assert ((low <= held.x) & (held.x <= high)).all()
    # Some numbers are held, the others free.
    fixed = np.random.default_rng(1).random(lower.size) < 0.5
    low, high = np.where(fixed, last.x, lower), np.where(fixed, last.x, upper)
    part = own.solve(last.x, p, lower=low, upper=high, seeds=0)
    assert set(part.status.tolist()) == {OK}
    assert (part.x[:, fixed] == last.x[:, fixed]).all()


def test_another_assembly_than_that_of_home_is_never_ok(compiled: Compiled, ticks: ModuleType) -> None:
    own = compiled("delta")
    p, (lower, upper) = tasks(own, 300, 9), ranges(own)
    robot = ticks.Robot(own, 1.0)
    anywhere = lower + np.random.default_rng(2).random((300, lower.size)) * (upper - lower)
    cold = own.solve(anywhere, p, seeds=0)
    is_home = robot.state(cold.x, p).is_home
    assert is_home[cold.ok].all()
    assert not is_home[cold.status == OTHER_ASSEMBLY].any()
    assert cold.ok.sum() >= 270
    # Closed loops of another assembly are the caller's choice: they are followed, and the status says so.
    other, p = cold.x[cold.status == OTHER_ASSEMBLY], p[cold.status == OTHER_ASSEMBLY]
    assert len(other) >= 2
    near = own.solve(other, p, lower=np.maximum(lower, other - 1e-6), upper=np.minimum(upper, other + 1e-6), seeds=0)
    assert set(near.status.tolist()) == {OTHER_ASSEMBLY}
    # Home's optimum comes before theirs, which may be larger.
    assert set(own.solve(other, p, seeds=4).status.tolist()) == {OK}


def test_a_range_of_the_programs_own_is_said(compiled: Compiled) -> None:
    own = compiled("3-rps")
    high = ranges(own)[1]
    high[[each.name for each in own.variables].index("p_z")] = 30.0
    found = own.solve(upper=high)
    assert found.status.tolist() == [RANGE_END]
    slides = [i for i, each in enumerate(own.variables) if each.name.endswith("_2")]
    assert (found.x[0, slides] == high[slides]).any()
    assert own.solve().status.tolist() == [OK]


def test_ranges_that_hide_the_tolerances_are_refused(compiled: Compiled) -> None:
    own = compiled("camera-mount")
    lower, upper = ranges(own)
    for wide, status in ((10.0, OK), (1e7, BAD_INPUT), (1e200, BAD_INPUT)):
        high = upper.copy()
        high[4] = wide
        assert own.solve(lower=lower, upper=high).status.tolist() == [status]


def test_the_page_says_what_to_do_on_each_status(compiled: Compiled) -> None:
    root = Path(__file__).parents[2]
    page = (root / "docs" / "embedding.md").read_text(encoding="utf-8")
    table = page.split("### What to do on each status")[1].split("\n#")[0]
    assert re.findall(r"^\| `SCREWSYNTH_(\w+)`", table, flags=re.MULTILINE) == list(compiled("delta").statuses)
    readme = (root / "nlp" / "embedding" / "c" / "README.md.in").read_text(encoding="utf-8")
    assert re.findall(r"^\| `SCREWSYNTH_(\w+)`", readme, flags=re.MULTILINE) == list(compiled("delta").statuses)

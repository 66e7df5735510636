"""Generated C is judged by formulas that are not the program's: those of bench/soak."""

from __future__ import annotations

import importlib
import itertools
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from builders import case_from, case_of, case_tables, shipped_tables, soaked, starter, starter_tables
from generated import BAD_INPUT, COMPILERS, INFEASIBLE, OK, OTHER_ASSEMBLY, RANGE_END, needs_compiler, written

from screwsynth.nlp import Case, CompiledCase, formulate, load_case, load_compiled, shipped_cases
from screwsynth.nlp.embedding.runtimelimits import fixed_conditions

ROOT = Path(__file__).parents[2]

Compiled = Callable[[str], CompiledCase]


#: Makes a case of one task a worst case of two.
OTHER = {"name": "other", "sense": "max", "axis": [0, 0, 1], "point": [0.2, 0, 0], "pitch": 0.5}


def case_named(name: str) -> Case:
    """A shipped case, or the starter of a robot, after "worst of two, " with a second task."""
    robot = name.removeprefix("worst of two, ")
    if name in shipped_cases():
        return load_case(name)
    if robot == name:
        return starter(robot)
    return case_of(robot, task=[OTHER, *starter_tables(robot)["task"]], combine={"method": "worst-case"})


@pytest.fixture(scope="module")
def ticks() -> ModuleType:
    sys.path.append(str(ROOT / "bench" / "soak"))
    return importlib.import_module("ticks")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")

    @cache
    def made(name: str) -> CompiledCase:
        return load_compiled(written(case_named(name), tmp_path_factory.mktemp("honest")))

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


@pytest.mark.parametrize("name", soaked(["camera-mount", "flight-simulator"], ["camera-mount"]))
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
        for _ in range(120):
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


@needs_compiler
def test_the_largest_of_other_tasks_to_be_minimised_is_theirs(tmp_path: Path, ticks: ModuleType) -> None:
    tasks_to_minimise = [each | {"sense": "min"} for each in shipped_tables("camera-mount")["task"]]
    own = load_compiled(written(case_of("camera-mount", task=tasks_to_minimise), tmp_path))
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
    # Open loops are closed at home, also where a first search leaves home's assembly, or where a joint turns past pi.
    assert robot.state(cold.x, p).is_home.all()
    assert cold.ok.sum() >= 299
    # Closed loops of another assembly are the caller's choice: they are followed, and the status says so. The first arm
    # is mirrored at the line from its motor to where its rods meet the platform, which is not turned.
    other = cold.x[cold.ok].copy()
    p = p[cold.ok]
    at = dict(zip([each.name for each in own.variables], range(lower.size), strict=True))
    number = {each.name: p[:, i] for i, each in enumerate(own.parameters)}
    number |= {name: other[:, i] for name, i in at.items()}
    towards = np.arctan2(-number["p_z"], number["p_x"] + number["rp"] - number["rb"])
    other[:, at["q1_1"]] = np.angle(np.exp(1j * (2 * (towards - number["tilt"]) - number["q1_1"])))
    state = robot.state(other, p)
    is_other = (np.abs(state.equations).max(axis=1) < 1e-9) & ~state.is_home
    other, p = other[is_other], p[is_other]
    assert len(other) >= 100
    near = own.solve(other, p, lower=np.maximum(lower, other - 1e-6), upper=np.minimum(upper, other + 1e-6), seeds=0)
    assert set(near.status.tolist()) == {OTHER_ASSEMBLY}
    # Home's optimum comes before theirs, which may be larger.
    assert set(own.solve(other, p, seeds=4).status.tolist()) == {OK}


def planar_points(own: CompiledCase, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random points of a planar 3-RRR with closed limbs, assembled as at home, by the triangle of each limb."""
    rng, (lower, upper) = np.random.default_rng(seed), ranges(own)
    at = dict(zip([each.name for each in own.variables], range(lower.size), strict=True))
    number = {each.name: each.default for each in own.parameters}
    x = lower + rng.random((count, lower.size)) * (upper - lower)
    x[:, [at["p_z"], at["q_x"], at["q_y"]]] = 0
    x[:, at["q_z"]] = np.sin(np.radians(9.9)) * rng.uniform(-1, 1, count)
    turn, rb, good = 2 * np.arcsin(x[:, at["q_z"]]), x[:, at["rb"]], np.ones(count, dtype=bool)
    tip = number["rp"] * np.exp(1j * number["turn"])
    for k in range(3):
        image = np.exp(2j * np.pi * k / 3)
        crank = (tip - rb) / 2 + 1j * number["bend"]
        rod = tip - rb - crank
        span = (x[:, at["p_x"]] + 1j * x[:, at["p_y"]]) / image + np.exp(1j * turn) * tip - rb
        cosine = (np.abs(crank) ** 2 + np.abs(span) ** 2 - np.abs(rod) ** 2) / (2 * np.abs(crank * span))
        good &= np.abs(cosine) < 1
        # At home the rod bends to the left of the crank.
        bent = np.abs(crank) * span / np.abs(span) * np.exp(-1j * np.arccos(np.clip(cosine, -1, 1)))
        x[:, at[f"q{k + 1}_1"]] = np.angle(bent / crank)
        x[:, at[f"q{k + 1}_2"]] = np.angle(np.exp(1j * turn) * rod / (span - bent))
    return x, good


def test_loops_of_a_feasible_pose_are_closed_at_home(compiled: Compiled, ticks: ModuleType) -> None:
    own = compiled("planar-3-rrr")
    robot, (x, good) = ticks.Robot(own, 1.0), planar_points(own, 1500, 1)
    x = x[good]
    p = tasks(own, len(x), 2)
    state = robot.state(x, p)
    assert np.abs(state.equations).max() < 1e-12
    assert state.is_home.all()
    lower, upper = (np.tile(each, (len(x), 1)) for each in ranges(own))
    anywhere = lower + np.random.default_rng(3).random(lower.shape) * (upper - lower)
    held = [i for i, each in enumerate(own.variables) if not each.name.startswith(("q1", "q2", "q3"))]
    for free in ([], [held[0]]):
        fixed = [i for i in held if i not in free]
        lower[:, fixed] = upper[:, fixed] = x[:, fixed]
        for seeds in (0, 4):
            found = own.solve(np.clip(anywhere, lower, upper), p, lower=lower, upper=upper, seeds=seeds)
            known = np.isin(found.status, (OK, RANGE_END))
            # Nothing is left to be optimised where the dimension is held too.
            assert known.sum() >= len(x) - (0 if not free else 2 if seeds else 40)
            assert robot.state(found.x[known], p[known]).is_home.all()
        lower[:, held[0]], upper[:, held[0]] = (each[held[0]] for each in ranges(own))


@pytest.mark.parametrize("name", ["planar-3-rrr", "worst of two, planar-3-rrr"])
def test_the_end_of_homes_assembly_is_an_optimum(name: str, compiled: Compiled, ticks: ModuleType) -> None:
    own = compiled(name)
    robot, p = ticks.Robot(own, 1.0), tasks(own, 20, 0)
    found = own.solve(p=p)
    assert set(found.status.tolist()) == {OK, RANGE_END}
    assert robot.state(found.x, p).is_home.all()
    # No other point with closed limbs is better.
    x, good = planar_points(own, 20000, 4)
    x = x[good]
    for row in range(20):
        best = robot.objective(robot.state(x, np.tile(p[row], (len(x), 1))), p[row : row + 1]).max()
        assert 0.9 * found.F[row] < best < found.F[row] * (1 + 1e-9)


def test_no_start_elsewhere_has_a_better_optimum(compiled: Compiled, ticks: ModuleType) -> None:
    """A task with two optima that differ by 1e-4 of F: one start of a hundred ended at the better one."""
    own = compiled("camera-mount")
    robot = ticks.Robot(own, 1.0)
    p = np.tile(robot.defaults, (1, 1))
    first = [-0.16121896, -0.21897922, -0.12273384, 0.09765277, -0.15896376, 0.22913147]
    second = [-0.14381278, -0.27614236, -0.13927718, 0.09756566, -0.05863161, 0.12620446]
    p[:, robot.twists] = first + second
    assert pytest.approx(0.0996778229, rel=1e-7) == own.solve(p=p).F


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
    page = (ROOT / "docs" / "embedding.md").read_text(encoding="utf-8")
    table = page.split("### What to do on each status")[1].split("\n#")[0]
    readme = (ROOT / "nlp" / "embedding" / "c" / "README.md.in").read_text(encoding="utf-8")
    for text in (table, readme):
        assert re.findall(r"^\| `SCREWSYNTH_(\w+)`", text, flags=re.MULTILINE) == list(compiled("delta").statuses)


PLATE = """
task = [{ sense = "max", axis = [0, 1, 0], point = [0, 0, 0.22], pitch = 0 }]
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 0.2, x2 = { min = 0.05, max = 0.15 }, x3 = 10, x4 = { min = 3, max = 27 } }
[pose]
position = [0, 0, { min = 0.25, max = 0.4 }]
[limits]
joint_spacing = { min = 0.04 }
"""


def held_delta() -> Case:
    """A Delta whose platform is held without rotation: three of its loop equations follow from the others."""
    pose = starter_tables("delta")["pose"] | {"rotation": {"axis": [0, 0, 1], "angle": 0}}
    return case_of("delta", pose=pose, solve={"starts": 2})


def numbers(own: CompiledCase, **changed: float) -> np.ndarray:
    """The case's fixed numbers, some of them changed."""
    values = {each.name: each.default for each in own.parameters}
    assert changed.keys() <= values.keys()
    return np.array(list((values | changed).values()))


@needs_compiler
@pytest.mark.usefixtures("ticks")
def test_loops_that_closed_by_a_fixed_number_are_judged(tmp_path: Path) -> None:
    formulas = importlib.import_module("formulas")
    own = load_compiled(written(held_delta(), tmp_path))
    names = [each.name for each in own.variables]

    def gap(x: np.ndarray, p: np.ndarray) -> float:
        """Largest difference of a rod's length between its joints from its own, by the positions of the joints."""
        at = dict(zip(names, x.reshape(-1, 1), strict=True))
        at |= dict(zip([each.name for each in own.parameters], p.reshape(-1, 1), strict=True))
        return float(np.abs(formulas.delta(at).equations).max())

    for angle in (0.0, 1e-4, 0.1):
        p = numbers(own, angle=angle)
        for seeds in (1, 16):
            found = own.solve(None, p, seeds=seeds)
            assert (gap(found.x[0], p) < 1e-8) == (found.status[0] == OK), angle
            assert (found.violation[0] <= 1e-9) == (found.status[0] == OK)
            assert found.status[0] == (OK if angle == 0 else INFEASIBLE)
    # All starting points of the case's own numbers still end at an optimum.
    low, high = (np.array([getattr(each, end) for each in own.variables]) for end in ("lower", "upper"))
    starts = low + (high - low) * np.random.default_rng(0).uniform(size=(300, len(low)))
    assert set(own.solve(starts, numbers(own), seeds=2).status.tolist()) == {OK}
    # An axis that is no direction gives no rotation.
    assert own.solve(None, numbers(own, axis_z=2.0)).status[0] == INFEASIBLE


@needs_compiler
def test_limits_on_fixed_numbers_are_judged(tmp_path: Path) -> None:
    own = load_compiled(written(case_from(PLATE, "plate"), tmp_path))

    def spacing(x1: float, x3: float) -> float:
        """Least distance of the base's joints: at angles x3 beside three directions on a circle of radius x1."""
        angles = np.radians(np.array([0, 120, 240])[:, None] + np.array([-x3, x3])).ravel()
        return min(2 * x1 * abs(np.sin((a - b) / 2)) for a, b in itertools.combinations(angles, 2))

    for x1, x3 in ((0.2, 10.0), (0.2, 5.0), (0.2, 5.75), (0.1, 10.0), (0.3, 5.0)):
        # In C an angle is in radians.
        p = numbers(own, x1=x1, x3=np.radians(x3))
        for least in (None, 0.045, 0.06, 0.1):
            limit = 0.04 if least is None else least
            found = own.solve(None, p, limits={} if least is None else {"joint_spacing.min": least})
            assert found.status[0] == (OK if spacing(x1, x3) >= limit else INFEASIBLE), (x1, x3, least)


@needs_compiler
def test_pairs_of_fixed_lengths_are_judged(tmp_path: Path) -> None:
    # Leg 1 alone is free. Of each other leg's 12 pairs of lengths, the tightest one of the case stands for all.
    heights = {"pose1_p_z": 35.0, "pose2_p_z": 36.0, "pose3_p_z": 37.0, "pose4_p_z": 38.0}
    poses = [{"position": [0, 0, height]} for height in heights.values()]
    limits, mean = {"actuator": {"stroke_max": 3.5}}, {"over_poses": "mean"}
    tables = case_tables("hexapod", pose=poses, limits=limits, combine=mean, solve={"starts": 2})
    own = load_compiled(written(case_from(tables, "strokes"), tmp_path))
    given = tables["robot"]["parameters"]

    def stroke(leg: int, **changed: float) -> float:
        """Longest less shortest length of a leg."""
        across = np.subtract(given[f"platform_{leg}"], given[f"base_{leg}"])
        lengths = [np.hypot(np.hypot(*across[:2]), across[2] + z) for z in (heights | changed).values()]
        return float(max(lengths) - min(lengths))

    verdicts = []
    one = [{"pose2_p_z": 39.5}, {"pose2_p_z": 38.4}, {"pose3_p_z": 34.9}, {"pose3_p_z": 34.0}]
    for changed in ({}, *one, {"pose1_p_z": 33.0, "pose4_p_z": 36.3}):
        for limit in (3.0, 3.5, 4.0, 5.0):
            found = own.solve(None, numbers(own, **changed), limits={"actuator.stroke_max": limit})
            verdicts.append(max(stroke(leg, **changed) for leg in range(2, 7)) <= limit)
            assert found.status[0] == (OK if verdicts[-1] else INFEASIBLE), (changed, limit)
    assert 5 < sum(verdicts) < len(verdicts) - 5


def test_what_fixed_numbers_make_hold_is_kept() -> None:
    nlp = formulate(held_delta())
    held = fixed_conditions(nlp)
    loops = [each.name for each in nlp.program.constraints if each.name.startswith("loop")]
    found = [each.constraint.name for each in held.items]
    every = [each.name for each in nlp.case.model.closure]
    assert sorted([*loops, *found[: held.equations]]) == sorted(every)
    assert found[held.equations :] == ["|axis|"]

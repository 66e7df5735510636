"""Dimensions and poses that change from task to task: closed forms, brute force, and the same problem shared."""

import itertools
import json
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, output_of, starter
from jsonschema import Draft202012Validator

from screwsynth.nlp import Case, LegLength, Limits, Method, PointKind, Sense, Solution, Status, Task, case_text, solve
from screwsynth.nlp.case.pose import Free, OverPoses, PerTask, Pose, Rotation, over_grid
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver import changes

HEIGHT, PLATFORM = 40.0, 6.0

PINS = """
title = "Pins: a base radius for each task"
units = { length = "cm" }
[robot]
model = "stewart-gough"
layout = "aligned"
[robot.parameters]
x1 = { min = 5, max = 12, per = "task" }
x2 = 6
x3 = 0
x4 = 30
[pose]
position = [0, 0, 40]
[[task]]
name = "push"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[task]]
name = "turn"
sense = "max"
axis = [0, 0, 1]
point = [0, 0, 0]
pitch = 0
[combine]
method = "worst-case"
"""

# Section 4.3 of the paper, with its screw and a rotation about z; the weights are the separate optima.
SECTION_4_3 = """
units = { length = "cm" }
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = { min = 0, max = 30 } }
[pose]
per = "task"
position = [{ min = -10, max = 10 }, { min = -10, max = 10 }, { min = 20, max = 50 }]
rotation = { angle = { min = -30, max = 30 } }
[[task]]
name = "screw"
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
weight = 408.80313235052216
[[task]]
name = "turn"
sense = "max"
axis = [0, 0, 1]
point = [0, 0, 0]
pitch = 0
weight = 168.00288609463763
[combine]
method = "worst-case"
"""


def read(text: str, **settings: float) -> Case:
    return case_from_tables(tomllib.loads(text), name="case", source="case.toml", settings=settings)


def pushed(x1: Array | float, x2: Array | float = PLATFORM, z: Array | float = HEIGHT) -> Array:
    """F of a translation along z: base joints in pairs at three points, platform joints 30 degrees beside them."""
    return 6 * z**2 / length(x1, x2, z) ** 2


def turned(x1: Array | float, x2: Array | float = PLATFORM, z: Array | float = HEIGHT) -> Array:
    """F of a rotation about z: every leg is at the distance x1 sin(30) x2 / length from z."""
    return 6 * (x1 * x2 / 2) ** 2 / length(x1, x2, z) ** 2


def length(x1: Array | float, x2: Array | float, z: Array | float) -> Array:
    return np.sqrt((x1 - x2 * math.cos(math.radians(30))) ** 2 + (x2 / 2) ** 2 + z**2)


RADII = np.linspace(5, 12, 700_001)
BEST_PUSH, BEST_TURN = float(pushed(RADII).max()), float(turned(RADII).max())


def reordered(task: Task) -> Array:
    """The twist of a task with the velocity first, as the rows of a Jacobian need it."""
    return np.roll(np.asarray(task.twist, dtype=np.float64), 3)


def pins(**changes: object) -> Case:
    """The case of the pins, with the separate optima as weights."""
    case = read(PINS)
    weights = (BEST_PUSH, BEST_TURN)
    tasks = [replace(task, weight=weight) for task, weight in zip(case.tasks, weights, strict=True)]
    return replace(case, **{"tasks": tasks, **changes})


def gain_of(solution: Solution, name: str) -> float:
    (found,) = (each.gain for each in solution.changes if each.name == name)
    assert found is not None
    return found


def relative(solution: Solution) -> list[float]:
    return [outcome.F / outcome.own.F for outcome in solution.outcomes]


def test_a_dimension_per_task_is_best_for_every_task() -> None:
    solution = solve(pins())
    assert solution.status is Status.OPTIMAL
    assert solution["x1.task1"] == pytest.approx(PLATFORM * math.cos(math.radians(30)), abs=1e-6)
    assert solution["x1.task2"] == pytest.approx(12, abs=1e-9)
    assert relative(solution) == pytest.approx([1, 1], abs=1e-8)
    assert [outcome.F for outcome in solution.outcomes] == pytest.approx([BEST_PUSH, BEST_TURN], abs=1e-8)
    # The same problem with the radius shared: a maximin over one variable.
    level = float(np.minimum(pushed(RADII) / BEST_PUSH, turned(RADII) / BEST_TURN).max())
    assert level == pytest.approx(0.9733691, abs=1e-6)
    assert gain_of(solution, "x1") == pytest.approx(1 / level - 1, abs=1e-6)
    shared = solution.changes[0].solution
    assert shared is not None
    assert shared["x1"] == pytest.approx(11.83101, abs=1e-4)
    assert [setting["x1"] for setting in solution.settings] == [solution["x1.task1"], solution["x1.task2"]]


@pytest.mark.parametrize("length_unit", [1e-3, 1e3])
def test_gains_have_no_unit(length_unit: float) -> None:
    lengths = {"x1": PerTask([Free(5 * length_unit, 12 * length_unit)]), "x2": 6 * length_unit}
    case = pins(parameters={**pins().parameters, **lengths}, position=(0, 0, HEIGHT * length_unit))
    case = replace(case, tasks=[case.tasks[0], replace(case.tasks[1], weight=BEST_TURN * length_unit**2)])
    assert gain_of(solve(case), "x1") == pytest.approx(gain_of(solve(pins()), "x1"), rel=1e-6)


def test_a_pose_per_task_of_section_4_3() -> None:
    solution = solve(read(SECTION_4_3))
    assert min(relative(solution)) == pytest.approx(0.991028, abs=1e-6)
    assert solution.evidence is not None
    assert solution.evidence.kind is PointKind.STRICT_MAXIMUM
    (change,) = solution.changes
    assert change.solution is not None
    assert min(relative(change.solution)) == pytest.approx(0.888447, abs=1e-6)
    assert change.gain == pytest.approx(0.991028 / 0.888447 - 1, abs=1e-5)
    names = ("p_x", "p_y", "p_z", "angle")
    poses = [[setting[name] for name in names] for setting in solution.settings]
    assert poses == [[solution[f"pose{k}_{name}"] for name in names] for k in (1, 2)]
    assert poses[0] != poses[1]


def test_the_page_says_what_its_cases_give(cli: Run, tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "changing.md").read_text(encoding="utf-8")
    texts = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    pins_text, poses_text = (next(each for each in texts if title in each) for title in ("Pins:", "Screw and turn:"))
    file = tmp_path / "pins.toml"
    file.write_text(pins_text)
    lines = re.findall(r"```text\n(.*?)\n```", page, flags=re.DOTALL)
    line = next(each for each in lines if each.startswith("x1 per task"))
    assert line in output_of(cli("solve", str(file)))
    solution = solve(read(poses_text))
    shared = solution.changes[0].solution
    assert shared is not None
    everything = {**read(poses_text).parameters, "x4": PerTask([Free(0, math.radians(30))])}
    parts = [
        min(relative(each)) for each in (shared, solution, solve(replace(read(poses_text), parameters=everything)))
    ]
    assert [f"{part:.3g}" for part in parts] == re.findall(r"^\|[^|]*\| ([01][.0-9]*) \|$", page, flags=re.MULTILINE)


def test_if_all_variables_change_no_task_has_a_loss() -> None:
    case = read(SECTION_4_3)
    solution = solve(replace(case, parameters={**case.parameters, "x4": PerTask([Free(0, math.radians(30))])}))
    assert [outcome.loss for outcome in solution.outcomes] == pytest.approx([0, 0], abs=1e-6)
    assert [outcome.F for outcome in solution.outcomes] == pytest.approx([408.80313, 168.00289], abs=1e-5)
    assert [each.name for each in solution.changes] == ["x4", "pose"]


@pytest.mark.parametrize("method", [Method.WEIGHTED_SUM, Method.WORST_CASE])
@pytest.mark.parametrize("senses", [("max", "max"), ("min", "min"), ("max", "min")])
def test_the_combined_optimum_is_that_of_brute_force(method: Method, senses: tuple[str, str]) -> None:
    parameters = {**read(PINS).parameters, "x2": Free(4, 8)}
    tasks = [
        replace(task, sense=sense, weight=w) for task, sense, w in zip(read(PINS).tasks, senses, (2, 3), strict=True)
    ]
    solution = solve(pins(parameters=parameters, tasks=tasks, method=method))
    assert solution.combination is not None
    weights = solution.combination.weights
    x1, x2 = np.linspace(5, 12, 1401)[:, None], np.linspace(4, 8, 801)[None, :]
    # The best radius of each task alone, for every shared x2; then the best x2.
    values = [
        F(x1, x2).max(axis=0) if sense == "max" else F(x1, x2).min(axis=0)
        for F, sense in zip((pushed, turned), senses, strict=True)
    ]
    best = [value.max() if sense == "max" else value.min() for value, sense in zip(values, senses, strict=True)]
    signs = [1.0 if sense == "max" else -1.0 for sense in senses]
    if method is Method.WEIGHTED_SUM:
        whole = sum(s * w * value for s, w, value in zip(signs, weights, values, strict=True))
        expected = whole.max() if senses != ("min", "min") else -whole.max()
    elif senses == ("max", "max"):
        expected = np.minimum(*[value / w for value, w in zip(values, weights, strict=True)]).max()
    elif senses == ("min", "min"):
        expected = np.maximum(*[value * w for value, w in zip(values, weights, strict=True)]).min()
    else:
        losses = [s * w * (b - v) for s, w, b, v in zip(signs, weights, best, values, strict=True)]
        expected = np.maximum(*losses).min()
    assert solution.combination.value == pytest.approx(float(expected), rel=2e-4, abs=1e-5)
    gain = solution.changes[0].gain
    assert gain is None or gain >= -1e-9


def legs_by_hand(at: Mapping[str, float | Sequence[float]], twist: Array) -> tuple[float, Array]:
    """F and leg lengths of the aligned 6-6 platform turned about z, from the velocities of its joints."""
    x1, x2, x3, x4, turn = (float(at[name]) for name in ("x1", "x2", "x3", "x4", "angle"))  # type: ignore[arg-type]
    centre = np.array([at["p_x"], at["p_y"], at["p_z"]], dtype=np.float64)
    rates, lengths = [], []
    for k, sign in itertools.product(range(3), (-1, 1)):
        b, a = (math.radians(120 * k + sign * half) for half in (x3, x4))
        a += math.radians(turn)
        B = x1 * np.array([math.cos(b), math.sin(b), 0])
        A = centre + x2 * np.array([math.cos(a), math.sin(a), 0])
        lengths.append(float(np.linalg.norm(A - B)))
        rates.append((A - B) @ (twist[3:] + np.cross(twist[:3], A)) / lengths[-1])
    return float(np.sum(np.square(rates))), np.array(lengths)


@pytest.mark.parametrize("seed", range(4))
def test_random_problems_have_the_F_of_hand_and_beat_random_points(seed: int) -> None:  # noqa: N802 - F is the objective
    rng = np.random.default_rng(seed)
    ranges = {"x1": (6, 14), "x2": (4, 9), "x3": (5, 25), "x4": (3, 28)}
    own = rng.permutation(list(ranges))[: 1 + seed % 3]
    free = {
        name: Free(*(math.radians(v) if name in ("x3", "x4") else v for v in ends)) for name, ends in ranges.items()
    }
    parameters = {name: PerTask([value]) if name in own else value for name, value in free.items()}
    tasks = [Task(rng.normal(size=6) * [1, 1, 1, 10, 10, 10], "max", f"task {k}") for k in range(2 + seed % 2)]
    box = [Free(-4, 4), Free(-4, 4), Free(15, 30)]
    case = pins(
        parameters=parameters,
        position=box,
        rotation=Rotation((0, 0, 1), Free(-0.4, 0.4)),
        tasks=tasks,
        pose_per_task=bool(seed % 2),
        method=[Method.WORST_CASE, Method.WEIGHTED_SUM][seed // 2],
        limits=Limits(LegLength(min=16, max=30)),
    )
    solution = solve(case)
    assert solution.status.is_answer
    for outcome, setting, task in zip(solution.outcomes, solution.settings, tasks, strict=True):
        F, lengths = legs_by_hand(setting, np.asarray(task.twist))  # type: ignore[arg-type]
        assert pytest.approx(F, rel=1e-8) == outcome.F
        assert lengths.min() >= 16 - 1e-6
        assert lengths.max() <= 30 + 1e-6
    kept = 0
    for _ in range(400):
        shared = {name: rng.uniform(*ends) for name, ends in ranges.items()}
        pose = random_pose(rng)
        values = []
        for task in tasks:
            at = {**shared, **{name: rng.uniform(*ranges[name]) for name in own}}
            at |= random_pose(rng) if case.pose_per_task else pose
            F, lengths = legs_by_hand(at, np.asarray(task.twist))
            values.append(F if lengths.min() >= 16 and lengths.max() <= 30 else -math.inf)
        value = min(values) if case.method is Method.WORST_CASE else sum(values)
        kept += math.isfinite(value)
        assert solution.combination is not None
        assert solution.combination.value is not None
        assert value <= solution.combination.value * (1 + 1e-9)
    assert kept
    assert all(each.gain is not None and each.gain >= -1e-7 for each in solution.changes)


def random_pose(rng: np.random.Generator) -> dict[str, float]:
    x, y, z, angle = rng.uniform((-4, -4, 15, math.degrees(-0.4)), (4, 4, 30, math.degrees(0.4)))
    return {"p_x": x, "p_y": y, "p_z": z, "angle": angle}


def test_the_average_is_of_what_the_tasks_share() -> None:
    solution = solve(replace(read(SECTION_4_3), method=Method.AVERAGE))
    assert solution.combination is not None
    shares = np.array(solution.combination.weights) / 2
    own = [dict(zip(("x4",), (outcome.x[0],), strict=True)) for outcome in solution.outcomes]
    mean = sum(share * each["x4"] for share, each in zip(shares, own, strict=True))
    for outcome, setting in zip(solution.outcomes, solution.settings, strict=True):
        assert math.radians(float(setting["x4"])) == pytest.approx(mean, abs=1e-9)
        assert outcome.at[1:] == pytest.approx(outcome.x[1:], abs=1e-9)  # the pose of the task's own optimum
    assert solution.changes[0].gain is None


def test_limits_hold_at_the_poses_and_dimensions_of_every_task() -> None:
    text = PINS.replace("position = [0, 0, 40]", 'per = "task"\nposition = [0, 0, { min = 30, max = 50 }]')
    text += "[limits]\nactuator = { stroke_max = 1.5 }\nleg_length = { min = 31, max = 48 }\n"
    text += 'custom = ["x1 + p_z / 10 <= 15.5"]\nfootprint = { base = 11.5 }\n'
    solution = solve(read(text))
    assert solution.status is Status.OPTIMAL
    at = [(float(setting["x1"]), float(setting["p_z"])) for setting in solution.settings]
    lengths = [float(length(x1, PLATFORM, z)) for x1, z in at]
    assert abs(lengths[0] - lengths[1]) <= 1.5 + 1e-7
    assert all(31 - 1e-7 <= each <= 48 + 1e-7 for each in lengths)
    assert all(x1 + z / 10 <= 15.5 + 1e-7 and x1 <= 11.5 + 1e-7 for x1, z in at)
    # Brute force over both radii and both heights, with the same limits.
    x1, z = (each.ravel() for each in np.meshgrid(np.linspace(5, 11.5, 66), np.linspace(30, 50, 201)))
    L = length(x1, PLATFORM, z)
    kept = (L >= 31) & (L <= 48) & (x1 + z / 10 <= 15.5)
    x1, z, L = x1[kept], z[kept], L[kept]
    best = 0.0
    for level in np.arange(31, 46.6, 0.05):  # the shortest leg
        inside = (level <= L) & (level + 1.5 >= L)
        best = max(best, min(pushed(x1[inside], z=z[inside]).max(), turned(x1[inside], z=z[inside]).max()))
    assert solution.combination is not None
    assert solution.combination.value is not None
    assert best - 1e-9 <= solution.combination.value <= best * 1.02
    free = solve(replace(read(text), limits=type(read(text).limits)()))
    lengths = [float(length(float(each["x1"]), PLATFORM, float(each["p_z"]))) for each in free.settings]
    assert abs(lengths[0] - lengths[1]) > 1.5 or max(lengths) > 48 or min(lengths) < 31


def test_catalogue_values_per_task_are_those_of_brute_force() -> None:
    values = (5.0, 7.0, 9.0, 10.0)
    parameters = {**pins().parameters, "x1": PerTask([Free.among(values)]), "x2": Free(4, 8)}
    solution = solve(pins(parameters=parameters))
    x2 = np.linspace(4, 8, 40_001)
    found = {
        (one, other): float(np.minimum(pushed(one, x2) / BEST_PUSH, turned(other, x2) / BEST_TURN).max())
        for one in values
        for other in values
    }
    best = max(found.values())
    assert solution.combination is not None
    value = min(outcome.F / b for outcome, b in zip(solution.outcomes, (BEST_PUSH, BEST_TURN), strict=True))
    assert value == pytest.approx(best, rel=1e-5)
    assert found[float(solution["x1.task1"]), float(solution["x1.task2"])] == pytest.approx(best, rel=1e-9)
    shared = max(value for (one, other), value in found.items() if one == other)
    assert gain_of(solution, "x1") == pytest.approx(best / shared - 1, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("count", [3, 7])
@pytest.mark.parametrize("senses", [("max", "max"), ("min", "min")])
@pytest.mark.parametrize("method", ["worst-case", "weighted-sum"])
def test_nothing_but_catalogue_values_may_be_free(
    count: int, senses: tuple[str, str], method: str, tmp_path: Path, cli: Run
) -> None:
    values = tuple(np.linspace(5, 12, count))
    tasks = [replace(task, sense=Sense(sense)) for task, sense in zip(pins().tasks, senses, strict=True)]
    parameters = {**pins().parameters, "x1": PerTask([Free.among(values)])}
    case = pins(parameters=parameters, tasks=tasks, method=Method(method))
    solution = solve(case)
    choose = max if senses[0] == "max" else min
    best = [choose(values, key=F) for F in (pushed, turned)]
    assert [solution["x1.task1"], solution["x1.task2"]] == pytest.approx(best)
    F = [float(pushed(best[0])), float(turned(best[1]))]
    assert solution.combination is not None
    weights = solution.combination.weights
    if method == "weighted-sum":
        value = sum(w * each for w, each in zip(weights, F, strict=True))
    elif senses[0] == "max":
        value = min(each / w for w, each in zip(weights, F, strict=True))
    else:
        value = max(each * w for w, each in zip(weights, F, strict=True))
    assert solution.combination.value == pytest.approx(value, rel=1e-9)
    if count == 3:
        file, data = tmp_path / "case.toml", tmp_path / "certified.json"
        file.write_text(case_text(case))
        output_of(cli("certify", str(file), "--json", str(data)))
        bound = json.loads(data.read_text())["certificate"]["bound"]
        assert (bound >= value * (1 - 1e-12)) if senses[0] == "max" else (bound <= value * (1 + 1e-12))
        assert bound == pytest.approx(value, rel=2e-4)


def test_values_of_each_task_may_be_fixed_or_have_their_own_range() -> None:
    solution = solve(pins(parameters={**pins().parameters, "x1": PerTask([7.0, Free(8, 9)])}))
    assert [solution["x1.task1"], solution["x1.task2"]] == pytest.approx([7, 9], abs=1e-9)
    assert solution.changes[0].reason.endswith("has no value that every task allows")
    assert [outcome.F for outcome in solution.outcomes] == pytest.approx([pushed(7.0), turned(9.0)], rel=1e-9)


def test_equal_fixed_values_are_those_of_the_shared_case() -> None:
    case = read(SECTION_4_3)
    apart = solve(replace(case, parameters={**case.parameters, "x1": PerTask([12.0, 12.0])}))
    together = solve(case)
    assert apart.combination is not None
    assert together.combination is not None
    assert apart.combination.value == pytest.approx(together.combination.value, rel=1e-9)
    assert gain_of(apart, "x1") == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("how", [OverPoses.SUM, OverPoses.MEAN])
def test_every_task_may_have_several_poses(how: OverPoses) -> None:
    steps = over_grid([(0,), (0,), (-2, 0, 3)])
    solution = solve(pins(displacements=steps, over_poses=how, position=(0, 0, Free(35, 45)), pose_per_task=True))
    part = 1 if how is OverPoses.SUM else 1 / 3
    for outcome, setting, F in zip(solution.outcomes, solution.settings, (pushed, turned), strict=True):
        z = np.array([-2, 0, 3]) + float(setting["p_z"])
        assert pytest.approx(part * float(np.sum(F(float(setting["x1"]), z=z))), rel=1e-9) == outcome.F
        assert pytest.approx(outcome.own.F, rel=1e-7) == outcome.F  # nothing is shared


def test_a_robot_with_loops_has_its_own_joints_at_every_pose() -> None:
    case = starter("6-rus")
    lift = Task([0, 0, 0, 0, 0, 1], "max", "lift")
    case = replace(case, tasks=[*case.tasks, lift], pose_per_task=True, method=Method.WEIGHTED_SUM)
    case = replace(case, parameters={**case.parameters, "rb": 1.0}, search=replace(case.search, starts=4))
    solution = solve(case)
    assert solution.status.is_answer
    assert len(solution.nlp.program.places.unknowns) == 2
    assert loops_are_closed(solution.nlp, solution.x)
    for task, (outcome, setting) in enumerate(zip(solution.outcomes, solution.settings, strict=True)):
        assert loops_are_closed(outcome.own.nlp, outcome.at)
        # Rates of the limbs by the robot's mechanism, independently of the program's rows.
        assert outcome.state is not None
        assert float(np.sum((outcome.state.jacobian @ reordered(case.tasks[task])) ** 2)) == pytest.approx(outcome.F)
        assert [float(setting[f"p_{axis}"]) for axis in "xyz"] == pytest.approx(outcome.state.position.tolist())
    sums = [sum(each) for each in zip(*((o.F, o.own.F) for o in solution.outcomes), strict=True)]
    assert sums[0] >= sums[1] - 1e-7  # nothing is shared; another working mode may be better


def test_certificates_bound_the_combined_program(tmp_path: Path, cli: Run) -> None:
    file = tmp_path / "pins.toml"
    file.write_text(case_text(pins()))
    data = tmp_path / "certified.json"
    assert "x1 per task  +2.74 %" in output_of(cli("solve", str(file), "--certify", "--json", str(data)))
    certificate = json.loads(data.read_text())["combined"]["certificate"]
    true = (BEST_PUSH + BEST_TURN) / 2  # the level of scaled weights where no task has a loss
    assert certificate["status"] == "proved"
    assert true - 1e-9 <= certificate["bound"] <= true * (1 + 2e-4)
    proof = tmp_path / "proof.txt"
    output_of(cli("certify", str(file), "--proof", str(proof)))
    words = output_of(cli("verify-proof", str(proof)))
    assert "PROOF VALID" in words
    assert "with x1 set for each task" in " ".join(words.split())


def test_results_keep_to_the_schema_and_name_every_setting(tmp_path: Path, cli: Run) -> None:
    file, data = tmp_path / "case.toml", tmp_path / "result.json"
    file.write_text(SECTION_4_3)
    words = output_of(cli("solve", str(file), "--json", str(data), "--all"))
    assert "pose per task  +11.5 % of the worst-case objective: 256.2307 with pose shared" in words
    assert "pose2_p_z" in words
    result = json.loads(data.read_text())
    schema = json.loads(json.dumps(result_schema()))
    Draft202012Validator(schema).validate(result)
    settings = result["combined"]["settings"]
    assert [each["task"]["name"] for each in settings] == ["screw", "turn"]
    assert [each["pose"]["position"] for each in settings] == [
        [pytest.approx(v) for v in (-10, -10, 50)],
        [pytest.approx(v) for v in (-10, 10, 20)],
    ]
    (change,) = result["combined"]["changes"]
    assert change["gain"] == pytest.approx(0.11546, abs=1e-5)
    assert change["F_shared"] == pytest.approx([363.1999, 149.2617], rel=1e-4)
    table = output_of(cli("solve", str(file), "--csv", "-", "--table", "limbs.task2"))
    assert table.count("\n") == 7


def test_a_change_without_gain_says_so(tmp_path: Path, cli: Run) -> None:
    file = tmp_path / "case.toml"
    file.write_text(PINS.replace('{ min = 5, max = 12, per = "task" }', "{ tasks = [9, 9] }"))
    words = output_of(cli("solve", str(file)))
    assert "x1 per task  no gain: the worst-case objective is" in words


def test_pictures_and_exports_are_at_the_pose_of_the_task(tmp_path: Path, cli: Run) -> None:
    solution = solve(read(SECTION_4_3))
    drawings = drawings_of(solution)
    for drawing, setting in zip(drawings, solution.settings, strict=True):
        at = [setting[f"p_{axis}"] for axis in "xyz"]
        assert np.allclose(drawing.posture.position, at)
    file = tmp_path / "case.toml"
    file.write_text(SECTION_4_3)
    texts = []
    for pose in ("1", "2"):
        output_of(cli("export", str(file), "--format", "mjcf", "--out", str(tmp_path / pose), "--pose", pose))
        texts.append((tmp_path / pose / "robot.xml").read_text())
    assert texts[0] != texts[1]
    status, _, fault = cli("solve", str(file), "--pose", "2")
    assert (status, "every task has 1 pose" in fault) == (2, True)


def test_case_files_are_read_as_they_are_written() -> None:
    own = [Pose((0, 0, 40)), Pose((0, 0, Free(30, 50)), Rotation((0, 0, 1), Free(0, 0.5)))]
    for case in (
        read(PINS),
        read(SECTION_4_3),
        pins(parameters={**pins().parameters, "x1": PerTask([7.0, Free.among([8, 9])])}, method=Method.WORST_CASE),
        pins(rotation=own[0].rotation, further=own[1:], pose_per_task=True),
    ):
        text = case_text(case)
        again = read(text)
        assert case_text(again) == text
        assert again.changes == case.changes
        assert dict(again.dimensions_per_task) == dict(case.dimensions_per_task)
        assert [pose.position for pose in again.poses] == [pose.position for pose in case.poses]


def test_values_of_one_task_are_set_by_name() -> None:
    case = read(PINS, **{"x1.task2": 9})
    assert case.dimensions_per_task["x1"].values == (Free(5, 12), 9.0)
    case = read(PINS, **{"x1.task1.max": 8, "x1.task2.min": 7})
    assert case.dimensions_per_task["x1"].values == (Free(5, 8), Free(7, 12))
    assert read(PINS, x1=9).changes == ()
    case = read(SECTION_4_3, pose2_p_z=30)
    assert [pose.position[2] for pose in case.poses] == [Free(20, 50), 30.0]
    assert [pose.position[2] for pose in read(SECTION_4_3, p_z=30).poses] == [30.0, 30.0]
    assert case.replace({"pose1_p_z.max": 40}).poses[0].position[2] == Free(20, 40)


PUSH = PINS[PINS.index("[[task]]") : PINS.index('[[task]]\nname = "turn"')]
POSES = "[[pose]]\nposition = [0, 0, 40]\n{}\n[[pose]]\nposition = [0, 0, 40]\n{}\n"


def with_poses(*names: str) -> str:
    return PINS.replace("[pose]\nposition = [0, 0, 40]\n", POSES.format(*names))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            PINS[: PINS.index("[[task]]")] + PUSH,
            'robot.parameters.x1.per = "task": needs several tasks, but the case has one [[task]]; leave per out',
        ),
        (
            PINS.replace('per = "task"', 'per = "tsak"'),
            "robot.parameters.x1.per = \"tsak\": must be one of 'task', 'path' or 'pose'",
        ),
        (
            PINS.replace('{ min = 5, max = 12, per = "task" }', "{ tasks = [6, 7, 8] }"),
            "robot.parameters.x1.tasks: must have one value for each of the 2 tasks, got 3",
        ),
        (
            PINS.replace('{ min = 5, max = 12, per = "task" }', "{ tasks = [6, { min = 8, max = 7 }] }"),
            "robot.parameters.x1.tasks[1].min = 8.0: must be below max = 7 cm; write a fixed value as a plain number",
        ),
        (
            PINS.replace("x2 = 6", "x2 = { min = 4, max = 8, rate = 2 }"),
            'robot.parameters.x2.rate: has an effect only with per = "path"',
        ),
        (
            PINS + "[workspace]\nposition = [0, 0, { min = 30, max = 31 }]\n",
            (
                "workspace: conflicts with robot.parameters.x1, which changes from task to task: "
                "the proof needs one robot; remove [workspace]"
            ),
        ),
        (with_poses('task = "push"', ""), "pose[1].task: is missing: another [[pose]] names its task, so each must"),
        (
            with_poses('task = "push"', 'task = "trun"'),
            "pose[1].task = \"trun\": no such task; did you mean 'turn'? allowed: push, turn",
        ),
        (
            with_poses('task = "turn"', 'task = "push"'),
            (
                'pose[0].task = "turn": is out of order: give the poses in the order of the tasks, '
                "the same number for each task"
            ),
        ),
        (
            with_poses('per = "task"', 'per = "task"'),
            'pose[0].per = "task": needs a single [pose]; write task = "NAME" in each [[pose]] instead',
        ),
    ],
)
def test_refusals(text: str, message: str) -> None:
    with pytest.raises(CaseError) as refused:
        read(text)
    assert str(refused.value) == f"case.toml: {message}"


def test_cases_in_python_are_checked_too() -> None:
    case = pins()
    with pytest.raises(CaseError, match=r"x1.tasks: must have one value for each of the 2 tasks, got 3"):
        replace(case, parameters={**case.parameters, "x1": PerTask([1.0, 2.0, 3.0])})
    with pytest.raises(CaseError, match="needs several tasks"):
        replace(case, tasks=case.tasks[:1], parameters={**case.parameters, "x1": PerTask([Free(5, 12)])})
    with pytest.raises(CaseError, match="must give each of the 2 tasks the same number of poses, got 3 stated poses"):
        replace(case, further=[Pose((0, 0, 40))] * 2, pose_per_task=True)


@pytest.mark.parametrize("method", ["average", "weighted-sum", "worst-case"])
def test_limits_of_all_tasks_are_reported_for_every_method(method: str, tmp_path: Path, cli: Run) -> None:
    file, data = tmp_path / "case.toml", tmp_path / "result.json"
    text = SECTION_4_3.replace("worst-case", method)
    file.write_text(text + "[limits]\nactuator = { stroke_max = 20 }\nleg_length = { min = 25, max = 52 }\n")
    status, _, fault = cli("solve", str(file), "--json", str(data))
    assert fault == ""
    combined = json.loads(data.read_text())["combined"]
    lengths = np.array([list(each["quantities"]["leg_length"].values()) for each in combined["settings"]])
    outside = [row["key"] for row in combined["limits"] if row["violated"]]
    assert ("actuator.stroke_max" in outside) == bool(np.ptp(lengths, axis=0).max() > 20 + 1e-6)
    assert ("leg_length.min" in outside) == bool(lengths.min() < 25 - 1e-6)
    assert ("leg_length.max" in outside) == bool(lengths.max() > 52 + 1e-6)
    assert status == (1 if outside else 0)
    assert outside or method != "average"  # nothing keeps an average within limits


def test_the_answer_comes_before_its_comparisons(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(changes, "is_requested", lambda: True)
    solution = solve(pins())
    assert solution.status is Status.OPTIMAL
    assert [(each.solution, each.reason) for each in solution.changes] == [(None, "the solve was stopped")]

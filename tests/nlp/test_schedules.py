"""Schedules along a path: independent kinematics, exhaustive search, proved bounds, refusals and round trips."""

from __future__ import annotations

import csv
import itertools
import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from builders import Run, docs_script

from screwsynth.models import FloatArray
from screwsynth.nlp import CaseError, Solution, load_case, result_of, solve
from screwsynth.nlp.case.case import Case
from screwsynth.nlp.case.limits.constraint import LENGTH, NUMBER, SQUARED_LENGTH
from screwsynth.nlp.case.pose import Free, OverPoses
from screwsynth.nlp.output.pictures.schedules import schedule_figure
from screwsynth.nlp.path.reader import path_without_settings
from screwsynth.nlp.path.waypoints import waypoints
from screwsynth.nlp.results.schedule import schedule_data
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.schedule.cells import cell_bound
from screwsynth.nlp.solver.schedule.dynamic import Grid, best_path, seeds, sliding_maximum
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.schedule.polish import polish
from screwsynth.nlp.solver.schedule.problem import ScheduleProblem
from screwsynth.nlp.system.jsonvalues import json_data
from screwsynth.nlp.words.schedule import schedule_lines
from screwsynth.nlp.words.text import Line

_DEGREE = math.pi / 180
_YAW = Path("cases/hexapod-yaw.toml").resolve()


def _circle(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the angles (N,) of points of the circle, and their positions (N, 3), inches."""
    angles = np.linspace(0, 2 * np.pi, count)
    return angles, np.stack([4 + 5 * np.cos(angles), 3 + 5 * np.sin(angles), np.full(count, 20.0)], axis=1)


def _struts(angle: float, position: FloatArray, turn: float, lean: float = 30.0) -> FloatArray:
    """Return the vectors (6, 3) of the struts: own kinematics of LinuxCNC's hexapod, with the tool leaning outwards."""
    centres, signs = np.repeat([0.0, 120.0, 240.0], 2) * _DEGREE, np.tile([-1, 1], 3)
    base = 26.5 * np.stack([np.cos(centres), np.sin(centres), 0 * centres], axis=1)
    at = centres + signs * 55 * _DEGREE
    platform = 11.543 * np.stack([np.cos(at), np.sin(at), 0 * at], axis=1)

    def about(axis: FloatArray, size: float) -> FloatArray:
        x, y, z = axis
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.asarray(np.eye(3) + np.sin(size) * K + (1 - np.cos(size)) * K @ K)

    tilt = about(np.array([-np.sin(angle), np.cos(angle), 0.0]), lean * _DEGREE)
    R = tilt @ about(np.array([0.0, 0.0, 1.0]), turn)
    return np.asarray(position + platform @ R.T - base)


def _objective(angle: float, position: FloatArray, turn: float) -> float:
    """Return F of the feed direction: the sum of the squared components of the struts' unit vectors along it."""
    struts = _struts(angle, position, turn)
    feed = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return float(((struts @ feed) ** 2 / (struts**2).sum(axis=1)).sum())


def _path(file: Path, count: int, lean: float = 30.0) -> None:
    """Write the circle as a table of poses with times."""
    angles, positions = _circle(count)
    half = lean * _DEGREE / 2
    with file.open("w") as text:
        text.write("t,x,y,z,qw,qx,qy,qz\n")
        for a, p in zip(angles, positions, strict=True):
            q = (math.cos(half), -math.sin(a) * math.sin(half), math.cos(a) * math.sin(half), 0.0)
            text.write(",".join(repr(float(v)) for v in (5 * a, *p, *q)) + "\n")


def _written(folder: Path, *changes: tuple[str, str], count: int = 0, lean: float = 30.0) -> Path:
    """Return a changed copy of the shipped case; with its own path for a number of points."""
    text = _YAW.read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    if count:
        _path(folder / "own.csv", count, lean)
        text = text.replace("hexapod-yaw.csv", "own.csv")
    else:
        (folder / "hexapod-yaw.csv").write_bytes(_YAW.with_suffix(".csv").read_bytes())
    text = text[: text.index("[expect]")]
    file = folder / "case.toml"
    file.write_text(text)
    return file


def _few_points(case: Case, count: int) -> ScheduleProblem:
    """Return the problem of a case at few points of its path, so that bounds take little time."""
    return replace(schedule_problem(case), points=waypoints(path_without_settings(case), count))


def _with_table(folder: Path, table: str, *changes: tuple[str, str]) -> str:
    """Return the name of a changed copy of the shipped case with another path."""
    file = _written(folder, *changes)
    (folder / "hexapod-yaw.csv").write_text(table)
    return str(file)


#: First lines of the task of the shipped case.
_TASK_LINES = '[[task]]\nname = "feed"\nsense = "max"\n'
_STRUT = (
    (
        _TASK_LINES + f'follows = "feed"{" " * 21}# the direction of the feed at each point\n',
        "",
    ),
    ('as = "mean"', 'as = "worst"\nminimise = "leg_length"'),
)


@pytest.fixture(scope="module")
def yaw() -> Case:
    return load_case(str(_YAW))


def test_shipped_case_reaches_the_known_schedule(yaw: Case) -> None:
    solution = solve(yaw, gap=5e-4)
    schedule = solution.schedule
    assert schedule is not None
    assert schedule.constant is not None
    assert schedule.bound is not None
    assert solution.status.value == "locally optimal"
    assert schedule.value == pytest.approx(1.6913299, abs=2e-7)
    assert schedule.value == solution.F
    assert schedule.constant.value == pytest.approx(1.657882, abs=1e-6)
    assert schedule.constant.values[0] == pytest.approx(-0.7011, abs=1e-3)
    assert schedule.gain == pytest.approx(0.02017, abs=1e-4)
    # A bound below a schedule would be a false proof; the gap is what was asked for.
    assert 1.691329 < schedule.value <= schedule.bound <= 1.6925
    assert schedule.gap is not None
    assert schedule.gap <= 5e-4
    assert schedule.names == ("turn",)
    # Objective and limits again, by kinematics of this file.
    angles, positions = _circle(200)
    turns = schedule.values[:, 0] * _DEGREE
    F = [_objective(a, p, s) for a, p, s in zip(angles, positions, turns, strict=True)]
    assert np.mean(F) == pytest.approx(schedule.value, abs=1e-9)
    np.testing.assert_allclose(schedule.F, F, atol=1e-9)
    assert F[57] == pytest.approx(1.7382456, abs=1e-6)
    lengths = np.array(
        [np.linalg.norm(_struts(a, p, s), axis=1) for a, p, s in zip(angles, positions, turns, strict=True)]
    )
    assert lengths.min() >= 17 * (1 - 1e-9)
    assert lengths.max() <= 43 * (1 + 1e-9)
    steps = np.abs(np.diff(schedule.values[:, 0]))
    assert (steps <= 5 * np.diff(schedule.times)).all()
    assert np.abs(schedule.values).max() <= 75


def test_ipopt_alone_stays_on_another_ridge(yaw: Case) -> None:
    problem = schedule_problem(yaw)
    found = polish(problem, np.zeros(0), np.zeros((200, 1)), near=False)
    assert found is not None
    assert found.value == pytest.approx(1.670501, abs=1e-5)


def test_worst_value_has_no_gain(tmp_path: Path, cli: Run) -> None:
    code, out, _ = cli("solve", str(_written(tmp_path, ('as = "mean"', 'as = "worst"'))))
    assert code == 0
    assert "worst F = 1.375807 (in/in)² along 199 segments (1.375807 with the best constant turn, no gain)" in " ".join(
        out.split()
    )


def test_longest_strut(tmp_path: Path) -> None:
    file = _written(tmp_path, *_STRUT, ("max = 43", "max = 60"), count=200, lean=40)
    schedule = solve(load_case(str(file))).schedule
    assert schedule is not None
    assert schedule.constant is not None
    assert schedule.value == pytest.approx(40.79375, abs=1e-4)
    assert schedule.constant.value == pytest.approx(41.3713, abs=1e-3)
    angles, positions = _circle(200)
    turns = schedule.values[:, 0] * _DEGREE
    longest = max(
        np.linalg.norm(_struts(a, p, s, 40), axis=1).max() for a, p, s in zip(angles, positions, turns, strict=True)
    )
    assert longest == pytest.approx(schedule.value, abs=1e-8)
    assert schedule.F.max() == pytest.approx(longest, abs=1e-8)


def test_struts_that_need_the_motion_are_proved_along_their_schedule(tmp_path: Path, cli: Run) -> None:
    """The shipped case has struts of 41 in: its schedule is proved, and the best constant turn, -3.6, is refuted."""
    table = tmp_path / "struts.csv"
    code, out, _ = cli("solve", "hexapod-struts", "--schedule", str(table))
    words = " ".join(out.split())
    assert code == 0
    assert "longest leg = 40.7937" in words
    assert "(no constant turn keeps the limits)" in words
    with table.open() as text:
        turns = [float(row["turn"]) * _DEGREE for row in csv.DictReader(text)]
    angles, positions = _circle(200)
    longest = max(
        np.linalg.norm(_struts(a, p, s, 40), axis=1).max() for a, p, s in zip(angles, positions, turns, strict=True)
    )
    assert longest == pytest.approx(40.7938, abs=1e-3)
    code, out, _ = cli("path", "hexapod-struts", "--along", str(table))
    assert code == 0
    assert "PROVED at every point: no singularity, 12 limits satisfied" in " ".join(out.split())

    # Of all constant turns, the best leaves struts of 41.37 in.
    def longest_at(turn: float, every: int) -> float:
        lengths = [
            np.linalg.norm(_struts(a, p, turn * _DEGREE, 40), axis=1)
            for a, p in zip(angles[::every], positions[::every], strict=True)
        ]
        return float(np.max(lengths))

    constants = np.arange(-75.0, 75.1, 1.2)
    assert constants[np.argmin([longest_at(each, 5) for each in constants])] == pytest.approx(-3.6, abs=1.3)
    assert longest_at(-3.6, 1) == pytest.approx(41.3719, abs=2e-3)
    code, out, _ = cli("path", "hexapod-struts", "--set", "turn=-3.6")
    assert code == 1
    assert "leg_length limb 3- exceeds 41 in" in " ".join(out.split())


def test_the_shipped_paths_are_the_written_ones() -> None:
    script = docs_script("circles")
    for name, lean in script.LEANS.items():
        table = _YAW.with_name(f"{name}.csv").read_text()
        assert script.table(lean) == table, "run `make docs`"
        angles, positions = _circle(200)
        rows = np.array([[float(each) for each in line.split(",")] for line in table.splitlines()[1:]])
        np.testing.assert_allclose(rows[:, 0], 5 * angles, atol=1e-11)
        np.testing.assert_allclose(rows[:, 1:4], positions, atol=1e-11)
        w, x, y, z = rows[:, 4:].T
        axes = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
        s, c = math.sin(lean * _DEGREE), math.cos(lean * _DEGREE)
        np.testing.assert_allclose(
            axes, np.stack([s * np.cos(angles), s * np.sin(angles), c + 0 * angles], axis=1), atol=1e-11
        )


def test_longest_strut_below_the_least_has_no_schedule(tmp_path: Path, cli: Run) -> None:
    file, result = _written(tmp_path, *_STRUT, ("max = 43", "max = 40.6"), count=200, lean=40), tmp_path / "r.json"
    code, out, _ = cli("solve", str(file), "--json", str(result))
    assert code == 1
    assert "no schedule found: the search found no turn within the limits and rates; this is no proof" in " ".join(
        out.split()
    )
    assert "infeasible" not in out
    assert json.loads(result.read_text())["status"] == "not converged"


@pytest.mark.soak
def test_a_finer_path_has_nearly_the_same_mean(tmp_path: Path) -> None:
    schedule = solve(load_case(str(_written(tmp_path, count=1000)))).schedule
    assert schedule is not None
    assert schedule.value == pytest.approx(1.692791, abs=2e-6)


def test_a_closed_contour_ends_as_it_begins(tmp_path: Path) -> None:
    found = []
    for changes in ([("tool = {", "periodic = true\ntool = {")], []):
        changes.append(("rate = 5", "rate = 2"))
        problem = _few_points(load_case(str(_written(tmp_path, *changes, count=12))), 12)
        assert problem.is_periodic == (len(changes) == 2)
        ways = [polish(problem, np.zeros(0), s) for s in seeds(problem, np.zeros(0), np.zeros(1), fine=False)]
        found.append(max((each for each in ways if each is not None), key=lambda each: each.value))
    periodic, free = found
    assert periodic.s[0, 0] == pytest.approx(periodic.s[-1, 0], abs=1e-9)
    # Without the condition the ends differ, and the value is no less.
    assert abs(free.s[0, 0] - free.s[-1, 0]) > 1e-3
    assert periodic.value <= free.value + 1e-9


def test_dynamic_programming_equals_exhaustive_search() -> None:
    rng = np.random.default_rng(3)
    for is_worst, count in itertools.product((True, False), (3, 5)):
        objective = rng.normal(size=(count, 6))
        objective[rng.random(objective.shape) < 0.15] = -math.inf
        weights = rng.random(count)
        reach = rng.integers(0, 3, count - 1)
        grid = Grid(np.arange(count), np.arange(6.0), objective, reach, weights)
        found = best_path(grid, is_worst=is_worst)
        best = -math.inf
        for way in itertools.product(range(6), repeat=count):
            if (np.abs(np.diff(way)) <= reach).all():
                values = objective[np.arange(count), way]
                best = max(best, values.min() if is_worst else float(values @ weights))
        if found is None:
            assert best == -math.inf
            continue
        values = objective[np.arange(count), found.astype(int)]
        assert (np.abs(np.diff(found)) <= reach).all()
        assert (values.min() if is_worst else float(values @ weights)) == pytest.approx(best)


def test_sliding_maximum_equals_its_definition() -> None:
    values = np.random.default_rng(0).normal(size=23)
    for reach in (0, 1, 2, 5, 22, 40):
        expected = [values[max(m - reach, 0) : m + reach + 1].max() for m in range(23)]
        np.testing.assert_array_equal(sliding_maximum(values, reach), expected)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 12))])
def test_bound_is_never_below_a_sampled_schedule(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    changes = [
        ("x4 = 5", f"x4 = {rng.uniform(2, 20):.6f}"),
        ("rate = 5", f"rate = {rng.uniform(2, 40):.6f}"),
        ("max = 43", f"max = {rng.uniform(42, 48):.6f}"),
    ]
    changes += [('as = "mean"', 'as = "worst"')] if seed % 2 else []
    problem = _few_points(load_case(str(_written(tmp_path, *changes, count=8))), 8)
    d = np.zeros(0)
    best = -math.inf
    limits = problem.steps[:, 0]
    for _ in range(400):
        s = np.empty((len(problem.points), 1))
        s[0] = rng.uniform(-75, 75) * _DEGREE
        for i, step in enumerate(limits):
            s[i + 1] = np.clip(s[i] + rng.uniform(-step, step), -75 * _DEGREE, 75 * _DEGREE)
        values = problem.at(d, s)
        if (values.excess <= 0).all():
            best = max(best, problem.value(d, s))
    assert math.isfinite(best)
    polished = [polish(problem, d, s) for s in seeds(problem, d, np.zeros(1))]
    known = max(each.value for each in polished if each is not None)
    assert known >= best
    # The bound holds also if only a poorer schedule is known.
    assert cell_bound(problem, d, known - 0.05 * abs(known), 0.1).bound >= known
    assert cell_bound(problem, d, known, 0.02).bound >= known


def test_written_schedule_keeps_rates_and_limits(tmp_path: Path, cli: Run) -> None:
    target, result = tmp_path / "s.csv", tmp_path / "r.json"
    file = _written(tmp_path, ("max = 43", "max = 60"), count=40)
    code, _, _ = cli("solve", str(file), "--schedule", str(target), "--json", str(result))
    assert code == 0
    with target.open() as text:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(text)]
    assert list(rows[0]) == ["x", "y", "z", "qw", "qx", "qy", "qz", "turn", "t"]
    for one, other in itertools.pairwise(rows):
        assert abs(other["turn"] - one["turn"]) <= 5 * (other["t"] - one["t"])
    assert all(-75 <= row["turn"] <= 75 for row in rows)
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    assert data["status"] == "locally optimal"
    assert data["schedule"]["names"] == ["turn"]
    assert len(data["schedule"]["rows"]) == len(rows)
    assert data["schedule"]["rates"][0]["used"] <= data["schedule"]["rates"][0]["max"] * (1 + 1e-12)


def test_case_is_read_again_from_its_text(yaw: Case, tmp_path: Path) -> None:
    text = yaw.to_toml()
    (tmp_path / "again.toml").write_text(text)
    again = load_case(str(tmp_path / "again.toml"))
    assert again.settings == yaw.settings
    assert again.over_path is OverPoses.MEAN
    assert again.tasks[0].follows == "feed"
    assert again.to_toml() == text
    moving = load_case(str(_written(tmp_path, ("x3 = 0", 'x3 = { min = 0, max = 9, per = "path", rate = 2 }'))))
    assert moving.settings["x3"] == Free(0.0, 9 * _DEGREE, rate=2 * _DEGREE)
    assert 'per = "path"' in moving.to_toml()
    assert moving.replace(x3=4, turn=2).settings == {}


_PER_PATH = ("x3 = 0", 'x3 = { min = 0, max = 30, per = "path", rate = 2 }')


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("x3 = 0", 'x3 = { min = 0, max = 30, per = "path" }')],
         "robot.parameters.x3.rate: is missing: a number that changes along the path needs its largest rate, or inf"),
        ([("x3 = 0", "x3 = { min = 0, max = 30, rate = 2 }")],
         'robot.parameters.x3.rate: has an effect only with per = "path"'),
        ([("rate = 5", "rate = 0")], "path.tool.turn.rate = 0.0: must be positive, or inf for no limit"),
        ([("rate = 5", "rate = -5")], "path.tool.turn.rate = -5.0: must be positive, or inf for no limit"),
        ([("rate = 5", "rate = nan")], "path.tool.turn.rate = nan: must be positive, or inf for no limit"),
        ([(", rate = 5", "")],
         "path.tool.turn.rate: is missing: a number that changes along the path needs its largest rate, or inf"),
        ([('as = "mean"', 'as = "mean"\nminimise = "leg_length"')],
         'task[0].sense = "max": objective.minimise needs no task: remove [[task]], or give it sense = "min"'),
        ([('sense = "max"', 'sense = "min"'), ('as = "mean"', 'as = "mean"\nminimise = "leg_length"')],
         'task[0].follows = "feed": conflicts with objective.minimise'),
        ([*_STRUT[:1], ('as = "mean"', 'as = "mean"\nminimise = "actuator_force"')],
         'objective.minimise = "actuator_force": needs a table [[load]] with a load on the platform'),
        ([('follows = "feed"', 'follows = "feed"\npitch = 0')],
         "task[0].pitch: conflicts with follows; state the motion in one way"),
        ([('follows = "feed"', 'follows = "thrust"'), ("tool = {", "#")], "needs path.tool with the tool's axis"),
        ([("position = [9,", "position = [{ min = 8, max = 9 },")], "pose: must be fixed with objective.as"),
        ([('as = "mean"', 'as = "median"')], "objective.as"),
        ([("axis = [0, 0, 1], turn", "axis = [0, 0, 0], turn")], "path.tool.axis = [0.0, 0.0, 0.0]: must not be zero"),
    ],
)  # fmt: skip
def test_bad_cases_are_refused(tmp_path: Path, changes: list[tuple[str, str]], words: str) -> None:
    with pytest.raises(CaseError) as error:
        load_case(str(_written(tmp_path, *changes)))
    assert words in str(error.value)


def test_change_along_a_missing_path_is_refused(tmp_path: Path) -> None:
    text = _written(tmp_path, _PER_PATH).read_text()
    (tmp_path / "case.toml").write_text(text[: text.index("[path]")])
    with pytest.raises(CaseError, match=r'robot\.parameters\.x3\.per = "path": the case states no path'):
        load_case(str(tmp_path / "case.toml"))


def _refusal(cli: Run, *arguments: str) -> str:
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    return " ".join(err.split())


def test_commands_refuse_what_they_cannot_do(tmp_path: Path, cli: Run) -> None:
    own = ("x1 = 26.5", 'x1 = { min = 18, max = 34, per = "path", rate = 0.5 }')
    three = str(_written(tmp_path, _PER_PATH, own))
    assert "certify: bounds schedules of at most two changing numbers; this case has 3" in _refusal(
        cli, "solve", three, "--certify"
    )
    assert "turn changes along the path, but this command takes one robot" in _refusal(cli, "evaluate", str(_YAW))
    free = str(_written(tmp_path, ("x1 = 26.5", "x1 = { min = 20, max = 30 }")))
    assert "--round: is for designs at stated poses" in _refusal(cli, "solve", free, "--round", "1")
    schedule = ("solve", "paper-4.1-helical", "--schedule", str(tmp_path / "none.csv"))
    assert "--schedule: the case optimises nothing along a path" in _refusal(cli, *schedule)
    assert not (tmp_path / "none.csv").exists()


def test_path_of_one_point_and_path_without_times_are_refused(tmp_path: Path, cli: Run) -> None:
    file = _written(tmp_path)
    (tmp_path / "hexapod-yaw.csv").write_text("t,x,y,z\n0,9,3,20\n")
    assert "fewer than two points" in _refusal(cli, "solve", str(file))
    (tmp_path / "hexapod-yaw.csv").write_text("x,y,z\n9,3,20\n4,8,20\n")
    assert "turn.rate: needs the time of every segment, which the path does not state" in _refusal(
        cli, "solve", str(file)
    )


def test_picture_has_the_schedule_and_the_constant(tmp_path: Path) -> None:
    case = load_case(str(_written(tmp_path, ("max = 43", "max = 60"), count=30)))
    figure = schedule_figure(case, solve(case))
    assert figure is not None
    marks = {artist.get_gid() for artist in figure.findobj()}
    assert {"schedule turn", "constant", "rate turn", "rate limit"} <= marks


def test_the_feed_has_a_direction_where_the_path_turns_back(tmp_path: Path) -> None:
    """Out and back along x, also with an end that differs from the beginning by rounding."""
    for end in ("0", "1e-13"):
        case = load_case(_with_table(tmp_path, f"t,x,y,z\n0,0,0,20\n5,3,0,20\n10,0,{end},20\n"))
        feeds = waypoints(path_without_settings(case), 10).feeds
        np.testing.assert_allclose(np.abs(feeds), np.repeat([[1.0, 0.0, 0.0]], len(feeds), axis=0), atol=1e-12)
    assert feeds[1, 0] == 1.0
    assert feeds[-2, 0] == -1.0


def test_a_point_without_translation_has_no_feed(tmp_path: Path, cli: Run) -> None:
    rows = "0,0,0,20,1,0,0,0\n5,3,0,20,1,0,0,0\n6,3,0,20,0.8,0.6,0,0\n7,3,0,20,0,1,0,0\n12,3,2,20,0,1,0,0\n"
    file, target = (
        _with_table(tmp_path, f"t,x,y,z,qw,qx,qy,qz\n{rows}", ('as = "mean"', 'as = "worst"')),
        tmp_path / "s.csv",
    )
    words = _refusal(cli, "solve", file, "--schedule", str(target))
    assert 'task[0].follows = "feed": has no direction at (3, 0, 20)' in words
    assert not target.exists()


def test_a_path_in_one_place_has_no_feed(tmp_path: Path, cli: Run) -> None:
    for table in ("t,x,y,z\n0,9,3,20\n3,9,3,20\n", "t,x,y,z,qw,qx,qy,qz\n0,0,0,20,1,0,0,0\n5,0,0,20,0.8,0.6,0,0\n"):
        assert "has no direction at" in _refusal(cli, "solve", _with_table(tmp_path, table))


def test_feasibility_is_relative_to_the_range_and_the_rates(tmp_path: Path) -> None:
    case = load_case(str(_written(tmp_path, ("rate = 5", "rate = 1e-7"), ("max = 43", "max = 60"))))
    problem = _few_points(case, 8)
    held = np.zeros((len(problem.points), 1))
    assert problem.is_feasible(np.zeros(0), held)
    steps = np.cumsum([0.0, *problem.steps[:, 0]])
    # Ten times the rate, far below the range: a slack relative to the range would allow it.
    fast = 10 * np.minimum(steps, steps[-1] - steps)[:, None]
    assert not problem.is_feasible(np.zeros(0), fast)
    assert problem.is_feasible(np.zeros(0), 0.09 * fast)


def test_a_closed_schedule_must_end_as_it_begins(tmp_path: Path) -> None:
    changes = [("tool = {", "periodic = true\ntool = {"), ("max = 43", "max = 60")]
    problem = _few_points(load_case(str(_written(tmp_path, *changes))), 8)
    moved = np.linspace(0.0, 1e-3, len(problem.points))[:, None]
    assert problem.is_feasible(np.zeros(0), np.zeros_like(moved))
    assert not problem.is_feasible(np.zeros(0), moved)


@pytest.mark.parametrize("size", [1e-3, pytest.param(1e3, marks=pytest.mark.soak)])
def test_the_size_of_the_robot_changes_no_answer(tmp_path: Path, size: float) -> None:
    """The same robot and path, scaled: the same gain, bound, and excess over limits."""
    found = []
    for scale in (1.0, size):
        changes = [
            ("x1 = 26.5", f"x1 = {26.5 * scale!r}"),
            ("x2 = 11.543", f"x2 = {11.543 * scale!r}"),
            ("min = 17, max = 43", f"min = {17 * scale!r}, max = {43 * scale!r}"),
        ]
        folder = tmp_path / str(scale)
        folder.mkdir()
        _, positions = _circle(12)
        rows = "".join(f"{5 * k},{','.join(repr(float(v)) for v in scale * p)}\n" for k, p in enumerate(positions))
        problem = _few_points(load_case(_with_table(folder, "t,x,y,z\n" + rows, *changes)), 12)
        (seed,) = seeds(problem, np.zeros(0), np.zeros(1))
        best = polish(problem, np.zeros(0), seed)
        assert best is not None
        bound = cell_bound(problem, best.d, best.value, 0.01).bound
        found.append((best.value, bound, *problem.at(best.d, np.zeros_like(seed)).excess.ravel()))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6, atol=1e-9)


def test_a_bound_of_zero_is_relative_to_the_robot() -> None:
    assert LENGTH.size(0.0, 40.0) == 40.0
    assert SQUARED_LENGTH.size(0.0, 40.0) == 1600.0
    assert (NUMBER.size(0.0, 40.0), LENGTH.size(-3.0, 40.0)) == (1.0, 3.0)


def test_report_has_map_and_points_of_the_schedule(tmp_path: Path, cli: Run) -> None:
    page = tmp_path / "page.html"
    assert cli("report", str(_written(tmp_path, count=12)), "--out", str(page))[0] == 0
    text = page.read_text()
    schedule = text[text.index('<section id="schedule"') :]
    schedule = schedule[: schedule.index('id="robot"')]
    assert "data:image/svg+xml" in schedule
    points = schedule[schedule.index('id="points"') :]
    words = re.sub(r"<[^>]*>", "", text)
    segments = re.search(r"along (\d+) segments", words)
    assert segments is not None
    assert points[points.index("<tbody") : points.index("</tbody")].count("<tr") == int(segments[1]) + 1
    for each in ("a translation along the feed at each point", "best constant turn"):
        assert each in words


@pytest.mark.parametrize(
    "words",
    [
        ("evaluate",),
        ("certify",),
        ("sweep", "--over", "x1=20:30:3", "--out", "sweep.csv"),
        ("tradeoff", "--over", "x1=20:30:3"),
        ("pareto", "--goal", "max F", "--goal", "min limits.leg_length.max"),
        ("compare", "case", "6-ups"),
        ("export", "--format", "mjcf", "--out", "files"),
    ],
    ids=lambda words: words[0],
)
def test_commands_with_one_robot_refuse_a_schedule(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    case = _written(tmp_path)
    monkeypatch.chdir(tmp_path)
    before = {*tmp_path.iterdir()}
    refusal = _refusal(cli, words[0], str(case), *words[1:])
    assert 'objective.as = "mean": turn changes along the path' in refusal
    assert "use solve" in refusal
    assert {*tmp_path.iterdir()} == before


@pytest.mark.parametrize("setting", ["turn", "x3"])
@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("evaluate",), "changes along the path, but this command takes one robot; use solve"),
        (("certify",), "changes along the path, but this command takes one robot; use solve"),
        (("sweep", "--over", "x1=20:30:3", "--out", "sweep.csv"), "but this command takes one robot; use solve"),
        (("tradeoff", "--over", "x1=20:30:3"), "but this command takes one robot; use solve"),
        (("pareto", "--goal", "max F", "--goal", "min limits.leg_length.max"), "takes one robot; use solve"),
        (("compare", "case", "6-ups"), "but this command takes one robot; use solve"),
        (("export", "--format", "csv", "--out", "files"), "but this command takes one robot; use solve"),
        (("workspace",), "workspace: is missing: state the poses to be verified in [workspace]"),
        (("path",), "changes along the path; add the column, or fix the value with --set"),
    ],
    ids=lambda each: each[0] if isinstance(each, tuple) else "",
)
def test_a_result_with_a_schedule_is_no_single_robot(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], fault: str, setting: str
) -> None:
    """With --of, a command refuses a schedule as it refuses the case, and names the way out."""
    case, result = _of_few_points(tmp_path, setting, monkeypatch)
    before = {*tmp_path.iterdir()}
    refusal = _refusal(cli, words[0], str(case), *words[1:], "--of", str(result))
    assert fault in refusal
    assert {*tmp_path.iterdir()} == before


def test_a_result_with_a_schedule_leaves_the_moving_dimension_free(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, result = _of_few_points(tmp_path, "x3", monkeypatch)
    for command in (("solve",), ("path", "--along", "schedule.csv")):
        assert cli(command[0], str(case), *command[1:], "--of", str(result))[0] == 0
    schedule = json.loads(result.read_text())["schedule"]
    again = tmp_path / "again.json"
    assert cli("solve", str(case), "--of", str(result), "--json", str(again))[0] == 0
    found = json.loads(again.read_text())["schedule"]
    assert (found["names"], found["value"]) == (["x3"], pytest.approx(schedule["value"], rel=1e-9))
    # Another case has one value for this dimension, and takes none from the schedule.
    fixed = tmp_path / "fixed.toml"
    fixed.write_text(case.read_text().replace('x3 = { min = 0, max = 9, per = "path", rate = 2 }', "x3 = 3"))
    words = _refusal(cli, "solve", str(fixed), "--of", str(result))
    assert "x3 changes along the path, but 'fixed' has one value for it; set the value with --set" in words
    # Joints at given poses need a value for each dimension; a turn about the tool is part of the pose.
    (tmp_path / "poses.csv").write_text("x,y,z\n9,3,20\n")
    words = _refusal(cli, "inverse", str(case), "--poses", "poses.csv")
    assert (
        "robot.parameters.x3: changes along the path, and joint positions are computed with fixed dimensions" in words
    )
    assert words.endswith("give it with --set")
    assert cli("inverse", str(case), "--poses", "poses.csv", "--set", "x3=3")[0] == 0


def _of_few_points(folder: Path, setting: str, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Return a case with one setting along a path of few points, and the file of its result."""
    changes = [("max = 43", "max = 60")]
    if setting == "x3":
        changes.append(("x3 = 0", 'x3 = { min = 0, max = 9, per = "path", rate = 2 }'))
    case, result = _written(folder, *changes, count=20), folder / "result.json"
    if setting == "x3":
        case.write_text(case.read_text().replace("tool = {", "# tool = {"))
    monkeypatch.chdir(folder)
    solution = _solved(case.read_text(), setting)
    assert solution.schedule is not None
    result.write_text(json.dumps(json_data(result_of(solution))))
    (folder / "schedule.csv").write_text(solution.schedule.to_csv())
    return case, result


@cache
def _solved(text: str, setting: str) -> Solution:
    """Return the solution of a case, in the present folder; each setting is solved once."""
    solution = solve(load_case("case.toml"))
    assert solution.schedule is not None, text
    assert solution.schedule.names == (setting,)
    return solution


def test_words_name_only_methods_that_were_used() -> None:
    """Without a setting there is no dynamic programming; without a free value there is no search."""
    case = load_case("hexapod-yaw", {"turn": 0})
    fixed, free = case, replace(case, parameters={**case.parameters, "x1": Free(26.0, 27.0)})
    words = {}
    for name, each in (("fixed", fixed), ("free", free)):
        schedule = solve(each, starts=1).schedule
        assert schedule is not None
        lines = schedule_lines(each, schedule_data(schedule))
        words[name] = next(line.words for line in lines if isinstance(line, Line) and line.label == "status")
    assert words == {
        "fixed": "evaluated: all dimensions and settings are fixed",
        "free": "locally optimal: searches by Ipopt; another design may be better",
    }


def test_length_of_the_tool_axis_does_not_matter() -> None:
    """A stated axis has any length but zero, also one whose square is 0 in floating point."""
    case, s = load_case("hexapod-yaw"), np.full((200, 1), -0.5)
    assert case.path is not None
    assert case.path.tool is not None
    short = replace(case, path=replace(case.path, tool=replace(case.path.tool, axis=(0.0, 0.0, 1e-200))))
    stated, found = (schedule_problem(each).at(np.zeros(0), s).objective for each in (case, short))
    np.testing.assert_array_equal(found, stated)


def test_a_fixed_turn_is_evaluated_and_no_search_is_claimed(tmp_path: Path, cli: Run) -> None:
    code, out, _ = cli("solve", str(_written(tmp_path)), "--set", "turn=5")
    words = " ".join(out.split())
    assert code == 0
    assert "(no setting changes) status evaluated: all dimensions and settings are fixed" in words
    assert "another schedule may be better" not in words


def test_an_unknown_name_is_refused_with_the_turn_among_the_allowed_names(tmp_path: Path, cli: Run) -> None:
    assert "p_z, angle, axis, rpy, quaternion, turn;" in _refusal(
        cli, "solve", str(_written(tmp_path)), "--set", "x9=1"
    )

"""Actuated joints that the pose does not determine, as settings along a path: kinematics and searches in NumPy."""

from __future__ import annotations

import csv
import json
import math
import re
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from builders import Array, Run, output_of, refusal_of, saved, turn_about, unbroken
from test_free_joints import LEGS

from screwsynth.models import robot_function
from screwsynth.nlp import CaseError, JointMotion, load_case, solve
from screwsynth.nlp.case.pose import Free
from screwsynth.nlp.path.reader import read_path
from screwsynth.nlp.path.settings import changing_of
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.scheduled import Schedule

RAIL, RATE = 0.2, 0.1
#: Crank and rod of each limb of the planar robot.
CRANK, ROD = math.hypot(0.5, 1.0), math.hypot(1.1, 0.8)


def turned(limb: int, point: tuple[float, float]) -> Array:
    """Return a point (2,) of the first limb, turned into another limb."""
    return np.asarray(turn_about([0, 0, 1], 2 * math.pi * limb / 3)[:2, :2] @ np.array(point))


def robot_text(rails: int = 1) -> str:
    """Return the file of a planar robot of three limbs, of which the first ones have a driven rail below the crank."""
    text = 'name = "rails"\nhome = [0, 0, 0]\n'
    for limb in range(3):
        places = {"B": turned(limb, (2.0, 0.0)), "C": turned(limb, (1.5, 1.0)), "A": turned(limb, (0.4, 0.2))}
        x, y = turned(limb, (0.0, 1.0)).tolist()
        points = ", ".join(f"{name} = [{at[0]!r}, {at[1]!r}, 0]" for name, at in places.items())
        rail = f'    {{ type = "P", name = "rail", at = "B", axis = [{x!r}, {y!r}, 0], actuated = true }},\n'
        text += f"[[limb]]\npoints = {{ {points} }}\njoints = [\n".replace("np.float64(", "").replace(")", "")
        text += (rail if limb < rails else "") + '    { type = "R", at = "B", axis = "z", actuated = true },\n'
        text += '    { type = "R", at = "C", axis = "z" },\n    { type = "R", at = "A", axis = "z" },\n]\n'
    return text


def case_text(limits: str, more: str = "", over: str = 'as = "mean"', task: str = 'follows = "feed"') -> str:
    return f"""
title = "rails"
units.length = "m"
robot = {{ file = "robot.toml" }}
pose.position = [0, 0, 0]
[[task]]
sense = "max"
{task}
[objective]
over = "path"
{over}
[path]
file = "path.csv"
{more}
[limits.joint]
{limits}
"""


MOVING = f'{{ min = {-RAIL}, max = {RAIL}, per = "path", rate = {RATE} }}'


def circle(folder: Path, count: int = 40, radius: float = 0.25, turns: float = 1.0) -> None:
    """Write a circle as a table of poses, 10 s for a full turn."""
    angles = 2 * np.pi * turns * np.arange(count + 1) / count
    rows = [f"{10 * turns * k / count!r},{radius * np.cos(a)!r},{radius * np.sin(a)!r},0" for k, a in enumerate(angles)]
    text = "\n".join(["t,x,y,z", *rows, ""]).replace("np.float64(", "").replace(")", "")
    (folder / "path.csv").write_text(text)


def planar(folder: Path, text: str, rails: int = 1) -> str:
    saved(folder / "robot.toml", robot_text(rails))
    return str(saved(folder / "case.toml", text))


def elbow(limb: int, rail: Array, position: Array) -> tuple[Array, Array, Array]:
    """Return the centres (..., 2) of crank, elbow and platform joint, with the elbow on the side of home."""
    base = turned(limb, (2.0, 0.0)) + rail[..., None] * turned(limb, (0.0, 1.0))
    end = position + turned(limb, (0.4, 0.2))
    return base, bent(base, end), end


def bent(base: Array, end: Array) -> Array:
    """Return the elbow (..., 2) between the centres of crank and platform joint, on the side of home."""
    way = end - base
    apart = np.linalg.norm(way, axis=-1, keepdims=True)
    along = (CRANK**2 - ROD**2 + apart**2) / (2 * apart)
    across = np.stack([way[..., 1], -way[..., 0]], axis=-1) / apart
    return np.asarray(base + along * way / apart + np.sqrt(CRANK**2 - along**2) * across)


def work(limb: int, rail: Array, position: Array, feed: Array) -> Array:
    """Return the squared work rate (...) of a rod of unit force: its change of length with locked rail and crank."""
    _, at, end = elbow(limb, rail, position)
    return stretched(at, end, feed)


def stretched(at: Array, end: Array, feed: Array) -> Array:
    """Return the squared change of length (...) of a rod from an elbow at rest to a joint that moves along the feed."""
    step = 1e-6
    lengths = [np.linalg.norm(end + sign * step * feed - at, axis=-1) for sign in (1, -1)]
    return np.asarray(((lengths[0] - lengths[1]) / (2 * step)) ** 2)


class Points:
    """Positions (N, 2), feeds (N, 2), times and weights (N,) of the points of a schedule, from its table."""

    def __init__(self, schedule: Schedule) -> None:
        rows = list(csv.DictReader(schedule.to_csv().splitlines()))
        self.at = np.array([[float(row["x"]), float(row["y"])] for row in rows])
        self.times = np.array([float(row["t"]) for row in rows])
        self.rails = {name: np.array([float(row[name]) for row in rows]) for name in schedule.names}
        steps, seconds = np.diff(self.at, axis=0), np.diff(self.times)
        units = steps / np.linalg.norm(steps, axis=1, keepdims=True)
        closed = np.allclose(self.at[0], self.at[-1])
        before = np.vstack([units[-1] if closed else units[0], units])
        after = np.vstack([units, units[0] if closed else units[-1]])
        self.feed = (before + after) / np.linalg.norm(before + after, axis=1, keepdims=True)
        weights = np.concatenate([[seconds[0]], 0.5 * (seconds[1:] + seconds[:-1]), [seconds[-1]]])
        self.weights = weights / weights.sum()

    def part(self, limb: int, rail: Array) -> Array:
        """Return the part (N, ...) of F of a limb, for rail coordinates (N, ...)."""
        extra = (slice(None), *[None] * (rail.ndim - 1))
        return work(limb, rail, self.at[extra], self.feed[extra])

    def searched(self, limb: int, size: int = 1601, rate: float = RATE) -> tuple[float, float]:
        """Return the best mean part of a limb over all schedules of grid values within the rate, and over constants."""
        grid = np.linspace(-RAIL, RAIL, size)
        gain = self.weights[:, None] * self.part(limb, np.broadcast_to(grid, (len(self.at), size)))
        reach = np.floor(rate * np.diff(self.times) / (grid[1] - grid[0]) + 1e-9).astype(int)
        level = gain[0]
        for k, width in enumerate(reach.tolist()):
            wide = np.concatenate([np.full(width, -np.inf), level, np.full(width, -np.inf)])
            level = gain[k + 1] + np.lib.stride_tricks.sliding_window_view(wide, 2 * width + 1).max(axis=1)
        return float(level.max()), float(gain.sum(axis=0).max())


@cache
def one_rail(folder: Path) -> Schedule:
    """Return the schedule of the robot with one rail along the circle, with a proved bound."""
    circle(folder)
    found = solve(load_case(planar(folder, case_text(f"rail = {MOVING}"))), gap=1e-3).schedule
    assert found is not None
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rail")


def test_a_rail_has_the_schedule_of_an_exhaustive_search(folder: Path) -> None:
    schedule = one_rail(folder)
    points = Points(schedule)
    rail = points.rails["joint.1:1"]
    rest = sum(points.part(limb, np.zeros(len(rail))) for limb in (1, 2))
    np.testing.assert_allclose(schedule.F, points.part(0, rail) + rest, rtol=1e-8)
    fixed, (best, constant) = float(points.weights @ rest), points.searched(0)
    # The grid divides the steps that the rate allows, so the gap is of second order in its width.
    assert fixed + best - 1e-7 <= schedule.value <= fixed + best + 2e-6
    assert schedule.constant is not None
    assert schedule.constant.value == pytest.approx(fixed + constant, rel=1e-6)
    assert schedule.gain == pytest.approx(schedule.value / (fixed + constant) - 1, rel=1e-4)
    assert schedule.gain > 0.02
    assert schedule.bound is not None
    assert schedule.value <= schedule.bound <= schedule.value * 1.001
    assert "in the home working mode" in schedule.statement
    assert (np.abs(rail) <= RAIL).all()
    assert (np.abs(np.diff(rail)) <= RATE * np.diff(points.times)).all()


def test_a_schedule_is_proved_with_the_speed_of_its_rail(folder: Path) -> None:
    """Speeds of the cranks contain the rate of the rail: differences along the path, between its points too."""
    schedule, case = one_rail(folder), load_case(str(folder / "case.toml"))
    table = saved(folder / "schedule.csv", schedule.to_csv())
    judged = judge_path(case, read_path(str(table), case.units, changing=changing_of(case)))
    assert judged.is_proved
    speeds = {each.motor.actuator: each.bound for each in judged.verdicts if each.motor is not None}
    points = Points(schedule)
    part = np.linspace(0, 1, 21)
    fine = (np.arange(len(points.at) - 1)[:, None] + part[:-1]).ravel()
    every = np.arange(len(points.at))
    position = np.stack([np.interp(fine, every, column) for column in points.at.T], axis=1)
    times, rail = np.interp(fine, every, points.times), np.interp(fine, every, points.rails["joint.1:1"])
    for limb, name in enumerate(("1.2", "2", "3")):
        base, at, _ = elbow(limb, rail if limb == 0 else np.zeros(len(rail)), position)
        angle = np.unwrap(np.arctan2(*(at - base).T[::-1]))
        largest = float(np.abs(np.diff(angle) / np.diff(times)).max())
        assert largest * (1 - 1e-6) <= speeds[name] <= largest * 1.01
    assert speeds["rail"] == pytest.approx(np.abs(np.diff(points.rails["joint.1:1"]) / np.diff(points.times)).max())


def test_an_altered_schedule_is_refused_or_refuted(folder: Path, cli: Run) -> None:
    schedule = one_rail(folder)
    file, text = str(folder / "case.toml"), schedule.to_csv()
    head, *rows = text.splitlines()
    at = head.split(",").index("joint.1:1")

    def altered(k: int, value: float) -> str:
        cells = rows[k].split(",")
        cells[at] = repr(value)
        lines = [head, *rows[:k], ",".join(cells), *rows[k + 1 :], ""]
        return str(saved(folder / "altered.csv", "\n".join(lines)))

    refusal_of(cli("path", file, "--along", altered(5, 0.25)), "row 7, column joint.1:1: 0.25 is above its max 0.2")
    refusal_of(cli("path", file, "--along", altered(0, -0.19)), "joint.1:1 changes by", "more than its rate 0.1")
    refusal_of(cli("path", file, "--along", str(folder / "path.csv")), "column 'joint.1:1' is missing")
    # With a limit on the crank that the schedule exceeds, the path is refuted.
    crank = '"1:2" = { max = 10 }\n'
    tight = saved(folder / "tight.toml", Path(file).read_text() + crank)
    good = str(saved(folder / "good.csv", text))
    code, out, _ = cli("path", str(tight), "--along", good)
    assert code == 1
    assert "joint.1:2" in out
    assert cli("path", file, "--along", good)[0] == 0


def test_a_driven_arm_is_a_setting_in_degrees(tmp_path: Path) -> None:
    """In place of a rail, the base of the crank is on a driven arm of 0.316 m."""
    circle(tmp_path, 12)
    arm = '{ type = "R", name = "arm", at = [2.3, 0.1, 0], axis = "z", actuated = true }'
    text = robot_text()
    rail = next(line for line in text.splitlines() if '"rail", at' in line)
    saved(tmp_path / "robot.toml", text.replace(rail, f"    {arm},"))
    limits = 'arm = { min = -40, max = 40, per = "path", rate = 15 }'
    schedule = solve(load_case(str(saved(tmp_path / "case.toml", case_text(limits))))).schedule
    assert schedule is not None
    assert schedule.rates.tolist() == pytest.approx([15.0])
    points = Points(schedule)
    assert (np.abs(np.diff(points.rails["joint.1:1"])) <= 15 * np.diff(points.times)).all()
    centre, angle = np.array([2.3, 0.1]), np.radians(points.rails["joint.1:1"])
    way = np.array([2.0, 0.0]) - centre
    across = np.array([-way[1], way[0]])
    base = centre + np.cos(angle)[:, None] * way + np.sin(angle)[:, None] * across
    end = points.at + np.array([0.4, 0.2])
    rest = sum(points.part(limb, np.zeros(len(angle))) for limb in (1, 2))
    np.testing.assert_allclose(schedule.F, stretched(bent(base, end), end, points.feed) + rest, rtol=1e-8)
    assert schedule.gain is not None
    assert schedule.gain > 0.01


def test_three_rails_move_as_each_one_alone(tmp_path: Path) -> None:
    """Each rail is in one part of F, and on a circle the limbs follow each other after a third of the time."""
    circle(tmp_path, 24)
    limits = "\n".join(f'"{k}:1" = {MOVING}' for k in (1, 2, 3))
    schedule = solve(load_case(planar(tmp_path, case_text(limits, "periodic = true"), 3))).schedule
    assert schedule is not None
    assert schedule.names == ("joint.1:1", "joint.2:1", "joint.3:1")
    points = Points(schedule)
    parts = [float(points.weights @ points.part(k, schedule.values[:, k])) for k in range(3)]
    assert schedule.value == pytest.approx(sum(parts), rel=1e-9)
    # By symmetry, each limb has the same part, at a time shifted by a third. The first point counts twice, as the last
    # one too, which moves the schedules by a few steps of the rate.
    even = [float(points.part(k, schedule.values[:, k])[:-1].mean()) for k in range(3)]
    assert even == pytest.approx([even[0]] * 3, rel=2e-4)
    one, period = schedule.values[:-1, 0], len(schedule.values) - 1
    for k in (1, 2):
        np.testing.assert_allclose(schedule.values[:-1, k], np.roll(one, k * period // 3), atol=0.025)
        assert np.ptp(schedule.values[:, k]) > 0.2


def test_a_joint_without_a_rate_is_the_same_everywhere(tmp_path: Path) -> None:
    circle(tmp_path, 12)
    limits = f'"1:1" = {MOVING}\n"2:1" = {{ min = {-RAIL}, max = {RAIL} }}'
    text = case_text(limits).replace("[limits.joint]", "[solve]\nstarts = 1\n[limits.joint]")
    schedule = solve(load_case(planar(tmp_path, text, 2))).schedule
    assert schedule is not None
    assert schedule.names == ("joint.1:1",)
    points, grid = Points(schedule), np.linspace(-RAIL, RAIL, 2001)
    means = points.weights @ points.part(1, np.broadcast_to(grid, (len(points.at), len(grid))))
    assert schedule.design["joint.2:1"] == pytest.approx(grid[np.argmax(means)], abs=5e-4)


@pytest.mark.parametrize("over", ["mean", "worst"])
def test_a_rail_that_stays_at_its_end_gains_nothing(tmp_path: Path, over: str) -> None:
    """Along a short path the part of F falls with the rail at all points, so the constant at the lower end is best."""
    saved(tmp_path / "path.csv", "t,x,y,z\n0,0.05,0,0\n2,0.1,0.02,0\n")
    limits = 'rail = { min = -0.02, max = 0.02, per = "path", rate = inf }'
    schedule = solve(load_case(planar(tmp_path, case_text(limits, over=f'as = "{over}"')))).schedule
    assert schedule is not None
    points, grid = Points(schedule), np.linspace(-0.02, 0.02, 101)
    changes = np.diff(points.part(0, np.broadcast_to(grid, (len(points.at), len(grid)))), axis=1)
    assert (changes > 0).all() or (changes < 0).all()
    end = 0.02 if changes[0, 0] > 0 else -0.02
    np.testing.assert_allclose(schedule.values[:, 0], end, atol=1e-6)
    assert schedule.gain == 0


def test_the_base_of_a_leg_follows_the_platform(tmp_path: Path, cli: Run) -> None:
    """With any rate, the base of a leg stays where the leg is steepest: below its joint on the platform."""
    saved(tmp_path / "robot.toml", LEGS)
    saved(tmp_path / "path.csv", "t,x,y,z\n0,-5,0,20\n2,5,0,20\n")
    limits = '"1:1" = { min = -25, max = -5, per = "path", rate = RATE }'
    text = case_text(limits, task="axis = [0, 0, 1]\npitch = inf").replace('length = "m"', 'length = "in"')
    locked = '"robot.toml", parameters = { r = 26.5, "joint.2:1" = 0, "joint.3:1" = -1.5 }'
    text = text.replace('"robot.toml"', locked).replace("[limits.joint]", '[limits]\nover = "path"\n[limits.joint]')
    for rate, gain in (("inf", True), ("0.5", False)):
        file = str(saved(tmp_path / "case.toml", text.replace("RATE", rate)))
        solution = solve(load_case(file))
        schedule = solution.schedule
        assert schedule is not None
        x = schedule.poses.positions[:, 0]
        if gain:
            np.testing.assert_allclose(schedule.values[:, 0], x + 11 - 26.5, atol=1e-4)
        assert schedule.rates_used[0] <= (math.inf if gain else 0.5)
        assert schedule.judgement is not None
        assert schedule.judgement.is_proved
        F = np.zeros(len(x))
        for limb, rail in enumerate((schedule.values[:, 0], np.zeros(len(x)), np.full(len(x), -1.5))):
            turn = turn_about([0, 0, 1], 2 * math.pi * limb / 3)
            for near, base, platform in (
                (rail, (26.5, 0.0), (11.0, 3.0)),
                (np.zeros(len(x)), (23.85, -7.95), (6.0, -10.0)),
            ):
                bases = np.stack([base[0] + near, np.full(len(x), base[1]), np.zeros(len(x))], axis=1)
                leg = schedule.poses.positions + turn @ np.array([*platform, 0]) - bases @ turn.T
                F += (leg[:, 2] / np.linalg.norm(leg, axis=1)) ** 2
        np.testing.assert_allclose(schedule.F, F, rtol=1e-10)
    shown = unbroken(output_of(cli("solve", file)))
    assert "F is taken with actuated joints 1:1, 2:1, 3:1 locked at each point of the path" in shown


def test_results_and_files_name_the_joint(folder: Path, cli: Run) -> None:
    one_rail(folder)
    file, result = str(folder / "case.toml"), folder / "result.json"
    shown = unbroken(output_of(cli("solve", file, "--json", str(result), "--schedule", str(folder / "s.csv"))))
    assert "best constant joint.1:1" in shown
    assert "F is taken with actuated joint 1:1 locked at each point of the path" in shown
    data = json.loads(result.read_text())
    jsonschema.validate(data, result_schema())
    assert data["schedule"]["names"] == ["joint.1:1"]
    case = load_case(file)
    assert case.settings["joint.1:1"] == Free(-RAIL, RAIL, 0.0, rate=RATE)
    again = load_case(str(saved(folder / "again.toml", case.to_toml())))
    assert again.limits == case.limits
    assert again.parameters == case.parameters
    wider = case.replace({"limits.joint.rail.max": 0.3})
    assert wider.settings["joint.1:1"].upper == 0.3
    locked = case.replace({"joint.1:1": 0.05})
    assert not locked.settings
    assert '"joint.1:1" = 0.05' in locked.to_toml()
    # A result gives what is the same along the path; the table gives the schedule.
    assert cli("path", file, "--along", str(folder / "s.csv"), "--of", str(result))[0] == 0


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        (((MOVING, "{ min = -0.2, max = 0.2, rate = 1 }"),), ("limits.joint.rail.rate", 'only with per = "path"')),
        (((MOVING, '{ min = -0.2, max = 0.2, per = "path" }'),), ("limits.joint.rail.rate", "is missing")),
        (((MOVING, '{ max = 0.2, per = "path", rate = 1 }'),), ("limits.joint.rail.per", "needs min and max")),
        ((("rate = 0.1", "rate = 0"),), ("limits.joint.rail.rate = 0", "must be positive")),
        ((("rail =", '"1:2" ='),), ("limits.joint.1:2.per", "joint 1:2 follows from the pose", "allowed: 1:1")),
        ((("rail =", '"1:3" ='),), ("limits.joint.1:3.per", "joint 1:3 is not actuated", "allowed: 1:1")),
        ((("rail =", '"2:1" ='),), ("limits.joint.2:1.per", "joint 2:1 follows from the pose", "allowed: 1:1")),
        (((f"rail = {MOVING}", ""),), ("limits.joint.1:1", "needs min and max", "does not determine")),
        (
            (('[objective]\nover = "path"\nas = "mean"', ""), ('follows = "feed"', "axis = [1, 0, 0]\npitch = inf")),
            ("objective", "joint.rail changes along the path"),
        ),
        (
            (('file = "robot.toml"', 'file = "robot.toml", parameters = { "joint.1:1" = { min = 0, max = 1 } }'),),
            ("robot.parameters.joint.1:1", "must be a number", "limits.joint"),
        ),
    ],
)
def test_refusals(tmp_path: Path, cli: Run, edits: tuple[tuple[str, str], ...], words: tuple[str, ...]) -> None:
    circle(tmp_path, 4)
    text = case_text(f"rail = {MOVING}")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    refusal_of(cli("solve", planar(tmp_path, text)), *words)


def test_other_commands_and_poses_are_refused(tmp_path: Path, cli: Run) -> None:
    circle(tmp_path, 4)
    file = planar(tmp_path, case_text(f"rail = {MOVING}"))
    refusal_of(cli("evaluate", file), "joint.1:1 changes along the path")
    refusal_of(cli("certify", file), "joint.1:1 changes along the path")
    saved(tmp_path / "path.csv", "t,x,y,z\n0,0,0,0\n1,0.1,0,0.1\n")
    refusal_of(cli("solve", file), "path.file", "cannot take the pose at (0.0005, 0, 0.0005)")


def test_joints_without_closed_forms_are_named(tmp_path: Path, cli: Run) -> None:
    saved(tmp_path / "path.csv", "t,x,y,z\n0,0,0,0\n1,0,0,0.01\n")
    text = case_text("", task="axis = [0, 0, 1]\npitch = inf").replace(
        'file = "robot.toml"', 'model = "differential-waist", parameters = { ratio = 0.55, spread = 0.05 }'
    )
    refusal_of(cli("solve", str(saved(tmp_path / "case.toml", text))), "no closed form of the passive joints of limb 1")


def test_limits_of_python(tmp_path: Path) -> None:
    circle(tmp_path, 4)
    case = load_case(planar(tmp_path, case_text(f"rail = {MOVING}")))
    (limit,) = case.limits
    assert limit == JointMotion("rail", min=-RAIL, max=RAIL, rate=RATE)
    with pytest.raises(CaseError, match="needs min and max"):
        type(limit)("rail", max=RAIL, rate=RATE).check(case.as_limited)


def test_idle_passive_joints_are_no_settings(tmp_path: Path) -> None:
    """A rod between ball joints spins about itself; only the driven rail below it is a setting."""
    model = robot_function("6-pus")()
    assert model.free_joints == model.with_joints_as_parameters().locked == ()
    saved(
        tmp_path / "robot.toml", LEGS.replace('{ type = "U", at = "B", axes = ["x", "y"] }', '{ type = "S", at = "B" }')
    )
    saved(tmp_path / "path.csv", "t,x,y,z\n0,-5,0,20\n2,5,0,20\n")
    limits = "\n".join(f'"{k}:1" = {{ min = -20, max = 0, per = "path", rate = 1 }}' for k in (1, 2, 3))
    text = case_text(limits, task="axis = [0, 0, 1]\npitch = inf").replace('length = "m"', 'length = "in"')
    text = text.replace('"robot.toml"', '"robot.toml", parameters = { r = 26.5 }')
    case = load_case(str(saved(tmp_path / "case.toml", text)))
    assert list(case.settings) == ["joint.1:1", "joint.2:1", "joint.3:1"]
    assert [each.name for each in schedule_problem(case).settings] == list(case.settings)
    with pytest.raises(CaseError, match=r"joint 1:2 is of type S"):
        load_case(str(saved(tmp_path / "spin.toml", text.replace('"1:1" =', '"1:2" ='))))


def test_the_example_of_the_page(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "changing.md").read_text(encoding="utf-8")
    part = page[page.index("### Driven rails along a path") :]
    robot, case = re.findall(r"```toml\n(.*?)```", part, re.DOTALL)[:2]
    circle(tmp_path)
    (tmp_path / "path.csv").rename(tmp_path / "circle.csv")
    saved(tmp_path / "three-rails.toml", robot)
    schedule = solve(load_case(str(saved(tmp_path / "case.toml", case)))).schedule
    assert schedule is not None
    assert schedule.constant is not None
    value, constant = (f"{each:.7g}" for each in (schedule.value, schedule.constant.value))
    shown = f"mean F = {value} (m/m)² along 192 segments ({constant} with the best constant joint.1:1, "
    assert shown in " ".join(part.split())


def test_proofs_and_pictures_along_a_table_with_a_rail(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table without rotations: the checker follows the loops with the rail as a further coordinate."""
    monkeypatch.chdir(tmp_path)
    circle(tmp_path)
    file = planar(tmp_path, case_text(f"rail = {MOVING}"))
    head, *rows = Path("path.csv").read_text().splitlines()
    lines = [f"{row},{0.02 * float(row.split(',')[0])!r}" for row in rows[:6]]
    saved(Path("rail.csv"), "\n".join([f"{head},joint.1:1", *lines, ""]))
    options = ("--along", "rail.csv")
    output_of(cli("path", file, *options, "--proof", "proof.json", "--plot", "path.svg"))
    assert "PROOF VALID: 16 of 16 claims" in output_of(cli("verify-proof", "proof.json", file, *options))
    assert 'id="rate of joint.1:1 joint.1:1"' in Path("path.svg").read_text()
    # Another motion of the rail has other speeds.
    faster = [f"{row},{0.05 * float(row.split(',')[0])!r}" for row in rows[:6]]
    saved(Path("faster.csv"), "\n".join([f"{head},joint.1:1", *faster, ""]))
    assert cli("verify-proof", "proof.json", file, "--along", "faster.csv")[0] == 1
    refusal_of(cli("path", file, *options, "--csv", "joints.csv"), "joints of robot 'rails' have no closed form")

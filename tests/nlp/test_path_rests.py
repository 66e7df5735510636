"""Paths on which the platform stands, turns in place, or turns on and on, and the first point beyond a limit."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from builders import PUSH_UP, Array, Run, case_of, output_of, rows_of, saved
from measures import circle_joints, segment_distance
from path_cases import hexapod, program, robot_of

from screwsynth.nlp import Case, InputError, Outcome, Sense, Units
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.path import Kind, ProgrammedPath
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.proof.workspace import path_faults
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.path_judge import judge_path

MM = Units("mm", "deg", "N")
SLERP = PathOptions(between=Between.SLERP)


def plates(**limits: object) -> Case:
    robot = {"model": "stewart-gough", "layout": "octahedral"}
    robot |= {"parameters": {"x1": 1000, "x2": 500, "x3": 30, "x4": 22}}
    given = {"units": {"length": "mm"}, "pose": {"position": [0, 0, 1000]}, "task": [PUSH_UP]}
    return case_of(robot, **given, limits=limits or {"leg_length": {"min": 500, "max": 3000}})


def table(rows: str, columns: str = "x,y,z,roll,pitch,yaw,feed", options: PathOptions = SLERP) -> ProgrammedPath:
    return read_poses(f"{columns}\n{rows}\n", "way.csv", MM, options)


def motion(text: str, between: Between = Between.ANGLES, start: Array | None = None) -> ProgrammedPath:
    here = [0.0, 0, 1000, 0, 0, 0] if start is None else start
    return read_program(f"{text}\nM2".split("\n"), "way.gcode", MM, PathOptions(between=between, start=here))


ANGLES, QUATERNIONS = "x,y,z,roll,pitch,yaw", "x,y,z,qw,qx,qy,qz,feed"
#: The same orientation in 6 and in 12 digits.
NEAR = "0.968848,0.1237,0.1237,0.1753", "0.968848,0.1237,0.1237,0.175300000001"


@pytest.mark.parametrize(
    ("rows", "columns", "kinds", "seconds"),
    [
        # The same rotation in other angles, with a motion after it.
        (("0,0,1000,0,0,0,1", "0,0,1000,0,0,360,1", "5,0,1000,0,0,360,1"), f"{ANGLES},feed", [Kind.LINE], [5]),
        # The last digit of a way and of a quaternion; a turn in place takes the time of its turn.
        (("0,0,1000,0,0,0,1", "0,0,1000.0000000001,10,0,0,5"), f"{ANGLES},feed", [Kind.LINE], [2]),
        ((f"0,0,9,{NEAR[0]},10", f"0,0,9,{NEAR[1]},10", f"5,0,9,{NEAR[0]},10"), QUATERNIONS, [Kind.LINE], [0.5]),
        # Where a row states its time, the platform waits.
        (
            ("0,0,1000,0,0,0,0", "0,0,1000,0,0,360,2", "5,0,1000,0,0,360,3"),
            f"{ANGLES},t",
            [Kind.DWELL, Kind.LINE],
            [2, 1],
        ),
    ],
)
def test_rounding_is_neither_a_motion_nor_a_time(
    rows: tuple[str, ...], columns: str, kinds: list[Kind], seconds: list[float]
) -> None:
    path = table("\n".join(rows), columns)
    assert [Kind(each) for each in path.kinds] == kinds
    np.testing.assert_allclose(path.durations, seconds, rtol=1e-12)
    for k in np.flatnonzero(path.kinds == Kind.DWELL):
        assert np.array_equal(path.knots[k], path.knots[k + 1])


@pytest.mark.parametrize("axis", [2, 5])
def test_many_steps_of_rounding_size_are_a_motion_in_their_time(axis: int) -> None:
    """Ways of 5e-9 of 1000, and turns of half of the angle that counts."""
    step = 5e-9 if axis == 2 else math.degrees(5e-12)
    poses = [[0.0, 0, 1000, 0, 0, 0] for _ in range(201)]
    for k, each in enumerate(poses):
        each[axis] += k * step
    path = table("\n".join(",".join(map(repr, [*each, 1])) for each in poses))
    assert 50 <= len(path) <= 100
    way = np.abs(path.knots[-1, axis] - path.knots[0, axis])
    shown = way if axis == 2 else math.degrees(way)
    assert shown == pytest.approx(200 * step, rel=0.02)
    # At one length, or one degree, by second.
    np.testing.assert_allclose(path.durations.sum(), shown, rtol=1e-3)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_what_stands_does_not_depend_on_the_unit(scale: float) -> None:
    steps = (0.0, 1e-10, 1e-7)  # of a thousand: rounding, and a motion
    rows = "\n".join(f"0,0,{scale * (1000 + step)!r},0,0,0,{scale!r}" for step in steps)
    assert [Kind(each) for each in table(rows).kinds] == [Kind.LINE]
    with pytest.raises(InputError, match="there is no path: all points are the same pose"):
        table("\n".join(rows.split("\n")[:2]))


def test_programs_stand_as_tables_do() -> None:
    text = "G21 G90\nG1 C360 F360\nG1 C0\nG1 X0.00000000001 C10\nG4 P2\nG91 G1 X5\nG0 X0.000000000001"
    path = motion(text, Between.SLERP)
    assert [Kind(each) for each in path.kinds] == [Kind.LINE, Kind.DWELL, Kind.LINE]
    np.testing.assert_allclose(path.durations, [60 * 10 / 360, 2, 60 * 5 / 360], rtol=1e-12)
    np.testing.assert_array_equal(path.knots[1], path.knots[2])
    assert path.lines.tolist() == [4, 5, 6]
    # Angles that change linearly turn all the way.
    assert motion("G21 G90\nG1 C90 F360\nG1 C0").durations.tolist() == pytest.approx([15, 15])
    with pytest.raises(InputError, match="the same pose"):
        motion("G21 G90\nG1 C360 F360", Between.SLERP)


def test_speeds_about_a_rest_are_those_of_the_motion() -> None:
    case = plates()
    path = table("0,0,1000,0,0,0,1\n0,0,1000.0000000001,0,0,360,1\n30,0,1000,0,0,360,1\n30,0,1000,8,0,0,4")
    judged = judge_path(case, path)
    assert judged.is_proved
    fastest = max(each.bound for each in judged.extremes if each.name.startswith("actuator_speed"))
    # A leg is no faster than the joint on the platform, at 1 mm/s or 4 deg/s about 700 mm away at most.
    assert 0.1 < fastest <= 700 * math.radians(4)


@pytest.mark.parametrize("turn", [3e-11, 1e-10])
def test_the_smallest_motions_that_count_end_their_search(turn: float) -> None:
    case = plates()
    path = table(f"0,0,1000,0,0,0,1\n0,0,1000,0,0,{math.degrees(turn)!r},1")
    judged = judge_path(case, path, time_limit=30)
    assert judged.is_proved
    speeds = [each for each in judged.extremes if each.name.startswith("actuator_speed")]
    assert len(speeds) == 6
    # Within the rounding of its ends, which is a part of a hundred of this turn.
    assert all(each.bound <= 1.05 * 500 * math.radians(1) for each in speeds)


def test_a_dwell_is_judged_without_a_warning(cli: Run, tmp_path: Path) -> None:
    limits = {"actuator_angle": {"min": -45, "max": 45}, "condition_number": {"max": 4.8, "length": 0.076}}
    path = saved(tmp_path / "case.toml", robot_of("delta", limits, rb=0.164).to_toml())
    for motions in ("G1 X10\nG4 P1", "G4 P1"):
        part = saved(tmp_path / "dwell.gcode", f"G21 G90\nG1 X0 Y0 Z-1200 F1200\n{motions}\nM2\n")
        command = ("path", str(path), "--along", str(part), "--html", str(tmp_path / "page.html"))
        assert "PROVED at every point" in output_of(cli(*command))


def measured(points: Array, key: str) -> Array:
    """A number of the robot of PLATES at points, moments divided by 400 mm."""
    base, platform = circle_joints({"x1": 1000.0, "x2": 500.0, "x3": math.radians(30), "x4": math.radians(22)})
    found = []
    for p in points:
        span = platform + p - base
        if key == "leg_clearance":
            legs = list(zip(base, base + span, strict=True))
            found.append(min(segment_distance(*legs[i], *legs[j]) for i in range(6) for j in range(i)))
            continue
        n = span / np.linalg.norm(span, axis=1, keepdims=True)
        values = np.linalg.svd(np.hstack([n, np.cross(platform, n) / 400]), compute_uv=False)
        found.append(values[-1] if key == "smallest_singular_value" else values[0] / values[-1])
    return np.array(found)


LINES = "G21 G90 F1200\nG1 X700\nG1 X-700 Z900\nG1 X0 Z1500"
ENDS = np.array([(0.0, 0.0, 1000.0), (700.0, 0.0, 1000.0), (-700.0, 0.0, 900.0), (0.0, 0.0, 1500.0)])


@pytest.mark.parametrize(
    ("key", "part"),
    [("smallest_singular_value", 0.3), ("condition_number", 0.6), ("leg_clearance", 0.4), ("condition_number", 0.02)],
)
def test_the_first_fault_is_the_first_of_every_number(key: str, part: float) -> None:
    s = np.linspace(0, 1, 201)
    points = np.concatenate([np.outer(1 - s, one) + np.outer(s, other) for one, other in itertools.pairwise(ENDS)])
    # The larger, the worse.
    sign = 1 if key == "condition_number" else -1
    values = sign * measured(points, key)
    limit = float(values.max() - part * np.ptp(values))
    length = {} if key == "leg_clearance" else {"length": 400}
    judged = judge_path(plates(**{key: {"max" if sign > 0 else "min": sign * limit} | length}), motion(LINES))
    refuted = [each for each in judged.extremes if each.outcome is Outcome.REFUTED]
    assert {each.key.partition(".")[0] for each in refuted} == {key}
    place, value, _ = min(judged.faults[each.name, each.sense] for each in refuted)
    first, worst = int(np.argmax(values > limit)), int(np.argmax(values))
    assert first < worst
    segment, at = divmod(first, len(s))
    assert (place.segment, place.parameter) == (segment, pytest.approx(s[at], abs=1.01 * s[1]))
    assert value == pytest.approx(sign * limit, rel=1e-8)


def test_a_fault_between_two_points_that_are_sampled_is_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_faults, "_LEAST_SAMPLES", 3)
    monkeypatch.setattr(path_faults, "_MOST_SAMPLES", 3)
    # The shortest length of a leg is reached inside of the line, between its ends and its middle.
    case = plates()
    path = motion("G21 G90 F1200\nG1 X-900 Y0 Z600\nG1 X900 Y333 Z600")
    shortest = [each for each in judge_path(case, path).extremes if each.sense is Sense.MIN and each.place.segment == 1]
    low = next(each for each in shortest if all(abs(each.place.parameter - part) > 0.05 for part in (0.0, 0.5, 1.0)))
    edge = low.reached * 1.0005
    judged = judge_path(plates(leg_length={"min": edge, "max": 3000}), path)
    fault = judged.faults[low.name, Sense.MIN]
    assert fault.place < next(
        each.place for each in judged.extremes if (each.name, each.sense) == (low.name, Sense.MIN)
    )
    assert fault.value == pytest.approx(edge, rel=1e-9)


SAMPLES = np.linspace(0, 1, 4001)
#: Three slides along x, y and z, then a motor about an axis along z through (100, 0, 0), at home.
GANTRY = """
name = "Gantry"
description = "three slides and a motor about the vertical"
length_unit = "mm"
home = [0, 0, 0]
[dimensions]
a = { typical = 100, description = "place of the motor" }
[[limb]]
points = { A = ["a", 0, 0] }
joints = [
  { type = "P", at = "A", axis = "x", actuated = true },
  { type = "P", at = "A", axis = "y", actuated = true },
  { type = "P", at = "A", axis = "z", actuated = true },
  { type = "R", at = "A", axis = "z", actuated = true },
]
"""
#: By seconds: two turns on a line, five back on three turns of a helix, and home.
PROGRAM = """
G21 G90 G94 F600
G1 X0 Y0 Z0 C0
G1 X20 C800
G17 G3 X20 Y0 I0 J10 P3 Z10 C-1000
G1 X0 Y0 Z0 C0
M2
"""


def gantry(folder: Path, **limits: dict[str, float]) -> Case:
    robot = {"file": str(saved(folder / "gantry.toml", GANTRY)), "parameters": {"a": 100}, "characteristic_length": 82}
    return case_of(
        robot,
        units={"length": "mm"},
        pose={"position": [0, 0, 0]},
        task=[PUSH_UP | {"point": [0, 0, 0], "pitch": 0}],
        limits=limits,
    )


def joints(path: ProgrammedPath) -> Array:
    """Positions (K, 4) of the joints at samples of all segments, the spindle's as far as the program has turned it."""
    found = []
    for k in range(len(path)):
        positions, _ = path.poses_at(np.full(len(SAMPLES), k), SAMPLES)
        yaw = path.knots[k, 5] + SAMPLES * (path.knots[k + 1, 5] - path.knots[k, 5])
        arm = 100 * np.stack([np.cos(yaw) - 1, np.sin(yaw), 0 * yaw], axis=1)
        found.append(np.hstack([positions + arm, yaw[:, None]]))
    return np.concatenate(found)


def extremes_of(judged: Judgement, name: str) -> list[tuple[Sense, float, float]]:
    found = [(each.sense, each.bound, each.reached) for each in judged.extremes if each.name == name]
    assert found, name
    return found


def test_a_spindle_turns_on_and_on(tmp_path: Path) -> None:
    wide = {"min": -1e4, "max": 1e4}
    case = gantry(tmp_path, actuator_angle=wide, actuator_length=wide)
    path = program(case, PROGRAM)
    judged = judge_path(case, path)
    assert judged.is_proved
    q, count = joints(path), len(SAMPLES)
    for k in range(4):
        ends = {Sense.MIN: q[:, k].min(), Sense.MAX: q[:, k].max()}
        room = 0.8 if k < 3 else 1e-2
        for sense, bound, reached in extremes_of(judged, f"actuator_{'length' if k < 3 else 'angle'} limb 1.{k + 1}"):
            assert sense.sign * (bound - ends[sense]) > -1e-6
            assert reached == pytest.approx(ends[sense], abs=room)
        speeds = [
            np.abs(np.diff(q[j * count : (j + 1) * count, k])).max() * (count - 1) / path.durations[j] for j in range(3)
        ]
        ((_, bound, _),) = extremes_of(judged, f"actuator_speed actuator 1.{k + 1}")
        assert max(speeds) * (1 - 1e-6) < bound < max(speeds) * 1.005


@pytest.mark.parametrize(
    ("angle", "outcomes"),
    [
        ({"max": 800.5, "min": -1000.5}, {"max": Outcome.PROVED, "min": Outcome.PROVED}),
        ({"max": 799, "min": -999}, {"max": Outcome.REFUTED, "min": Outcome.REFUTED}),
        # The pose alone does not tell how far the motor has turned.
        ({"max": 300, "min": -1001}, {"max": Outcome.REFUTED, "min": Outcome.PROVED}),
    ],
)
def test_limits_count_whole_turns(tmp_path: Path, angle: dict[str, float], outcomes: dict[str, Outcome]) -> None:
    case = gantry(tmp_path, actuator_angle=angle)
    judged = judge_path(case, program(case, PROGRAM))
    found = {each.sense.value: each for each in judged.extremes if each.name.startswith("actuator_angle")}
    assert {sense: each.outcome for sense, each in found.items()} == outcomes
    if outcomes["max"] is Outcome.REFUTED:
        fault = judged.faults["actuator_angle limb 1.4", Sense.MAX]
        assert fault.place.segment == 0
        assert fault.place.parameter == pytest.approx(angle["max"] / 800, abs=1e-9)


@pytest.mark.parametrize(("most", "is_proved"), [(321, True), (319, False), (170, False)])
def test_a_motor_goes_on_beyond_half_a_turn_on_a_short_path(tmp_path: Path, most: float, is_proved: bool) -> None:
    case = gantry(tmp_path, actuator_angle={"min": 39, "max": most})
    judged = judge_path(case, program(case, "F60\nG1 X0 Y0 Z0 C40\nG1 C320\nG1 C40\nM2"))
    assert judged.is_proved == is_proved
    found = {each.sense: each for each in judged.extremes if each.name.startswith("actuator_angle")}
    assert found[Sense.MIN].outcome is Outcome.PROVED
    assert math.degrees(found[Sense.MAX].reached) == pytest.approx(320, abs=0.5)


def test_a_hexapod_is_singular_on_the_way_round() -> None:
    case = hexapod({"min": 17, "max": 43})
    judged = judge_path(case, program(case, "G20 F60\nG1 X0 Y0 Z20 C0\nG1 C720\nM2"))
    (rank,) = judged.ranks
    assert rank.outcome is Outcome.REFUTED
    # By symmetry at a right angle.
    assert rank.place.parameter == pytest.approx(1 / 8, abs=1e-9)
    lengths = [each for each in judged.extremes if each.name.startswith("leg_length")]
    assert len(lengths) == 12
    for sense in Sense:
        ends = [each.reached for each in lengths if each.sense is sense]
        np.testing.assert_allclose(ends, ends[0], rtol=2e-3)


def test_the_command_answers_for_whole_turns(cli: Run, tmp_path: Path) -> None:
    part, out, table = (tmp_path / name for name in ("part.ngc", "path.json", "joints.csv"))
    saved(part, PROGRAM)
    case = gantry(tmp_path, actuator_angle={"min": -1001, "max": 801})
    saved(tmp_path / "case.toml", case.to_toml())
    command = ("path", str(tmp_path / "case.toml"), "--along", str(part), "--json", str(out), "--csv", str(table))
    shown = output_of(cli(*command, "--plot", str(tmp_path / "path.svg")))
    assert "PROVED at every point" in shown
    result = json.loads(out.read_text())
    spindle = [each for each in result["path"]["claims"] if each["name"] == "actuator_angle limb 1.4"]
    assert sorted(each["reached"] for each in spindle) == pytest.approx([-1000, 800], abs=0.5)
    turned = np.array([float(row["actuator_angle 1.4"]) for row in rows_of(table.read_text())])
    assert [turned.max(), turned.min(), turned[-1]] == pytest.approx([800, -1000, 0], abs=1e-9)

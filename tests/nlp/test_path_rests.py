"""Programs in which the platform stands or turns in place, and the first point of a path at which a number is wrong."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, case_from, edited, output_of, saved, starter_tables
from measures import circle_joints, segment_distance

from screwsynth.nlp import InputError, Outcome
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.path import Kind, ProgrammedPath
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.proof.workspace import path_faults
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.units import Units

MM = Units("mm", "deg", "N")
SLERP = PathOptions(between=Between.SLERP)
LIMITS = "leg_length = { min = 500, max = 3000 }"
CASE = f"""
[units]
length = "mm"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = {{ x1 = 1000, x2 = 500, x3 = 30, x4 = 22 }}
[pose]
position = [0, 0, 1000]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
{LIMITS}
"""


def table(rows: str, columns: str = "x,y,z,roll,pitch,yaw,feed", options: PathOptions = SLERP) -> ProgrammedPath:
    return read_poses(f"{columns}\n{rows}\n", "way.csv", MM, options)


def program(text: str, between: Between = Between.ANGLES, start: Array | None = None) -> ProgrammedPath:
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
    # A dwell is at one pose.
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
    with pytest.raises(InputError, match="there is no path: all of its points are one pose"):
        table("\n".join(rows.split("\n")[:2]))


def test_programs_stand_as_tables_do() -> None:
    text = "G21 G90\nG1 C360 F360\nG1 C0\nG1 X0.00000000001 C10\nG4 P2\nG91 G1 X5\nG0 X0.000000000001"
    path = program(text, Between.SLERP)
    assert [Kind(each) for each in path.kinds] == [Kind.LINE, Kind.DWELL, Kind.LINE]
    np.testing.assert_allclose(path.durations, [60 * 10 / 360, 2, 60 * 5 / 360], rtol=1e-12)
    np.testing.assert_array_equal(path.knots[1], path.knots[2])
    assert path.lines.tolist() == [4, 5, 6]
    # Angles that change linearly turn all the way.
    assert program("G21 G90\nG1 C90 F360\nG1 C0").durations.tolist() == pytest.approx([15, 15])
    with pytest.raises(InputError, match="one pose"):
        program("G21 G90\nG1 C360 F360", Between.SLERP)


def test_speeds_about_a_rest_are_those_of_the_motion() -> None:
    case = case_from(CASE)
    path = table("0,0,1000,0,0,0,1\n0,0,1000.0000000001,0,0,360,1\n30,0,1000,0,0,360,1\n30,0,1000,8,0,0,4")
    judged = judge_path(case, path)
    assert judged.is_proved
    fastest = max(each.bound for each in judged.extremes if each.name.startswith("actuator_speed"))
    # A leg is no faster than the joint on the platform, at 1 mm/s or 4 deg/s about 700 mm away at most.
    assert 0.1 < fastest <= 700 * math.radians(4)


@pytest.mark.parametrize("turn", [3e-11, 1e-10])
def test_the_smallest_motions_that_count_end_their_search(turn: float) -> None:
    case = case_from(CASE)
    path = table(f"0,0,1000,0,0,0,1\n0,0,1000,0,0,{math.degrees(turn)!r},1")
    judged = judge_path(case, path, time_limit=30)
    assert judged.is_proved
    speeds = [each for each in judged.extremes if each.name.startswith("actuator_speed")]
    assert len(speeds) == 6
    # Within the rounding of its ends, which is a part of a hundred of this turn.
    assert all(each.bound <= 1.05 * 500 * math.radians(1) for each in speeds)


def test_a_dwell_is_judged_without_a_warning(cli: Run, tmp_path: Path) -> None:
    tables = starter_tables("delta")
    tables["robot"]["parameters"]["rb"] = 0.164
    limits = {"actuator_angle": {"min": -45, "max": 45}, "condition_number": {"max": 4.8, "length": 0.076}}
    case = case_from(tables | {"limits": limits})
    path = saved(tmp_path / "case.toml", case.to_toml())
    part = saved(tmp_path / "dwell.gcode", "G21 G90\nG1 X0 Y0 Z-1200 F1200\nG1 X10\nG4 P1\nM2\n")
    page = tmp_path / "page.html"
    assert "everything is proved" in output_of(cli("path", str(path), "--along", str(part), "--html", str(page)))
    only = saved(tmp_path / "only.gcode", "G21 G90\nG1 X0 Y0 Z-1200 F1200\nG4 P1\nM2\n")
    assert "everything is proved" in output_of(cli("path", str(path), "--along", str(only), "--html", str(page)))


def measured(points: Array, key: str) -> Array:
    """A number of the robot of CASE at points, moments divided by 400 mm."""
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
    end, length = "max" if sign > 0 else "min", "" if key == "leg_clearance" else ", length = 400"
    words = f"{key} = {{ {end} = {sign * limit!r}{length} }}"
    judged = judge_path(case_from(edited(CASE, (LIMITS, words))), program(LINES))
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
    case = case_from(CASE)
    path = program("G21 G90 F1200\nG1 X-900 Y0 Z600\nG1 X900 Y333 Z600")
    shortest = [each for each in judge_path(case, path).extremes if each.sense is Sense.MIN and each.place.segment == 1]
    low = next(each for each in shortest if all(abs(each.place.parameter - part) > 0.05 for part in (0.0, 0.5, 1.0)))
    edge = low.reached * 1.0005
    judged = judge_path(case_from(edited(CASE, ("min = 500", f"min = {edge!r}"))), path)
    fault = judged.faults[low.name, Sense.MIN]
    assert fault.place < next(
        each.place for each in judged.extremes if (each.name, each.sense) == (low.name, Sense.MIN)
    )
    assert fault.value == pytest.approx(edge, rel=1e-9)

"""Speeds of actuators in the motion of a path, against differences of coordinates that are computed one by one."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders import Array, case_from, output_of, saved, shipped_tables, starter_tables

from screwsynth.nlp import Case, Outcome, inverse
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import PathOptions
from screwsynth.nlp.path.path import ProgrammedPath
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.proof.workspace.numbers.extremes import Extreme
from screwsynth.nlp.proof.workspace.path_judge import PathJudgement, judge_path

Run = Callable[..., tuple[int, str, str]]
#: Parameters of the points of each segment at which coordinates are computed.
SAMPLES = np.linspace(0, 1, 801)


def table(case: Case, rows: Array, seconds: Array) -> ProgrammedPath:
    """A path through rows of x, y, z, roll, pitch, yaw, at given times."""
    text = "\n".join(",".join(map(repr, [*row, t])) for row, t in zip(rows.tolist(), seconds.tolist(), strict=True))
    return read_poses(f"x,y,z,roll,pitch,yaw,t\n{text}", "poses.csv", case.units, PathOptions())


def program(case: Case, text: str, start: tuple[float, ...]) -> ProgrammedPath:
    return read_program(text.split("\n"), "part.ngc", case.units, PathOptions(start=start))


def coordinates(case: Case, path: ProgrammedPath, k: int, s: Array = SAMPLES) -> Array:
    """Coordinates (N, a) of the actuators on a segment, by inverse kinematics."""
    found = inverse(case, *path.poses_at([k] * len(s), s))
    assert found.closed.all()
    return np.asarray(found.coordinates)


def sampled_speeds(case: Case, path: ProgrammedPath) -> Array:
    """Mean speeds (N, a) between samples: none is above the largest speed."""
    timed = [k for k in range(len(path)) if np.isfinite(path.durations[k])]
    steps = [np.abs(np.diff(coordinates(case, path, k), axis=0)) / path.durations[k] for k in timed]
    return np.concatenate(steps) * (len(SAMPLES) - 1)


def largest(judged: PathJudgement, number: str) -> list[Extreme]:
    return [each for each in judged.extremes if each.name.startswith(number) and each.sense is Sense.MAX]


def hexapod() -> Case:
    return case_from(shipped_tables("hexapod-linuxcnc") | {"limits": {}})


def robot(name: str, **parameters: float) -> Case:
    tables = starter_tables(name)
    tables["robot"]["parameters"] |= parameters
    return case_from(tables | {"limits": {}})


#: Robots, with the middle of a random path and the largest changes from it.
ROBOTS = {
    "legs": (hexapod(), (0, 0, 20, 0, 0, 0), (3, 3, 3, 15, 15, 30)),
    "cranks": (robot("delta", rb=0.164), (0, 0, -1.1, 0, 0, 0), (0.2, 0.2, 0.15, 0, 0, 0)),
    "cranks in space": (robot("6-rss", rb=0.12), (0, 0, 0.17, 0, 0, 0), (0.01, 0.01, 0.01, 5, 5, 5)),
    "slides": (robot("planar-3-prr", rb=1.0), (0.05, 0.05, 0, 0, 0, 0), (0.1, 0.1, 0, 0, 0, 8)),
    "loops": (robot("planar-3-rrr", rb=1.0), (0.0, 0.0, 0, 0, 0, 0), (0.1, 0.1, 0, 0, 0, 8)),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_speeds_are_those_of_dense_samples(name: str) -> None:
    case, middle, half = ROBOTS[name]
    rng = np.random.default_rng(len(name))
    rows = middle + half * rng.uniform(-1, 1, (6, 6))
    path = table(case, rows, np.cumsum(rng.uniform(0.5, 2, 6)))
    judged, sampled = judge_path(case, path), sampled_speeds(case, path).max(axis=0)
    speeds = largest(judged, "actuator_speed")
    assert [each.outcome for each in speeds] == [Outcome.PROVED] * len(sampled)
    for found, most in zip(speeds, sampled, strict=True):
        assert most <= found.bound * (1 + 1e-9)
        assert found.bound <= 1.01 * most
        k, s = found.place
        two = np.clip([s - 1e-6, s + 1e-6], 0, 1)
        mean = np.ptp(coordinates(case, path, k, two), axis=0) / (np.ptp(two) * path.durations[k])
        assert np.abs(mean - found.reached).min() <= 1e-4 * found.reached


def test_speeds_on_arcs_are_those_of_dense_samples_and_rapid_motions_have_none() -> None:
    case = hexapod()
    path = program(
        case,
        "G94 F60\nG3 X0 Y0 Z22 A3 C9 I2 J1 P2\nG18 G2 X0 Z25 K1.5 I0\nG4 P1\nG0 X3\n"
        "G19 G3 Y3 Z22 J0 K-3 B4\nG93 G1 X0 C-5 F20\nM2",
        (0, 0, 20, 0, 0, 0),
    )
    assert np.isnan(path.durations).tolist() == [False, False, False, True, False, False]
    judged, sampled = judge_path(case, path), sampled_speeds(case, path).max(axis=0)
    for found, most in zip(largest(judged, "actuator_speed"), sampled, strict=True):
        assert most <= found.bound * (1 + 1e-9)
        assert found.bound <= 1.01 * most
    # Without any time there are no speeds.
    rapid = judge_path(case, program(case, "G0 X3 Y1\nM2", (0, 0, 20, 0, 0, 0)))
    assert not largest(rapid, "actuator_speed")


def test_a_limit_on_speeds_is_that_of_the_path_and_names_the_first_line_beyond_it(cli: Run, tmp_path: Path) -> None:
    case, part, out = hexapod(), tmp_path / "part.ngc", tmp_path / "path.json"
    text = "G20 G94 F60 G90\nG0 X0 Y0 Z20 A0 B0 C0\nG1 X1\nG0 Z21\nF120 G1 X1.5 Z20\nG1 A3\nF300 X-2 Y1\nM2"
    saved(part, text)
    path = read_program(text.split("\n"), "part.ngc", case.units, PathOptions())
    sampled = [
        np.abs(np.diff(coordinates(case, path, k), axis=0)).max() * (len(SAMPLES) - 1) / path.durations[k]
        for k in range(len(path))
    ]
    limit = 1.5 * sampled[0]
    line = int(path.lines[next(k for k, each in enumerate(sampled) if each > limit)])
    tables = shipped_tables("hexapod-linuxcnc")
    # The fastest motions of the case are not those of the path.
    tables |= {"limits": {"actuator_speed": {"max": limit}}, "motion": {"linear": 1e-3}}
    judged = judge_path(case_from(tables), path)
    speeds = largest(judged, "actuator_speed")
    assert {each.limit for each in speeds} == {limit}
    worst = np.nanmax(sampled)
    assert max(each.reached for each in speeds) == pytest.approx(worst, rel=1e-3)
    first = min(fault.place for fault in judged.faults.values())
    assert path.lines[first.segment] == line
    assert min(fault.value for fault in judged.faults.values()) > limit
    shown = output_of(cli("path", "hexapod-linuxcnc", "--along", str(part), "--json", str(out)))
    assert "1 of 5 segments has no time" in " ".join(shown.split())
    result = json.loads(out.read_text())["path"]
    assert result["untimed"] == 1
    assert result["time"] == pytest.approx(np.nansum(path.durations))
    assert max(each["speed"] for each in result["actuators"]) == pytest.approx(worst, rel=2e-3)

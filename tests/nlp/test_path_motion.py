"""Speeds of actuators in the motion of a path, and what a user sees of a path: samples, panels, a page."""

import cmath
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_from, output_of, refusal_of, saved, shipped_tables
from path_cases import (
    BASE,
    HOME,
    LEGS,
    PLATFORM,
    delta_angles,
    hexapod,
    leg_lengths,
    program,
    robot_of,
    table,
    turns_of,
)

from screwsynth.nlp import Case, Outcome, PathOptions, ProgrammedPath, Sense, Verdict, inverse
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.output.pictures.pathpanels import PathPicture, path_picture
from screwsynth.nlp.output.pictures.paths import path_figure
from screwsynth.nlp.output.report.path import path_page
from screwsynth.nlp.path.options import Between
from screwsynth.nlp.path.orientation import ORDERS
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.path.sampling import ProgressKind, progress_of, spread_points
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.path_knots import Knots, Sampling
from screwsynth.nlp.proof.workspace.path_samples import samples_of
from screwsynth.nlp.proof.workspace.robot.path_cover import PathCover
from screwsynth.nlp.proof.workspace.robot.path_turns import Tangents
from screwsynth.nlp.results.path import path_result

#: Parameters of the points of each segment at which coordinates are computed.
SAMPLES = np.linspace(0, 1, 801)


def coordinates(case: Case, path: ProgrammedPath, k: int, s: Array = SAMPLES) -> Array:
    """Coordinates (N, a) of the actuators on a segment, by inverse kinematics."""
    found = inverse(case, *path.poses_at([k] * len(s), s))
    assert found.closed.all()
    return np.asarray(found.coordinates)


def speeds_on(case: Case, path: ProgrammedPath, k: int) -> Array:
    return np.abs(np.diff(coordinates(case, path, k), axis=0)) * (len(SAMPLES) - 1) / path.durations[k]


def sampled_speeds(case: Case, path: ProgrammedPath) -> Array:
    """Mean speeds (N, a) between samples: none is above the largest speed."""
    return np.concatenate([speeds_on(case, path, k) for k in np.flatnonzero(np.isfinite(path.durations))])


def largest(judged: Judgement, number: str) -> list[Verdict]:
    return [each for each in judged.extremes if each.name.startswith(number) and each.sense is Sense.MAX]


#: Robots, with the middle of a random path and the largest changes from it.
ROBOTS = {
    "legs": (hexapod(), HOME, (3, 3, 3, 15, 15, 30)),
    "cranks": (robot_of("delta", rb=0.164), (0, 0, -1.1, 0, 0, 0), (0.2, 0.2, 0.15, 0, 0, 0)),
    "cranks in space": (robot_of("6-rss", rb=0.12), (0, 0, 0.17, 0, 0, 0), (0.01, 0.01, 0.01, 5, 5, 5)),
    "slides": (robot_of("planar-3-prr", rb=1.0), (0.05, 0.05, 0, 0, 0, 0), (0.1, 0.1, 0, 0, 0, 8)),
    "loops": (robot_of("planar-3-rrr", rb=1.0), (0.0, 0.0, 0, 0, 0, 0), (0.1, 0.1, 0, 0, 0, 8)),
}


@pytest.mark.parametrize(
    ("name", "how"),
    [*((name, "rpy") for name in ROBOTS), ("legs", "slerp"), ("legs", "xyz"), ("legs", "yzx"), ("loops", "slerp")],
)
def test_speeds_are_those_of_dense_samples(name: str, how: str) -> None:
    case, middle, half = ROBOTS[name]
    rng = np.random.default_rng(len(name))
    rows = middle + half * rng.uniform(-1, 1, (6, 6))
    path = table(case, rows, np.cumsum(rng.uniform(0.5, 2, 6)))
    path = replace(path, between=Between.SLERP) if how == "slerp" else replace(path, order=ORDERS[how])
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
        HOME,
    )
    assert np.isnan(path.durations).tolist() == [False, False, False, True, False, False]
    judged, sampled = judge_path(case, path), sampled_speeds(case, path).max(axis=0)
    for found, most in zip(largest(judged, "actuator_speed"), sampled, strict=True):
        assert most <= found.bound * (1 + 1e-9)
        assert found.bound <= 1.01 * most
    rapid = judge_path(case, program(case, "G0 X3 Y1\nM2", HOME))
    assert not largest(rapid, "actuator_speed")


def test_a_limit_on_speeds_is_that_of_the_path_and_names_the_first_line_beyond_it(cli: Run, tmp_path: Path) -> None:
    case, part, out = hexapod(), tmp_path / "part.ngc", tmp_path / "path.json"
    text = "G20 G94 F60 G90\nG0 X0 Y0 Z20 A0 B0 C0\nG1 X1\nG0 Z21\nF120 G1 X1.5 Z20\nG1 A3\nF300 X-2 Y1\nM2"
    saved(part, text)
    path = program(case, text)
    sampled = [speeds_on(case, path, k).max() for k in range(len(path))]
    limit = 1.5 * sampled[0]
    line = int(path.lines[next(k for k, each in enumerate(sampled) if each > limit)])
    tables = shipped_tables("hexapod-linuxcnc")
    tables |= {"limits": {"actuator_speed": {"max": limit}}}
    # The fastest motions of a case that has any are not those of the path.
    judged, same = (judge_path(case_from(tables | each), path) for each in ({}, {"motion": {"linear": 1e-3}}))
    speeds = largest(judged, "actuator_speed")
    assert [each.reached for each in speeds] == [each.reached for each in largest(same, "actuator_speed")]
    assert {each.limit for each in speeds} == {limit}
    worst = np.nanmax(sampled)
    assert max(each.reached for each in speeds) == pytest.approx(worst, rel=1e-3)
    first = min(fault.place for fault in judged.faults.values())
    assert path.lines[first.segment] == line
    assert min(fault.value for fault in judged.faults.values()) > limit
    shown = output_of(cli("path", "hexapod-linuxcnc", "--along", str(part), "--json", str(out)))
    assert "1 of 5 segments has no feed rate or time" in " ".join(shown.split())
    result = json.loads(out.read_text())["path"]
    assert result["untimed"] == 1
    assert result["time"] == pytest.approx(np.nansum(path.durations))
    assert max(each["speed"] for each in result["actuators"]) == pytest.approx(worst, rel=2e-3)


def test_limits_on_speeds_and_powers_need_a_motion_of_the_case_or_of_the_path(cli: Run, tmp_path: Path) -> None:
    tables = shipped_tables("hexapod-linuxcnc")
    text = find_case("hexapod-linuxcnc").read_text(encoding="utf-8")
    text = f"{text.partition('[limits]')[0]}\n[workspace]\nposition = [0, 0, {{ min = 20, max = 21 }}]\n"
    case = str(saved(tmp_path / "case.toml", f"{text}[limits]\nactuator_speed = {{ max = 2 }}\n"))
    timed, rapid = (
        str(saved(tmp_path / f"{word}.ngc", f"G20 {word} X1 Y0 Z20\n{word} Z21\nM2")) for word in ("G1 F60", "G0")
    )
    assert "verdict  PROVED at every point" in output_of(cli("path", case, "--along", timed))
    fault = "case.toml: limits.actuator_speed: needs [motion], the largest speeds of the platform"
    refusal_of(cli("path", case, "--along", rapid), f"{fault}, or a path that states times")
    for words in (["workspace", case], ["solve", case], ["path", case, "--range"]):
        assert refusal_of(cli(*words)).strip().endswith(fault)
    # At a pose of the path, which an answer names, everything else is shown.
    code, shown, err = cli("evaluate", case, "--set", "p_z=20.5")
    assert (code, err) == (0, "limits.actuator_speed: left out, as the case has no [motion]\n")
    assert "F" in shown
    power = f"{text}[[load]]\nforce = [0, 0, 9]\n[limits]\nactuator_power = {{ max = 2 }}\n"
    refused = cli("workspace", str(saved(tmp_path / "power.toml", power)))
    refusal_of(refused, "limits.actuator_power: needs [motion], the largest speeds")
    # Powers are the same whether the case has a motion, which is not used, or none.
    tables |= {"limits": {"actuator_power": {"max": 1e3}}, "load": [{"name": "cut", "force": [3, -2, 10]}]}
    found = []
    for each in ({}, {"motion": {"linear": 100}}):
        made = case_from(tables | each)
        judged = judge_path(made, program(made, "G94 F60\nG1 X3 A2\nM2", HOME))
        assert judged.is_proved
        found.append([(each.name, each.bound, each.limit) for each in largest(judged, "actuator_power")])
    assert found[0] == found[1]
    assert len(found[0]) == 12


def knots_along(case: Case, path: ProgrammedPath, within: float) -> Knots:
    return judge_path(case, path, sampling=Sampling(within=within)).knots


def lengths_of(x: Array) -> Array:
    """Lengths (N, 6) of LinuxCNC's hexapod at positions and rotation vectors (N, 6), small ones."""
    angle = np.linalg.norm(x[:, 3:], axis=1)[:, None, None]
    axis = x[:, None, 3:] / np.maximum(angle, 1e-300)
    along = np.sum(axis * PLATFORM, axis=2)[:, :, None] * axis
    turned = np.cos(angle) * (PLATFORM - along) + np.sin(angle) * np.cross(axis, PLATFORM) + along
    return np.asarray(np.linalg.norm(x[:, None, :3] + turned - BASE, axis=2))


def poses_with(measure: Callable[[Array], Array], q: Array, x: Array) -> Array:
    """Solve the forward kinematics by Newton's method with differences: poses (N, m) with coordinates (N, m)."""
    x, steps = x.copy(), 1e-6 * np.eye(x.shape[1])
    for _ in range(6):
        slopes = np.stack([(measure(x + e) - measure(x - e)) / 2e-6 for e in steps], axis=2)
        x -= np.linalg.solve(slopes, (measure(x) - q)[:, :, None])[:, :, 0]
    assert np.abs(measure(x) - q).max() < 1e-9
    return x


@pytest.mark.parametrize("name", ["legs", "cranks"])
def test_the_platform_stays_within_the_tolerance_between_knots(name: str) -> None:
    case, middle, half = ROBOTS[name]
    rng, within = np.random.default_rng(7), 1e-3 * half[0]
    rows = middle + half * rng.uniform(-1, 1, (4, 6))
    path = table(case, rows, np.cumsum(rng.uniform(0.5, 2, 4)))
    if name == "legs":
        text = "G20 G94 F60\nG3 X0 Y0 Z22 A3 C9 I2 J1\nG4 P1\nG18 G2 X0 Z25 K1.5 I0\nG0 X3 A20 B-10\nM2"
        path = program(case, text, HOME)
    knots = knots_along(case, path, within)
    assert not knots.reason
    assert knots.deviation <= within
    part = np.linspace(0, 1, 101)
    k = knots.segments[1:]
    begin, end = np.where(k == knots.segments[:-1], knots.parameters[:-1], 0.0), knots.parameters[1:]
    q = np.stack([(1 - r) * knots.coordinates[:-1] + r * knots.coordinates[1:] for r in part])
    poses = path.poses_at(np.tile(k, 101), np.concatenate([begin + r * (end - begin) for r in part]))
    start, measure = poses.positions, delta_angles
    if name == "legs":
        start = np.hstack([start, [rotation_vector(R) for R in poses.rotations]])
        measure = lengths_of
    moved = poses_with(measure, q.reshape(-1, q.shape[2]), start)
    worst = np.linalg.norm(moved[:, :3] - poses.positions, axis=1)
    assert worst.max() <= knots.deviation
    # Knots are not much closer to each other than they have to be.
    assert worst.max() >= 0.5 * within


def rotation_vector(R: Array) -> Array:
    """Axis times angle (3,) of a rotation by less than half a turn."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.linalg.norm(v)
    return np.asarray(v * (math.atan2(sine, 0.5 * (np.trace(R) - 1)) / sine if sine > 0 else 1.0))


@pytest.mark.parametrize("name", ["cranks in space", "slides", "loops"])
def test_knots_of_robots_with_loops_are_near_enough_at_points_between_them(name: str) -> None:
    case, middle, half = ROBOTS[name]
    rng, within = np.random.default_rng(3), 1e-3 * half[0]
    path = table(case, middle + half * rng.uniform(-1, 1, (3, 6)), np.array([0.0, 1.0, 3.0]))
    knots = knots_along(case, path, within)
    assert not knots.reason
    k, part = knots.segments[1:], np.linspace(0, 1, 101)[:-1]
    begin = np.where(k == knots.segments[:-1], knots.parameters[:-1], 0.0)
    s = (begin + part[:, None] * (knots.parameters[1:] - begin)).T.ravel()
    at = inverse(case, *path.poses_at(np.repeat(k, len(part)), s), follow="previous")
    q = knots.coordinates[:-1, None] + part[:, None] * np.diff(knots.coordinates, axis=0)[:, None]
    # To first order the platform moves by the motion whose rates these are.
    off = q.reshape(len(s), -1) - at.coordinates
    moved = (np.linalg.pinv(at.rates, rcond=1e-9) @ off[:, :, None])[:, 3:, 0]
    assert 0.5 * within <= np.linalg.norm(moved, axis=1).max() <= knots.deviation <= within


def test_knots_that_cannot_be_shown_are_said_to_be_open() -> None:
    case = robot_of("delta", rb=0.164)
    # Arms and rods are 1.768 long together.
    path = table(case, np.array([[0, 0, -1.2, 0, 0, 0], [0, 0, -3.0, 0, 0, 0]]), np.array([0.0, 1.0]))
    judged = judge_path(case, path, sampling=Sampling(within=1e-3))
    assert judged.knots.reason
    assert judged.knots.deviation is None
    assert not judged.is_proved


def test_the_table_of_actuators_has_poses_times_and_differences(cli: Run, tmp_path: Path) -> None:
    part, out, result = tmp_path / "part.ngc", tmp_path / "out.csv", tmp_path / "path.json"
    saved(part, "G20 G94 F60 G90\nG0 X0 Y0 Z20 A0 B0 C0\nG1 X1\nG0 Z21\nG3 X1 Y2 I0 J1\nG1 A5\nM2")
    arguments = ("path", "hexapod-linuxcnc", "--along", str(part), "--csv", str(out))
    output_of(cli(*arguments, "--step", "0.25", "--json", str(result)))
    head, *rows = [line.split(",") for line in out.read_text().splitlines()]
    assert head[:10] == ["line", "segment", "parameter", "t", "x", "y", "z", "roll", "pitch", "yaw"]
    assert head[10:12] == ["leg_length 1-", "leg_length 1+"]
    assert (head[16], head[22]) == ("speed 1-", "acceleration 1-")
    numbers = np.array([[float(cell or "nan") for cell in row] for row in rows])
    # A line of 1 in, one without a time, half a circle of pi in, and a turn by 5 degrees.
    assert [int((numbers[1:, 1] == k).sum()) for k in range(4)] == [4, 4, 13, 5]
    assert numbers[-1, 3] == pytest.approx(1 + math.pi + 5)
    assert (np.linalg.norm(np.diff(numbers[:, 4:7], axis=0), axis=1) <= 0.25 + 1e-9).all()
    angles = np.radians(numbers[:, 7:10])
    assert numbers[:9, 10:16] == pytest.approx(lengths_of(np.hstack([numbers[:, 4:7], angles])[:9]), abs=1e-12)
    t, q = numbers[:, 3], numbers[:, 10:16]
    timed = np.diff(t) > 1e-9
    assert timed.tolist() == (numbers[1:, 1] != 1).tolist()
    assert numbers[1:, 16:22][timed] == pytest.approx((np.diff(q, axis=0)[timed].T / np.diff(t)[timed]).T)
    assert np.isnan(numbers[1:, 16:22][~timed]).all()
    v, inner = numbers[:, 16:22], slice(2, 4)
    assert numbers[inner, 22:] == pytest.approx((v[3:5] - v[2:4]) / 0.25)
    actuators = json.loads(result.read_text())["path"]["actuators"]
    assert [each["acceleration"] for each in actuators] == pytest.approx(np.nanmax(np.abs(numbers[:, 22:]), axis=0))
    assert all(each["speed"] >= np.nanmax(np.abs(v[:, k])) for k, each in enumerate(actuators))
    shown = output_of(cli(*arguments, "--within", "0.01", "--json", str(result)))
    knots = json.loads(result.read_text())["path"]["knots"]
    assert knots["within"] == 0.01
    assert 0 < knots["deviation"] <= 0.01
    assert knots["number"] == knots["closed"] == len(out.read_text().splitlines()) - 1
    assert "within 0.01 in proved" in " ".join(shown.split())
    for more, word in ((("--step", "0"), "--step"), (("--within", "-1"), "--within"), (("--step", "nan"), "--step")):
        refusal_of(cli(*arguments, *more), f"{word} {more[1]}")
    refusal_of(cli(*arguments, "--step", "1", "--within", "1"), "--step and --within")
    refusal_of(cli(*arguments, "--step", "1e-9"), "knots")


def test_speeds_are_those_of_every_machine_within_the_tolerance() -> None:
    tolerance = 0.05
    tables = shipped_tables("hexapod-linuxcnc") | {"limits": {}, "tolerance": {"joint_centre": tolerance}}
    case, rng = case_from(tables), np.random.default_rng(5)
    path = table(case, ROBOTS["legs"][1] + ROBOTS["legs"][2] * rng.uniform(-1, 1, (3, 6)), np.array([0.0, 1.0, 2.0]))
    bounds = np.array([each.bound for each in largest(judge_path(case, path), "actuator_speed")])
    most = np.zeros(6)
    for _ in range(200):
        e, f = rng.normal(size=(2, 6, 3))
        e, f = (tolerance * each / np.linalg.norm(each, axis=1)[:, None] for each in (e, f))
        for k in range(2):
            p, R = path.poses_at([k] * 101, np.linspace(0, 1, 101))
            spans = p[:, None] + np.einsum("nij,kj->nki", R, PLATFORM + f) - BASE - e
            q = np.linalg.norm(spans, axis=2)
            most = np.maximum(most, np.abs(np.diff(q, axis=0)).max(axis=0) * 100 / path.durations[k])
    assert (most <= bounds).all()
    assert (bounds <= 1.02 * most).all()


def test_powers_are_forces_times_the_speeds_of_the_path() -> None:
    tables = shipped_tables("hexapod-linuxcnc") | {"limits": {}, "motion": {"linear": 100}}
    case = case_from(tables | {"load": [{"name": "cut", "force": [3, -2, 10], "moment": [5, 0, 2]}]})
    path = program(case, "G94 F60\nG3 X0 Y0 Z22 A3 C9 I2 J1\nG1 X3\nM2", HOME)
    judged = judge_path(case, path)
    assert len(largest(judged, "actuator_speed")) == 6
    found = []
    for k in range(len(path)):
        at = inverse(case, *path.poses_at([k] * len(SAMPLES), SAMPLES))
        # By virtual work: a unit rate of one leg moves the platform by a column of the inverse of all rates.
        motions = np.linalg.inv(at.rates)
        forces = -np.einsum("i,nik->nk", [5, 0, 2, 3, -2, 10], motions)
        speeds = np.abs(np.diff(at.coordinates, axis=0)) * (len(SAMPLES) - 1) / path.durations[k]
        found.append(np.stack([np.maximum(sign * 0.5 * (forces[1:] + forces[:-1]), 0) * speeds for sign in (1, -1)]))
    sampled = np.concatenate(found, axis=1).max(axis=1)
    # Gaps are parts of the largest power.
    gap = 0.02 * sampled.max()
    for k, leg in enumerate(LEGS):
        forward, backward = (each.bound for each in largest(judged, f"actuator_power actuator {leg}"))
        assert sampled[0, k] * (1 - 1e-4) <= forward <= 1.01 * sampled[0, k] + gap
        assert sampled[1, k] * (1 - 1e-4) <= backward <= 1.01 * sampled[1, k] + gap


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_of_arcs_whose_radius_grows_are_between_their_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arc = rng.uniform([-1, -1, 0.5, -0.1, -3, -9], [1, 1, 3, 0.1, 3, 9])
    knots = rng.uniform(-1, 1, (2, 6))
    plane = [(0, 1, 2), (2, 0, 1), (1, 2, 0)][seed % 3]
    cover = PathCover(knots[:, :3], arc[None], np.array([plane]), Tangents(knots[:, 3:]), np.array([2.0]))
    change = knots[1] - knots[0]

    def pose(s: complex) -> list[complex]:
        found = [complex(x) for x in knots[0] + s * change]
        radius, angle = arc[2] + s * arc[3], arc[4] + s * arc[5]
        found[plane[0]], found[plane[1]] = arc[0] + radius * cmath.cos(angle), arc[1] + radius * cmath.sin(angle)
        return found

    for _ in range(50):
        low, high = np.sort(rng.uniform(0, 1, 2))
        piece = np.array([[0, low, high]])
        for s in np.linspace(low, high, 9):
            # Derivatives by a complex step, and by its real part.
            step = 1e-4
            values = np.array(pose(s + 1j * step))
            first, second = values.imag / step, 2 * (np.array(pose(s)).real - values.real) / step**2
            for order, found in ((1, first), (2, second)):
                lower, upper = cover.derivatives(piece, order)
                assert (lower[0] - 1e-5 <= found).all()
                assert (found <= upper[0] + 1e-5).all()
        lower, upper = cover.derivatives(np.array([[0, low, low]]))
        assert (upper - lower).max() < 1e-11
        assert cover.rates(np.array([[0, low, low]]))[0] == pytest.approx(lower / 2, abs=1e-11)


#: Seconds, positions and angles of a path on which legs of the hexapod become longer than 43 in.
KNOTS = np.array(
    [[0, 0, 0, 20, 0, 0, 0], [1, 2, -1, 22, 8, 0, 5], [4, 16, 0, 22, 8, -4, 0], [6, -18, 1, 19, 0, 0, 0]], dtype=float
)


def pictured(case: Case, knots: Array, name: str = "x,y,z,roll,pitch,yaw", seconds: float = 60) -> PathPicture:
    """The picture of a path through rows of time and pose, or of a pose alone."""
    names = f"t,{name}" if knots.shape[1] > name.count(",") + 1 else name
    rows = "\n".join(",".join(repr(float(each)) for each in row) for row in knots)
    path = read_poses(f"{names}\n{rows}", "poses.csv", case.units, PathOptions())
    judged = judge_path(case, path, gap=0.1, time_limit=seconds)
    return path_picture(judged, samples_of(judged), path_result(judged))


@pytest.fixture(scope="module")
def spindle() -> PathPicture:
    return pictured(case_from(shipped_tables("hexapod-spindle")), KNOTS)


def poses_at(t: Array) -> tuple[Array, Array]:
    p = np.stack([np.interp(t, KNOTS[:, 0], column) for column in KNOTS[:, 1:].T], axis=1)
    return p[:, :3], turns_of(np.radians(p[:, 3:]))


def lengths(t: Array) -> Array:
    return leg_lengths(*poses_at(t))


def spans(t: Array) -> tuple[Array, Array]:
    """Vectors (N, 6, 3) along the legs, and their ends on the platform from its origin."""
    p, R = poses_at(t)
    arms = np.einsum("nij,kj->nki", R, PLATFORM)
    return p[:, None] + arms - BASE, arms


def panel(picture: PathPicture, title: str) -> Array:
    (found,) = (each for each in picture.panels if each.title == title)
    return np.stack([each.values for each in found.curves], axis=1)


def test_curves_are_those_of_the_definitions(spindle: PathPicture) -> None:
    t, (legs, arms) = spindle.at, spans(spindle.at)
    assert spindle.label == "time, s"
    np.testing.assert_allclose(panel(spindle, "leg lengths"), lengths(t), rtol=1e-12)
    # Away from knots, where speeds jump.
    inside = np.abs(t[:, None] - KNOTS[:, 0]).min(axis=1) > 1e-4
    speeds = (lengths(t[inside] + 1e-5) - lengths(t[inside] - 1e-5)) / 2e-5
    np.testing.assert_allclose(panel(spindle, "speeds along the path")[inside], speeds, atol=1e-6)
    # Forces along the legs hold 15 lbf at (0, 0, 2) and 20 lbf in any direction at (0, 0, 5) of the platform.
    R, n = poses_at(t)[1], legs / lengths(t)[:, :, None]
    inverted = np.linalg.inv(np.concatenate([n, np.cross(arms, n)], axis=2).transpose(0, 2, 1))
    weight = np.array([0.0, 0.0, -15.0]) + np.zeros((len(t), 3))
    held = -np.einsum("nij,nj->ni", inverted, np.hstack([weight, np.cross(R @ [0, 0, 2], weight)]))
    x, y, z = (R @ [0, 0, 5]).T
    zero = np.zeros(len(t))
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    spread = 20 * np.linalg.norm(inverted[:, :, :3] + inverted[:, :, 3:] @ cross, axis=2)
    forces = panel(spindle, 'forces, load "cutting"')
    np.testing.assert_allclose(forces, np.hstack([held + spread, held - spread]), atol=1e-9)
    # The smallest of all margins is that of a length, between its limits, a force or a speed.
    own_speeds = np.abs(panel(spindle, "speeds along the path"))
    every = [(43 - lengths(t)) / 26, (lengths(t) - 17) / 26, (40 - np.abs(forces)) / 40, (10 - own_speeds) / 10]
    np.testing.assert_allclose(spindle.margins, 100 * np.hstack(every).min(axis=1), atol=1e-7)
    nearest = [spindle.samples.keys[k].split(".")[0] for k in spindle.samples.nearest]
    own = np.array(["leg_length", "leg_length", "actuator_force", "actuator_speed"])
    chosen = np.argmin([each.min(axis=1) for each in every], axis=0)
    ties = np.sort([each.min(axis=1) for each in every], axis=0)
    assert (own[chosen] == nearest)[ties[1] - ties[0] > 1e-9].all()


def test_faults_are_marked_and_their_segments_are_shaded(spindle: PathPicture) -> None:
    # The first instants at which a leg is longer than 43 in, or faster than 10 in/s.
    t = np.linspace(0, 6, 60001)
    speeds = np.abs(np.diff(lengths(t), axis=0)) / (t[1] - t[0])
    beyond = [*(lengths(t).T > 43), *(speeds.T > 10)]
    first = sorted({float(t[np.argmax(row)]) for row in beyond if row.any()})
    np.testing.assert_allclose([each.at for each in spindle.marks], first, atol=1.1e-4)
    assert [each.line for each in spindle.marks] == [4, 5, 5, 5, 5, 5]
    # A leg is too long at the end of the second segment and at the beginning of the third one.
    assert [(each.start, each.end, each.is_refuted) for each in spindle.bands] == [(1.0, 6.0, True)]
    fast = (np.abs(panel(spindle, "speeds along the path")) > 10 * (1 + 3e-9)).any(axis=1)
    assert spindle.samples.is_violated.tolist() == ((lengths(spindle.at) > 43 * (1 + 3e-9)).any(axis=1) | fast).tolist()


def test_the_first_force_beyond_its_limit_is_found(spindle: PathPicture) -> None:
    """Not the place of the largest force, which the search names."""
    limit = 0.9 * np.abs(panel(spindle, 'forces, load "cutting"')).max()
    tables = shipped_tables("hexapod-spindle") | {"limits": {"actuator_force": {"max": limit}}}
    picture = pictured(case_from(tables), KNOTS)
    beyond = np.abs(panel(picture, 'forces, load "cutting"')) > limit
    (mark, *_), first = picture.marks, int(np.argmax(beyond.any(axis=1)))
    assert 0 < first < len(beyond) - 1
    assert picture.at[first - 1] <= mark.at <= picture.at[first]


def test_the_picture_has_its_panels(spindle: PathPicture) -> None:
    figure = path_figure(spindle)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        "leg lengths, in", "speeds along the path, in/s", 'forces, load "cutting", lbf', "smallest margin, %",
    ]  # fmt: skip
    for axes, shown in zip(figure.axes, spindle.panels, strict=False):
        drawn = {line.get_gid(): line for line in axes.get_lines()}
        for curve in shown.curves:
            name = f"{'smallest ' * curve.is_other}{shown.title} {curve.name}"
            np.testing.assert_array_equal(drawn[name].get_xydata(), np.stack([spindle.at, curve.values], axis=1))
    limits = [[line.get_ydata()[0] for line in axes.get_lines() if line.get_gid() == "limit"] for axes in figure.axes]
    assert [sorted(each) for each in limits] == [[17, 43], [-10, 10], [-40, 40], [0]]
    for axes in figure.axes:
        assert [line.get_gid() for line in axes.get_lines()].count("fault 5") == 5
        assert [patch.get_gid() for patch in axes.patches] == ["refuted"]
    words = [text.get_text() for text in figure.axes[0].texts]
    # Of faults that are near to each other there is one label.
    assert words[0] == "lines 4, 5"
    assert set(words[1:]) == {"line 5"}
    assert "The curves are sampled; the verdicts are proved." in figure.legends[0].get_title().get_text()


def test_without_times_the_axis_is_the_length_or_the_segment(spindle: PathPicture) -> None:
    case = case_from(shipped_tables("hexapod-linuxcnc"))
    picture = pictured(case, KNOTS[:, 1:])
    steps = np.linalg.norm(np.diff(KNOTS[:, 1:4], axis=0), axis=1)
    assert picture.label == "length along the path, in"
    np.testing.assert_allclose(picture.way.knots, [0, *np.cumsum(steps)])
    assert [each.title for each in picture.panels] == ["leg lengths"]
    turning = pictured(case, np.array([[0, 0, 20, 0, 0, 0], [0, 0, 20, 5, 0, 0], [0, 0, 21, 5, 0, 0]], dtype=float))
    assert turning.label == "segments"
    assert progress_of(spindle.judged.path).kind is ProgressKind.TIME
    assert not turning.marks
    assert not turning.bands


def test_long_paths_have_few_points_with_the_places_that_are_named() -> None:
    rows = "\n".join(f"{math.sin(k / 99)!r},{math.cos(k / 77)!r},20" for k in range(5001))
    path = read_poses(f"x,y,z\n{rows}", "poses.csv", case_from(shipped_tables("hexapod-linuxcnc")).units, PathOptions())
    points = spread_points(path, 400, [(17, 0.25), (4999, 1.0)])
    assert 400 <= len(points.segments) <= 402
    assert (17, 0.25) in zip(points.segments.tolist(), points.parameters.tolist(), strict=True)
    along = progress_of(path).at(points)
    assert along[0] == 0
    assert along[-1] == pytest.approx(path.lengths.sum(), rel=1e-12)
    assert (np.diff(along) > 0).all()
    assert np.diff(along).max() <= path.lengths.sum() / 398


def data_of(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, flags=re.DOTALL)
    return dict(json.loads(text))


def drawn_lengths(view: dict[str, Any], frame: dict[str, Any]) -> dict[str, list[float]]:
    """Lengths of the lines of each limb."""
    points = np.array(frame["points"])
    found: dict[str, list[float]] = {}
    for link in view["links"]:
        if link["limb"] is not None:
            a, b = link["ends"]
            found.setdefault(link["limb"], []).append(float(np.linalg.norm(points[a] - points[b])))
    return found


def test_the_page_has_the_postures_of_the_path(spindle: PathPicture) -> None:
    page = path_page(spindle, "the text of the case", lambda claim: f"command at {claim.line}")
    assert len(page) < 3_000_000
    view = data_of(page)["view"]
    frames = view["frames"]
    assert 250 <= len(frames) <= 300
    at = np.array([each["at"] for each in frames])
    assert (at[0], at[-1]) == (0, 6)
    assert {each.at for each in spindle.marks} <= set(at.tolist())
    found = inverse(spindle.judged.case, *poses_at(at))
    for frame, p, coordinates in zip(frames, poses_at(at)[0], found.coordinates, strict=True):
        shown = drawn_lengths(view, frame)
        assert list(shown) == list(found.actuators)
        np.testing.assert_allclose([each[0] for each in shown.values()], coordinates, atol=1e-5)
        np.testing.assert_allclose(frame["position"], p, atol=1e-5)
    # The slider begins at the first fault, and says so.
    first = frames[view["first"]]
    assert first["at"] == spindle.marks[0].at
    assert first["words"].startswith("line 4, time ")
    places = np.array([each["position"] for each in view["marks"]])
    np.testing.assert_allclose(places, poses_at(np.array([each.at for each in spindle.marks]))[0], atol=1e-5)
    # Words, tables and charts need no script.
    words = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for text in (
        "First violation: line 4",
        "leg_length limb 1-",
        "Leg lengths:",
        "the text of the case",
        "command at",
    ):
        assert text in words
    assert words.count('class="chart"') == 4
    assert words.count('class="cursor"') == 4
    assert len(re.findall(r'class="bound"', words)) == 6 * 4


def test_a_delta_on_a_page_keeps_its_arms_and_rods() -> None:
    case = robot_of("delta", {"actuator_angle": {"min": -30, "max": 60}}, rb=0.164)
    rows = np.array([[0, 0, -1.1], [0.2, 0.1, -1.2], [0, 0, -1.9], [-0.2, 0.1, -1.0]])
    picture = pictured(case, rows, "x,y,z", 0.1)
    view = data_of(path_page(picture, "", lambda _: ""))["view"]
    positions = np.array([each["position"] for each in view["frames"]])
    # Out of reach, there is no posture; arms and rods are 1.768 m long together.
    assert positions[:, 2].min() < -1.75
    assert positions[:, 2].min() > -1.768 - 0.12
    for frame in view["frames"]:
        for found in drawn_lengths(view, frame).values():
            assert {0.524, 1.244} <= {round(each, 5) for each in found}
    apart = ~picture.samples.joints.closed
    assert apart.any()
    assert np.isnan(picture.margins[apart]).all()
    assert not picture.samples.is_violated[apart].any()
    assert picture.samples.is_apart.tolist() == apart.tolist()
    for at in picture.at[apart]:
        assert any(each.start <= at <= each.end for each in picture.bands)


def test_the_command_writes_picture_and_page(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = saved(tmp_path / "part.ngc", "G20 G90\nG0 X0 Y0 Z20 A0 B0 C0\nG1 F60 X2 A5\nG2 X2 Y2 I0 J1 B-4\nM2\n")
    files = [tmp_path / name for name in ("path.png", "page.html")]
    command = ("path", "hexapod-linuxcnc", "--along", str(part))
    code, _, err = cli(*command, "--plot", str(files[0]), "--html", str(files[1]))
    assert (code, err) == (0, "")
    assert files[0].read_bytes().startswith(b"\x89PNG")
    assert "PROVED at every point: no singularity" in files[1].read_text(encoding="utf-8")
    refusal_of(cli(*command, "--plot", str(tmp_path / "path.txt")), ".png, .svg or .pdf")
    refusal_of(cli(*command, "--html", str(part)), "the path that is read")
    monkeypatch.setattr("screwsynth.nlp.output.pictures.requirements.find_spec", lambda _: None)
    refusal_of(cli(*command, "--html", str(tmp_path / "other.html")), "pages need")

"""Proofs along paths with settings, beside kinematics in NumPy: a turn about the tool, and a moving base radius."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_from, case_of, commands_in, output_of, refusal_of, saved, unbroken
from measures import circle_joints
from path_cases import BASE, LEGS, PLATFORM, extreme, hexapod, program, turns_of

from screwsynth.nlp import Case, CaseError, InputError, Judgement, Outcome, ProgrammedPath, Sense
from screwsynth.nlp.path.dividing import divided_path
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.path.reader import path_without_settings
from screwsynth.nlp.path.settings import changing_of
from screwsynth.nlp.path.waypoints import waypoints
from screwsynth.nlp.proof.checker.proof_file import PathPremises, Proof, ProofError
from screwsynth.nlp.proof.checker.workspace.check import check_path_proof
from screwsynth.nlp.proof.checker.workspace.path_poses import PathPoses
from screwsynth.nlp.proof.checker.workspace.path_premises import carried_path, premises_of
from screwsynth.nlp.proof.workspace.path_domain import covered
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.path_proof_writer import path_proof_of
from screwsynth.nlp.proof.workspace.path_samples import samples_of
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.solver.schedule.exchange import exchanged
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.schedule.polish import polish

#: Points of a path with a turn about a tool that leans: position, roll, pitch, yaw, turn (degrees), time.
TURN_ROWS = ((0, 0, 20, 10, 20, 0, -40, 0), (3, 1, 21, 0, 25, 30, 35, 4), (2, 3, 20, -15, 10, 10, 60, 8))
AXIS = (0.3, -0.2, 1.0)
#: Points of a path with a moving base radius: position, roll, pitch, yaw, radius x1, time.
RADIUS_ROWS = ((-2, 1, 20, 0, 0, 0, 24, 0), (3, 2, 21, 0, 0, 0, 26.5, 5))
SAMPLES = 100_000
Rows = Sequence[Sequence[float]]


def tables(**changes: object) -> dict[str, Any]:
    """LinuxCNC's hexapod with an objective over a path."""
    return {
        "units": {"length": "in"},
        "robot": {
            "model": "stewart-gough",
            "layout": "octahedral",
            "parameters": {"x1": 26.5, "x2": 11.543, "x3": 0, "x4": 5},
        },
        "pose": {"position": [0, 0, 20]},
        "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "objective": {"over": "path", "as": "mean"},
        "path": {"file": "s.csv"},
    } | changes


def turning(**changes: object) -> Case:
    tool = {"axis": list(AXIS), "turn": {"min": -75, "max": 75, "rate": 20}}
    return case_from(tables(path={"file": "s.csv", "tool": tool}, **changes))


def moving(**changes: object) -> Case:
    whole = tables(**changes)
    whole["robot"]["parameters"]["x1"] = {"min": 18, "max": 34, "per": "path", "rate": 0.5}
    return case_from(whole)


def written(names: str, rows: Rows) -> str:
    return "\n".join([names, *(",".join(map(repr, map(float, row))) for row in rows)])


def path_of(case: Case, setting: str, rows: Rows, between: Between | None = None) -> ProgrammedPath:
    text = written(f"x,y,z,roll,pitch,yaw,{setting},t", rows)
    return read_poses(text, "s.csv", case.units, PathOptions(between=between), changing_of(case))


def about_tool(angles: Array) -> Array:
    """Rotations (N, 3, 3) about the tool's axis, by Rodrigues' formula."""
    x, y, z = np.array(AXIS) / np.linalg.norm(AXIS)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + s * K + (1 - c) * (K @ K))


def lengths(rows: Rows, segment: int, s: Array, setting: str) -> Array:
    """Lengths (P, 6) of the legs at parameters (P,) of a segment."""
    first, last = (np.array(row[:7], dtype=float) for row in rows[segment : segment + 2])
    y = first + s[:, None] * (last - first)
    R, base = turns_of(np.radians(y[:, 3:6])), np.zeros((1, 6, 3))
    numbers = {"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)}
    if setting == "turn":
        R, base = R @ about_tool(np.radians(y[:, 6])), circle_joints(numbers)[0][None]
    else:  # the radius scales the base
        base = circle_joints(numbers | {"x1": 1.0})[0][None] * y[:, 6, None, None]
    return np.asarray(np.linalg.norm(y[:, None, :3] + np.einsum("nij,kj->nki", R, PLATFORM) - base, axis=2))


def sampled(rows: Rows, setting: str) -> tuple[Array, Array]:
    """Lengths (P, 6) and speeds (P, 6), central differences, at many points of all segments."""
    found, h = [], 1e-6
    for k in range(len(rows) - 1):
        s = np.linspace(0.0, 1.0, SAMPLES // (len(rows) - 1))
        speeds = (lengths(rows, k, s + h, setting) - lengths(rows, k, s - h, setting)) / (2 * h)
        found.append((lengths(rows, k, s, setting), np.abs(speeds) / (rows[k + 1][7] - rows[k][7])))
    every = [np.concatenate(each) for each in zip(*found, strict=True)]
    return every[0], every[1]


@cache
def judged(setting: str) -> Judgement:
    case, rows = (turning(), TURN_ROWS) if setting == "turn" else (moving(), RADIUS_ROWS)
    return judge_path(case, path_of(case, setting, rows), gap=1e-8)


@pytest.mark.parametrize(("setting", "rows"), [("turn", TURN_ROWS), ("x1", RADIUS_ROWS)])
def test_ranges_and_speeds_are_those_of_samples(setting: str, rows: Rows) -> None:
    every, speeds = sampled(rows, setting)
    for k, leg in enumerate(LEGS):
        name = f"leg_length limb {leg}"
        low, high = (extreme(judged(setting), name, sense).bound for sense in (Sense.MIN, Sense.MAX))
        assert every[:, k].min() - 1e-4 <= low <= every[:, k].min() + 1e-9
        assert every[:, k].max() - 1e-9 <= high <= every[:, k].max() + 1e-4
        speed = extreme(judged(setting), f"actuator_speed actuator {leg}", Sense.MAX).bound
        # Bounds of the angular velocity of two turns are of first order, so a small gap takes many pieces.
        most = speeds[:, k].max()
        assert most - 1e-8 <= speed <= most + (2e-3 * speeds.max() if setting == "turn" else 1e-6)
    assert judged(setting).is_proved


def test_a_speed_limit_just_below_the_largest_speed_is_refuted() -> None:
    largest = float(sampled(RADIUS_ROWS, "x1")[1].max())
    outcomes = []
    for limit in (largest + 1e-3, largest - 1e-3):
        case = moving(limits={"actuator_speed": {"max": limit}})
        outcomes.append(judge_path(case, path_of(case, "x1", RADIUS_ROWS)).is_proved)
    assert outcomes == [True, False]
    # At rest, the legs move by the radius alone.
    still = [RADIUS_ROWS[0], (*RADIUS_ROWS[0][:6], 26.5, 5)]
    case = moving()
    path = path_of(case, "x1", still)
    assert len(path) == 1
    speeds = sampled(still, "x1")[1].max(axis=0)
    found = judge_path(case, path, gap=1e-8)
    for k, leg in enumerate(LEGS):
        assert extreme(found, f"actuator_speed actuator {leg}", Sense.MAX).bound == pytest.approx(speeds[k], abs=1e-6)


def test_powers_have_the_speed_of_the_dimension_too() -> None:
    case = moving(units={"length": "in", "force": "lbf"}, load=[{"name": "cut", "any": {"force": 20}}])
    found = judge_path(case, path_of(case, "x1", RADIUS_ROWS))
    rows, s, h = RADIUS_ROWS, np.linspace(0, 1, 201), 1e-6
    speeds = (lengths(rows, 0, s + h, "x1") - lengths(rows, 0, s - h, "x1")) / (2 * h * 5)
    # A force f at the platform's origin: the leg forces are those of J' t = f; the worst f has the norm of a row.
    numbers = {"x2": 11.543, "x3": 0.0, "x4": math.radians(5)}
    worst = np.zeros(6)
    for k, part in enumerate(s):
        p, radius = np.array([-2 + 5 * part, 1 + part, 20 + part]), 24 + 2.5 * part
        spans = p + PLATFORM - circle_joints(numbers | {"x1": radius})[0]
        u = spans / np.linalg.norm(spans, axis=1)[:, None]
        J = np.hstack([u, np.cross(PLATFORM, u)])
        forces = 20 * np.linalg.norm(np.linalg.inv(J)[:3], axis=0)
        worst = np.maximum(worst, forces * np.abs(speeds[k]))
    for k, leg in enumerate(LEGS):
        power = extreme(found, f"actuator_power actuator {leg} load cut", Sense.MAX).bound
        assert worst[k] - 1e-6 <= power <= 1.02 * worst[k] + 0.02 * worst.max()


@pytest.mark.parametrize("between", Between)
def test_boxes_and_the_checker_hold_the_exact_rotation(between: Between) -> None:
    case = turning()
    path = path_of(case, "turn", TURN_ROWS, between)
    cover, box, _ = covered(path, 50.0)
    rng = np.random.default_rng(1)
    k, a, width = rng.integers(0, 2, 400), rng.random(400), rng.random(400) * 0.2
    pieces = np.stack([k, a, np.minimum(a + width, 1.0)], axis=1)
    low, high = cover.boxes(pieces)
    s = pieces[:, 1] + rng.random(400) * (pieces[:, 2] - pieces[:, 1])
    poses = path.poses_at(k, s)
    turn = np.array([row[6] for row in TURN_ROWS], dtype=float)
    task = read_poses(
        written("x,y,z,roll,pitch,yaw,t", [(*row[:6], row[7]) for row in TURN_ROWS]),
        "s.csv", case.units, PathOptions(between=between),
    ).poses_at(k, s)  # fmt: skip
    exact = task.rotations @ about_tool(np.radians(turn[k] + s * (turn[k + 1] - turn[k])))
    assert np.abs(poses.rotations - exact).max() < 1e-14
    # Cayley vectors of the exact rotation, relative to no rotation, as this path has it.
    assert box.reference == (1, 0, 0, 0)
    trace = 1 + np.trace(exact, axis1=1, axis2=2)
    r = np.stack([exact[:, 2, 1] - exact[:, 1, 2], exact[:, 0, 2] - exact[:, 2, 0], exact[:, 1, 0] - exact[:, 0, 1]], 1)
    r /= trace[:, None]
    assert ((low[:, 3:] <= r + 1e-14) & (r <= high[:, 3:] + 1e-14)).all()
    # Angular velocities by central differences.
    h = 1e-6
    s = np.clip(s, 2 * h, 1 - 2 * h)
    R, Q = (path.poses_at(k, s + step).rotations for step in (-h, h))
    W = (Q - R) / (2 * h) @ (0.5 * (Q + R)).transpose(0, 2, 1)
    omega = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=1)
    pieces = np.stack([k, s - 2 * h, s + 2 * h], axis=1)
    slow, fast = (each[:, 3:] for each in cover.derivatives(pieces))
    assert ((slow <= omega + 1e-7) & (omega <= fast + 1e-7)).all()
    assert np.abs(fast - slow).max() < 1e-4
    # The checker's quaternions have the same directions.
    values, _ = PathPoses(path).over(k + s, k + s)
    q = np.stack([each.V.mean(axis=0) for each in values[3:]], axis=1)
    Rs = path.poses_at(k, s).rotations
    w, v = q[:, 0], q[:, 1:]
    size = w * w + (v * v).sum(axis=1)
    own = (2 * w[:, None] * v) / size[:, None]
    skew = np.stack([Rs[:, 2, 1] - Rs[:, 1, 2], Rs[:, 0, 2] - Rs[:, 2, 0], Rs[:, 1, 0] - Rs[:, 0, 1]], axis=1) / 2
    assert np.abs(own - skew).max() < 1e-12


def icinco(**changes: object) -> tuple[dict[str, Any], list[float]]:
    """The hexapod of Schappler and Ortmaier (ICINCO 2021), and the quaternion of its pose without a turn."""
    parameters: dict[str, Any] = {}
    for k in range(6):
        a, m = math.radians(60 * k), math.radians(120 * (k // 2))
        side = 0.05 if k % 2 else -0.05
        parameters[f"base_{k + 1}"] = [0.6 * math.cos(a), 0.6 * math.sin(a), 0.0]
        x, y = 0.2 * math.cos(m) - side * math.sin(m), 0.2 * math.sin(m) + side * math.cos(m)
        parameters[f"platform_{k + 1}"] = [x, y, 0.0]
    tool = {"axis": [0, 0, 1], "turn": {"min": -150, "max": 150, "rate": 10}}
    whole = {
        "units": {"length": "m"},
        "robot": {"model": "hexapod", "parameters": parameters},
        "pose": {"position": [0.05, 0.03, 0.6]},
        "task": [{"sense": "max", "follows": "tool"}],
        "objective": {"over": "path", "as": "mean"},
        "path": {"file": "s.csv", "tool": tool},
    }
    c, s = math.cos(math.radians(15)), math.sin(math.radians(15))
    return whole | changes, [c * c, s * c, -s * c, -s * s]  # Rx(30) Ry(-30)


def icinco_path(case: Case, quaternion: list[float], turns: list[float]) -> ProgrammedPath:
    rows = [(0.05, 0.03, 0.6, *quaternion, turn, 3.0 * k) for k, turn in enumerate(turns)]
    text = written("x,y,z,qw,qx,qy,qz,turn,t", rows)
    return read_poses(text, "s.csv", case.units, PathOptions(), changing_of(case))


def test_the_singular_turn_of_icinco_is_found() -> None:
    whole, q = icinco()
    case = case_from(whole)
    found = judge_path(case, icinco_path(case, q, [24, 36]))
    (rank,) = found.ranks
    assert rank.outcome is Outcome.REFUTED
    assert rank.place is not None
    assert 24 + 12 * rank.place.parameter == pytest.approx(33.836928, abs=1e-5)
    assert judge_path(case, icinco_path(case, q, [24, 33.8])).is_proved


def test_a_proof_with_a_turn_is_checked_and_an_altered_one_is_rejected() -> None:
    whole, q = icinco()
    case = case_from(whole)
    rows = [(0.05, 0.03, 0.6, *q, turn, 3.0 * k) for k, turn in enumerate([-20.0, 5.0])]
    text = written("x,y,z,qw,qx,qy,qz,turn,t", rows)
    path = read_poses(text, "s.csv", case.units, PathOptions(), changing_of(case))
    record = ProofRecord()
    found = judge_path(case, path, record=record)
    premises = premises_of(case, "s.csv", text, PathOptions(), of_case=False)
    proof: Proof = path_proof_of(case, found, record, "", premises)
    assert not proof.unproved
    assert len(check_path_proof(proof, case, path).claims) == len(proof.claims) == 19
    # The same trees do not prove the claims for a turn that goes on.
    other = read_poses(
        written("x,y,z,qw,qx,qy,qz,turn,t", [rows[0], (*rows[1][:7], 9.0, 3.0)]),
        "s.csv", case.units, PathOptions(), changing_of(case),
    )  # fmt: skip
    with pytest.raises(ProofError):
        check_path_proof(proof, case, other)


BAD_TABLES = {
    "x,y,z,x1,t\n0,0,20,24,0\n0,0,21,35,30": "s.csv: row 3, column x1: 35 is above its max 34",
    "x,y,z,x1,t\n0,0,20,17,0\n0,0,21,24,30": "s.csv: row 2, column x1: 17 is below its min 18",
    "x,y,z,x1,t\n0,0,20,24,0\n0,0,21,24.9,0.1": ("s.csv: row 3: x1 changes by 0.9 in 0.1 s, more than its rate 0.5"),
    "x,y,z,t\n0,0,20,0\n0,0,21,1": (
        "s.csv: column 'x1' is missing: x1 changes along the path; add the column, or fix the value with --set x1=.."
    ),
    "x,y,z,x1\n0,0,20,24\n0,0,21,24": "s.csv: column 't' is missing: the rate of x1 needs times",
    "x,y,z,x1,feed\n0,0,20,24,1\n0,0,21,24,1": (
        "s.csv: column 'feed' gives no time to a change of x1; state t instead"
    ),
    "x,y,z,x1,turn,t\n0,0,20,24,0,0\n0,0,21,24,0,1": "no such column, 'turn'",
}


@pytest.mark.parametrize("text", BAD_TABLES)
def test_tables_with_faults_are_refused(text: str) -> None:
    case = moving()
    with pytest.raises(InputError) as error:
        read_poses(text, "s.csv", case.units, PathOptions(), changing_of(case))
    assert BAD_TABLES[text] in str(error.value)


def test_values_at_their_bounds_and_rates_are_allowed() -> None:
    case = moving()
    rows = [(0, 0, 20, 0, 0, 0, 18, 0.1), (0, 0, 21, 0, 0, 0, 18.1, 0.3), (0, 0, 21, 0, 0, 0, 18.05, 0.4)]
    assert len(path_of(case, "x1", rows)) == 2
    assert case.replace(x1=20).settings == {}
    fixed = case.replace(x1=20)
    (note,) = path_of(fixed, "x1", rows).warnings
    assert note == "column x1: not used"


def test_commands_refuse_what_settings_do_not_support(
    cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.csv").write_text(written("x,y,z,roll,pitch,yaw,x1,t", RADIUS_ROWS))
    (tmp_path / "p.ngc").write_text("G20 G90 G94\nF100\nG0 X0 Y0 Z20 A0 B0 C0\nG1 X1\nM2\n")
    monkeypatch.chdir(tmp_path)
    file = str(saved(tmp_path / "case.toml", moving().to_toml()))
    text = unbroken(output_of(cli("path", file)))
    assert "PROVED at every point" in text
    assert "F locks x1; its drive has no force or power here" in text
    refusal_of(cli("path", file, "--csv", "j.csv", "--within", "0.1"), "--within: is not proved while x1 changes")
    assert not (tmp_path / "j.csv").exists()
    refusal_of(cli("path", file, "--along", "p.ngc"), "states no x1")
    home = moving(limits={"base_joint_angle": {"max": 40, "about": "home"}, "home": {"position": [0, 0, 20]}})
    file = str(saved(tmp_path / "home.toml", home.to_toml()))
    refusal_of(cli("path", file), "limits.base_joint_angle.about", "home has no x1")


def test_no_command_is_printed_that_evaluate_refuses(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A case that is optimised along its path has no F at one pose, so evaluate refuses it."""
    (tmp_path / "s.csv").write_text(written("x,y,z,roll,pitch,yaw,x1,t", RADIUS_ROWS))
    monkeypatch.chdir(tmp_path)
    file = str(saved(tmp_path / "case.toml", moving(limits={"leg_length": {"max": 28}}).to_toml()))
    code, out, err = cli("path", file, "--html", "page.html")
    assert (code, err) == (1, "")
    assert "first violation" in out
    assert commands_in(out, "see it with") == []
    assert 'aria-label="Command"' not in Path("page.html").read_text()
    refusal_of(cli("evaluate", file), "x1 changes along the path, but this command takes one robot")


def test_a_fixed_turn_is_part_of_every_path() -> None:
    tool = {"axis": [0, 0, 1], "turn": 12}
    whole = tables(path={"file": "s.csv", "tool": tool})
    del whole["objective"]
    case, plain = case_from(whole), hexapod()
    rows = [(0, 0, 20, 0, 0, 3), (1, 0, 21, 0, 0, 8)]
    text = written("x,y,z,roll,pitch,yaw", rows)
    turned = read_poses(text, "s.csv", case.units, PathOptions(), changing_of(case))
    other = read_poses(
        written("x,y,z,roll,pitch,yaw", [(*row[:5], row[5] + 12) for row in rows]), "s.csv", plain.units, PathOptions()
    )
    one, two = judge_path(case, turned, gap=1e-7), judge_path(plain, other, gap=1e-7)
    for leg in LEGS:
        for sense in Sense:
            name = f"leg_length limb {leg}"
            assert extreme(one, name, sense).bound == pytest.approx(extreme(two, name, sense).bound, abs=1e-5)


def test_a_schedule_that_is_violated_between_its_points_is_solved_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(Path(__file__).parents[2] / "cases")
    case = case_of("hexapod-yaw")
    assert case.path is not None
    problem = schedule_problem(replace(case, path=replace(case.path, has_limits=True)))
    start = np.full((len(problem.points), 1), math.radians(-0.7))
    (seed,) = [each for each in (polish(problem, np.zeros(0), start),) if each is not None]
    found = exchanged(problem, seed)
    assert found.judgement.is_proved
    # Dense samples of the schedule, with own kinematics.
    points, s = found.problem.points, found.schedule.s[:, 0]
    path = path_without_settings(case)
    worst = 0.0
    for part in np.linspace(0, 1, 21):
        begin = points.points.parameters[:-1]
        end = np.where(points.points.segments[1:] == points.points.segments[:-1], points.points.parameters[1:], 1.0)
        poses = path.poses_at(points.points.segments[:-1], begin + part * (end - begin))
        turn = s[:-1] + part * np.diff(s)
        c, w, z = np.cos(turn), np.sin(turn), np.zeros_like(turn)
        R = poses.rotations @ np.moveaxis(np.array([[c, -w, z], [w, c, z], [z, z, z + 1]]), 2, 0)
        legs = np.linalg.norm(poses.positions[:, None] + np.einsum("nij,kj->nki", R, PLATFORM) - BASE, axis=2)
        worst = max(worst, float(legs.max()))
        assert legs.min() >= 17
    assert 42.9 < worst <= 43
    assert (np.abs(np.diff(s)) <= math.radians(5) * points.seconds).all()


def test_a_divided_path_has_the_same_poses() -> None:
    text = "G20 G90 G94\nF100\nG1 X0 Y0 Z20 A0 B0 C0\nG1 X1 A5 B3\nG2 X3 Y0 I1 J0 C20\nG18 G3 X5 Z21 I1 K0.5\nM2"
    for path in (program(hexapod(), text), replace(program(hexapod(), text), between=Between.SLERP)):
        points = waypoints(path, 40).points
        own = divided_path(path, points)
        rng = np.random.default_rng(3)
        k, s = rng.integers(0, len(own), 300), rng.random(300)
        end = np.where(points.segments[k + 1] == points.segments[k], points.parameters[k + 1], 1.0)
        at = points.parameters[k] + s * (end - points.parameters[k])
        one, two = path.poses_at(points.segments[k], at), own.poses_at(k, s)
        assert np.abs(one.positions - two.positions).max() < 1e-12
        assert np.abs(one.rotations - two.rotations).max() < 1e-12
        assert own.time == pytest.approx(path.time, rel=1e-12)


def proof_along(case: Case, text: str) -> tuple[Proof, ProgrammedPath]:
    """The proof of a table, with its path."""
    path = read_poses(text, "s.csv", case.units, PathOptions(), changing_of(case))
    record = ProofRecord()
    found = judge_path(case, path, record=record)
    return path_proof_of(case, found, record, "", premises_of(case, "s.csv", text, PathOptions(), of_case=False)), path


#: Points with a moving base radius and with a turn: position, roll, pitch, yaw, radius x1, turn, time.
BOTH_ROWS = ((-2, 1, 20, 0, 5, 0, 24, -20, 0), (3, 2, 21, 4, 0, 0, 26.5, 10, 5), (3, 2, 21, 4, 0, 0, 26, 5, 6))


def both(**changes: object) -> Case:
    """A hexapod whose base radius and turn change."""
    whole = tables(**changes)
    whole["robot"]["parameters"]["x1"] = {"min": 18, "max": 34, "per": "path", "rate": 0.5}
    whole["path"] = {"file": "s.csv", "tool": {"axis": [0, 0, 1], "turn": {"min": -75, "max": 75, "rate": 20}}}
    return case_from(whole)


FORCES = {
    "units": {"length": "in", "force": "lbf"},
    "load": [{"name": "cut", "any": {"force": 20}}],
    "limits": {"leg_length": {"min": 10, "max": 45}, "actuator_speed": {"max": 5}, "actuator_power": {"max": 500}},
}


@pytest.mark.parametrize("more", [{}, FORCES, {"limits": {"smallest_singular_value": {"min": 0.05, "length": 11}}}])
@pytest.mark.parametrize("is_both", [False, True])
def test_proofs_with_a_moving_dimension_are_checked(more: dict[str, Any], is_both: bool) -> None:
    names = "x,y,z,roll,pitch,yaw,x1,turn,t" if is_both else "x,y,z,roll,pitch,yaw,x1,t"
    case, rows = (both(**more), BOTH_ROWS) if is_both else (moving(**more), RADIUS_ROWS)
    proof, path = proof_along(case, written(names, rows))
    assert proof.unproved == ()
    checked = check_path_proof(proof, case, path)
    assert {each.name for each in checked.claims} >= {"regular", *(f"actuator_speed actuator {leg}" for leg in LEGS)}
    # A bound a little nearer than the largest speed is not confirmed.
    k = next(k for k, each in enumerate(proof.claims) if each.name == "actuator_speed actuator 1-")
    assert proof.claims[k].bound is not None
    less = replace(proof.claims[k], bound=0.95 * (proof.claims[k].bound or 0.0))
    with pytest.raises(ProofError, match="1-"):
        check_path_proof(replace(proof, claims=(*proof.claims[:k], less, *proof.claims[k + 1 :])), case, path)


def test_a_proof_takes_no_setting_from_its_file() -> None:
    case = moving()
    text = written("x,y,z,roll,pitch,yaw,x1,t", RADIUS_ROWS)
    proof, _ = proof_along(case, text)
    assert isinstance(proof.premises, PathPremises)
    # The trees do not prove the claims for another radius.
    rows = [RADIUS_ROWS[0], (*RADIUS_ROWS[1][:6], 25.9, 5)]
    with pytest.raises(ProofError):
        check_path_proof(proof, case, path_of(case, "x1", rows))
    # A file whose text has a radius out of the range of the case, or that changes too fast, is rejected.
    for old, new, fault in (("26.5", "34.5", "above its max 34"), ("26.5,5.0", "26.5,4.9", "more than its rate 0.5")):
        altered = replace(proof.premises, text=text.replace(old, new))
        with pytest.raises(ProofError, match=fault):
            carried_path(case, altered)
    # A case without the setting has no use for the file.
    with pytest.raises(ProofError):
        check_path_proof(proof, case.replace(x1=26), path_of(case.replace(x1=26), "x1", RADIUS_ROWS))


def test_a_claim_about_a_clearance_is_rejected_while_a_dimension_changes() -> None:
    case = moving(limits={"leg_clearance": {"min": 0.5}})
    proof, path = proof_along(case, written("x,y,z,roll,pitch,yaw,x1,t", RADIUS_ROWS))
    name = "leg_clearance limbs 1+ and 2-"
    (own,) = [each for each in proof.unproved if each.name == name]
    some = next(each for each in proof.claims if each.reason == "boxes")
    forged = replace(some, name=name, sense=own.sense, bound=0.5)
    left = tuple(each for each in proof.unproved if each is not own)
    with pytest.raises(ProofError, match="leg clearances cannot be proved"):
        check_path_proof(replace(proof, claims=(*proof.claims, forged), unproved=left), case, path)


def test_tables_curves_and_pages_have_the_settings(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.csv").write_text(written("x,y,z,roll,pitch,yaw,x1,turn,t", BOTH_ROWS))
    file = str(saved(Path("case.toml"), both().to_toml()))
    output_of(cli("path", file, "--csv", "joints.csv", "--step", "0.5", "--plot", "path.svg", "--html", "page.html"))
    output_of(cli("path", file, "--proof", "proof.json"))
    output_of(cli("verify-proof", "proof.json", file))
    with Path("joints.csv").open() as opened:
        table = [{key: float(cell or "nan") for key, cell in row.items()} for row in csv.DictReader(opened)]
    columns = {key: np.array([row[key] for row in table]) for key in table[0]}
    assert [*columns][-2:] == ["rate turn", "rate x1"]
    k, s = columns["segment"].astype(int), columns["parameter"]
    whole = np.array(BOTH_ROWS, dtype=float)
    at = whole[k] + s[:, None] * (whole[k + 1] - whole[k])
    for j, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw", "x1", "turn", "t")):
        assert columns[name] == pytest.approx(at[:, j], abs=1e-9)
    R = turns_of(np.radians(at[:, 3:6])) @ turns_of(np.radians(np.column_stack([0 * s, 0 * s, at[:, 7]])))
    base = circle_joints({"x1": 1.0, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})[0] * at[:, 6, None, None]
    legs = np.linalg.norm(at[:, None, :3] + np.einsum("nij,kj->nki", R, PLATFORM) - base, axis=2)
    assert np.column_stack([columns[f"leg_length {leg}"] for leg in LEGS]) == pytest.approx(legs, abs=1e-9)
    seconds = whole[k + 1, 8] - whole[k, 8]
    for j, name in ((6, "rate x1"), (7, "rate turn")):
        assert math.isnan(columns[name][0])
        assert columns[name][1:] == pytest.approx(((whole[k + 1, j] - whole[k, j]) / seconds)[1:], abs=1e-12)
    # Speeds between rows are differences of the lengths.
    assert columns["speed 1-"][1:] == pytest.approx(np.diff(legs[:, 0]) / np.diff(columns["t"]), abs=1e-6)
    svg, page = Path("path.svg").read_text(), Path("page.html").read_text()
    for name in ("setting x1", "setting turn", "rate of x1", "rate of turn"):
        assert f'id="{name} {name.rpartition(" ")[2]}"' in svg
        assert f"{name[0].upper()}{name[1:]}:" in page
    assert re.search(r"x1</th><td[^>]*>(<[^>]*>)*24(<[^>]*>)* \.\. 26\.5", page)
    assert "the live view does not move x1 along a path" in page


def test_curves_of_speeds_have_the_motion_of_the_dimension() -> None:
    found = samples_of(judged("x1"))
    assert found.joints is not None
    s, h = found.points.parameters, 1e-6
    assert found.joints.coordinates == pytest.approx(lengths(RADIUS_ROWS, 0, s, "x1"), abs=1e-10)
    speeds = (lengths(RADIUS_ROWS, 0, s + h, "x1") - lengths(RADIUS_ROWS, 0, s - h, "x1")) / (2 * h * 5)
    assert found.speeds == pytest.approx(speeds, abs=1e-7)


def test_a_schedule_that_cannot_be_proved_is_refused_before_its_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.csv").write_text(written("x,y,z,roll,pitch,yaw,t", [(*row[:6], row[7]) for row in RADIUS_ROWS]))
    angles = {"base_joint_angle": {"max": 40, "about": "home"}, "home": {"position": [0, 0, 20]}}
    for limits in (angles, angles | {"over": "path"}):
        with pytest.raises(CaseError, match="home has no x1, which changes along the path"):
            schedule_problem(moving(limits=limits))

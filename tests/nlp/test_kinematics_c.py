"""Kinematics in C, held against inverse kinematics in Python, differences, power, and controllers' own numbers."""

import math
import re
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import DOCS, Array, Run, output_of, refusal_of, saved, turn_about
from generated import COMPILERS, STRICT, made, needs_compiler, run
from kinematics_library import BAD_INPUT, LOOPS_OPEN, OK, OUT_OF_REACH, SINGULAR, Library, typical_case
from position_cases import DELTA

from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, CaseError, case_text, inverse, load_case
from screwsynth.nlp.case.controller import Controller
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.case.robotcase import read_robot_case
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.embedding.kinematics import matrix_of_rpy
from screwsynth.nlp.embedding.kinematicsfiles import generate_kinematics, kinematics_prefix

pytestmark = needs_compiler

PAGE = (DOCS / "servo-angles.md").read_text(encoding="utf-8")
#: A robot with legs, one with cranks in closed form, and one whose coordinates depend on each other.
SOME = ("stewart-gough", "6-rss", "3-rrs")
OTHERS = [name for name in ("hexapod", "three-upu", *gallery_names()) if name not in SOME]
ROBOTS = [*SOME, *(pytest.param(name, marks=pytest.mark.soak) for name in OTHERS)]

ROTARY = """
[units]
length = "m"
[robot]
model = "delta"
parameters = { rb = 0.010, rp = 0.006, arm = 0.010, rod = 0.014, w = 0.002, tilt = 20 }
[pose]
position = [0, 0, -0.010]
[[task]]
sense = "min"
axis = [0, 0, 1]
point = [0, 0, 0]
pitch = inf
"""
CONTROLLER = """
[controller]
length = "mm"
angle = "deg"
zero = 20
rpy = [0, 0, 90]
"""
ANKLE = """
name = "ankle"
home = [0, 0, 0]
[[limb]]
name = "ankle"
joints = [
    { type = "U", name = "ankle", at = [0, 0, 0.02], axes = [[0, 1, 0], [1, 0, 0]] },
]
[[limb]]
name = "right"
joints = [
    { type = "R", at = [0, -0.04, 0.2], axis = [0, 1, 0], actuated = true },
    { type = "S", at = [-0.05, -0.04, 0.2] },
    { type = "S", at = [-0.05, -0.04, 0.0] },
]
[[limb]]
name = "left"
joints = [
    { type = "R", at = [0, 0.04, 0.28], axis = [0, 1, 0], actuated = true },
    { type = "S", at = [-0.05, 0.04, 0.28] },
    { type = "S", at = [-0.05, 0.04, 0.0] },
]
"""


@cache
def library(name: str) -> Library:
    return Library(typical_case(name))


@cache
def rotary(text: str = CONTROLLER) -> Library:
    return Library(case_of(ROTARY + text, "rotary"))


def case_of(text: str, name: str = "case") -> Case:
    return case_from_tables(tomllib.loads(text), name=name, source=f"{name}.toml")


def feasible(robot: Library, p: Array, R: Array, seed: int) -> Array:
    """Return a motion that the platform can make at a closed pose of a robot whose controller is the case's."""
    found = inverse(robot.case, p[None], R[None])
    pose = np.concatenate([R.ravel(), p])
    z = robot.robot.point(pose, found.unknowns[0])
    step = np.random.default_rng(seed).normal(size=len(robot.robot.step_sizes))
    return robot.robot.feasible(z, step) * np.repeat([1.0, robot.robot.size], 3)


def moved(p: Array, R: Array, twist: Array, step: float) -> tuple[Array, Array]:
    """Return the pose after a small motion."""
    size = float(np.linalg.norm(twist[:3]))
    return p + step * twist[3:], (turn_about(twist[:3], step * size) if size else np.eye(3)) @ R


@pytest.mark.parametrize("name", ROBOTS)
def test_motors_and_rates_are_those_of_inverse_kinematics(name: str) -> None:
    robot, soak = library(name), name not in SOME
    p, R = robot.poses(2000 if soak else 200, 0.1)
    p[::10], R[::10] = (each[::10] for each in robot.poses(len(p), 0.8, seed=1))
    turned = np.array([turn_about(np.array([0.3, 1.0, 0.2]), 0.2) @ each for each in R[::25]])
    p, R = np.concatenate([p, p[::25]]), np.concatenate([R, turned])
    found = inverse(robot.case, p, R)
    sizes = robot.robot.motor_sizes
    for k in range(len(p)):
        robot.start()
        status, q = robot.motors(found.positions[k], found.rotations[k])
        assert (status == OK) == found.closed[k]
        if status != OK:
            assert (q == -77).all()
            continue
        np.testing.assert_allclose(q / sizes, found.coordinates[k] / sizes, rtol=0, atol=1e-12)
        rates = robot.at("rates", found.positions[k], found.rotations[k], 6 * robot.count).values
        np.testing.assert_allclose(rates, found.rates[k].ravel(), rtol=1e-11, atol=1e-11 * np.abs(found.rates[k]).max())
    assert found.closed.sum() >= 0.2 * len(p)


@pytest.mark.parametrize("name", ROBOTS)
def test_one_motor_alone_has_the_same_coordinate(name: str) -> None:
    robot = library(name)
    if robot.state is not None:
        assert f"int {robot.kin}_motor(" not in robot.files[next(x for x in robot.files if x.endswith(".h"))]
        return
    p, R = robot.poses(20, 0.05)
    for k in range(len(p)):
        q = robot.motors(p[k], R[k]).values
        for i in range(robot.count):
            found = np.full(1, -77.0)
            pose = [np.ascontiguousarray(p[k]), np.ascontiguousarray(R[k]).reshape(9)]
            assert robot.call("motor", i, *pose, found) == OK
            assert found[0] == pytest.approx(q[i], abs=1e-13 * robot.robot.motor_sizes[i])
        assert robot.call("motor", robot.count, *pose, found) == BAD_INPUT


@pytest.mark.parametrize("name", ROBOTS)
def test_speeds_are_differences_and_powers_balance(name: str) -> None:
    robot = library(name)
    p, R = robot.poses(15, 0.06, seed=2)
    sizes, rng, singular = robot.robot.motor_sizes, np.random.default_rng(5), 0
    found = inverse(robot.case, p, R)
    for k in np.flatnonzero(found.closed):
        at, turn = found.positions[k], found.rotations[k]
        robot.start()
        twist = feasible(robot, at, turn, int(k))
        speeds = robot.at("speeds", at, turn, robot.count, twist)
        assert speeds.status == OK
        if not robot.robot.complete:  # the path of a twist closes the loops where all coordinates are independent
            step = 1e-5
            ahead, behind = (robot.motors(*moved(at, turn, twist, sign * step)).values for sign in (1, -1))
            np.testing.assert_allclose((ahead - behind) / (2 * step) / sizes, speeds.values / sizes, atol=1e-6)
        load = rng.normal(size=6) / np.repeat([1.0, robot.robot.size], 3)
        torques = robot.at("torques", at, turn, robot.count, load)
        if robot.robot.no_torques or found.singular[k]:
            assert torques.status == SINGULAR
            assert (torques.values == -77).all()
            singular += 1
            continue
        assert torques.status == OK
        powers = [*(torques.values * speeds.values), *(load * twist)]
        assert abs(sum(powers)) <= 1e-11 * sum(map(abs, powers))
    assert singular == 0 or robot.robot.no_torques


@pytest.mark.parametrize("name", ROBOTS)
def test_forward_kinematics_is_the_way_back(name: str) -> None:
    robot = library(name)
    p, R = robot.poses(60, 0.05, seed=3)
    found = inverse(robot.case, p, R)
    home, reached = robot.home, 0
    for k in np.flatnonzero(found.closed):
        at, turn = found.positions[k], found.rotations[k]
        robot.start()
        q = robot.motors(at, turn).values
        z = robot.robot.point(np.concatenate([turn.ravel(), at]), found.unknowns[k])
        if not robot.robot.forward or found.singular[k]:
            assert robot.forward(q, at, turn)[0] == SINGULAR
            continue
        near = robot.forward(q, at + 1e-4 * robot.robot.size * np.array([1.0, -1.0, 0.5]), turn)
        robot.start()
        from_home = robot.forward(q, *home)
        # Beyond a singularity home's side has no pose with these coordinates, or another one.
        results = [near] if robot.robot.side(z) < 0.05 else [near, from_home]
        for status, position, rotation in results:
            assert status == OK
            np.testing.assert_allclose(position / robot.robot.size, at / robot.robot.size, atol=1e-8)
            np.testing.assert_allclose(rotation, turn, atol=1e-8)
            reached += 1
    assert reached > 40 or not robot.robot.forward


@pytest.mark.parametrize("name", ROBOTS)
def test_dependent_coordinates_are_completed(name: str) -> None:
    robot = library(name)
    p, R = robot.poses(20, 0.05, seed=4)
    found = inverse(robot.case, p, R)
    for k in np.flatnonzero(found.closed):
        robot.start()
        status, position, rotation = robot.complete(p[k], R[k])
        assert status == OK
        np.testing.assert_allclose(position / robot.robot.size, found.positions[k] / robot.robot.size, atol=1e-7)
        np.testing.assert_allclose(rotation, found.rotations[k], atol=1e-7)
        assert robot.motors(position, rotation).status == OK


@pytest.mark.parametrize("name", ROBOTS)
def test_the_jacobian_in_roll_pitch_and_yaw_is_a_difference(name: str) -> None:
    robot = library(name)
    p = robot.home[0] + 0.02 * robot.robot.size * np.isin(range(3), robot.robot.coordinates)
    rpy = 0.05 * np.isin(range(3, 6), robot.robot.coordinates) * np.array([1.0, -0.7, 0.4])

    def motors(given: Array) -> Array:
        robot.start()
        pose = given[:3], rotation_of(robot, given[3:])
        status, position, rotation = robot.complete(*pose)
        assert status == OK
        return robot.motors(position, rotation).values

    middle = np.concatenate([p, rpy])
    robot.start()
    _, position, rotation = robot.complete(p, rotation_of(robot, rpy))
    angles = np.zeros(3)
    robot.call("to_rpy", np.ascontiguousarray(rotation).reshape(9), angles)
    at = [np.ascontiguousarray(position), angles, *([robot.state] if robot.state is not None else [])]
    jacobian = np.full((robot.count, 6), -77.0)
    assert robot.call("jacobian_rpy", *at, jacobian) == OK
    sizes = robot.robot.motor_sizes
    for k in robot.robot.coordinates:
        step = np.zeros(6)
        step[k] = 1e-5 * (robot.robot.size if k < 3 else 1.0)
        slope = (motors(middle + step) - motors(middle - step)) / (2 * step[k])
        scale = (robot.robot.size if k < 3 else 1.0) / sizes
        np.testing.assert_allclose(jacobian[:, k] * scale, slope * scale, atol=2e-7)
    if robot.robot.complete:
        others = [k for k in range(6) if k not in robot.robot.coordinates]
        assert (jacobian[:, others] == 0).all()


def rotation_of(robot: Library, rpy: Array) -> Array:
    """Return the rotation matrix by the function in C, which is that of the words about fixed axes."""
    found = np.zeros(9)
    robot.call("from_rpy", np.ascontiguousarray(rpy), found)
    x, y, z = (turn_about(np.eye(3)[k], float(rpy[k])) for k in range(3))
    np.testing.assert_allclose(found.reshape(3, 3), z @ y @ x, atol=1e-15)
    return found.reshape(3, 3)


@pytest.mark.parametrize("name", SOME)
def test_no_motor_jumps_along_a_line(name: str) -> None:
    robot, count = library(name), 10_000
    p, R = robot.home
    end = 0.06 * robot.robot.size * np.isin(range(3), robot.robot.coordinates) * np.array([1.0, -0.5, 0.8])
    robot.start()
    q = robot.motors(p, R).values + 2 * math.pi * (robot.robot.motor_sizes == 1.0)
    largest = np.zeros(robot.count)
    for k in range(count):
        at = p + (k / count) * end
        status, position, rotation = robot.complete(at, R) if robot.robot.complete else (OK, at, R)
        found = robot.at("motors_near", position, rotation, robot.count, q)
        assert status == found.status == OK
        largest = np.maximum(largest, np.abs(found.values - q))
        q = found.values.copy()
    rates = np.abs(robot.at("rates", p, R, 6 * robot.count).values.reshape(-1, 6)) @ np.abs([0, 0, 0, *end]) / count
    assert (largest <= 4 * rates + 1e-9).all()
    turning = robot.robot.motor_sizes == 1.0
    assert (q[turning] > math.pi).all()


@pytest.mark.parametrize("name", ["6-rss", "delta", "3-rrs"])
def test_what_is_no_pose_is_refused_and_changes_nothing(name: str) -> None:
    robot = library(name)
    for place in range(12):
        for value in (math.nan, math.inf, -math.inf):
            pose = np.concatenate([robot.home[1].ravel(), robot.home[0]])
            pose[place] = value
            robot.start()
            before = None if robot.state is None else robot.state.copy()
            for function, size, further in (
                ("motors", robot.count, []),
                ("rates", 6 * robot.count, []),
                ("torques", robot.count, [np.ones(6)]),
                ("motors_near", robot.count, [np.zeros(robot.count)]),
            ):
                status, values = robot.at(function, pose[9:], pose[:9], size, *further)
                assert status == BAD_INPUT
                assert (values == -77).all()
            assert before is None or (robot.state == before).all()
    p, R = robot.home
    far = robot.motors(p + 50 * robot.robot.size, R)
    assert far.status in (OUT_OF_REACH, LOOPS_OPEN)
    assert (far.values == -77).all()
    status, position, _ = robot.forward(np.full(robot.count, math.nan), p, R)
    assert status == BAD_INPUT
    assert (position == p).all()
    assert robot.at("speeds", p, R, robot.count, np.full(6, math.nan)).status == BAD_INPUT
    if robot.robot.complete:
        tilted = turn_about(np.array([1.0, 0, 0] if name == "delta" else [0, 0, 1.0]), 0.1) @ R
        assert robot.motors(p, tilted).status == LOOPS_OPEN


def test_coordinates_of_linuxcnc_follow_from_the_table_of_the_controller() -> None:
    # LinuxCNC's rotarydeltakins with radii 10 and 6, arm 10, rod 14 (its joints are 0 for a horizontal arm).
    robot = rotary()
    expected = {(0, 0, -10): [27.128862228231] * 3, (1, 0, -10): [27.396064246355, 21.250539432715, 33.161020614388]}
    for place, angles in expected.items():
        status, q = robot.motors(np.array(place, dtype=float), np.eye(3))
        assert status == OK
        np.testing.assert_allclose(q, angles, atol=1e-11)
    # Klipper's rotary delta: up is positive, and radians.
    klipper = rotary('[controller]\nlength = "mm"\nzero = -20\nsign = -1\n')
    x, y, z = 0.0, 1.0, -10.0
    np.testing.assert_allclose(
        klipper.motors(np.array([x, y, z]), np.eye(3)).values, -np.radians(expected[(1, 0, -10)]), atol=1e-13
    )


def test_carriages_of_a_linear_delta_are_those_of_linuxcnc(tmp_path: Path) -> None:
    # LinuxCNC's lineardeltakins with its default radius 130.25 and rod 269; its x axis is the negative y axis here.
    saved(tmp_path / "linear.toml", DELTA)
    case = 'units.length = "mm"\nrobot.file = "linear.toml"\ncontroller.rpy = [0, 0, -90]\n'
    case += "robot.parameters = { R = 130.25, rp = 33, L = 269, w = 50 }\n"
    file = str(saved(tmp_path / "case.toml", case))
    robot = Library(read_robot_case(file).case)
    expected = {(0, 0, 0): [235.363415806280] * 3, (10, 20, 5): [250.165122927385, 228.684915278482, 238.552849858139]}
    for place, heights in expected.items():
        status, q = robot.motors(np.array(place, dtype=float), np.eye(3))
        assert status == OK
        np.testing.assert_allclose(q, heights, atol=1e-11)
        status, position, _ = robot.forward(np.array(heights), *robot.home)
        assert status == OK
        np.testing.assert_allclose(position, place, atol=1e-9)


#: Robots as modules of LinuxCNC control them: straight legs, cranks, and three translations.
IN_MODULES = ("hexapod", "6-rss", "delta", "orthoglide")


@pytest.mark.parametrize(("name", "single"), [*((each, False) for each in IN_MODULES), ("6-rss", True)])
def test_all_sources_in_one_file_have_small_stack_frames(name: str, single: bool, tmp_path: Path) -> None:
    case = typical_case(name)
    files = generate_kinematics(case, "", single=single)
    for file, text in files.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    stem = next(file for file in files if file.endswith("-kinematics.c"))[:-2]
    texts = [f'#include "{stem}{end}.c"\n' for end in ("", "-casadi", "-newton")]
    (tmp_path / "whole.c").write_text("".join(texts), encoding="utf-8")
    # The flag of LinuxCNC's build.
    run(COMPILERS[0], *STRICT.split(), "-O2", "-Wframe-larger-than=2560", "-c", "whole.c", where=tmp_path)
    # A library of mathematics that the controller names.
    (tmp_path / "mathematics.h").write_text("#include <math.h>\n#define GIVEN 1\n", encoding="utf-8")
    texts.append('#ifndef GIVEN\n#error "the header was not included"\n#endif\n')
    (tmp_path / "whole.c").write_text("".join(texts), encoding="utf-8")
    given = f'-D{kinematics_prefix(case.name).upper()}_MATH="mathematics.h"'
    run(COMPILERS[0], *STRICT.split(), given, "-fsyntax-only", "whole.c", where=tmp_path)


def test_names_of_solver_and_kinematics_differ(tmp_path: Path) -> None:
    """In one folder, and of cases whose names continue each other."""
    case = load_case("paper-4.1-helical")
    names: list[str] = []
    for title in ("kinematics", "kinematics kinematics"):
        folder = tmp_path / title
        folder.mkdir()
        files = generate_c(replace(case, name=title))
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        made(folder, "CFLAGS=-std=c99", "library")
        objects = sorted(each.name for each in folder.glob("*.o"))
        assert any("-kinematics-newton" in each for each in objects)
        shown = run("nm", "--defined-only", "--extern-only", *objects, where=folder)
        names += [line.split()[-1] for line in shown.splitlines() if len(line.split()) == 3]
        both = "".join(f'#include "{each}"\n' for each in files if each.endswith(".h"))
        (folder / "both.c").write_text(f"{both}int main(void) {{ return 0; }}\n", encoding="utf-8")
        run(COMPILERS[0], *STRICT.split(), "-c", "both.c", where=folder)
    assert len(names) == len(set(names)) > 100
    assert {each.partition("_")[0] for each in names} == {"screwsynth", "kinematics"}


def test_a_turned_frame_and_other_units_keep_the_power_balance() -> None:
    robot = rotary(
        '[controller]\nlength = "mm"\nangle = "deg"\nsign = { "2" = -1 }\norigin = [0.001, 0.002, 0.003]\n'
        "rpy = [10, -20, 70]\n"
    )
    p, R = robot.home
    rng = np.random.default_rng(0)
    q = robot.motors(p, R).values
    np.testing.assert_allclose(q, 0.0, atol=1e-9)  # home
    twist, load = np.array([0, 0, 0, *rng.normal(size=3)]), rng.normal(size=6)
    load[:3] = 0
    dq = robot.at("speeds", p, R, 3, twist).values
    step = 1e-5
    ahead, behind = (robot.motors(p + sign * step * twist[3:], R).values for sign in (1, -1))
    np.testing.assert_allclose((ahead - behind) / (2 * step), dq, atol=1e-6)
    torques = robot.at("torques", p, R, 3, load).values
    assert torques @ np.radians(dq) == pytest.approx(-load @ twist, abs=1e-12)
    status, position, rotation = robot.forward(q + np.array([1.0, -2.0, 0.5]), p, R)
    assert status == OK
    np.testing.assert_allclose(robot.motors(position, rotation).values, q + np.array([1.0, -2.0, 0.5]), atol=1e-10)


def test_joint_coordinates_of_an_ankle_take_the_place_of_the_pose(cli: Run, tmp_path: Path) -> None:
    file, out = str(saved(tmp_path / "ankle.toml", ANKLE)), tmp_path / "c"
    assert "compiles and tests" in output_of(
        cli("codegen", file, "--kinematics", "--coordinates", "ankle", "--out", str(out))
    )
    made(out, "test")
    robot = Library(read_robot_case(file).case, coordinates="ankle")
    for k in range(60):
        c = np.array([0.35 * math.sin(1.3 * k), 0.25 * math.sin(0.7 * k + 1)])
        q, pose, back = np.zeros(2), [np.zeros(3), np.zeros(9)], np.zeros(2)
        assert robot.call("joint_motors", c, q) == OK
        assert robot.call("pose", c, *pose) == robot.call("joints", *pose, back) == OK
        np.testing.assert_allclose(back, c, atol=1e-14)
        R = turn_about(np.array([0, 1.0, 0]), c[0]) @ turn_about(np.array([1.0, 0, 0]), c[1])
        np.testing.assert_allclose(pose[1].reshape(3, 3), R, atol=1e-14)
        # The rods keep their lengths: an equation of its own for each motor.
        for angle, y, z, rod in zip(q, (-0.04, 0.04), (0.2, 0.28), (0.2, 0.28), strict=True):
            crank = np.array([-0.05 * math.cos(angle), y, z + 0.05 * math.sin(angle)])
            foot = np.array([0, 0, 0.02]) + R @ np.array([-0.05, y, -0.02])
            assert np.linalg.norm(crank - foot) == pytest.approx(rod, abs=1e-14)
        rates, step = np.zeros((2, 2)), 1e-6
        assert robot.call("joint_rates", c, rates) == OK
        for j in range(2):
            ends = [np.zeros(2), np.zeros(2)]
            for sign, end in zip((1, -1), ends, strict=True):
                robot.call("joint_motors", c + sign * step * np.eye(2)[j], end)
            np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step), rates[:, j], atol=1e-8)
        load, torques, speeds = np.array([0.3, -1.0]), np.zeros(2), np.array([0.7, 0.4])
        assert robot.call("joint_torques", c, load, torques) == OK
        assert torques @ (rates @ speeds) == pytest.approx(-load @ speeds, abs=1e-13)
        guess = np.zeros(2)
        assert robot.call("joint_forward", q, guess, np.zeros(1, np.int32)) == OK
        np.testing.assert_allclose(guess, c, atol=1e-9)
    error = refusal_of(cli("codegen", file, "--kinematics", "--coordinates", "foot", "--out", str(tmp_path / "d")))
    assert "--coordinates" in error
    assert "ankle" in error
    error = refusal_of(cli("codegen", file, "--kinematics", "--coordinates", "left", "--out", str(tmp_path / "d")))
    assert "type S" in error
    assert not (tmp_path / "d").exists()


def test_limits_have_the_margins_that_people_state() -> None:
    case = load_case("hexapod-linuxcnc")
    robot = Library(case)
    p, R = robot.poses(20, 0.1)
    header = next(text for file, text in robot.files.items() if file.endswith(".h"))
    count = int(re.search(r"_LIMITS (\d+)", header)[1])  # type: ignore[index]
    for k in range(len(p)):
        q = robot.motors(p[k], R[k]).values
        margins, violated = np.zeros(count), np.zeros(1, np.int32)
        pose = [np.ascontiguousarray(p[k]), np.ascontiguousarray(R[k]).reshape(9)]
        assert robot.call("limits", *pose, margins, violated) == OK
        limit = next(each for each in case.limits if each.name == "leg_length")
        expected = np.concatenate([[each - limit.min, limit.max - each] for each in q])
        np.testing.assert_allclose(np.sort(margins), np.sort(expected), atol=1e-11)
        assert violated[0] == (expected < 0).sum()


def axes_of(text: str) -> Array:
    """Return the column ``axis`` of the table of actuators in a generated README."""
    rows = re.findall(r"^\| \d+: .*\| \((.*)\) \|$", text, flags=re.MULTILINE)
    return np.array([[float(each) for each in row.split(",")] for row in rows])


def test_axes_of_actuators_are_those_of_the_robot_file() -> None:
    # 6-rss: the axis of a servo points outwards, along B.
    outward = [[math.cos(a), math.sin(a), 0.0] for a in np.radians([-30, 90, 210, 30, 150, 270])]
    files = generate_kinematics(typical_case("6-rss"), "")
    np.testing.assert_allclose(axes_of(files["README.md"]), outward, atol=5e-5)
    # Horns of servos 1 to 3 turn down, and those of 4 to 6 turn up: the motion of their ends for a small angle.
    ends = [turn_about(np.array([0, 0, 1.0]), a) @ [0.0, s, 0.0] for s in (-1, 1) for a in np.radians([0, 120, 240])]
    horns = [end - np.array(axis) * (end @ axis) for end, axis in zip(ends, outward, strict=True)]
    assert (
        np.sign([np.cross(a, horn)[2] for a, horn in zip(outward, horns, strict=True)]).tolist() == [-1] * 3 + [1] * 3
    )
    # The remedy of servo-angles.md, in a frame that is turned, and with joints that slide.
    senses = Controller(sign={"1": -1.0, "2": -1.0, "3": -1.0}, rpy=(0.0, 0.0, math.pi / 2))
    text = generate_kinematics(replace(typical_case("6-rss"), controller=senses), "")["README.md"]
    turned = [[y * s, -x * s, 0.0] for (x, y, _), s in zip(outward, [-1, -1, -1, 1, 1, 1], strict=True)]
    np.testing.assert_allclose(axes_of(text), turned, atol=5e-5)
    assert (axes_of(generate_kinematics(typical_case("orthoglide"), "")["README.md"]) == np.eye(3)).all()
    # Motors with couplings alone, and legs, which have no axes.
    expected = [[0, 1, 0], [0, 1, 0], [0, 0, 1]]
    assert axes_of(generate_kinematics(typical_case("differential-waist"), "")["README.md"]).tolist() == expected
    assert "axis" not in generate_kinematics(typical_case("hexapod"), "")["README.md"].partition("Twist")[0]


def test_rounding_at_home_is_printed_as_zero() -> None:
    files = generate_kinematics(typical_case("6-rss"), "")
    header = next(text for name, text in files.items() if name.endswith(".h"))
    assert re.findall(r"angle in rad, (.*) at home", header) == ["0"] * 6
    assert "e-" not in files["README.md"].partition("Actuators")[2].partition("Twist")[0]
    assert files["README.md"].endswith("index |\n")


def test_servos_of_6_rss_turn_up_with_the_remedy_of_the_page() -> None:
    signs = tomllib.loads(re.search(r"sign = \{.*\}", PAGE)[0])["sign"]  # type: ignore[index]
    case = typical_case("6-rss")
    for controller, up in ((Controller(), [-1, -1, -1, 1, 1, 1]), (Controller(sign=signs), [1] * 6)):
        robot = Library(replace(case, controller=controller))
        p, R = robot.home
        status, q = robot.motors(p + np.array([0, 0, 0.1 * robot.robot.size]), R)
        assert status == OK
        assert np.sign(q).tolist() == up


def test_the_fragment_of_servo_angles_compiles_and_refuses_what_is_out_of_range(tmp_path: Path) -> None:
    (case,) = re.findall(r"<!-- file: rig.toml -->\n```toml\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
    (fragment,) = re.findall(r"^```c\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
    files = generate_kinematics(case_of(case, "rig"), case)
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    # Within reach and range, within reach but out of the servos' range, and out of reach.
    for height, expected in ((648, "0 0 ok"), (884, "0 0 ok"), (886, "0 1 refused"), (9000, "1 0 refused")):
        body = fragment.replace("{30, 0, 648}", f"{{0, 0, {height}}}").replace("{0, 5, 0}", "{0, 0, 0}")
        assert body.count(f"{{0, 0, {height}}}") == 1
        body = re.sub(r"if \((.*)\) \{\n", r"if (\1) {\n    refused = 1;\n", body, count=1)
        program = (
            '#include <stdio.h>\n#include "screwsynth_rig-kinematics.h"\nint main(void) {\nint refused = 0;\n' + body
            + 'printf("%d %d %s\\n", status != 0, violated > 0, refused ? "refused" : "ok");\n'
            "(void)angles;\nreturn 0; }\n"
        )  # fmt: skip
        (tmp_path / "main.c").write_text(program, encoding="utf-8")
        sources = [name for name in files if name.endswith(".c") and "kinematics" in name]
        run(COMPILERS[0], *STRICT.split(), "main.c", *sources, "-lm", "-o", "main", where=tmp_path)
        assert run("./main", where=tmp_path).strip() == expected


@pytest.mark.parametrize("scale", [1e-6, 1e5])
def test_verdicts_do_not_depend_on_the_unit_of_length(scale: float) -> None:
    small = library("6-rss")
    model, own = small.case.model, small.case.parameters
    sizes = {name: values[0] if "half" in name else values[0] * scale for name, values in own.items()}
    case = Case(
        model, sizes, [scale * each for each in model.home], small.case.tasks, name="scaled", units=small.case.units
    )
    robot = Library(case)
    p, R = small.poses(60, 0.3, seed=6)
    for k in range(len(p)):
        one, other = small.motors(p[k], R[k]), robot.motors(scale * p[k], R[k])
        assert one.status == other.status
        if one.status == OK:
            np.testing.assert_allclose(one.values, other.values, atol=1e-9)
            here, there = small.forward(one.values, *small.home), robot.forward(one.values, *robot.home)
            assert here[0] == there[0]


def test_single_precision_is_measured_by_the_self_test(cli: Run, tmp_path: Path) -> None:
    output_of(cli("codegen", "6-rss", "--kinematics", "--single", "--out", str(tmp_path / "c")))
    shown = made(tmp_path / "c", "test")
    assert "single precision: motors" in shown
    assert ", 0 failed" in shown
    assert float(shown.split("motors ")[1].split()[0]) < 1e-5  # radians


def test_a_task_is_not_needed(cli: Run, tmp_path: Path) -> None:
    text = ROTARY.partition("[[task]]")[0] + CONTROLLER
    file = str(saved(tmp_path / "rotary.toml", text))
    output_of(cli("codegen", file, "--kinematics", "--out", str(tmp_path / "c")))
    assert (tmp_path / "c" / "case.toml").read_text(encoding="utf-8") == text
    header = (tmp_path / "c" / "screwsynth_rotary-kinematics.h").read_text(encoding="utf-8")
    assert "turned by roll, pitch and yaw of 0 deg, 0 deg, 90 deg" in header
    assert "angle in deg, 20 at home" in header
    # A free dimension, options of the other kind of folder, and a file that is none.
    freed = ROTARY.replace("rod = 0.014", "rod = { min = 0.01, max = 0.02 }")
    free = str(saved(tmp_path / "free.toml", freed))
    assert "robot.parameters.rod" in refusal_of(cli("codegen", free, "--kinematics", "--out", str(tmp_path / "d")))
    assert "--kinematics" in refusal_of(cli("codegen", file, "--single", "--out", str(tmp_path / "d")))
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ("sign = 2", "controller.sign = 2.0: must be 1 or -1"),
        ('sign = { "7" = 1 }', "controller.sign.7: is no actuator"),
        ('length = "furlong"', 'controller.length = "furlong": must be one of'),
        ('angle = "grad"', "controller.angle"),
        ("rpy = [0, 0]", "controller.rpy"),
        ("zero = inf", "controller.zero"),
        ("offset = [0, 0, 0]", "controller.offset"),
    ],
)
def test_conventions_that_mean_nothing_are_refused(table: str, fault: str) -> None:
    with pytest.raises(CaseError, match=fault.replace(".", r"\.").replace("(", r"\(")):
        case_of(f"{ROTARY}[controller]\n{table}\n")


def test_conventions_are_written_and_read_again() -> None:
    table = 'length = "mm"\nangle = "deg"\nzero = { "1" = 20, "3" = -5 }\nsign = { "2" = -1 }\n'
    table += "origin = [0.1, 0, 0]\nrpy = [0, 0, 90]\n"
    case = case_of(f"{ROTARY}[controller]\n{table}")
    again = case_of(case_text(case))
    assert again.controller == case.controller
    assert case.controller.zero_of("1") == math.radians(20)
    assert (case.controller.sign_of("2"), case.controller.sign_of("1")) == (-1, 1)
    assert case_of(ROTARY).controller == Controller()
    assert "controller" not in case_text(case_of(ROTARY))


#: Frequencies and phases of a moving platform, for x, y, z, roll, pitch, yaw.
FREQUENCIES, PHASES = np.array([2.1, 3.3, 1.7, 2.9, 1.3, 3.7]), np.arange(6.0)
MOVING = ("stewart-gough", "6-rss", "6-rus", "delta", "3-rps", "tricept", "orthoglide", "planar-3-rrr")


@pytest.mark.parametrize(
    ("name", "count"),
    [("6-rss", 2000), ("3-rrs", 2000), *(pytest.param(each, 100_000, marks=pytest.mark.soak) for each in MOVING)],
)
def test_forward_kinematics_follows_a_moving_platform_in_its_assembly_mode(name: str, count: int) -> None:
    robot = library(name)
    home = robot.home
    robot.start()
    position, rotation = home
    # One state follows the true pose, and one the pose that forward kinematics returns.
    states = [None if robot.state is None else robot.state.copy() for _ in range(2)]
    largest = 0.03 * np.isin(range(6), robot.robot.coordinates)
    for k in range(count):
        wave = largest * (np.sin(FREQUENCIES * k * 1e-3 + PHASES) - np.sin(PHASES))
        at = home[0] + robot.robot.size * wave[:3]
        turn = matrix_of_rpy(*(2 * wave[3:])) @ home[1]
        robot.state = states[0]
        if robot.robot.complete:
            status, at, turn = robot.complete(at, turn)
            assert status == OK
        status, q = robot.motors(at, turn)
        assert status == OK
        robot.state = states[1]
        status, position, rotation = robot.forward(q, position, rotation)
        assert status == OK
        assert np.abs(position - at).max() <= 1e-8 * robot.robot.size
        assert np.abs(rotation - turn).max() <= 1e-8

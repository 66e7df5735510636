"""Kinematics in the form of controllers: their own numbers, and builds against headers of ours.

Expected numbers are those of LinuxCNC's modules, or of geometry by bisection, and never those of the formulas in
`nlp/embedding/targets`.
"""

import math
import re
import shutil
import subprocess
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, refusal_of, turn_about
from controller_programs import HEADERS, Module, Stepper, klipper, tool_head
from generated import needs_compiler, run
from kinematics_library import typical_case
from position_cases import DELTA
from test_kinematics_c import ANKLE, ROTARY, case_of

from screwsynth.models.statics import driven_joints
from screwsynth.nlp import Case, CaseError, InputError, inverse
from screwsynth.nlp.case.controllertable import ControllerTable
from screwsynth.nlp.case.robotcase import read_robot_case
from screwsynth.nlp.embedding.kinematics import Kinematics, matrix_of_rpy
from screwsynth.nlp.embedding.targets import TARGETS, Request, export_kinematics
from screwsynth.nlp.units import Units

pytestmark = needs_compiler

#: Functions that the mathematics of LinuxCNC's real-time kernel declares.
LIBM = {
    "sin", "cos", "tan", "sqrt", "fabs", "atan", "atan2", "asin", "acos", "exp", "pow", "fmin", "fmax", "fmod", "round",
    "ceil", "floor",
}  # fmt: skip
#: Poses of rotarydeltakins and lineardeltakins with their defaults, and LinuxCNC's joints.
ROTARY_JOINTS = (
    ((0, 0, -10), (27.128862228231,) * 3),
    ((1, 0, -10), (27.396064246355, 21.250539432715, 33.161020614388)),
)
LINEAR_JOINTS = (
    ((0, 0, 0), (235.363415806280,) * 3),
    ((10, 20, 5), (250.165122927385, 228.684915278482, 238.552849858139)),
)
#: The same rotary Delta with millimetres as the case's unit.
IN_MM = re.sub(r"0\.(\d{3})", lambda found: str(int(found[1])), ROTARY).replace('"m"', '"mm"')


def robot_case(text: str, folder: Path, name: str = "robot") -> Case:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return read_robot_case(str(path)).case


@cache
def rotary(table: str = "") -> Case:
    return case_of(ROTARY + table, "rotary")


@pytest.fixture(scope="module")
def linear(tmp_path_factory: pytest.TempPathFactory) -> Case:
    return robot_case('length_unit = "mm"' + DELTA, tmp_path_factory.mktemp("linear"), "linear")


def table_of(files: dict[str, str]) -> str:
    """Return the table of conventions in a description."""
    found = re.search(r"```toml\n(.*?)```", files["README.md"], re.DOTALL)
    assert found is not None
    return found[1]


def with_table(case: Case, table: str) -> Kinematics:
    """Return the kinematics of a case with a table of conventions."""
    assert case.model.actuators
    own = ControllerTable.model_validate(tomllib.loads(table)["controller"]).read(case.model, case.units)
    own.check(driven_joints(case.model), case.units)
    return Kinematics(replace(case, controller=own))


def joints_at(robot: Kinematics, positions: Array) -> Array:
    """Return the coordinates of a controller at positions in its frame, by inverse kinematics."""
    poses = np.hstack([np.tile(robot.home[:9], (len(positions), 1)), positions])
    found = inverse(robot.case, *robot.transform.world_poses(poses))
    assert found.closed.all()
    return robot.transform.coordinates(found.coordinates)


def setp(files: dict[str, str]) -> dict[str, float]:
    lines = [line.split() for line in files["kinematics.hal"].splitlines() if line.startswith("setp")]
    return {name: float(value) for _, name, value in lines}


def crank_down(p: Array, angle: float, radius: float, arm: float, rod: float) -> float:
    """Return the angle below the horizontal of a Delta's arm, degrees, by bisection of the length of its rods."""
    outward = np.array([math.cos(angle), math.sin(angle), 0.0])

    def gap(down: float) -> float:
        knee = outward * (radius + arm * math.cos(down)) - [0, 0, arm * math.sin(down)]
        return float(np.linalg.norm(p - knee)) - rod

    # The knee is outside: the rods get shorter as the arm goes down from this angle.
    low, high = -1.5, math.atan2(-p[2], p[:2] @ outward[:2] - radius)
    assert gap(low) > 0 > gap(high)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap(middle) > 0 else (low, middle)
    return math.degrees(low)


def test_rotary_delta_for_linuxcnc() -> None:
    files = export_kinematics(rotary(), "", "linuxcnc")
    own = setp(files)
    radius = own["rotarydeltakins.platformradius"] - own["rotarydeltakins.footradius"]
    assert (radius, own["rotarydeltakins.thighlength"], own["rotarydeltakins.shinlength"]) == (4, 10, 14)
    ini = files["kinematics.ini"]
    assert "KINEMATICS = rotarydeltakins\nJOINTS = 3" in ini
    assert ini.count("TYPE = ANGULAR") == ini.count("\nHOME = 20\n") == 3
    robot = with_table(rotary(), table_of(files))
    for position, joints in ROTARY_JOINTS:
        assert joints_at(robot, np.array([position], float))[0] == pytest.approx(joints, abs=2e-12)


def test_linear_delta_for_linuxcnc(linear: Case) -> None:
    files = export_kinematics(linear, "", "linuxcnc")
    assert setp(files) == {"lineardeltakins.R": 130.25, "lineardeltakins.L": 269}
    robot = with_table(linear, table_of(files))
    for position, joints in LINEAR_JOINTS:
        assert joints_at(robot, np.array([position], float))[0] == pytest.approx(joints, abs=2e-12)


@pytest.mark.parametrize("name", ["hexapod-linuxcnc", "6-ups"])
def test_legs_for_linuxcnc(name: str) -> None:
    """The joints of the configuration have the distances that inverse kinematics returns."""
    case = read_robot_case(name).case
    files = export_kinematics(case, "", "linuxcnc")
    own = setp(files)
    base, platform = (
        np.array([[own[f"genhexkins.{plate}.{k}.{axis}"] for axis in "xyz"] for k in range(6)])
        for plate in ("base", "platform")
    )
    scale = {"m": 1000.0, "mm": 1.0, "in": 25.4}[case.units.length]
    p, R = scale * np.array(Kinematics(case).start[9:12]) + [5.0, -7.0, 3.0], matrix_of_rpy(0.1, -0.05, 0.2)
    found = inverse(case, p[None] / scale, R[None])
    lengths = np.linalg.norm(p + platform @ R.T - base, axis=1)
    home = [float(each) for each in re.findall(r"\nHOME = (\S+)\n", files["kinematics.ini"])]
    if name == "6-ups":
        lengths -= home  # the coordinates of a robot file count from home
    # Values at home have nine digits.
    assert scale * found.coordinates[0] == pytest.approx(lengths, abs=1e-8 * max(home))
    if name == "hexapod-linuxcnc":
        assert files["kinematics.ini"].count("MIN_LIMIT = 431.8\nMAX_LIMIT = 1092.2") == 6


def test_pentapod_for_linuxcnc() -> None:
    """The shipped pentapod has LinuxCNC's own dimensions, which the configuration returns; the lengths follow."""
    case = read_robot_case("pentapod").case
    given = {name: float(np.ravel(value)[0]) for name, value in case.parameters.items()}
    files = export_kinematics(case, "", "linuxcnc")
    own = setp(files)
    base = np.array([[own[f"pentakins.base.{k}.{axis}"] for axis in "xyz"] for k in range(5)])
    rings = np.array([[own[f"pentakins.effector.{k}.{axis}"] for axis in "rz"] for k in range(5)])
    expected = [[given[f"base_{k}_x"], given[f"base_{k}_y"], given["base_z"]] for k in range(5)]
    assert base == pytest.approx(np.array(expected), abs=1e-8)
    expected = [[given["effector_r"], given[f"effector_{k}_z"]] for k in range(5)]
    assert rings - rings[0] * [0, 1] == pytest.approx(np.array(expected) - np.array(expected[0]) * [0, 1], abs=1e-8)
    assert "COORDINATES = XYZAB\n" in files["kinematics.ini"]
    robot = with_table(case, table_of(files))
    p, R = robot.home[9:12] + np.array([20.0, -30.0, 10.0]), matrix_of_rpy(0.1, -0.2, 0.0)
    seen = (base - p) @ R
    lengths = [math.hypot(math.hypot(x, y) - r, z - h) for (x, y, z), (r, h) in zip(seen, rings, strict=True)]
    at = inverse(robot.case, p[None], R[None])
    assert robot.transform.coordinates(at.coordinates)[0] == pytest.approx(lengths, rel=1e-9)


def test_shipped_printers_have_the_dimensions_of_their_source() -> None:
    """Klipper's example files, by whose numbers the robots are shipped."""
    own = sections(export_kinematics(read_robot_case("linear-delta").case, "", "klipper")["printer.cfg"])
    assert (own["printer"]["delta_radius"], own["stepper_b"]["arm_length"]) == ("174.75", "333")
    own = sections(export_kinematics(read_robot_case("rotary-delta").case, "", "klipper")["printer.cfg"])
    assert (own["printer"]["shoulder_radius"], own["printer"]["shoulder_height"]) == ("33.9", "412.9")
    assert (own["stepper_c"]["upper_arm_length"], own["stepper_c"]["lower_arm_length"]) == ("170", "320")


def sections(text: str) -> dict[str, dict[str, str]]:
    """Return the values of a printer.cfg by section."""
    found: dict[str, dict[str, str]] = {}
    for line in text.splitlines():
        if line.startswith("["):
            found[line.strip("[]")] = {}
        elif line and not line.startswith("#"):
            key, _, value = line.partition(": ")
            found[list(found)[-1]][key] = value
    return found


def test_rotary_delta_for_klipper() -> None:
    """Klipper's numbers are minus those of LinuxCNC; its frame has the height that the case states."""
    case = rotary("[controller]\norigin = [0, 0, -0.02]\n")
    files = export_kinematics(case, "", "klipper")
    own = sections(files["printer.cfg"])
    assert own["printer"] == {"kinematics": "rotary_delta", "shoulder_radius": "4", "shoulder_height": "20"}
    robot = with_table(case, table_of(files))
    for k, letter in enumerate("abc"):
        arm = own[f"stepper_{letter}"]
        assert arm == {"angle": str(120 * k), "upper_arm_length": "10", "lower_arm_length": "14"}
    # LinuxCNC (x, y) is (y, -x) of the case.
    for (x, y, z), joints in ROTARY_JOINTS:
        found = np.degrees(joints_at(robot, np.array([[-y, x, z + 20.0]])))[0]
        assert found == pytest.approx(-np.array(joints), abs=2e-12)


def test_linear_delta_for_klipper_marlin_and_reprapfirmware(linear: Case) -> None:
    own = sections(export_kinematics(linear, "", "klipper")["printer.cfg"])
    assert own["printer"] == {"kinematics": "delta", "delta_radius": "130.25"}
    assert [own[f"stepper_{each}"] for each in "abc"] == [
        {"angle": str(angle), "arm_length": "269"} for angle in (0, 120, 240)
    ]
    marlin = export_kinematics(linear, "", "marlin")
    assert "\nM665 L269 R130.25 X0 Y0 Z0\nM666 X0 Y0 Z0\n" in marlin["marlin.gcode"]
    reprap = export_kinematics(linear, "", "reprapfirmware")
    assert "\nM665 L269 R130.25 X0 Y0 Z0\n" in reprap["config.g"]
    # Towers X, Y, Z are at 210, 330 and 90 degrees of the firmware's frame.
    for files in (marlin, reprap):
        robot = with_table(linear, table_of(files))
        p = np.array([20.0, -30.0, 4.0])
        towers = [130.25 * np.array([math.cos(a), math.sin(a)]) for a in np.radians([210, 330, 90])]
        expected = [p[2] + math.sqrt(269**2 - np.sum((p[:2] - each) ** 2)) for each in towers]
        assert joints_at(robot, p[None])[0] == pytest.approx(expected, abs=1e-9)


def test_rotary_delta_for_reprapfirmware() -> None:
    files = export_kinematics(rotary("[controller]\norigin = [0, 0, -0.02]\n"), "", "reprapfirmware")
    assert "\nM669 K10 U10:10:10 L14:14:14 R4 H20:20:20 X0 Y0 Z0\n" in files["config.g"]
    robot = with_table(rotary(), table_of(files))
    p = np.array([1.0, -2.0, 9.0])
    angles = np.radians([-150, -30, 90])
    expected = [-crank_down(p - [0, 0, 20], each, 4, 10, 14) for each in angles]
    assert joints_at(robot, p[None])[0] == pytest.approx(expected, abs=1e-9)


def test_the_description_for_klipper_names_settings_of_a_printer_in_use(linear: Case) -> None:
    text = export_kinematics(linear, "", "klipper")["README.md"]
    assert "Klipper's defaults are 210, 330, 90." in text
    assert "State `print_radius`\n  yourself" in text
    text = export_kinematics(rotary("[controller]\norigin = [0, 0, -0.02]\n"), "", "klipper")["README.md"]
    assert "print_radius" not in text
    assert "Klipper's defaults are 30, 150, 270." in text


def test_limits_become_those_of_joints() -> None:
    text = ROTARY + "[limits.actuator_angle]\nmin = -30\nmax = 50\n"
    files = export_kinematics(case_of(text, "limited"), "", "linuxcnc")
    assert files["kinematics.ini"].count("MIN_LIMIT = -10\nMAX_LIMIT = 70\n") == 3
    files = export_kinematics(case_of(text, "limited"), "", "reprapfirmware")
    assert " A-70:10 " in files["config.g"]


def delta_text(angles: tuple[float, ...], more: tuple[float, ...], unit: str) -> str:
    """Return the robot file of a rotary Delta with limbs at angles, and knees that are farther outwards."""
    text = f"""
name = "delta"
length_unit = "{unit}"
home = [0, 0, "h"]
[dimensions]
rb = {{ typical = 10 }}
rp = {{ typical = 6 }}
arm = {{ typical = 10 }}
rod = {{ typical = 14 }}
w = {{ typical = 2 }}
tilt = {{ kind = "angle", typical = 20 }}
[derived]
out = "rb + arm*cos(tilt)"
h = "-arm*sin(tilt) - sqrt(rod^2 - (out - rp)^2)"
"""
    for k, (angle, own) in enumerate(zip(angles, more, strict=True)):
        text += f"""
[[limb]]
name = "arm {"abc"[k]}"
repeat = {{ angles = [{angle}] }}
points = {{ B = ["rb", 0, 0], E = ["out + {own!r}", 0, "-arm*sin(tilt)"], A = ["rp", 0, "h"] }}
joints = [{{ type = "R", at = "B", axis = "y", actuated = true }}]
branch = [
    {{ joints = [{{ type = "S", at = "E + w/2*y" }}, {{ type = "S", at = "A + w/2*y" }}] }},
    {{ joints = [{{ type = "S", at = "E - w/2*y" }}, {{ type = "S", at = "A - w/2*y" }}] }},
]
"""
    return text


@pytest.mark.parametrize("unit", ["um", "m"])
def test_kinds_do_not_depend_on_the_unit_of_length(unit: str, tmp_path: Path) -> None:
    """The same numbers in another unit: the same kind, and the same faults."""
    scale = {"um": 1e-3, "m": 1e3}[unit]
    case = robot_case(delta_text((0, 120, 240), (0, 1e-7, 0), unit), tmp_path)
    own = setp(export_kinematics(case, "", "linuxcnc"))
    assert own["rotarydeltakins.thighlength"] == pytest.approx(10 * scale, rel=1e-7)
    case = robot_case(delta_text((0, 120, 240), (0, 1e-3, 0), unit), tmp_path, "uneven")
    fault = rf'uneven.toml: --target = "linuxcnc": .* the arm of arm b1 has a length of 10\.0009\d* {unit}, but the'
    with pytest.raises(CaseError, match=fault):
        export_kinematics(case, "", "linuxcnc")
    # Klipper has an arm length for each limb.
    case = robot_case(delta_text((0, 120, 240), (0, 1e-3, 0), unit) + "\n", tmp_path, "uneven")
    with pytest.raises(CaseError, match="Klipper needs motor axes above the bed"):
        export_kinematics(case, "", "klipper")


def test_limbs_in_another_order_get_the_joints_of_the_controller(tmp_path: Path) -> None:
    """Limbs clockwise from above, the first at 50 degrees: joints are numbered anticlockwise."""
    case = robot_case(delta_text((50, -70, -190), (0, 0, 0), "mm"), tmp_path)
    files = export_kinematics(case, "", "linuxcnc")
    named = re.findall(r"\[JOINT_\d\]\n# actuator (.*)\n", files["kinematics.ini"])
    assert named == ["arm a1", "arm c1", "arm b1"]
    robot = with_table(case, table_of(files))
    for position, joints in ROTARY_JOINTS:
        found = joints_at(robot, np.array([position], float))[0]
        assert found[[0, 2, 1]] == pytest.approx(joints, abs=2e-12)


@pytest.mark.parametrize(
    ("name", "target", "fault"),
    [
        ("6-rss", "linuxcnc", "the robot has 0 straight legs and 6 actuators"),
        ("orthoglide", "linuxcnc", r"the rail of 1 is inclined by 90 deg, but the rails of a Delta are vertical"),
        ("3-rrs", "klipper", "the platform rotates by|the platform has 3 degrees"),
        ("delta", "marlin", "the robot has arms that turn; arduino"),
        ("delta", "klipper", "its motor axes are at height 0 mm, but Klipper needs motor axes above the bed"),
        ("3-rrs", "klipper-patch", "degrees of freedom|this platform turns"),
        ("hexapod", "klipper-patch", "this one has 6 degrees of freedom and 6 motors"),
        ("five-bar", "reprapfirmware", "2 degrees of freedom instead of 3"),
        ("three-upu", "ros2", "degrees of freedom|as many actuators as joints|forward kinematics"),
    ],
)
def test_robots_of_other_kinds_are_refused(name: str, target: str, fault: str) -> None:
    with pytest.raises(CaseError, match=fault) as caught:
        export_kinematics(typical_case(name, units=Units(length="mm")), "", target)
    assert str(caught.value).count("\n") == 0


def test_a_parallelogram_is_a_delta_too() -> None:
    own = [
        setp(export_kinematics(read_robot_case(each).case, "", "linuxcnc")) for each in ("delta", "delta-parallelogram")
    ]
    assert (
        own[0]
        == own[1]
        == {
            "rotarydeltakins.platformradius": 120,
            "rotarydeltakins.thighlength": 524,
            "rotarydeltakins.shinlength": 1244,
            "rotarydeltakins.footradius": 0,
        }
    )


TABLE = "[controller]\nzero = 20\nrpy = [0, 0, 90]\n"


def test_module_of_linuxcnc(tmp_path: Path) -> None:
    """LinuxCNC's own numbers; out of reach and NaN leave the joints."""
    module = Module(rotary(TABLE), tmp_path)
    assert module.needed <= {*LIBM, "hal_init", "hal_ready", "hal_exit", "memcpy", "memset", "_GLOBAL_OFFSET_TABLE_"}
    assert module.loaded.kinematicsType() == 4
    for position, joints in ROTARY_JOINTS:
        status, found = module.inverse(*map(float, position))
        assert (status, found[3]) == (0, -77.0)
        assert found[:3] == pytest.approx(joints, abs=2e-12)
        status, pose = module.forward(found, 0.0, 0.0, -9.0)
        assert status == 0
        assert pose == pytest.approx([*position, 0, 0, 0], abs=1e-9)
    for words in ((0.0, 0.0, -100.0), (math.nan, 0.0, -10.0), (0.0, math.inf, -10.0)):
        status, found = module.inverse(*words)
        assert status < 0
        assert (found == -77.0).all()
    status, pose = module.forward(np.array([math.nan, 0, 0]), 0.0, 0.0, -9.0)
    assert status < 0
    assert pose.tolist() == [0, 0, -9, 0, 0, 0]


@pytest.mark.parametrize("name", ["6-rss", "hexapod", "3-rrs"])
def test_module_of_linuxcnc_with_rotations(name: str, tmp_path: Path) -> None:
    """Joints are those of inverse kinematics; the Jacobian is their derivative by the words of the pose."""
    case = typical_case(name, units=Units(length="mm", angle="rad"))
    module, robot = Module(case, tmp_path), Kinematics(case)
    assert module.needed <= {*LIBM, "hal_init", "hal_ready", "hal_exit", "memcpy", "memset", "_GLOBAL_OFFSET_TABLE_"}
    rng, free = np.random.default_rng(2), np.isin(range(6), robot.coordinates)
    home = np.concatenate([robot.start[9:12], np.zeros(3)])
    degree = math.pi / 180
    unit = np.array([robot.size] * 3 + [1 / degree] * 3)
    turned = np.array([degree if each.dimension.value == "angle" else 1.0 for each in robot.drives])
    for _ in range(20):
        words = home + 0.04 * free * unit * rng.uniform(-1, 1, 6)
        status, joints = module.inverse(*words)
        found = inverse(case, words[None, :3], matrix_of_rpy(*(words[3:] * degree))[None])
        assert (status == 0) == found.closed[0]
        assert status == 0
        assert joints[: module.count] * turned == pytest.approx(found.coordinates[0], rel=1e-9, abs=1e-9)
        status, pose = module.forward(joints, *home)
        assert status == 0
        assert (pose - words)[free] / unit[free] == pytest.approx(0, abs=1e-9)
        status, rates = module.jacobian(*words)
        assert status == 0
        assert (rates[module.count :] == 0).all()
        assert (rates[:, 6:] == 0).all()
        for k in robot.coordinates:
            step = 1e-5 * unit[k] * np.eye(6)[k]
            ends = [module.inverse(*(words + sign * step))[1][: module.count] for sign in (1, -1)]
            slope = (ends[0] - ends[1]) / (2e-5 * unit[k])
            size = np.abs(rates[: module.count]).max()
            assert rates[: module.count, k] == pytest.approx(slope, abs=1e-6 * size)


@pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
@pytest.mark.parametrize("name", ["rotary", "uneven"])
def test_step_generator_of_klipper(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Callback and class: coordinates of inverse kinematics; out of reach, the last value stays and moves are refused.

    With a longer arm, passive joints have no closed form.
    """
    uneven = robot_case(delta_text((0, 120, 240), (0, 0.5, 0), "mm"), tmp_path)
    case = uneven if name == "uneven" else case_of(IN_MM, "rotary")
    assert (Kinematics(case).unknowns > 0) == (name == "uneven")
    library, module, name = klipper(case, tmp_path, monkeypatch)
    home = Kinematics(case).home[9:12]
    positions = home + np.random.default_rng(0).uniform(-3, 3, (20, 3))
    found = inverse(case, positions)
    assert found.closed.all()
    for motor in range(3):
        address = getattr(library, f"{name}_stepper_alloc")(motor)
        stepper = Stepper.from_address(address)
        assert stepper.flags == 7

        def at(point: Array, time: float = 0.0) -> float:
            move = np.array([*point, 1.0, 0.0, 0.0])
            return float(stepper.callback(address, move.ctypes.data, time))  # noqa: B023 - called at once

        for p, q in zip(positions, found.coordinates, strict=True):
            assert at(p) == pytest.approx(q[motor], abs=1e-10)
        line = np.array([at(home + np.array([-3, 2, 1]), 0.003 * k) for k in range(2001)])
        assert np.abs(np.diff(line)).max() < 3 * np.abs(np.diff(line)).mean() < 3 * 0.003
        last = at(positions[-1])
        for point in (np.array([0, 0, -100.0]), np.array([math.nan, 0, 0])):
            assert at(point) == last
    kinematics = module.load_kinematics(*tool_head(home))
    steppers = dict(zip(("stepper_a", "stepper_b", "stepper_c"), found.coordinates[0], strict=True))
    assert kinematics.calc_position(steppers) == pytest.approx(positions[0].tolist(), abs=1e-9)

    def move(start: Array, end: Array) -> Any:  # noqa: ANN401 - Klipper's class, which is not installed
        axes = (end - start).tolist()
        return SimpleNamespace(
            start_pos=start, end_pos=end, axes_d=axes, move_d=float(np.linalg.norm(axes)), accel=1.0,
            move_error=ValueError, limit_speed=lambda *_: None,
        )  # fmt: skip

    with pytest.raises(ValueError, match="home first"):
        kinematics.check_move(move(home, home))
    kinematics.set_position(home, (0, 1, 2))
    kinematics.check_move(move(home, positions[0]))
    for end in ([0, 0, -100.0], [14.0, 0, home[2]], [math.nan, 0, 0]):
        with pytest.raises(ValueError, match="reach"):
            kinematics.check_move(move(home, np.array(end)))
    assert kinematics.get_status(0.0)["homed_axes"] == "xyz"


@pytest.mark.skipif(not shutil.which("g++"), reason="g++ is not installed")
@pytest.mark.parametrize("name", ["ankle", "delta", "3-rrs"])
def test_transmission_of_ros2_control(name: str, tmp_path: Path) -> None:
    """Power of joints = power of actuators, and back again, with names whose alphabetical order is the other one."""
    if name == "ankle":
        case = robot_case(ANKLE, tmp_path, "ankle")
        files = export_kinematics(case, "", "ros2", Request(coordinates="ankle"))
    else:
        case = read_robot_case(name).case
        files = export_kinematics(case, "", "ros2")
    order = {
        "ankle": "ankle first turns about y (pitch); ankle second turns about x (roll).\n  Without `--coordinates`",
        "delta": "in this order: x, y, z;",
        "3-rrs": "in this order: z, roll, pitch;",
    }
    assert order[name] in files["README.md"]
    robot = Kinematics(case)
    for file, text in files.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text, encoding="utf-8")
    roles = {
        kind: re.findall(rf'<{kind} name="[^"]*" role="([^"]*)"/>', files["transmission.urdf"])
        for kind in ("joint", "actuator")
    }
    package = re.search(r"<name>(.*)</name>", files["package.xml"])
    own_class = re.search(r'<class name="\w+/(\w+)"', files["ros2_control_plugins.xml"])
    assert package is not None
    assert own_class is not None
    at_home = [*robot.start[9:12], 0.0, 0.0, 0.0]
    scale = 1e-3 if case.units.length == "mm" else 1.0
    size = robot.size * scale
    home = [0.0, 0.0] if name == "ankle" else [at_home[k] * (scale if k < 3 else 1) for k in robot.coordinates]
    spread = [0.3, 0.3] if name == "ankle" else [0.05 * (size if k < 3 else 1) for k in robot.coordinates]
    names = {
        "PACKAGE": package[1],
        "COUNT": str(len(home)),
        "CLASS": own_class[1],
        "JOINTS": f"std::vector<std::string>({{{', '.join(f'{each!r}' for each in roles['joint'])}}})".replace(
            "'", '"'
        ),
        "ACTUATORS": f"std::vector<std::string>({{{', '.join(f'{each!r}' for each in roles['actuator'])}}})".replace(
            "'", '"'
        ),
        "HOME": ", ".join(map(repr, map(float, home))),
        "FARTHEST": "2.5" if name == "ankle" else "1e6",
        "SPREAD": ", ".join(map(repr, map(float, spread))),
    }
    text = re.sub(
        "|".join(names), lambda found: names[found[0]], (HEADERS / "ros2/driver.cpp").read_text(encoding="utf-8")
    )
    (tmp_path / "driver.cpp").write_text(text, encoding="utf-8")
    warnings = ["-O1", "-Wall", "-Wextra", "-Werror", f"-I{HEADERS / 'ros2'}", "-Iinclude", "-Isrc"]
    sources = [file for file in files if file.endswith(".c")]
    for source in sources:
        run("gcc", "-std=c99", *warnings, "-c", source, "-o", f"{Path(source).stem}.o", where=tmp_path)
    objects = [f"{Path(source).stem}.o" for source in sources]
    run(
        "g++",
        "-std=c++17",
        *warnings,
        "driver.cpp",
        "src/transmission.cpp",
        *objects,
        "-lm",
        "-o",
        "driver",
        where=tmp_path,
    )
    done = subprocess.run(["./driver"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    *rows, last = [list(map(float, line.split())) for line in done.stdout.splitlines()]
    power, back = last
    assert power < 1e-12
    assert back < 1e-8
    joints, motors = np.array(rows).T
    if name == "ankle":
        pitch, roll = joints
        R = turn_about(np.array([0.0, 1, 0]), pitch) @ turn_about(np.array([1.0, 0, 0]), roll)
        p = np.array([0, 0, 0.02]) - R @ np.array([0, 0, 0.02])
        assert motors == pytest.approx(inverse(case, p[None], R[None]).coordinates[0], abs=1e-12)
    elif name == "delta":
        assert motors == pytest.approx(inverse(case, joints[None]).coordinates[0], abs=1e-12)


@pytest.mark.skipif(not shutil.which("g++"), reason="g++ is not installed")
@pytest.mark.parametrize("single", [False, True])
def test_library_for_arduino(single: bool, tmp_path: Path) -> None:
    """The folder builds as Arduino does it, and its example prints the coordinates of inverse kinematics."""
    case = read_robot_case("6-rss").case
    files = export_kinematics(case, "", "arduino", Request(single=single))
    for file, text in files.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert {"library.json", "library.properties", "examples/motors/motors.ino"} <= set(files)
    warnings = ["-O1", "-Wall", "-Wextra", "-Werror", "-Isrc", f"-I{HEADERS / 'arduino'}"]
    sources = sorted(file for file in files if file.startswith("src/") and file.endswith(".c"))
    for source in sources:
        run("gcc", "-std=gnu11", *warnings, "-c", source, "-o", f"{Path(source).stem}.o", where=tmp_path)
    objects = [f"{Path(source).stem}.o" for source in sources]
    program = "#include <Arduino.h>\nTestSerial Serial;\nint main() { setup(); loop(); return 0; }\n"
    (tmp_path / "main.cpp").write_text(program, encoding="utf-8")
    sketch = ["-include", "Arduino.h", "-x", "c++", "-c", "examples/motors/motors.ino", "-o", "sketch.o"]
    run("g++", "-std=gnu++11", *warnings, *sketch, where=tmp_path)
    run("g++", *warnings, "main.cpp", "sketch.o", *objects, "-lm", "-o", "sketch", where=tmp_path)
    rows = np.array([list(map(float, line.split())) for line in run("./sketch", where=tmp_path).splitlines()])
    robot = Kinematics(case)
    positions = np.tile(robot.start[9:12], (11, 1))
    positions[:, 2] += 0.005 * np.arange(11) * robot.size
    found = inverse(case, positions)
    assert found.closed.all()
    assert rows == pytest.approx(found.coordinates, abs=1e-5 if single else 6e-7)
    refused = subprocess.run(
        ["gcc", "-fsyntax-only", "-x", "c", "-D__SIZEOF_DOUBLE__=4", next(f"src/{n}" for n in _headers(files))],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "needs a board whose double has 8 bytes" in refused.stderr


def _headers(files: dict[str, str]) -> list[str]:
    """Return the names of the headers that a sketch includes."""
    return re.findall(r"^includes=(.*)$", files["library.properties"], re.MULTILINE)


def test_every_description_says_what_is_not_checked() -> None:
    """Titles with control characters, ends of comments and line breaks get into no file as they are."""
    case = replace(rotary(), title="\x1b[31m red */ \n new")
    for target in set(TARGETS) - {"c", "marlin", "klipper"}:
        files = export_kinematics(case, "", target)
        assert not [name for name, content in files.items() if "\x1b" in content or "red */" in content]
        text = files["README.md"]
        for head in ("**Frame**", "**Zero and sense**", "**Units**", "**Not checked**", "**Proof**", "screwsynth path"):
            assert head in text, target


def test_command_line_of_targets(cli: Run, tmp_path: Path) -> None:
    out = tmp_path / "out"
    status, shown, _ = cli("codegen", "delta", "--kinematics", "--target", "arduino", "--out", str(out))
    assert status == 0
    assert shown.endswith("README.md describes them\n")
    assert (out / "src").is_dir()
    assert (out / "case.toml").read_text(encoding="utf-8")
    # Files of an earlier run are replaced, and those of another origin are not.
    assert cli("codegen", "delta", "--kinematics", "--target", "arduino", "--out", str(out))[0] == 0
    (out / "config.g").write_text("mine", encoding="utf-8")
    fault = refusal_of(cli("codegen", "delta", "--kinematics", "--target", "reprapfirmware", "--out", str(out)))
    assert "contains config.g, not written by screwsynth" in fault
    empty = tmp_path / "none"
    for words, expected in (
        (["--kinematics", "--target", "linuxcn"], "--target linuxcn: no such target; did you mean 'linuxcnc'"),
        (["--kinematics", "--target", "linuxcnc", "--single"], "--single: is not for --target linuxcnc"),
        (["--kinematics", "--target", "klipper", "--coordinates", "1"], "--coordinates: is not for --target klipper"),
        (["--target", "linuxcnc"], "--target: is only for --kinematics"),
        (["--kinematics", "--target", "marlin"], "the robot has arms that turn"),
    ):
        assert expected in refusal_of(cli("codegen", "delta", *words, "--out", str(empty)))
        assert not empty.exists()


def test_unknown_target() -> None:
    with pytest.raises(InputError, match="no such target"):
        export_kinematics(rotary(), "", "grbl")


def test_inches_for_linuxcnc() -> None:
    files = export_kinematics(rotary('[controller]\nlength = "in"\n'), "", "linuxcnc")
    assert setp(files)["rotarydeltakins.thighlength"] == pytest.approx(10 / 25.4, rel=1e-11)
    assert "LINEAR_UNITS = inch\n" in files["kinematics.ini"]
    robot = with_table(rotary(), table_of(files))
    for position, joints in ROTARY_JOINTS:
        assert joints_at(robot, np.array([position], float) / 25.4)[0] == pytest.approx(joints, abs=1e-8)


def test_a_free_dimension_is_refused(cli: Run, tmp_path: Path) -> None:
    words = ("codegen", "pick-and-place", "--kinematics", "--target", "linuxcnc", "--out", str(tmp_path / "out"))
    assert "robot.parameters" in refusal_of(cli(*words))

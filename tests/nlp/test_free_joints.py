"""Driven joints that the pose does not determine, held against the geometry of two robots written out in NumPy."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, edited, output_of, refusal_of, rows_of, saved, saved_with_robot, turn_about, unbroken
from generated import made, needs_compiler, written

from screwsynth.models import robot_function
from screwsynth.nlp import CertificateStatus, Status, certify, formulate, inverse, load_case, solve
from screwsynth.nlp.evidence.closing import closed_starts
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.proof.statement.standard_form import is_in_home_mode

#: Three limbs in a plane: a driven rail, a driven crank and a rod. The rails move with the platform at rest.
PLANAR = """
name = "three rails"
home = [0, 0, 0]
[dimensions]
r = { typical = 2 }
[[limb]]
repeat = { count = 3 }
points = { B = ["r", 0, 0], C = [1.5, 1, 0], A = [0.4, 0.2, 0] }
joints = [
    { type = "P", at = "B", axis = "y", actuated = true },
    { type = "R", at = "B", axis = "z", actuated = true },
    { type = "R", at = "C", axis = "z" },
    { type = "R", at = "A", axis = "z" },
]
"""
CASE = """
title = "three rails"
units.length = "m"
robot = { file = "robot.toml", parameters = { r = 2 } }
pose.position = [0.1, 0, 0]
task = [{ sense = "max", axis = [1, 0, 0], pitch = inf }]
[solve]
starts = 3
[limits.joint]
"1:1" = { min = -0.2, max = 0.2 }
"2:1" = { min = -0.2, max = 0.2 }
"3:1" = { min = -0.2, max = 0.2 }
"""
#: Six driven legs, three of them on driven rails: no loop has an unknown that its equations would determine.
LEGS = """
name = "legs on rails"
home = [0, 0, 20]
[dimensions]
r = { typical = 26.5 }
[[limb]]
repeat = { count = 3 }
points = { B = ["r", 0, 0], A = [11, 3, 20] }
joints = [
    { type = "P", at = "B", axis = "x", actuated = true },
    { type = "U", at = "B", axes = ["x", "y"] },
    { type = "P", at = "B", axis = "A - B", actuated = true },
    { type = "S", at = "A" },
]
[[limb]]
repeat = { count = 3 }
points = { B = ["r*0.9", "-r*0.3", 0], A = [6, -10, 20] }
joints = [
    { type = "U", at = "B", axes = ["x", "y"] },
    { type = "P", at = "B", axis = "A - B", actuated = true },
    { type = "S", at = "A" },
]
"""
LEGS_CASE = """
title = "legs on rails"
robot = { file = "robot.toml", parameters = { r = 26.5 } }
pose.position = [0, 0, { min = 18, max = 22 }]
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
solve.starts = 4
"""
LIMBS = range(3)
ROD = math.hypot(1.1, 0.8)
#: So many places of a rail are tried.
PLACES = 4001


def elbows(
    limb: int, rail: Array, position: tuple[float, float], r: float = 2.0, side: int = 1
) -> tuple[Array, Array, Array]:
    """Centres (n, 2) of the crank and the elbow, and that (2,) on the platform; on side 1 the elbow is as at home."""
    turn = turn_about([0, 0, 1], 2 * math.pi * limb / 3)[:2, :2]
    base = np.column_stack([np.full_like(rail, r), rail]) @ turn.T
    end = np.array(position) + turn @ np.array([0.4, 0.2])
    way, crank = end - base, math.hypot(r - 1.5, 1.0)
    apart = np.linalg.norm(way, axis=1, keepdims=True)
    along = (crank**2 - ROD**2 + apart**2) / (2 * apart)
    across = np.column_stack([way[:, 1], -way[:, 0]]) / apart
    return base, base + along * way / apart + side * np.sqrt(crank**2 - along**2) * across, end


def part(limb: int, rail: Array, position: tuple[float, float] = (0.1, 0.0), r: float = 2.0, side: int = 1) -> Array:
    """The part (n,) of a limb in F of the translation along x: a rod resists along its line alone."""
    _, elbow, end = elbows(limb, rail, position, r, side)
    return np.asarray(((end - elbow)[:, 0] / ROD) ** 2)


def best(sense: str, half: float, position: tuple[float, float] = (0.1, 0.0), r: float = 2.0) -> float:
    """The largest or smallest F over all rails within a half range; each rail is in one part of F alone."""
    rail = np.linspace(-half, half, PLACES)
    parts = [part(limb, rail, position, r) for limb in LIMBS]
    return float(sum(each.max() if sense == "max" else each.min() for each in parts))


def planar(folder: Path, *edits: tuple[str, str], half: float = 0.2) -> str:
    rails = CASE.replace("{ min = -0.2, max = 0.2 }", f"{{ min = {-half}, max = {half} }}")
    return saved_with_robot(folder, PLANAR, edited(rails, *edits))


def test_the_written_geometry_is_that_of_home_and_other_robots_have_no_free_joints() -> None:
    for limb in LIMBS:
        _, elbow, _ = elbows(limb, np.zeros(1), (0.0, 0.0))
        turn = turn_about([0, 0, 1], 2 * math.pi * limb / 3)[:2, :2]
        np.testing.assert_allclose(elbow[0], turn @ np.array([1.5, 1.0]), atol=1e-14)
    for name in ("planar-3-rrr", "delta", "five-bar", "6-pus"):
        assert robot_function(name)().free_joints == ()


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("half", [0.2, 1e-6])
def test_rails_take_the_places_of_the_best_value(tmp_path: Path, sense: str, half: float) -> None:
    case = load_case(planar(tmp_path, ('sense = "max"', f'sense = "{sense}"'), half=half))
    found = certify(case)
    wanted = best(sense, half)
    (certificate,) = found.tasks
    assert found.solution.status is Status.OPTIMAL
    assert pytest.approx(wanted, rel=1e-7) == found.solution.F
    # Where a bound is proved, it is one of the same robots.
    assert certificate.status is CertificateStatus.PROVED
    assert "in the home working mode" in certificate.statement
    assert 0 <= case.tasks[0].sense.sign * (certificate.bound - wanted) <= 2e-4
    assembly = found.solution.outcomes[0].own.optima[0].assembly
    assert assembly is not None
    assert not assembly.sentences


def test_a_bound_over_all_assemblies_covers_elbows_on_both_sides(tmp_path: Path) -> None:
    every = certify(load_case(planar(tmp_path, half=0.01)), all_assemblies=True, gap=0.2).tasks[0]
    assert every.status is CertificateStatus.PROVED
    assert "in the home working mode" not in every.statement
    rail = np.linspace(-0.01, 0.01, PLACES)
    most = sum(max(part(limb, rail, side=side).max() for side in (1, -1)) for limb in LIMBS)
    assert most > best("max", 0.01) + 0.5
    assert most * (1 - 1e-9) <= every.bound <= 1.21 * most


def test_costs_of_rails_are_derivatives(tmp_path: Path) -> None:
    result = solve(load_case(planar(tmp_path))).to_dict()
    step = 1e-6
    for row in result["limits"]:
        if row["active"]:
            limb, at = int(row["key"].split(".")[1][0]) - 1, np.array([row["limit"] - step, row["limit"] + step])
            slope = np.diff(part(limb, at))[0] / (2 * step)
            assert row["cost"] == pytest.approx(slope, rel=1e-6)
    assert sum(bool(row["active"]) for row in result["limits"]) == 3
    felt = {row["name"]: row["derivative"] for row in result["sensitivity"] if "derivative" in row}
    slope = (best("max", 0.2, r=2 + step) - best("max", 0.2, r=2 - step)) / (2 * step)
    assert felt["r"] == pytest.approx(slope, rel=1e-5)


def test_starts_are_spread_and_assembled_as_at_home(tmp_path: Path) -> None:
    nlp = formulate(load_case(planar(tmp_path)))
    assert not nlp.is_fixed
    joints = list(nlp.program.places.joints[0])
    points = starting_points(nlp, 12, 0)
    assert (np.ptp(points[:, joints], axis=0) > 0.3).all()
    assert (points[0, joints] == 0).all()
    closed = closed_starts(nlp, points)
    np.testing.assert_allclose(closed[:, joints], points[:, joints], rtol=4 * np.finfo(float).eps)  # of scaling
    for x in closed:
        assert loops_are_closed(nlp, x)
        assert is_in_home_mode(nlp, x)


def test_rows_are_in_every_answer(tmp_path: Path, cli: Run) -> None:
    file, result, table = planar(tmp_path), tmp_path / "result.json", tmp_path / "result.csv"
    shown = output_of(cli("solve", file, "--json", str(result), "--csv", str(table)))
    for joint, held in (("1:1", "-0.2 m -0.2 .. 0.2 at lower bound"), ("2:1", "0.2 m -0.2 .. 0.2 at upper bound")):
        (row,) = [line for line in shown.splitlines() if line.startswith(f"joint.{joint} ")]
        assert " ".join(row.split()).startswith(f"joint.{joint} {held}")
    assert "at the given point" not in shown
    joints = json.loads(result.read_text())["free_joints"]
    ends = [(each["joint"], each["lower"], each["upper"], each["lower_is_limit"]) for each in joints]
    assert ends == [(f"{k}:1", pytest.approx(-0.2), pytest.approx(0.2), True) for k in (1, 2, 3)]
    assert [round(each["value"], 9) for each in joints] == [-0.2, 0.2, 0.2]
    assert "joint.3:1,0.2" in table.read_text()
    page = tmp_path / "page.html"
    output_of(cli("report", file, "--out", str(page)))
    assert "3 variables: joint.1:1, joint.2:1, joint.3:1." in page.read_text(encoding="utf-8")


def test_the_robot_of_a_result_has_its_rails(tmp_path: Path, cli: Run) -> None:
    file, result, out = planar(tmp_path), str(tmp_path / "result.json"), tmp_path / "out"
    output_of(cli("solve", file, "--json", result))
    own = json.loads(Path(result).read_text())["F"]
    for of, wanted in ((["--of", result], own), ([], float(sum(part(k, np.zeros(1))[0] for k in LIMBS)))):
        evaluated = tmp_path / "evaluated.json"
        output_of(cli("evaluate", file, *of, "--json", str(evaluated)))
        assert json.loads(evaluated.read_text())["F"] == pytest.approx(wanted, rel=1e-9)
    for of in ([], ["--of", result]):
        output_of(cli("export", file, "--out", str(out), "--format", "csv", "--format", "mjcf", "--force", *of))
        rows = {row["joint"]: row for row in rows_of((out / "joints.csv").read_text())}
        for limb, rail in zip(LIMBS, (-0.2, 0.2, 0.2), strict=True):
            base, elbow, _ = elbows(limb, np.array([rail]), (0.1, 0.0))
            assert float(rows[f"joint_{limb + 1}_1"]["from home"]) == pytest.approx(rail)
            for joint, centre in ((2, base[0]), (3, elbow[0])):
                row = rows[f"joint_{limb + 1}_{joint}"]
                assert [float(row[f"{axis} in base [m]"]) for axis in "xy"] == pytest.approx(centre.tolist())


def test_limits_on_actuators_give_the_ranges(tmp_path: Path) -> None:
    by_joint = CASE[CASE.index("[limits.joint]") :]
    limits = "[limits]\nactuator_length = { min = -0.2, max = 0.2 }\n"
    found = solve(load_case(planar(tmp_path, (by_joint, limits))))
    assert pytest.approx(best("max", 0.2), rel=1e-9) == found.F
    joints = found.to_dict()["free_joints"]
    assert [(each["lower"], each["upper"]) for each in joints] == [(pytest.approx(-0.2), pytest.approx(0.2))] * 3


def test_each_pose_has_rails_of_its_own(tmp_path: Path, cli: Run) -> None:
    places = [(0.1, 0.0), (-0.1, -0.05)]
    poses = ", ".join(f"{{ position = [{x}, {y}, 0] }}" for x, y in places)
    file = planar(tmp_path, ("pose.position = [0.1, 0, 0]", f"pose = [{poses}]"))
    found = solve(load_case(file))
    assert pytest.approx(sum(best("max", 0.2, place) for place in places), rel=1e-9) == found.F
    shown = output_of(cli("solve", file, "--all"))
    rows = [line.split()[:3] for line in shown.splitlines() if line.startswith("joint.2:1 pose")]
    assert rows == [["joint.2:1", "pose", str(k)] for k in (1, 2)]


def test_several_tasks_share_the_rails(tmp_path: Path) -> None:
    second = (
        ', { name = "up", sense = "max", axis = [0, 1, 0], pitch = inf }]\ncombine.method = "weighted-sum"\n[solve]'
    )
    found = solve(load_case(planar(tmp_path, ("]\n[solve]", second))))
    # Of a rod in the plane the squares along x and y have the sum 1, so that of three rods is 3 with any rails.
    assert found.to_dict()["combined"]["value"] == pytest.approx(3.0, rel=1e-9)
    assert found.status is Status.OPTIMAL


def leg_squares(rail: Array, z: float) -> Array:
    """F (n,) of the translation along z of six legs, three of them on rails."""
    near = z**2 / ((11 - 26.5 - rail) ** 2 + 9 + z**2)
    far = z**2 / ((6 - 0.9 * 26.5) ** 2 + (-10 + 0.3 * 26.5) ** 2 + z**2)
    return np.asarray(3 * (near + far))


def test_legs_on_rails_without_limits(tmp_path: Path, cli: Run) -> None:
    file, result = saved_with_robot(tmp_path, LEGS, LEGS_CASE), tmp_path / "result.json"
    output_of(cli("evaluate", file, "--json", str(result)))
    assert json.loads(result.read_text())["F"] == pytest.approx(leg_squares(np.zeros(1), 20.0)[0], rel=1e-12)
    shown = unbroken(output_of(cli("solve", file, "--json", str(result))))
    found = json.loads(result.read_text())
    assert found["F"] == pytest.approx(leg_squares(np.linspace(-30, 0, PLACES), 22.0).max(), rel=1e-6)
    assert [each["value"] for each in found["free_joints"]] == pytest.approx([11 - 26.5] * 3, abs=1e-5)
    # Four times the robot's size: of r and the largest number that the file has as such, 4 hypot(26.5, 20).
    assert "joints 1:1, 2:1, 3:1 have no limits: solve searches from -132.801 to 132.801" in shown
    assert "assembly" not in shown
    (certificate,) = certify(load_case(file)).tasks
    assert certificate.status is CertificateStatus.PROVED
    assert 0 <= certificate.bound - found["F"] <= 1e-3


def test_one_limit_is_one_end(tmp_path: Path, cli: Run) -> None:
    limits = '[limits.joint]\n"1:1" = { max = -16 }\n"2:1" = { min = -10, max = 0 }\n'
    file = saved_with_robot(tmp_path, LEGS, LEGS_CASE + limits)
    shown = unbroken(output_of(cli("solve", file, "--all")))
    assert "joint 1:1 has no lower limit: solve searches from -132.801 to -16" in shown
    assert "joint 3:1 has no limits: solve searches from -132.801 to 132.801" in shown
    rails = {line.split()[0]: float(line.split()[1]) for line in shown.splitlines() if line.startswith("joint.")}
    wanted = {"joint.1:1": -16, "joint.2:1": -10, "joint.3:1": -15.5}
    assert {name: rails[name] for name in wanted} == pytest.approx(wanted, abs=1e-4)


def test_what_is_judged_over_poses_is_refused(tmp_path: Path, cli: Run) -> None:
    poses = str(saved(tmp_path / "poses.csv", "x,y,z\n0,0,0\n0.05,0.02,0\n"))
    words = "the pose does not determine the coordinates of actuated joints 1:1, 2:1, 3:1 of 'three rails'"
    half = "{ min = -0.05, max = 0.05 }"
    workspace = ("[solve]", f"workspace.position = [{half}, {half}, 0]\n[solve]")
    file = planar(tmp_path, workspace)
    for arguments in (["workspace", file], ["workspace", file, "--scale"], ["path", file, "--along", poses]):
        refusal_of(cli(*arguments), words)
    refusal_of(cli("path", file, "--range"), words)
    over = ("[limits.joint]", '[limits]\nover = "workspace"\n[limits.joint]')
    refusal_of(cli("solve", planar(tmp_path, workspace, over)), "limits.over", words)
    load = planar(tmp_path, ("[solve]", "load = [{ force = [10, 0, 0] }]\n[solve]"))
    refusal_of(cli("solve", load), "6 actuators for 3 degrees of freedom", "can move while the platform stands still")


def test_inverse_holds_the_rails_at_home(tmp_path: Path, cli: Run) -> None:
    case = load_case(planar(tmp_path))
    poses = np.array([[0.05, 0.02, 0.0], [-0.08, 0.06, 0.0]])
    found = inverse(case, poses)
    assert found.closed.all()
    assert found.held == ("1:1", "2:1", "3:1")

    def cranks(position: Array) -> Array:
        angles = []
        for limb in LIMBS:
            ends = [elbows(limb, np.zeros(1), (x, y)) for x, y, _ in (position, np.zeros(3))]
            now, home = (elbow[0] - base[0] for base, elbow, _ in ends)
            angles.append(math.atan2(home[0] * now[1] - home[1] * now[0], home @ now))
        return np.array(angles)

    step = 1e-6
    for k, pose in enumerate(poses):
        np.testing.assert_allclose(found.coordinates[k, 0::2], 0.0)
        np.testing.assert_allclose(found.coordinates[k, 1::2], cranks(pose), atol=1e-12)
        np.testing.assert_allclose(found.rates[k, 0::2], 0.0)
        for axis in (0, 1):
            away = step * np.eye(3)[axis]
            slope = (cranks(pose + away) - cranks(pose - away)) / (2 * step)
            np.testing.assert_allclose(found.rates[k, 1::2, 3 + axis], slope, atol=1e-8)
    file = str(saved(tmp_path / "poses.csv", "x,y,z\n0.05,0.02,0\n"))
    shown = unbroken(output_of(cli("inverse", planar(tmp_path), "--poses", file)))
    assert "driven joints 1:1, 2:1, 3:1 held at home: the pose does not determine their positions" in shown


def test_a_sweep_has_a_column_for_each_rail(tmp_path: Path, cli: Run) -> None:
    out = tmp_path / "sweep.csv"
    code, _, _ = cli("sweep", planar(tmp_path), "--over", "r=1.9:2.1:2", "--out", str(out), "--starts", "3")
    assert code == 0
    for row in rows_of(out.read_text()):
        assert float(row["F"]) == pytest.approx(best("max", 0.2, r=float(row["r"])), rel=1e-7)
        assert float(row["joint.2:1"]) == pytest.approx(0.2)


def test_robots_say_which_joints_are_free(tmp_path: Path, cli: Run) -> None:
    for text, loops in ((PLANAR, "including these variables"), (LEGS, "these 3 variables (no equations)")):
        robot = str(saved(tmp_path / "robot.toml", text))
        shown = unbroken(output_of(cli("models", robot, "--all")))
        assert "coordinates of actuated joints 1:1, 2:1, 3:1, which the pose does not determine" in shown
        assert loops in shown
        starter = output_of(cli("new", robot))
        assert "[workspace]" not in starter
        assert "actuator_length = " in starter or starter.count("the pose does not determine") == 3
        evaluated = cli("evaluate", str(saved(tmp_path / "starter.toml", starter)))
        assert evaluated[0] == 0
    certified = unbroken(output_of(cli("certify", planar(tmp_path))))
    assert "limbs 1, 2, 3: 2 joint coordinates each, from the loop equations; covers home's working mode" in certified


@pytest.mark.slow
@needs_compiler
def test_generated_c_finds_the_rails(tmp_path: Path) -> None:
    case = load_case(planar(tmp_path))
    folder = written(case, tmp_path / "c")
    header = next(folder.glob("*case.h")).read_text()
    assert '"joint.1:1"' in header
    assert "0 failed" in made(folder, "test")

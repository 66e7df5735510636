"""Robots of literal numbers: the same robot in other units of length has the same verdicts."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_file, case_of, case_tables, output_of, saved

from screwsynth.nlp import Case, Outcome, judge_workspace, load_case
from screwsynth.nlp.evidence.assembly import assembly_at, unknowns_from_home
from screwsynth.nlp.evidence.workingmode import Posture
from screwsynth.nlp.path.reader import read_path
from screwsynth.nlp.proof.workspace.path_judge import judge_path

#: A linear Delta, mm: radius of the rails, half width of a parallelogram, radius of the platform, height of the rods.
RAIL, HALF, RADIUS, HEIGHT = 234.8, 30.0, 0.0, 408.301310309
#: Lengths of one unit, in millimetres.
UNITS = {"um": 1e-3, "mm": 1.0, "in": 25.4, "m": 1e3, "km": 1e6}


def point(azimuth: float, out: float, across: float, height: float, unit: float) -> list[float]:
    c, s = math.cos(azimuth), math.sin(azimuth)
    return [(c * out - s * across) / unit, (s * out + c * across) / unit, height / unit]


def linear_delta(folder: Path, unit: float) -> Case:
    """The case of the robot in a unit, with a workspace and limits of the same sizes."""
    limbs = []
    for k in range(3):
        azimuth = 2 * math.pi * k / 3
        rods = [
            f"{{ joints = [{{ type = 'S', at = {point(azimuth, RAIL, side, HEIGHT, unit)} }}, "
            f"{{ type = 'S', at = {point(azimuth, RADIUS, side, 0, unit)} }}] }}"
            for side in (HALF, -HALF)
        ]
        slide = f"{{ type = 'P', at = {point(azimuth, RAIL, 0, HEIGHT, unit)}, axis = 'z', actuated = true }}"
        limbs.append(f"[[limb]]\njoints = [{slide}]\nbranch = [{', '.join(rods)}]\n")
    saved(folder / "robot.toml", f"name = 'd'\nhome = [0, 0, 0]\n{''.join(limbs)}")
    across, high = 50 / unit, 20 / unit
    text = f"""
[units]
length = "any"
[robot]
file = "robot.toml"
parameters = {{}}
[pose]
position = [0, 0, 0]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
actuator_length = {{ min = {-90 / unit!r}, max = {90 / unit!r} }}
[workspace]
position = [{{ min = {-across!r}, max = {across!r} }}, {{ min = {-across!r}, max = {across!r} }},
            {{ min = {-high!r}, max = {high!r} }}]
"""
    return load_case(str(saved(folder / "case.toml", text)))


def test_a_robot_of_literal_numbers_has_the_same_verdicts_in_every_unit(tmp_path: Path) -> None:
    found = [judge_workspace(linear_delta(tmp_path, unit), jobs=1) for unit in UNITS.values()]
    ends = []
    for judged in found:
        assert judged.is_proved
        assert {each.outcome for each in judged.extremes} == {Outcome.PROVED}
        ends.append([each.bound for each in judged.extremes if each.name == "F"])
    # F of a translation does not depend on the unit; its bounds are found to 1e-3.
    assert len(ends[0]) == 2
    np.testing.assert_allclose(ends, [ends[1]] * len(UNITS), rtol=2e-3)


def test_a_structure_with_fewer_than_six_rows_is_singular_at_every_pose(tmp_path: Path) -> None:
    feet = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1)]
    for count in (5, 3):
        limbs = "".join(
            f"[[limb]]\njoints = [{{ type = 'S', at = [{x}, {y}, 0] }}, "
            f"{{ type = 'P', at = [{x}, {y}, 0], axis = {[0.4 * y - 0.5 * x, -0.5 * y + 0.1, 1]}, actuated = true }}, "
            f"{{ type = 'S', at = {[x + 0.4 * y - 0.5 * x, y - 0.5 * y + 0.1, 1]} }}]\n"
            for x, y in feet[:count]
        )
        saved(tmp_path / "robot.toml", f"name = 'struts'\nhome = [0, 0, 1]\n{limbs}")
        text = """
[units]
length = "m"
[robot]
file = "robot.toml"
parameters = {}
[pose]
position = [0, 0, 1]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[workspace]
position = [{ min = -0.1, max = 0.1 }, { min = -0.1, max = 0.1 }, { min = 0.9, max = 1.1 }]
"""
        judged = judge_workspace(load_case(str(saved(tmp_path / "case.toml", text))), time_limit=5)
        assert judged.regularity.outcome is Outcome.REFUTED
        assert "below six at all dimensions and poses" in judged.regularity.reason


def test_the_condition_number_of_a_planar_robot_on_a_path_is_proved_in_each_unit(tmp_path: Path) -> None:
    """Where an inverse of J is zero, rounding decides nothing: in metres all was proved, in micrometres not."""
    found = []
    for unit in (UNITS["um"], UNITS["in"], UNITS["m"]):
        rail, at = [1000 / unit, -300 / unit, 0], [175 / unit, 303.1088913245535 / unit, 0]
        slide = f"{{ type = 'P', at = {rail}, axis = 'y', actuated = true }}"
        turns = ", ".join(f"{{ type = 'R', at = {each}, axis = 'z' }}" for each in (rail, at))
        robot = f"name = 'planar'\nhome = [0, 0, 0]\n[[limb]]\nrepeat = 3\njoints = [{slide}, {turns}]\n"
        saved(tmp_path / "robot.toml", robot.replace("repeat = 3", "repeat = { count = 3 }"))
        case = case_of(
            {"file": str(tmp_path / "robot.toml"), "characteristic_length": 350 / unit},
            units={"length": "any"},
            pose={"position": [0, 0, 0]},
            task=[{"sense": "max", "axis": [1, 0, 0], "pitch": math.inf}],
            limits={"condition_number": {"max": 2.6, "length": 350 / unit}},
        )
        points = [[0, 0], [24, 12], [-18, 30], [6, -24]]
        rows = "".join(f"{x / unit!r},{y / unit!r},0,{t}\n" for t, (x, y) in enumerate(points))
        judged = judge_path(case, read_path(saved(tmp_path / "path.csv", "x,y,z,t\n" + rows), case.units))
        (number,) = [each for each in judged.extremes if each.name == "condition_number"]
        assert number.outcome is Outcome.PROVED, (unit, number)
        found.append(number.bound)
    np.testing.assert_allclose(found, found[0], rtol=1e-9)


def orthogonal_slides(folder: Path, unit: float) -> Case:
    """Three slides along the axes whose home is the origin, each with a rod of parallel struts to the platform."""
    limbs = []
    for k in range(3):
        axis, other = np.roll([1.0, 0, 0], k), np.roll([0, 1.0, 0], k)
        rail = 240 * axis / unit
        rods = [
            "{ joints = ["
            + ", ".join(
                f"{{ type = 'S', at = {(each + side * 30 * other / unit).tolist()} }}" for each in (rail, 0 * rail)
            )
            + "] }"
            for side in (1, -1)
        ]
        slide = f"{{ type = 'P', at = {rail.tolist()}, axis = {axis.tolist()}, actuated = true }}"
        limbs.append(f"[[limb]]\njoints = [{slide}]\nbranch = [{', '.join(rods)}]\n")
    saved(folder / "robot.toml", f"name = 'slides'\nhome = [0, 0, 0]\n{''.join(limbs)}")
    reach = 60 / unit
    text = f"""
[units]
length = "any"
[robot]
file = "robot.toml"
parameters = {{}}
[pose]
position = [{-reach!r}, {reach!r}, {reach!r}]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""
    return load_case(str(saved(folder / "case.toml", text)))


def test_the_assembly_of_a_robot_whose_home_is_the_origin_is_the_same_in_every_unit(tmp_path: Path) -> None:
    found = []
    for unit in UNITS.values():
        case = orthogonal_slides(tmp_path, unit)
        at = np.array([-60.0, 60.0, 60.0]) / unit
        unknowns = unknowns_from_home(case.model, np.zeros(0), np.concatenate([np.zeros(3), at]))
        assembly = assembly_at(case.model, Posture(np.zeros(0), unknowns, np.eye(3), at))
        found.append((assembly.is_home, assembly.nearness))
    assert all(is_home for is_home, _ in found)
    nearness = [near for _, near in found]
    assert 0.1 < nearness[0] <= 1
    np.testing.assert_allclose(nearness, nearness[0], rtol=1e-6)


def test_the_force_that_a_limit_bounds_is_that_of_the_load_in_every_unit(cli: Run, tmp_path: Path) -> None:
    """Minors of six rows are ninth powers of a length: beside them nothing is small by itself."""
    found, out = [], tmp_path / "out.json"
    for unit in UNITS.values():
        tables = case_tables(
            {"model": "stewart-gough", "layout": "octahedral"}
            | {"parameters": {"x1": 300 / unit, "x2": 120 / unit, "x3": 0, "x4": 5}},
            units={"length": "any", "force": "N"},
            pose={"position": [10 / unit, 20 / unit, 220 / unit]},
            task=[{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
            load=[{"any": {"force": 20, "moment": 300 / unit}, "point": [0, 0, 50 / unit]}],
            motion={"linear": 50 / unit, "angular": 20},
            limits={"actuator_force": {"max": 400}, "actuator_speed": {"max": 1e3 / unit}},
        )
        output_of(cli("evaluate", str(case_file(tmp_path, tables)), "--json", str(out)))
        data = json.loads(out.read_text(encoding="utf-8"))
        force, speed = (row["value"] for row in data["limits"])
        assert force == pytest.approx(max(each["largest"] for each in data["loads"][0]["actuators"]), rel=1e-9)
        assert speed == pytest.approx(max(each["value"] for each in data["speeds"]), rel=1e-9)
        found.append([force, speed * unit])
    np.testing.assert_allclose(found, [found[0]] * len(UNITS), rtol=1e-9)

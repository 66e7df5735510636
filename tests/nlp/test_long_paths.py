"""Paths with whole turns: of a machine whose spindle turns on and on, beside closed forms, and of one that cannot."""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders import Array, case_from, output_of, saved, shipped_tables

from screwsynth.nlp import Case, Outcome
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import PathOptions
from screwsynth.nlp.path.path import ProgrammedPath
from screwsynth.nlp.proof.workspace.path_judge import PathJudgement, judge_path

Run = Callable[..., tuple[int, str, str]]
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
    saved(folder / "gantry.toml", GANTRY)
    return case_from(
        {
            "units": {"length": "mm"},
            "robot": {"file": str(folder / "gantry.toml"), "parameters": {"a": 100}, "characteristic_length": 82},
            "pose": {"position": [0, 0, 0]},
            "task": [{"axis": [0, 0, 1], "point": [0, 0, 0], "pitch": 0, "sense": "max"}],
            "limits": limits,
        }
    )


def program(case: Case, text: str = PROGRAM) -> ProgrammedPath:
    return read_program(text.splitlines(), "part.ngc", case.units, PathOptions())


def joints(path: ProgrammedPath) -> Array:
    """Positions (K, 4) of the joints at samples of all segments, the spindle's as far as the program has turned it."""
    found = []
    for k in range(len(path)):
        positions, _ = path.poses_at(np.full(len(SAMPLES), k), SAMPLES)
        yaw = path.knots[k, 5] + SAMPLES * (path.knots[k + 1, 5] - path.knots[k, 5])
        arm = 100 * np.stack([np.cos(yaw) - 1, np.sin(yaw), 0 * yaw], axis=1)
        found.append(np.hstack([positions + arm, yaw[:, None]]))
    return np.concatenate(found)


def extremes_of(judged: PathJudgement, name: str) -> list[tuple[Sense, float, float]]:
    found = [(each.sense, each.bound, each.reached) for each in judged.extremes if each.name == name]
    assert found, name
    return found


def test_a_spindle_turns_on_and_on(tmp_path: Path) -> None:
    wide = {"min": -1e4, "max": 1e4}
    case = gantry(tmp_path, actuator_angle=wide, actuator_length=wide)
    path = program(case)
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
    judged = judge_path(case, program(case))
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
    case = case_from(shipped_tables("hexapod-linuxcnc") | {"limits": {"leg_length": {"min": 17, "max": 43}}})
    judged = judge_path(case, program(case, "G20 F60\nG1 X0 Y0 Z20 C0\nG1 C720\nM2"))
    (rank,) = judged.ranks
    assert rank.outcome is Outcome.REFUTED
    # By symmetry at a right angle.
    assert rank.place.parameter == pytest.approx(1 / 8, abs=1e-9)
    lengths = [each for each in judged.extremes if each.name.startswith("leg_length")]
    assert len(lengths) == 12
    # All legs take part in the same motion.
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
    assert "everything is proved at every point" in shown
    result = json.loads(out.read_text())
    spindle = [each for each in result["path"]["claims"] if each["name"] == "actuator_angle limb 1.4"]
    assert sorted(each["reached"] for each in spindle) == pytest.approx([-1000, 800], abs=0.5)
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    turned = np.array([float(row["actuator_angle 1.4"]) for row in rows])
    assert [turned.max(), turned.min(), turned[-1]] == pytest.approx([800, -1000, 0], abs=1e-9)

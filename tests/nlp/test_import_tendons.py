"""Differentials in MJCF: fixed tendons with actuators, and equalities of fixed tendons, against MuJoCo's lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from builders import Run, saved, starter_text, turn_about

from screwsynth.models import robot, robot_function
from screwsynth.nlp import Case, Task, inverse
from screwsynth.nlp.formats.reading.importing import Request, import_robot
from screwsynth.nlp.formats.reading.reduction import Ends
from screwsynth.nlp.units import Units

BODY = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
TORSO = f"""
<body name="pelvis">{BODY}
  <body name="yoke"><joint name="pitch" axis="0 1 0" ref="{{ref}}"/>{BODY}
    <body name="torso" pos="0.03 0 0.1"><joint name="roll" pos="-0.03 0 -0.05" axis="1 0 0"/>{BODY}</body>
  </body>
  {{more}}
</body>
"""
TENDONS = """
<tendon>
  <fixed name="left"><joint joint="pitch" coef="-0.7"/><joint joint="roll" coef="1.3"/></fixed>
  <fixed name="right"><joint joint="pitch" coef="0.9"/><joint joint="roll" coef="1.1"/></fixed>
  <spatial name="cable"><site site="a"/><site site="b"/></spatial>
</tendon>
<actuator>
  <motor name="m1" tendon="left"/><motor name="m2" tendon="right"/><motor name="m3" tendon="cable"/>
</actuator>
"""
SITES = '<site name="a"/><site name="b" pos="0 0 1"/>'
ROTORS = f"""
<body name="rotor1" pos="0 0.1 0"><joint name="motor1" axis="0 1 0"/>{BODY}</body>
<body name="rotor2" pos="0 -0.1 0"><joint name="motor2" axis="0 1 0"/>{BODY}</body>
"""
EQUALITIES = """
<tendon>
  <fixed name="left"><joint joint="pitch" coef="-0.7"/><joint joint="roll" coef="1.3"/></fixed>
  <fixed name="motor"><joint joint="motor1" coef="2"/></fixed>
  <fixed name="right"><joint joint="pitch" coef="0.9"/><joint joint="roll" coef="1.1"/>
    <joint joint="motor2" coef="-3"/></fixed>
</tendon>
<equality>
  <tendon name="first" tendon1="left" tendon2="motor" polycoef="0 0.5 0 0 0"/>
  <tendon name="second" tendon1="right" polycoef="0 0 0 0 0"/>
</equality>
<actuator><motor name="m1" joint="motor1"/><motor name="m2" joint="motor2"/></actuator>
"""


def model_text(more: str, parts: str, ref: float = 0.0) -> str:
    return f"<mujoco><worldbody>{TORSO.format(more=more, ref=ref)}</worldbody>{parts}</mujoco>"


def imported(path: Path, text: str) -> tuple[dict[str, Any], tuple[str, ...]]:
    found = import_robot(Request(saved(path, text), Ends("torso", "pelvis")))
    return found.tables, found.notes


def poses_of(text: str, count: int) -> tuple[Any, np.ndarray, list[np.ndarray], np.ndarray]:
    """The compiled model, random pitch and roll, places and rotations of the torso, and lengths of the tendons."""
    model = mujoco.MjModel.from_xml_string(text)
    data, rng = mujoco.MjData(model), np.random.default_rng(5)
    angles, p, R, lengths = rng.uniform(-0.6, 0.6, (count, 2)), [], [], []
    home = data.qpos.copy()
    for pitch, roll in angles:
        data.qpos[:] = home
        data.joint("pitch").qpos[0] += pitch
        data.joint("roll").qpos[0] += roll
        mujoco.mj_forward(model, data)
        p.append(data.body("torso").xpos.copy())
        R.append(data.body("torso").xmat.reshape(3, 3).copy())
        lengths.append(data.ten_length.copy())
    return model, np.array(p), R, np.array(lengths)


def motors_at(tables: dict[str, Any], p: np.ndarray, R: list[np.ndarray]) -> dict[str, np.ndarray]:
    model = robot(**tables)
    task = Task(np.array([0.0, 1, 0, 0, 0, 0]))
    found = inverse(Case(model, {}, model.home, [task], units=Units(angle="rad")), p, R)
    assert found.closed.all()
    return dict(zip(found.actuators, found.coordinates.T, strict=True))


@pytest.mark.parametrize("ref", [0.0, 20.0])
def test_motors_of_fixed_tendons_have_their_lengths(tmp_path: Path, ref: float) -> None:
    text = model_text(SITES, TENDONS, ref)
    tables, notes = imported(tmp_path / "waist.xml", text)
    _, p, R, lengths = poses_of(text, 40)
    motors = motors_at(tables, p, R)
    assert list(motors) == ["left", "right"]
    zero = mujoco.MjData(model := mujoco.MjModel.from_xml_string(text))
    mujoco.mj_forward(model, zero)
    for k, found in enumerate(motors.values()):
        np.testing.assert_allclose(found, lengths[:, k] - zero.ten_length[k], rtol=0, atol=1e-11)
    assert "the actuator of tendon left became joint left; its coordinate is the length of the tendon" in notes
    assert any("'m3' was omitted: it acts on the tendon 'cable'" in note for note in notes)


def test_equalities_of_fixed_tendons_tie_motors_to_joints(tmp_path: Path) -> None:
    text = model_text(ROTORS, EQUALITIES)
    tables, _ = imported(tmp_path / "waist.xml", text)
    _, p, R, lengths = poses_of(text, 40)
    motors = motors_at(tables, p, R)
    # Of the lengths, the motors at rest have no part: left = 0.5 * 2 motor1, and right - 3 motor2 = 0.
    np.testing.assert_allclose(motors["motor1"], lengths[:, 0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(motors["motor2"], lengths[:, 2] / 3, rtol=0, atol=1e-11)


def test_a_tendon_of_one_joint_drives_it_and_one_of_a_missing_joint_is_left_out(tmp_path: Path) -> None:
    parts = """
    <tendon>
      <fixed name="only"><joint joint="motor1" coef="3"/></fixed>
      <fixed name="right"><joint joint="pitch" coef="1"/><joint joint="roll" coef="1"/></fixed>
      <fixed name="left"><joint joint="pitch" coef="1"/><joint joint="roll" coef="-1"/><joint joint="motor1"
        coef="-1"/></fixed>
      <fixed name="nothing"><joint joint="absent" coef="1"/></fixed>
    </tendon>
    <equality><tendon name="tie" tendon1="left"/></equality>
    <actuator><motor tendon="only"/><motor tendon="right"/><motor tendon="nothing"/></actuator>
    """
    tables, notes = imported(tmp_path / "waist.xml", model_text(ROTORS, parts))
    assert [each["name"] for each in tables["joint"] if each.get("actuated")] == ["motor1", "right"]
    assert "the actuator of tendon only drives only joint motor1; its rate is the rate of motor1" in notes
    assert any("acts on the tendon 'nothing'" in note for note in notes)


def test_an_actuator_of_a_tendon_that_moves_nothing_is_refused(tmp_path: Path, cli: Run) -> None:
    parts = """
    <tendon><fixed name="slack"><joint joint="motor1" coef="0"/></fixed></tendon>
    <actuator><motor tendon="slack"/></actuator>
    """
    path = saved(tmp_path / "waist.xml", model_text(ROTORS, parts))
    status, _, err = cli("import", str(path), "--platform", "torso", "--base", "pelvis", "--out", "-")
    assert status == 2
    assert "an actuator drives the tendon 'slack', which moves no joint: all its coef are 0" in " ".join(err.split())


def test_a_polynomial_of_tendons_is_refused(tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / "waist.xml", model_text(ROTORS, EQUALITIES.replace("0 0.5 0 0 0", "0 0.5 0.1 0 0")))
    status, _, err = cli("import", str(path), "--platform", "torso", "--base", "pelvis", "--out", "-")
    assert status == 2
    assert "equality first of tendons: must be linear" in " ".join(err.split())


def test_a_chain_without_coupled_motors_stays_refused(tmp_path: Path, cli: Run) -> None:
    parts = '<actuator><motor joint="pitch"/><motor joint="roll"/></actuator>'
    path = saved(tmp_path / "arm.xml", model_text("", parts))
    status, _, err = cli("import", str(path), "--platform", "torso", "--base", "pelvis", "--out", "-")
    assert status == 2
    assert "at the end of an open chain" in " ".join(err.split())


def test_a_differential_that_was_exported_comes_back(tmp_path: Path, cli: Run) -> None:
    model = robot_function("differential-waist")()
    text = starter_text("differential-waist").replace(
        "{ angle = { min = -20, max = 20 } }", "{ axis = [0, 0, 1], angle = 0 }"
    )
    case = saved(tmp_path / "waist.toml", text)
    assert cli("export", str(case), "--format", "mjcf", "--out", str(tmp_path / "out"), "--starts", "1")[0] == 0
    (path,) = (tmp_path / "out").glob("*.xml")
    found = import_robot(Request(path, Ends("platform", "base")))
    couplings = [each["factors"] for each in found.tables["coupling"]]
    assert len(couplings) == 3
    poses = np.zeros((1, 3)), [turn_about([0.3, -0.5, 0.7], 0.4)]
    values = {item.name: item.typical for item in model.parameters}
    case_of_model = Case(model, values, model.home, [Task(np.eye(6)[0])], units=Units(angle="rad"))
    own = inverse(case_of_model, *poses)
    again = motors_at(found.tables, *poses)
    np.testing.assert_allclose([again[name][0] for name in own.actuators], own.coordinates[0], rtol=0, atol=1e-11)

"""Nested loops and coupled joints in other programs' formats: MuJoCo finds the rates of the result, an import its J."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Array
from link_robots import CASE, COUPLING, ROBOT
from mujoco_trees import Tree

from screwsynth.models.mechanism import wrenches_of
from screwsynth.nlp import InputError, Task, evaluate, formulate, load_case
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.exchange.reading.importing import Request, import_robot
from screwsynth.nlp.exchange.reading.reduction import Ends
from screwsynth.nlp.exchange.solved.mechanism_of import mechanism_of
from screwsynth.nlp.exchange.writing.mjcf import mjcf_text


def work_rates(J: Array) -> Array:
    """J'J, from which F of every twist follows, in parts of its largest entry."""
    squares = J.T @ J
    return squares / np.abs(squares).max()


@pytest.mark.parametrize("coupling", ["", COUPLING])
def test_nested_loops_and_coupled_joints_are_exported(coupling: str, tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(ROBOT + coupling, encoding="utf-8")
    free = "{ min = -0.1, max = 0.1 }, { min = 0.9, max = 1.1 }, 0]\n"
    free += "rotation = { axis = [0, 0, 1], angle = { min = -10, max = 10 } }"
    limits = "[limits]\nactuator_angle = { min = -40, max = 50 }\n"
    (tmp_path / "case.toml").write_text(CASE.replace("0, 1, 0]", free) + limits, encoding="utf-8")
    nlp = formulate(load_case(tmp_path / "case.toml"))
    start = closed_start(nlp)
    x = close_equations(nlp, start + 0.05 * np.random.default_rng(1).uniform(-1, 1, nlp.n))
    state = evaluate(nlp, x)
    assert np.abs(state.position - [0, 1, 0]).max() > 1e-3
    found = mechanism_of(nlp, x)
    tree = Tree(mjcf_text(found.mechanism), found.size)
    assert tree.open <= 1e-9
    np.testing.assert_allclose(tree.data.body("platform").xpos, state.position, atol=1e-9)
    J = wrenches_of(found.mechanism, nlp.case.characteristic_length).jacobian
    np.testing.assert_allclose(work_rates(J), work_rates(state.jacobian), atol=1e-8)
    angle = next(joint.coordinate for joint in found.joints if joint.name == "motor")
    motor = next(joint for joint in found.mechanism.joints if joint.name == "motor")
    assert motor.range is not None
    assert angle is not None
    np.testing.assert_allclose(motor.range, np.radians([-40, 50]) - angle, atol=1e-12)
    basis = tree.feasible_twists()
    assert basis.shape[1] == (1 if coupling else 2)
    twist = basis @ basis.T @ np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
    twisted = formulate(replace(nlp.case, tasks=[Task(tuple(twist))]))
    mobility = mobility_of(twisted, x, evaluate(twisted, x))
    assert mobility is not None
    rates = [mobility.actuator_rates[joint.actuator] for joint in found.joints if joint.actuator]
    np.testing.assert_allclose(tree.motion(twist)[0][tree.driven], rates, atol=1e-7)
    (tmp_path / "robot.xml").write_text(mjcf_text(found.mechanism), encoding="utf-8")
    again = import_robot(Request(tmp_path / "robot.xml", Ends("platform"))).mechanism
    J = wrenches_of(again, nlp.case.characteristic_length).jacobian
    np.testing.assert_allclose(work_rates(J), work_rates(state.jacobian), atol=1e-8)
    # Another assembly of the four-bar has the same actuators, and is not reached from home.
    flipped = x.copy()
    index = [each.name for each in nlp.program.variables].index("q2_2")
    flipped[index] += 0.5
    with pytest.raises(InputError, match="leads to another assembly or pose than the answer's"):
        mechanism_of(nlp, flipped)

"""Kinematics in C of random mechanisms of any topology, which MuJoCo drives and closes."""

from __future__ import annotations

import numpy as np
import pytest
from generated import needs_compiler
from kinematics_library import OK, SINGULAR, Library
from mujoco_graphs import GraphEngine
from random_mechanisms import random_mechanism

from screwsynth.models import robot
from screwsynth.models.mechanism import mechanism_of
from screwsynth.nlp import Case, Rotation, Task
from screwsynth.nlp.units import Units

pytestmark = needs_compiler

#: Mechanisms of at most 12 unknowns that MuJoCo closes away from singularities, and with actuators at rest where the
#: platform is: nested, serial and coupled loops, of up to six degrees of freedom.
QUICK = (2, 18, 36, 80)
OTHERS = (
    13,
    14,
    23,
    27,
    31,
    32,
    37,
    38,
    39,
    42,
    43,
    46,
    52,
    66,
    68,
    70,
    81,
    83,
    84,
    86,
    90,
    97,
    101,
    103,
    105,
    106,
    110,
    115,
    117,
    121,
    122,
    123,
    125,
    129,
    133,
    137,
    140,
    143,
    145,
    163,
    175,
    176,
    178,
    186,
    201,
    207,
)


@pytest.mark.parametrize("seed", [*QUICK, *(pytest.param(each, marks=pytest.mark.soak) for each in OTHERS)])
def test_motors_rates_and_pose_are_those_of_mujoco(seed: int) -> None:
    tables = random_mechanism(seed)
    engine, model = GraphEngine(mechanism_of(tables)), robot(**tables)
    rng = np.random.default_rng(seed)
    task = Task(np.array([0, 0, 0, 0, 0, 1.0]))
    case = Case(model, {}, model.home, [task], Rotation(), units=Units(angle="rad"), name=f"random {seed}")
    library = Library(case, optimise="-O0")
    order = [engine.actuators.index(each.name) for each in model.joints if each.name in engine.actuators]
    assert len(order) == library.count
    for driven in rng.uniform(-0.08, 0.08, (3, library.count)):
        assert engine.drive(driven)
        assert engine.regularity > 1e-2
        (p, R), (twists, rates) = engine.pose, engine.motions()
        library.start()
        status, q = library.motors(p, R)
        assert status == OK
        np.testing.assert_allclose(q, driven[order], atol=1e-10)
        by_twist = library.at("rates", p, R, 6 * library.count)
        assert by_twist.status == OK
        np.testing.assert_allclose(twists @ by_twist.values.reshape(-1, 6).T, rates[:, order], atol=1e-9)
        # Power: the torques that balance a load, in all motions of the engine.
        load = rng.normal(size=6)
        status, torques = library.at("torques", p, R, library.count, load)
        assert (status == SINGULAR) == bool(library.robot.no_torques)
        if status == OK:
            np.testing.assert_allclose(rates[:, order] @ torques, -twists @ load, atol=1e-9 * np.abs(torques).max())
        # Fewer actuators than degrees of freedom do not determine the pose.
        assert (library.robot.forward is None) == (library.count < library.robot.freedoms)
        library.start()
        status, position, rotation = library.forward(driven[order], *library.home)
        assert status == (OK if library.robot.forward else SINGULAR)
        if status == OK:
            np.testing.assert_allclose(position, p, atol=1e-9)
            np.testing.assert_allclose(rotation, R, atol=1e-9)

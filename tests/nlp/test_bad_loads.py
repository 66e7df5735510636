"""Faults in tables of loads, motions, gravity and limits on actuators: one sentence with file, key and value."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from builders import Run, case_from, edited, refusal_of, saved, saved_with_robot

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, CaseError, Limits, Units, load_case
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from screwsynth.nlp.case.loads import Load, Loading, Motion

CASE = """\
title = "loads"
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 8, x3 = 10, x4 = { min = 5, max = 20 } }
[pose]
position = [0, 0, 30]
[[task]]
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
"""
LOAD = "[[load]]\nforce = [1, 2, 3]\n"
MOVED = "[motion]\nlinear = 1\n"
VECTOR = "must be a list of 3 numbers"
NO_LOAD = "load[0]: is no load: give force, moment, any or mass"
BESIDE = "cannot stand beside mass; write another [[load]]"


class Fault(NamedTuple):
    """What is added to the case, and the sentence after the file's name, or its beginning."""

    tables: str
    sentence: str


FAULTS = {
    # -- masses and gravity
    "mass in millimetres": Fault(
        '[units]\nlength = "mm"\n[[load]]\nmass = 2',
        "gravity.acceleration: is missing: a mass times it is a weight in N, [0, 0, -9.81] for a mass in kg\n",
    ),
    "mass in pounds": Fault(
        '[units]\nforce = "lbf"\n[[load]]\nmass = 2',
        "gravity.acceleration: is missing: a mass times it is a weight in lbf\n",
    ),
    "gravity without a number": Fault(
        '[units]\nlength = "mm"\n[gravity]\n[[load]]\nmass = 2', "gravity.acceleration: is missing"
    ),
    "gravity of zero": Fault("[gravity]\nacceleration = [0, 0, 0]", "gravity.acceleration: must not be zero"),
    "gravity as a number": Fault("[gravity]\nacceleration = 9.81", f"gravity.acceleration = 9.81: {VECTOR}"),
    "gravity of NaN": Fault("[gravity]\nacceleration = [0, 0, nan]", "gravity.acceleration[2] = nan: must be finite"),
    "gravity too large": Fault(
        "[gravity]\nacceleration = [0, 0, 1e300]", "gravity.acceleration[2] = 1e+300: must be at most 1e+30 in size"
    ),
    "gravity misspelt": Fault(
        "[gravity]\naccelerations = [0, 0, 1]",
        "gravity.accelerations: no such key; did you mean 'acceleration'? allowed: acceleration",
    ),
    "mass below 0": Fault("[[load]]\nmass = -2", "load[0].mass = -2: must be greater than 0"),
    "mass of 0": Fault("[[load]]\nmass = 0", "load[0].mass = 0: must be greater than 0"),
    "mass of NaN": Fault("[[load]]\nmass = nan", "load[0].mass = nan: must be finite"),
    "mass as text": Fault('[[load]]\nmass = "2 kg"', 'load[0].mass = "2 kg": must be a number'),
    "mass too large": Fault("[[load]]\nmass = 1e31", "load[0].mass = 1e+31: must be at most 1e+30 in size"),
    "mass and force": Fault("[[load]]\nmass = 2\nforce = [1, 2, 3]", f"load[0].force: {BESIDE}"),
    "mass and moment": Fault("[[load]]\nmass = 2\nmoment = [1, 2, 3]", f"load[0].moment: {BESIDE}"),
    "mass and point": Fault("[[load]]\nmass = 2\npoint = [1, 2, 3]", f"load[0].point: {BESIDE}"),
    "mass and any": Fault("[[load]]\nmass = 2\nany = { force = 1 }", f"load[0].any: {BESIDE}"),
    "mass and sign": Fault('[[load]]\nmass = 2\nsign = "both"', f"load[0].sign: {BESIDE}"),
    "mass and frame": Fault('[[load]]\nmass = 2\nframe = "platform"', f"load[0].frame: {BESIDE}"),
    "centre without mass": Fault(
        "[[load]]\nforce = [0, 0, 1]\ncentre = [0, 0, 1]",
        "load[0].centre: means nothing without mass; a force acts at point",
    ),
    # -- loads
    "no load": Fault("[[load]]", NO_LOAD),
    "name alone": Fault('[[load]]\nname = "a"', NO_LOAD),
    "force of zero": Fault("[[load]]\nforce = [0, 0, 0]\nmoment = [0, 0, 0]", NO_LOAD),
    "any of nothing": Fault("[[load]]\nany = { force = 0 }", NO_LOAD),
    "force of NaN": Fault("[[load]]\nforce = [nan, 0, 0]", "load[0].force[0] = nan: must be finite"),
    "moment that is infinite": Fault("[[load]]\nmoment = [0, inf, 0]", "load[0].moment[1] = inf: must be finite"),
    "force of two numbers": Fault("[[load]]\nforce = [1, 2]", "load[0].force: must have 3 entries, got 2"),
    "force as a number": Fault("[[load]]\nforce = 5", f"load[0].force = 5: {VECTOR}"),
    "moment as a number": Fault("[[load]]\nmoment = 5", f"load[0].moment = 5: {VECTOR}"),
    "centre as a number": Fault("[[load]]\nmass = 1\ncentre = 5", f"load[0].centre = 5: {VECTOR}"),
    "force with text": Fault('[[load]]\nforce = [1, "a", 3]', 'load[0].force[1] = "a": must be a number'),
    "force too large": Fault(
        "[[load]]\nforce = [1e300, 0, 0]", "load[0].force[0] = 1e+300: must be at most 1e+30 in size"
    ),
    "any below 0": Fault(
        "[[load]]\nany = { force = -1 }", "load[0].any.force = -1: must be greater than or equal to 0"
    ),
    "any of NaN": Fault("[[load]]\nany = { moment = nan }", "load[0].any.moment = nan: must be finite"),
    "any as a number": Fault("[[load]]\nany = 3", "load[0].any = 3: must be a table"),
    "any misspelt": Fault(
        "[[load]]\nany = { forces = 3 }",
        "load[0].any.forces: no such key; did you mean 'force'? allowed: force, moment",
    ),
    "sign of any": Fault(
        '[[load]]\nany = { force = 2 }\nsign = "both"',
        'load[0].sign = "both": means nothing without force or moment',
    ),
    "sign misspelt": Fault(
        '[[load]]\nforce = [1, 0, 0]\nsign = "plus"', "load[0].sign = \"plus\": must be one of 'given' or 'both'"
    ),
    "another frame": Fault(
        '[[load]]\nforce = [1, 0, 0]\nframe = "tool"', "load[0].frame = \"tool\": must be one of 'world' or 'platform'"
    ),
    "always as a number": Fault("[[load]]\nforce = [1, 0, 0]\nalways = 1", "load[0].always = 1: must be true or false"),
    "load misspelt": Fault(
        "[[load]]\nforces = [1, 0, 0]", "load[0].forces: no such key; did you mean 'force'? allowed: "
    ),
    "loads misspelt": Fault("[[loads]]\nforce = [1, 0, 0]", "loads: no such key; did you mean 'load'? allowed: "),
    "one bracket": Fault(
        "[load]\nforce = [1, 0, 0]", "load: must be a list of tables: write [[load]], with two brackets"
    ),
    "one name": Fault(
        '[[load]]\nname = "a"\nforce = [1, 0, 0]\n[[load]]\nname = "a"\nmass = 2',
        'load[1].name = "a": is used by an earlier load',
    ),
    "name of a load without one": Fault(
        '[[load]]\nname = "load 2"\nforce = [1, 0, 0]\n[[load]]\nmass = 2',
        'load[1].name = "load 2": is used by an earlier load',
    ),
    "name of an opposite load": Fault(
        '[[load]]\nname = "cut"\nforce = [1, 0, 0]\nsign = "both"\n[[load]]\nname = "cut reversed"\nforce = [0, 1, 0]',
        "load: has loads that act together under one name, 'cut reversed', twice; rename a load",
    ),
    "empty name": Fault('[[load]]\nname = ""\nforce = [1, 0, 0]', 'load[0].name = "": must not be empty'),
    "name as a number": Fault("[[load]]\nname = 3\nforce = [1, 0, 0]", "load[0].name = 3: must be text in quotes"),
    "too many signs": Fault(
        '[[load]]\nforce = [1, 0, 0]\nsign = "both"\nalways = true\n' * 30,
        "load: has 30 loads with always and both signs, which act together in 2^30 ways; at most 6",
    ),
    # -- motion
    "no motion": Fault("[motion]", "motion: must have linear, angular, or both, above 0"),
    "motion of zero": Fault("[motion]\nlinear = 0\nangular = 0", "motion: must have linear, angular, or both, above 0"),
    "speed below 0": Fault("[motion]\nlinear = -1", "motion.linear = -1: must be greater than or equal to 0"),
    "speed of NaN": Fault("[motion]\nangular = nan", "motion.angular = nan: must be finite"),
    "speed as text": Fault('[motion]\nlinear = "1 m/s"', 'motion.linear = "1 m/s": must be a number'),
    "speed too large": Fault("[motion]\nlinear = 1e31", "motion.linear = 1e+31: must be at most 1e+30 in size"),
    "motion misspelt": Fault(
        "[motion]\nliner = 1", "motion.liner: no such key; did you mean 'linear'? allowed: linear, angular"
    ),
    "two motions": Fault("[[motion]]\nlinear = 1", "motion: must be a table"),
    # -- limits
    "force without loads": Fault(
        "[limits]\nactuator_force = { max = 3 }", "limits.actuator_force: means nothing without [[load]]"
    ),
    "power without loads": Fault(
        f"{MOVED}[limits]\nactuator_power = {{ max = 3 }}", "limits.actuator_power: means nothing without [[load]]"
    ),
    "power without motion": Fault(
        f"{LOAD}[limits]\nactuator_power = {{ max = 3 }}", "limits.actuator_power: means nothing without [motion]"
    ),
    "speed without motion": Fault(
        f"{LOAD}[limits]\nactuator_speed = {{ max = 3 }}", "limits.actuator_speed: means nothing without [motion]"
    ),
    "no number": Fault(f"{LOAD}[limits]\nactuator_force = {{}}", "limits.actuator_force: must have min, max, or both"),
    "no largest power": Fault(f"{LOAD}{MOVED}[limits]\nactuator_power = {{}}", "limits.actuator_power.max: is missing"),
    "a number alone": Fault(f"{LOAD}[limits]\nactuator_force = 3", "limits.actuator_force = 3: must be a table"),
    "a list": Fault(f"{LOAD}[limits]\nactuator_force = [3]", "limits.actuator_force: must be a table"),
    "min above max": Fault(
        f"{LOAD}[limits]\nactuator_force = {{ min = 3, max = 2 }}",
        "limits.actuator_force.min = 3.0: must be below max = 2 N",
    ),
    "min above max of one": Fault(
        f'{LOAD}[limits]\nactuator_force = {{ "1+" = {{ min = 3, max = 2 }} }}',
        "limits.actuator_force.1+.min = 3.0: must be below max = 2 N",
    ),
    "largest force of 0": Fault(
        f"{LOAD}[limits]\nactuator_force = {{ max = 0 }}", "limits.actuator_force.max = 0.0: must be above 0 N"
    ),
    "largest force of NaN": Fault(
        f"{LOAD}[limits]\nactuator_force = {{ max = nan }}", "limits.actuator_force.max = nan: must be finite"
    ),
    "largest speed below 0": Fault(
        f"{MOVED}[limits]\nactuator_speed = {{ max = -1 }}", "limits.actuator_speed.max = -1.0: must be above 0 m/s"
    ),
    "largest power of 0": Fault(
        f"{LOAD}{MOVED}[limits]\nactuator_power = {{ max = 0 }}",
        "limits.actuator_power.max = 0.0: must be above 0 N m/s",
    ),
    "smallest speed": Fault(
        f"{MOVED}[limits]\nactuator_speed = {{ min = 1 }}", "limits.actuator_speed.min: no such key; allowed: max"
    ),
    "limit misspelt": Fault(
        f"{LOAD}[limits]\nactuator_force = {{ maxi = 3 }}",
        "limits.actuator_force.maxi: no such key; did you mean 'max'? allowed: min, max",
    ),
    "limit of one misspelt": Fault(
        f'{LOAD}[limits]\nactuator_force = {{ "1+" = {{ maxi = 3 }} }}',
        "limits.actuator_force.1+.maxi: no such key; did you mean 'max'? allowed: min, max",
    ),
    "unknown actuator": Fault(
        f'{LOAD}[limits]\nactuator_force = {{ "3*" = {{ max = 3 }} }}',
        "limits.actuator_force.3*: is no actuator of 'stewart-gough'; ",
    ),
    "numbers beside a table": Fault(
        f'{LOAD}[limits]\nactuator_force = {{ max = 4, "1+" = {{ max = 3 }} }}',
        "limits.actuator_force: has numbers for all actuators beside a table for one; "
        "write one table for each actuator\n",
    ),
    "force as a unit": Fault("[units]\nforce = 3", "units.force = 3: must be text in quotes"),
}

#: A plane robot with two cranks and a driven slide; and with two more motors.
MIXED = """\
name = "mixed"
description = "two driven cranks and a driven slide in a plane"
home = [0, 0, 0]
[dimensions]
rb = { typical = 1.0, description = "radius of the base's hinges" }
[[limb]]
repeat = { angles = [0, 120] }
points = { B = ["rb", 0, 0], E = [0.67, 0.4, 0], A = [0.34, 0.07, 0] }
joints = [
    { type = "R", at = "B", axis = "z", actuated = true },
    { type = "R", at = "E", axis = "z" },
    { type = "R", at = "A", axis = "z" },
]
[[limb]]
repeat = { angles = [240] }
points = { B = ["rb", 0, 0], A = [0.34, 0.07, 0] }
joints = [
    { type = "R", at = "B", axis = "z" },
    { type = "P", at = "B", axis = "A - B", actuated = true },
    { type = "R", at = "A", axis = "z" },
]
"""
MORE = edited(MIXED, ('at = "E", axis = "z"', 'at = "E", axis = "z", actuated = true'))
PLANE = """\
[robot]
file = "robot.toml"
parameters = { rb = 1.0 }
[pose]
position = [0.01, 0.02, 0]
[[task]]
sense = "max"
axis = [0, 0, 1]
point = [0, 0, 0]
pitch = 0
"""
KINDS = "means actuators that turn and actuators that slide; give one table for each, by its name: 1, 2, 3\n"
REDUNDANT = (
    "is not for 'mixed': it has 5 actuators for 3 freedoms, so that they can load each other with forces that no load "
    "determines\n"
)
IDLE = "does no work in any motion of 'mixed': its actuators do not hold it; allowed is a load"
#: Robot, tables and sentence.
OF_ROBOTS = {
    "force of two kinds": (MIXED, f"{LOAD}[limits]\nactuator_force = {{ max = 3 }}", f"limits.actuator_force: {KINDS}"),
    "speed of two kinds": (
        MIXED,
        f"{MOVED}[limits]\nactuator_speed = {{ max = 3 }}",
        f"limits.actuator_speed: {KINDS}",
    ),
    "unknown actuator": (
        MIXED,
        f'{LOAD}[limits]\nactuator_force = {{ "4" = {{ max = 3 }} }}',
        "limits.actuator_force.4: is no actuator of 'mixed'; allowed: 1, 2, 3\n",
    ),
    "load on more actuators": (MORE, LOAD, f"load: {REDUNDANT}"),
    "motion of more actuators": (MORE, MOVED, "motion: is not for 'mixed': it has 5 actuators for 3 freedoms"),
    "weight on a plane": (
        MIXED,
        '[[load]]\nname = "tool"\nmass = 2\ncentre = [1, 0, 0]',
        f"load[0].mass = 2.0: load 'tool' {IDLE} with a force along x or y, or a moment about z\n",
    ),
    "force out of a plane": (
        MIXED,
        f"{LOAD}[[load]]\nforce = [0, 0, 5]",
        f"load[1].force = [0.0, 0.0, 5.0]: load 'load 2' {IDLE} with a force along x or y, or a moment about z\n",
    ),
    "force and moment out of a plane": (
        MIXED,
        '[[load]]\nforce = [0, 0, 5]\nmoment = [1, 2, 0]\nframe = "platform"',
        f"load[0]: load 'load 1' {IDLE} with a force along x or y, or a moment about z\n",
    ),
    "limit on more actuators": (
        MORE,
        "[limits]\nactuator_force = { max = 3 }",
        f"limits.actuator_force: {REDUNDANT}",
    ),
}


def text_with(tables: str) -> str:
    return f"{CASE}{tables}\n"


def test_the_case_without_a_fault_is_read() -> None:
    assert case_from(text_with(f"{LOAD}{MOVED}[limits]\nactuator_force = {{ max = 3 }}")).loading.loads


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_one_sentence(name: str, tmp_path: Path, cli: Run) -> None:
    tables, sentence = FAULTS[name]
    path = saved(tmp_path / "broken.toml", text_with(tables))
    err = refusal_of(cli("solve", str(path)))
    assert err.startswith(f"screwsynth: broken.toml: {sentence}"), err


@pytest.mark.parametrize("name", OF_ROBOTS)
def test_what_a_robot_does_not_have_is_one_sentence(name: str, tmp_path: Path, cli: Run) -> None:
    robot, tables, sentence = OF_ROBOTS[name]
    path = saved_with_robot(tmp_path, robot, PLANE + tables)
    err = refusal_of(cli("solve", path))
    assert err.startswith(f"screwsynth: case.toml: {sentence}"), err


def test_a_robot_with_actuators_of_two_kinds_has_limits_by_actuator_and_one_power(tmp_path: Path) -> None:
    limits = '[limits]\nactuator_force = { "1" = { max = 3 }, "3" = { min = -5 } }\nactuator_power = { max = 9 }'
    path = saved_with_robot(tmp_path, MIXED, f"{PLANE}{LOAD}{MOVED}{limits}")
    assert [each.name for each in load_case(path).limits] == [
        "actuator_force.1", "actuator_force.3", "actuator_power",
    ]  # fmt: skip


#: The same in Python: a loading, limits, and the sentence.
IN_PYTHON = {
    "mass and any": (Loading((Load(mass=1.0, any_force=2.0),)), (), r"load\[0\]\.mass = 1\.0: cannot stand beside"),
    "mass and both": (Loading((Load(mass=1.0, both_signs=True),)), (), r"load\[0\]\.mass = 1\.0: cannot stand beside"),
    "mass and force": (Loading((Load("a", (1, 0, 0), mass=1.0),)), (), r"load\[0\]\.mass = 1\.0: cannot stand beside"),
    "mass below 0": (Loading((Load(mass=-1.0),)), (), r"load\[0\]\.mass = -1\.0: must be at least 0"),
    "mass of NaN": (Loading((Load(mass=float("nan")),)), (), r"load\[0\]\.mass = nan: must be at least 0 and finite"),
    "any of NaN": (Loading((Load(any_moment=float("nan")),)), (), r"load\[0\]\.any\.moment = nan: must be at least 0"),
    "force of NaN": (Loading((Load("a", (0, float("nan"), 0)),)), (), r"load\[0\]\.force: must be three finite"),
    "force as text": (Loading((Load("a", "abc"),)), (), r"load\[0\]\.force\[0\]: must be a number, got str 'a'"),
    "two numbers": (Loading((Load("a", (1, 2)),)), (), r"load\[0\]\.force: must be three finite numbers"),
    "nothing": (Loading((Load(),)), (), r"load\[0\]: is no load"),
    "empty name": (Loading((Load("", (1, 0, 0)),)), (), r'load\[0\]\.name = "": must not be empty'),
    "speed below 0": (Loading((), Motion(-1.0)), (), r"motion\.linear = -1\.0: must be at least 0 and finite"),
    "no speed": (Loading((), Motion()), (), r"motion: must have linear, angular, or both"),
    "gravity": (Loading((), None, (0.0, 0.0)), (), r"gravity\.acceleration: must be three finite numbers"),
    "limit": (Loading(), (ActuatorForce(max=2.0),), r"limits\.actuator_force: means nothing without \[\[load\]\]"),
    "force": (
        Loading((Load("a", (1, 0, 0)),)),
        (ActuatorForce("1+", max=float("nan")),),
        r"limits\.actuator_force\.1\+\.max = nan: must be above 0 N",
    ),
    "no number": (Loading((Load("a", (1, 0, 0)),)), (ActuatorForce("1+"),), r"limits\.actuator_force\.1\+: must have"),
    "no speed's number": (Loading((), Motion(1.0)), (ActuatorSpeed(),), r"limits\.actuator_speed"),
    "no power's number": (
        Loading((Load("a", (1, 0, 0)),), Motion(1.0)),
        (ActuatorPower("1+"),),
        r"limits\.actuator_power\.1\+",
    ),
}


@pytest.mark.parametrize("name", IN_PYTHON)
def test_a_case_made_in_python_is_refused_in_the_same_words(name: str) -> None:
    loading, limits, sentence = IN_PYTHON[name]
    model = stewart_gough()
    case = case_from(text_with(""))
    with pytest.raises(CaseError, match=sentence):
        Case(
            model, dict(case.parameters), case.position, case.tasks, units=Units("m"),
            loading=loading, limits=Limits(*limits),
        )  # fmt: skip

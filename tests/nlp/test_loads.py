"""Loads: faults in their tables, deflections against a stiffness matrix computed here, and arrows in pictures."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, edited, output_of, refusal_of, saved, saved_with_robot

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, CaseError, Limits, Rotation, Solution, Task, Units, build_model, load_case, solve
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed, Deflection
from screwsynth.nlp.case.limits.limit import Limit
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.sections import sections
from screwsynth.nlp.results.result import result_of

CASE = """\
title = "loads"
robot = { model = "stewart-gough", parameters = { x1 = 12, x2 = 8, x3 = 10, x4 = { min = 5, max = 20 } } }
pose.position = [0, 0, 30]
task = [{ sense = "max", axis = [2, 2, 1], point = [2, 3, 6], pitch = 1 }]
"""
LOAD = "[[load]]\nforce = [1, 2, 3]\n"
MOVED = "[motion]\nlinear = 1\n"
VECTOR = "must be a list of 3 numbers"
NO_LOAD = "load[0]: is empty: give force, moment, any or mass"
BESIDE = "conflicts with mass; write another [[load]]"


#: What is added to the case, and the sentence after the file's name, or its beginning.
FAULTS = {
    '[units]\nlength = "mm"\n[[load]]\nmass = 2': (
        "gravity.acceleration: is missing: give [gravity] acceleration in units in which "
        "mass times acceleration is in N, such as "
        "[0, 0, -9.81] for a mass in kg\n"
    ),
    '[units]\nforce = "lbf"\n[[load]]\nmass = 2': (
        "gravity.acceleration: is missing: give [gravity] acceleration in units in which "
        "mass times acceleration is in lbf\n"
    ),
    '[units]\nlength = "mm"\n[gravity]\n[[load]]\nmass = 2': "gravity.acceleration: is missing",
    "[gravity]\nacceleration = [0, 0, 0]": "gravity.acceleration: must not be zero",
    "[gravity]\nacceleration = 9.81": f"gravity.acceleration = 9.81: {VECTOR}",
    "[gravity]\nacceleration = [0, 0, nan]": "gravity.acceleration[2] = nan: must be finite",
    "[gravity]\nacceleration = [0, 0, 1e300]": "gravity.acceleration[2] = 1e+300: must be at most 1e+30 in magnitude",
    "[gravity]\naccelerations = [0, 0, 1]": (
        "gravity.accelerations: no such key; did you mean 'acceleration'? allowed: acceleration"
    ),
    "[[load]]": NO_LOAD,
    '[[load]]\nname = "a"': NO_LOAD,
    "[[load]]\nforce = [0, 0, 0]\nmoment = [0, 0, 0]": NO_LOAD,
    "[[load]]\nany = { force = 0 }": NO_LOAD,
    "[[loads]]\nforce = [1, 0, 0]": "loads: no such key; did you mean 'load'? allowed: ",
    "[load]\nforce = [1, 0, 0]": "load: must be a list of tables: write [[load]], with two brackets",
    '[[load]]\nname = "a"\nforce = [1, 0, 0]\n[[load]]\nname = "a"\nmass = 2': (
        'load[1].name = "a": is used by an earlier load'
    ),
    '[[load]]\nname = "load 2"\nforce = [1, 0, 0]\n[[load]]\nmass = 2': (
        'load[1].name = "load 2": is used by an earlier load'
    ),
    '[[load]]\nname = "cut"\nforce = [1, 0, 0]\nsign = "both"\n[[load]]\nname = "cut reversed"\nforce = [0, 1, 0]': (
        "load: gives two load cases with the name 'cut reversed'; rename a load"
    ),
    '[[load]]\nforce = [1, 0, 0]\nsign = "both"\nalways = true\n' * 30: (
        "load: must have at most 6 loads with always = true and both signs, got 30: they give 2^30 load cases"
    ),
    "[motion]": "motion: is empty: give linear, angular, or both, above 0",
    "[motion]\nlinear = 0\nangular = 0": "motion: is empty: give linear, angular, or both, above 0",
    "[motion]\nlinear = -1": "motion.linear = -1: must be greater than or equal to 0",
    "[motion]\nangular = nan": "motion.angular = nan: must be finite",
    '[motion]\nlinear = "1 m/s"': 'motion.linear = "1 m/s": must be a number',
    "[motion]\nlinear = 1e31": "motion.linear = 1e+31: must be at most 1e+30 in magnitude",
    "[motion]\nliner = 1": "motion.liner: no such key; did you mean 'linear'? allowed: linear, angular",
    "[[motion]]\nlinear = 1": "motion: must be a table",
    "[limits]\nactuator_force = { max = 3 }": "limits.actuator_force: needs a table [[load]]",
    "[units]\nforce = 3": "units.force = 3: must be text in quotes",
}
#: What is written below [[load]], and the rest of the sentence.
OF_LOADS = {
    "mass = -2": ".mass = -2: must be greater than 0",
    "mass = 0": ".mass = 0: must be greater than 0",
    "mass = nan": ".mass = nan: must be finite",
    'mass = "2 kg"': '.mass = "2 kg": must be a number',
    "mass = 1e31": ".mass = 1e+31: must be at most 1e+30 in magnitude",
    "mass = 2\nforce = [1, 2, 3]": f".force: {BESIDE}",
    "mass = 2\nmoment = [1, 2, 3]": f".moment: {BESIDE}",
    "mass = 2\npoint = [1, 2, 3]": f".point: {BESIDE}",
    "mass = 2\nany = { force = 1 }": f".any: {BESIDE}",
    'mass = 2\nsign = "both"': f".sign: {BESIDE}",
    'mass = 2\nframe = "platform"': f".frame: {BESIDE}",
    "force = [0, 0, 1]\ncentre = [0, 0, 1]": ".centre: has no effect without mass; for a force, use point",
    "force = [nan, 0, 0]": ".force[0] = nan: must be finite",
    "moment = [0, inf, 0]": ".moment[1] = inf: must be finite",
    "force = [1, 2]": ".force: must have 3 entries, got 2",
    "force = 5": f".force = 5: {VECTOR}",
    "moment = 5": f".moment = 5: {VECTOR}",
    "mass = 1\ncentre = 5": f".centre = 5: {VECTOR}",
    'force = [1, "a", 3]': '.force[1] = "a": must be a number',
    "force = [1e300, 0, 0]": ".force[0] = 1e+300: must be at most 1e+30 in magnitude",
    "any = { force = -1 }": ".any.force = -1: must be greater than or equal to 0",
    "any = { moment = nan }": ".any.moment = nan: must be finite",
    "any = 3": ".any = 3: must be a table",
    "any = { forces = 3 }": ".any.forces: no such key; did you mean 'force'? allowed: force, moment",
    'any = { force = 2 }\nsign = "both"': '.sign = "both": has no effect without force or moment; remove it',
    'force = [1, 0, 0]\nsign = "plus"': ".sign = \"plus\": must be one of 'given' or 'both'",
    'force = [1, 0, 0]\nframe = "tool"': ".frame = \"tool\": must be one of 'world' or 'platform'",
    "force = [1, 0, 0]\nalways = 1": ".always = 1: must be true or false",
    "forces = [1, 0, 0]": ".forces: no such key; did you mean 'force'? allowed: ",
    'name = ""\nforce = [1, 0, 0]': '.name = "": must not be empty',
    "name = 3\nforce = [1, 0, 0]": ".name = 3: must be text in quotes",
}
FAULTS |= {f"[[load]]\n{table}": f"load[0]{sentence}" for table, sentence in OF_LOADS.items()}
#: What stands before [limits], a limit, and the rest of the sentence.
OF_LIMITS = [
    (MOVED, "actuator_power = { max = 3 }", "actuator_power: needs a table [[load]] with a load on the platform"),
    (LOAD, "actuator_power = { max = 3 }", "actuator_power: needs [motion], the largest speeds"),
    (LOAD, "actuator_speed = { max = 3 }", "actuator_speed: needs [motion], the largest speeds"),
    (LOAD, "actuator_force = {}", "actuator_force: is empty: it must have min, max, or both"),
    (LOAD + MOVED, "actuator_power = {}", "actuator_power.max: is missing"),
    (LOAD, "actuator_force = 3", "actuator_force = 3: must be a table"),
    (LOAD, "actuator_force = [3]", "actuator_force: must be a table"),
    (LOAD, "actuator_force = { min = 3, max = 2 }", "actuator_force.min = 3.0: must be below max = 2 N"),
    (LOAD, 'actuator_force = { "1+" = { min = 3, max = 2 } }', "actuator_force.1+.min = 3.0: must be below max = 2 N"),
    (LOAD, "actuator_force = { max = 0 }", "actuator_force.max = 0.0: must be above 0 N"),
    (LOAD, "actuator_force = { max = nan }", "actuator_force.max = nan: must be finite"),
    (MOVED, "actuator_speed = { max = -1 }", "actuator_speed.max = -1.0: must be above 0 m/s"),
    (LOAD + MOVED, "actuator_power = { max = 0 }", "actuator_power.max = 0.0: must be above 0 N m/s"),
    (MOVED, "actuator_speed = { min = 1 }", "actuator_speed.min: no such key; allowed: max"),
    (LOAD, "actuator_force = { maxi = 3 }", "actuator_force.maxi: no such key; did you mean 'max'? allowed: min, max"),
    (
        LOAD,
        'actuator_force = { "1+" = { maxi = 3 } }',
        "actuator_force.1+.maxi: no such key; did you mean 'max'? allowed: min, max",
    ),
    (LOAD, 'actuator_force = { "3*" = { max = 3 } }', "actuator_force.3*: no such actuator of 'stewart-gough'; "),
    (
        LOAD,
        'actuator_force = { max = 4, "1+" = { max = 3 } }',
        "actuator_force: has both numbers for all actuators and a table for one; write a table for each actuator\n",
    ),
]
FAULTS |= {f"{given}[limits]\n{limit}": f"limits.{sentence}" for given, limit, sentence in OF_LIMITS}

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
robot = { file = "robot.toml", parameters = { rb = 1.0 } }
pose.position = [0.01, 0.02, 0]
task = [{ sense = "max", axis = [0, 0, 1], point = [0, 0, 0], pitch = 0 }]
"""
KINDS = "matches both revolute and prismatic actuators; give one table for each, by name: 1, 2, 3\n"
REDUNDANT = (
    "is not supported for the robot 'mixed': it has 5 actuators for 3 degrees of freedom, so internal forces between "
    "actuators are not determined by the load\n"
)
IDLE = "does no work in any motion of 'mixed', so no actuator balances it; give"
#: Robot, tables and sentence.
OF_ROBOTS = [
    (MIXED, f"{LOAD}[limits]\nactuator_force = {{ max = 3 }}", f"limits.actuator_force: {KINDS}"),
    (MIXED, f"{MOVED}[limits]\nactuator_speed = {{ max = 3 }}", f"limits.actuator_speed: {KINDS}"),
    (
        MIXED,
        f'{LOAD}[limits]\nactuator_force = {{ "4" = {{ max = 3 }} }}',
        "limits.actuator_force.4: no such actuator of 'mixed'; allowed: 1, 2, 3\n",
    ),
    (MORE, LOAD, f"load: {REDUNDANT}"),
    (MORE, MOVED, "motion: is not supported for the robot 'mixed': it has 5 actuators for 3 degrees of freedom"),
    (
        MIXED,
        '[[load]]\nname = "tool"\nmass = 2\ncentre = [1, 0, 0]',
        f'load[0].mass = 2.0: load "tool" {IDLE} a force along x or y, or a moment about z\n',
    ),
    (
        MIXED,
        f"{LOAD}[[load]]\nforce = [0, 0, 5]",
        f"load[1].force = [0.0, 0.0, 5.0]: load 2 {IDLE} a force along x or y, or a moment about z\n",
    ),
    (
        MIXED,
        '[[load]]\nforce = [0, 0, 5]\nmoment = [1, 2, 0]\nframe = "platform"',
        f"load[0]: load 1 {IDLE} a force along x or y, or a moment about z\n",
    ),
    (MORE, "[limits]\nactuator_force = { max = 3 }", f"limits.actuator_force: {REDUNDANT}"),
]


def test_cases_without_a_fault_are_read(tmp_path: Path) -> None:
    assert case_from(f"{CASE}{LOAD}{MOVED}[limits]\nactuator_force = {{ max = 3 }}").loading.loads
    limits = '[limits]\nactuator_force = { "1" = { max = 3 }, "3" = { min = -5 } }\nactuator_power = { max = 9 }'
    case = load_case(saved_with_robot(tmp_path, MIXED, f"{PLANE}{LOAD}{MOVED}{limits}"))
    assert [each.name for each in case.limits] == ["actuator_force.1", "actuator_force.3", "actuator_power"]


@pytest.mark.parametrize("tables", FAULTS)
def test_a_fault_is_one_sentence(tables: str, tmp_path: Path, cli: Run) -> None:
    err = refusal_of(cli("solve", str(saved(tmp_path / "broken.toml", f"{CASE}{tables}\n"))))
    assert err.startswith(f"screwsynth: broken.toml: {FAULTS[tables]}"), err


@pytest.mark.parametrize(("robot", "tables", "sentence"), OF_ROBOTS)
def test_what_a_robot_does_not_have_is_one_sentence(
    robot: str, tables: str, sentence: str, tmp_path: Path, cli: Run
) -> None:
    err = refusal_of(cli("solve", saved_with_robot(tmp_path, robot, PLANE + tables)))
    assert err.startswith(f"screwsynth: case.toml: {sentence}"), err


#: The same in Python: a loading, limits, and the sentence.
IN_PYTHON = [
    (Loading((Load(mass=1.0, any_force=2.0),)), (), r"load\[0\]\.mass = 1\.0: conflicts with"),
    (Loading((Load(mass=1.0, both_signs=True),)), (), r"load\[0\]\.mass = 1\.0: conflicts with"),
    (Loading((Load("a", (1, 0, 0), mass=1.0),)), (), r"load\[0\]\.mass = 1\.0: conflicts with"),
    (Loading((Load(mass=-1.0),)), (), r"load\[0\]\.mass = -1\.0: must be at least 0"),
    (Loading((Load(mass=float("nan")),)), (), r"load\[0\]\.mass = nan: must be at least 0 and finite"),
    (Loading((Load(any_moment=float("nan")),)), (), r"load\[0\]\.any\.moment = nan: must be at least 0"),
    (Loading((Load("a", (0, float("nan"), 0)),)), (), r"load\[0\]\.force = .*: must be three finite"),
    (Loading((Load("a", "abc"),)), (), r"load\[0\]\.force\[0\]: must be a number, got str 'a'"),
    (Loading((Load("a", (1, 2)),)), (), r"load\[0\]\.force = .*: must be three finite numbers"),
    (Loading((Load(),)), (), r"load\[0\]: is empty"),
    (Loading((Load("", (1, 0, 0)),)), (), r'load\[0\]\.name = "": must not be empty'),
    (Loading((), Motion(-1.0)), (), r"motion\.linear = -1\.0: must be at least 0 and finite"),
    (Loading((), Motion()), (), r"motion: is empty: give linear, angular, or both"),
    (Loading((), None, (0.0, 0.0)), (), r"gravity\.acceleration = .*: must be three finite numbers"),
    (Loading(), (ActuatorForce(max=2.0),), r"limits\.actuator_force: needs a table \[\[load\]\]"),
    (
        Loading((Load("a", (1, 0, 0)),)),
        (ActuatorForce("1+", max=float("nan")),),
        r"limits\.actuator_force\.1\+\.max = nan: must be above 0 N",
    ),
    (Loading((Load("a", (1, 0, 0)),)), (ActuatorForce("1+"),), r"limits\.actuator_force\.1\+: is empty: it must have"),
    (Loading((), Motion(1.0)), (ActuatorSpeed(),), r"limits\.actuator_speed"),
    (Loading((Load("a", (1, 0, 0)),), Motion(1.0)), (ActuatorPower("1+"),), r"limits\.actuator_power\.1\+"),
]


@pytest.mark.parametrize(("loading", "limits", "sentence"), IN_PYTHON)
def test_a_case_made_in_python_is_refused_in_the_same_words(
    loading: Loading, limits: tuple[Limit, ...], sentence: str
) -> None:
    case = case_from(CASE)
    with pytest.raises(CaseError, match=sentence):
        Case(
            stewart_gough(), dict(case.parameters), case.position, case.tasks, units=Units("m"),
            loading=loading, limits=Limits(*limits),
        )  # fmt: skip


SPRINGS = [2000.0, 2500.0, 3000.0, 3500.0, 4000.0, 4500.0]
EACH = '{{ "1-" = {}, "1+" = {}, "2-" = {}, "2+" = {}, "3-" = {}, "3+" = {} }}'.format(*SPRINGS)
HEXAPOD = """\
robot = { model = "stewart-gough", layout = "octahedral", parameters = { x1 = 26.5, x2 = X2, x3 = 0, x4 = 5 }STIFF }
pose = { position = [1, 2, 20], rotation = { axis = [1, 2, 3], angle = 10 } }
task = [{ sense = "SENSE", axis = [0, 0, 1], pitch = inf }]
"""
PUSHED = HEXAPOD + '[[load]]\nname = "cutting"\nforce = [20, 20, -100]\npoint = [0, 0, 2]\n'


def text_of(stiffness: str, x2: str = "11.543", text: str = PUSHED, sense: str = "max") -> str:
    stiff = stiffness and f", actuator_stiffness = {stiffness}"
    return 'units.length = "in"\n' + edited(text, ("STIFF", stiff), ("X2", x2), ("SENSE", sense))


def test_the_platform_moves_as_six_springs_let_it(cli: Run, tmp_path: Path) -> None:
    data = json.loads(output_of(cli("evaluate", str(saved(tmp_path / "case.toml", text_of(EACH))), "--json", "-")))
    position, turn = np.array(data["pose"]["position"]), np.array(data["pose"]["rotation_matrix"])
    J = np.array(data["jacobian"])
    force, moment = J[:, :3], J[:, 3:] - np.cross(position, J[:, :3])
    rows = np.hstack([force, moment])  # rate of each leg by the platform's velocity and its angular velocity
    stiffness = rows.T @ np.diag(SPRINGS) @ rows
    compliance = np.array(data["compliance"])
    assert compliance @ stiffness == pytest.approx(np.eye(6), abs=1e-10)
    load = np.array([20.0, 20.0, -100.0])
    moved = np.linalg.solve(stiffness, np.concatenate([load, np.cross(turn @ [0, 0, 2], load)]))
    (found,) = (each["deflection"] for each in data["loads"])
    assert found["translation"] == pytest.approx(moved[:3], rel=1e-10)
    assert found["rotation"] == pytest.approx(np.degrees(moved[3:]), rel=1e-10)
    assert found["largest"] == pytest.approx(np.linalg.norm(moved[:3]), rel=1e-10)
    # The legs are shorter by their forces over their stiffness.
    forces = np.array([each["value"] for each in data["loads"][0]["actuators"]])
    assert rows @ moved == pytest.approx(-forces / SPRINGS, rel=1e-9, abs=1e-12)


def test_a_load_of_any_direction_moves_it_no_farther_than_said(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "case.toml", text_of(EACH) + "any = { force = 30, moment = 10 }\n")
    data = json.loads(output_of(cli("evaluate", str(path), "--json", "-")))
    (found,) = (each["deflection"] for each in data["loads"])
    compliance, turn = np.array(data["compliance"]), np.array(data["pose"]["rotation_matrix"])
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(2000):
        more, twist = rng.normal(size=(2, 3))
        load = np.array([20.0, 20.0, -100.0]) + 30 * more / np.linalg.norm(more)
        moment = np.cross(turn @ [0, 0, 2], load) + 10 * twist / np.linalg.norm(twist)
        worst = max(worst, float(np.linalg.norm((compliance @ np.concatenate([load, moment]))[:3])))
    assert worst <= found["largest"] <= 2 * worst


def test_a_limit_on_the_deflection_holds_a_design() -> None:
    text = text_of("4000", "{ min = 8, max = 14 }", sense="min") + "[limits]\ndeflection = "
    loose = solve(case_from(text + "{ max = 9 }\n"))
    ends = [margins_of(loose.nlp, np.array([x]), optimal=False)[0].value for x in (8.0, 14.0)]
    (at_best,) = margins_of(loose.nlp, loose.x, optimal=True)
    assert at_best.cost == 0
    # Half of the way from the best end of the free number to the other one, the limit holds the design.
    other = min(ends)
    assert other < at_best.value
    most = 0.5 * (at_best.value + other)
    held = solve(case_from(text + f"{{ max = {most!r} }}\n"))
    (margin,) = margins_of(held.nlp, held.x, optimal=True)
    assert margin.active
    assert margin.value == pytest.approx(most, rel=1e-8)
    more = solve(case_from(text + f"{{ max = {most * 1.001!r} }}\n"))
    assert margin.cost == pytest.approx((more.F - held.F) / (most * 0.001), rel=1e-2)


def test_the_deflection_of_a_translating_robot_has_no_turn(cli: Run, tmp_path: Path) -> None:
    text = """\
robot = { model = "three-upu", axes = "tsai", actuator_stiffness = 1000, parameters = PARAMETERS }
pose.position = [0.1, -0.1, 0.4]
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
load = [{ force = [2, 2, -10] }]
""".replace("PARAMETERS", "{ base_radius = 0.5, platform_radius = 0.12 }")
    data = json.loads(output_of(cli("evaluate", str(saved(tmp_path / "case.toml", text)), "--json", "-")))
    units = np.array(data["jacobian"])[:3, :3]
    moved = np.linalg.solve(1000 * units.T @ units, [2.0, 2.0, -10.0])
    (found,) = (each["deflection"] for each in data["loads"])
    assert found["translation"] == pytest.approx(moved, rel=1e-10)
    assert found["rotation"] == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("stiffness", "sentence"),
    [
        ("0", "robot.actuator_stiffness = 0.0: must be above 0"),
        ("-3", "must be above 0 and finite"),
        ('{ "1-" = 3 }', "is missing for actuator 1+: give one number for all"),
        (EACH.replace('"3+"', '"4"'), "robot.actuator_stiffness.4: no such actuator"),
    ],
)
def test_stiffness_that_means_nothing_is_refused(stiffness: str, sentence: str) -> None:
    with pytest.raises(CaseError) as error:
        case_from(text_of(stiffness))
    assert sentence in str(error.value)


def test_a_limit_on_the_deflection_needs_loads_and_stiffness() -> None:
    assert case_from(text_of("4000")).loading.stiffness == {"": 4000.0}
    limit = "[limits]\ndeflection = { max = 1 }\n"
    with pytest.raises(CaseError, match=r"deflection: needs robot.actuator_stiffness"):
        case_from(text_of("") + limit)
    with pytest.raises(CaseError, match=r"deflection: needs a table \[\[load\]\]"):
        case_from(text_of("4000", text=HEXAPOD) + limit)
    case = case_from(text_of(EACH) + limit)
    assert case_from(case.to_toml()).to_toml() == case.to_toml()
    assert [each for each in case.limits if isinstance(each, Deflection)] == [Deflection(1.0)]


SIDE = '[[load]]\nname = "side"\nforce = [200, 20, -100]\npoint = [0, 1, 2]\n'
DELTA = """\
robot.model = "delta"
robot.parameters = { rb = 0.164, rp = 0.044, arm = 0.524, rod = 1.244, w = 0.131, tilt = 20 }
pose.position = [0.1, 0, -1.2]
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
"""


@cache
def handling() -> Solution:
    return solve(load_case("handling-3-upu"))


def test_arrows_push_and_pull_the_platform_along_the_legs_to_one_scale() -> None:
    solution = solve(case_from(text_of("", text=HEXAPOD) + SIDE))
    (drawing,) = drawings_of(solution)
    assert drawing.forces is not None
    robot = result_of(solution).robot
    (load,) = robot.loading.loads
    wanted = {each.actuator: each.value for each in load.actuators}
    lengths = {arrow.name: arrow.ends[1] - arrow.ends[0] for arrow in drawing.forces.arrows}
    scale = np.linalg.norm(lengths["side"]) / np.linalg.norm([200, 20, -100])
    assert lengths["side"] == pytest.approx(scale * np.array([200.0, 20.0, -100.0]), rel=1e-9)
    total = np.zeros(3)
    rows = {row.limb: row for row in solution.nlp.program.model.rows}
    for k, name in enumerate(rows):
        arrow = next(each for each in drawing.forces.arrows if each.name == name)
        assert arrow.kind == ("push" if wanted[name] > 0 else "pull")
        along = np.array(robot.jacobian[k][:3])
        assert lengths[name] == pytest.approx(scale * wanted[name] * along, rel=1e-6)
        total += lengths[name]
    # The arrows of legs and load together are no force.
    assert total + lengths["side"] == pytest.approx(np.zeros(3), abs=1e-9 * float(np.linalg.norm(lengths["side"])))
    assert {arrow.kind for arrow in drawing.forces.arrows} == {"load", "push", "pull"}
    assert 'load "side"' in drawing.forces.words


def test_torques_are_told_in_words_and_no_forces_have_no_arrows_and_no_scale() -> None:
    (without,) = drawings_of(solve(case_from(DELTA)))
    assert without.forces is None
    (drawing,) = drawings_of(solve(case_from(DELTA + "[[load]]\nforce = [0, 0, -30]\n")))
    assert drawing.forces is not None
    assert [arrow.kind for arrow in drawing.forces.arrows] == ["load"]
    assert drawing.forces.torques.count("N m") == 3
    (drawing,) = drawings_of(solve(case_from(DELTA + "[[load]]\nany = { force = 5 }\n")))
    assert drawing.forces is not None
    assert drawing.forces.arrows == ()
    assert "longest arrow" not in drawing.forces.words


@pytest.mark.parametrize(
    ("name", "twist"),
    [
        ("3-prs", (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
        ("6-pus", (0.3, -0.5, 0.2, 0.7, 0.4, -0.6)),
        ("planar-3-prr", (0.0, 0.0, 0.8, 0.5, -0.3, 0.0)),
    ],
)
def test_arrows_of_slides_do_the_opposite_work_of_those_of_the_load(name: str, twist: tuple[float, ...]) -> None:
    """In a motion of the platform, with the places of the slides as the drawing has them after it and before it."""
    model = build_model(name)
    values = {item.name: item.typical for item in model.parameters}
    load = Load("cut", (3.0, -2.0, 5.0), (1.0, 2.0, -2.0), (0.1, 0.2, 0.3), in_platform=True)
    case = Case(model, values, model.home, [Task(twist)], Rotation((0, 0, 1), 0.0), loading=Loading((load,)))
    (drawing,) = drawings_of(solve(case))
    assert drawing.forces is not None
    assert drawing.forces.torques == ""
    arrows = {(arrow.kind, arrow.name): arrow.ends for arrow in drawing.forces.arrows}
    held, force, moment = drawing.posture, np.array(load.force), np.array(load.moment)
    point = held.position + held.rotation @ load.point
    lengths = [np.linalg.norm(np.diff(arrows[kind, "cut"], axis=0)) for kind in ("load", "moment")]
    scale, turn = lengths[0] / np.linalg.norm(force), lengths[1] / np.linalg.norm(moment)
    np.testing.assert_allclose(arrows["load", "cut"], [point - scale * force, point], atol=1e-12)
    np.testing.assert_allclose(arrows["moment", "cut"], [point, point + turn * moment], atol=1e-12)
    t = 1e-5
    axes = figure_of([drawing]).axes[0]
    assert {"moment cut", "moment cut second head"} <= {text.get_gid() for text in axes.texts}
    before, after = (drawing.linkage.posture_after(held, np.array(twist), time) for time in (-t, t))
    assert before is not None
    assert after is not None
    work = 0.0
    for k, joint in enumerate(model.scene.joints):
        if joint.is_actuated:
            start, head = arrows["drive", str(joint.limb)]
            np.testing.assert_allclose(start, held.joints[k][0], atol=1e-12)
            work += float((head - start) / scale @ (after.joints[k][0] - before.joints[k][0]) / (2 * t))
    omega, v = np.array(twist[:3]), np.array(twist[3:])
    assert work == pytest.approx(-float(force @ (v + np.cross(omega, point)) + moment @ omega), rel=1e-8)


def test_pictures_of_forces_have_no_rates_and_arrows_the_name_of_their_load() -> None:
    drawing = drawings_of(handling(), 3)[0]
    assert drawing.motion is None
    assert drawing.rows == ()
    assert "smallest F = 7.532144 N (largest over 8 poses). Shown: pose 3" in drawing.headline
    # A force of any direction has no arrow, and the weight that acts with it has one.
    loads = '[[load]]\nname = "tool"\nmass = 2\nalways = true\n[[load]]\nname = "cut"\nany = { force = 5 }\n'
    (drawing,) = drawings_of(solve(case_from(DELTA + loads)))
    assert drawing.forces is not None
    (arrow,) = drawing.forces.arrows
    assert (arrow.kind, arrow.name, arrow.words) == ("load", "tool", "weight of tool: 19.62 N")
    assert drawing.forces.words.startswith('weight of tool, actuator forces under load "cut": longest arrow 19.62 N')
    assert drawings_of(handling(), 1)[0].forces.words.startswith('load "handling": longest arrow')


def test_a_page_has_the_arrows_beside_the_legs_and_the_forces_of_each_pose() -> None:
    solution = handling()
    report = report_of("", solution, result_of(solution))
    (part,) = report.parts
    forces = [pose.F for pose in result_of(solution).robot.several.poses]
    worst = [round(force, 5) for force in forces].index(round(max(forces), 5))
    assert [view["is_worst"] for view in part.views] == [k == worst for k in range(8)]
    for k, (view, drawing) in enumerate(zip(part.views, part.drawings, strict=True)):
        assert view["pose_words"] == f"pose {k + 1} of 8, F = {forces[k]:.7g} N"
        for shown, arrow in zip(view["forces"], drawing.forces.arrows, strict=True):
            ends, way = np.array(shown["ends"]), arrow.ends[1] - arrow.ends[0]
            assert ends[1] - ends[0] == pytest.approx(way, abs=1e-12)
            aside = ends[0] - arrow.ends[0]
            assert abs(aside @ way) <= 1e-12
            wanted = 0.0 if arrow.kind == "load" else 0.045 * drawing.size
            assert float(np.linalg.norm(aside)) == pytest.approx(wanted, rel=1e-9, abs=1e-15)
    words = re.sub(r"<[^>]*>", "", "".join(str(content) for _, _, content in sections(report)))
    assert "the largest actuator force over all actuators and loads" in words
    assert "translation along" not in words
    assert "Rates at this position" not in words
    assert "longest arrow 10.39 N" in words

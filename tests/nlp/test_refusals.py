"""Refusals of the case reader, one row for each kind, with the sentence: file, key, value, and what is allowed."""

from pathlib import Path
from typing import NamedTuple

import pytest
from builders import edited, saved

from screwsynth.nlp import InputError, formulate, load_case

CASE = """\
units = { length = "cm", angle = "deg" }
robot = { model = "stewart-gough", parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = { min = 2, max = 20 } } }
pose = { position = [0, 0, { min = 20, max = 50 }], rotation = { axis = [0, 0, 1], angle = 10 } }
[[task]]
name = "screw"
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
"""
DIMENSIONS = "x1 = 12, x2 = 8, x3 = 30, x4 = { min = 2, max = 20 }"
POSE = CASE.splitlines()[2]
TASK = CASE[CASE.index("[[task]]") :]


class Refused(NamedTuple):
    """A case file, and a file beside it with its name."""

    case: str
    file: str = ""
    content: str = ""


def changed(old: str, new: str, file: str = "", content: str = "") -> Refused:
    return Refused(edited(CASE, (old, new)), file, content)


def above(tables: str) -> Refused:
    """The case with further tables above its task."""
    return changed("[[task]]", f"{tables}\n[[task]]")


#: A case for each kind of refusal, and the sentence; one that ends with a colon is followed by names.
REFUSALS = {
    "text that is not TOML": (
        changed("x1 = 12,", "x1 = 12 cm,"),
        "case.toml: is not valid TOML: line 2: 12 cm has a unit, write 12",
    ),
    "unknown top key": (
        above("titel = 3"),
        "case.toml: titel: no such key; did you mean 'title'? allowed: ",
    ),
    "unknown key": (
        changed('name = "screw"', 'nmae = "screw"'),
        (
            "case.toml: task[0].nmae: no such key; did you mean 'name'? allowed: name, sense, axis, "
            "point, pitch, weight, twist, follows"
        ),
    ),
    "missing table": (
        changed('\nname = "screw"\nsense = "max"\naxis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1\n', ""),
        "case.toml: task[0].sense: is missing: give 'max' or 'min'",
    ),
    "missing robot": (
        changed('model = "stewart-gough", ', ""),
        "case.toml: robot.model: is missing: give model, or file with the name of a robot file",
    ),
    "missing key": (
        changed("pitch = 1\n", ""),
        "case.toml: task[0].pitch: is missing: give a number, 0 for a rotation, inf for a translation",
    ),
    "missing parameter": (
        changed("x2 = 8, ", ""),
        (
            "case.toml: robot.parameters.x2: is missing: radius of the platform's joint circle; give "
            "a number or { min, max } or { values }"
        ),
    ),
    "wrong type": (
        changed("x1 = 12", 'x1 = "12"'),
        'case.toml: robot.parameters.x1 = "12": must be a number or { min, max }; write 12 without quotes',
    ),
    "wrong type with unit": (
        changed("x1 = 12", 'x1 = "12 cm"'),
        (
            'case.toml: robot.parameters.x1 = "12 cm": must be a number or { min, max }; write 12: a '
            "number is written without its unit"
        ),
    ),
    "wrong table": (
        changed("rotation = { axis = [0, 0, 1], angle = 10 }", "rotation = 10"),
        "case.toml: pose.rotation = 10: must be a table",
    ),
    "wrong number of entries": (
        changed("[2, 3, 6]", "[2, 3]"),
        "case.toml: task[0].point: must have 3 entries, got 2",
    ),
    "NaN": (
        changed("x1 = 12", "x1 = nan"),
        "case.toml: robot.parameters.x1 = nan: must be finite",
    ),
    "infinite bound": (
        changed("max = 50", "max = inf"),
        "case.toml: pose.position[2].max = inf: must be finite",
    ),
    "too large": (
        changed("x1 = 12", "x1 = 1e31"),
        "case.toml: robot.parameters.x1 = 1e+31: must be at most 1e+30 in magnitude",
    ),
    "crossed bounds": (
        changed("min = 2, max = 20", "min = 20, max = 2"),
        ("case.toml: robot.parameters.x4.min = 20.0: must be below max = 2 deg; write a fixed value as a plain number"),
    ),
    "bound without other": (
        changed("min = 2, max = 20", "min = 2"),
        "case.toml: robot.parameters.x4.max: is missing: give a number",
    ),
    "start outside": (
        changed("min = 2, max = 20", "min = 2, max = 20, start = 21"),
        "case.toml: robot.parameters.x4.start = 21.0: must be between 2 deg and 20 deg",
    ),
    "outside of the domain": (
        changed("x3 = 30", "x3 = 40"),
        "case.toml: robot.parameters.x3 = 40.0: must be between 0 deg and 30 deg",
    ),
    "single catalogue value": (
        changed("x1 = 12", "x1 = { values = [12] }"),
        (
            "case.toml: robot.parameters.x1.values: must have at least 2 entries, got 1; write a "
            "fixed value as a plain number"
        ),
    ),
    "catalogue value twice": (
        changed("x1 = 12", "x1 = { values = [12, 13, 12] }"),
        "case.toml: robot.parameters.x1.values: must not have a value twice, got 12 cm twice",
    ),
    "unknown word": (
        changed('"max"', '"most"'),
        "case.toml: task[0].sense = \"most\": must be one of 'max' or 'min'",
    ),
    "unknown robot": (
        changed('"stewart-gough"', '"stewart-guogh"'),
        "case.toml: robot.model = \"stewart-guogh\": no such robot; did you mean 'stewart-gough'? allowed: ",
    ),
    "case as robot": (
        changed('"stewart-gough"', '"paper-4.2"'),
        ("case.toml: robot.model = \"paper-4.2\": no such robot; 'paper-4.2' is a case; use it with screwsynth solve"),
    ),
    "unknown option": (
        changed("model =", 'layuot = "aligned", model ='),
        (
            "case.toml: robot.layuot: no such key; did you mean 'layout'? allowed: layout, model, "
            "file, definition, parameters, characteristic_length, actuator_stiffness"
        ),
    ),
    "bad option": (
        changed("model =", 'layout = "round", model ='),
        "case.toml: robot.layout = \"round\": must be 'aligned' or 'octahedral'",
    ),
    "unknown parameter": (
        changed("x1 = 12", "x1 = 12, x5 = 3"),
        "case.toml: robot.parameters.x5: no such parameter; allowed: x1, x2, x3, x4",
    ),
    "missing robot file": (
        changed('model = "stewart-gough", ', 'file = "robot.toml", '),
        'case.toml: robot.file = "robot.toml": cannot be read: No such file or directory',
    ),
    "two robots": (
        changed("model =", 'file = "robot.toml", model ='),
        "case.toml: robot.model: conflicts with robot.file; give only one of them",
    ),
    "not a robot file": (
        changed('model = "stewart-gough", ', 'file = "robot.toml", ', "robot.toml", "robot = 3\ntask = 3\n"),
        "robot.toml: the file: is a case, not a robot file; use it with screwsynth solve",
    ),
    "joint without type": (
        changed(
            'model = "stewart-gough", ',
            'file = "robot.toml", ',
            "robot.toml",
            'name = "r"\n[[limb]]\njoints = [{ at = "0*x", axis = "x" }]\n',
        ),
        "robot.toml: limb 1, joint 1, type: is missing; it must be one of R, P, H, C, U, S and Pa",
    ),
    "zero axis": (
        changed("[2, 2, 1]", "[0, 0, 0]"),
        "case.toml: task[0].axis = [0.0, 0.0, 0.0]: must not be zero: a zero vector has no direction",
    ),
    "zero rotation axis": (
        changed("axis = [0, 0, 1], angle", "axis = [0, 0, 0], angle"),
        "case.toml: pose.rotation.axis = [0.0, 0.0, 0.0]: must not be zero: a zero vector has no direction",
    ),
    "two forms of a rotation": (
        changed("angle = 10 }", "angle = 10, rpy = [0, 0, 1] }"),
        "case.toml: pose.rotation.angle: conflicts with rpy; state the rotation in one way",
    ),
    "not orthogonal": (
        changed("axis = [0, 0, 1], angle = 10", "matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 2]]"),
        (
            "case.toml: pose.rotation.matrix: must be orthogonal, with perpendicular unit vectors as "
            "columns; R' R differs from the identity by 3"
        ),
    ),
    "reflection": (
        changed("axis = [0, 0, 1], angle = 10", "matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]"),
        (
            "case.toml: pose.rotation.matrix: must be a rotation with determinant 1, got a "
            "reflection with determinant -1"
        ),
    ),
    "not a unit quaternion": (
        changed("axis = [0, 0, 1], angle = 10", "quaternion = [1, 1, 0, 0]"),
        (
            "case.toml: pose.rotation.quaternion = [1.0, 1.0, 0.0, 0.0]: must be a unit quaternion "
            "(w, x, y, z), got one of norm 1.414214"
        ),
    ),
    "large free rotation": (
        changed("axis = [0, 0, 1], angle = 10", "angle = 180"),
        "case.toml: pose.rotation.angle = 180.0: must be at most 179 deg in magnitude with a free axis",
    ),
    "lopsided free rotation": (
        changed("axis = [0, 0, 1], angle = 10", "angle = { min = -10, max = 20 }"),
        (
            "case.toml: pose.rotation.angle.min = -10.0: must be -max, or have the sign of max: "
            "about a free axis the sign of an angle has no meaning"
        ),
    ),
    "two forms of a motion": (
        changed("pitch = 1", "pitch = 1\ntwist = [0, 0, 1, 0, 0, 0]"),
        "case.toml: task[0].axis: conflicts with twist; state the motion in one way",
    ),
    "NaN pitch": (
        changed("pitch = 1", "pitch = nan"),
        "case.toml: task[0].pitch = nan: must be a number, or inf for a translation",
    ),
    "zero twist": (
        changed("axis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1", "twist = [0, 0, 0, 0, 0, 0]"),
        ("case.toml: task[0].twist = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]: must not be zero: the platform would not move"),
    ),
    "name twice": (
        above('[[task]]\nname = "screw"\nsense = "min"\ntwist = [0, 0, 1, 0, 0, 0]'),
        'case.toml: task[1].name = "screw": is used by an earlier task; give each task its own name',
    ),
    "combination of one task": (
        above('combine = { method = "average" }'),
        "case.toml: combine: has no effect with one task; remove it, or add another [[task]]",
    ),
    "two displacements": (
        changed("angle = 10 }", "angle = 10 }, grid = {}, along_task = { first = 0, last = 1, count = 2 }"),
        "case.toml: pose.grid: conflicts with along_task; write two [[pose]] tables",
    ),
    "too many poses": (
        changed(
            "angle = 10 }",
            "angle = 10 }, grid = { x = { min = 0, max = 1, count = 20 }, y = { min = 0, max = 1, count = 20 } }",
        ),
        "case.toml: pose.grid: must have at most 200 poses, got 400",
    ),
    "unknown task": (
        changed("angle = 10 }", 'angle = 10 }, along_task = { task = "mill", first = 0, last = 1, count = 2 }'),
        'case.toml: pose.along_task.task = "mill": no such task; allowed: screw',
    ),
    "unknown limit": (
        above("limits.leg_lenght = { max = 40 }"),
        (
            "case.toml: limits.leg_lenght: no such limit for the robot 'stewart-gough'; did you mean "
            "'leg_length'? allowed: "
        ),
    ),
    "empty limit": (
        above("limits.leg_length = {}"),
        "case.toml: limits.leg_length: is empty: it must have min, max, or both",
    ),
    "crossed limit": (
        above("limits.leg_length = { min = 40, max = 30 }"),
        "case.toml: limits.leg_length.min = 40.0: must be below max = 30 cm",
    ),
    "limit out of range": (
        above("limits.base_joint_angle = 200"),
        "case.toml: limits.base_joint_angle.max = 200.0: must be above 0 deg and at most 180 deg",
    ),
    "NaN limit": (
        above("limits.leg_length = { max = nan }"),
        "case.toml: limits.leg_length.max = nan: must be finite",
    ),
    "limit of another robot": (
        above("limits.joint.slide = { max = 3 }"),
        "case.toml: limits.joint.slide: no such limit for the robot 'stewart-gough'; allowed: ",
    ),
    "relation": (
        above('limits.custom = ["x1 > 2"]'),
        (
            "case.toml: limits.custom[0] = \"x1 > 2\": '>' at position 4 is not allowed: x1 »> 2; "
            "allowed are numbers, names, + - * / ^ ( ) and one of >=, <=, =="
        ),
    ),
    "unknown name in a relation": (
        above('limits.custom = ["x1 >= x9"]'),
        (
            "case.toml: limits.custom[0] = \"x1 >= x9\": 'x9' at position 7 is not a quantity of this "
            "case; allowed: x1, x2, x3, x4, p_x, p_y, p_z, angle, sqrt, sin, cos, abs"
        ),
    ),
    "limit without load": (
        above("limits.actuator_force = { max = 3 }"),
        "case.toml: limits.actuator_force: needs a table [[load]] with a load on the platform",
    ),
    "limit without motion": (
        above("limits.actuator_speed = { max = 3 }"),
        "case.toml: limits.actuator_speed: needs [motion], the largest speeds of the platform",
    ),
    "mounting pose": (
        above('limits.base_joint_angle = { max = 9, about = "home" }'),
        'case.toml: limits.home: is missing: limits.base_joint_angle with about = "home" needs it',
    ),
    "limits over nothing": (
        above('limits = { over = "workspace", leg_length = { max = 40 } }'),
        'case.toml: limits.over = "workspace": needs the table [workspace] with the box of poses',
    ),
    "empty load": (
        above('load = [{ name = "cut" }]'),
        "case.toml: load[0]: is empty: give force, moment, any or mass",
    ),
    "mass without gravity": (
        above("load = [{ mass = 3 }]"),
        (
            "case.toml: gravity.acceleration: is missing: give [gravity] acceleration in units in which mass "
            "times acceleration is in N, such as [0, 0, -9.81] for a mass in kg"
        ),
    ),
    "two forms of a load": (
        above("load = [{ mass = 3, force = [0, 0, 1] }]"),
        "case.toml: load[0].force: conflicts with mass; write another [[load]]",
    ),
    "empty motion": (
        above("motion = {}"),
        "case.toml: motion: is empty: give linear, angular, or both, above 0",
    ),
    "stiffness": (
        changed("robot = {", "robot = { actuator_stiffness = 0,"),
        "case.toml: robot.actuator_stiffness = 0.0: must be above 0 and finite",
    ),
    "objective": (
        above('objective = { minimise = "actuator_force" }'),
        'case.toml: task[0].sense = "max": objective.minimise needs no task: remove [[task]], or give it sense = "min"',
    ),
    "empty objective": (
        above("objective = {}"),
        "case.toml: objective.minimise: is missing: give minimise, over, or both",
    ),
    "tolerance": (
        above("tolerance = { joint_centre = 0 }"),
        "case.toml: tolerance.joint_centre = 0.0: must be positive and finite",
    ),
    "workspace of one pose": (
        above("workspace = { position = [0, 0, 30] }"),
        "case.toml: workspace: is only one pose: give one coordinate or more as { min, max }",
    ),
    "crossed workspace": (
        above("workspace = { position = [0, 0, { min = 40, max = 30 }] }"),
        (
            "case.toml: workspace.position[2].min = 40.0: must be below max = 30 cm; write a fixed "
            "value as a plain number"
        ),
    ),
    "workspace without rotation": (
        above("workspace = { position = [0, 0, 30], rotation = { axis = [0, 0, 1] } }"),
        "case.toml: workspace.rotation.angle: is missing: give angle, or one or more of roll, pitch, yaw",
    ),
    "large workspace rotation": (
        above("workspace = { position = [0, 0, 30], rotation = { yaw = { min = 0, max = 170 } } }"),
        "case.toml: workspace.rotation.yaw.max = 170.0: must be between -150 deg and 150 deg",
    ),
    "excursions about another axis": (
        above(
            'workspace = { about = "pose", position = [0, 0, { min = 0, max = 1 }], rotation = { '
            "axis = [1, 0, 0], angle = 5 } }"
        ),
        (
            "case.toml: workspace.rotation: must be left out, or rotate about the axis of the pose's rotation: with "
            "about = 'pose', rotations about different axes cannot be combined"
        ),
    ),
    "path place": (
        above('path = { file = "a.ngc", place = { roll = 200 } }'),
        "case.toml: path.place.roll = 200.0: must be between -150 deg and 150 deg",
    ),
    "path keys": (
        above('path = { flie = "a.ngc" }'),
        (
            "case.toml: path.flie: no such key; did you mean 'file'? allowed: file, unit, start, "
            "offsets, angles, between, flavour, end_of_file, part, macros, place, tool, periodic"
        ),
    ),
    "settings": (
        above("solve.starts = 0"),
        "case.toml: solve.starts = 0: must be greater than or equal to 1",
    ),
    "expectation": (
        above('expect.value = [{ quantity = "F", value = 1 }]'),
        "case.toml: expect.value[0].within: is missing: give the largest allowed difference",
    ),
    "published": (
        above('published = [{ quantity = "gain", value = 1, source = "s", reproduced = true }]'),
        'case.toml: published[0].over: is missing: quantity = "gain" needs the name of a reference case',
    ),
    "missing CSV": (
        changed(POSE, 'poses = "poses.csv"'),
        'case.toml: poses = "poses.csv": cannot be read: No such file or directory',
    ),
    "CSV without rows": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n"),
        "poses.csv: has no rows: expected a first row with the names of the columns, then rows of values",
    ),
    "CSV column unknown": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,w\n1,2,3\n"),
        (
            "poses.csv: row 1: no such column, 'w'; did you mean 'qw'? allowed: x, y, z, roll, "
            "pitch, yaw, qw, qx, qy, qz, axis_x, axis_y, axis_z, angle"
        ),
    ),
    "CSV column missing": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y\n1,2\n"),
        "poses.csv: row 1: column z is missing",
    ),
    "CSV column twice": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z,z\n1,2,3,3\n"),
        "poses.csv: row 1: column 'z' appears twice; remove one",
    ),
    "CSV two forms": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z,roll,pitch,yaw,qw,qx,qy,qz\n1,2,3,0,0,0,1,0,0,0\n"),
        "poses.csv: row 1: column 'qw' conflicts with 'roll'; give only one of the two forms",
    ),
    "CSV cells": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n1,2,30\n1,2\n"),
        "poses.csv: row 3: must have 3 cells, got 2",
    ),
    "CSV text": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n1,2,30\n1,2,z\n"),
        'poses.csv: row 3, column z = "z": must be a number',
    ),
    "CSV empty cell": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n1,,30\n"),
        "poses.csv: row 2, column y: must be a number, got an empty cell",
    ),
    "CSV NaN": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n1,2,nan\n"),
        "poses.csv: row 2, column z = nan: must be finite",
    ),
    "CSV quaternion": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z,qw,qx,qy,qz\n1,2,30,1,1,0,0\n"),
        (
            "poses.csv: row 2, columns qw, qx, qy, qz = [1.0, 1.0, 0.0, 0.0]: must be a unit "
            "quaternion (w, x, y, z), got one of norm 1.414214"
        ),
    ),
    "CSV with unit": (
        changed(POSE, 'poses = "poses.csv"', "poses.csv", "x,y,z\n1,2,30 cm\n"),
        'poses.csv: row 2, column z = "30 cm": must be a number; write 30: a number is written without its unit',
    ),
    "poses twice": (
        above('poses = "poses.csv"'),
        'case.toml: poses = "poses.csv": conflicts with [[pose]]; state the poses in one way',
    ),
    "CSV zero axis": (
        changed(
            TASK,
            'tasks = "tasks.csv"',
            "tasks.csv",
            "sense,axis_x,axis_y,axis_z,point_x,point_y,point_z,pitch\nmax,0,0,0,1,2,3,0\n",
        ),
        (
            "tasks.csv: row 2, columns axis_x, axis_y, axis_z = [0.0, 0.0, 0.0]: must not be zero: a "
            "zero vector has no direction"
        ),
    ),
    "CSV sense": (
        changed(
            TASK, 'tasks = "tasks.csv"', "tasks.csv", "sense,omega_x,omega_y,omega_z,v_x,v_y,v_z\nmost,0,0,1,0,0,0\n"
        ),
        "tasks.csv: row 2, column sense = \"most\": must be one of 'max' or 'min'",
    ),
    "limb of zero length": (
        Refused(edited(CASE, (DIMENSIONS, "x1 = 8, x2 = 8, x3 = 30, x4 = 30"), (POSE, "pose.position = [0, 0, 0]"))),
        "case.toml: robot.parameters: limb '1-' has zero length: its two joints coincide",
    ),
}


@pytest.mark.parametrize(("refused", "sentence"), REFUSALS.values(), ids=REFUSALS)
def test_a_refusal_names_file_key_value_and_what_is_allowed(
    refused: Refused, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "case.toml", refused.case)
    if refused.file:
        saved(tmp_path / refused.file, refused.content)
    with pytest.raises(InputError) as caught:
        formulate(load_case("case.toml"))
    text = str(caught.value)
    assert text.startswith(sentence) if sentence.endswith("allowed: ") else text == sentence


def test_the_case_is_good_before_it_is_changed(tmp_path: Path) -> None:
    assert formulate(load_case(str(saved(tmp_path / "case.toml", CASE)))).n > 0

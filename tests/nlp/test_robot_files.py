"""Robot files: solved, written again, and refused or remarked on in one sentence where something is wrong."""

# ruff: noqa: E501 - each fault is a row of a table

from __future__ import annotations

import json
import math
import pickle
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import EACH_KIND, Run, case_from, output_of, refusal_of, saved, saved_with_robot, starter_text
from link_robots import CASE as LINKS_CASE
from link_robots import COUPLING
from link_robots import ROBOT as LINKS

import screwsynth.models
from screwsynth.models import Dimension, model_names, robot, robot_function
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import (
    Case,
    CaseError,
    Free,
    JointMotion,
    Limits,
    Search,
    Status,
    Task,
    evaluate,
    formulate,
    load_case,
    load_result,
    solve,
)
from screwsynth.nlp.case.robotfile import check_form
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.evidence.state import loops_are_closed

ROBOT = """name = "rps"
home = [0, 0, "h"]
[dimensions]
rb = { typical = 1.0 }
rp = { typical = 0.6 }
h = { typical = 1.1 }
[derived]
half = "rb/2"
[[limb]]
repeat = { count = 1 }
points = { B = ["rb", 0, 0], A = ["rp", 0, "h"] }
joints = [ { type = "R", at = "B", axis = "y" },
           { type = "P", at = "B", axis = "A - B", actuated = true },
           { type = "S", at = "A" } ]
"""
CASE = """robot = { file = "robot.toml", parameters = { rb = 1, rp = 0.6, h = 1.1 } }
pose = { position = [0, 0, { min = 0.9, max = 1.3 }] }
task = [{ sense = "max", axis = [0, 0, 1], point = [0, 0, 0], pitch = 0 }]
"""
LIMB = ROBOT[ROBOT.index("[[limb]]") :]
JOINTS = ROBOT[ROBOT.index("joints = ") :]
AXIS, SECOND, LAST = '"A - B"', "limb 1, joint 2 (P), axis: is", 'at = "A" }'
GRAMMAR = "which may have only numbers, names, + - * / ^, brackets and functions"
NOT_A_NAME = "cannot be the name of a dimension: letters, digits and _ are allowed, a letter first"
DRIVEN = '{ type = "R", at = "B", axis = "y", actuated = true }'

#: Text that is replaced, its replacement, and the sentence behind the name of the file.
FAULTS: list[tuple[str, str | bytes, str]] = [
    # A robot that contradicts itself.
    (LAST, 'at = "A", actuated = true }', "limb 1, joint 3 (S), actuated: is not allowed for this type: write each axis"),
    ('"R", at = "B", axis = "y"', '"U", at = "B", axes = ["x", "y"], actuated = true', "joint 1 (U), actuated: is not allowed"),
    ('"R"', '"C", actuated = true', "limb 1, joint 1 (C), actuated: is not allowed"),
    (", actuated = true", "", "actuated: is given at no joint of the robot; write actuated = true at each joint that"),
    ('axis = "y"', "axis = [0, 0, 0]", "limb 1, joint 1 (R), axis: is [0, 0, 0], which is zero; a direction is needed"),
    (AXIS, '"B - B"', f"{SECOND} 'B - B', which is zero; a direction is needed"),
    (AXIS, '"(rb - 1)*x"', "limb 1, joint 2 (P), axis: is '(rb - 1)*x', which is zero; a direction is needed, at the typ"),
    ('axis = "y"', 'axis = "cross(A, 2*A)"', "limb 1, joint 1 (R), axis: is 'cross(A, 2*A)', which is zero; a direction is ne"),
    ('"R", at = "B", axis = "y"', '"U", at = "B", axes = ["x", "-2*x"]', "limb 1, joint 1 (U), axes: are parallel; two different"),
    ('"R"', '"Pa", to = "B"', "limb 1, joint 1 (Pa), to: is the same point as \"at\"; a rod needs a nonzero length"),
    ('"R"', '"Pa", to = "B + y"', "limb 1, joint 1 (Pa), axis: is parallel to the rod from \"at\" to \"to\"; give the axis of its hinges"),
    (JOINTS, f'joints = [{DRIVEN}, {{ type = "S", at = "A" }}, {{ type = "S", at = "A" }}]', "limb 1, joint 3 (S), at: is also the point of the preceding joint S"),
    (JOINTS, 'joints = [{ type = "S", at = "A" }, { type = "C", at = "B", axis = "x" }, { type = "P", at = "B", axis = "y" }]', "the robot: no limb resists any motion of the platform: each limb has six or more independent passive joints"),
    ("count = 1", "angles = [0, 120, 360]", "limb 1, repeat, angles: has 0 twice; each copy needs an angle of its own"),
    # A limb that ends nowhere, or has too much.
    (JOINTS, "", "limb 1, joints: is missing: a limb needs at least one joint"),
    (JOINTS, "joints = []", "limb 1, joints: is missing: a limb needs at least one joint"),
    (JOINTS, f"joints = [{', '.join([DRIVEN] * 13)}]", "limb 1, joints: has 13 joints; at most 12 are allowed"),
    (JOINTS, f'joints = [{DRIVEN}]\nbranch = [{{ joints = [{{ type = "S", at = "A" }}] }}]', "limb 1, branch: has only one branch: write its joints"),
    (JOINTS, f"joints = [{DRIVEN}]\nbranch = [{{ joints = [] }}]", "limb 1, branch 1, joints: must have at least 1 entry, got 0"),
    (JOINTS, f"joints = [{DRIVEN}]\nbranch = [{', '.join(['{ joints = [' + DRIVEN + '] }'] * 7)}]", "limb 1, branch: has 7 branches; at most 6"),
    (JOINTS, 'joints = [{ type = "R", at = "B", axis = "y" }]\nbranch = [{ joints = [{ type = "S", at = "A" }] }, { joints = [{ type = "S", at = "B" }] }]', "limb 1, joint 1 (R): is passive and before the branches of its limb; only actuated joints are allowed there"),
    (JOINTS, f'joints = [{DRIVEN}]\nbranch = [{{ joints = [{{ type = "S", at = "A" }}], branch = [] }}, {{ joints = [] }}]', "limb 1, branch 1, branch: is a branch of a branch; allowed are branches of a limb, each with joints up to"),
    (LIMB, "", "limb: is missing; it must be one or more tables [[limb]]"),
    (LIMB, "[limb]\njoints = []", "limb: must be a list of tables: write [[limb]], with two brackets"),
    ("", "limb = []\n", "the file: is not valid TOML"),
    ("count = 1", "count = 0", "limb 1, repeat, count = 0: must be a whole number from 1 to 24"),
    ("count = 1", "count = 1_000_000_000", "limb 1, repeat, count = 1000000000: must be a whole number from 1 to 24"),
    ("count = 1", "count = 3.0", "limb 1, repeat, count = 3.0: must be a whole number"),
    ("count = 1", "count = true", "limb 1, repeat, count = true: must be a whole number"),
    ("count = 1", "count = 3, angles = [0]", "limb 1, repeat: needs count or angles, and not both"),
    ("count = 1", "angles = []", "limb 1, repeat, angles: must have at least 1 entry, got 0"),
    ("count = 1", "angles = [0, nan]", "limb 1, repeat, angle 2 = nan: must be finite"),
    ("count = 1", "count = 2, axis = [0, 0, 0]", "limb 1, repeat, axis: is zero: it needs a direction"),
    ("count = 1", 'count = 2, axis = "z"', 'limb 1, repeat, axis = "z": must be a list of 3 numbers'),
    (LIMB, f"{LIMB}{LIMB}".replace("count = 1", "count = 20"), "limb: has 40 limbs with all copies; at most 24 are allowed"),
    (LIMB, LIMB.replace("count = 1", "count = 24").replace(JOINTS, f"joints = [{', '.join([DRIVEN] * 6)}]"), "limb: has 144 joints with all copies; at most 120 are allowed"),
    ("home =", f"{'x' * 5000} = 1\nhome =", f"{'x' * 57}...: no such key; allowed: schema, name"),
    # Names.
    (AXIS, '"A - D"', "which has the name 'D', which is unknown; known are A, B, h, half, pi, rb, rp, x, y, z"),
    (LAST, 'at = "AA" }', "limb 1, joint 3 (S), at: is 'AA', which has the name 'AA', which is unknown; did you mean 'A'?"),
    (AXIS, '"unti(A - B)"', "which has the function 'unti', which is unknown; did you mean 'unit'?"),
    ('name = "rps"', 'name = "r\\u0007s"', "name: has the character '\\x07'; only printable characters are allowed"),
    ("repeat =", 'name = "a\\u001b[31m"\nrepeat =', "limb 1, name: has the character '\\x1b'"),
    (LAST, 'at = "A", name = "b\\u0000" }', "limb 1, joint 3 (S), name: is 'b\\x00'; letters, digits and _ are allowed, a letter"),
    (LAST, 'at = "A", name = "2:1" }', "limb 1, joint 3 (S), name: is '2:1'; letters, digits and _ are allowed, a letter first"),
    ("[derived]", '"d\\u0001" = { typical = 1 }\n[derived]', f"d\\x01: {NOT_A_NAME}"),
    ("[derived]", '"a-b" = { typical = 1 }\n[derived]', f"a-b: {NOT_A_NAME}"),
    ("[derived]", '"\u03b1" = { typical = 1 }\n[derived]', f"\u03b1: {NOT_A_NAME}"),
    ("[derived]", "sin = { typical = 1 }\n[derived]", "sin: cannot be the name of a dimension: it is a function or a constant of expressions"),
    ('name = "rps"', "name = 3", "name = 3: must be text in quotes"),
    ('name = "rps"', 'name = "  "', 'name = "  ": must not be empty'),
    ("rp = {", "rb = {", "the file: is not valid TOML: Cannot overwrite a value (at line 5, column 23)"),
    ("half =", "rb =", "rb: is given twice"),
    ("[[limb]]", '[[limb]]\nname = "111"\njoints = [{ type = "S", at = "x" }]\n[[limb]]\nname = "11"', "limb: has two limbs with the name '111'"),
    ("B = [", "h = [", "limb 1, point h: has the name of a dimension"),
    ("B = [", "x = [", "limb 1, x: cannot be the name of a point: it is a function or a constant of expressions"),
    ('half = "rb/2"', 'a = "b"\nb = "a"', "derived, a: is 'b', which uses 'b' before its definition; use names defined above"),
    ('half = "rb/2"', 'a = "a + 1"', "derived, a: is 'a + 1', which uses 'a' before its definition"),
    ("points = {", 'points = { D = "E", E = "D",', "limb 1, point D: is 'E', which uses 'E' before its definition"),
    # Keys.
    ("home =", "colour = 1\nhome =", "colour: no such key; allowed: schema, name, description, length_unit, home, dimensions, derived, limb"),
    ("name =", "nme =", "nme: no such key; did you mean 'name'?"),
    ("joints =", "joint =", "limb 1, joint: no such key; did you mean 'joints'?"),
    ('axis = "A - B", ', "", "limb 1, joint 2 (P), axis: is missing"),
    ('"A - B"', "3", "limb 1, joint 2, axis = 3: must be an expression in quotes or a list of 3"),
    (LAST, 'at = "A", friction = 1 }', "limb 1, joint 3, friction: no such key; allowed: type, name, at, axis"),
    ("typical = 1.0", "typical = 1.0, min = 0", "dimensions, rb, min: no such key; allowed: typical, kind, description"),
    ("repeat =", "mirror = true\nrepeat =", "limb 1, mirror: no such key; allowed: name, repeat, points, joints, branch"),
    ("count = 1", "count = 1, step = 2", "limb 1, repeat, step: no such key; allowed: count, angles, axis, through"),
    (LAST, 'at = "A", axis = "z" }', "limb 1, joint 3 (S), axis: no such key; allowed are type, name, at"),
    ('"R"', '"R", pitch = 1', "limb 1, joint 1 (R), pitch: no such key; allowed are type, name, at, axis, actuated"),
    ('"R"', '"H"', "limb 1, joint 1 (H), pitch: is missing"),
    ('"R"', '"Pa"', "limb 1, joint 1 (Pa), to: is missing"),
    ('type = "S", ', "", "limb 1, joint 3, type: is missing; it must be one of R, P, H, C, U, S and Pa"),
    (', at = "A" }', " }", "limb 1, joint 3, at: is missing; it must be a point, as an expression in quotes or a list of 3"),
    ("typical = 1.0", 'kind = "length"', "dimensions, rb, typical: is missing; it must be a number, degrees for an angle"),
    # Types and numbers.
    ('"S"', '"s"', "limb 1, joint 3, type = \"s\": must be one of 'R', 'P', 'H', 'C', 'U', 'S' or 'Pa'"),
    ("actuated = true", "actuated = 1", "limb 1, joint 2, actuated = 1: must be true or false"),
    ("typical = 1.0", "typical = nan", "dimensions, rb, typical = nan: must be finite"),
    ("typical = 1.0", "typical = true", "dimensions, rb, typical = true: must be a number"),
    ("typical = 1.0", 'typical = "1"', 'dimensions, rb, typical = "1": must be a number'),
    ("typical = 1.0", "typical = 2020-01-01", "dimensions, rb, typical: must be a number"),
    ("typical = 1.0", 'typical = 1, kind = "mass"', "dimensions, rb, kind = \"mass\": must be one of 'length', 'angle' or"),
    ("{ typical = 1.0 }", "1.0", "dimensions, rb = 1.0: must be a table"),
    ('home = [0, 0, "h"]', "home = [0, nan, 0]", "home, entry 2 = nan: must be finite"),
    ('home = [0, 0, "h"]', "home = [0, 0]", "home: must have 3 entries, got 2"),
    ('home = [0, 0, "h"]', 'home = "h"', "home: is 'h', which is a number; a vector is needed"),
    ('["rb", 0, 0]', '["rb", inf, 0]', "limb 1, points, B, entry 2 = inf: must be finite"),
    ('half = "rb/2"', 'a = "x"', "derived, a: is 'x', which is a vector; a number is needed"),
    ('half = "rb/2"', 'a = "0/0"', "derived, a: is '0/0', which has no finite value"),
    (JOINTS, 'joints = "RPS"', 'limb 1, joints = "RPS": must be a list'),
    (JOINTS, 'joints = ["R"]', 'limb 1, joint 1 = "R": must be a table'),
    ("repeat =", "centre = 3\nrepeat =", "limb 1, centre = 3: must be an expression in quotes or a list of 3"),
    # Expressions.
    (AXIS, '"().__class__"', f"{SECOND} '().__class__', {GRAMMAR}"),
    (AXIS, '"[x for x in A]"', GRAMMAR),
    (AXIS, '"(lambda: A)()"', GRAMMAR),
    (AXIS, "\"__import__('os')\"", GRAMMAR),
    (AXIS, '"A.x"', GRAMMAR),
    (AXIS, '"(A := B)"', GRAMMAR),
    (AXIS, "\"f'{A}'\"", GRAMMAR),
    (AXIS, '"A[0]"', GRAMMAR),
    (AXIS, '"A if 1 else B"', GRAMMAR),
    (AXIS, '"cross(*A)"', GRAMMAR),
    (AXIS, '"1j*A"', GRAMMAR),
    (AXIS, '"True"', GRAMMAR),
    (AXIS, '"A # - B"', GRAMMAR),
    (AXIS, '"A -\\n B"', GRAMMAR),
    (AXIS, '"A -\\u0007 B"', GRAMMAR),
    (AXIS, '"0x10*A"', GRAMMAR),
    (AXIS, '"1_0*A"', GRAMMAR),
    (AXIS, '"A*\u0663"', GRAMMAR),
    (AXIS, '"\uff21 - B"', GRAMMAR),
    (AXIS, '"A**2"', "which has '**'; write a power with '^'"),
    (AXIS, '"A -"', "which is not an expression of numbers, names, + - * / ^ and functions"),
    (AXIS, f'"{"(" * 500}A{")" * 500}"', "which is not an expression of numbers, names"),
    (AXIS, f'"{"-" * 500}A"', "which has more than 60 nested operations"),
    (AXIS, f'"A{" + A" * 2000}"', "which is longer than 2000 letters"),
    (AXIS, '""', 'limb 1, joint 2, axis = "": must not be empty'),
    (AXIS, '"A*B"', "which multiplies two vectors: use dot or cross"),
    (AXIS, '"A - rb"', "which adds or subtracts a number and a vector"),
    (AXIS, '"cross(A)"', "which gives cross 1 arguments instead of 2"),
    ('["rp", 0, "h"]', '["rp^1e9", 0, "h"]', "limb 1, point A: is 'rp^1e9', which has a power larger than 100"),
    ('["rp", 0, "h"]', '["9^9^9^9", 0, "h"]', "limb 1, point A: is '9^9^9^9', which has a power larger than 100"),
    ('["rp", 0, "h"]', f'["1{"0" * 400}", 0, "h"]', "which has a number that is not finite"),
    ('["rp", 0, "h"]', '["1e308*10", 0, "h"]', "limb 1, point A: is '1e308*10', which has no finite value"),
    ('["rp", 0, "h"]', '["sqrt(-rp)", 0, "h"]', "the argument of sqrt, -rp = -0.6, must be at least 0, at the typical dim"),
    # Files.
    (ROBOT, "", "name: is missing; it must be a text in quotes"),
    (ROBOT, "\ufeff", "name: is missing; it must be a text in quotes"),
    (ROBOT, f"{ROBOT}[[limb", "the file: is not valid TOML"),
    (ROBOT, f"{ROBOT}# \x01\n", "the file: is not valid TOML: Found invalid character '\\x01'"),
    (ROBOT, f"{ROBOT}a = {'[' * 3000}{']' * 3000}", "the file: is not valid TOML"),
    (ROBOT, ROBOT.encode() + b"\0", "the file: is not valid TOML"),
    (ROBOT, ROBOT.encode() + b"# \xff", "the file: is not valid TOML: 'utf-8' codec can't decode byte 0xff"),
    (ROBOT, ROBOT.encode("utf-16"), "the file: is not valid TOML: 'utf-8' codec can't decode byte 0xff"),
]  # fmt: skip


#: Of a robot of links and joints.
LINK_FAULTS: list[tuple[str, str, str]] = [
    ('links = ["base",', '[[limb]]\njoints = []\n#', "joint: conflicts with limb: give the robot by limbs, or by links and joints"),
    ('links = ["base", "crank", "coupler", "rocker", "rod", "bar", "platform"]', "", "links: is missing; it must be a list of the names of all links"),
    ('"bar", "platform"]', '"bar"]', "platform: is 'platform', which is not a link; links are base, crank, coupler, rocker, rod"),
    ("points =", 'base = "ground"\npoints =', "base: is 'ground', which is not a link"),
    ("points =", 'platform = "base"\npoints =', "platform: is 'base', which is the base; two links are needed"),
    ('"bar", "platform"]', '"bar", "rod", "platform"]', "links, rod: is given twice"),
    ('"bar", "platform"]', '"bar", "9x", "platform"]', "links, 9x: is '9x'; letters, digits and _ are allowed, a letter first"),
    ('"bar", "platform"]', '"bar", "extra", "platform"]', "links, extra: has no joint"),
    ('["base", "crank"]', '["base", "cranc"]', "joint motor, between: has 'cranc', which is not a link"),
    ('["base", "crank"]', '["crank", "crank"]', "joint motor, between: has the link 'crank' twice"),
    ('["base", "crank"]', '["crank"]', "joint motor, between: must have 2 entries, got 1"),
    ('between = ["base", "crank"]\n', "", "joint motor, between: is missing; it must be a list of two links, the base's side first"),
    ('name = "motor"\n', "", "joint 1, name: is missing; it must be a text in quotes"),
    ('name = "motor"', 'name = "a:1"', "joint 1, name: is 'a:1'; letters, digits and _ are allowed"),
    ('name = "motor"', 'name = "knee"', "joint knee (R): is given twice"),
    ('type = "R"', 'type = "X"', "joint motor, type = \"X\": must be one of 'R', 'P', 'H', 'C', 'U', 'S', 'Pa' or 'weld'"),
    ('type = "R"', 'type = "weld"', "joint motor (weld), at: no such key; allowed are name, type"),
    ('type = "R"', 'type = "S"', "joint motor (S), actuated: is not allowed"),
    ('at = "A"\n', "", "joint motor (R), at: is missing"),
    ('at = "A"', 'at = "Q"', "joint motor (R), at: is 'Q', which has the name 'Q', which is unknown"),
    ('axis = "z"', "axis = [0, 0, 0]", "joint motor (R), axis: is [0, 0, 0], which is zero; a direction is needed"),
    ('axis = "z"', 'axis = "z"\nfriction = 1', "joint motor, friction: no such key"),
    ('axis = "z"', 'axis = "z"\npitch = 1', "joint motor (R), pitch: no such key"),
    ("actuated = true", "actuated = 1", "joint motor, actuated = 1: must be true or false"),
    ("points = {", "points = { s = [0, 0, 0],", "point s: has the name of a dimension"),
    ("points = {", "points = { sin = [0, 0, 0],", "sin: cannot be the name of a point: it is a function or a constant of expressions"),
    ("name = ", "colour = 1\nname = ", "colour: no such key; allowed: schema, name, description, length_unit, home"),
    (LINKS[LINKS.index("[[joint]]") :], "", "joint: is missing; it must be one or more tables [[joint]]"),
    (LINKS, LINKS.replace("actuated = true", ""), "actuated: is given at no joint of the robot; write actuated = true"),
    (LINKS, LINKS + COUPLING.replace("pivot", "none"), "coupling 1, none: is not a joint; joints are motor, knee"),
    (LINKS, LINKS + '[[coupling]]\nfactors = { motor = 1 }\n', "coupling 1, factors: has 1 joints; a coupling needs 2 or more"),
    (LINKS, LINKS + COUPLING.replace('"-s"', "0"), "coupling 1, pivot: is 0; the factor of a coupled joint must not be 0"),
    (LINKS, LINKS + COUPLING.replace('"-s"', '"t"'), "coupling 1, pivot: is 't', which has the name 't', which is unknown"),
    (LINKS, LINKS + "[[coupling]]\n", "coupling 1, factors: is missing; it must be a table with a factor for each joint"),
    (LINKS[LINKS.index('[[joint]]\nname = "slide"') :], "", "links, rod: has no joint"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("robot", "case", "faults"), [(ROBOT, CASE, FAULTS), (LINKS, LINKS_CASE, LINK_FAULTS)], ids=["limbs", "links"]
)
def test_every_broken_robot_file_is_refused_in_one_sentence(
    robot: str, case: str, faults: list[tuple[str, str | bytes, str]], tmp_path: Path
) -> None:
    assert len(faults) >= 30
    for old, new, fault in faults:
        assert old in robot
        content = new if isinstance(new, bytes) else robot.replace(old, new, 1)
        with pytest.raises(CaseError) as error:
            load_case(saved_with_robot(tmp_path, content, case))
        sentence = str(error.value)
        assert sentence.startswith("robot.toml: "), sentence
        assert fault in sentence
        assert sentence.isprintable()
        assert len(sentence) < 300


def test_a_robot_file_that_cannot_be_read_is_refused_with_status_2(tmp_path: Path, cli: Run) -> None:
    """The command line has no traceback, and one line, for faults of every stage: file, form, words and geometry."""
    (tmp_path / "folder.toml").mkdir()
    big = f"{ROBOT}# {'x' * (4 * 2**20)}"
    for content, case, fault in (
        (big, CASE, 'case.toml: robot.file = "robot.toml": cannot be read: it is larger than 1 MB'),
        (ROBOT, CASE.replace("robot.", "folder."), 'robot.file = "folder.toml": cannot be read: Is a directory'),
        (ROBOT, CASE.replace("robot.toml", "none.toml"), 'robot.file = "none.toml": cannot be read: No such file'),
        (ROBOT, CASE.replace("robot.toml", "a\\u0000"), "robot.file"),
        (
            ROBOT.replace("count = 1", "count = 0"),
            CASE,
            "robot.toml: limb 1, repeat, count = 0: must be a whole number",
        ),
        (ROBOT.replace(AXIS, '"().__class__"'), CASE, "robot.toml: limb 1, joint 2 (P), axis: is"),
        (ROBOT.replace(", actuated = true", ""), CASE, "robot.toml: actuated: is given at no joint"),
    ):
        name = saved_with_robot(tmp_path, content, case)
        refusal_of(cli("solve", name, "--json", str(tmp_path / "result.json")), fault)
        assert not (tmp_path / "result.json").exists()


#: Robots that may be a mistake: text that is replaced, its replacement, and the remark.
REMARKS = [
    ('"R", at = "B", axis = "y"', '"U", at = "B", axes = ["x", "x + 0.0003*y"]', "limb 1, joint 1 (U), axes: are almost parallel (sine 0.0003);"),
    (JOINTS, 'joints = [{ type = "R", at = "B", axis = [0.0003, 1, 0], actuated = true }, { type = "R", at = "A", axis = "y" }]', "limb 1, joint 2 (R), axis: and the axis of joint 1 (R) are almost parallel (sine 0.0003); if they must be parallel, write both with the same numbers"),
    ('axis = "y" }', 'axis = "y" }, { type = "R", at = "B + 0.0003*z", axis = "x" }', "limb 1, joint 2 (R), axis: and the axis of joint 1 (R) are 0.0002 of the robot's size apart"),
    ("[[limb]]", '[[limb]]\njoints = [{ type = "U", at = "0*x", axes = ["x", "y"] }, { type = "P", at = "z", axis = "z" }, { type = "S", at = "z" }]\n[[limb]]', "limb 1 carries no load: its passive joints leave the platform free"),
]  # fmt: skip


def test_axes_that_are_almost_parallel_and_idle_limbs_are_remarked_on(tmp_path: Path, cli: Run) -> None:
    (alone,) = load_case(saved_with_robot(tmp_path, ROBOT, CASE)).model.remarks
    assert alone.startswith("the robot has one member only, so F is not informative")
    for old, new, remark in REMARKS:
        name = saved_with_robot(tmp_path, ROBOT.replace(old, new, 1), CASE)
        found, *others = load_case(name).model.remarks
        assert found.startswith(remark)
        assert others == [alone]
    out = output_of(cli("evaluate", name, "--set", "p_z=1.1"))
    assert "note  limb 1 carries no load" in out


def test_nested_loops_are_evaluated_and_solved_and_c_is_refused(tmp_path: Path, cli: Run) -> None:
    name = saved_with_robot(tmp_path, LINKS, LINKS_CASE)
    slides = {member.label: member.slide for member in load_case(name).model.members}
    assert list(slides) == ["1", "2"]
    # The centre of the nested loops is any point of the axis of their hinge at the platform.
    assert str(slides["2"]) == "@1=0, [@1, @1, 1]"
    assert slides["1"] is not None
    out = output_of(cli("evaluate", name))
    assert "degrees of freedom  2 with unlocked actuators" in out
    assert "rates  1: " in out
    assert "motor: " in out
    refusal_of(
        cli("codegen", name, "--out", str(tmp_path / "c")),
        "robot: has loops within a limb (joints motor, knee, wrist, pivot, hand)",
    )
    assert not (tmp_path / "c").exists()
    # With a coupling the rest is one network too.
    coupled = LINKS + COUPLING.replace('pivot = "-s"', "slide = 2")
    out = output_of(cli("evaluate", saved_with_robot(tmp_path, coupled, LINKS_CASE)))
    assert "degrees of freedom  1 with unlocked actuators" in out


SHIPPED = Path(screwsynth.models.__file__).parent / "robots"
RPS, DELTA = ((SHIPPED / f"{name}.toml").read_text(encoding="utf-8") for name in ("3-rps", "delta"))
RPS_CASE = """
task = [{ sense = "max", axis = [1, 0.3, 0], point = [0, 0, 1.1], pitch = 0.2 }]
units = { length = "m" }
[robot]
file = "robot.toml"
parameters = { rb = { min = 0.8, max = 1.2 }, rp = { min = 0.4, max = 0.7 }, h = 1.1 }
[pose]
position = [{ min = -0.3, max = 0.3 }, { min = -0.3, max = 0.3 }, { min = 0.9, max = 1.3 }]
rotation = { angle = { min = -30, max = 30 } }
"""
DELTA_CASE = """
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
units = { length = "m" }
[robot]
file = "robot.toml"
parameters = { rb = { min = 0.3, max = 0.5 }, rp = 0.12, arm = { min = 0.35, max = 0.55 }, rod = 0.9, w = 0.1, tilt = 23 }
[pose]
position = [0.1, 0.05, -0.8]
rotation = { angle = { min = -30, max = 30 } }
"""


@pytest.mark.parametrize(("robot_text", "case_text", "F"), [(RPS, RPS_CASE, 1.158234), (DELTA, DELTA_CASE, 3.926943)])
def test_a_robot_file_of_a_case_is_solved(tmp_path: Path, cli: Run, robot_text: str, case_text: str, F: float) -> None:
    name = saved_with_robot(tmp_path, robot_text, case_text)
    result = tmp_path / "result.json"
    out = output_of(cli("solve", name, "--starts", "6", "--json", str(result)))
    assert "degrees of freedom  3 with unlocked actuators" in out
    data = json.loads(result.read_text(encoding="utf-8"))
    assert data["F"] == pytest.approx(F, abs=1e-6)
    assert len(data["joints"]["actuators"]) == 3
    assert load_result(result) is not None
    # The starts close their loops before the search, so that all converge.
    assert "6 of 6 converged" in out
    case = load_case(name)
    again = case_from(case.to_toml(), "case")
    assert again.model.options["definition"] == case.model.options["definition"]


def test_a_new_case_of_a_robot_file_is_read_beside_it_and_no_output_takes_its_place(tmp_path: Path, cli: Run) -> None:
    robot = saved(tmp_path / "robot.toml", RPS)
    case = saved(tmp_path / "case.toml", output_of(cli("new", str(robot))))
    assert cli("evaluate", str(case))[0] == 0
    assert cli("new", str(case))[0] == 2
    case.write_text(RPS_CASE, encoding="utf-8")
    refusal_of(cli("solve", str(case), "--starts", "1", "--json", str(robot)), "is a file that the case names")
    assert robot.read_text(encoding="utf-8") == RPS


def test_a_solution_closes_all_loops_and_survives_pickling(tmp_path: Path) -> None:
    case = load_case(saved_with_robot(tmp_path, DELTA, DELTA_CASE))
    solution = solve(replace(case, search=Search(starts=4)))
    own = pickle.loads(pickle.dumps(solution)).outcomes[0].own  # noqa: S301 - its own pickle
    assert own.status is Status.OPTIMAL
    assert loops_are_closed(own.nlp, own.x)
    opened = own.x.copy()
    opened[own.nlp.program.places.unknowns[0][0]] += 0.5
    assert not loops_are_closed(own.nlp, opened)
    state = evaluate(own.nlp, own.x)
    # A translation: the platform keeps its orientation, and the rates of the two rods of an arm are equal.
    assert state.angle == pytest.approx(0, abs=1e-7)
    assert state.rates[::2] == pytest.approx(state.rates[1::2], abs=1e-9)


def test_actuator_rates_are_those_of_finite_differences(tmp_path: Path) -> None:
    case = load_case(saved_with_robot(tmp_path, DELTA, DELTA_CASE.replace("{ min = 0.3, max = 0.5 }", "0.4")))
    step = 1e-5

    def angles(z: float) -> tuple[np.ndarray, Mobility]:
        nlp = formulate(replace(case, position=(0.1, 0.05, z)))
        x = close_equations(nlp, nlp.start)
        state = evaluate(nlp, x)
        found = mobility_of(nlp, x, state)
        assert found is not None
        return state.quantities["actuator_angle"], found

    here = angles(-0.8)[1]
    slopes = (angles(-0.8 + step)[0] - angles(-0.8 - step)[0]) / (2 * step)
    assert list(here.actuator_rates.values()) == pytest.approx(slopes, rel=1e-8)
    assert here.constrained == 0
    assert (here.freedoms, here.singularities) == (3, ())


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('file = "robot.toml"', "file = 3", "case.toml: robot.file: must be the name of a robot file"),
        ('file = "robot.toml"', 'file = "robot.toml"\nmodel = "hexapod"', "robot.model: conflicts with robot.file"),
        ('file = "robot.toml"', 'file = "robot.toml"\naxes = "free"', "case.toml: robot.axes: no such key"),
        ('file = "robot.toml"', "", "case.toml: robot.model: is missing"),
        ('file = "robot.toml"', 'model = "3-rpz"', "did you mean '3-rps'?"),
        ('file = "robot.toml"', 'model = "../robots/3-rps"', "no such robot"),
        ("h = 1.1", "height = 1.1", "case.toml: robot.parameters.height: no such parameter"),
    ],
)
def test_faults_of_a_case_with_a_robot_file_are_sentences(tmp_path: Path, old: str, new: str, fault: str) -> None:
    assert old in RPS_CASE
    with pytest.raises(CaseError) as error:
        load_case(saved_with_robot(tmp_path, RPS, RPS_CASE.replace(old, new, 1)))
    assert fault in str(error.value)


def test_the_gallery_is_found_by_name_and_each_robot_has_a_starter() -> None:
    assert len(gallery_names()) >= 14
    assert set(gallery_names()) < set(model_names())
    for name in gallery_names():
        model = robot_function(name)()
        assert (model.name, model.generic.jacobian) == (name, 6)
    # The starter of each is in test_gallery.py.


UNITS = {
    **dict.fromkeys(("3-puu", "6-rss", "6-sps", "delta", "delta-parallelogram", "five-bar"), "m"),
    **dict.fromkeys(("ankle", "differential-waist"), "m"),
    **dict.fromkeys(("five-bar-pen", "five-bar-plotter", "linear-delta", "pentapod"), "mm"),
    **dict.fromkeys(("rotary-delta", "servo-hexapod"), "mm"),
}


def tables_of(name: str) -> dict[str, object]:
    return tomllib.loads((SHIPPED / f"{name}.toml").read_text(encoding="utf-8"))


def test_starters_say_the_unit_of_the_robot_file() -> None:
    files = {name: tables_of(name).get("length_unit", "") for name in gallery_names()}
    assert files == {name: UNITS.get(name, "") for name in gallery_names()}
    for name, unit in (("delta", "m"), ("3-rps", "unit"), ("stewart-gough", "cm")):
        starter = starter_text(name)
        assert tomllib.loads(starter)["units"]["length"] == unit
        assert f", {unit}\n" in starter  # beside a dimension


def with_tuples(value: object) -> object:
    """The value with tuples in the place of lists, as people write them in Python."""
    if isinstance(value, dict):
        return {key: with_tuples(each) for key, each in value.items()}
    return tuple(with_tuples(each) for each in value) if isinstance(value, list) else value


@pytest.mark.parametrize("name", EACH_KIND)
def test_a_robot_in_python_is_written_and_read_again(name: str) -> None:
    tables = tables_of(name)
    model = robot(**{key: with_tuples(value) for key, value in tables.items()})
    values = {item.name: item.typical[0] for item in model.parameters}
    case = Case(model, values, model.home, [Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))], name=name)
    text = case.to_toml()
    written = tomllib.loads(text)["robot"]["definition"]
    assert written == tables
    check_form(written)
    if name == "delta":
        again = case_from(text, name)
        assert again.to_toml() == text
        assert again.model.length_unit == "m"


def test_the_default_home_is_written_too() -> None:
    joints = [
        {"type": "U", "at": (1, 0, -1), "axes": ("x", "y")},
        {"type": "P", "at": (1, 0, -1), "axis": "-z", "actuated": True},
        {"type": "S", "at": (1, 0, 0)},
    ]
    model = robot("legs", limb=({"repeat": {"count": 3}, "joints": tuple(joints)},))
    case = Case(model, {}, (0, 0, 0), [Task(np.array([0, 0, 0, 0, 0, 1.0]))], name="legs")
    assert case_from(case.to_toml(), "legs").model.home == (0, 0, 0)


def test_a_driven_limb_that_resists_nothing_is_refused_in_one_sentence(tmp_path: Path) -> None:
    hinges = [{"type": "C", "at": "z", "axis": "x"}, {"type": "P", "at": "z", "axis": "y"}]
    with pytest.raises(ValueError, match="no limb resists any motion of the platform"):
        robot(name="floating", limb=[{"joints": [{"type": "S", "at": "0*x"}, *hinges]}])
    leg = {"points": {"B": (1, 0, 0), "A": (0.5, 0.4, 1)}, "repeat": {"count": 3}}
    leg["joints"] = [
        {"type": "U", "at": "B", "axes": ["x", "y"]},
        {"type": "P", "at": "B", "axis": "A-B", "actuated": True},
        {"type": "S", "at": "A"},
    ]
    idle = {
        "points": {"B": (0, 0, 0), "A": (0, 0, 1)},
        "joints": [
            {"type": "R", "at": "B", "axis": "x", "actuated": True},
            {"type": "U", "at": "B", "axes": ["x", "y"]},
            {"type": "P", "at": "B", "axis": "A-B"},
            {"type": "S", "at": "A"},
        ],
    }
    with pytest.raises(ValueError, match=r"^limb 2: has an actuated joint without effect, .* remove actuated"):
        robot("idle", home=(0, 0, 1), limb=[leg, idle])
    # An open chain of links.
    chain = LINKS[: LINKS.index('[[joint]]\nname = "pivot"')].replace(', "rod", "bar"', "")
    chain += LINKS[LINKS.index('[[joint]]\nname = "hand"') : LINKS.index('[[joint]]\nname = "slide"')]
    with pytest.raises(CaseError, match=r"platform: is at the end of an open chain \(motor, knee, wrist, hand\)"):
        load_case(saved_with_robot(tmp_path, chain, LINKS_CASE))


def test_a_driven_parallelogram_has_a_way_and_a_rate_in_length() -> None:
    # A platform on one parallelogram that is driven, and two legs that do not matter: it swings on a circle.
    rod = 2.0
    driven = {"type": "Pa", "at": (0, 0, 0), "to": (0, 0, rod), "axis": "y", "actuated": True}
    model = robot("swing", home=(0, 0, rod), limb=[{"joints": [driven]}])
    (quantity,), (actuator,), (coordinate,) = model.quantities, model.actuators, model.joints[0].coordinates
    assert quantity.name == "actuator_length"
    assert quantity.dimension is actuator.dimension is coordinate.dimension is Dimension.LENGTH
    angle, step = 0.4, 1e-6
    position = [Free(-2, 2), 0.0, Free(0, 3)]

    def way(turn: float) -> float:
        case = Case(model, {}, position, [Task(np.array([0, 0, 0, math.cos(angle), 0, -math.sin(angle)]))])
        nlp = formulate(replace(case, limits=Limits(JointMotion("1:1", max=rod))))
        x = np.array(nlp.start)
        x[0], x[1], x[2] = rod * math.sin(turn), rod * math.cos(turn), turn
        x = close_equations(nlp, x)
        state = evaluate(nlp, x)
        mobility = mobility_of(nlp, x, state)
        assert mobility is not None
        if turn == angle:  # unit speed along the circle
            assert mobility.actuator_rates["1"] == pytest.approx(1)
        return float(state.quantities["actuator_length"][0])

    assert way(angle) == pytest.approx(rod * angle)
    # The rate of the way is the speed along the circle.
    assert (way(angle + step) - way(angle - step)) / (2 * step * rod) == pytest.approx(1, rel=1e-6)

"""Robot files with links and joints: broken ones are refused in one sentence; whole ones are evaluated."""

# ruff: noqa: E501 - each fault is a row of a table

from __future__ import annotations

from pathlib import Path

import pytest
from builders import Run, output_of, refusal_of
from link_robots import CASE, COUPLING, ROBOT

from screwsynth.nlp import CaseError, load_case

FAULTS: list[tuple[str, str, str]] = [
    ('links = ["base",', '[[limb]]\njoints = []\n#', "joint: cannot stand beside limb: give the robot by limbs, or by links and joints"),
    ('links = ["base", "crank", "coupler", "rocker", "rod", "bar", "platform"]', "", "links: is missing; it must be a list of the names of all links"),
    ('"bar", "platform"]', '"bar"]', "platform: is 'platform', which is no link; links are base, crank, coupler, rocker, rod"),
    ("points =", 'base = "ground"\npoints =', "base: is 'ground', which is no link"),
    ("points =", 'platform = "base"\npoints =', "platform: is 'base', which is the base; two links are needed"),
    ('"bar", "platform"]', '"bar", "rod", "platform"]', "links, rod: is given twice"),
    ('"bar", "platform"]', '"bar", "9x", "platform"]', "links, 9x: is '9x'; letters, digits and _ are allowed, a letter first"),
    ('"bar", "platform"]', '"bar", "extra", "platform"]', "links, extra: has no joint"),
    ('["base", "crank"]', '["base", "cranc"]', "joint motor, between: has 'cranc', which is no link"),
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
    ("points = {", "points = { sin = [0, 0, 0],", "sin: is no name for a point: expressions use it for something else"),
    ("name = ", "colour = 1\nname = ", "colour: no such key; allowed: name, description, length_unit, home"),
    (ROBOT[ROBOT.index("[[joint]]") :], "", "joint: is missing; it must be one or more tables [[joint]]"),
    ("actuated = true", "", ""),
    (ROBOT, ROBOT + COUPLING.replace("pivot", "none"), "coupling 1, none: is no joint; joints are motor, knee"),
    (ROBOT, ROBOT + '[[coupling]]\nfactors = { motor = 1 }\n', "coupling 1, factors: has 1 joints; a coupling needs 2 or more"),
    (ROBOT, ROBOT + COUPLING.replace('"-s"', "0"), "coupling 1, pivot: is 0; a coupled joint needs another factor"),
    (ROBOT, ROBOT + COUPLING.replace('"-s"', '"t"'), "coupling 1, pivot: is 't', which has the name 't', which is unknown"),
    (ROBOT, ROBOT + "[[coupling]]\n", "coupling 1, factors: is missing; it must be a table with a factor for each joint"),
    (ROBOT[ROBOT.index('[[joint]]\nname = "slide"') :], "", "links, rod: has no joint"),
]  # fmt: skip


def put(folder: Path, robot: str) -> str:
    (folder / "robot.toml").write_text(robot, encoding="utf-8")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    return str(folder / "case.toml")


def test_every_broken_file_of_links_is_refused_in_one_sentence(tmp_path: Path) -> None:
    assert len(FAULTS) >= 30
    for old, new, fault in FAULTS:
        assert old in ROBOT
        changed = ROBOT.replace(old, new) if not fault else ROBOT.replace(old, new, 1)
        expected = fault or "actuated: is given at no joint of the robot; write actuated = true"
        with pytest.raises(CaseError) as error:
            load_case(put(tmp_path, changed))
        sentence = str(error.value)
        assert sentence.startswith("robot.toml: "), sentence
        assert expected in sentence
        assert sentence.isprintable()
        assert len(sentence) < 300
    chain = ROBOT[: ROBOT.index('[[joint]]\nname = "pivot"')].replace(', "rod", "bar"', "")
    chain += ROBOT[ROBOT.index('[[joint]]\nname = "hand"') : ROBOT.index('[[joint]]\nname = "slide"')]
    with pytest.raises(CaseError, match=r"platform: is at the end of an open chain \(motor, knee, wrist, hand\)"):
        load_case(put(tmp_path, chain))


def test_nested_loops_are_evaluated_and_solved_and_c_is_refused(tmp_path: Path, cli: Run) -> None:
    name = put(tmp_path, ROBOT)
    slides = {member.label: member.slide for member in load_case(name).model.members}
    assert list(slides) == ["1", "2"]
    # The centre of the nested loops is any point of the axis of their hinge at the platform.
    assert str(slides["2"]) == "@1=0, [@1, @1, 1]"
    assert slides["1"] is not None
    out = output_of(cli("evaluate", name))
    assert "freedoms  2 with free actuators" in out
    assert "rates  1: " in out
    assert "motor: " in out
    refusal_of(
        cli("codegen", name, "--out", str(tmp_path / "c")),
        "robot: has joints that are no limb with branches (motor, knee, wrist, pivot, hand)",
    )
    assert not (tmp_path / "c").exists()
    # With a coupling the rest is one network too.
    status, out, err = cli("evaluate", put(tmp_path, ROBOT + COUPLING.replace('pivot = "-s"', "slide = 2")))
    assert (status, err) == (0, ""), err
    assert "freedoms  1 with free actuators" in out

"""Commands export and import: files, cases and results that they take, and models that they refuse."""

# ruff: noqa: E501 - each fault is a row of a table

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
import reachy
import yaml
from builders import Run, case_from, output_of, refusal_of, saved, starter_text
from mujoco_trees import Tree

from screwsynth.models import robot
from screwsynth.nlp import Case, InputError, Task, export_robot, formulate, load_case, solve


def test_command_writes_what_is_asked_for_and_the_same_bytes_again(tmp_path: Path, cli: Run) -> None:
    out = tmp_path / "robot"
    words = ("export", "paper-4.4-max", "--starts", "2", "--format", "mjcf", "--format", "csv", "--out", str(out))
    said = output_of(cli(*words))
    assert said.startswith("6 files in")
    files = {path.name: path.read_bytes() for path in out.iterdir()}
    tables = {"joints.csv", "links.csv", "cut-list.csv", "plates.csv"}
    assert set(files) == {"README.md", "robot.xml", *tables, "screwsynth-files.txt"}
    assert cli(*words)[0] == 0
    assert files == {path.name: path.read_bytes() for path in out.iterdir()}
    solution = solve(load_case("paper-4.4-max"), starts=2)
    again = export_robot(solution, ["mjcf"])
    assert again["robot.xml"].encode() == files["robot.xml"]
    assert Tree(again["robot.xml"], 50.0).open <= 1e-9


def test_files_are_the_same_bytes_whatever_the_seed_of_hashes(tmp_path: Path) -> None:
    found = []
    for seed in ("1", "4"):  # which order the sets of ezdxf differently
        out = tmp_path / seed
        words = ("export", "paper-4.4-max", "--starts", "2", "--format", "all", "--out", str(out))
        command, seeded = [sys.executable, "-P", "-m", "screwsynth.nlp", *words], os.environ | {"PYTHONHASHSEED": seed}
        subprocess.run(command, env=seeded, check=True, capture_output=True)
        found.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert found[0] == found[1]
    assert sum(name.endswith(".dxf") for name in found[0]) > 2


@pytest.mark.parametrize("name", ["paper-4.2", "free-wrist", "drilling-spindle"])
def test_shipped_cases_at_their_last_pose(name: str) -> None:
    solution = solve(load_case(name), starts=2)
    count = solution.case.pose_count
    assert Tree(export_robot(solution, ["mjcf"], pose=count)["robot.xml"], 50.0).open <= 1e-9
    with pytest.raises(InputError, match=f"--pose {count + 1}: no such pose; the case has {count} pose"):
        export_robot(solution, ["mjcf"], pose=count + 1)
    with pytest.raises(InputError, match="--format step: no such format"):
        export_robot(solution, ["step"])


def test_refusals_are_one_sentence_and_write_nothing(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "robot"
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine", encoding="utf-8")
    case = "paper-4.1-helical"
    for words, fault in {
        ("--format", "stl", "--out", str(out)): "--format stl: no such format; allowed: mjcf, urdf, csv, dxf, all",
        ("--format", "mjcf", "--out", str(tmp_path / "full")): "contains mine.txt, not written by screwsynth",
        ("--format", "mjcf", "--out", str(out), "--pose", "2"): "--pose 2: no such pose; the case has 1 pose",
    }.items():
        refusal_of(cli("export", case, *words), fault)
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    missing = "ezdxf, which is not installed: pip install 'screwsynth[robots]'"
    refusal_of(cli("export", case, "--format", "all", "--out", str(out)), missing)
    assert not out.exists()
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["mine.txt"]


def test_a_case_that_cannot_be_solved_is_not_exported_and_a_fixed_one_is(tmp_path: Path, cli: Run) -> None:
    text = starter_text("hexapod")
    path, out = saved(tmp_path / "case.toml", text), tmp_path / "robot"
    words = ("export", str(path), "--format", "mjcf", "--out", str(out))
    status, _, wrong = cli(*words, "--starts", "2", "--set=limits.leg_length.min=0.5", "--set=limits.leg_length.max=1")
    assert status == 1
    assert "the solve is infeasible: nothing is exported" in wrong
    assert not out.exists()
    nlp = formulate(case_from(text, "hexapod"))
    values = dict(zip([each.name for each in nlp.program.variables], nlp.start, strict=True))
    fixed = [f"--set={name}={value}" for name, value in values.items() if not name.startswith("q")]
    output_of(cli(*words, *fixed, "--set=angle=0", "--set=axis=0,0,1"))


def test_a_result_is_exported_without_a_solve(tmp_path: Path, cli: Run) -> None:
    # A robot given joint by joint away from home, two tasks combined, and several poses.
    rps = str(saved(tmp_path / "3-rps.toml", starter_text("3-rps")))
    for case, words in (rps, ()), ("paper-4.2", ()), ("flight-simulator", ("--pose", "7")):
        result = tmp_path / "result.json"
        assert cli("solve", case, "--starts", "2", "--json", str(result))[0] == 0
        texts = []
        for k, more in enumerate((("--starts", "2"), ("--of", str(result)))):
            out = tmp_path / f"{Path(case).stem}{k}"
            status, _, wrong = cli("export", case, "--format", "mjcf", "--out", str(out), *words, *more)
            assert (status, wrong) == (0, ""), case
            texts.append((out / "robot.xml").read_text(encoding="utf-8"))
        one, other = (Tree(text, 1.0).model.body_pos for text in texts)
        assert abs(one - other).max() <= 1e-9 * abs(one).max(), case


def test_a_result_of_another_case_or_assembly_is_refused(tmp_path: Path, cli: Run) -> None:
    result, out = tmp_path / "result.json", tmp_path / "robot"
    words = ("--format", "mjcf", "--out", str(out), "--of", str(result))
    assert cli("evaluate", "paper-4.1-helical", "--json", str(result))[0] == 0
    assert cli("export", "paper-4.1-helical", *words)[0] == 0
    other = "is a result of the case 'paper-4.1-helical' with the robot 'stewart-gough', not of 'free-wrist'"
    refusal_of(cli("export", "free-wrist", *words), other)
    data = json.loads(result.read_text(encoding="utf-8"))
    data["jacobian"][0][0] += 1e-3
    saved(result, json.dumps(data))
    refusal_of(cli("export", "paper-4.1-helical", *words), "another assembly mode")
    saved(result, "{}")
    assert cli("export", "paper-4.1-helical", *words)[0] == 2


def test_names_of_any_letters_become_names_that_every_format_takes() -> None:
    limbs = [
        {
            "name": name,
            "points": {"r": f"cos({k}*2*pi/3)*x + sin({k}*2*pi/3)*y", "A": "0.6*r + z"},
            "joints": [
                {"type": "R", "at": "r", "axis": "cross(z, r)"},
                {"type": "P", "at": "r", "axis": "A - r", "actuated": True},
                {"type": "S", "at": "A"},
            ],
        }
        for k, name in enumerate(("a b", "a_b", "d&'e'|<f>"))
    ]
    model = robot('<"&é>', limb=limbs, home=(0.0, 0.0, 1.0))
    case = Case(model=model, parameters={}, position=model.home, tasks=[Task((0, 0, 0, 0, 0, 1))], name="a|b")
    files = export_robot(solve(case))
    joints = Tree(files["robot.xml"], 1.0).model
    names = [joints.joint(k).name for k in range(joints.njnt)]
    assert names[:4] == ["joint_a_b_1", "joint_a_b_2", "joint_a_b_3", "joint_a_b_1_"]
    assert len(set(names)) == len(names) == 7
    loops = yaml.safe_load(files["robot.yaml"])
    assert loops["name_mot"] == ["joint_a_b_2", "joint_a_b_2_", "joint_d__e___f__2"]
    assert mujoco.MjModel.from_xml_string(files["robot.urdf"]).nbody > 7


HEAD = reachy.mjcf()
URDF = reachy.urdf("constraints")
BODY = ("--platform", "head")
ALL = ("--platform", "head", "--actuated", *(f"stewart_{k}" for k in range(1, 7)))
ENTITIES = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))
BOMB = f'<?xml version="1.0"?><!DOCTYPE mujoco [<!ENTITY e0 "ha">{ENTITIES}]><mujoco model="&e9;"/>'
OUTSIDE = '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY e SYSTEM "file:///etc/hostname">]><robot name="&e;"/>'
ARM = (
    '<mujoco><worldbody><body name="arm"><joint name="a" type="hinge"/><body name="hand"><joint name="b" type="hinge"/>'
    '</body></body></worldbody><actuator><motor joint="a"/></actuator></mujoco>'
)
PAIRS = "closed_loop: [[loop1_A, loop1_B]]\ntype: [3d]\nname_mot: [stewart_1]\n"

#: Name of the file, its text, arguments, and words of the sentence.
FAULTS: list[tuple[str, str | bytes, tuple[str, ...], str]] = [
    # Platform, base and actuators.
    ("m.xml", HEAD, (), "--platform: is missing: BODY, platform: a body, link or site of the model"),
    ("m.xml", HEAD, ("--platform", "haed"), "--platform haed: no such body or frame; did you mean 'head'?"),
    ("m.xml", HEAD, ("--platform", ""), "--platform: needs a value, BODY"),
    ("m.xml", HEAD, (*BODY, "--base", "tors"), "--base tors: no such body; did you mean 'torso'?"),
    ("m.xml", HEAD, ("--platform", "torso"), "--platform torso: is rigidly joined to the base world"),
    ("m.xml", ARM, ("--platform", "hand"), "--platform hand: is at the end of an open chain of 2 joints from the base world; a parallel robot has two or more chains"),
    ("m.xml", HEAD.replace("<equality>", "<equality><!--").replace("</equality>", "--></equality>"), BODY, "no joints connect it to the base world; choose the base with --base"),
    ("m.xml", HEAD, (*BODY, "--actuated", "stewart_7"), "--actuated stewart_7: no such joint between base and platform; did you mean 'stewart_6'?"),
    ("m.xml", HEAD, (*BODY, "--actuated", "ear"), "--actuated ear: no such joint between base and platform"),
    ("m.xml", HEAD, (*BODY, "--actuated", "passive_1"), "the ball joint passive_1 must not have an actuator; only hinges and slides may"),
    ("m.urdf", URDF, BODY, "no joint between base and platform has an actuator; name actuated joints with --actuated; allowed: stewart_1"),
    ("m.xml", HEAD, (*BODY, "--loops", "x.yaml"), "--loops x.yaml: is only for URDF files"),
    # Loops.
    ("m.xml", reachy.mjcf(lift=0.001), BODY, "the loop loop_1 is open by 0.001 and 0 deg, more than 1e-06 of the robot's size 0.117; --close closes it by Newton's method"),
    # Hostile and broken files.
    ("m.xml", BOMB, BODY, "it declares a document type or entities, which are not allowed"),
    ("m.urdf", OUTSIDE, BODY, "it declares a document type or entities, which are not allowed"),
    ("m.xml", "<mujoco>" + " " * 17 * 2**20, BODY, "it is larger than 16 MB"),
    ("m.xml", "<body>" * 500, BODY, "its elements are nested more than 400 deep"),
    ("m.xml", f"<mujoco>{'<a/>' * 200_001}</mujoco>", BODY, "it has more than 200000 elements"),
    ("m.xml", "<mujoco", BODY, "is not valid XML"),
    ("m.xml", b"\xff\xfe\x00", BODY, "is not valid XML"),
    ("m.xml", "", BODY, "is not valid XML"),
    ("m.xml", "<sdf/>", BODY, "expected <mujoco> of MJCF or <robot> of URDF as root element, got <sdf>"),
    # MJCF.
    ("m.xml", '<mujoco><include file="m.xml"/></mujoco>', BODY, "includes m.xml, which includes itself"),
    ("m.xml", '<mujoco><include file="n.xml"/></mujoco>', BODY, "includes n.xml, which does not exist"),
    ("m.xml", "<mujoco><include/></mujoco>", BODY, "<include>: attribute file is missing"),
    ("m.xml", '<mujoco><worldbody><replicate count="99999999"><body/></replicate></worldbody></mujoco>', BODY, "replicate count = 99999999: must give at most 2000 copies in total"),
    ("m.xml", '<mujoco><worldbody><attach model="arm" prefix="a"/></worldbody></mujoco>', BODY, "attaches 'arm', which is not supported; save the model as a single file first"),
    ("m.xml", HEAD.replace('name="passive_2"', 'name="passive_1"'), BODY, "MuJoCo cannot read it: "),
    ("m.xml", HEAD.replace('axis="', 'axis="nan '), BODY, "MuJoCo cannot read it: "),
    ("m.xml", HEAD.replace('joint="stewart_3"', 'joint="stewart_9"'), BODY, "an actuator drives 'stewart_9', which is not a hinge or slide of the model"),
    ("m.xml", HEAD.replace("<equality>", '<equality><joint joint1="stewart_1" joint2="stewart_2" polycoef="0 1 2 0 0"/>'), BODY, "must be linear"),
    ("m.xml", HEAD.replace('name="rod_1"', 'name="rod&#10;1"'), BODY, r"the body 'rod\n1' must have a name of printable characters"),
    ("m.xml", HEAD.replace('model="head"', 'model="a&#9;b"'), BODY, r"the robot 'a\tb' must have a name of printable characters"),
    ("m.xml", HEAD.replace('model="head"', 'model="a&#27;[31mb"'), BODY, "is not valid XML"),
    # URDF.
    ("m.urdf", URDF.replace('type="spherical"', 'type="rod"', 1), ALL, 'constraint closing_1, type = "rod": must be one of spherical, ball, fixed'),
    ("m.urdf", URDF.replace('<parent link="rod_1"/><parent_origin', '<parent link="rod_9"/><parent_origin'), ALL, 'constraint closing_1, parent = "rod_9": must be one of the links'),
    ("m.urdf", URDF.replace('type="revolute"', 'type="hinge"', 1), ALL, 'type = "hinge": must be one of revolute'),
    ("m.urdf", URDF.replace('xyz="1.0 0.0 0.0"', 'xyz="0 0 0"', 1), ALL, 'axis = "0 0 0": must be a direction'),
    ("m.urdf", URDF.replace('xyz="1.0 0.0 0.0"', 'xyz="1 0"', 1), ALL, 'axis, xyz = "1 0": must be three finite numbers'),
    ("m.xml", HEAD.replace('pos="0.0 0.0 ', 'pos="1e200 0.0 '), BODY, "must have finite coordinates of at most 1e+09"),
    ("m.urdf", URDF.replace('xyz="1.0 0.0 0.0"', 'xyz="1 0 inf"', 1), ALL, "must be three finite numbers"),
    ("m.urdf", URDF.replace('<link name="rod_2"/>', '<link name="rod_1"/>'), ALL, "has two elements <link> with the name 'rod_1'"),
    ("m.urdf", URDF.replace('<link name="torso"/>', '<link name="torso"/><link name="spare"/>'), ALL, "must have exactly one root link (a link that is not the child of a joint), got torso, spare"),
    ("m.urdf", '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="a"/></robot>', ALL, "has xacro elements, which are not supported; convert it to plain URDF first"),
    ("m.urdf", '<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint></robot>', ALL, "must have exactly one root link (a link that is not the child of a joint), got none"),
    ("m.urdf", URDF.replace('<child link="horn_1"/>', '<child link="horn_1"/><mimic joint="x"/>'), ALL, 'mimic = "x": must be the name of another joint'),
    # Dimensions.
    ("m.xml", HEAD, (*BODY, "--free", "circle9"), "--free circle9: no such joint, circle or symmetry; did you mean 'circle3'?"),
    ("m.xml", HEAD, (*BODY, "--free", "circle1", "stewart_1"), "--free stewart_1: the centre of stewart_1 is a dimension already"),
    ("m.xml", HEAD, (*BODY, "--free", "passive_1.axis"), "--free passive_1.axis: the joint is of type S, which has no single axis"),
    ("m.xml", HEAD, (*BODY, "--free", "circle1=a", "circle2=a"), "--free: the dimension a exists already"),
    ("m.xml", HEAD, (*BODY, "--free", "circle1=sin"), "the robot cannot be written as a robot file: "),
]  # fmt: skip


def test_each_fault_is_one_sentence_and_no_file(tmp_path: Path, cli: Run, capfd: pytest.CaptureFixture[str]) -> None:
    for number, (name, text, arguments, words) in enumerate(FAULTS):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
        out = folder / "robot.toml"
        err = refusal_of(cli("import", str(folder / name), "--out", str(out), *arguments), words)
        assert "\x1b" not in err, number
        assert sorted(path.name for path in folder.iterdir()) == [name], number
    # Neither parser wrote past the command's own streams.
    assert capfd.readouterr() == ("", "")


def test_yaml_of_loops_is_checked(tmp_path: Path, cli: Run) -> None:
    model, loops, out = (
        saved(tmp_path / "m.urdf", reachy.urdf("pairs")),
        tmp_path / "loops.yaml",
        tmp_path / "robot.toml",
    )
    for text, words in [
        ("closed_loop: [[a, b]", "is not valid YAML"),
        ("[1, 2]", "must be a table of loops"),
        ("closed_loop: [[a]]", "closed_loop: must be a list of pairs of names"),
        (PAIRS.replace("loop1_A", "loop9_A"), 'closed_loop = "loop9_A": no such link or joint in the URDF file'),
        (PAIRS.replace("3d", "4d"), 'type = "4d": must be 3d or 6d'),
        (PAIRS.replace("[3d]", "[3d, 3d]"), "type: must have 1 entries, one for each loop, got 2"),
        (PAIRS.replace("[stewart_1]", "[stewart_x]"), 'name_mot = "stewart_x": no such joint in the URDF file'),
        (PAIRS + "joint_name: [stewart_2]\njoint_type: [BALL]\n", 'joint_type = "BALL": must be SPHERICAL, FIXED or'),
        (
            PAIRS + "joint_name: [stewart_2]\n",
            "joint_type: must have 1 entries, one for each name in joint_name, got 0",
        ),
        ("x: &a [1]\n" + "y: " + "[" * 1100, "is not valid YAML"),
        (" " * (2**20 + 1), "it is larger than 1 MB"),
    ]:
        loops.write_text(text, encoding="utf-8")
        refusal_of(cli("import", str(model), *BODY, "--out", str(out), "--loops", str(loops)), words)
        assert not out.exists()


def test_the_extra_that_is_missing_is_named(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    model, urdf, out = saved(tmp_path / "m.xml", HEAD), saved(tmp_path / "m.urdf", URDF), tmp_path / "robot.toml"
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "yaml", None)
    err = refusal_of(cli("import", str(model), *BODY, "--out", str(out)))
    assert err == "screwsynth: MJCF files need mujoco, which is not installed: pip install 'screwsynth[robots]'\n"
    # URDF needs neither, until a YAML file states its loops.
    assert cli("import", str(urdf), *ALL, "--out", str(out))[0] == 0
    saved(urdf.with_suffix(".yaml"), PAIRS)
    missing = "YAML files of loops need pyyaml, which is not installed: pip install 'screwsynth[robots]'"
    refusal_of(cli("import", str(urdf), *ALL, "--out", str(tmp_path / "second.toml")), missing)


def test_inputs_are_not_written_over(tmp_path: Path, cli: Run) -> None:
    model = saved(tmp_path / "m.xml", HEAD)
    lost = "is the model that is read, which would be lost"
    refusal_of(cli("import", str(model), *BODY, "--out", str(model)), lost)
    assert model.read_text(encoding="utf-8") == HEAD
    none = cli("import", str(tmp_path / "none.xml"), *BODY, "--out", str(tmp_path / "o.toml"))
    refusal_of(none, "none.xml: cannot be read: No such file or directory")
    refusal_of(cli("import", str(model), *BODY), "--out: is missing")

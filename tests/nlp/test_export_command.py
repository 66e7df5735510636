"""The command ``export``: its files, cases that it takes and refuses, and results instead of a solve."""

import json
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
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
    tree = Tree(again["robot.xml"], 50.0)
    assert tree.open <= 1e-9


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
    case = solution.case
    text = export_robot(solution, ["mjcf"], pose=case.pose_count)["robot.xml"]
    assert Tree(text, 50.0).open <= 1e-9


def test_refusals_are_one_sentence_and_write_nothing(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "robot"
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine", encoding="utf-8")
    case = "paper-4.1-helical"
    for words, fault in {
        ("--format", "stl", "--out", str(out)): "--format stl: is no format; allowed: mjcf, urdf, csv, dxf, all",
        ("--format", "mjcf", "--out", str(tmp_path / "full")): "holds mine.txt, which screwsynth did not write",
        ("--format", "mjcf", "--out", str(out), "--pose", "2"): "--pose 2: the case has 1 pose",
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
    fixed = [
        f"--set={each.name}={value}"
        for each, value in zip(nlp.program.variables, nlp.start, strict=True)
        if not each.name.startswith("q")
    ]
    output_of(cli(*words, *fixed, "--set=angle=0", "--set=axis=0,0,1"))


def test_a_result_is_exported_without_a_solve(tmp_path: Path, cli: Run) -> None:
    # A robot given joint by joint away from home, two tasks combined, and several poses.
    (tmp_path / "3-rps.toml").write_text(starter_text("3-rps"), encoding="utf-8")
    cases = (str(tmp_path / "3-rps.toml"), ()), ("paper-4.2", ()), ("flight-simulator", ("--pose", "7"))
    for case, words in cases:
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
    result.write_text(json.dumps(data), encoding="utf-8")
    refusal_of(cli("export", "paper-4.1-helical", *words), "another assembly of its joints")
    result.write_text("{}", encoding="utf-8")
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


def test_solutions_that_are_no_answer_or_pose_are_refused() -> None:
    solution = solve(load_case("free-wrist"), starts=2)
    with pytest.raises(InputError, match="--pose 2: the case has 1 pose"):
        export_robot(solution, ["mjcf"], pose=2)
    with pytest.raises(InputError, match="--format step: is no format"):
        export_robot(solution, ["step"])

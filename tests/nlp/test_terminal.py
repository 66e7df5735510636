"""What commands print: the answer in 25 lines of 80 columns, everything with --all, commands that a shell reads."""

import io
import json
import math
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from builders import FEW_CASES, Run, commands_in, output_of, ran, refusal_of, saved, soaked, turn_about, unbroken
from rich.console import Console

from screwsynth.nlp import Case, load_case, shipped_cases
from screwsynth.nlp.case.pose import RotationForm
from screwsynth.nlp.output.terminal import PLAIN_WIDTH, ROOM, show
from screwsynth.nlp.results.posewording import evaluate_command, pose_words, rotation_form, rotation_numbers
from screwsynth.nlp.results.text import Line, TextTable
from screwsynth.nlp.results.workspace import WorkspacePose

#: A command on a shipped case, and whether everything of it is printed too.
COMMANDS = [
    ("models", True),
    ("models delta", True),
    ("models 6-ups", True),
    ("solve paper-4.1-helical --starts 2", True),
    ("solve paper-4.2 --starts 2 --certify", False),
    ("solve hexapod-machining --starts 2", False),
    ("solve camera-mount --starts 2", False),
    ("solve handling-3-upu --starts 1", False),
    ("certify paper-4.1-helical", False),
    ("certify paper-4.2", True),
    ("workspace hexapod-linuxcnc", True),
    ("workspace hexapod-linuxcnc --set limits.leg_length.max=30", True),
    ("path hexapod-linuxcnc --along POSES", True),
    ("path hexapod-linuxcnc --range --time 1", False),
    ("inverse hexapod-linuxcnc --poses POSES", False),
    ("tradeoff hexapod-machining --over limits.leg_length.max=30:36:3 --starts 1", False),
    ("sweep paper-4.1-helical --over x1=11,12 --out TABLE", False),
    ("pareto free-wrist --goal max_F --goal min_limits.leg_length.max --points 2 --starts 1", False),
    ("compare drilling-spindle case delta --starts 1", True),
    ("check paper-4.1-helical", False),
    ("export hexapod-linuxcnc --format all --out FOLDER", False),
]


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    """Files that commands read and write, by their words in a command."""
    (tmp_path / "poses.csv").write_text(
        "x,y,z,roll,pitch,yaw\n0,0,20,0,0,0\n5,0,20,3,0,0\n20,0,20,7,1,0\n", encoding="utf-8"
    )
    return {"POSES": "poses.csv", "TABLE": "table.csv", "FOLDER": "folder"}


def widest(out: str) -> int:
    return max(map(len, out.splitlines()))


@pytest.mark.parametrize(("command", "with_all"), COMMANDS, ids=[command for command, _ in COMMANDS])
def test_a_command_prints_its_answer_in_few_short_lines(
    command: str, with_all: bool, files: dict[str, str], cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = [files.get(word, word.replace("_F", " F").replace("min_", "min ")) for word in command.split()]
    _, out, _ = cli(*arguments)
    assert 0 < len(out.splitlines()) <= ROOM
    assert widest(out) <= PLAIN_WIDTH
    if with_all:
        _, every, _ = cli(*arguments, "--all")
        assert widest(every) <= PLAIN_WIDTH
        assert "--all" not in every.replace("--all, --csv FILE", "")
        assert len(every.splitlines()) >= len(out.splitlines()) - 1


@pytest.mark.parametrize("name", soaked(shipped_cases(), FEW_CASES))
def test_an_evaluation_is_short_for_every_shipped_case(name: str, cli: Run) -> None:
    _, out, _ = cli("evaluate", name)
    assert 0 < len(out.splitlines()) <= ROOM
    _, every, _ = cli("evaluate", name, "--all")
    assert widest(out + every) <= PLAIN_WIDTH
    assert len(every.splitlines()) >= len(out.splitlines()) - 1


def test_proofs_that_hold_are_short_too(cli: Run, tmp_path: Path) -> None:
    for command, name in (("certify", "paper-4.1-helical"), ("workspace", "hexapod-linuxcnc")):
        proof = str(tmp_path / f"{command}.json")
        output_of(cli(command, name, "--proof", proof))
        out, every = output_of(cli("verify-proof", proof, name)), output_of(cli("verify-proof", proof, name, "--all"))
        assert out.startswith("holds: ")
        assert len(out.splitlines()) <= ROOM
        assert widest(out + every) <= PLAIN_WIDTH


@pytest.fixture(scope="module")
def refuted(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Output of a judged workspace with refuted and open claims, and its result."""
    target = tmp_path_factory.mktemp("judged") / "result.json"
    command = ["workspace", "reachy-mini-envelope", "--time", "2", "--json", str(target)]
    return ran(*command).output, target


def test_every_limit_is_counted_by_its_outcome(refuted: tuple[str, Path]) -> None:
    out, target = refuted
    assert len(out.splitlines()) == ROOM
    assert widest(out) <= PLAIN_WIDTH
    outcomes = [each["outcome"] for each in json.loads(target.read_text())["extremes"] if "limit" in each]
    assert len(outcomes) == 18
    for outcome in ("refuted", "open", "proved"):
        shown = re.search(rf"^{outcome}  (\d+) limits?: ", out, re.MULTILINE)
        assert (0 if shown is None else int(shown[1])) == outcomes.count(outcome)
    # The first ones are shown in full, and others are named.
    assert len(commands_in(out, "see it with")) == 2
    assert re.search(r"^other refuted claims  \d+: --all, ", out, re.MULTILINE)


def text(items: list[Line | TextTable], width: int, *, whole: bool) -> str:
    out = io.StringIO()
    show(Console(file=out, width=width, highlight=False, markup=False, emoji=False), items, whole=whole)
    return out.getvalue()


def test_parts_that_fit_are_shown_and_others_are_named() -> None:
    def lines(name: str, count: int) -> list[Line]:
        return [Line(f"{name} {k}", part=name) for k in range(count)]

    answer: list[Line | TextTable] = [Line("the answer")]
    short = text([*answer, *lines("one", 30), *lines("two", 10), *lines("three", 20)], 80, whole=False).splitlines()
    assert short == ["the answer", *(f"two {k}" for k in range(10)), "more  one, three: --all"]
    # All of them, where there is room for all.
    assert "more" not in text([*answer, *lines("one", 14), *lines("two", 10)], 80, whole=False)
    assert text([*answer, *lines("one", 30)], 80, whole=True).count("\n") == 31


def test_a_long_table_loses_columns_before_rows_and_a_curve_keeps_its_ends() -> None:
    rows = tuple((str(k), "limit " * 9) for k in range(20))
    few = text([TextTable(("value", "active"), rows, extra=1)], 50, whole=False)
    assert [line.strip() for line in few.splitlines()[1:-1]] == [str(k) for k in range(20)]
    assert few.endswith("--all shows the column active\n")
    many = TextTable(("value",), tuple((str(k),) for k in range(101)), is_curve=True)
    shown = text([many], 50, whole=False).splitlines()
    assert len(shown) == ROOM
    assert (shown[1], shown[-2], shown[-1]) == ("0", "100", "23 of 101 rows: --all shows every one")
    steps = np.diff([int(each) for each in shown[1:-1]])
    assert set(steps) <= {4, 5}
    first = text([TextTable(("value",), many.rows)], 50, whole=False).splitlines()
    assert first[-2:] == ["22", "and 78 more rows: --all"]
    assert text([many], 50, whole=True).count("\n") == 102


@pytest.mark.parametrize("width", [30, 50, 80])
def test_a_broken_command_is_one_for_a_shell(width: int) -> None:
    words = ["evaluate", "it's my --case.toml", *(f"--set x{k}={k}.25" for k in range(9)), "--set axis=0,0,1"]
    command = "screwsynth " + " ".join(each if each.startswith("--set") else f"'{each}'" for each in words[2:])
    command = f"screwsynth evaluate 'it'\"'\"'s my --case.toml' {command.removeprefix('screwsynth ')}"
    shown = text([Line(command, label="see it", is_command=True)], width, whole=False)
    assert widest(shown) <= max(width, len("see it  screwsynth evaluate 'it'\"'\"'s my --case.toml' \\"))
    script = shown.replace("see it  screwsynth ", "printf '%s|' ")
    read = subprocess.run(["sh", "-c", script], capture_output=True, text=True, check=True).stdout
    assert read == "|".join([*words[:2], *(part for each in words[2:] for part in each.split(" "))]) + "|"


def turned(name: str, rotation: str) -> Case:
    """A shipped case without a workspace, with another rotation."""
    return load_case(name, {"rpy": [1.0, 2.0, 3.0]} if rotation == "rpy" else {"quaternion": [0.8, 0.6, 0.0, 0.0]})


def test_a_rotation_is_shown_in_the_form_of_the_case() -> None:
    assert rotation_form(load_case("reachy-mini-envelope")) is RotationForm.RPY
    assert rotation_form(load_case("hexapod-linuxcnc")) is RotationForm.AXIS_ANGLE
    assert rotation_form(turned("hexapod-machining", "rpy")) is RotationForm.RPY
    assert rotation_form(turned("hexapod-machining", "quaternion")) is RotationForm.QUATERNION
    axis, angle = np.array([2, -3, 6]) / 7, 40.0
    case = load_case("reachy-mini-envelope")
    roll, pitch, yaw = np.radians(rotation_numbers(case, axis.tolist(), angle, RotationForm.RPY)["rpy"])
    R = turn_about((0, 0, 1), yaw) @ turn_about((0, 1, 0), pitch) @ turn_about((1, 0, 0), roll)
    np.testing.assert_allclose(R, turn_about(axis, math.radians(angle)), atol=1e-14)
    pose = WorkspacePose(position=(0.0, 0.0, 0.177), axis=tuple(axis.tolist()), angle=angle)
    shown = pose_words(case, pose)
    assert shown == "(0, 0, 0.177), " + f"roll {math.degrees(roll):.5g}, pitch {math.degrees(pitch):.5g}, yaw " + (
        f"{math.degrees(yaw):.5g} deg"
    )
    assert pose_words(turned("hexapod-machining", "quaternion"), pose).endswith(
        "quaternion (0.93969, 0.09772, -0.14658, 0.29316)"
    )


def test_a_rotation_is_set_in_every_form(cli: Run) -> None:
    """Roll by 90 degrees about x, in three forms, and rows of the design in these forms."""
    forms = (
        (["rpy=90,0,0"], ("roll", "pitch", "yaw")),
        ([f"quaternion={math.sqrt(0.5)!r},{math.sqrt(0.5)!r},0,0"], ("q_w", "q_x", "q_y", "q_z")),
        (["axis=1,0,0", "angle=90"], ("axis", "angle")),
    )
    found = []
    for settings, names in forms:
        flags = [part for each in settings for part in ("--set", each)]
        _, out, _ = cli("evaluate", "hexapod-linuxcnc", *flags, "--all")
        rows = [line.split()[0] for line in out.splitlines() if line.split()]
        assert all(name in rows for name in names)
        found.append(json.loads(cli("evaluate", "hexapod-linuxcnc", *flags, "--json", "-")[1]))
    for each in found:
        assert each["F"] == pytest.approx(found[0]["F"], rel=1e-12)
        assert each["pose"]["angle"] == pytest.approx(90)


def test_a_command_has_no_more_digits_than_show_the_claim(cli: Run) -> None:
    """A leg that is too long by little needs digits; one that is too long by much needs few."""
    case = load_case("hexapod-linuxcnc")

    def command_at(x: float) -> list[str]:
        pose = WorkspacePose(position=(x, 0.0, 20.0), axis=(0.0, 0.0, 1.0), angle=0.0)
        return evaluate_command("hexapod-linuxcnc", case, {}, pose).split()[1:]

    def is_violated(x: float) -> bool:
        shown = cli("evaluate", "hexapod-linuxcnc", "--set", f"p_x={x!r}", "--json", "-")[1]
        return bool(json.loads(shown)["violated"])

    assert "p_x=19.1" in command_at(19.123456789)
    low, high = 17.0, 19.0
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (low, middle) if is_violated(middle) else (middle, high)
    (stated,) = (each for each in command_at(high) if each.startswith("p_x"))
    value = float(stated.removeprefix("p_x="))
    digits = len(stated.partition(".")[2])
    assert is_violated(value)
    assert not any(is_violated(round(high, fewer)) for fewer in range(1, digits))
    assert cli(*command_at(high))[0] == 1


def test_the_command_at_a_singular_pose_and_beyond_reach_shows_both(cli: Run, refuted: tuple[str, Path]) -> None:
    out, _ = refuted
    singular, beyond = commands_in(out, "see it with")
    assert "refuted  regular: J is singular" in unbroken(out)
    assert any(each.startswith("rpy=") for each in singular)
    assert json.loads(cli(*singular, "--json", "-")[1])["rank"] < 6
    status, _, err = cli(*beyond)
    assert status != 0 or err
    assert [each for each in beyond if each.startswith("rpy=")] == ["rpy=40,-40,65"]


def test_a_refuted_claim_of_a_result_is_evaluated(cli: Run, tmp_path: Path) -> None:
    """Each claim of the result is shown at its pose, and a wrong number or result is one sentence."""
    target = str(tmp_path / "result.json")
    cli("workspace", "hexapod-linuxcnc", "--set", "x1=25", "--set", "limits.leg_length.max=40", "--json", target)
    claims = [each for each in json.loads(Path(target).read_text())["extremes"] if each["outcome"] == "refuted"]
    assert len(claims) > 2
    for k, claim in enumerate(claims, start=1):
        status, out, _ = cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", "--json", "-")
        point = json.loads(out)
        assert status == 1
        assert point["parameters"]["x1"] == 25
        (limb,) = (value for key, value in point["quantities"]["leg_length"].items() if claim["name"].endswith(key))
        assert limb == pytest.approx(claim["reached"], rel=1e-9)
    for wrong, words in ((f"{target}#0", "refuted claims"), (target, "RESULT#N"), (f"{target}#99", "refuted claims")):
        refusal_of(cli("evaluate", "hexapod-linuxcnc", "--set-from", wrong), "--set-from", words)
    refusal_of(cli("evaluate", "hexapod-pocket", "--set-from", f"{target}#1"), "hexapod-linuxcnc", "hexapod-pocket")


def test_limits_of_set_are_evaluated_at_a_claim_of_a_workspace(cli: Run, tmp_path: Path) -> None:
    """The limits that the claim was judged with are in the result; those of the command take their place."""
    target = tmp_path / "result.json"
    settings = ("--set", "x1=25", "--set", "limits.leg_length.max=40", "--set", "p_x=1", "--set", "task.pitch=inf")
    cli("workspace", "hexapod-linuxcnc", *settings, "--json", str(target))
    tables = json.loads(target.read_text())
    claims = [each for each in tables["extremes"] if each["outcome"] == "refuted"]
    k, claim = next((k, each) for k, each in enumerate(claims, start=1) if each["limit"] == 40)
    owner = claim["name"].split()[-1]
    for limits, most in ((), 40.0), (("limits.leg_length.max=41",), 41.0), (("limits.leg_length=60",), 60.0):
        given = [part for each in limits for part in ("--set", each)]
        status, out, _ = cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", *given, "--json", "-")
        point = json.loads(out)
        lengths = point["quantities"]["leg_length"]
        assert lengths[owner] == pytest.approx(claim["reached"], rel=1e-9)
        assert status == int(max(lengths.values()) > most or min(lengths.values()) < 17)
        assert point["pose"]["position"] == claim["pose"]["position"]
    # A result of an earlier version has no settings.
    assert tables.pop("settings") == {"x1": 25, "limits.leg_length.max": 40, "p_x": 1, "task.pitch": "inf"}
    target.write_text(json.dumps(tables))
    shown = json.loads(cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", "--json", "-")[1])
    assert shown["parameters"]["x1"] == 25


def test_dimensions_and_limits_of_set_are_evaluated_at_a_claim_of_a_path(cli: Run, tmp_path: Path) -> None:
    way = saved(tmp_path / "way.csv", "x,y,z,roll,pitch,yaw\n0,0,19,0,0,0\n5,0,19,0,0,9\n")
    target = tmp_path / "path.json"
    limits = {"leg_length.max": 30.0, "base_joint_angle.max": 50.0}
    settings = [
        "--set",
        "x1=25",
        *(part for key, value in limits.items() for part in ("--set", f"limits.{key}={value}")),
    ]
    cli("path", "hexapod-linuxcnc", "--along", str(way), *settings, "--json", str(target))
    faults = [each for each in json.loads(target.read_text())["path"]["claims"] if each["outcome"] == "refuted"]
    assert {each["limit"] for each in faults} == {30, 50}
    for k, claim in enumerate(faults, start=1):
        point = json.loads(cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", "--json", "-")[1])
        assert point["parameters"]["x1"] == 25
        assert limits.items() <= {each["key"]: each["limit"] for each in point["limits"]}.items()
        kind, owner = claim["name"].split(" limb ")
        assert point["quantities"][kind][owner] == pytest.approx(claim["fault"]["value"], rel=1e-9)
        wide = [part for key in limits for part in ("--set", f"limits.{key}=89")]
        assert cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", *wide)[0] == 0

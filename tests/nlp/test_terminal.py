"""Terminal output: the answer in 25 lines, tables at every width, commands that a shell reads."""

import io
import json
import math
import re
import subprocess
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import (
    EACH_CASE,
    FEW_CASES,
    Patch,
    Run,
    assert_words,
    case_from,
    commands_in,
    output_of,
    ran,
    refusal_of,
    rows_of,
    saved,
    shipped_tables,
    soaked,
    turn_about,
    unbroken,
)
from rich.console import Console

from screwsynth.models import model_names
from screwsynth.nlp import Case, Free, Limits, Rotation, Task, build_model, load_case, shipped_cases, solve
from screwsynth.nlp.case.limits.legs import LegLength
from screwsynth.nlp.case.pose import RotationForm
from screwsynth.nlp.case.robots import model_options
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.screwvalues import motion_of
from screwsynth.nlp.evidence.state import WorkspacePose, evaluate
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.webpage import page_of
from screwsynth.nlp.output.terminal import PLAIN_WIDTH, ROOM, show
from screwsynth.nlp.program.epigraph import with_exact_level
from screwsynth.nlp.program.formulation import formulate, formulate_each
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.results.data import SolveResult
from screwsynth.nlp.results.evaluation import EvaluationResult, evaluation_of
from screwsynth.nlp.results.evidence import certificate_data
from screwsynth.nlp.results.poses import rotation_form, rotation_numbers
from screwsynth.nlp.results.result import result_of
from screwsynth.nlp.words.lines import certificate_lines, headline, motion_words, task_words
from screwsynth.nlp.words.models import model_words
from screwsynth.nlp.words.numbers import listed, number, quantity_words
from screwsynth.nlp.words.poses import evaluate_command, pose_words
from screwsynth.nlp.words.summary import case_summary, evaluation_summary
from screwsynth.nlp.words.tables import limit_table, margin_table, optimum_table
from screwsynth.nlp.words.text import Line, TextTable, Tone

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
    saved(tmp_path / "poses.csv", "x,y,z,roll,pitch,yaw\n0,0,20,0,0,0\n5,0,20,3,0,0\n20,0,20,7,1,0\n")
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
    for command, name, *gap in (("certify", "paper-4.1-rotation", "--gap", "0.1"), ("workspace", "hexapod-linuxcnc")):
        proof = str(tmp_path / f"{command}.json")
        output_of(cli(command, name, *gap, "--proof", proof))
        out, every = output_of(cli("verify-proof", proof, name)), output_of(cli("verify-proof", proof, name, "--all"))
        assert out.startswith("PROOF VALID: ")
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
    for outcome, word in {"refuted": "violated", "open": "undecided", "proved": "proved"}.items():
        shown = re.search(rf"^{word}  (\d+) limits?: ", out, re.MULTILINE)
        assert (0 if shown is None else int(shown[1])) == outcomes.count(outcome)
    # The first ones are shown in full, and others are named.
    assert len(commands_in(out, "see it with")) == 2
    assert re.search(r"^other violated claims  \d+: --all, ", out, re.MULTILINE)


def printed(items: Iterable[Line | TextTable], width: int, *, whole: bool = True) -> str:
    out = io.StringIO()
    show(Console(file=out, width=width, highlight=False, markup=False, emoji=False), items, whole=whole)
    return out.getvalue()


def test_parts_that_fit_are_shown_and_others_are_named() -> None:
    def lines(name: str, count: int) -> list[Line]:
        return [Line(f"{name} {k}", part=name) for k in range(count)]

    answer: list[Line | TextTable] = [Line("the answer")]
    short = printed([*answer, *lines("one", 30), *lines("two", 10), *lines("three", 20)], 80, whole=False).splitlines()
    assert short == ["the answer", *(f"two {k}" for k in range(10)), "more  one, three: --all"]
    # All of them, where there is room for all.
    assert "more" not in printed([*answer, *lines("one", 14), *lines("two", 10)], 80, whole=False)
    assert printed([*answer, *lines("one", 30)], 80, whole=True).count("\n") == 31


def test_a_long_table_loses_columns_before_rows_and_a_curve_keeps_its_ends() -> None:
    rows = tuple((str(k), "limit " * 9) for k in range(20))
    few = printed([TextTable(("value", "active"), rows, extra=1)], 50, whole=False)
    assert [line.strip() for line in few.splitlines()[1:-1]] == [str(k) for k in range(20)]
    assert few.endswith("--all shows the column active\n")
    many = TextTable(("value",), tuple((str(k),) for k in range(101)), is_curve=True)
    shown = printed([many], 50, whole=False).splitlines()
    assert len(shown) == ROOM
    assert (shown[1], shown[-2], shown[-1]) == ("0", "100", "23 of 101 rows shown: --all shows all")
    steps = np.diff([int(each) for each in shown[1:-1]])
    assert set(steps) <= {4, 5}
    first = printed([TextTable(("value",), many.rows)], 50, whole=False).splitlines()
    assert first[-2:] == ["22", "and 78 more rows: --all"]
    assert printed([many], 50, whole=True).count("\n") == 102


@pytest.mark.parametrize("width", [30, 50, 80])
def test_a_broken_command_is_one_for_a_shell(width: int) -> None:
    words = ["evaluate", "it's my --case.toml", *(f"--set x{k}={k}.25" for k in range(9)), "--set axis=0,0,1"]
    command = "screwsynth " + " ".join(each if each.startswith("--set") else f"'{each}'" for each in words[2:])
    command = f"screwsynth evaluate 'it'\"'\"'s my --case.toml' {command.removeprefix('screwsynth ')}"
    shown = printed([Line(command, label="see it", is_command=True)], width, whole=False)
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
    words = ", ".join(f"{name} {math.degrees(a):.5g}" for name, a in (("roll", roll), ("pitch", pitch), ("yaw", yaw)))
    assert pose_words(case, pose) == f"(0, 0, 0.177), {words} deg"
    shown = pose_words(turned("hexapod-machining", "quaternion"), pose)
    assert shown.endswith("quaternion (0.93969, 0.09772, -0.14658, 0.29316)")


def test_a_rotation_is_set_in_every_form(cli: Run) -> None:
    """Roll by 90 degrees about x, in three forms, and rows of the design in these forms."""
    forms = (
        (["rpy=90,0,0"], ("roll", "pitch", "yaw")),
        ([f"quaternion={math.sqrt(0.5)!r},{math.sqrt(0.5)!r},0,0"], ("q_w", "q_x", "q_y", "q_z")),
        (["axis=1,0,0", "angle=90"], ("axis", "angle")),
    )
    found = []
    for settings, names in forms:
        flags = [f"--set={each}" for each in settings]
        _, out, _ = cli("evaluate", "hexapod-linuxcnc", *flags, "--all")
        rows = [line.split()[0] for line in out.splitlines() if line.split()]
        assert all(name in rows for name in names)
        found.append(json.loads(cli("evaluate", "hexapod-linuxcnc", *flags, "--json", "-")[1]))
    for each in found:
        assert each["F"] == pytest.approx(found[0]["F"], rel=1e-12)
        assert each["pose"]["angle"] == pytest.approx(90)


def test_a_point_shows_F_with_its_unit_and_nothing_at_rounding_level(cli: Run) -> None:  # noqa: N802 - the objective
    _, out, _ = cli("evaluate", "reachy-mini")
    assert "(m/rad)²" in next(line for line in out.splitlines() if line.startswith("F  "))
    assert "e-10" not in out
    # The numbers themselves are in the result.
    _, out, _ = cli("evaluate", "reachy-mini", "--json", "-")
    pitches = [each["pitch"] for each in json.loads(out)["principal_motions"]["rotations"]]
    assert 0 < abs(pitches[0]) < 1e-6
    # Legs upright below equal plates do no work in a turn about the normal: F is the rounding of larger terms.
    upright = ("x1=8", "x2=8", "x3=7.3", "x4=7.3", "p_x=0", "p_y=0", "angle=0")
    _, out, _ = cli("evaluate", "paper-4.2", *(f"--set={each}" for each in upright))
    assert [line for line in out.splitlines() if line.startswith("F  ")] == ["F  6 (cm/cm)²", "F  0 (cm/rad)²"]


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
    # A limit on speeds, which needs a motion, takes no digits away: evaluate leaves it out.
    tables = shipped_tables("hexapod-linuxcnc")
    tables["limits"] |= {"actuator_speed": {"max": 5}}
    fast = case_from(tables)
    pose = WorkspacePose(position=(high, 0.0, 20.0), axis=(0.0, 0.0, 1.0), angle=0.0)
    assert evaluate_command("hexapod-linuxcnc", fast, {}, pose).split()[1:] == command_at(high)


def test_the_command_at_a_singular_pose_and_beyond_reach_shows_both(cli: Run, refuted: tuple[str, Path]) -> None:
    out, _ = refuted
    singular, beyond = commands_in(out, "see it with")
    assert "violated  J is singular" in unbroken(out)
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
        given = [f"--set={each}" for each in limits]
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
    settings = ["--set=x1=25", *(f"--set=limits.{key}={value}" for key, value in limits.items())]
    cli("path", "hexapod-linuxcnc", "--along", str(way), *settings, "--json", str(target))
    faults = [each for each in json.loads(target.read_text())["path"]["claims"] if each["outcome"] == "refuted"]
    assert {each["limit"] for each in faults} == {30, 50}
    for k, claim in enumerate(faults, start=1):
        point = json.loads(cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", "--json", "-")[1])
        assert point["parameters"]["x1"] == 25
        assert limits.items() <= {each["key"]: each["limit"] for each in point["limits"]}.items()
        kind, owner = claim["name"].split(" limb ")
        assert point["quantities"][kind][owner] == pytest.approx(claim["fault"]["value"], rel=1e-9)
        wide = [f"--set=limits.{key}=89" for key in limits]
        assert cli("evaluate", "hexapod-linuxcnc", "--set-from", f"{target}#{k}", *wide)[0] == 0


WIDTHS = (60, 80, 100, 120)
LIMB_NAMES = ("1", "2", "3", "4", "5", "6")

EIGHT = """
title = "Motion base with eight poses"
units = { length = "mm" }
task = [{ name = "roll", sense = "max", axis = [1, 0, 0], point = [12, 0, 700], pitch = 30 }]
robot.model = "hexapod"
[robot.parameters]
base_1 = [{ min = 350, max = 450 }, 60, 3]
base_2 = [260, 320, -4]
base_3 = [-150, 390.5, 2]
base_4 = [-391, 71.25, 0]
base_5 = [-230, -330, 5]
base_6 = [180, -370, -2]
platform_1 = [170, 110, -8]
platform_2 = [31, 196, 4]
platform_3 = [-160.5, 120, 3]
platform_4 = [-185, -80, 0]
platform_5 = [22, -201.5, -3]
platform_6 = [162, -121, 6]
[pose]
position = [{ min = -50, max = 50 }, 0, { min = 600, max = 700 }]
along_task = { first = -20, last = 20, count = 8 }
[limits]
leg_length = { min = 500, max = 950 }
base_joint_angle = { max = 45, about = "home" }
platform_joint_angle = 60
home = { position = [0, 0, 650] }
leg_clearance = { min = 30 }
"""


def evaluated(case: Case) -> EvaluationResult:
    nlps = formulate_each(case)
    x = with_exact_level(nlps[0], close_equations(nlps[0], nlps[0].start))
    return evaluation_of(nlps, x, [evaluate(nlp, x) for nlp in nlps])


def table_of(case: Case, name: str) -> TextTable:
    """A table of the evaluation of a case."""
    return next(i for i in evaluation_summary(case, evaluated(case)) if isinstance(i, TextTable) and i.name == name)


def case_of(name: str) -> Case:
    return case_from(EIGHT, "eight") if name == "eight" else load_case(name)


@cache
def solved(name: str) -> tuple[Line | TextTable, ...]:
    case = case_of(name)
    return tuple(case_summary(case, result_of(solve(case, starts=2))))


def check_widths(items: tuple[Line | TextTable, ...]) -> None:
    words = Counter(printed(items, 2000).split())
    for width in WIDTHS:
        text = printed(items, width)
        assert max(map(len, text.splitlines())) <= width
        # Every word and number is whole; headers and names of rows may occur more than once.
        assert not words - Counter(text.split()), width


@pytest.mark.parametrize("name", soaked(["eight", *EACH_CASE], ("eight", *FEW_CASES)))
def test_no_number_of_a_solve_or_an_evaluation_is_split_at_any_width(name: str) -> None:
    case = case_of(name)
    check_widths(solved(name))
    check_widths(tuple(evaluation_summary(case, evaluated(case))))


def test_the_continuation_of_a_wrapped_cell_is_indented() -> None:
    rows = (('actuator_force 2-, load "cutting"', "at the first pose"), ("leg_length 1", "at home"))
    lines = printed([TextTable(("quantity", "where"), rows)], 34).splitlines()
    assert lines == [
        "quantity          where",
        "actuator_force    at the first",
        "  2-, load          pose",
        '  "cutting"',
        "leg_length 1      at home",
    ]
    # A word that is wider than its column keeps the indent, too.
    assert printed([TextTable(("name",), (("a " + "b" * 15,),))], 10).splitlines() == [
        "name",
        "a",
        "  bbbbbbbb",
        "  bbbbbbb",
    ]


def test_a_load_without_a_name_is_named_once() -> None:
    assert quantity_words("actuator_force actuator 1 load load 1") == "actuator_force actuator 1, load 1"
    assert quantity_words("actuator_force actuator 1 load load 1 reversed pose 2") == (
        "actuator_force actuator 1, load 1 reversed pose 2"
    )
    assert quantity_words("actuator_force actuator 1 load cutting, other sense") == (
        'actuator_force actuator 1, load "cutting", other sense'
    )
    assert quantity_words("actuator_force actuator 1 backwards load tool") == (
        'actuator_force actuator 1, negative force, load "tool"'
    )


def test_a_narrow_table_goes_on_below_with_the_names_of_its_rows() -> None:
    numbers = [f"{k}.123456" for k in range(9)]
    table = TextTable(("leg", *(f"column {k}\nmm" for k in range(9))), (("1-", *numbers), ("1+", *numbers)))
    lines = printed([table], 60).splitlines()
    assert all(len(line) <= 60 for line in lines)
    assert sum(line.startswith("1- ") for line in lines) == 2
    assert all(len(re.findall(re.escape(each), "\n".join(lines))) == 2 for each in numbers)
    assert printed([TextTable(("", ""), (("x", "y" * 90),))], 60).count("y") == 90
    # No word about a robot is split at any width.
    for name in model_names():
        check_widths(tuple(model_words(name, build_model(name), model_options(name))))


def test_no_rounding_noise_and_no_plural_of_one_on_a_page() -> None:
    case = load_case("paper-4.4-min")
    solution = solve(case, starts=2)
    page = page_of(report_of("", solution, result_of(solution)))
    assert re.search(r"\de-[23]\d", page), "the JSON has the noise as it is"
    words = re.sub(r"<script.*?</script>|<p><span class=.label.>evidence:.*?</p>", "", page, flags=re.DOTALL)
    assert not re.findall(r".{40}\de-[1-3]\d", words)
    solution = solve(load_case("paper-4.1-helical"), starts=1)
    table = optimum_table(solution.outcomes[0].own)
    assert [str(row[0]).partition(", ")[2] for row in table.rows] == ["1 start"]
    page = page_of(report_of("", solution, result_of(solution)))
    assert not re.search(r"\b1 (starts|starting points|times|optima)\b", page)


@pytest.mark.parametrize("name", soaked(shipped_cases(), (*FEW_CASES, "paper-4.4-snu", "paper-4.4-min", "paper-4.2")))
def test_no_rounding_noise_in_an_evaluation(name: str) -> None:
    """Every number of the tables is 0, or at least a hundred-millionth of the largest one in its row or column."""
    case = case_of(name)
    tables = [item for item in evaluation_summary(case, evaluated(case)) if isinstance(item, TextTable)]
    for text in (cell for table in tables for row in table.rows for cell in row if isinstance(cell, str)):
        for found in re.findall(r"[-+]?\d\.?\d*e-\d+", text):
            assert abs(float(found)) > 1e-12, text
    assert not re.search(r"[-+]0(?![.\d])", printed(tables, 200))


def test_noise_of_a_singular_robot_is_zero_in_words_and_stays_in_json() -> None:
    case = load_case("paper-4.4-snu")
    result = evaluated(case)
    limbs, jacobian = table_of(case, "limbs"), table_of(case, "jacobian")
    assert {row[2] for row in limbs.rows} == {"0"}
    assert all(abs(float(str(cell))) > 1e-6 or cell == "0" for row in jacobian.rows for cell in row[1:])
    lines = [item for item in evaluation_summary(case, result) if isinstance(item, Line)]
    (values,) = (line.text for line in lines if line.label == "singular values")
    assert values.split()[4:] == ["0", "0"]
    assert any(0 < abs(rate) < 1e-12 for rate in result.robot.rates or ())
    assert 0 < result.robot.singular_values[5] < 1e-12


def test_numbers_below_their_error_bound() -> None:
    assert (number(1e-10, 1.0), number(-1e-10, 1.0), number(2e-9, 1.0)) == ("0", "0", "2e-09")
    assert number(-1e-10, 1.0).value == 0
    # A small robot in a large unit keeps its digits.
    assert number(1.5e-11, 1e-10, digits=3) == "1.5e-11"
    assert listed([1e-17, -2.5, 0.0]) == "0  -2.5  0"
    assert (number(3.0, signed=True), number(-0.0, signed=True)) == ("+3", "0")


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_motions_have_no_noise_in_any_unit(scale: float) -> None:
    case = case_of("eight")
    axis, point = np.array([0.0, 1.0, 0.0]), scale * np.array([0.25, 0.0, 0.5])
    noise = scale * 1e-13 * np.array([1.0, -1.0, 1.0])
    twist = np.concatenate([axis, np.cross(point, axis) + noise])
    assert motion_words(motion_of(twist), case.units).startswith("rotation about (0, 1, 0) through (")
    assert f"({0.25 * scale:.4g}, 0, {0.5 * scale:.4g})" in motion_words(motion_of(twist), case.units)


def test_rates_angles_and_lengths_by_pose_and_leg_with_the_worst_pose_marked() -> None:
    case = case_of("eight")
    result = evaluated(case)
    several = result.robot.several
    tables = {i.name: i for i in evaluation_summary(case, result) if isinstance(i, TextTable)}
    # An angle along the task has its sign.
    angles = [float(str(row[6])) for row in tables["poses"].rows]
    assert angles == pytest.approx(np.linspace(-20, 20, 8), abs=1e-4)
    forces = [np.array(pose.jacobian) for pose in several.poses]
    twist = np.asarray(case.tasks[0].twist)
    rates = [J[:, :3] @ twist[3:] + J[:, 3:] @ twist[:3] for J in forces]
    assert tables["rates"].headers[1:7] == tuple(f"{name}\nmm/rad" for name in LIMB_NAMES)
    for row, expected, pose in zip(tables["rates"].rows, rates, several.poses, strict=True):
        assert [float(str(cell)) for cell in row[1:7]] == pytest.approx(expected, rel=1e-5)
        lengths = [float(str(cell)) for cell in tables["leg-lengths"].rows[int(str(row[0])) - 1][1:]]
        assert lengths == pytest.approx(list(pose.quantities["leg_length"].values()), 1e-4)
    worst = int(np.argmin([float(each @ each) for each in rates]))
    marks = ["worst" if k == worst else "" for k in range(8)]
    assert [row[2] for row in tables["poses"].rows] == [row[7] for row in tables["rates"].rows] == marks
    assert "platform-joint-angles" in tables


def test_the_table_shows_the_angles_that_the_limits_speak_of() -> None:
    """An independent reckoning: the angle of each leg to its own direction at home."""
    case = load_case("hexapod-machining", {"p_x": 2, "p_y": -1, "p_z": 21})
    result = evaluated(case)
    limbs = table_of(case, "limbs")
    assert_words(limbs.headers, "base joint angle\nfrom home, deg", "platform joint angle\nfrom home, deg")
    robot, home = result.robot, np.array([0.0, 0.0, 20.0])
    J = np.array(robot.jacobian)
    position = np.array(robot.pose.position)
    column = limbs.headers.index("base joint angle\nfrom home, deg")
    for k, name in enumerate(robot.limbs):
        # The platform does not turn, so that every leg moves by the platform's own displacement.
        span = J[k, :3] * robot.quantities["leg_length"][name]
        there = span - (position - home)
        angle = math.degrees(math.acos(span @ there / np.linalg.norm(span) / np.linalg.norm(there)))
        assert float(str(limbs.rows[k][column])) == pytest.approx(angle, rel=1e-4)
    largest = next(row.value for row in result.limits if row.key == "base_joint_angle.max")
    assert max(float(str(row[column])) for row in limbs.rows) == pytest.approx(largest, rel=1e-4)
    # Without such limits they are from the normal.
    case = load_case("paper-4.1-helical")
    limbs = table_of(case, "limbs")
    assert "base joint angle\ndeg" in limbs.headers
    assert evaluated(case).robot.limited_quantities is None


def test_free_and_active_numbers_come_first_and_fixed_ones_are_folded() -> None:
    design = next(item for item in solved("eight") if isinstance(item, TextTable) and item.name == "design")
    ranges = [bool(row[3]) for row in design.rows]
    assert ranges == sorted(ranges, reverse=True)
    held = [str(row[4]).startswith(("min", "max")) for row in design.rows]
    assert held == sorted(held, reverse=True)
    assert sum(ranges) == 3
    assert len(design.rows) - design.folded <= 10
    assert f"and {design.folded} more fixed values" in printed([design], 80, whole=False)


def test_a_table_as_csv_has_every_digit(tmp_path: Path, cli: Run) -> None:
    name, target = str(saved(tmp_path / "eight.toml", EIGHT)), tmp_path / "table.csv"
    assert cli("evaluate", name, "--csv", str(target), "--table", "rates")[0] == 0
    rows = [
        [float(row[f"{limb}, mm/rad"]) for limb in LIMB_NAMES] for row in rows_of(target.read_text(encoding="utf-8"))
    ]
    assert rows == [list(pose.rates) for pose in evaluated(case_of("eight")).robot.several.poses]
    out = output_of(cli("evaluate", name, "--csv", "-"))
    assert re.findall(r"^[a-z-]+$", out, re.MULTILINE) == [
        "design", "poses", "rates", "leg-lengths", "base-joint-angles", "platform-joint-angles", "limits", "jacobian",
        "motions", "margins",
    ]  # fmt: skip
    assert cli("solve", "paper-4.2", "--starts", "2", "--csv", str(target), "--table", "tasks")[0] == 0
    assert target.read_text(encoding="utf-8").startswith("task,sense,weight,F,separate optimum,loss,")


@pytest.mark.parametrize(
    ("command", "outputs"), [("solve", "--json -, --csv - and --schedule -"), ("evaluate", "--json - and --csv -")]
)
def test_csv_that_cannot_be_is_refused_first(
    command: str, outputs: str, tmp_path: Path, cli: Run, monkeypatch: Patch
) -> None:
    monkeypatch.chdir(tmp_path)
    for options, words in (
        ("--table limbs", "--table limbs: needs --csv FILE"),
        ("--csv x.csv --table legs", "--table legs: must be one of design, limbs"),
        ("--csv - --json -", f"one of {outputs} can go to standard output"),
        ("--csv nowhere/x.csv", "nowhere/x.csv: cannot be written"),
    ):
        refusal_of(cli(command, "paper-4.1-helical", *options.split()), words)
    assert not list(tmp_path.iterdir())


def test_a_margin_of_an_infeasible_answer_is_violated() -> None:
    case = replace(load_case("paper-4.1-helical"), limits=Limits(LegLength(max=15.0)))
    result = result_of(solve(case, starts=2))
    assert isinstance(result, SolveResult)
    assert result.F is None
    (limit,) = (row for row in result.limits if row.key == "leg_length.max")
    assert limit.margin < 0
    assert [row[5] for row in limit_table(result.limits).rows] == ["violated"]
    violated = [row for row in margin_table(result.margins).rows if row[-1] == "violated"]
    assert violated
    assert len(violated) == sum(row.margin is not None and row.margin < -1e-6 for row in result.margins)


def test_the_stated_point_of_a_task_is_echoed_beside_the_nearest_one() -> None:
    case = load_case("paper-4.1-helical")
    task = evaluated(case).tasks[0].task
    assert task.stated_point == (2, 3, 6)
    words = task_words(task, case.units)
    assert words.endswith("through (2, 3, 6), nearest to the origin at (-1.556, -0.5556, 4.222)")
    same = load_case("paper-4.4-max")
    assert task_words(evaluated(same).tasks[0].task, same.units).endswith("through (0, 0, 100)")
    stated = Task.screw("max", axis=[0, 0, 1], point=[1, 2, 3], pitch=0)
    assert list(np.asarray(stated.point)) == [1, 2, 3]
    assert Task.screw("max", axis=[0, 0, 1], point=[1, 2, 3], pitch=math.inf).point is None


def test_a_singular_answer_that_nobody_asked_for_is_no_green_bar() -> None:
    case = replace(load_case("paper-4.2-translation"), title="")
    solution = solve(case, starts=2)
    result = result_of(solution)
    assert isinstance(result, SolveResult)
    assert result.robot.singular
    unasked = replace(case, expect=replace(case.expect, singular=False))
    asked = replace(case, expect=replace(case.expect, singular=True))
    assert (headline(result, unasked).tone, headline(result, asked).tone) == (Tone.CAUTION, Tone.ANSWER)
    report = report_of("", solution, result)
    assert 'class="answer singular"' in page_of(replace(report, case=unasked))
    assert 'class="answer"' in page_of(replace(report, case=asked))


def test_a_certificate_that_proves_only_the_obvious_says_so() -> None:
    rotation = Rotation(axis=None, angle=Free(-0.5, 0.5))
    case = replace(load_case("paper-4.1-helical"), rotation=rotation)
    nlp = replace(formulate(case), sense=type(case.tasks[0].sense)("min"))
    early = certify_program(nlp, nlp.start, time_limit=1e-6)
    assert early.status is CertificateStatus.INCOMPLETE
    assert early.incumbent > 0
    assert early.statement.startswith("nothing is proved: stopped after")
    early = replace(early, bound=0.0)
    assert early.statement.startswith("only the trivial bound is proved (")
    assert "F is at least 0" in early.statement
    useful = replace(early, bound=0.5 * early.incumbent)
    assert useful.statement.startswith("incomplete")
    below = replace(early, above=-1.0, status=CertificateStatus.PROVED)
    assert "is trivial: F is at least 0" in below.statement
    assert "1 boxes" not in "".join(line.words for line in certificate_lines(certificate_data(replace(early, boxes=1))))
    fixed = certify_program(formulate(load_case("paper-4.4-snu")))
    assert 0 < fixed.bound < 1e-20
    assert "has F smaller than 0; the best known point has 0" in fixed.statement
    # Where F reaches 0, the bound 0 is all there is to prove.
    reached = replace(early, status=CertificateStatus.PROVED, incumbent=0.0, bound=0.0)
    assert reached.statement.startswith("proved: no point of the box")

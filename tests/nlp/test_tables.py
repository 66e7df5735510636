"""Tables on terminals of every width, rounding noise, several poses, CSV, and the sentences beside the tables."""

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import EACH_CASE, FEW_CASES, Run, case_from, output_of, refusal_of, soaked
from rich.console import Console

from screwsynth.models import model_names
from screwsynth.nlp import Case, Free, Limits, Rotation, Task, build_model, load_case, shipped_cases, solve
from screwsynth.nlp.case.limits.legs import LegLength
from screwsynth.nlp.case.robots import model_options
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.webpage import page_of
from screwsynth.nlp.output.terminal import show
from screwsynth.nlp.program.epigraph import with_exact_level
from screwsynth.nlp.program.formulation import formulate, formulate_each
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.results.data import SolveResult
from screwsynth.nlp.results.evaluation import EvaluationResult, evaluation_of
from screwsynth.nlp.results.evidence import certificate_data
from screwsynth.nlp.results.point import motion_data
from screwsynth.nlp.results.result import result_of
from screwsynth.nlp.results.robotwording import model_words
from screwsynth.nlp.results.rounding import listed, number
from screwsynth.nlp.results.summary import case_summary, evaluation_summary
from screwsynth.nlp.results.tables import limit_table, margin_table, optimum_table
from screwsynth.nlp.results.text import Line, TextTable, Tone
from screwsynth.nlp.results.wording import certificate_lines, headline, motion_words, task_words

WIDTHS = (60, 80, 100, 120)
LIMB_NAMES = ("1", "2", "3", "4", "5", "6")

EIGHT = """
title = "Motion base with eight poses"
[units]
length = "mm"
[robot]
model = "hexapod"
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
[[task]]
name = "roll"
sense = "max"
axis = [1, 0, 0]
point = [12, 0, 700]
pitch = 30
[limits]
leg_length = { min = 500, max = 950 }
base_joint_angle = { max = 45, about = "home" }
platform_joint_angle = 60
home = { position = [0, 0, 650] }
leg_clearance = { min = 30 }
"""


def eight() -> Case:
    return case_from(EIGHT, "eight")


def evaluated(case: Case) -> EvaluationResult:
    nlps = formulate_each(case)
    x = with_exact_level(nlps[0], close_equations(nlps[0], nlps[0].start))
    return evaluation_of(nlps, x, [evaluate(nlp, x) for nlp in nlps])


def table_of(case: Case, name: str) -> TextTable:
    """A table of the evaluation of a case."""
    return next(i for i in evaluation_summary(case, evaluated(case)) if isinstance(i, TextTable) and i.name == name)


def case_of(name: str) -> Case:
    return eight() if name == "eight" else load_case(name)


@cache
def solved(name: str) -> tuple[Line | TextTable, ...]:
    case = case_of(name)
    return tuple(case_summary(case, result_of(solve(case, starts=2))))


def shortly(items: Iterable[Line | TextTable], width: int) -> str:
    text = io.StringIO()
    show(Console(file=text, width=width, highlight=False, markup=False, emoji=False), items, whole=False)
    return text.getvalue()


def printed(items: Iterable[Line | TextTable], width: int) -> str:
    text = io.StringIO()
    show(Console(file=text, width=width, highlight=False, markup=False, emoji=False), items)
    return text.getvalue()


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


def test_no_word_about_a_robot_is_split_at_any_width() -> None:
    for name in model_names():
        check_widths(tuple(model_words(name, build_model(name), model_options(name))))


def test_a_narrow_table_goes_on_below_with_the_names_of_its_rows() -> None:
    numbers = [f"{k}.123456" for k in range(9)]
    table = TextTable(("leg", *(f"column {k}\nmm" for k in range(9))), (("1-", *numbers), ("1+", *numbers)))
    lines = printed([table], 60).splitlines()
    assert all(len(line) <= 60 for line in lines)
    assert sum(line.startswith("1- ") for line in lines) == 2
    assert all(len(re.findall(re.escape(each), "\n".join(lines))) == 2 for each in numbers)
    assert printed([TextTable(("", ""), (("x", "y" * 90),))], 60).count("y") == 90


def test_no_rounding_noise_on_a_page() -> None:
    case = load_case("paper-4.4-min")
    solution = solve(case, starts=2)
    page = page_of(report_of("", solution, result_of(solution)))
    assert re.search(r"\de-[23]\d", page), "the JSON has the noise as it is"
    words = re.sub(r"<script.*?</script>|<p><span class=.label.>evidence:.*?</p>", "", page, flags=re.DOTALL)
    assert not re.findall(r".{40}\de-[1-3]\d", words)


@pytest.mark.parametrize("name", [*shipped_cases()])
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
    case = eight()
    axis, point = np.array([0.0, 1.0, 0.0]), scale * np.array([0.25, 0.0, 0.5])
    noise = scale * 1e-13 * np.array([1.0, -1.0, 1.0])
    twist = np.concatenate([axis, np.cross(point, axis) + noise])
    assert motion_words(motion_data(twist), case.units).startswith("rotation about (0, 1, 0) through (")
    assert f"({0.25 * scale:.4g}, 0, {0.5 * scale:.4g})" in motion_words(motion_data(twist), case.units)


def test_the_sign_of_an_angle_along_a_task_is_shown() -> None:
    case = eight()
    angles = [float(str(row[6])) for row in table_of(case, "poses").rows]
    assert angles == pytest.approx(np.linspace(-20, 20, 8), abs=1e-4)


def test_rates_angles_and_lengths_by_pose_and_leg_with_the_worst_pose_marked() -> None:
    case = eight()
    result = evaluated(case)
    several = result.robot.several
    tables = {i.name: i for i in evaluation_summary(case, result) if isinstance(i, TextTable)}
    forces = [np.array(pose.jacobian) for pose in several.poses]
    twist = np.asarray(case.tasks[0].twist)
    rates = [J[:, :3] @ twist[3:] + J[:, 3:] @ twist[:3] for J in forces]
    assert tables["rates"].headers[1:7] == tuple(f"{name}\nmm/rad" for name in LIMB_NAMES)
    for row, expected, pose in zip(tables["rates"].rows, rates, several.poses, strict=True):
        assert [float(str(cell)) for cell in row[1:7]] == pytest.approx(expected, rel=1e-5)
        lengths = tables["leg-lengths"].rows[int(str(row[0])) - 1][1:]
        assert [float(str(cell)) for cell in lengths] == pytest.approx(
            list(pose.quantities["leg_length"].values()), 1e-4
        )
    worst = int(np.argmin([float(each @ each) for each in rates]))
    assert [row[2] for row in tables["poses"].rows] == ["worst" if k == worst else "" for k in range(8)]
    assert [row[7] for row in tables["rates"].rows] == ["worst" if k == worst else "" for k in range(8)]
    assert "platform-joint-angles" in tables


def test_the_table_shows_the_angles_that_the_limits_speak_of() -> None:
    """An independent reckoning: the angle of each leg to its own direction at home."""
    case = load_case("hexapod-machining", {"p_x": 2, "p_y": -1, "p_z": 21})
    result = evaluated(case)
    limbs = table_of(case, "limbs")
    assert "base joint angle\nfrom home, deg" in limbs.headers
    assert "platform joint angle\nfrom home, deg" in limbs.headers
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


def test_without_such_limits_angles_are_from_the_normal() -> None:
    case = load_case("paper-4.1-helical")
    limbs = table_of(case, "limbs")
    assert "base joint angle\ndeg" in limbs.headers
    assert evaluated(case).robot.limited_quantities is None


def test_free_and_active_numbers_come_first_and_fixed_ones_are_folded() -> None:
    case, items = eight(), solved("eight")
    design = next(item for item in items if isinstance(item, TextTable) and item.name == "design")
    ranges = [bool(row[3]) for row in design.rows]
    assert ranges == sorted(ranges, reverse=True)
    held = [str(row[4]).startswith(("min", "max")) for row in design.rows]
    assert held == sorted(held, reverse=True)
    assert sum(ranges) == 3
    assert len(design.rows) - design.folded <= 10
    assert f"and {design.folded} more fixed numbers" in shortly([design], 80)
    assert case.title


def test_a_table_as_csv_has_every_digit(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "eight.toml").write_text(EIGHT, encoding="utf-8")
    name, target = str(tmp_path / "eight.toml"), tmp_path / "table.csv"
    assert cli("evaluate", name, "--csv", str(target), "--table", "rates")[0] == 0
    rows = list(csv.DictReader(io.StringIO(target.read_text(encoding="utf-8"))))
    several = evaluated(eight()).robot.several
    assert [[float(row[f"{limb}, mm/rad"]) for limb in LIMB_NAMES] for row in rows] == [
        list(pose.rates) for pose in several.poses
    ]
    out = output_of(cli("evaluate", name, "--csv", "-"))
    assert re.findall(r"^[a-z-]+$", out, re.MULTILINE) == [
        "design", "poses", "rates", "leg-lengths", "base-joint-angles", "platform-joint-angles", "limits", "jacobian",
        "motions", "margins",
    ]  # fmt: skip
    assert cli("solve", "paper-4.2", "--starts", "2", "--csv", str(target), "--table", "tasks")[0] == 0
    assert target.read_text(encoding="utf-8").startswith("task,sense,weight,F,best alone,loss,")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--table", "limbs"), "--table limbs: needs --csv FILE"),
        (("--csv", "x.csv", "--table", "legs"), "--table legs: must be one of design, limbs"),
        (("--csv", "-", "--json", "-"), "one of --json - and --csv -"),
        (("--csv", "nowhere/x.csv"), "nowhere/x.csv: cannot be written"),
    ],
)
@pytest.mark.parametrize("command", ["solve", "evaluate"])
def test_csv_that_cannot_be_is_refused_before_the_work(
    command: str, options: tuple[str, ...], words: str, tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refusal_of(cli(command, "paper-4.1-helical", *options), words)
    assert not list(tmp_path.iterdir())


def test_a_margin_of_an_infeasible_answer_is_violated() -> None:
    case = replace(load_case("paper-4.1-helical"), limits=Limits(LegLength(max=15.0)))
    result = result_of(solve(case, starts=2))
    assert isinstance(result, SolveResult)
    assert result.F is None
    (limit,) = (row for row in result.limits if row.key == "leg_length.max")
    assert limit.margin is not None
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


def test_one_start_is_no_starts() -> None:
    case = load_case("paper-4.1-helical")
    solution = solve(case, starts=1)
    table = optimum_table(solution.outcomes[0].own)
    assert [str(row[0]).partition(", ")[2] for row in table.rows] == ["1 start"]
    page = page_of(report_of("", solution, result_of(solution)))
    assert not re.search(r"\b1 (starts|starting points|times|optima)\b", page)


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
    assert early.statement.startswith("nothing useful is proved yet (")
    assert "F is at least 0" in early.statement
    useful = replace(early, bound=0.5 * early.incumbent)
    assert useful.statement.startswith("incomplete")
    below = replace(early, above=-1.0, status=CertificateStatus.PROVED)
    assert "says nothing useful: F is at least 0" in below.statement
    assert "1 boxes" not in "".join(line.words for line in certificate_lines(certificate_data(replace(early, boxes=1))))
    fixed = certify_program(formulate(load_case("paper-4.4-snu")))
    assert 0 < fixed.bound < 1e-20
    assert "has F smaller than 0; the best point known has 0" in fixed.statement
    # Where F reaches 0, the bound 0 is all there is to prove.
    reached = replace(early, status=CertificateStatus.PROVED, incumbent=0.0, bound=0.0)
    assert reached.statement.startswith("proved: no point of the box")

"""Claims about a workspace, one a statement: verdicts, counts, what is shown beside them, and the largest box."""

import json
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from builders import Run, case_from, edited, saved, unbroken
from hexapods import SMALL
from workspace_cases import gallery_case

from screwsynth.nlp import Case, Free, Rotation
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.proof.workspace import judge
from screwsynth.nlp.proof.workspace.judge import Judgement, judge_workspace
from screwsynth.nlp.proof.workspace.numbers.extremes import Extreme, prove_extreme
from screwsynth.nlp.proof.workspace.robot.pose_box import scaled
from screwsynth.nlp.proof.workspace.scale import ACCURACY, largest_scale
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.results.workspace import WorkspaceResult, workspace_of
from screwsynth.nlp.results.workspaceposes import refuted_claims, seeing_lines
from screwsynth.nlp.results.workspacewording import verdict_words

Value = TypeVar("Value")


def squares_at(case: Case, position: list[float], rotation: Rotation) -> float:
    """F at one pose, its loops closed from home by Newton's method."""
    nlp = formulate(replace(case, position=position, rotation=rotation, workspace=None))
    return nlp.evaluate(closed_start(nlp)).F


def judged(text: str, time_limit: float = 20.0, **options: Any) -> Judgement:  # noqa: ANN401
    return judge_workspace(case_from(SMALL + text), time_limit=time_limit, jobs=1, **options)


@pytest.mark.parametrize("name", ["tripteron", "3-puu", "orthoglide", "3-upu", "planar-3-rrr"])
def test_the_objective_over_a_small_box_about_home_is_bounded(name: str) -> None:
    """Every robot's loops have assemblies in which F has no bound: what is meant is that of home."""
    case = gallery_case(name)
    found = judge_workspace(case, jobs=1)
    assert found.is_proved
    low, high = (each for each in found.extremes if each.name == "F")
    assert (low.outcome, high.outcome) == (Outcome.PROVED, Outcome.PROVED)
    assert high.boxes < 5000
    rng, is_planar = np.random.default_rng(3), name.startswith("planar")
    for k in range(4):
        place = [rng.uniform(each.lower, each.upper) for each in case.workspace.position if isinstance(each, Free)]
        if is_planar:
            place[2] = case.model.home[2]
        turn = rng.uniform(-math.radians(5), math.radians(5)) if is_planar and k % 2 else 0.0
        assert low.bound <= squares_at(case, place, Rotation((0, 0, 1), turn)) <= high.bound
    for each in (low, high):
        axis = [float(part) for part in each.pose.axis]
        at = squares_at(case, [float(part) for part in each.pose.position], Rotation(axis, float(each.pose.angle)))
        assert at == pytest.approx(each.reached, rel=1e-9)
        assert abs(each.bound - each.reached) <= 1.001e-3 * abs(each.reached)


def opened(*args: Any, **options: Any) -> Extreme:  # noqa: ANN401
    """A search that leaves what has no limit open."""
    found = prove_extreme(*args, **options)
    return found if found.limit is not None else replace(found, outcome=Outcome.OPEN, reason="for a test")


def test_numbers_that_are_only_shown_decide_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "prove_extreme", opened)
    found = judged("leg_length = { min = 15, max = 60 }")
    assert {each.name for each in found.extremes if each.outcome is Outcome.OPEN} == {"F"}
    assert found.is_proved
    assert verdict_words(workspace_of(found)) == (
        "everything is proved for every pose; 2 numbers without a limit stay open"
    )
    half = judged("leg_length = { min = 15 }")
    assert verdict_words(workspace_of(half)).endswith("; 8 numbers without a limit stay open")
    assert half.is_proved


def test_a_number_that_is_only_shown_does_not_end_the_search_for_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trap: lengths without a limit come before the limits on strokes, which would then never be judged."""
    monkeypatch.setattr(judge, "prove_extreme", opened)
    found = judged("actuator = { stroke_max = 0.01 }", until_fault=True, with_objective=False)
    assert found.is_refuted
    assert not found.is_proved


def test_the_exit_status_is_that_of_ranks_and_limits(cli: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(judge, "prove_extreme", opened)
    for text, status in (("leg_length = { min = 15, max = 60 }", 0), ("leg_length = { min = 15, max = 20 }", 1)):
        code, out, _ = cli("workspace", str(saved(tmp_path / "case.toml", SMALL + text)))
        assert (code, "not everything is proved" in out) == (status, bool(status))


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        ("actuator = { dead_length = 1, stroke_max = 10 }", ()),
        (
            "base_joint_angle = { max = 80, about = 'home' }\nhome = { position = [0, 0, 20] }",
            ("base_joint_angle",) * 2,
        ),
        ("leg_length = { max = 60 }", ("leg_length", "smallest_singular_value", "smallest_singular_value")),
        ("condition_number = { max = 1000, length = 1 }", ("condition_number",)),
    ],
    ids=["a dead length", "a measure with a limit", "lengths", "another length"],
)
def test_each_statement_is_claimed_once(text: str, asked: tuple[str, ...]) -> None:
    found = judged(text, time_limit=0.2, quantities=asked)
    names = Counter((each.name, each.sense) for each in found.extremes)
    assert set(names.values()) == {1}
    for name in asked:
        assert any(each.name.startswith(name) for each in found.extremes)


def test_a_measure_with_its_own_limit_is_not_judged_again() -> None:
    length = judged("leg_length = { max = 60 }", with_limits=False).case.characteristic_length
    text, name = f"smallest_singular_value = {{ min = 0.1, length = {length!r} }}", "smallest_singular_value"
    found = judged(text, time_limit=0.2, quantities=[name])
    assert [each.name for each in found.extremes if "singular" in each.name] == [name]


def changed(value: Value, **parts: object) -> Value:
    """A part of a result with other fields."""
    return type(value)(**{**vars(value), **parts})


def counted(result: WorkspaceResult) -> tuple[int, int]:
    """Refuted claims of the verdict's words, and those of the list of commands."""
    lines = list(seeing_lines(result, lambda _: "command"))
    shown = {
        each.words.partition(":")[0] + each.words.partition("limit ")[2].partition(";")[0]
        for each in lines
        if each.label == "refuted"
    }
    others = sum(int(each.words.partition(":")[0]) for each in lines if each.label == "other refuted claims")
    counts = re.search(r"(\d+) refuted", verdict_words(result))
    return int(counts[1]), len(shown) + others


def test_refuted_claims_are_counted_by_statement() -> None:
    """A number may be beyond both of its limits, and a limit on a stroke names two poses."""
    text = "leg_length = { max = 20 }\nactuator = { stroke_max = 0.01, dead_length = 25 }"
    result = workspace_of(judged(text))
    refuted = sum(each.outcome is Outcome.REFUTED for each in result.extremes)
    assert refuted == 12
    assert counted(result) == (refuted, refuted)
    other = [changed(each, key="leg_length.min") for each in result.extremes if each.key == "leg_length.max"]
    both = changed(result, extremes=(*other, *result.extremes))
    assert len({each.name for each in refuted_claims(both)}) < refuted + 6
    assert counted(both) == (refuted + 6, refuted + 6)


def test_the_rank_of_constraints_is_counted() -> None:
    result = workspace_of(judge_workspace(gallery_case("tripteron"), with_limits=False))
    assert result.constraints is not None
    refuted = changed(result.constraints, outcome=Outcome.REFUTED)
    lost = changed(result, proved=False, constraints=refuted)
    assert verdict_words(lost) == "not everything is proved: 1 refuted, 0 open, 1 proved"


def test_actuators_keep_the_limit_on_their_rates() -> None:
    """Trap: it begins with the word of the limit on strokes, whose claims at one pose are left out."""
    found = judged("actuator = { dead_length = 1 }\nactuator_rate = { max = 60 }", time_limit=0.2)
    assert sum(each.key == "actuator_rate.max" for each in found.extremes) >= 1
    assert sum(each.key == "actuator.dead_length" for each in found.extremes) == 6


def test_a_measure_gives_way_to_its_limit_for_every_machine_too() -> None:
    text = "base_joint_angle = { max = 80, about = 'home' }\nhome = { position = [0, 0, 20] }\n"
    found = judged(f"{text}[tolerance]\njoint_centre = 0.01", time_limit=0.2, quantities=["base_joint_angle"])
    names = Counter((each.name, each.sense) for each in found.extremes)
    assert set(names.values()) == {1}
    assert sum(each.key == "base_joint_angle.max" for each in found.extremes) == 6


#: Six servos with horns and rods, which do not reach the corners of the box.
HORNS = """
[units]
length = "mm"
angle = "deg"
[robot]
model = "6-rss"
parameters = { rb = 76, rp = 62, base_half = 12, platform_half = 30, horn = 16, rod = 130 }
[pose]
position = [0, 0, 127]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
actuator_angle = { min = -75, max = 75 }
[workspace]
position = [{ min = -15, max = 15 }, { min = -15, max = 15 }, { min = 112, max = 142 }]
rotation = { roll = { min = -12, max = 12 }, pitch = { min = -12, max = 12 }, yaw = { min = -12, max = 12 } }
"""
#: At no pose.
IMPOSSIBLE = ("actuator_angle = { min = -75, max = 75 }", "actuator_angle = { min = 60, max = 75 }")


def test_a_box_that_stays_open_leaves_time_for_smaller_ones() -> None:
    case = case_from(HORNS)
    found = largest_scale(case, time_limit=4)
    assert found.factor is not None
    assert found.factor > 0.15
    assert found.factor < found.failed <= 1
    smaller = scaled(case.workspace, found.factor)
    assert judge_workspace(case, workspace=smaller, with_objective=False).is_proved
    assert found.reason or found.failed - found.factor <= ACCURACY * found.failed


def test_verdicts_on_the_workspace_are_not_searched_again() -> None:
    whole = case_from(HORNS)
    case = replace(whole, workspace=scaled(whole.workspace, 0.1))
    judged = judge_workspace(case, with_objective=False)
    assert judged.is_proved
    found = largest_scale(case, time_limit=0, judged=judged)
    assert (found.factor, found.failed, found.reason) == (1.0, math.inf, "the time is over")


def test_no_time_and_no_box_are_no_number(tmp_path: Path, cli: Run) -> None:
    case = case_from(HORNS)
    late = largest_scale(case, time_limit=0)
    assert (late.factor, late.failed, late.claim, late.reason) == (None, math.inf, "", "the time is over")
    nowhere = largest_scale(case_from(edited(HORNS, IMPOSSIBLE)))
    assert nowhere.factor is None
    assert nowhere.refuted
    assert not nowhere.reason
    path, target, page = tmp_path / "c.toml", tmp_path / "r.json", tmp_path / "p.html"
    for text, time, words, reason in (
        (HORNS, "1e-6", "largest proved box: none found within the time", "the time is over"),
        (edited(HORNS, IMPOSSIBLE), "0.4", "not even the smallest", None),
    ):
        pages = ("--html", str(page)) if reason else ()
        found = cli("workspace", str(saved(path, text)), "--scale", "--time", time, "--json", str(target), *pages)
        status, out, err = found
        assert (status, err) == (1, "")
        assert words in unbroken(out)
        assert "0 times" not in unbroken(out)
        scale = json.loads(target.read_text(encoding="utf-8"))["scale"]
        assert scale["factor"] is None
        assert scale.get("reason") == reason
    assert "none found within the time" in unbroken(page.read_text(encoding="utf-8"))

"""Claims about a workspace, one a statement: what the verdict rests on, what is shown beside it, and their counts."""

import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from hexapods import SMALL

from screwsynth.nlp import Case, Free, Rotation, Task
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.proof.workspace import judge
from screwsynth.nlp.proof.workspace.judge import Judgement, judge_workspace
from screwsynth.nlp.proof.workspace.numbers.extremes import Extreme, prove_extreme
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.results.workspace import WorkspaceResult, workspace_of
from screwsynth.nlp.results.workspaceposes import refuted_claims, seeing_lines
from screwsynth.nlp.results.workspacewording import verdict_words

Value = TypeVar("Value")
Run = Callable[..., tuple[int, str, str]]


def at_home(name: str, part: float = 0.02, degrees: float = 5.0) -> Case:
    """A robot of the gallery over a small box about home, as in ``bench/workspace_robots.py``."""
    model = build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    size, angle = max(abs(each) for each in (*model.home, *values.values())), math.radians(degrees)
    place = [Free(each - part * size, each + part * size) for each in model.home]
    workspace = Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3))
    return Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])], workspace=workspace)


def squares_at(case: Case, position: list[float], rotation: Rotation) -> float:
    """F at one pose, its loops closed from home by Newton's method."""
    nlp = formulate(replace(case, position=position, rotation=rotation, workspace=None))
    return nlp.evaluate(closed_start(nlp)).F


def judged(text: str, folder: Path, time_limit: float = 20.0, **options: Any) -> Judgement:  # noqa: ANN401
    path = folder / "case.toml"
    path.write_text(SMALL + text, encoding="utf-8")
    return judge_workspace(read_case(str(path), {}).case, time_limit=time_limit, jobs=1, **options)


@pytest.mark.parametrize("name", ["tripteron", "3-puu", "orthoglide", "3-upu", "planar-3-rrr"])
def test_the_objective_over_a_small_box_about_home_is_bounded(name: str) -> None:
    """Every robot's loops have assemblies in which F has no bound: what is meant is that of home."""
    case = at_home(name)
    found = judge_workspace(case, jobs=1)
    assert found.is_proved
    low, high = (each for each in found.extremes if each.name == "F")
    assert (low.outcome, high.outcome) == (Outcome.PROVED, Outcome.PROVED)
    assert high.boxes < 5000
    assert case.workspace is not None
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


def test_numbers_that_are_only_shown_decide_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "prove_extreme", opened)
    found = judged("leg_length = { min = 15, max = 60 }", tmp_path)
    assert {each.name for each in found.extremes if each.outcome is Outcome.OPEN} == {"F"}
    assert found.is_proved
    assert verdict_words(workspace_of(found)) == (
        "everything is proved for every pose; 2 numbers without a limit stay open"
    )
    half = judged("leg_length = { min = 15 }", tmp_path)
    assert verdict_words(workspace_of(half)).endswith("; 8 numbers without a limit stay open")
    assert half.is_proved


def test_a_number_that_is_only_shown_does_not_end_the_search_for_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Trap: lengths without a limit come before the limits on strokes, which would then never be judged."""
    monkeypatch.setattr(judge, "prove_extreme", opened)
    found = judged("actuator = { stroke_max = 0.01 }", tmp_path, until_fault=True, with_objective=False)
    assert found.is_refuted
    assert not found.is_proved


def test_the_exit_status_is_that_of_ranks_and_limits(cli: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(judge, "prove_extreme", opened)
    path = tmp_path / "case.toml"
    for text, status in (("leg_length = { min = 15, max = 60 }", 0), ("leg_length = { min = 15, max = 20 }", 1)):
        path.write_text(SMALL + text, encoding="utf-8")
        code, out, _ = cli("workspace", str(path))
        assert code == status
        assert ("not everything is proved" in out) == bool(status)


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
def test_each_statement_is_claimed_once(text: str, asked: tuple[str, ...], tmp_path: Path) -> None:
    found = judged(text, tmp_path, time_limit=0.2, quantities=asked)
    names = Counter((each.name, each.sense) for each in found.extremes)
    assert set(names.values()) == {1}
    for name in asked:
        assert any(each.name.startswith(name) for each in found.extremes)


def test_a_measure_with_its_own_limit_is_not_judged_again(tmp_path: Path) -> None:
    length = judged("leg_length = { max = 60 }", tmp_path, with_limits=False).case.characteristic_length
    text, name = f"smallest_singular_value = {{ min = 0.1, length = {length!r} }}", "smallest_singular_value"
    found = judged(text, tmp_path, time_limit=0.2, quantities=[name])
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


def test_refuted_claims_are_counted_by_statement(tmp_path: Path) -> None:
    """A number may be beyond both of its limits, and a limit on a stroke names two poses."""
    text = "leg_length = { max = 20 }\nactuator = { stroke_max = 0.01, dead_length = 25 }"
    result = workspace_of(judged(text, tmp_path))
    refuted = sum(each.outcome is Outcome.REFUTED for each in result.extremes)
    assert refuted == 12
    assert counted(result) == (refuted, refuted)
    other = [changed(each, key="leg_length.min") for each in result.extremes if each.key == "leg_length.max"]
    both = changed(result, extremes=(*other, *result.extremes))
    assert len({each.name for each in refuted_claims(both)}) < refuted + 6
    assert counted(both) == (refuted + 6, refuted + 6)


def test_the_rank_of_constraints_is_counted() -> None:
    result = workspace_of(judge_workspace(at_home("tripteron"), with_limits=False))
    assert result.constraints is not None
    refuted = changed(result.constraints, outcome=Outcome.REFUTED)
    lost = changed(result, proved=False, constraints=refuted)
    assert verdict_words(lost) == "not everything is proved: 1 refuted, 0 open, 1 proved"


def test_actuators_keep_the_limit_on_their_rates(tmp_path: Path) -> None:
    """Trap: it begins with the word of the limit on strokes, whose claims at one pose are left out."""
    found = judged("actuator = { dead_length = 1 }\nactuator_rate = { max = 60 }", tmp_path, time_limit=0.2)
    assert sum(each.key == "actuator_rate.max" for each in found.extremes) >= 1
    assert sum(each.key == "actuator.dead_length" for each in found.extremes) == 6


def test_a_measure_gives_way_to_its_limit_for_every_machine_too(tmp_path: Path) -> None:
    text = "base_joint_angle = { max = 80, about = 'home' }\nhome = { position = [0, 0, 20] }\n"
    found = judged(f"{text}[tolerance]\njoint_centre = 0.01", tmp_path, time_limit=0.2, quantities=["base_joint_angle"])
    names = Counter((each.name, each.sense) for each in found.extremes)
    assert set(names.values()) == {1}
    assert sum(each.key == "base_joint_angle.max" for each in found.extremes) == 6

"""Claims about a workspace, one a statement, the largest box, and what a user sees: slices, pages, poses, commands."""

import itertools
import json
import math
import re
import shlex
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from builders import Run, case_from, commands_in, edited, ends, output_of, ran, refusal_of, saved, soaked, unbroken
from hexapods import SMALL, hexapod_text
from measures import circle_joints
from workspace_cases import gallery_case

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, LegClearance, Limits, Outcome, Rotation, Sense, formulate, load_case, load_result
from screwsynth.nlp.case.limits.singular_values import SmallestSingularValue
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.output.pictures.workspaces import drawing_at, slices_legend
from screwsynth.nlp.proof.statement.fixed_robot import legs_of
from screwsynth.nlp.proof.workspace import judge
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.numbers.extremes import prove_extreme
from screwsynth.nlp.proof.workspace.ranks.krawczyk import Coordinates, no_relation
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import LoopBoxes
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box, scaled
from screwsynth.nlp.proof.workspace.scale import ACCURACY, largest_scale
from screwsynth.nlp.proof.workspace.slices.slice_limits import UNDECIDED, LimitState, SliceLimits
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.proof.workspace.verdict import Verdict
from screwsynth.nlp.results.claims import refuted_claims, worst_claim
from screwsynth.nlp.results.workspace import WorkspaceResult, workspace_of
from screwsynth.nlp.words.claims import claim_words, violation_lines
from screwsynth.nlp.words.workspace import verdict_words

Value = TypeVar("Value")


def squares_at(case: Case, position: list[float], rotation: Rotation) -> float:
    """F at one pose, its loops closed from home by Newton's method."""
    nlp = formulate(replace(case, position=position, rotation=rotation, workspace=None))
    return nlp.evaluate(closed_start(nlp)).F


def judged(text: str, time_limit: float = 20.0, **options: Any) -> Judgement:  # noqa: ANN401
    return judge_workspace(case_from(SMALL + text), time_limit=time_limit, jobs=1, **options)


@pytest.mark.parametrize(
    "name", soaked(["tripteron", "3-puu", "orthoglide", "3-upu", "planar-3-rrr"], ["tripteron", "3-upu"])
)
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


def opened(*args: Any, **options: Any) -> Verdict:  # noqa: ANN401
    """A search that leaves what has no limit open."""
    found = prove_extreme(*args, **options)
    return found if found.limit is not None else replace(found, outcome=Outcome.OPEN, reason="for a test")


def test_numbers_that_are_only_shown_decide_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "prove_extreme", opened)
    found = judged("leg_length = { min = 15, max = 60 }")
    assert {each.name for each in found.extremes if each.outcome is Outcome.OPEN} == {"F"}
    assert found.is_proved
    assert verdict_words(workspace_of(found)) == (
        "PROVED at every pose: no singularity, 12 limits satisfied "
        "(2 quantities without a limit undecided, for information)"
    )
    half = judged("leg_length = { min = 15 }")
    assert verdict_words(workspace_of(half)).endswith(" (8 quantities without a limit undecided, for information)")
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
        assert (code, "NOT PROVED" in out) == (status, bool(status))


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
    return type(value)(**{**vars(value), **parts})


def counted(result: WorkspaceResult) -> tuple[int, int]:
    """Refuted claims of the verdict's words, and those of the list of commands."""
    lines = list(violation_lines(result, lambda _: "command"))
    shown = {
        each.words.partition(":")[0] + each.words.partition("limit ")[2].partition(";")[0]
        for each in lines
        if each.label == "violated"
    }
    others = sum(int(each.words.partition(":")[0]) for each in lines if each.label == "other violated claims")
    counts = re.search(r"(\d+) limits? violated", verdict_words(result))
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
    assert verdict_words(lost) == "NOT PROVED: a singularity, 0 limits violated, 0 undecided, 1 proved"


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
        (HORNS, "1e-6", "largest proved box  none found within the time limit", "the time is over"),
        (edited(HORNS, IMPOSSIBLE), "0.4", "even the smallest examined box is not proved", None),
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


#: Limits of every kind that a slice shows, on a design that violates each of them somewhere.
LIMITED = (
    hexapod_text(5, 9)
    + """[limits]
leg_length = { min = 26, max = 34 }
base_joint_angle = { max = 25, about = "home" }
home = { position = [0, 0, 20] }
leg_clearance = { min = 3.5 }
smallest_singular_value = { min = 0.5, length = 11.5 }
actuator = { stroke_max = 12 }
[workspace]
position = [{ min = -4, max = 4 }, 0, { min = 17, max = 23 }]
"""
)
#: Number of random boxes, and of poses in each.
BOXES, POSES = 120, 4


@pytest.fixture(scope="module")
def limited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(tmp_path_factory.mktemp("workspace") / "a machine.toml", LIMITED)


def violations(
    case: Case, position: FloatArray, rotation: FloatArray, *, angle: float = 25, with_distances: bool = True
) -> dict[str, FloatArray]:
    """How far each limit is violated at poses, (K, 3) and (K, 3, 3): positive where it is; by the definitions alone."""
    legs = legs_of(case)
    ends = position[:, None] + np.einsum("kij,lj->kli", rotation, legs.platform)
    span = ends - legs.base
    length = np.linalg.norm(span, axis=2)
    home = np.array([0, 0, 20]) + legs.platform - legs.base
    cosines = np.einsum("kli,li->kl", span / length[..., None], home / np.linalg.norm(home, axis=1)[:, None])
    unit = span / length[..., None]
    J = np.concatenate([unit, np.cross(ends - position[:, None], unit) / 11.5], axis=2)
    found = {
        "leg_length.min": 26 - length.min(axis=1),
        "leg_length.max": length.max(axis=1) - 34,
        "base_joint_angle.max": np.degrees(np.arccos(cosines.min(axis=1))) - angle,
    }
    if not with_distances:
        return found
    # The distance of two legs, from many pairs of their points: at most the distance between these too large.
    parts = np.linspace(0, 1, 21)[:, None]
    points = legs.base[None, :, None] + parts * span[:, :, None]
    apart = np.full(len(position), np.inf)
    for one in range(6):
        for other in range(one):
            between = points[:, one, :, None] - points[:, other, None]
            apart = np.minimum(apart, np.sqrt((between**2).sum(axis=3).min(axis=(1, 2))))
    return found | {
        "leg_clearance.min": 3.5 - apart,
        "smallest_singular_value.min": 0.5 - np.linalg.svd(J, compute_uv=False)[:, -1],
    }


@pytest.mark.parametrize("kind", TurnKind)
def test_limits_over_boxes_are_those_at_their_poses(limited: Path, kind: TurnKind) -> None:
    case, rng = load_case(str(limited)), np.random.default_rng(0)
    count = 3 if kind is TurnKind.ROLL_PITCH_YAW else 1
    turns = Turns(kind, (Free(-0.7, 0.7),) * count, (0.6, 0.0, 0.8))
    workspace = Workspace((Free(-12.0, 12.0), 0.0, Free(11.0, 29.0)), turns)
    box = pose_box(workspace)
    chosen = (0, 3) if kind is TurnKind.AXIS else (3, 4)
    closed = closed_form(case.model)
    cells = SliceLimits(case, closed, workspace)
    free = list(cells.problem.free)
    lower = np.repeat(0.5 * (box.lower + box.upper)[None], BOXES, axis=0)
    upper = lower.copy()
    size = (box.upper - box.lower)[list(chosen)] * 2.0 ** -rng.integers(3, 8, size=(BOXES, 1))
    lower[:, chosen] = rng.uniform(box.lower[list(chosen)], box.upper[list(chosen)] - size)
    upper[:, chosen] = lower[:, chosen] + size
    ends = lower[:, free], upper[:, free]
    boxes = LoopBoxes(*ends, ends[0], np.ones(BOXES, dtype=bool))
    relation = no_relation(BOXES, Coordinates(list(range(len(free))), [], []))
    states = cells.of_limits(cells.examine(boxes, relation, np.repeat(cells.unknown, BOXES, axis=0)))
    points = rng.uniform(np.repeat(lower, POSES, axis=0), np.repeat(upper, POSES, axis=0))
    found = violations(case, points[:, :3], box.rotations(points))
    for limit, row in zip(cells.limits, states, strict=True):
        values = found[limit.key].reshape(BOXES, POSES)
        # The distance of two legs is taken between points 1.7 in apart: it is too large by less than 0.3 in.
        slack = 0.3 if limit.key == "leg_clearance.min" else 1e-9
        assert (values[row == LimitState.KEPT] <= 1e-9).all(), limit.key
        assert (values[row == LimitState.VIOLATED] > -slack).all(), limit.key
        assert np.count_nonzero(row == LimitState.OPEN) < 0.7 * BOXES, limit.key
    assert (states == LimitState.VIOLATED).any(axis=1).sum() >= 3
    assert (states == LimitState.KEPT).any(axis=1).sum() >= 3


def test_a_box_has_the_limit_that_is_violated_first(limited: Path) -> None:
    case = load_case(str(limited), {"limits.base_joint_angle.max": 12})
    slow = (SmallestSingularValue, LegClearance)
    case = replace(case, limits=Limits(*[each for each in case.limits if not isinstance(each, slow)]))
    (each,) = slices_of(case)
    assert each.names == ("p_x", "p_z")
    assert each.left_out == ("actuator.stroke_max",)
    area = np.prod(each.boxes[:, 2:] - each.boxes[:, :2], axis=1)
    assert area.sum() == pytest.approx(float(np.prod(each.whole[1] - each.whole[0])))
    # Boxes that are left open are as small as they get, and few.
    assert area[each.binding == UNDECIDED].sum() < 0.05 * area.sum()
    keys = [limit.key for limit in each.limits]
    chosen = np.flatnonzero((area > area.sum() / 4**7) & (each.binding >= 0))
    middle = each.workspace.mean(axis=0)
    ends = 0.5 * (each.boxes[chosen, :2] + each.boxes[chosen, 2:])
    way = middle + np.linspace(0, 1, 40)[:, None, None] * (ends - middle)
    position = np.stack([way[..., 0], np.zeros(way.shape[:2]), way[..., 1]], axis=-1).reshape(-1, 3)
    found = violations(
        case, position, np.repeat(np.eye(3)[None], len(position), axis=0), angle=12, with_distances=False
    )
    on_way = np.array([(found[key] > 0).reshape(way.shape[:2]) for key in keys])
    begins = np.where(on_way.any(axis=1), np.argmax(on_way, axis=1), way.shape[0] - 1)
    own = begins[each.binding[chosen], np.arange(len(chosen))]
    # The grid in which the first one is looked up has steps of 1/64 of the slice, the way here of 1/80.
    assert (own <= begins.min(axis=0) + 3).all()
    assert len(set(each.binding[chosen].tolist())) > 2
    words = [kind.words for kind in slices_legend(case, [each])]
    assert "violated: maximum leg length = 34 in" in words


@pytest.fixture(scope="module")
def refuted(limited: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, WorkspaceResult, Path]:
    """Output, result and files of a machine with refuted claims."""
    folder = tmp_path_factory.mktemp("judged")
    files = [str(folder / name) for name in ("result.json", "page.html", "worst.svg")]
    flags = [part for pair in zip(("--json", "--html", "--plot-pose"), files, strict=True) for part in pair]
    numbers = ["x3=6", "limits.leg_clearance.min=6", "limits.base_joint_angle.max=8", "limits.actuator.stroke_max=5"]
    flags += [part for each in numbers for part in ("--set", each)]
    run = ran("workspace", str(limited), "--gap", "0.05", "--time", "2", "--all", *flags)
    assert run.code == 1
    result = load_result(folder / "result.json")
    assert isinstance(result, WorkspaceResult)
    return run.output, result, folder


def test_each_command_shows_what_it_is_printed_for(refuted: tuple[str, WorkspaceResult, Path], cli: Run) -> None:
    out, result, folder = refuted
    commands = commands_in(out, "see it with")
    claims = list(refuted_claims(result))
    keys = {each.key for each in claims}
    assert keys == {"base_joint_angle.max", "leg_length.min", "actuator.stroke_max", "leg_clearance.min"}
    # One for each limit, and two for a stroke, which no single pose shows.
    assert len(commands) == len(keys) + 1
    page = Reader((folder / "page.html").read_text(encoding="utf-8")).words
    assert all(shlex.join(["screwsynth", *each]) in page for each in commands)
    words = [line.removeprefix("violated  ") for line in unbroken(out).splitlines() if line.startswith("violated  ")]
    words = [each for each in words if ": smallest " in each or ": largest " in each]
    for claim, arguments in zip(words, commands, strict=True):
        status, shown, _ = cli(*arguments, "--json", "-")
        assert status == 1
        point = json.loads(shown)
        found = re.fullmatch(r"(.*): (?:smallest|largest) \S+ \S+, limit (\S+) = (\S+) \S+", claim)
        if found is None:
            assert claim.startswith("actuator.stroke_max")
            continue
        name, key, limit = found.groups()
        row = next(each for each in point["limits"] if each["key"] == key)
        assert row["limit"] == pytest.approx(float(limit))
        assert name in row["violated"]
        # Few digits: all of them are needed only where they decide.
        assert all(len(digits) < 8 for digits in re.findall(r"\d+\.(\d+)", " ".join(arguments)))


def test_a_command_takes_the_place_of_a_rotation_in_another_form(tmp_path: Path, cli: Run) -> None:
    place = "[limits]\nleg_length = { max = 27 }\n[workspace]\nposition = [{ min = -5, max = 5 }, 0, 20]\n"
    turned = edited(
        hexapod_text(5, 9), ("position = [0, 0, 20]", "position = [0, 0, 20]\nrotation = { rpy = [0, 0, 9] }")
    )
    path = saved(tmp_path / "turned.toml", turned + place)
    status, out, _ = cli("workspace", str(path), "--gap", "0.1")
    assert status == 1
    (command,) = commands_in(out, "see it with")
    status, shown, err = cli(*command, "--json", "-")
    assert (status, err) == (1, "")
    assert json.loads(shown)["violated"][0]["name"].startswith("leg_length")
    refusal_of(cli("evaluate", str(path), "--set", "axis=0,0,1"), "angle")


def test_a_singular_pose_is_seen_with_its_command(cli: Run, tmp_path: Path) -> None:
    place = "[workspace]\nposition = [0, 0, 20]\nrotation = { angle = { min = -80, max = 80 } }\n"
    path = saved(tmp_path / "turned.toml", hexapod_text(5, 9) + place)
    status, out, _ = cli("workspace", str(path), "--gap", "0.5", "--time", "0.1")
    assert status == 1
    assert "violated  J is singular" in out
    _, shown, _ = cli(*commands_in(out, "see it with")[0], "--json", "-")
    assert json.loads(shown)["rank"] < 6


class Reader(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.images: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.ids.append(found.get("id") or "")
        if tag == "img":
            self.images.append(found["src"] or "")

    def handle_data(self, data: str) -> None:
        self.words += data


def test_the_page_has_verdicts_poses_and_slices(refuted: tuple[str, WorkspaceResult, Path], limited: Path) -> None:
    _, result, folder = refuted
    text = (folder / "page.html").read_text(encoding="utf-8")
    page = Reader(text)
    assert {"verdicts", "robot", "slices", "refuted", "origin"} <= set(page.ids)
    assert len(page.images) == 1 + 1
    assert all(each.startswith("data:image/") for each in page.images)
    assert "http" not in re.sub(r"http-equiv|http://www\.w3\.org/\S+", "", text)
    # Headings and captions have quantities and limits in words, such as "base joint angle" and "maximum leg length".
    plain = re.sub(r"([a-z]+)_(?=[a-z]{2})", r"\1 ", page.words).replace("\N{MINUS SIGN}", "-")
    for claim in refuted_claims(result):
        name, colon, rest = claim_words(claim).partition(":")
        value = rest.partition(",")[0]
        assert f"{name.replace('_', ' ')}{colon}{value}" in plain
    assert not re.search(r"\blimit [a-z_]+\.(min|max) =", page.words)
    assert len(text) < 1_000_000
    worst = worst_claim(result, Sense.MAX)
    assert "Robot at the worst pose:" in page.words
    assert 'id="limb 1+"' in (folder / "worst.svg").read_text(encoding="utf-8")
    headline = drawing_at(load_case(limited, {"x3": 6}), worst).headline
    assert headline.startswith(f"refuted: {claim_words(worst)}; at ")
    said = [float(each) for each in re.findall(r"-?[\d.]+(?:e-?\d+)?", headline.partition("; at ")[2])]
    assert said[:3] == pytest.approx(list(worst.pose.position), rel=1e-4, abs=1e-4)


def test_the_shipped_hexapod_is_proved(cli: Run) -> None:
    assert "PROVED at every pose" in output_of(cli("workspace", "hexapod-linuxcnc"))
    assert load_case("hexapod-linuxcnc").position[2] == pytest.approx(20)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (
            ["--html", "-", "--json", "-"],
            "only one of --json -, --csv -, --html - and --proof - can go to standard output",
        ),
        (["--plot-pose", "a.txt"], "a.txt"),
        (["--html", "nowhere/page.html"], "nowhere/page.html"),
    ],
)
def test_files_are_refused_in_a_sentence(cli: Run, flags: list[str], words: str) -> None:
    refusal_of(cli("workspace", "hexapod-linuxcnc", *flags), words)


@pytest.mark.parametrize("metre", [1.0, 1e3])
def test_a_bound_of_equal_singular_values_is_close_to_their_smallest_value(metre: float) -> None:
    """A threefold hexapod: two smallest singular values are equal in the middle, where a sum of powers counts both."""
    tables = {
        "robot": {
            "model": "stewart-gough",
            "layout": "octahedral",
            "parameters": {"x1": 0.18 * metre, "x2": 0.11 * metre, "x3": 29.46, "x4": 20.28},
        },
        "units": {"angle": "deg"},
        "pose": {"position": [0, 0, 0.25 * metre]},
        "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "limits": {"smallest_singular_value": {"min": 0.2, "length": 0.11 * metre}},
        "workspace": {"position": [ends(0.03 * metre), ends(0.03 * metre), 0.25 * metre]},
    }
    judged = judge_workspace(case_from(tables), with_objective=False)
    (found,) = (each for each in judged.extremes if each.name == "smallest_singular_value")
    assert found.outcome is Outcome.PROVED
    # Columns of moments are divided by the length; legs from the closed form of both circles.
    base, platform = circle_joints({"x1": 0.18, "x2": 0.11, "x3": math.radians(29.46), "x4": math.radians(20.28)})
    smallest = []
    for x, y in itertools.product(np.linspace(-0.03, 0.03, 21), repeat=2):
        spans = platform + np.array([x, y, 0.25]) - base
        legs = spans / np.linalg.norm(spans, axis=1, keepdims=True)
        smallest.append(np.linalg.svd(np.hstack([legs, np.cross(platform, legs) / 0.11]), compute_uv=False)[-1])
    assert min(smallest) * (1 - 1e-3) <= found.bound <= min(smallest) * (1 + 1e-9)

"""What a user sees of a workspace: slices, a page, a picture of the worst pose, commands that show a pose."""

import json
import math
import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from builders import commands_in, output_of, ran, refusal_of, unbroken
from hexapods import hexapod_text

from screwsynth.models import FloatArray
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free, Limits, load_case, load_result
from screwsynth.nlp.case.limits.clearance import LegClearance
from screwsynth.nlp.case.limits.singular_values import SmallestSingularValue
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.output.pictures.workspaces import drawing_at, slices_legend
from screwsynth.nlp.proof.statement.machine import legs_of
from screwsynth.nlp.proof.workspace.ranks.krawczyk import Coordinates, no_relation
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import LoopBoxes
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.slices.slice_limits import UNDECIDED, LimitState, SliceLimits
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.results.workspace import WorkspaceResult
from screwsynth.nlp.results.workspaceposes import refuted_claims, worst_claim

Run = Callable[..., tuple[int, str, str]]

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
    path = tmp_path_factory.mktemp("workspace") / "a machine.toml"
    path.write_text(LIMITED, encoding="utf-8")
    return path


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
    assert "violated: leg_length.max = 34 in" in words


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
    words = [line.removeprefix("refuted  ") for line in unbroken(out).splitlines() if line.startswith("refuted  ")]
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
    path = tmp_path / "turned.toml"
    turned = LIMITED.partition("[limits]")[0].replace(
        "position = [0, 0, 20]", "position = [0, 0, 20]\nrotation = { rpy = [0, 0, 9] }"
    )
    path.write_text(
        f"{turned}[limits]\nleg_length = {{ max = 27 }}\n[workspace]\nposition = [{{ min = -5, max = 5 }}, 0, 20]\n"
    )
    status, out, _ = cli("workspace", str(path), "--gap", "0.1")
    assert status == 1
    (command,) = commands_in(out, "see it with")
    status, shown, err = cli(*command, "--json", "-")
    assert (status, err) == (1, "")
    assert json.loads(shown)["violated"][0]["name"].startswith("leg_length")
    refusal_of(cli("evaluate", str(path), "--set", "axis=0,0,1"), "angle")


def test_a_singular_pose_is_seen_with_its_command(cli: Run, tmp_path: Path) -> None:
    path = tmp_path / "turned.toml"
    fixed = LIMITED.partition("[limits]")[0]
    path.write_text(f"{fixed}[workspace]\nposition = [0, 0, 20]\nrotation = {{ angle = {{ min = -80, max = 80 }} }}\n")
    status, out, _ = cli("workspace", str(path), "--gap", "0.5", "--time", "0.1")
    assert status == 1
    assert "refuted  regular: J is singular" in out
    _, shown, _ = cli(*commands_in(out, "see it with")[0], "--json", "-")
    assert json.loads(shown)["rank"] < 6


class Reader(HTMLParser):
    """Headings, images and text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.images: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if found.get("id"):
            self.ids.append(found["id"] or "")
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
    for claim in refuted_claims(result):
        assert claim.words in page.words
    assert len(text) < 1_000_000
    worst = worst_claim(result, Sense.MAX)
    assert worst.words in page.words
    assert 'id="limb 1+"' in (folder / "worst.svg").read_text(encoding="utf-8")
    # The picture says its pose.
    headline = drawing_at(load_case(limited, {"x3": 6}), worst).headline
    assert headline.startswith(f"refuted: {worst.words}; shown at ")
    said = [float(each) for each in re.findall(r"-?[\d.]+(?:e-?\d+)?", headline.partition("shown at ")[2])]
    assert said[:3] == pytest.approx(list(worst.pose.position), rel=1e-4, abs=1e-4)


def test_the_shipped_hexapod_is_proved(cli: Run) -> None:
    out = output_of(cli("workspace", "hexapod-linuxcnc"))
    assert "everything is proved for every pose" in out
    assert math.isclose(load_case("hexapod-linuxcnc").position[2], 20)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (
            ["--html", "-", "--json", "-"],
            "standard output can take one of --json -, --csv -, --html - and --proof - only",
        ),
        (["--plot-pose", "a.txt"], "a.txt"),
        (["--html", "nowhere/page.html"], "nowhere/page.html"),
    ],
)
def test_files_are_refused_in_a_sentence(cli: Run, flags: list[str], words: str) -> None:
    status, out, err = cli("workspace", "hexapod-linuxcnc", *flags)
    assert status == 2
    assert out == ""
    assert words in err
    assert err.count("\n") == 1

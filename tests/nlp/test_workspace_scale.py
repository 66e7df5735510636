"""The largest proved box: small boxes first, so that a box that stays open does not take the time of them all."""

import json
import math
from dataclasses import replace
from pathlib import Path

from builders import Run, case_from, edited, saved, unbroken

from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.robot.pose_box import scaled
from screwsynth.nlp.proof.workspace.scale import ACCURACY, largest_scale

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

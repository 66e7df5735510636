"""Settings for every pose of a workspace in words: their policy, or the proof that they exist."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from ..proof.workspace.verdict import Outcome
from ..results.posesettings import policy_of
from .lines import title_line
from .numbers import number
from .poses import pose_words
from .text import Line, TextTable, Tone, in_part

if TYPE_CHECKING:
    from ..case.case import Case
    from ..evidence.state import WorkspacePose
    from ..results.posesettings import PoseSettingsResult, SettingRangeData


def policy_lines(case: Case) -> Iterator[Line]:
    """Yield the affine settings of a case; nothing without fixed ones."""
    policy = policy_of(case)
    if policy:
        yield Line("; ".join(policy), label="settings", after=", set at a standstill")


def pose_settings_summary(
    case: Case, result: PoseSettingsResult, command: Callable[[WorkspacePose], str]
) -> Iterator[Line | TextTable]:
    """Yield the verdict on the existence of settings, the refuting pose, and the settings of each box.

    Args:
        case: the case.
        result: the verdict.
        command: function that returns the command that shows the robot at a pose.
    """
    yield title_line(case)
    names = " and ".join(each.name for each in result.ranges) or "the stated dimensions"
    ranges = ", ".join(map(_range_words, result.ranges))
    if result.outcome is Outcome.PROVED:
        answer = f"PROVED: every pose has a value of {names} that satisfies all limits, without a singularity"
    elif result.outcome is Outcome.REFUTED:
        answer = f"NOT PROVED: one pose has no value of {names} that satisfies all limits"
    else:
        answer = f"NOT PROVED: {_boxes(result.open)} undecided"
    yield Line(answer, label="verdict", tone=Tone.ANSWER if result.proved else Tone.NO_ANSWER)
    yield Line(ranges, label="settings", after=", reset at a standstill")
    if result.pose is not None:
        at = pose_words(case, result.pose)
        label = "no setting at" if result.outcome is Outcome.REFUTED else "undecided near"
        yield Line(at, label=label)
        if result.outcome is Outcome.REFUTED:
            yield Line(command(result.pose), label="see it with", is_command=True)
    proved, examined = len(result.setting_boxes), result.examined
    words = f"{_boxes(proved)} of poses proved, each with one setting; {examined} examined"
    yield Line(words, label="boxes")
    if result.reason is not None:
        yield Line(result.reason, label="search")
    if proved:
        yield from in_part("settings", [_table(result)])


def _boxes(count: int) -> str:
    """Return a number of boxes in words."""
    return "1 box" if count == 1 else f"{count:,} boxes"


def _range_words(each: SettingRangeData) -> str:
    """Return the range of a setting."""
    return f"{each.name} {number(each.lower)} .. {number(each.upper)} {each.unit}".rstrip()


def _table(result: PoseSettingsResult) -> TextTable:
    """Return the table of the proved boxes."""
    first = result.setting_boxes[0]
    headers = [f"{name} {end}" for name in first.coordinates for end in ("from", "to")]
    headers += [f"{each.name}\n{each.unit}" if each.unit else each.name for each in result.ranges]
    rows = []
    for box in result.setting_boxes:
        cells = [number(end) for ends in box.coordinates.values() for end in ends]
        rows.append((*cells, *(number(box.values[each.name]) for each in result.ranges)))
    return TextTable(tuple(headers), tuple(rows), "settings", "settings of each box of poses")

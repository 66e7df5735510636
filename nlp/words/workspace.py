"""Verdicts over a workspace: the answer, singularities, limits with the smallest margin, and all quantities."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..case.motors import ActuatorQuantity
from ..case.pose import ends_of
from ..case.positionsets import SetKind
from ..case.task import Sense
from ..interruption import STOPPED
from ..proof.statement.claims import CONSTRAINTS, REGULAR
from ..proof.workspace.verdict import EVERYWHERE, Outcome
from .claims import CLAIM_WORDS, rank_line, unproved_ranks, violation_lines
from .lines import engine_words
from .motors import OUTCOME_WORDS, ends_of_motor, motor_tables
from .numbers import number
from .poses import pose_words
from .posesettings import policy_lines
from .text import Line, TextTable, Tone, in_part
from .verdicts import (
    answer_words,
    exchange_lines,
    head_lines,
    open_lines,
    outcome_lines,
    proof_line,
    tightest_table,
    tolerance_lines,
    verdict_table,
    violating_robot,
)

if TYPE_CHECKING:
    from ..evidence.state import WorkspacePose
    from ..results.verdicts import RegularData, VerdictData
    from ..results.workspace import ScaleData, WorkspaceProofData, WorkspaceResult


def _about_lines(case: Case, result: WorkspaceResult) -> Iterator[Line]:
    """Yield tolerance, affine settings and set of poses that a verdict covers, each where the case has it."""
    yield from tolerance_lines(case, result.joint_centre)
    yield from policy_lines(case)
    if result.poses is not None:
        yield Line(result.poses, label="poses")


def _objective_lines(extremes: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield the proved range of F."""
    for low, high in pairwise(extremes):
        if low.bound is None or high.bound is None:
            continue
        if low.name == high.name and low.name.partition(" ")[0] == "F":
            ends = f"{number(low.bound)} .. {number(high.bound)} {low.unit}".rstrip()
            yield Line(ends, label=low.name, after=", over the workspace (proved)")


def verdict_words(result: WorkspaceResult) -> str:
    """Return the verdict: counts of singularities, limits, and undecided quantities without a limit."""
    ranks = [each.outcome for each in (result.regular, result.constraints) if each is not None]
    limits = [each.outcome for each in result.extremes if each.limit is not None]
    words = answer_words(ranks, limits, "at every pose", is_proved=result.proved)
    ends = [
        end
        for each in result.motors or ()
        if each.number is not ActuatorQuantity.COORDINATE
        for end in ends_of_motor(each)
    ]
    shown = sum(each.limit is None and each.outcome is Outcome.OPEN for each in result.extremes)
    shown += sum(each.limit is None and each.outcome is Outcome.OPEN for each in ends)
    if not shown:
        return words
    quantities = "1 quantity" if shown == 1 else f"{shown} quantities"
    return f"{words} ({quantities} without a limit undecided, for information)"


def _needs_line(case: Case, result: WorkspaceResult) -> Iterator[Line]:
    """Yield the proved range of the lengths of straight legs."""
    legs = [each for each in result.extremes if each.name.startswith("leg_length limb ") and each.bound is not None]
    short = [each.bound for each in legs if each.sense is Sense.MIN and each.bound is not None]
    long = [each.bound for each in legs if each.sense is Sense.MAX and each.bound is not None]
    if short and long:
        words = f"{number(min(short))} .. {number(max(long))} {case.units.length}"
        yield Line(words, label="leg lengths", after=", over the workspace (proved)")


def workspace_summary(
    case: Case, result: WorkspaceResult, command: Callable[[WorkspacePose], str] | None = None
) -> Iterator[Line | TextTable]:
    """Yield the verdicts on a robot over its workspace: the answer, then all quantities.

    Args:
        case: the case.
        result: the verdicts.
        command: function that returns the command for a pose; None for a page, which lists claims only in tables.
    """
    limited, answer = [each for each in result.extremes if each.limit is not None], verdict_words(result)
    about = _about_lines(case, result)
    yield from head_lines(case, answer, result.extremes, result.dependent, is_proved=result.proved, about=about)
    yield from _objective_lines(result.extremes)
    yield from _pose_lines(case)
    yield from _regular_lines(case, result.regular)
    if result.constraints is not None:
        yield from _regular_lines(case, result.constraints, CONSTRAINTS)
    yield from outcome_lines(limited)
    if command is not None:
        yield from violation_lines(result, command)
        yield from open_lines(limited)
    yield from _needs_line(case, result)
    if result.scale is not None:
        yield from _scale_lines(case, result.scale)
    yield from tightest_table(result.extremes)
    yield from in_part("motors", motor_tables(case, result.motors or ()))
    for regular, label in ((result.regular, "search"), (result.constraints, "search for constraint singularities")):
        if regular is not None:
            yield from in_part("searches", _search_lines(case, regular, label))
    yield from in_part("robot that violates a limit", _violating_robot_table(case, result.extremes))
    yield from in_part("all quantities", _tables(case, result.extremes))


def _pose_lines(case: Case) -> Iterator[Line]:
    """Yield the reference pose of a workspace of offsets; nothing for a workspace in world coordinates."""
    if case.workspace is not None and case.workspace.about_pose:
        position, (angle, _) = [ends_of(value)[0] for value in case.position], ends_of(case.rotation.angle)
        words = ", ".join(number(each, max(map(abs, position)), digits=5) for each in position)
        turned = f", rotated by {case.units.text(angle, Dimension.ANGLE)}" if angle else ""
        yield Line(f"the stated pose ({words}){turned}", label="workspace relative to")


def _violating_robot_table(case: Case, extremes: Sequence[VerdictData]) -> Iterator[TextTable]:
    """Yield the joint-centre errors with which a robot within the tolerance violates a limit."""
    for each in extremes:
        if each.outcome is Outcome.REFUTED and each.machine is not None:
            yield violating_robot(case, each.name, each.machine)
            return


def proof_lines(proof: WorkspaceProofData | None) -> Iterator[Line]:
    """Yield the proof of a solved design over its workspace."""
    if proof is not None:
        yield proof_line(proof, unproved_ranks({REGULAR: proof.regular.outcome}), proof.extremes, "workspace", "pose")
        yield from exchange_lines(proof, "workspace")


def proof_tables(case: Case, proof: WorkspaceProofData) -> Iterator[TextTable]:
    """Yield the limits and the other quantities of a solved design over its workspace."""
    yield from _tables(case, proof.extremes)


def _tables(case: Case, extremes: Sequence[VerdictData]) -> Iterator[TextTable]:
    """Yield the quantities with a limit, and those without."""
    limited = [each for each in extremes if each.limit is not None]
    yield from verdict_table(case, "limits", "limits over all poses", limited)
    others = [each for each in extremes if each.limit is None]
    yield from verdict_table(case, "ranges", "quantities without a limit, over all poses", others)


def _regular_lines(case: Case, regular: RegularData, name: str = REGULAR) -> Iterator[Line]:
    """Yield the verdict on the rank of J, or on the rank of the constraint wrenches."""
    after = ""
    if regular.outcome is Outcome.REFUTED:
        after = f" at {'every pose' if regular.reason == EVERYWHERE else 'a pose'}"
        after += f", {regular.reason}" if regular.reason and regular.between is None else ""
    elif regular.outcome is Outcome.OPEN:
        boxes = "1 box remains" if regular.open == 1 else f"{regular.open:,} boxes remain"
        reason = f" ({regular.reason})" if regular.reason else ""
        after = f": {boxes}, {100 * regular.share:.3g} % of the workspace{reason}"
    yield rank_line(name, regular.outcome, after)
    if regular.pose is not None:
        is_singular = regular.outcome is Outcome.REFUTED
        label = "singular pose" if is_singular else "undecided boxes near"
        yield Line(pose_words(case, regular.pose), label=label)


def _search_lines(case: Case, regular: RegularData, label: str) -> Iterator[Line | TextTable]:
    """Yield the robot within the tolerance that is singular, and the size of the search."""
    if regular.machine is not None:
        yield violating_robot(case, "full rank of J", regular.machine)
    word = "box" if regular.boxes == 1 else "boxes"
    yield Line(
        f"{regular.boxes:,} {word} examined in {regular.seconds:.2f} s{engine_words(regular.engine)}", label=label
    )


def _scale_lines(case: Case, scale: ScaleData) -> Iterator[Line]:
    """Yield the largest proved box or diameter, and the claim that fails on the next larger one."""
    ended = f"; the search ended early: {scale.reason}" if scale.reason else ""
    positions = None if case.workspace is None else case.workspace.position_set
    size = "box" if positions is None or not positions.has_radius else "diameter"
    if scale.factor is not None and scale.diameter is not None:
        stated = "width" if positions is not None and positions.kind is SetKind.RING else "one"
        words = f"{scale.diameter:.6g} {case.units.length}, {scale.factor:.4g} times the stated {stated}"
        yield Line(words, label=f"largest proved {size}", tone=Tone.ANSWER, after=ended)
    elif scale.factor is not None:
        words = f"{scale.factor:.4g} times the workspace"
        yield Line(words, label=f"largest proved {size}", tone=Tone.ANSWER, after=ended)
    else:
        within = "the search was interrupted" if scale.reason == STOPPED else "none found within the time limit"
        words = within if scale.reason else f"none found; even the smallest examined {size} is not proved"
        yield Line(words, label=f"largest proved {size}", tone=Tone.NO_ANSWER)
    if scale.claim:
        larger = "" if scale.refuted is None else f"{scale.refuted:.4g} times, "
        near = "" if scale.pose is None else f", near {pose_words(case, scale.pose)}"
        yield Line(f"{larger}fails on {_failed_words(scale.claim)}{near}", label=f"next larger {size}")


def _failed_words(claim: str) -> str:
    """Return a claim with its outcome in words, from a text with the name and the status of the claim."""
    name, comma, status = claim.rpartition(", ")
    words = {each.value: word for each, word in OUTCOME_WORDS.items()}
    return f"{CLAIM_WORDS.get(name, name)}{comma}{words.get(status, status)}"

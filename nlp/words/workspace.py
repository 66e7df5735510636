"""Verdicts on a workspace in words: a digest of the claims that are nearest to their limits, then every number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..case.motors import MotorNumber
from ..case.pose import ends_of
from ..case.task import Sense
from ..interruption import STOPPED
from ..proof.workspace.verdict import EVERYWHERE, Outcome
from .claims import seeing_lines
from .motors import TONES, ends_of_motor, motor_tables
from .numbers import number
from .poses import pose_words
from .text import Line, TextTable, Tone, in_part
from .verdicts import (
    answer_words,
    exchange_lines,
    head_lines,
    machine_lines,
    open_lines,
    outcome_lines,
    proof_line,
    refuting_machine,
    tightest_table,
    verdict_table,
)

if TYPE_CHECKING:
    from ..results.verdicts import RegularData, VerdictData, WorkspacePose
    from ..results.workspace import ScaleData, WorkspaceProofData, WorkspaceResult


def _about_lines(case: Case, result: WorkspaceResult) -> Iterator[Line]:
    """Yield the machines and the poses that a verdict covers, where these are more than the exact one and the box."""
    yield from machine_lines(case, result.joint_centre)
    if result.poses is not None:
        yield Line(result.poses, label="poses")


def _objective_lines(extremes: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield the proved range of F."""
    for low, high in pairwise(extremes):
        if low.bound is None or high.bound is None:
            continue
        if low.name == high.name and low.name.partition(" ")[0] == "F":
            ends = f"{number(low.bound)} to {number(high.bound)} {low.unit}".rstrip()
            yield Line(ends, label=low.name, after=", at no pose smaller or larger")


def verdict_words(result: WorkspaceResult) -> str:
    """Return the verdict in one clause: counts of ranks and limits, and of numbers without a limit that stay open."""
    outcomes = [each.outcome for each in (result.regular, result.constraints) if each is not None]
    outcomes += [each.outcome for each in result.extremes if each.limit is not None]
    words = answer_words(outcomes, "for every pose", is_proved=result.proved)
    ends = [
        end for each in result.motors or () if each.number is not MotorNumber.COORDINATE for end in ends_of_motor(each)
    ]
    shown = sum(each.limit is None and each.outcome is Outcome.OPEN for each in result.extremes)
    shown += sum(each.limit is None and each.outcome is Outcome.OPEN for each in ends)
    if not shown:
        return words
    return f"{words}; {shown} number{' without a limit stays' if shown == 1 else 's without a limit stay'} open"


def _needs_line(case: Case, result: WorkspaceResult) -> Iterator[Line]:
    """Yield the lengths that the actuators of straight legs need."""
    legs = [each for each in result.extremes if each.name.startswith("leg_length limb ") and each.bound is not None]
    short = [each.bound for each in legs if each.sense is Sense.MIN and each.bound is not None]
    long = [each.bound for each in legs if each.sense is Sense.MAX and each.bound is not None]
    if short and long:
        words = f"{number(min(short))} to {number(max(long))} {case.units.length}"
        yield Line(words, label="lengths of legs", after=", at no pose shorter or longer")


def workspace_summary(
    case: Case, result: WorkspaceResult, command: Callable[[WorkspacePose], str] | None = None
) -> Iterator[Line | TextTable]:
    """Yield the verdicts on a machine over its workspace: the answer, then every number.

    Args:
        case: the case.
        result: the verdicts.
        command: returns the command that shows a pose; left out, for a page, only tables have single claims.
    """
    limited, answer = [each for each in result.extremes if each.limit is not None], verdict_words(result)
    about = _about_lines(case, result)
    yield from head_lines(case, answer, result.extremes, result.dependent, is_proved=result.proved, about=about)
    yield from _objective_lines(result.extremes)
    yield from _pose_lines(case)
    yield from _regular_lines(case, result.regular)
    if result.constraints is not None:
        yield from _regular_lines(case, result.constraints, "constraints regular", "the constraint wrenches lose")
    yield from outcome_lines(limited)
    if command is not None:
        yield from seeing_lines(result, command)
        yield from open_lines(limited)
    yield from _needs_line(case, result)
    if result.scale is not None:
        yield from _scale_lines(case, result.scale)
    yield from tightest_table(result.extremes)
    yield from in_part("motors", motor_tables(case, result.motors or ()))
    for regular, label in ((result.regular, "search"), (result.constraints, "search of constraints")):
        if regular is not None:
            yield from in_part("searches", _search_lines(case, regular, label))
    yield from in_part("the machine that refutes", _machine_lines(case, result.extremes))
    yield from in_part("every number", _tables(case, result.extremes))


def _pose_lines(case: Case) -> Iterator[Line]:
    """Yield the pose about which the workspace of a case with a fixed pose is."""
    if case.workspace is not None and case.workspace.about_pose:
        position, (angle, _) = [ends_of(value)[0] for value in case.position], ends_of(case.rotation.angle)
        words = ", ".join(number(each, max(map(abs, position)), digits=5) for each in position)
        turned = f", turned by {case.units.text(angle, Dimension.ANGLE)}" if angle else ""
        yield Line(f"the pose ({words}){turned}", label="about")


def _machine_lines(case: Case, extremes: Sequence[VerdictData]) -> Iterator[TextTable]:
    """Yield the machine of the first limit that is refuted by one within the tolerance."""
    for each in extremes:
        if each.outcome is Outcome.REFUTED and each.machine is not None:
            yield refuting_machine(case, each.name, each.machine)
            return


def proof_lines(proof: WorkspaceProofData | None) -> Iterator[Line]:
    """Yield the proof of a solved design over its workspace."""
    if proof is not None:
        yield proof_line(proof, "workspace", "pose")
        yield from exchange_lines(proof, "workspace")


def proof_tables(case: Case, proof: WorkspaceProofData) -> Iterator[TextTable]:
    """Yield the limits and numbers of a solved design over its workspace."""
    yield from _tables(case, proof.extremes)


def _tables(case: Case, extremes: Sequence[VerdictData]) -> Iterator[TextTable]:
    """Yield the numbers with a limit, and those without."""
    limited = [each for each in extremes if each.limit is not None]
    yield from verdict_table(case, "limits", "limits over every pose", limited)
    others = [each for each in extremes if each.limit is None]
    yield from verdict_table(case, "ranges", "numbers over every pose", others)


def _regular_lines(case: Case, regular: RegularData, label: str = "regular", of: str = "") -> Iterator[Line]:
    """Yield the verdict on a rank: that of J, or of the wrenches that a clause names."""
    share = f"{100 * regular.share:.3g} % of the box"
    found = f", {regular.reason}" if regular.reason and regular.between is None else ""
    at = "every pose" if regular.reason == EVERYWHERE else "a pose"
    boxes = "box is" if regular.open == 1 else "boxes are"
    words = {
        Outcome.PROVED: ": the constraint wrenches keep their rank at every pose"
        if of
        else ": J has full rank at every pose",
        Outcome.REFUTED: f": {of} rank at a pose{found}" if of else f": J is singular at {at}{found}",
        Outcome.OPEN: f": {regular.open:,} {boxes} left, {share} ({regular.reason or ''})",
    }
    yield Line(regular.outcome.value, label=label, tone=TONES[regular.outcome], after=words[regular.outcome])
    if regular.pose is not None:
        yield Line(pose_words(case, regular.pose), label="at" if regular.outcome is Outcome.REFUTED else "left about")


def _search_lines(case: Case, regular: RegularData, label: str) -> Iterator[Line | TextTable]:
    """Yield the machine that refutes a rank, and the size of the search."""
    if regular.machine is not None:
        yield refuting_machine(case, "regular", regular.machine)
    word = "box" if regular.boxes == 1 else "boxes"
    yield Line(f"{regular.boxes:,} {word} in {regular.seconds:.2f} s, engine {regular.engine}", label=label)


def _scale_lines(case: Case, scale: ScaleData) -> Iterator[Line]:
    """Yield the largest box."""
    ended = f"; the search ended early: {scale.reason}" if scale.reason else ""
    if scale.factor is not None:
        yield Line(f"{scale.factor:.4g}", label="scale", tone=Tone.ANSWER, after=f" times the box is proved{ended}")
    else:
        within = "the search was interrupted" if scale.reason == STOPPED else "none found within the time"
        words = within if scale.reason else "none found; not even the smallest box that is tried is proved"
        yield Line(f"largest proved box: {words}", label="scale", tone=Tone.NO_ANSWER)
    if scale.claim:
        beyond = "" if scale.refuted is None else f"at {scale.refuted:.4g} times: "
        at = "" if scale.pose is None else f", at {pose_words(case, scale.pose)}"
        yield Line(f"{beyond}{scale.claim}{at}", label="beyond")

"""Verdicts on a workspace in words: a digest of the claims that are nearest to their limits, then every number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..case.motors import MotorNumber
from ..case.pose import ends_of
from ..case.task import Sense
from ..case.workspace import POSITION
from ..interruption import STOPPED
from ..proof.workspace.verdict import EVERYWHERE, Outcome
from .posewording import pose_words
from .rounding import number, ordered
from .text import Line, TextTable, Tone, in_part
from .wording import counted, title_line
from .workspacemotors import TONES, ends_of_motor, motor_tables
from .workspaceposes import SHOWN, seeing_lines

if TYPE_CHECKING:
    from .path import PathClaimData, PathProofData
    from .workspace import (
        ExtremeData,
        MachineData,
        RegularData,
        ScaleData,
        WorkspacePose,
        WorkspaceProofData,
        WorkspaceResult,
    )

#: So many claims are in the digest, and so many kinds of limits in the count of an outcome.
_TIGHTEST, _GROUPS = 5, 6
_ORDER = (Outcome.REFUTED, Outcome.OPEN, Outcome.PROVED)


def verdict_lines(case: Case, result: WorkspaceResult) -> Iterator[Line]:
    """Yield the verdict on a machine, what it is about, and F."""
    yield Line(verdict_words(result), label="verdict", tone=Tone.ANSWER if result.proved else Tone.NO_ANSWER)
    yield from machine_lines(case, result.joint_centre)
    yield from _dependent_lines(result)
    for low, high in zip(result.extremes, result.extremes[1:], strict=False):
        if low.bound is None or high.bound is None:
            continue
        if low.name == high.name and low.name.partition(" ")[0] == "F":
            ends = f"{number(low.bound)} to {number(high.bound)} {low.unit}".rstrip()
            yield Line(ends, label=low.name, after=", at no pose smaller or larger")


def _dependent_lines(result: WorkspaceResult) -> Iterator[Line]:
    """Yield the set of poses of a robot with dependent coordinates, and the proved range of each of these."""
    if result.poses is None:
        return
    yield Line(result.poses, label="poses")
    yield from following_lines(result.dependent or (), result.extremes)


def following_lines(names: Sequence[str], claims: Sequence[ExtremeData | PathClaimData]) -> Iterator[Line]:
    """Yield the proved range of each dependent coordinate of the pose."""
    for name in names:
        ends = {each.sense: each for each in claims if each.name == name}
        bounds = [ends[sense].bound if sense in ends else None for sense in (Sense.MIN, Sense.MAX)]
        size = _size_of(name, claims)
        low, high = ("unknown" if each is None else number(each, size) for each in bounds)
        unit = next((each.unit or "" for each in ends.values()), "")
        words = f"{name} {low} to {high} {unit}".rstrip() if None not in bounds else f"{name}, no range is proved"
        yield Line(words, label="follows")


def _size_of(name: str, claims: Sequence[ExtremeData | PathClaimData]) -> float:
    """Return a size beside which a coordinate is rounding: that of the positions of poses; 0 for a rotation."""
    poses = [each.pose for each in claims if each.pose is not None] if name in POSITION else []
    return max((abs(part) for pose in poses for part in pose.position), default=0.0)


def verdict_words(result: WorkspaceResult) -> str:
    """Return the verdict in one clause: counts of ranks and limits, and of numbers without a limit that stay open."""
    claims = [each.outcome for each in (result.regular, result.constraints) if each is not None]
    claims += [each.outcome for each in result.extremes if each.limit is not None]
    counts = ", ".join(f"{claims.count(each)} {each.value}" for each in _ORDER)
    words = "everything is proved for every pose" if result.proved else f"not everything is proved: {counts}"
    ends = [
        end for each in result.motors or () if each.number is not MotorNumber.COORDINATE for end in ends_of_motor(each)
    ]
    shown = sum(each.limit is None and each.outcome is Outcome.OPEN for each in result.extremes)
    shown += sum(each.limit is None and each.outcome is Outcome.OPEN for each in ends)
    if not shown:
        return words
    return f"{words}; {shown} number{' without a limit stays' if shown == 1 else 's without a limit stay'} open"


def machine_lines(case: Case, joint_centre: float | None) -> Iterator[Line]:
    """Yield the machines that a verdict is about, where it is about more than the exact one."""
    if joint_centre is not None:
        words = f"every one whose joint centres are off by at most {joint_centre:g} {case.units.length}".rstrip()
        yield Line(words, label="machines")


def tightest_table(
    extremes: Sequence[ExtremeData | PathClaimData], title: str = "tightest limits over every pose"
) -> Iterator[TextTable]:
    """Yield the claims that are nearest to their limits: refuted ones first, then open ones."""
    limited = [each for each in extremes if each.limit is not None]
    limited.sort(key=lambda each: (_ORDER.index(each.outcome), ordered(_room(each))))
    seen: dict[str, ExtremeData | PathClaimData] = {}
    for each in limited:
        # The nearest of each limit stands for all legs and joints.
        key = getattr(each, "key", None) or f"{each.name.partition(' ')[0]} {each.sense}"
        seen.setdefault(f"{each.outcome} {key}", each)
    rows = [
        (
            each.name,
            _limit_words(each),
            "none" if each.bound is None else number(each.bound),
            "none" if each.reached is None else number(each.reached),
            Line(each.outcome.value, tone=TONES[each.outcome]),
        )
        for each in list(seen.values())[:_TIGHTEST]
    ]
    if rows:
        headers = ("nearest to its limit", "limit", "proven", "reached", "outcome")
        yield TextTable(headers, tuple(rows), name="tightest", title=title)


def _room(each: ExtremeData | PathClaimData) -> float:
    """Return the distance of a claim's bound from its limit, as a part of the limit; negative beyond it."""
    limit = each.limit or 0.0
    value = each.bound if each.bound is not None else each.reached
    if value is None:
        return 0.0
    return (value - limit if each.sense is Sense.MIN else limit - value) / (abs(limit) or 1.0)


def refuting_machine(case: Case, name: str, machine: MachineData) -> TextTable:
    """Return the errors of the joint centres of the machine that refutes a claim."""
    unit = case.units.length
    if machine.centres is not None:
        off = [(each.joint, ", ".join(f"{part:.6g}" for part in each.error)) for each in machine.centres]
        return TextTable(
            ("joint", f"off by\n{unit}"), tuple(off), name="machine", title=f"the machine that refutes: {name}"
        )
    rows = [
        (leg.name, *(", ".join(f"{part:.6g}" for part in each) for each in (base, platform)))
        for leg, base, platform in zip(case.model.legs, machine.base or (), machine.platform or (), strict=True)
    ]
    headers = ("leg", f"base joint off by\n{unit}", f"platform joint off by\n{unit}")
    return TextTable(headers, tuple(rows), name="machine", title=f"the machine that refutes: {name}")


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
    limited = [each for each in result.extremes if each.limit is not None]
    yield title_line(case)
    yield from verdict_lines(case, result)
    yield from _about_lines(case)
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


def _about_lines(case: Case) -> Iterator[Line]:
    """Yield the pose about which the workspace of a case with a fixed pose is."""
    if case.workspace is not None and case.workspace.about_pose:
        position, (angle, _) = [ends_of(value)[0] for value in case.position], ends_of(case.rotation.angle)
        words = ", ".join(number(each, max(map(abs, position)), digits=5) for each in position)
        turned = f", turned by {case.units.text(angle, Dimension.ANGLE)}" if angle else ""
        yield Line(f"the pose ({words}){turned}", label="about")


def outcome_lines(claims: Sequence[ExtremeData | PathClaimData]) -> Iterator[Line]:
    """Yield in one line each how many limits are proved, refuted and open, and which of them wholly."""
    every = Counter(map(_limit_of, claims))
    for outcome in _ORDER:
        counts = Counter(_limit_of(each) for each in claims if each.outcome is outcome)
        if not counts:
            continue
        texts = []
        for name, count in counts.items():
            size = every[name]
            share = f"{count} of {size}" if count < size else "the" if size == 1 else f"all {size}"
            texts.append(f"{share} {name}")
        words = f"{counted(counts.total(), 'limit')}: {', '.join(texts[:_GROUPS])}"
        words += f" and {len(texts) - _GROUPS} more kinds" if len(texts) > _GROUPS else ""
        yield Line(words, label=outcome.value, tone=TONES[outcome])


def _limit_of(claim: ExtremeData | PathClaimData) -> str:
    """Return the name of a claim's limit, the same for all limbs, joints and actuators."""
    return claim.name.partition(" ")[0].partition(".")[0]


def open_lines(claims: Sequence[ExtremeData | PathClaimData]) -> Iterator[Line]:
    """Yield the open claims with their reasons; the first ones belong to the answer."""
    found = [each for each in claims if each.outcome is Outcome.OPEN]
    for k, each in enumerate(found):
        reason = f": {each.reason}" if each.reason else ""
        yield Line(f"{each.name} {_limit_words(each)}{reason}", label="open", part="open claims" if k >= SHOWN else "")


def _limit_words(each: ExtremeData | PathClaimData) -> str:
    """Return the limit of a number with its sense and unit."""
    return f"{'>=' if each.sense is Sense.MIN else '<='} {number(each.limit or 0.0)} {each.unit}".rstrip()


def _machine_lines(case: Case, extremes: Sequence[ExtremeData]) -> Iterator[TextTable]:
    """Yield the machine of the first limit that is refuted by one within the tolerance."""
    for each in extremes:
        if each.outcome is Outcome.REFUTED and each.machine is not None:
            yield refuting_machine(case, each.name, each.machine)
            return


def proof_lines(proof: WorkspaceProofData | None) -> Iterator[Line]:
    """Yield the proof of a solved design over its workspace."""
    if proof is None:
        return
    if proof.proved:
        yield Line("proved: regular and within the limits at every pose", label="workspace", tone=Tone.ANSWER)
    else:
        count = proof.designs[-1].unproved
        words = f"not proved: {count} claim{'' if count == 1 else 's'} refuted or open"
        yield Line(words, label="workspace", tone=Tone.NO_ANSWER)
    yield from exchange_lines(proof, "workspace")


def exchange_lines(proof: WorkspaceProofData | PathProofData, where: str) -> Iterator[Line]:
    """Yield the designs of an exchange, and the number of its poses.

    Args:
        proof: of a solved design.
        where: of what the poses are.
    """
    steps = ", ".join(f"{each.F:.7g} ({each.unproved} refuted or open)" for each in proof.designs)
    yield Line(f"F = {steps}", label="designs")
    count = len(proof.poses)
    words = f"{count} pose{'' if count == 1 else 's'} of the {where} became constraints"
    tighter = count and proof.tighter
    after = f", tighter than the limits by {tighter:g} of the program's number" if tighter else ""
    yield Line(words, label="exchange", after=after)


def proof_tables(case: Case, proof: WorkspaceProofData) -> Iterator[TextTable]:
    """Yield the limits and numbers of a solved design over its workspace."""
    yield from _tables(case, proof.extremes)


def _tables(case: Case, extremes: Sequence[ExtremeData]) -> Iterator[TextTable]:
    """Yield the numbers with a limit, and those without."""
    limited = [each for each in extremes if each.limit is not None]
    others = [each for each in extremes if each.limit is None]
    titles = (("limits", "limits over every pose", limited), ("ranges", "numbers over every pose", others))
    for name, title, rows in titles:
        if rows:
            yield _table(case, name, title, rows)


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


def _table(case: Case, name: str, title: str, rows: list[ExtremeData]) -> TextTable:
    """Return a table of extremes."""
    cells = []
    for each in rows:
        worst = "smallest" if each.sense is Sense.MIN else "largest"
        known = [Line(each.outcome.value, tone=TONES[each.outcome], after=f": {each.reason}" if each.reason else "")]
        limit = [] if name == "ranges" else ["" if each.limit is None else number(each.limit)]
        cells.append(
            (
                each.name,
                each.unit,
                worst,
                *limit,
                "" if each.bound is None else number(each.bound),
                "" if each.reached is None else number(each.reached),
                *known,
                "" if each.pose is None else pose_words(case, each.pose),
            )
        )
    limits = () if name == "ranges" else ("limit",)
    headers = ("number", "unit", "value", *limits, "proven bound", "reached", "outcome", "at")
    return TextTable(headers, tuple(cells), name=name, title=title)


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

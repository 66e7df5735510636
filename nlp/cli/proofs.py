"""Proofs about robots in the commands ``workspace``, ``path`` and ``verify-proof``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from .commandline import print_notice

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.pose import Value
    from ..path.options import PathOptions
    from ..path.path import ProgrammedPath
    from ..proof.checker.proof_file import PathPremises, Proof, Unproved
    from ..proof.checker.workspace.check import CheckedClaim, VerifiedWorkspace
    from ..proof.workspace.judgement import Judgement
    from ..proof.workspace.pose_settings import SettingsProof
    from ..proof.workspace.proof_record import ProofRecord
    from ..words.text import Line


def proof_record(target: str | None, json_file: str | None) -> ProofRecord | None:
    """Return an empty record of searches; None without a proof.

    Args:
        target: name of the proof file; ``-`` is standard output; None without a proof.
        json_file: name of the result file.

    Raises:
        InputError: both files are standard output.
    """
    from ..errors import InputError
    from ..proof.workspace.proof_record import ProofRecord

    if target is None:
        return None
    if target == "-" and json_file == "-":
        raise InputError("only one of --json - and --proof - can go to standard output")
    return ProofRecord()


def proof_text(
    target: str | None,
    judged: Judgement,
    record: ProofRecord | None,
    text: str,
    quantities: Sequence[str],
    leg_error: float,
) -> str | None:
    """Return the text of the proof file of verdicts; None without a proof.

    Claims without a proof are named in notices.

    Args:
        target: file name; ``-`` is standard output.
        judged: the verdicts.
        record: recorder of the searches; None without a proof.
        text: text of the case file.
        quantities: requested quantities.
        leg_error: largest error of a leg length.
    """
    from ..proof.workspace.proof_writer import proof_of

    if target is None or record is None:
        return None
    return _proof_file_text(target, proof_of(judged, record, text, quantities=quantities, leg_error=leg_error))


def path_premises(target: str | None, case: Case, along: str | None, choices: PathOptions) -> PathPremises | None:
    """Return the premises of a proof about a path; None without a proof.

    Args:
        target: name of the proof file; None without a proof.
        case: the case.
        along: file of the path; None for the file of the case.
        choices: options for reading the file.

    Raises:
        InputError: the file cannot be read, or is too long for a proof file.
    """
    from ..path.reader import text_of_path
    from ..proof.checker.workspace.path_premises import premises_of

    stated = case.path if along is None else None
    if target is None or (along is None and stated is None):
        return None
    file, name = (along, along) if stated is None else (stated.file, stated.name)
    return premises_of(case, file or "", text_of_path(name or ""), choices, of_case=stated is not None)


def path_proof_text(
    target: str | None,
    case: Case,
    judged: Judgement,
    record: ProofRecord | None,
    text: str,
    premises: PathPremises | None,
) -> str | None:
    """Return the text of the proof file of verdicts along a path; see :func:`proof_text`.

    Args:
        target: file name; ``-`` is standard output.
        case: the case.
        judged: the verdicts.
        record: recorder of the searches; None without a proof.
        text: text of the case file.
        premises: premises about the path.
    """
    from ..proof.workspace.path_proof_writer import path_proof_of

    if target is None or record is None or premises is None:
        return None
    return _proof_file_text(target, path_proof_of(case, judged, record, text, premises))


def settings_proof_text(target: str | None, found: SettingsProof, text: str) -> str | None:
    """Return the text of the proof file of settings for every pose; see :func:`proof_text`.

    Args:
        target: file name; ``-`` is standard output.
        found: the verdict.
        text: text of the case file.
    """
    from ..proof.workspace.settings_proof_writer import settings_proof_of

    return None if target is None else _proof_file_text(target, settings_proof_of(found, text))


def _proof_file_text(target: str, proof: Proof) -> str | None:
    """Return the text of a proof file, and print a notice for each claim without a proof; None without any proof."""
    from ..errors import one_line

    if not proof.claims:
        # The file of an earlier run stays: an empty file would look like a proof of this run.
        print_notice(f"--proof {one_line(target)}: not written, as no claim has a proof")
        return None
    for words in _unproved_words(proof.unproved):
        print_notice(one_line(words))
    return proof.as_text()


def verified_lines(proof: Proof, case: Case, leg_error: float) -> Iterator[Line]:
    """Check the proof of a workspace, and return lines with the proved claims.

    Raises:
        Exit: with status 1 where the proof does not hold.
    """
    from ..proof.checker.proof_file import ProofError
    from ..proof.checker.workspace.check import check_workspace_proof
    from ..proof.checker.workspace.settings_check import check_settings_proof

    if case.has_any_settings and leg_error:
        from ..errors import InputError

        raise InputError('--leg-error: is not supported with settings = "any"')
    try:
        checked = (
            check_settings_proof(proof, case)
            if case.has_any_settings
            else check_workspace_proof(proof, case, leg_error=leg_error)
        )
    except ProofError as error:
        print_notice(f"rejected: {error}")
        raise SystemExit(1) from None
    premises = list(_premises(case, checked))
    return _checked_lines(proof, checked, case, leg_error, f"the workspace of {case.name}", premises)


def verified_path_lines(proof: Proof, premises: PathPremises, case: Case) -> Iterator[Line]:
    """Check the proof of a path, and return lines with the proved claims.

    Raises:
        Exit: with status 1 where the proof does not hold.
    """
    from ..proof.checker.proof_file import ProofError
    from ..proof.checker.workspace.check import check_path_proof
    from ..proof.checker.workspace.path_premises import carried_path

    try:
        path = carried_path(case, premises)
        checked = check_path_proof(proof, case, path)
    except ProofError as error:
        print_notice(f"rejected: {error}")
        raise SystemExit(1) from None
    subject = f"the path {premises.file} of {case.name}"
    notes = [_untimed_note(len(path.untimed), len(path))] if path.is_timed and path.untimed.size else []
    return _checked_lines(proof, checked, case, 0.0, subject, list(_path_premises(premises, path, case)), notes)


def _checked_lines(
    proof: Proof,
    checked: VerifiedWorkspace,
    case: Case,
    leg_error: float,
    whose: str,
    premises: Sequence[str],
    notes: Sequence[str] = (),
) -> Iterator[Line]:
    """Yield the result of a check: counts, notes, claims without a proof, then every premise and claim."""
    from ..proof.checker.premises import exact
    from ..proof.statement.claims import ERRORS
    from ..words.text import Line
    from ..words.verdicts import SHOWN

    count = len(checked.claims) + len(proof.unproved)
    if case.joint_centre_tolerance:
        off = f"{exact(case.joint_centre_tolerance)} {case.units.length}"
        whose += f", for every robot whose joint centres are off by at most {off}"
    counts = f"{len(checked.claims)} of {count} claims"
    if proof.unproved:
        yield Line(f"PROOF VALID for {counts}; {_outcome_counts(proof.unproved)}")
        yield Line(f"the claims are about {whose}")
    else:
        yield Line(f"PROOF VALID: {counts} about {whose}")
    yield from map(Line, notes)
    yield Line(f"{checked.leaves:,} leaves of the proof trees, checked on {checked.pieces:,} boxes")
    # A short view shows the lines of parts last, so that nothing stands between the claims without a proof.
    if proof.unproved:
        yield Line("the reasons in the file for claims without a proof are not checked")
    for k, words in enumerate(_unproved_words(proof.unproved)):
        yield Line(words, part="claims without a proof" if k >= SHOWN else "")
    for line in premises:
        yield Line(f"  {line}", part="premises")
    legs = f"off by at most {exact(leg_error)} {case.units.length}" if leg_error else "exact"
    for each in checked.claims:
        of = f", for leg lengths that are {legs}" if any(each.name == error.name for error in ERRORS) else ""
        yield Line(f"  {each.name}: {_words(each, case)}{of}", part="claims")


def _premises(case: Case, checked: VerifiedWorkspace) -> Iterator[str]:
    """Yield the poses, the tasks and the assembly modes that the claims cover."""
    from ...models import Dimension
    from ..case.pose import Free
    from ..proof.checker.premises import exact

    def span(value: Value, dimension: Dimension) -> str:
        ends = (value.lower, value.upper) if isinstance(value, Free) else (value,)
        return " to ".join(exact(case.units.shown(each, dimension)) for each in ends)

    workspace = checked.workspace
    turns, length, angle = workspace.turns, Dimension.LENGTH, Dimension.ANGLE
    about = f" {' '.join(map(exact, turns.axis))}" if turns.kind.value == "axis" else ""
    position = ", ".join(f"{name} {span(each, length)}" for name, each in zip("xyz", workspace.position, strict=True))
    rotation = ", ".join(span(each, angle) for each in turns.angles)
    if workspace.position_set is not None and not workspace.dependent:
        chosen = workspace.set_words(case.units, exact)
        turned = f"rotation by {turns.kind.value}{about}: {rotation} {case.units.label(angle)}"
        yield f"poses: every {chosen}; {turned}"
    elif workspace.dependent:
        chosen, names = workspace.set_words(case.units, exact), workspace.names
        following = ", ".join(names[each.index] for each in workspace.dependent)
        yield f"poses: every {chosen}; dependent: {following}"
    else:
        yield (
            f"poses: {position} {case.units.label(length)}; rotation by {turns.kind.value}{about}: {rotation} "
            f"{case.units.label(angle)}"
        )
    if case.has_any_settings:
        yield f"settings: {', '.join(_setting_words(case))}, reset at a standstill"
    for task in () if case.has_any_settings else case.tasks:
        yield f"{'F' if len(case.tasks) == 1 else f'F of {task.name}'}: of the task {task.name!r}"
    if checked.numbers_at:
        # The boxes of actuators' loads follow the loops from the middle, as those of ranks do.
        followed = "ranks, forces, speeds and powers" if case.loading.cases or case.loading.motion else "ranks"
        others = "quantities" if followed == "ranks" else "other quantities"
        middle = "the home assembly mode at the workspace centre"
        yield f"assembly modes: {followed} in {middle}, {others} in {checked.numbers_at}"


def _setting_words(case: Case) -> Iterator[str]:
    """Yield the range of each setting of which any value may do at a pose."""
    from ..proof.checker.premises import exact
    from ..proof.statement.chosen_settings import ranges_of_settings

    kinds = {name: item.dimension for item in case.model.parameters for name in item.components}
    for name, value in ranges_of_settings(case).items():
        low, high = (exact(case.units.shown(end, kinds[name])) for end in (value.lower, value.upper))
        yield f"{case.parameter_name(name)} {low} to {high} {case.units.label(kinds[name])}".rstrip()


def _path_premises(premises: PathPremises, path: ProgrammedPath, case: Case) -> Iterator[str]:
    """Yield the path, the options for reading its file, and the assembly mode that the claims cover."""
    from ..proof.checker.premises import exact

    arcs = len(path.arc_segments)
    with_arcs = f", {arcs:,} of them arc{'s' * (arcs > 1)}" if arcs else ""
    placed = ", placed as in the case" if premises.of_case else ""
    yield f"path: {premises.file}, {len(path):,} segment{'s' * (len(path) > 1)}{with_arcs}{placed}"
    choices = {"angles": premises.angles, "between": path.between.value, "unit before G20 or G21": premises.unit}
    choices |= {name: ", ".join(map(exact, each)) for name, each in premises.offsets.items()}
    if premises.flavour != "linuxcnc":
        choices |= {"flavour": premises.flavour, "part": None if premises.part is None else str(premises.part)}
    choices |= {
        "macros": ", ".join(premises.macros) or None,
        "end": "end of the file" if premises.end_of_file else None,
    }
    if premises.start is not None:
        choices["start"] = ", ".join(map(exact, premises.start))
    yield f"read with: {'; '.join(f'{name} {each}' for name, each in choices.items() if each is not None)}"
    if path.is_timed:
        yield "speeds and powers: in the motion of the path"
    if case.model.unknowns:
        yield "assembly mode: home at the first point, followed along the path"


def _untimed_note(untimed: int, segments: int) -> str:
    """Return the note on speeds along segments without a time."""
    verb = "has" if untimed == 1 else "have"
    return f"{untimed:,} of {segments:,} segments {verb} no time: speeds and powers there count as 0"


def _words(claim: CheckedClaim, case: Case) -> str:
    """Return the proved statement of a claim."""
    from ..proof.checker.premises import outward
    from ..proof.statement.chosen_settings import SETTINGS
    from ..proof.statement.claims import CONSTRAINTS
    from ..results.objective import unit_of_claim

    if claim.is_within_tolerance:
        return "refuted: at the stated pose J is singular for a robot within the tolerance"
    if claim.is_refuted:
        return "refuted: J is singular at a pose between both stated poses"
    if claim.name == SETTINGS:
        return "every pose has a value of each setting that satisfies all limits, without a singularity"
    if claim.bound is None:
        whose = "the constraint wrenches keep their" if claim.name == CONSTRAINTS else "J has full"
        return f"{whose} rank at every pose"
    is_most = claim.sense != "min"
    bound = outward(case.units.shown(claim.bound, claim.dimension), up=is_most)
    text = f"{'at most' if is_most else 'at least'} {bound} {unit_of_claim(case, claim.name, claim.dimension)}".rstrip()
    if claim.limit is None:
        return text
    return f"{text}, within the limit {case.units.shown(claim.limit, claim.dimension):.10g}"


def _outcome_counts(unproved: Sequence[Unproved]) -> str:
    """Return the numbers of claims without a proof, by the outcome that the file states."""
    from collections import Counter

    from ..proof.workspace.verdict import Outcome

    words = {Outcome.REFUTED.value: "refuted", Outcome.OPEN.value: "undecided"}
    counts = Counter(words.get(each.reason.partition(":")[0], "without a proof") for each in unproved)
    return ", ".join(f"{counts[each]} {each}" for each in (*words.values(), "without a proof") if counts[each])


def _unproved_words(unproved: Sequence[Unproved]) -> Iterator[str]:
    """Yield the claims without a proof, with the reasons."""
    for each in unproved:
        yield f"no proof: {f'{each.name} {each.sense}'.strip()}: {each.reason}"

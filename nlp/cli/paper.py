"""Proofs of workspaces in the commands ``workspace`` and ``verify-proof``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from ..case.case import Case
    from ..workspace.judge import Judgement
    from ..workspace.paper.check import CheckedClaim
    from ..workspace.paper.document import PaperProof, Unproved
    from ..workspace.paper.record import PaperRecord


def paper_record(target: str | None, json_file: str | None) -> PaperRecord | None:
    """Return an empty record of searches; None without a proof.

    Args:
        target: name of the proof's file; ``-`` is standard output; None without a proof.
        json_file: name of the result's file.

    Raises:
        InputError: both are standard output.
    """
    from ..errors import InputError
    from ..workspace.paper.record import PaperRecord

    if target is None:
        return None
    if target == "-" and json_file == "-":
        raise InputError("standard output can take one of --json - and --proof - only")
    return PaperRecord()


def write_paper(
    target: str, judged: Judgement, record: PaperRecord | None, text: str, quantities: Sequence[str], leg_error: float
) -> None:
    """Write the proof of a judgement, and say what has none.

    Args:
        target: file name; ``-`` is standard output.
        judged: the verdicts.
        record: of the searches that led to them; without one nothing is written.
        text: the case file's text.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
    """
    from ..errors import one_line
    from ..output.files import write_text
    from ..workspace.paper.written import paper_of

    if record is None:
        return
    proof = paper_of(judged, record, text, quantities=quantities, leg_error=leg_error)
    if not proof.claims:
        # A file of an earlier run is left as it is: it must not be taken for the proof of this one.
        typer.echo(f"--proof {one_line(target)}: not written, as no claim has a proof", err=True)
        return
    write_text(target, proof.as_text())
    _echo_unproved(proof.unproved, err=True)


def verify_paper(proof: PaperProof, case: Case) -> None:
    """Check the proof of a workspace and say what it proves.

    Raises:
        Exit: with status 1 where the proof does not hold.
    """
    from ...models import Dimension
    from ..certificate.paper.proof import ProofError
    from ..errors import one_line
    from ..workspace.paper.check import check_paper

    try:
        checked = check_paper(proof, case)
    except ProofError as error:
        typer.echo(f"rejected: {error}", err=True)
        raise typer.Exit(1) from None
    count = len(checked.claims) + len(checked.unproved)
    whose = ""
    if proof.tolerance:
        off = (
            f"{case.units.shown(proof.tolerance, Dimension.LENGTH):.10g} {case.units.label(Dimension.LENGTH)}".rstrip()
        )
        whose = f", for every machine whose joint centres are off by at most {off}"
    typer.echo(f"holds: {len(checked.claims)} of {count} claims about the workspace of {one_line(case.name)}{whose}")
    for each in checked.claims:
        typer.echo(f"  {one_line(each.name)}: {_words(each, case)}")
    _echo_unproved(checked.unproved, err=False)
    typer.echo(f"{checked.leaves:,} leaves, shown on {checked.pieces:,} boxes")


def _words(claim: CheckedClaim, case: Case) -> str:
    """Return what is shown of a claim."""
    from ..workspace.claims import CONSTRAINTS

    if claim.by_machine:
        return "refuted, at the pose given J is singular for a machine within the tolerance"
    if claim.is_refuted:
        return "refuted, J is singular at a pose between the two given"
    if claim.bound is None:
        whose = "the constraint wrenches keep their" if claim.name == CONSTRAINTS else "J has full"
        return f"{whose} rank at every pose"
    side = "at least" if claim.sense == "min" else "at most"
    text = f"{side} {case.units.shown(claim.bound, claim.dimension):.10g} {case.units.label(claim.dimension)}".rstrip()
    if claim.limit is None:
        return text
    return f"{text}, within the limit {case.units.shown(claim.limit, claim.dimension):.10g}"


def _echo_unproved(unproved: Sequence[Unproved], *, err: bool) -> None:
    """Say which claims have no proof."""
    from ..errors import one_line

    for each in unproved:
        name = f"{each.name} {each.sense}".strip()
        typer.echo(f"not on paper: {one_line(name)}: {one_line(each.reason)}", err=err)

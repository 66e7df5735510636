"""The command ``verify-proof``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..case.case import Case


def verify_proof(
    proof: Annotated[
        str, typer.Argument(metavar="PROOF", help="A proof that certify --proof or workspace --proof wrote.")
    ],
    case: Annotated[
        str | None, typer.Argument(metavar="[CASE]", help="The case that it must be for; else the one it carries.")
    ] = None,
) -> None:
    """Check a proof anew, with nothing of what made it."""
    from ..certificate.paper.proof import ProofError, read_proof
    from ..certificate.paper.proofcheck import check_proof
    from ..errors import one_line
    from ..output.files import read_text
    from ..solver.certified import program_of
    from ..workspace.paper.document import is_paper, read_paper

    text = read_text(proof)
    if is_paper(text):
        from .paper import verify_paper

        paper = read_paper(text, proof)
        verify_paper(paper, _case_of(paper.case, paper.name, proof, case))
        return
    given = read_proof(text, proof)
    loaded = _case_of(given.case, given.name, proof, case)
    nlp = program_of(loaded, given.statement)
    try:
        checked = check_proof(given, nlp)
    except ProofError as error:
        typer.echo(f"rejected: {error}", err=True)
        raise typer.Exit(1) from None
    what = "there is no feasible point"
    if given.bound is not None:
        what = f"F is at most {given.bound:.10g}" if nlp.sign < 0 else f"F is at least {-given.bound:.10g}"
    where = " in home's working mode" if given.statement.in_home_mode else ""
    typer.echo(f"holds: {what} within the limits of {one_line(loaded.name)}{where}")
    typer.echo(f"{checked.leaves:,} leaves, shown on {checked.pieces:,} boxes")


def _case_of(text: str, name: str, proof: str, case: str | None) -> Case:
    """Return the case of a file or name; without one, that of the text that a proof carries.

    Raises:
        ProofError: the text is no TOML.
    """
    import tomllib

    from ..case.reader import case_from_tables, load_case
    from ..certificate.paper.proof import ProofError

    if case is not None:
        return load_case(case)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProofError(f"{proof}: the case that it carries is no TOML: {error}") from None
    return case_from_tables(tables, name=name, source=proof)

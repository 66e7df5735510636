"""The command ``verify-proof``."""

from __future__ import annotations

from typing import Annotated

import typer


def verify_proof(
    proof: Annotated[str, typer.Argument(metavar="PROOF", help="A proof that certify --proof wrote.")],
    case: Annotated[
        str | None, typer.Argument(metavar="[CASE]", help="The case that it must be for; else the one it carries.")
    ] = None,
) -> None:
    """Check a proof anew, with nothing of what made it."""
    import tomllib

    from ..case.reader import case_from_tables, load_case
    from ..certificate.proof import ProofError, read_proof
    from ..certificate.proofcheck import check_proof
    from ..errors import one_line
    from ..output.files import read_text
    from ..solver.certified import program_of

    given = read_proof(read_text(proof), proof)
    if case is not None:
        loaded = load_case(case)
    else:
        try:
            tables = tomllib.loads(given.case)
        except tomllib.TOMLDecodeError as error:
            raise ProofError(f"{proof}: the case that it carries is no TOML: {error}") from None
        loaded = case_from_tables(tables, name=given.name, source=proof)
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

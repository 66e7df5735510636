"""The command ``verify-proof``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import options
from .commandline import Argument, print_notice

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..case.case import Case
    from ..proof.checker.proof_file import ProofClaim, Statement
    from ..results.text import Line


def verify_proof(
    proof: Annotated[str, Argument("PROOF", "A proof that certify --proof or workspace --proof wrote.")],
    case: Annotated[
        str | None,
        Argument("[CASE]", "The case to be proved, - is stdin; that in the proof if left out."),
    ] = None,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    above: Annotated[
        float | None, options.number("--above", "F", "The proof must show that F is above this value")
    ] = None,
    all_assemblies: options.AllAssemblies = False,
    leg_error: options.LegError = 0.0,
    whole: options.ShowAll = False,
) -> None:
    """Check a proof with independent code.

    The claims come from the case and from the options, which are those of the command that wrote the proof.
    """
    from .. import __version__
    from ..errors import InputError
    from ..proof.checker.proof_file import LARGEST_PROOF, Statement, read_proof
    from ..results.text import Line
    from ..system.reading import read_limited
    from .proofs import verified_lines

    is_given = {"--above": above is not None, "--all-assemblies": all_assemblies, "--leg-error": leg_error != 0}
    given = read_proof(read_limited(proof, LARGEST_PROOF), proof)
    foreign = ("--leg-error",) if isinstance(given.premises, Statement) else ("--above", "--all-assemblies")
    for name in foreign:
        if is_given[name]:
            raise InputError(f"{name}: means nothing for this proof, which another command wrote")
    if case is not None:
        loaded = options.read_machine(case, settings, of).file.case
    elif settings or of:
        raise InputError(f"{'--set' if settings else '--of'}: needs the CASE that it changes")
    else:
        loaded = _carried_case(given.case, given.name, proof)
    if isinstance(given.premises, Statement):
        lines: Iterable[Line] = _verify(given.premises, given.claims[0], loaded, above, all_assemblies=all_assemblies)
    else:
        lines = verified_lines(given, loaded, leg_error)
    whose = "the case is the one that the proof carries; " if case is None else ""
    first, *others = lines
    options.show([first, Line(f"{whose}checked by screwsynth {__version__}"), *others], whole=whole)


def _verify(
    statement: Statement, claim: ProofClaim, case: Case, above: float | None, *, all_assemblies: bool
) -> Iterable[Line]:
    """Check the proof of a certificate, and return the lines that say what it proves.

    Raises:
        Exit: with status 1 where the proof does not hold.
    """
    from ..proof.checker.check import check_proof
    from ..proof.checker.premises import claim_words, hold_statement, program_of, root_below
    from ..proof.checker.proof_file import ProofError
    from ..results.objective import unit_of_objective
    from ..results.text import Line

    try:
        hold_statement(case, statement, above=above, all_assemblies=all_assemblies)
        checked = check_proof(claim, program_of(case, statement))
        shown = root_below(-checked.bound) if case.tasks[0].measure else -checked.bound
        if above is not None and not shown > above:
            raise ProofError(f"the proof shows {shown:.10g}, which is not above {above:.10g}")
    except ProofError as error:
        print_notice(f"rejected: {error}")
        raise SystemExit(1) from None
    bound = None if claim.bound is None else checked.bound
    holds = Line(f"holds: {claim_words(case, statement, bound, unit_of_objective(case))}")
    return [holds, Line(f"{checked.leaves:,} leaves, shown on {checked.pieces:,} boxes")]


def _carried_case(text: str, name: str, proof: str) -> Case:
    """Return the case of the text that a proof carries.

    Raises:
        InputError: the text is no TOML, or no case.
    """
    from pathlib import Path

    from ..case.reader import case_from_tables
    from ..case.source import tables_of

    return case_from_tables(tables_of(Path(proof), text), name=name, source=proof)

"""Command ``verify-proof``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import options, pathoptions
from .commandline import Argument, print_notice

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..case.case import Case
    from ..proof.checker.proof_file import PathPremises, ProofClaim, Statement
    from ..words.text import Line


def verify_proof(
    proof: Annotated[str, Argument("PROOF", "Proof file of certify, workspace or path --proof.")],
    case: Annotated[
        str | None,
        Argument("[CASE]", "Case that the proof must prove, - is stdin; the case in the proof if left out."),
    ] = None,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    above: Annotated[
        float | None, options.number("--above", "F", "Require that the proof shows F above this value")
    ] = None,
    all_assemblies: options.AllAssemblies = False,
    leg_error: options.LegError = 0.0,
    along: pathoptions.AlongFile = None,
    unit: pathoptions.Unit = None,
    start: pathoptions.Stands = None,
    offset: pathoptions.Offsets = None,
    angles: pathoptions.Angles = None,
    between: pathoptions.BetweenPoints = None,
    flavour: pathoptions.Flavour = None,
    end_of_file: pathoptions.EndOfFile = False,
    part: pathoptions.Part = None,
    macro: pathoptions.Macros = None,
    whole: options.ShowAll = False,
) -> None:
    """Check a proof file with independent code.

    The claims are derived again from the case and the options: give the options of the command that wrote the proof.
    """
    from .. import __version__
    from ..errors import InputError, listing
    from ..proof.checker.proof_file import LARGEST_PROOF, PathPremises, Statement, read_proof
    from ..system.reading import read_limited
    from ..words.text import Line
    from .proofs import verified_lines, verified_path_lines

    of_path = {"--along": along, "--unit": unit, "--start": start, "--offset": offset} | {
        "--angles": angles,
        "--between": between,
        "--flavour": flavour,
        "--end-of-file": end_of_file or None,
        "--part": part,
        "--macro": macro,
    }
    is_given = {"--above": above is not None, "--all-assemblies": all_assemblies, "--leg-error": leg_error != 0}
    is_given |= {name: each not in (None, []) for name, each in of_path.items()}
    given = read_proof(read_limited(proof, LARGEST_PROOF), proof)
    own = (
        {"--above", "--all-assemblies"}
        if isinstance(given.premises, Statement)
        else set(of_path)
        if isinstance(given.premises, PathPremises)
        else {"--leg-error"}
    )
    for name in is_given:
        if is_given[name] and name not in own:
            raise InputError(f"{name}: does not apply to this kind of proof; allowed: {listing(sorted(own))}")
    if case is not None:
        loaded = options.read_changed_case(case, settings, of).file.case
    elif settings or of:
        raise InputError(f"{'--set' if settings else '--of'}: needs the argument CASE")
    else:
        loaded = _carried_case(given.case, given.name, proof)
    carried = ["case"] if case is None else []
    if isinstance(given.premises, Statement):
        lines: Iterable[Line] = _verify(given.premises, given.claims[0], loaded, above, all_assemblies=all_assemblies)
    elif isinstance(given.premises, PathPremises):
        choices = pathoptions.PathChoices(
            unit, start, offset or [], angles, between, flavour, end_of_file, part, macro or ()
        )
        if not _hold_path(given.premises, loaded, along, choices, is_own=case is not None):
            carried.append("path")
        lines = verified_path_lines(given, given.premises, loaded)
    else:
        lines = verified_lines(given, loaded, leg_error)
    whose = f"{' and '.join(carried)} read from the proof file; " if carried else ""
    first, *others = lines
    options.show([first, Line(f"{whose}checked by screwsynth {__version__}"), *others], whole=whole)


def _hold_path(
    given: PathPremises, case: Case, along: str | None, choices: pathoptions.PathChoices, *, is_own: bool
) -> bool:
    """Compare the path of a proof with the user's file; return whether there is such a file.

    Args:
        given: premises of the proof.
        case: the case.
        along: file of the path; None for the file of the case, or of the proof.
        choices: options for reading the file.
        is_own: If true, the case is the user's, not that of the proof.

    Raises:
        InputError: a file cannot be read, or options for reading are given without a file.
        Exit: with status 1 where the proof is for another path.
    """
    from ..errors import InputError
    from ..path.options import PathOptions
    from ..path.reader import options_of, text_of_path
    from ..proof.checker.proof_file import ProofError
    from ..proof.checker.workspace.path_premises import check_path_premises, premises_of

    stated = case.path if is_own and along is None and given.of_case else None
    if along is None and stated is None:
        if choices.is_any:
            raise InputError("--along: is missing: give the tool path to which the other options apply")
        return False
    own = choices.over(PathOptions() if stated is None else options_of(stated))
    file = along if stated is None else str(stated.name)
    try:
        text = text_of_path(file or "")
        check_path_premises(given, premises_of(case, file or "", text, own, of_case=stated is not None))
    except ProofError as error:
        print_notice(f"rejected: {error}")
        raise SystemExit(1) from None
    return True


def _verify(
    statement: Statement, claim: ProofClaim, case: Case, above: float | None, *, all_assemblies: bool
) -> Iterable[Line]:
    """Check the proof of a certificate, and return lines with the proved claim.

    Raises:
        Exit: with status 1 where the proof does not hold.
    """
    from ..proof.checker.check import check_proof
    from ..proof.checker.premises import check_statement, claim_words, program_of, root_below
    from ..proof.checker.proof_file import ProofError
    from ..results.objective import unit_of_objective
    from ..words.text import Line

    try:
        check_statement(case, statement, above=above, all_assemblies=all_assemblies)
        checked = check_proof(claim, program_of(case, statement))
        shown = root_below(-checked.bound) if case.tasks[0].measure else -checked.bound
        if above is not None and not shown > above:
            raise ProofError(
                f"the proof shows only F >= {shown:.10g}, but --above {above:.10g} needs a larger lower bound"
            )
    except ProofError as error:
        print_notice(f"rejected: {error}")
        raise SystemExit(1) from None
    bound = None if claim.bound is None else checked.bound
    holds = Line(f"PROOF VALID: {claim_words(case, statement, bound, unit_of_objective(case))}")
    return [holds, Line(f"{checked.leaves:,} leaves of the proof tree, checked on {checked.pieces:,} boxes")]


def _carried_case(text: str, name: str, proof: str) -> Case:
    """Return the case of the text in a proof file.

    Raises:
        InputError: the text is no TOML, or no case.
    """
    from pathlib import Path

    from ..case.reader import case_from_tables
    from ..case.source import tables_of

    return case_from_tables(tables_of(Path(proof), text), name=name, source=proof)

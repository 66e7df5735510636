"""Premises of a proof about a path: the text of the path's file, with the reading options that the file leaves open."""

from __future__ import annotations

from ....case.case import Case
from ....errors import CaseError, InputError
from ....path.options import PathOptions
from ....path.path import ProgrammedPath
from ....path.reader import in_place_of_case, is_table, path_of_text
from ....path.settings import changing_of
from ...statement.fixed_robot import legs_of
from ..proof_file import LARGEST_CASE, PathPremises, ProofError
from .statement import legs_premise

#: Command options by the name of the premise that they set.
_OPTIONS = {
    "between": "--between",
    "angles": "--angles",
    "unit": "--unit",
    "start": "--start",
    "offsets": "--offset",
    "flavour": "--flavour",
    "end_of_file": "--end-of-file",
    "part": "--part",
    "macros": "--macro",
}


def premises_of(
    case: Case, file: str, text: str, options: PathOptions, *, of_case: bool, with_angles: bool = True
) -> PathPremises:
    """Return the premises of a proof about a path.

    Args:
        case: case with fixed dimensions.
        file: name of the path's file.
        text: text of the file.
        options: options of reading that the file leaves open.
        of_case: If true, the path is that of the case.
        with_angles: If true, closed forms replace joint angles.

    Raises:
        ProofError: the text is longer than a checker accepts.
    """
    if len(text) > LARGEST_CASE:
        raise ProofError(f"{file}: has {len(text):,} characters; a proof carries at most {LARGEST_CASE:,}")
    return PathPremises(
        file=file,
        text=text,
        of_case=of_case,
        between=None if options.between is None else options.between.value,
        angles=options.angles,
        unit=options.unit,
        start=None if options.start is None else tuple(map(float, options.start)),
        offsets={name: tuple(map(float, origin)) for name, origin in options.offsets.items()},
        legs=legs_premise(legs_of(case)),
        joint_centre=case.joint_centre_tolerance or 0.0,
        with_angles=with_angles,
        flavour=options.flavour,
        end_of_file=options.end_of_file,
        part=options.part,
        macros=tuple(name.upper() for name in options.macros),
    )


def carried_path(case: Case, given: PathPremises) -> ProgrammedPath:
    """Return the path from the text and the reading options in a proof.

    Raises:
        ProofError: the proof has no readable path, or the case has no path.
    """
    try:
        path = path_of_text(given.text, given.file, case.units, PathOptions.stated_in(given), changing_of(case))
    except (InputError, ValueError) as error:
        raise ProofError(f"the path in the proof cannot be read: {error}") from None
    if not given.of_case:
        return path
    if case.path is None:
        raise ProofError("the proof is for the tool path of its case, but this case has no table [path]")
    try:
        return in_place_of_case(path, case)
    except CaseError as error:
        raise ProofError(str(error)) from None


def check_path_premises(given: PathPremises, own: PathPremises) -> None:
    """Refuse a proof with a path or reading options (``given``) that differ from the requested ones (``own``)."""
    if given.of_case != own.of_case:
        whose = (
            "the tool path of its case: leave out --along"
            if given.of_case
            else "a tool path that is not in its case: give this path with --along"
        )
        raise ProofError(f"the proof is for {whose}")
    if given.text != own.text or is_table(given.file) != is_table(own.file):
        raise ProofError(f"the proof is for another tool path than that in {own.file}")
    for option, name in _OPTIONS.items():
        stated, requested = getattr(given, option), getattr(own, option)
        if stated != requested:
            raise ProofError(f"the path of the proof was read with another value of {name}")

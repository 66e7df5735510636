"""Premises of a proof about a path: its file's text, with the choices that the file leaves open."""

from __future__ import annotations

from ....case.case import Case
from ....errors import CaseError, InputError
from ....path.options import Between, PathOptions
from ....path.path import ProgrammedPath
from ....path.reader import in_place_of_case, is_table, path_of_text
from ...statement.machine import legs_of
from ..proof_file import LARGEST_CASE, PathPremises, ProofError
from .statement import legs_numbers

#: Options of the command by the choices that they state.
_OPTIONS = {
    "between": "--between",
    "angles": "--angles",
    "unit": "--unit",
    "start": "--start",
    "offsets": "--offset",
}


def premises_of(
    case: Case, file: str, text: str, options: PathOptions, *, of_case: bool, with_angles: bool = True
) -> PathPremises:
    """Return the premises of a proof about a path.

    Args:
        case: with fixed dimensions.
        file: name of the path's file.
        text: text of the file.
        options: choices that the file leaves open.
        of_case: whether the path is that of the case, in its place.
        with_angles: whether angles of joints are replaced by closed forms.

    Raises:
        ProofError: the text is longer than one that is read.
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
        legs=legs_numbers(legs_of(case)),
        joint_centre=case.joint_centre_tolerance or 0.0,
        with_angles=with_angles,
    )


def carried_path(case: Case, given: PathPremises) -> ProgrammedPath:
    """Return the path that a proof carries.

    Raises:
        ProofError: it carries none, or none of the case.
    """
    try:
        between = None if given.between is None else Between(given.between)
        options = PathOptions(between, given.angles, given.unit, given.start, given.offsets)
        path = path_of_text(given.text, given.file, case.units, options)
    except (InputError, ValueError) as error:
        raise ProofError(f"the path that the proof carries cannot be read: {error}") from None
    if not given.of_case:
        return path
    if case.path is None:
        raise ProofError("the proof is for the path of its case, and this case has none")
    try:
        return in_place_of_case(path, case)
    except CaseError as error:
        raise ProofError(str(error)) from None


def hold_path(given: PathPremises, own: PathPremises) -> None:
    """Refuse a proof about another path, or one that is read in another way, than the user's own."""
    if given.of_case != own.of_case:
        whose = "the path of its case" if given.of_case else "a path that was given beside the case"
        raise ProofError(f"the proof is for {whose}: see --along")
    if given.text != own.text or is_table(given.file) != is_table(own.file):
        raise ProofError(f"the proof is for another path than that of {own.file}")
    for option, name in _OPTIONS.items():
        stated, meant = getattr(given, option), getattr(own, option)
        if stated != meant:
            raise ProofError(f"the proof is for a path that is read with other options: see {name}")

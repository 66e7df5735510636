"""Dimensions of a robot from a result, as settings of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..case.overrides import Settings
    from ..case.reader import CaseFile


class Machine(NamedTuple):
    """A case as it was read, and the numbers that replace those of its file."""

    file: CaseFile
    settings: Settings


def read_machine(name: str, settings: Settings, of: str | None) -> Machine:
    """Read a case with the dimensions of a result of it.

    Args:
        name: of the case.
        settings: numbers that replace those of the file, and of the result.
        of: file of the result; None without one.

    Raises:
        InputError: a file cannot be read or holds a fault, or the result is no answer of the case.
    """
    from ..case.reader import read_case
    from ..results.reading import load_result
    from ..results.settings import dimensions_of, robot_of

    if of is None:
        return Machine(read_case(name, settings), settings)
    case = read_case(name).case
    chosen = {**dimensions_of(robot_of(load_result(of), f"--of {of}", case), case), **settings}
    return Machine(read_case(name, chosen), chosen)

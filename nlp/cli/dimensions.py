"""Dimensions of a robot from a result, as settings of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import typer

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
        InputError: a file cannot be read or holds a fault, or the result is no answer for this robot in these units.
    """
    from ..case.reader import read_case
    from ..errors import one_line
    from ..results.settings import dimensions_of, load_answer, robot_of

    if of is None:
        return Machine(read_case(name, settings), settings)
    case, result = read_case(name).case, load_answer(of)
    chosen = {**dimensions_of(robot_of(result, f"--of {of}", case, of_any_case=True), case), **settings}
    if result.head.case != case.name:
        typer.echo(f"--of {one_line(of)}: has the dimensions of the case {one_line(result.head.case)!r}", err=True)
    return Machine(read_case(name, chosen), chosen)

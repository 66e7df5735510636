"""Robots of a comparison, by name, by robot file, or as models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...models import Model, model_names
from ..case.case import Case
from ..case.robotfile import model_of_definition, read_definition
from ..case.robots import build_model
from ..errors import CaseError, InputError, nearest

#: Stands for the case's own robot, which takes part as the case states it.
OWN = "case"


@dataclass(frozen=True, eq=False)
class Contender:
    """A robot that takes part in a comparison.

    Attributes:
        label: name in tables: that of the robot, or of its file.
        model: the robot; the case's own for ``case``.
        is_own: whether it takes part as the case states it.
        file: the robot file; None for a robot by name.
    """

    label: str
    model: Model
    is_own: bool = False
    file: Path | None = None


def read_robots(robots: Sequence[str | Path | Model], case: Case) -> list[Contender]:
    """Return the robots of a comparison.

    Args:
        robots: names of robots, paths of robot files, models, or the word ``case`` for the case's own robot.
        case: the case.

    Raises:
        InputError: there are fewer than two robots, one is not found or given twice, or a robot file holds a fault.
    """
    if len(robots) < 2:
        raise InputError(f"compare: needs at least two robots, and {len(robots)} is given")
    found: list[Contender] = []
    for each in robots:
        contender = _read(each, case)
        for other in found:
            if contender.model is other.model or _is_same_file(contender, other):
                raise InputError(f"compare: {each if isinstance(each, str) else contender.label} is given twice")
            if contender.label == other.label:
                fault = "two robots have this name in tables: rename a file"
                raise InputError(f"compare: {contender.label}: {fault}")
        found.append(contender)
    return found


def _read(given: str | Path | Model, case: Case) -> Contender:
    """Return one robot; the errors are those of :func:`read_robots`."""
    if isinstance(given, Model):
        return Contender(given.name, given)
    text = str(given)
    if text == OWN:
        return Contender(OWN, case.model, is_own=True)
    names = model_names()
    if text in names:
        return Contender(text, build_model(text))
    path = Path(text)
    if path.is_file():
        try:
            return Contender(path.stem, model_of_definition(read_definition(text, Path()), text), file=path.resolve())
        except CaseError as error:
            raise (error if error.source else error.within(text)) from None
    hint = nearest(text, [*names, OWN])
    raise InputError(f"compare: {text or 'an empty name'}: no such robot, and no such robot file; {hint}")


def _is_same_file(one: Contender, other: Contender) -> bool:
    return one.file is not None and one.file == other.file

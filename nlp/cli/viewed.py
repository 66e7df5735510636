"""Case of the command ``view``: that of a file, or the starter case of a robot."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..case.overrides import Settings
    from ..case.reader import CaseFile


class Viewed(NamedTuple):
    """Case with its text, and whether it is solved: a robot without a case is shown at home."""

    file: CaseFile
    is_solved: bool


def read_viewed(name: str, settings: Settings) -> Viewed:
    """Read a case, or make the starter case of a robot by name or of a robot file.

    Args:
        name: path of a case or robot file, or name of a shipped case or of a robot.
        settings: values by name that replace those of the case.

    Raises:
        InputError: the file cannot be read, or has an error.
    """
    from ...models import model_names
    from ..case.reader import CaseFile, case_from_tables, is_robot_file, read_case
    from ..case.robots import build_model
    from ..case.source import find_case, inputs_of, read_text, shipped_cases, tables_of
    from ..starter.text import starter_case
    from .options import read_robot

    if name in model_names() and name not in shipped_cases() and not Path(name).exists():
        text = starter_case(build_model(name))
        case = case_from_tables(tomllib.loads(text), name=name, source=name, settings=settings)
        return Viewed(CaseFile(replace(case, title=f"Robot {name}"), text, {}), is_solved=False)
    path = find_case(name)
    tables = tables_of(path, read_text(path))
    if not is_robot_file(tables):
        return Viewed(read_case(name, settings), is_solved=True)
    text = starter_case(read_robot(name), path.name)
    case = case_from_tables(
        tomllib.loads(text), name=path.stem, source=path.name, settings=settings, folder=path.parent
    )
    titled = replace(case, title=f"Robot {path.stem}")
    return Viewed(CaseFile(titled, text, inputs_of(path, tables)), is_solved=False)

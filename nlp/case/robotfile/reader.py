"""Reader of robot files, which a case names by ``[robot] file = "my-robot.toml"``, beside its own file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ....models import Model, ModelError, robot
from ....models.joints import RobotError
from ...errors import CaseError
from .schema import check_form

#: Largest robot file, bytes: a hundred times the largest that a person writes.
_LARGEST_FILE = 2**20


def insert_robot(tables: dict[str, Any], folder: Path) -> str:
    """Put the robot file that a case names in the place of its name, and return this name.

    Args:
        tables: the case, as ``tomllib`` returns it; ``file`` of its table ``robot`` becomes ``definition``.
        folder: folder of the case, beside which the file is.

    Raises:
        CaseError: the file cannot be read, holds a fault, or stands beside a robot that is given in another way.
    """
    table = tables["robot"]
    name = table["file"]
    if not isinstance(name, str) or not name:
        raise CaseError("robot.file", "must be the name of a robot file")
    for other in ("model", "definition"):
        if other in table:
            raise CaseError(f"robot.{other}", "cannot stand beside file: give the robot in one way")
    definition = read_definition(name, folder)
    tables["robot"] = {"definition": definition, **{key: value for key, value in table.items() if key != "file"}}
    return name


def read_definition(name: str, folder: Path) -> dict[str, Any]:
    """Return the tables of a robot file, with their form checked.

    Args:
        name: path of the file.
        folder: folder from which a relative path begins.

    Raises:
        CaseError: the file cannot be read, or holds a fault.
    """
    path = folder / name
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CaseError("robot.file", f"cannot be read: {reason}", name) from None
    if len(content) > _LARGEST_FILE:
        raise CaseError("robot.file", f"cannot be read: it is larger than {_LARGEST_FILE // 2**20} MB", name)
    try:
        tables = tomllib.loads(content.decode("utf-8-sig").replace("\r\n", "\n"))
    except (ValueError, RecursionError) as error:
        raise CaseError("the file", f"is not valid TOML: {error}", source=name) from None
    try:
        check_form(tables)
    except CaseError as error:
        raise error.within(name) from None
    return tables


def model_of_definition(definition: Mapping[str, Any], source: str | None = None) -> Model:
    """Return the robot of a definition.

    Args:
        definition: tables of a robot file.
        source: name of the file, for messages; None for a definition within a case.

    Raises:
        CaseError: the definition holds a fault.
    """
    prefix = "" if source else "robot.definition: "
    try:
        if source is None:
            check_form(dict(definition))
        return robot(**definition)
    except CaseError as error:
        raise CaseError(f"{prefix}{error.key}", error.fault, error.value) from None
    except RobotError as error:
        raise CaseError(f"{prefix}{error.place or 'the robot'}", error.fault, source=source) from None
    except ModelError as error:
        raise CaseError(f"{prefix}the robot", str(error), source=source) from None

"""Robot files, which a case names by ``[robot] file = "my-robot.toml"``, beside its own file: their schema and reader.

The classes check keys and types, of tables and keys as :func:`screwsynth.models.robot` takes them. Everything else is
checked where the robot is built.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, FiniteFloat, StringConstraints, Tag, ValidationError
from pydantic_core import ErrorDetails

from ...models import Model, ModelError, robot
from ...models.fileversions import ROBOT_FILES, VERSION_KEY
from ...models.joints import RobotError
from ...models.joints.written.words import GRAPH_KEYS, MOST_LIMBS, NESTED_BRANCH
from ..errors import CaseError, InputError
from ..system.reading import check_version, read_limited
from ..system.slips import toml_fault
from .table import Table, Vector, case_error, empty_list

Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Expression = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[Name, Tag("<word>")],
    Discriminator(lambda value: "<word>" if isinstance(value, str) else "<number>"),
]
VectorExpression = Annotated[
    Annotated[Name, Tag("<word>")] | Annotated[list[Expression], Field(min_length=3, max_length=3), Tag("<list>")],
    Discriminator(lambda value: "<list>" if isinstance(value, list) else "<word>"),
]


class DimensionTable(Table):
    """A dimension that a case fixes or frees."""

    typical: FiniteFloat = Field(description="a sensible value; degrees for an angle")
    kind: Literal["length", "angle", "number"] = Field(default="length", description="kind of number")
    description: str = Field(default="", description="a few words")


class RepeatTable(Table):
    """Copies of a limb by rotation about an axis."""

    count: Annotated[int, Field(ge=1, le=MOST_LIMBS)] | None = Field(
        default=None, description="number of copies, evenly spread"
    )
    angles: Annotated[list[FiniteFloat], Field(min_length=1, max_length=MOST_LIMBS)] | None = Field(
        default=None, description="angle of each copy, degrees"
    )
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="direction of the axis")
    through: Vector = Field(default=[0.0, 0.0, 0.0], description="point of the axis")


class JointTable(Table):
    """A joint of a limb, at home."""

    type: Literal["R", "P", "H", "C", "U", "S", "Pa"] = Field(description="its kind")
    name: Name | None = Field(default=None, description="its name, by which limits mean this joint of every limb")
    at: VectorExpression = Field(description="its centre, or a point of its axis")
    axis: VectorExpression | None = Field(default=None, description="direction of its axis")
    axes: Annotated[list[VectorExpression], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="axes of a U, the base side first"
    )
    pitch: Expression | None = Field(default=None, description="way per radian of an H")
    to: VectorExpression | None = Field(default=None, description="far end of a parallelogram's rod")
    actuated: bool | None = Field(default=None, description="whether an actuator drives it")


class BranchTable(Table):
    """One of several paths of a limb behind the joints that they share."""

    joints: Annotated[list[JointTable], Field(min_length=1)] = Field(description="joints, towards the platform")


class LimbTable(Table):
    """A limb, with its copies."""

    name: Name | None = Field(default=None, description="its name; copies are numbered")
    repeat: RepeatTable | None = Field(default=None, description="copies of the limb")
    points: dict[str, VectorExpression] = Field(default_factory=dict, description="points by name, at home")
    joints: list[JointTable] = Field(default_factory=empty_list, description="joints from the base to the platform")
    branch: list[BranchTable] = Field(default_factory=empty_list, description="paths behind these joints")
    centre: VectorExpression | None = Field(default=None, description="place where its wrenches are measured")


class LinkJointTable(Table):
    """A joint between two links, at home."""

    name: Name = Field(description="its name, unique among the joints")
    type: Literal["R", "P", "H", "C", "U", "S", "Pa", "weld"] = Field(description="its kind")
    between: Annotated[list[Name], Field(min_length=2, max_length=2)] = Field(
        description="names of its links, the base's side first"
    )
    at: VectorExpression | None = Field(default=None, description="its centre, or a point of its axis")
    axis: VectorExpression | None = Field(default=None, description="direction of its axis")
    axes: Annotated[list[VectorExpression], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="axes of a U, the base side first"
    )
    pitch: Expression | None = Field(default=None, description="way per radian of an H")
    to: VectorExpression | None = Field(default=None, description="far end of a parallelogram's rod")
    actuated: bool | None = Field(default=None, description="whether an actuator drives it")


class CouplingTable(Table):
    """A linear relation of joints' coordinates."""

    factors: dict[str, Expression] = Field(
        description="factor of each joint; their sum with coordinates stays as it is"
    )


class HeadTable(Table):
    """The part of every robot file: version, name, home and dimensions."""

    schema_: Literal[1] = Field(default=1, alias=VERSION_KEY, description="version of the keys of this file")
    name: Name = Field(description="its name")
    description: str = Field(default="", description="one sentence")
    length_unit: str = Field(default="", description="unit of the typical lengths, such as m; empty for proportions")
    home: VectorExpression = Field(default="0*x", description="origin of the platform at home")
    dimensions: dict[str, DimensionTable] = Field(default_factory=dict, description="dimensions by name")
    derived: dict[str, Expression] = Field(default_factory=dict, description="further numbers by name")


class RobotFile(HeadTable):
    """A robot given limb by limb, at home."""

    limb: Annotated[list[LimbTable], Field(min_length=1)] = Field(description="limbs")


class LinkFile(HeadTable):
    """A robot given by links and joints, at home: for shapes that limbs with branches do not have."""

    links: Annotated[list[Name], Field(min_length=2)] = Field(description="names of all links")
    base: Name = Field(default="base", description="the link that is the base")
    platform: Name = Field(default="platform", description="the link that is the platform")
    points: dict[str, VectorExpression] = Field(default_factory=dict, description="points by name, at home")
    joint: Annotated[list[LinkJointTable], Field(min_length=1)] = Field(description="joints")
    coupling: list[CouplingTable] = Field(default_factory=empty_list, description="relations of joints' coordinates")


#: Keys longer than this are cut in messages.
_LONGEST_KEY = 60
#: Words for one entry of a list.
_ONE = {
    "limb": "limb",
    "joint": "joint",
    "coupling": "coupling",
    "links": "link",
    "joints": "joint",
    "branch": "branch",
    "angles": "angle",
    "axes": "axis",
}
#: Values that a key must have, for messages where it is missing.
_NEEDED = {
    "type": "one of R, P, H, C, U, S and Pa",
    "at": "a point, as an expression in quotes or a list of 3",
    "name": "a text in quotes",
    "limb": "one or more tables [[limb]]",
    "joints": "a list of one or more joints",
    "links": "a list of the names of all links",
    "joint": "one or more tables [[joint]]",
    "between": "a list of two links, the base's side first",
    "factors": "a table with a factor for each joint",
    "typical": "a number, degrees for an angle",
}


def check_form(tables: dict[str, Any]) -> None:
    """Refuse a robot file whose keys or types are not those of the schema.

    Args:
        tables: the document, as ``tomllib`` returns it.

    Raises:
        CaseError: the first fault, with limb and joint in words.
    """
    if "robot" in tables and "task" in tables:
        raise CaseError("the file", "is a case, and not a robot file; screwsynth solve takes it")
    check_version(ROBOT_FILES, tables)
    given = [key for key in GRAPH_KEYS if key in tables]
    if given and "limb" in tables:
        raise CaseError(given[0], "cannot stand beside limb: give the robot by limbs, or by links and joints")
    try:
        (LinkFile if given else RobotFile).model_validate(tables)
    except ValidationError as error:
        raise _error(error.errors()[0], tables) from None


def _error(fault: ErrorDetails, tables: dict[str, Any]) -> CaseError:
    """Return a fault of tables as an error whose key is a place in words, such as ``limb 2, joint 1, axis``."""
    written = case_error(fault)
    location = [*fault["loc"], *([fault["ctx"]["key"]] if "key" in fault.get("ctx", {}) else [])]
    if location[0] == "joint" and len(location) > 1 and isinstance(location[1], int):
        table = tables["joint"][location[1]]
        name = table.get("name") if isinstance(table, dict) else None
        if isinstance(name, str) and name.isidentifier():
            location[:2] = [f"joint {name}"]
    if fault["type"] == "string_type" and location[-1] == "<word>":
        return CaseError(_place(location), "must be an expression in quotes or a list of 3", written.value)
    if fault["type"] == "float_type" and location[-1] == "<number>":
        return CaseError(_place(location), "must be a number or an expression in quotes", written.value)
    if fault["type"] in ("greater_than_equal", "less_than_equal") and location[-1] == "count":
        return CaseError(_place(location), f"must be a whole number from 1 to {MOST_LIMBS}", written.value)
    if fault["type"] == "unknown_key" and location[-1] == "branch" and "branch" in location[:-1]:
        return CaseError(_place(location), NESTED_BRANCH)
    needed = _NEEDED.get(str(location[-1])) if fault["type"] == "missing" else None
    # The word "points" is a key of its own, and not a slip for "joint".
    if needed and (written.fault == "is missing" or location == ["joint"]):
        return CaseError(_place(location), f"is missing; it must be {needed}", written.value)
    return CaseError(_place(location), written.fault, written.value)


def _place(location: Sequence[int | str]) -> str:
    """Return a path into the document in words; parts that stand for branches of a union are left out.

    An entry of a list of tables, or of axes, is counted by the word for one of them; others are entries of a vector.
    """
    parts: list[str] = []
    for part in location:
        if isinstance(part, int) and parts[-1] in _ONE:
            parts[-1] = f"{_ONE[parts[-1]]} {part + 1}"
        elif isinstance(part, int):
            parts.append(f"entry {part + 1}")
        elif not part.startswith("<"):
            parts.append(part if len(part) <= _LONGEST_KEY else f"{part[: _LONGEST_KEY - 3]}...")
    return ", ".join(parts) or "the file"


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
        content = read_limited(path, _LARGEST_FILE)
    except InputError as error:
        raise CaseError("robot.file", str(error).removeprefix(f"{path}: "), name) from None
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
    except ValueError as error:
        raise CaseError("the file", f"is not valid TOML: {error}", source=name) from None
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise CaseError("the file", toml_fault(text, error), source=name) from None
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

"""Robot files: their schema and reader. A case refers to a robot file by ``[robot] file = "my-robot.toml"``.

The classes check keys and types; the tables are the arguments of :func:`screwsynth.models.robot`, which checks
everything else.
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
    """Dimension of the robot: a parameter that a case fixes or leaves free."""

    typical: FiniteFloat = Field(description="typical value of the dimension; degrees for an angle")
    kind: Literal["length", "angle", "number"] = Field(
        default="length", description="physical dimension: length, angle or plain number"
    )
    description: str = Field(default="", description="description of the dimension in a few words")


class RepeatTable(Table):
    """Copies of a limb, rotated about an axis."""

    count: Annotated[int, Field(ge=1, le=MOST_LIMBS)] | None = Field(
        default=None, description="number of limbs, evenly spaced around the axis"
    )
    angles: Annotated[list[FiniteFloat], Field(min_length=1, max_length=MOST_LIMBS)] | None = Field(
        default=None, description="angle of rotation of each limb about the axis, degrees, instead of count"
    )
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="direction of the axis of rotation")
    through: Vector = Field(default=[0.0, 0.0, 0.0], description="point on the axis of rotation")


class JointTable(Table):
    """Joint of a limb, in the home configuration."""

    type: Literal["R", "P", "H", "C", "U", "S", "Pa"] = Field(
        description="joint type: R revolute, P prismatic, H helical, C cylindrical, U universal, S spherical, "
        "Pa parallelogram"
    )
    name: Name | None = Field(
        default=None, description="name of the joint; a limit with this name is on this joint of every copy of the limb"
    )
    at: VectorExpression = Field(description="centre of the joint, or a point on its axis")
    axis: VectorExpression | None = Field(default=None, description="direction of the joint axis")
    axes: Annotated[list[VectorExpression], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="two axes of a universal joint, the one on the base side first"
    )
    pitch: Expression | None = Field(default=None, description="translation per radian of a helical joint")
    to: VectorExpression | None = Field(default=None, description="far end of a rod of a parallelogram joint")
    actuated: bool | None = Field(default=None, description="If true, an actuator drives the joint")


class BranchTable(Table):
    """Branch of a limb: one of several parallel chains that follow the common joints."""

    joints: Annotated[list[JointTable], Field(min_length=1)] = Field(
        description="joints of the branch, from the common joints to the platform"
    )


class LimbTable(Table):
    """Limb of the robot, with its copies."""

    name: Name | None = Field(default=None, description="name of the limb; its copies are numbered")
    repeat: RepeatTable | None = Field(default=None, description="copies of the limb, rotated about an axis")
    points: dict[str, VectorExpression] = Field(
        default_factory=dict, description="points by name, in the home configuration"
    )
    joints: list[JointTable] = Field(default_factory=empty_list, description="joints from the base to the platform")
    branch: list[BranchTable] = Field(
        default_factory=empty_list, description="parallel chains that follow these joints and end at the platform"
    )
    centre: VectorExpression | None = Field(
        default=None, description="reference point for the moments of the limb's wrenches"
    )


class LinkJointTable(Table):
    """Joint between two links, in the home configuration."""

    name: Name = Field(description="name of the joint, unique among all joints")
    type: Literal["R", "P", "H", "C", "U", "S", "Pa", "weld"] = Field(
        description="joint type: R revolute, P prismatic, H helical, C cylindrical, U universal, S spherical, "
        "Pa parallelogram, weld rigid connection"
    )
    between: Annotated[list[Name], Field(min_length=2, max_length=2)] = Field(
        description="names of the two links, the one on the base side first"
    )
    at: VectorExpression | None = Field(default=None, description="centre of the joint, or a point on its axis")
    axis: VectorExpression | None = Field(default=None, description="direction of the joint axis")
    axes: Annotated[list[VectorExpression], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="two axes of a universal joint, the one on the base side first"
    )
    pitch: Expression | None = Field(default=None, description="translation per radian of a helical joint")
    to: VectorExpression | None = Field(default=None, description="far end of a rod of a parallelogram joint")
    actuated: bool | None = Field(default=None, description="If true, an actuator drives the joint")


class CouplingTable(Table):
    """Linear relation of joint coordinates, such as that of gears."""

    factors: dict[str, Expression] = Field(
        description="factor of each joint coordinate by joint name; the sum of factors times coordinates is constant"
    )


class HeadTable(Table):
    """Common keys of all robot files: version, name, home and dimensions."""

    schema_: Literal[1] = Field(default=1, alias=VERSION_KEY, description="version of the file format")
    name: Name = Field(description="name of the robot")
    description: str = Field(default="", description="description of the robot in one sentence")
    length_unit: str = Field(
        default="", description="unit of the typical lengths, such as m; empty if only proportions matter"
    )
    home: VectorExpression = Field(default="0*x", description="origin of the platform frame in the home configuration")
    dimensions: dict[str, DimensionTable] = Field(default_factory=dict, description="dimensions by name")
    derived: dict[str, Expression] = Field(
        default_factory=dict, description="derived quantities by name, as expressions of the dimensions"
    )


class RobotFile(HeadTable):
    """Robot given by its limbs, in the home configuration."""

    limb: Annotated[list[LimbTable], Field(min_length=1)] = Field(description="limbs from the base to the platform")


class LinkFile(HeadTable):
    """Robot given by links and joints, in the home configuration: for structures other than limbs with branches."""

    links: Annotated[list[Name], Field(min_length=2)] = Field(description="names of all links")
    base: Name = Field(default="base", description="name of the base link")
    platform: Name = Field(default="platform", description="name of the platform link")
    points: dict[str, VectorExpression] = Field(
        default_factory=dict, description="points by name, in the home configuration"
    )
    joint: Annotated[list[LinkJointTable], Field(min_length=1)] = Field(description="joints between the links")
    coupling: list[CouplingTable] = Field(
        default_factory=empty_list, description="linear relations of joint coordinates"
    )


#: Keys longer than this are cut in messages.
_LONGEST_KEY = 60
#: Singular of the keys of lists, for messages about one entry.
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
#: Allowed values of keys, for messages about a missing key.
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
    """Check keys and types of a robot file.

    Args:
        tables: the document, as ``tomllib`` returns it.

    Raises:
        CaseError: a key or a type is not allowed; the first one is reported, with limb and joint in words.
    """
    if "robot" in tables and "task" in tables:
        raise CaseError("the file", "is a case, not a robot file; use it with screwsynth solve")
    check_version(ROBOT_FILES, tables)
    given = [key for key in GRAPH_KEYS if key in tables]
    if given and "limb" in tables:
        raise CaseError(given[0], "conflicts with limb: give the robot by limbs, or by links and joints")
    try:
        (LinkFile if given else RobotFile).model_validate(tables)
    except ValidationError as error:
        raise _error(error.errors()[0], tables) from None


def _error(fault: ErrorDetails, tables: dict[str, Any]) -> CaseError:
    """Return an error of pydantic as an error with its place in words, such as ``limb 2, joint 1, axis``."""
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
    # "points" is a key too, and not a slip for "joint".
    if needed and (written.fault == "is missing" or location == ["joint"]):
        return CaseError(_place(location), f"is missing; it must be {needed}", written.value)
    return CaseError(_place(location), written.fault, written.value)


def _place(location: Sequence[int | str]) -> str:
    """Return a location in the document in words, without branches of unions.

    Entries of lists of tables and of axes are numbered by name, as in ``joint 2``; other entries are ``entry 2``.
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


#: Largest robot file, bytes: a hundred times the largest one that a person writes.
_LARGEST_FILE = 2**20


def insert_robot(tables: dict[str, Any], folder: Path) -> str:
    """Replace the name of a robot file in a case by the content of the file, and return the name.

    Args:
        tables: the case, as ``tomllib`` returns it; ``file`` of its table ``robot`` becomes ``definition``.
        folder: folder of the case file, from which the name begins.

    Raises:
        CaseError: the file cannot be read or has an error, or the case also gives the robot in another way.
    """
    table = tables["robot"]
    name = table["file"]
    if not isinstance(name, str) or not name:
        raise CaseError("robot.file", "must be the name of a robot file in quotes")
    for other in ("model", "definition"):
        if other in table:
            raise CaseError(f"robot.{other}", "conflicts with robot.file; give only one of them")
    definition = read_definition(name, folder)
    tables["robot"] = {"definition": definition, **{key: value for key, value in table.items() if key != "file"}}
    return name


def read_definition(name: str, folder: Path) -> dict[str, Any]:
    """Return the tables of a robot file, with keys and types checked.

    Args:
        name: path of the file.
        folder: folder from which a relative path begins.

    Raises:
        CaseError: the file cannot be read, or has an error.
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
        CaseError: the definition has an error.
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

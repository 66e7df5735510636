"""A robot as it is written: dimensions, points, limbs and joints in words, with their form checked.

The tables of a robot file and the arguments of :func:`~screwsynth.models.joints.robot.robot` have the same words. Here
their form is checked; :mod:`.chain` gives the expressions their values.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from ..model import ModelError
from ..parts import Dimension
from .expression import CONSTANTS, FUNCTIONS

#: A scalar expression: a number or a text.
Expression: TypeAlias = str | float
#: A vector expression: a text, or three scalar expressions.
VectorExpression: TypeAlias = str | Sequence[Expression]

#: The joints by name, with their own keys beside ``type`` and ``at``.
JOINT_KEYS: Mapping[str, tuple[str, ...]] = {
    "R": ("axis", "actuated"),
    "P": ("axis", "actuated"),
    "H": ("axis", "pitch", "actuated"),
    "C": ("axis",),
    "U": ("axes",),
    "S": (),
    "Pa": ("axis", "to", "actuated"),
}
_MOST_LIMBS = 24
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class RobotError(ModelError):
    """Error in a robot given joint by joint.

    Attributes:
        place: limb, joint and key, such as ``limb 2, joint 1 (R), axis``; empty for the whole robot.
        fault: the fault, with the value and with what is allowed.
    """

    def __init__(self, place: str, fault: str) -> None:
        super().__init__(f"{place}: {fault}" if place else fault)
        self.place, self.fault = place, fault


@dataclass(frozen=True)
class DimensionWords:
    """A dimension: its typical value (degrees for an angle), kind and description."""

    typical: float
    kind: Dimension
    description: str


@dataclass(frozen=True)
class JointWords:
    """A joint: its type, place, axes and further numbers, as expressions; None for what its type does not have."""

    place: str
    type: str
    at: VectorExpression
    axes: tuple[VectorExpression, ...]
    actuated: bool = False
    pitch: Expression = 0.0
    to: VectorExpression | None = None
    name: str = ""


@dataclass(frozen=True)
class RepeatWords:
    """Copies of a limb by rotation about an axis: angles in degrees, direction and point of the axis."""

    angles: tuple[float, ...]
    axis: tuple[float, float, float]
    through: tuple[float, float, float]


@dataclass(frozen=True)
class LimbWords:
    """A limb: names of its copies, how it is repeated, points, joints of the stem, and of each branch."""

    place: str
    names: tuple[str, ...]
    repeat: RepeatWords | None
    points: Mapping[str, VectorExpression]
    stem: tuple[JointWords, ...]
    branches: tuple[tuple[JointWords, ...], ...]
    centre: VectorExpression | None


@dataclass(frozen=True)
class RobotWords:
    """A robot as it is written."""

    name: str
    description: str
    home: VectorExpression
    limbs: tuple[LimbWords, ...]
    dimensions: Mapping[str, DimensionWords] = field(default_factory=dict)
    derived: Mapping[str, Expression] = field(default_factory=dict)


def read_words(tables: Mapping[str, object]) -> RobotWords:
    """Return a robot from its tables, as ``tomllib`` returns those of a robot file.

    Args:
        tables: the keys ``name``, ``description``, ``home``, ``dimensions``, ``derived`` and ``limb``.

    Raises:
        RobotError: a key is unknown or missing, or a value has a form that is not allowed.
    """
    _refuse_other_keys("", tables, ("name", "description", "home", "dimensions", "derived", "limb"))
    name = tables.get("name")
    if not isinstance(name, str) or not name.strip():
        raise RobotError("name", "is missing: give the robot's name as a text")
    limbs = tables.get("limb")
    if not isinstance(limbs, Sequence) or isinstance(limbs, str) or not limbs:
        raise RobotError("limb", "is missing: a robot needs at least one [[limb]]")
    dimensions = {key: _dimension(key, value) for key, value in _table("dimensions", tables.get("dimensions")).items()}
    derived = {
        key: _expression(f"derived.{key}", value) for key, value in _table("derived", tables.get("derived")).items()
    }
    _check_names([*dimensions, *derived], "a dimension")
    read: list[LimbWords] = []
    for index, each in enumerate(limbs):
        read.append(_limb(f"limb {index + 1}", _table(f"limb {index + 1}", each), sum(len(one.names) for one in read)))
    names = [limb for each in read for limb in each.names]
    if len(names) > _MOST_LIMBS:
        raise RobotError("limb", f"has {len(names)} limbs with all copies; at most {_MOST_LIMBS} are allowed")
    for limb in names:
        if names.count(limb) > 1:
            raise RobotError("limb", f"has two limbs with the name {limb!r}")
    return RobotWords(
        name=name,
        description=_text("description", tables.get("description", "")) or f"{name}, given joint by joint",
        home=_vector("home", tables.get("home", (0.0, 0.0, 0.0))),
        limbs=tuple(read),
        dimensions=dimensions,
        derived=derived,
    )


def _limb(place: str, table: Mapping[str, object], before: int) -> LimbWords:
    """Return a limb.

    Args:
        place: of the limb, for messages.
        table: the limb's keys.
        before: number of limbs before it, with all copies.
    """
    _refuse_other_keys(place, table, ("name", "repeat", "points", "joints", "branch", "centre"))
    repeat = None if table.get("repeat") is None else _repeat(f"{place}, repeat", table["repeat"])
    count = 1 if repeat is None else len(repeat.angles)
    given = _text(f"{place}, name", table.get("name", ""))
    names = [str(before + k + 1) for k in range(count)]
    if given:
        names = [given] if repeat is None else [f"{given}{k + 1}" for k in range(count)]
    points = {
        key: _vector(f"{place}, point {key}", value)
        for key, value in _table(f"{place}, points", table.get("points")).items()
    }
    _check_names(points, "a point", place)
    stem = _joints(place, table.get("joints", ()))
    _check_joint_names(place, stem)
    branches = [
        _joints(f"{place}, branch {k + 1}", _only_joints(f"{place}, branch {k + 1}", branch))
        for k, branch in enumerate(_list(f"{place}, branch", table.get("branch", ())))
    ]
    for branch in branches:
        _check_joint_names(place, [*stem, *branch])
    if not stem and not branches:
        raise RobotError(f"{place}, joints", "is missing: a limb needs at least one joint")
    if len(branches) == 1:
        raise RobotError(f"{place}, branch", "has one branch: write its joints among those of the limb")
    centre = None if table.get("centre") is None else _vector(f"{place}, centre", table["centre"])
    return LimbWords(place, tuple(names), repeat, points, stem, tuple(branches), centre)


def _check_joint_names(place: str, joints: Sequence[JointWords]) -> None:
    """Refuse names of joints of one path that are no words, or are given twice."""
    names = [joint.name for joint in joints if joint.name]
    for joint in joints:
        if joint.name and not _NAME.fullmatch(joint.name):
            fault = f"is {joint.name!r}; letters, digits and _ are allowed, a letter first"
            raise RobotError(f"{joint.place}, name", fault)
        if names.count(joint.name) > 1:
            raise RobotError(f"{place}, joints", f"has two joints with the name {joint.name!r}")


def _only_joints(place: str, branch: object) -> object:
    """Return the joints of a branch, which has no other key."""
    table = _table(place, branch)
    _refuse_other_keys(place, table, ("joints",))
    if not table.get("joints"):
        raise RobotError(f"{place}, joints", "is missing: a branch needs at least one joint")
    return table["joints"]


def _joints(place: str, value: object) -> tuple[JointWords, ...]:
    """Return the joints of a limb or of a branch."""
    return tuple(
        _joint(f"{place}, joint {k + 1}", _table(f"{place}, joint {k + 1}", each))
        for k, each in enumerate(_list(f"{place}, joints", value))
    )


def _joint(place: str, table: Mapping[str, object]) -> JointWords:
    """Return a joint."""
    kind = table.get("type")
    if not isinstance(kind, str) or kind not in JOINT_KEYS:
        raise RobotError(f"{place}, type", f"is {kind!r}; allowed are {', '.join(JOINT_KEYS)}")
    place = f"{place} ({kind})"
    allowed = ("type", "name", "at", *JOINT_KEYS[kind])
    if "actuated" in table and "actuated" not in allowed:
        raise RobotError(f"{place}, actuated", "is not allowed: write its axes as joints R or P of their own")
    _refuse_other_keys(place, table, allowed)
    for key in allowed:
        if key not in ("actuated", "name") and key not in table:
            raise RobotError(f"{place}, {key}", "is missing")
    axes: tuple[VectorExpression, ...] = ()
    if "axis" in allowed:
        axes = (_vector(f"{place}, axis", table["axis"]),)
    if "axes" in allowed:
        written = _list(f"{place}, axes", table["axes"])
        if len(written) != 2:
            raise RobotError(f"{place}, axes", f"has {len(written)} axes; a universal joint has 2")
        axes = tuple(_vector(f"{place}, axes[{k}]", each) for k, each in enumerate(written))
    actuated = table.get("actuated", False)
    if not isinstance(actuated, bool):
        raise RobotError(f"{place}, actuated", f"is {actuated!r}; allowed are true and false")
    return JointWords(
        place=place,
        type=kind,
        at=_vector(f"{place}, at", table["at"]),
        axes=axes,
        actuated=actuated,
        pitch=_expression(f"{place}, pitch", table.get("pitch", 0.0)),
        to=None if "to" not in table else _vector(f"{place}, to", table["to"]),
        name=_text(f"{place}, name", table.get("name", "")),
    )


def _repeat(place: str, value: object) -> RepeatWords:
    """Return how a limb is repeated: evenly by a count, or at angles."""
    table = _table(place, value)
    _refuse_other_keys(place, table, ("count", "angles", "axis", "through"))
    if ("count" in table) == ("angles" in table):
        raise RobotError(place, "needs either count or angles")
    if "count" in table:
        count = table["count"]
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= _MOST_LIMBS:
            raise RobotError(f"{place}, count", f"is {count!r}; allowed are whole numbers from 1 to {_MOST_LIMBS}")
        angles = tuple(360.0 * k / count for k in range(count))
    else:
        angles = tuple(_real(f"{place}, angles", each) for each in _list(f"{place}, angles", table["angles"]))
        if not 1 <= len(angles) <= _MOST_LIMBS:
            raise RobotError(f"{place}, angles", f"has {len(angles)} angles; allowed are 1 to {_MOST_LIMBS}")
    axis = _triple(f"{place}, axis", table.get("axis", (0.0, 0.0, 1.0)))
    if not any(axis):
        raise RobotError(f"{place}, axis", "is zero: it needs a direction")
    return RepeatWords(angles, axis, _triple(f"{place}, through", table.get("through", (0.0, 0.0, 0.0))))


def _dimension(name: str, value: object) -> DimensionWords:
    """Return a dimension."""
    place = f"dimensions.{name}"
    table = _table(place, value)
    _refuse_other_keys(place, table, ("typical", "kind", "description"))
    if "typical" not in table:
        raise RobotError(f"{place}, typical", "is missing: a dimension needs a typical value")
    kinds = {item.value: item for item in Dimension}
    kind = table.get("kind", "length")
    if not isinstance(kind, str) or kind not in kinds:
        raise RobotError(f"{place}, kind", f"is {kind!r}; allowed are {', '.join(kinds)}")
    typical = _real(f"{place}, typical", table["typical"])
    return DimensionWords(typical, kinds[kind], _text(f"{place}, description", table.get("description", "")))


def _check_names(names: Sequence[str] | Mapping[str, object], what: str, place: str = "") -> None:
    """Refuse names that are no words, or that expressions use for something else."""
    for name in names:
        where = f"{place}, {name}" if place else name
        if not _NAME.fullmatch(name):
            raise RobotError(where, f"is no name for {what}: letters, digits and _ are allowed, a letter first")
        if name in CONSTANTS or name in FUNCTIONS:
            raise RobotError(where, f"is no name for {what}: expressions use it for something else")
        if list(names).count(name) > 1:
            raise RobotError(where, "is given twice")


def _refuse_other_keys(place: str, table: Mapping[str, object], allowed: Sequence[str]) -> None:
    for key in table:
        if key not in allowed:
            where = f"{place}, {key}" if place else str(key)
            raise RobotError(where, f"no such key; allowed are {', '.join(allowed)}")


def _table(place: str, value: object) -> Mapping[str, object]:
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise RobotError(place, f"is {value!r}; a table is needed")
    return value


def _list(place: str, value: object) -> Sequence[object]:
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise RobotError(place, f"is {value!r}; a list is needed")
    return value


def _text(place: str, value: object) -> str:
    if not isinstance(value, str):
        raise RobotError(place, f"is {value!r}; a text is needed")
    return value


def _real(place: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RobotError(place, f"is {value!r}; a finite number is needed")
    return float(value)


def _triple(place: str, value: object) -> tuple[float, float, float]:
    numbers = [_real(place, each) for each in _list(place, value)]
    if len(numbers) != 3:
        raise RobotError(place, f"has {len(numbers)} numbers; 3 are needed")
    return numbers[0], numbers[1], numbers[2]


def _expression(place: str, value: object) -> Expression:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise RobotError(place, f"is {value!r}; a number or an expression is needed")
    return value


def _vector(place: str, value: object) -> VectorExpression:
    if isinstance(value, str):
        return value
    parts = [_expression(place, each) for each in _list(place, value)]
    if len(parts) != 3:
        raise RobotError(place, f"has {len(parts)} components; a vector has 3, or is an expression")
    return parts

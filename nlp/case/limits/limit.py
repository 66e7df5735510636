"""A limit of a case, with its table in the file, its check against the robot, and its constraints.

Everything is optional: no limit is no restriction. A limit is checked against the robot once, when its case is made.

A limit type is one class in one file of this package, and one row of the registry in
:mod:`screwsynth.nlp.case.limits.registry`. Lengths are in the case's unit and angles in radians. Every constraint's
expression grows with the measured number, so that a lower limit is a lower bound; the constraint's reading brings
bounds and multipliers back to the words of the case.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, NamedTuple, Self, TypeAlias, TypeVar

from casadi import SX

from ....models import Dimension, Model, RobotInstance
from ...errors import CaseError
from ...units import Units
from ..checks import check_real
from ..loads import NO_LOADING, Loading
from .constraint import BoundedConstraint, PairFamily

if TYPE_CHECKING:
    from ..forces import PosedForces
    from ..table import Table
    from ..toml import TomlValue

#: The value that a case file has at a limit's key: a table, mostly.
TableT = TypeVar("TableT")


class TableField(NamedTuple):
    """A key of the table ``[limits]``: the type of its value, and pydantic's ``Field`` for it."""

    annotation: Any
    info: Any


class NumberRange(NamedTuple):
    """Range of a number of a limit, radians for an angle: above one number, from one number on, and at most another."""

    dimension: Dimension = Dimension.LENGTH
    above: float = 0.0
    most: float = math.inf
    least: float = -math.inf


#: Numbers of a limit by name.
Ranges: TypeAlias = Mapping[str, NumberRange]


class Written(NamedTuple, Generic[TableT]):
    """A limit as a case file writes it, in the file's units.

    Attributes:
        key: its key in ``[limits]``.
        value: the value at that key.
        limits: the whole table ``[limits]``.
        model: the robot.
        units: the file's units.
    """

    key: str
    value: TableT
    limits: Table
    model: Model
    units: Units

    def internal(self, number: float, dimension: Dimension) -> float:
        """Return a number of the file as computations use it."""
        return self.units.to_internal(number, dimension)

    def numbers(self, ranges: Ranges, table: Table | None = None) -> dict[str, float | None]:
        """Return numbers of the limit's table, or of a table in it, as computations use them; None where there is none.

        Args:
            ranges: the numbers.
            table: the table; the limit's own if left out.
        """
        given = {name: getattr(table or self.value, name) for name in ranges}
        return {
            name: None if number is None else self.internal(number, ranges[name].dimension)
            for name, number in given.items()
        }


class LimitedCase(NamedTuple):
    """A case as far as its limits read it.

    Attributes:
        model: the robot.
        units: units for people.
        scalars: names of the case's own numbers, and the dimension of each.
        loading: loads on the platform, and its motions.
    """

    model: Model
    units: Units
    scalars: Mapping[str, Dimension]
    loading: Loading = NO_LOADING

    def check_number(self, key: str, value: float | None, allowed: NumberRange) -> None:
        """Refuse a number of a limit that is out of its range.

        Args:
            key: its dotted key below ``limits``.
            value: the number, radians for an angle; None where it is not given.
            allowed: its range.

        Raises:
            CaseError: the number is not finite, or out of its range.
        """
        dimension, above, most, least = allowed
        if value is not None:
            value = check_real(value, f"limits.{key}")
        if value is None or (math.isfinite(value) and above < value <= most and value >= least):
            return
        smallest = f"above {self.units.text(above, dimension)}" if math.isfinite(above) else "finite"
        largest = f" and at most {self.units.text(most, dimension)}" if math.isfinite(most) else ""
        needed = f"{smallest}{largest}"
        if math.isfinite(value) and value < least:
            needed = f"at least {self.units.text(least, dimension)}"
        shown = self.units.shown(value, dimension) if math.isfinite(value) else value
        raise CaseError(f"limits.{key}", f"must be {needed}", shown)


class PlateJoint(NamedTuple):
    """A joint of a plate: its leg's name, and its centre (3, 1) in the plate's frame."""

    name: str
    centre: SX


class Plate(NamedTuple):
    """The joint centres of the base or of the platform, in its own frame; no pose changes them."""

    name: Literal["base", "platform"]
    joints: tuple[PlateJoint, ...]


class Design(NamedTuple):
    """A whole case as expressions of the program's variables and arguments.

    Attributes:
        case: the case.
        robots: the robot at each pose.
        numbers: the case's own numbers by name, radians for angles.
    """

    case: LimitedCase
    robots: tuple[RobotInstance, ...]
    numbers: Mapping[str, SX]


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """The robot at one pose, as expressions of the program's variables and arguments.

    Attributes:
        model: the robot, in its own symbols.
        robot: the robot at the pose.
        tasks: names of the tasks that the columns of its rates belong to.
        where: end of the names of constraints at this pose; empty for a single pose.
        loading: loads on the platform, and its motions.
    """

    model: Model
    robot: RobotInstance
    tasks: tuple[str, ...]
    where: str = ""
    loading: Loading = NO_LOADING

    @cached_property
    def forces(self) -> PosedForces:
        """Forces and speeds of the actuators."""
        from ....models.statics import posed_statics  # noqa: PLC0415 - a case without loads starts without them
        from ..forces import forces_at  # noqa: PLC0415 - likewise

        statics = posed_statics(self.model, self.robot)
        return forces_at(self.model, statics, self.robot.rotation, self.loading, self.robot.size)


class Measures(NamedTuple):
    """Numbers that a limit speaks of, in place of the model's quantity with the limit's key.

    Attributes:
        owners: name of the limb of each number.
        values: (n, 1) expressions, radians for angles.
        dimension: of each number.
    """

    owners: tuple[str, ...]
    values: SX
    dimension: Dimension


@dataclass(frozen=True)
class Limit(abc.ABC, Generic[TableT]):
    """A limit that a design must keep.

    A subclass is a frozen dataclass whose fields are the limit's numbers. It states the class attributes below, and
    yields its constraints from those of :meth:`on_plate`, :meth:`of_design`, :meth:`on_pairs` and :meth:`at_pose` that
    concern it. Its table in a file, both ways, and its check follow from its numbers; a limit that is more than numbers
    has methods of its own for them.

    Attributes:
        key: its key in ``[limits]``; empty for a type whose limits have keys of their own.
        table: type of the value at the key.
        description: a few words for the JSON Schema of case files.
        numbers: the range of each of its numbers, which have the same names in its table.
        needs_legs: whether only a robot with legs between joint centres can have it.
        needs_joints: whether only a robot given joint by joint can have it.
        needs_motion: whether the numbers depend on the platform's motions: those of the case, or of a path with times.
        order: place of its constraints among those of other limits on the same plate, design or pose: lower first, and
            in the registry's order where equal.
    """

    key: ClassVar[str]
    table: ClassVar[Any]
    description: ClassVar[str]
    numbers: ClassVar[Ranges] = {}
    needs_legs: ClassVar[bool] = False
    needs_joints: ClassVar[bool] = False
    needs_motion: ClassVar[bool] = False
    order: ClassVar[int] = 0

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the keys of ``[limits]`` that belong to this type."""
        from pydantic import Field  # noqa: PLC0415 - a case without limits starts without it

        return {cls.key: TableField(cls.table | None, Field(default=None, description=cls.description))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type that a case file states.

        Args:
            limits: the table ``[limits]``.
            model: the robot.
            units: the file's units.

        Raises:
            CaseError: the table contradicts itself.
        """
        value = getattr(limits, cls.key)
        if value is not None:
            yield cls.from_table(Written(cls.key, value, limits, model, units))

    @classmethod
    def from_table(cls, written: Written[TableT]) -> Self:
        """Return the limit that a case file writes.

        Raises:
            CaseError: the table contradicts itself.
        """
        return cls(**written.numbers(cls.numbers))

    def ranges(self, model: Model) -> Ranges:  # noqa: ARG002 - most measures are the same everywhere
        """Return the range of each number of this limit on a robot."""
        return self.numbers

    def angles(self, model: Model) -> Mapping[str, float | None]:
        """Return the angles among the numbers of this limit, radians, by their dotted keys below ``limits``."""
        ranges = self.ranges(model).items()
        names = [name for name, allowed in ranges if allowed.dimension is Dimension.ANGLE]
        return {f"{self.name}.{name}": getattr(self, name) for name in names}

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit, the inverse of :meth:`from_table`.

        Args:
            model: the robot.
            units: the file's units.
        """
        given = {name: (getattr(self, name), allowed) for name, allowed in self.ranges(model).items()}
        return {
            self.name: {
                name: units.written(value, allowed.dimension)
                for name, (value, allowed) in given.items()
                if value is not None
            }
        }

    @property
    def name(self) -> str:
        """Key of this limit in ``[limits]``."""
        return self.key

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether a robot has the parts that limits of this type need."""
        return (bool(model.legs) or not cls.needs_legs) and (bool(model.joints) or not cls.needs_joints)

    def exists_for(self, model: Model) -> bool:
        """Return whether a robot has the measure that is limited."""
        return self.is_for(model)

    def check(self, case: LimitedCase) -> None:
        """Refuse a limit without a number, with one out of its range or crossed sides, and one that contradicts itself.

        Raises:
            CaseError: in the words of a case file.
        """
        ranges = self.ranges(case.model)
        for name, allowed in ranges.items():
            case.check_number(f"{self.name}.{name}", getattr(self, name), allowed)
        given = {name: getattr(self, name) for name in ranges}
        two_sided = given.keys() == {"min", "max"}
        if ranges and all(value is None for value in given.values()):
            needed = "min, max, or both" if two_sided else " or ".join(ranges)
            raise CaseError(f"limits.{self.name}", f"must have {needed}")
        if two_sided and None not in given.values() and not given["min"] < given["max"]:
            dimension = ranges["max"].dimension
            fault = f"must be below max = {case.units.text(given['max'], dimension)}"
            raise CaseError(f"limits.{self.name}.min", fault, case.units.shown(given["min"], dimension))

    @property
    def reference(self) -> str:
        """Direction that an angle is measured from, in a word or two; empty for other limits."""
        return ""

    def measures(self, robot: RobotInstance) -> Measures | None:  # noqa: ARG002 - most limits need none
        """Return the numbers that this limit speaks of, where they are not the model's quantity with its key."""
        return None

    def on_plate(self, plate: Plate) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on the joint centres of one plate."""
        return ()

    def of_design(self, design: Design) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on the case's numbers, or on several poses together."""
        return ()

    def on_pairs(self, design: Design) -> Iterable[PairFamily]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on all pairs of many values, such as a leg's lengths at the poses."""
        return ()

    def at_pose(self, pose: PosedRobot) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - some limits have none
        """Return this limit's constraints at one pose."""
        return ()

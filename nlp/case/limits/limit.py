"""Base class of limits: table in the case file, check against the robot, and constraints of the nonlinear program.

A limit type is one class in one file, and one row of :mod:`screwsynth.nlp.case.limits.registry`. Lengths are in the
case's unit, angles in radians. The expression of each constraint increases with the measured quantity, so that a lower
limit is a lower bound. The reading of the constraint converts bounds and multipliers back to the quantity.
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

#: Type of the value at a limit's key in a case file, in most cases a table.
TableT = TypeVar("TableT")


class TableField(NamedTuple):
    """Key of the table ``[limits]``: type of its value, and pydantic's ``Field`` for it."""

    annotation: Any
    info: Any


class NumberRange(NamedTuple):
    """Allowed range of a limit's value: above an exclusive lower end, at least an inclusive one, at most an upper end.

    Angles are in radians.
    """

    dimension: Dimension = Dimension.LENGTH
    above: float = 0.0
    most: float = math.inf
    least: float = -math.inf


#: Allowed ranges of a limit's values, by name.
Ranges: TypeAlias = Mapping[str, NumberRange]


class Written(NamedTuple, Generic[TableT]):
    """Limit in a case file, in the file's units.

    Attributes:
        key: key of the limit in ``[limits]``.
        value: value at this key.
        limits: whole table ``[limits]``.
        model: the robot.
        units: units of the file.
    """

    key: str
    value: TableT
    limits: Table
    model: Model
    units: Units

    def internal(self, number: float, dimension: Dimension) -> float:
        """Return a number of the file in internal units: radians for angles."""
        return self.units.to_internal(number, dimension)

    def numbers(self, ranges: Ranges, table: Table | None = None) -> dict[str, float | None]:
        """Return values of the limit's table, or of a table in it, in internal units; None for a missing value.

        Args:
            ranges: names and allowed ranges of the values.
            table: table with the values; the limit's table if left out.
        """
        given = {name: getattr(table or self.value, name) for name in ranges}
        return {
            name: None if number is None else self.internal(number, ranges[name].dimension)
            for name, number in given.items()
        }


class LimitedCase(NamedTuple):
    """Part of a case on which its limits depend.

    Attributes:
        model: the robot.
        units: units of messages.
        scalars: dimension of each quantity of the case, by name.
        loading: loads on the platform, and its largest speeds.
    """

    model: Model
    units: Units
    scalars: Mapping[str, Dimension]
    loading: Loading = NO_LOADING

    def check_number(self, key: str, value: float | None, allowed: NumberRange) -> None:
        """Refuse a value of a limit outside of its range.

        Args:
            key: dotted key of the value below ``limits``.
            value: value to check, radians for an angle; None if not given.
            allowed: allowed range.

        Raises:
            CaseError: the value is not finite, or outside of its range.
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
    """Joint of a plate: name of its leg, and joint centre (3, 1) in the plate's frame."""

    name: str
    centre: SX


class Plate(NamedTuple):
    """Joint centres of the base or of the platform in its frame; they do not depend on the pose."""

    name: Literal["base", "platform"]
    joints: tuple[PlateJoint, ...]


class Design(NamedTuple):
    """Whole case as expressions of the variables and arguments of the nonlinear program.

    Attributes:
        case: part of the case on which limits depend.
        robots: the robot at each pose.
        numbers: quantities of the case by name, radians for angles.
    """

    case: LimitedCase
    robots: tuple[RobotInstance, ...]
    numbers: Mapping[str, SX]


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """Robot at one pose, as expressions of the variables and arguments of the nonlinear program.

    Attributes:
        model: the robot, with the symbols of its definition.
        robot: the robot at the pose.
        tasks: names of the tasks, one for each column of the rates.
        where: suffix of the names of constraints at this pose; empty for a single pose.
        loading: loads on the platform, and its largest speeds.
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
    """Quantities that a limit bounds, if they are not the model's quantity with the limit's key.

    Attributes:
        owners: name of the limb of each quantity.
        values: (n, 1) expressions, radians for angles.
        dimension: physical dimension of the quantities.
    """

    owners: tuple[str, ...]
    values: SX
    dimension: Dimension


@dataclass(frozen=True)
class Limit(abc.ABC, Generic[TableT]):
    """Limit that a design must satisfy.

    A subclass is a frozen dataclass whose fields are the values of the limit. It sets the class attributes below, and
    overrides those of :meth:`on_plate`, :meth:`of_design`, :meth:`on_pairs` and :meth:`at_pose` that give its
    constraints. Reader, writer and check follow from ``numbers``; a limit with other values overrides their methods.

    Attributes:
        key: key of the limit in ``[limits]``; empty for a type whose instances have different keys.
        table: type of the value at the key.
        description: description of the limit in the JSON Schema of case files.
        numbers: allowed range of each value of the limit; names are those in its table.
        needs_legs: If true, only robots with legs between joint centres can have the limit.
        needs_joints: If true, only robots given joint by joint can have the limit.
        needs_loads: If true, the limited quantity depends on the loads of the case.
        needs_motion: If true, the limited quantity depends on the platform's speeds, from the case or from a path.
        order: position of the constraints among constraints of other limits at the same place: lower first, then in the
            registry's order.
    """

    key: ClassVar[str]
    table: ClassVar[Any]
    description: ClassVar[str]
    numbers: ClassVar[Ranges] = {}
    needs_legs: ClassVar[bool] = False
    needs_joints: ClassVar[bool] = False
    needs_motion: ClassVar[bool] = False
    needs_loads: ClassVar[bool] = False
    order: ClassVar[int] = 0

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the keys of ``[limits]`` for this type."""
        from pydantic import Field  # noqa: PLC0415 - a case without limits starts without it

        return {cls.key: TableField(cls.table | None, Field(default=None, description=cls.description))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type in a case file.

        Args:
            limits: table ``[limits]``.
            model: the robot.
            units: units of the file.

        Raises:
            CaseError: the table contradicts itself.
        """
        value = getattr(limits, cls.key)
        if value is not None:
            yield cls.from_table(Written(cls.key, value, limits, model, units))

    @classmethod
    def from_table(cls, written: Written[TableT]) -> Self:
        """Return the limit of a case file.

        Args:
            written: the limit in the file.

        Raises:
            CaseError: the table contradicts itself.
        """
        return cls(**written.numbers(cls.numbers))

    def ranges(self, model: Model) -> Ranges:  # noqa: ARG002 - most measures are the same everywhere
        """Return the allowed range of each value of this limit on a robot."""
        return self.numbers

    def angles(self, model: Model) -> Mapping[str, float | None]:
        """Return the angles among the values of this limit, radians, by their dotted keys below ``limits``."""
        ranges = self.ranges(model).items()
        names = [name for name, allowed in ranges if allowed.dimension is Dimension.ANGLE]
        return {f"{self.name}.{name}": getattr(self, name) for name in names}

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit, the inverse of :meth:`from_table`.

        Args:
            model: the robot.
            units: units of the file.
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
        """Return whether a robot has the limited quantity."""
        return self.is_for(model)

    def check(self, case: LimitedCase) -> None:
        """Check the values of this limit against the case.

        Raises:
            CaseError: no value is given, a value is outside of its range, or min is not below max.
        """
        ranges = self.ranges(case.model)
        for name, allowed in ranges.items():
            case.check_number(f"{self.name}.{name}", getattr(self, name), allowed)
        given = {name: getattr(self, name) for name in ranges}
        two_sided = given.keys() == {"min", "max"}
        if ranges and all(value is None for value in given.values()):
            needed = "min, max, or both" if two_sided else " or ".join(ranges)
            raise CaseError(f"limits.{self.name}", f"is empty: it must have {needed}")
        if two_sided and None not in given.values() and not given["min"] < given["max"]:
            dimension = ranges["max"].dimension
            fault = f"must be below max = {case.units.text(given['max'], dimension)}"
            raise CaseError(f"limits.{self.name}.min", fault, case.units.shown(given["min"], dimension))

    @property
    def reference(self) -> str:
        """Name of the direction from which an angle is measured; empty for other limits."""
        return ""

    def measures(self, robot: RobotInstance) -> Measures | None:  # noqa: ARG002 - most limits need none
        """Return the quantities that this limit bounds; None for the model's quantity with its key."""
        return None

    def on_plate(self, plate: Plate) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on the joint centres of one plate."""
        return ()

    def of_design(self, design: Design) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on quantities of the case, or on several poses together."""
        return ()

    def on_pairs(self, design: Design) -> Iterable[PairFamily]:  # noqa: ARG002 - most limits have none
        """Return this limit's constraints on pairs of values, such as the lengths of a leg at all poses."""
        return ()

    def at_pose(self, pose: PosedRobot) -> Iterable[BoundedConstraint]:  # noqa: ARG002 - some limits have none
        """Return this limit's constraints at one pose."""
        return ()

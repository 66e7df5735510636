"""A limit of a case: its table in the file, its check against the robot, and its constraints.

A limit type is one class in one file of this package, and one row of the registry in
:mod:`screwsynth.nlp.case.limits.registry`. Lengths are in the case's unit and angles in radians. Every constraint's
expression grows with the measured number, so that a lower limit is a lower bound; the constraint's reading brings
bounds and multipliers back to the words of the case.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, NamedTuple, Self, TypeVar

from casadi import SX

from ....models import Dimension, Model, RobotInstance
from ...errors import CaseError
from ...units import Units
from ..checks import check_real
from .constraint import BoundedConstraint
from .pairs import PairFamily

if TYPE_CHECKING:
    from ..table import Table
    from ..toml import TomlValue

#: The value that a case file has at a limit's key: a table, mostly.
TableT = TypeVar("TableT")


class TableField(NamedTuple):
    """A key of the table ``[limits]``: the type of its value, and pydantic's ``Field`` for it."""

    annotation: Any
    info: Any


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


class LimitedCase(NamedTuple):
    """A case as far as its limits read it.

    Attributes:
        model: the robot.
        units: units for people.
        scalars: names of the case's own numbers, and the dimension of each.
    """

    model: Model
    units: Units
    scalars: Mapping[str, Dimension]

    def check_number(
        self,
        key: str,
        value: float | None,
        dimension: Dimension = Dimension.LENGTH,
        *,
        above: float = 0.0,
        most: float = math.inf,
    ) -> None:
        """Refuse a number of a limit that is out of its range.

        Args:
            key: its dotted key below ``limits``.
            value: the number, radians for an angle; None where it is not given.
            dimension: of the number.
            above: the number must be larger than this.
            most: the number may be at most this.

        Raises:
            CaseError: the number is not finite, not above ``above``, or larger than ``most``.
        """
        if value is not None:
            value = check_real(value, f"limits.{key}")
        if value is None or (math.isfinite(value) and above < value <= most):
            return
        allowed = f"above {self.units.text(above, dimension)}" if math.isfinite(above) else "finite"
        if math.isfinite(most):
            allowed += f" and at most {self.units.text(most, dimension)}"
        shown = self.units.shown(value, dimension) if math.isfinite(value) else value
        raise CaseError(f"limits.{key}", f"must be {allowed}", shown)


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


class PosedRobot(NamedTuple):
    """The robot at one pose, as expressions of the program's variables and arguments.

    Attributes:
        model: the robot, in its own symbols.
        robot: the robot at the pose.
        tasks: names of the tasks that the columns of its rates belong to.
        where: end of the names of constraints at this pose; empty for a single pose.
    """

    model: Model
    robot: RobotInstance
    tasks: tuple[str, ...]
    where: str = ""


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

    A subclass is a frozen dataclass whose fields are the limit's numbers. It states the class attributes below, builds
    itself from its table, checks its numbers, and yields its constraints from those of :meth:`on_plate`,
    :meth:`of_design`, :meth:`on_pairs` and :meth:`at_pose` that concern it.

    Attributes:
        key: its key in ``[limits]``; empty for a type whose limits have keys of their own.
        table: type of the value at the key.
        description: a few words for the JSON Schema of case files.
        needs_legs: whether only a robot with legs between joint centres can have it.
        needs_joints: whether only a robot given joint by joint can have it.
        order: place of its constraints among those of other limits on the same plate, design or pose: lower first, and
            in the registry's order where equal.
    """

    key: ClassVar[str]
    table: ClassVar[Any]
    description: ClassVar[str]
    needs_legs: ClassVar[bool] = False
    needs_joints: ClassVar[bool] = False
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
    @abc.abstractmethod
    def from_table(cls, written: Written[TableT]) -> Self:
        """Return the limit that a case file writes.

        Raises:
            CaseError: the table contradicts itself.
        """

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - most limits need neither
        """Return the keys of ``[limits]`` that state this limit, the inverse of :meth:`from_table`.

        This is a table of the limit's own numbers. A limit on angles, which a file has in its own unit, or with another
        table, has a method of its own.

        Args:
            model: the robot.
            units: the file's units.
        """
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {self.key: {name: value for name, value in values.items() if value is not None}}

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

    @abc.abstractmethod
    def check(self, case: LimitedCase) -> None:
        """Refuse this limit where a number of it is out of its range, or where its numbers contradict each other.

        Raises:
            CaseError: in the words of a case file.
        """

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

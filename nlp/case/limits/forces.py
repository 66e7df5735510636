"""Limits on forces, speeds and powers of actuators, for the loads on the platform and its fastest motions.

:mod:`..forces` has the expressions. A limit is on all actuators, or on one by its name.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, ClassVar, Self

from casadi import SX
from pydantic import BeforeValidator, Discriminator, Tag

from ....models import Dimension, Model
from ....models.statics import DrivenJoint, driven_joints
from ...errors import CaseError, nearest
from ...units import Units
from ..checks import check_statics
from ..forces import PosedForces, dimension_of_force, dimension_of_speed
from ..table import Table, fault_of
from ..toml import TomlValue
from .constraint import LENGTH, BoundedConstraint, Reading, between
from .interval import AtMost, IntervalTable
from .limit import Limit, LimitedCase, NumberRange, PosedRobot, Ranges, TableT, Written


def _kind(value: object) -> str:
    """Return the branch of a union for a table of numbers, or for one such table for each of several actuators."""
    is_each = isinstance(value, dict) and any(isinstance(part, dict | Table) for part in value.values())
    return "<list>" if is_each else "<range>"


def _unmixed(value: object) -> object:
    """Return the value at a limit's key, or refuse numbers for all actuators beside tables of single ones."""
    if isinstance(value, dict) and len({isinstance(part, dict | Table) for part in value.values()}) > 1:
        raise fault_of("", "has numbers for all actuators beside a table for one; write one table for each actuator")
    return value


_Each = Discriminator(_kind), BeforeValidator(_unmixed)
_Intervals = Annotated[
    Annotated[IntervalTable, Tag("<range>")] | Annotated[dict[str, IntervalTable], Tag("<list>")], *_Each
]
_Largest = Annotated[Annotated[AtMost, Tag("<range>")] | Annotated[dict[str, AtMost], Tag("<list>")], *_Each]


class LoadedLimit(Limit[TableT], abc.ABC):
    """A limit on what loads on the platform or its fastest motions demand of actuators.

    Attributes:
        needs_loads: whether the numbers depend on loads.
    """

    needs_loads: ClassVar[bool] = True

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether a robot's actuators are known."""
        return bool(driven_joints(model))

    def check(self, case: LimitedCase) -> None:
        """Refuse a number out of its range, and a case without the loads that the limit needs.

        Raises:
            CaseError: in the words of a case file.
        """
        super().check(case)
        if self.needs_loads and not case.loading.loads:
            raise CaseError(f"limits.{self.name}", "means nothing without [[load]]")


@dataclass(frozen=True)
class ActuatorLimit(LoadedLimit[Table], abc.ABC):
    """A limit on a number of all actuators, or of one.

    Attributes:
        actuator: name of the one; empty for all.
        max: largest number, in radians of an actuator that turns; None where there is none.
    """

    actuator: str = ""
    _: KW_ONLY
    max: float | None = None

    table: ClassVar[Any] = _Largest

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type that a case file states.

        Raises:
            CaseError: a table is neither numbers nor one table of numbers by actuator.
        """
        given = getattr(limits, cls.key)
        if given is None:
            return
        tables = given if isinstance(given, dict) else {"": given}
        for name, table in tables.items():
            key = f"{cls.key}.{name}" if name else cls.key
            yield cls.from_table(Written(key, table, limits, model, units))

    @classmethod
    def from_table(cls, written: Written[Table]) -> Self:
        """Return the limit that a case file writes."""
        name = written.key.removeprefix(cls.key).removeprefix(".")
        return cls(name, **written.numbers(cls(name).ranges(written.model)))

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit."""
        (table,) = super().to_keys(model, units).values()
        return {self.key: {self.actuator: table} if self.actuator else table}

    @property
    def name(self) -> str:
        """Dotted key of this limit in ``[limits]``."""
        return f"{self.key}.{self.actuator}" if self.actuator else self.key

    def limited(self, model: Model) -> list[tuple[int, DrivenJoint]]:
        """Return the actuators that are limited, with their indices."""
        return [pair for pair in enumerate(driven_joints(model)) if self.actuator in ("", pair[1].name)]

    @classmethod
    @abc.abstractmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of the number of an actuator."""

    def ranges(self, model: Model) -> Ranges:
        """Return the range of the largest number."""
        joint = next((joint for _, joint in self.limited(model)), None)
        return {"max": NumberRange(Dimension.NUMBER if joint is None else self.dimension(joint))}

    def check(self, case: LimitedCase) -> None:
        """Refuse an unknown actuator, actuators of two kinds, numbers out of their range, and what is not known.

        Raises:
            CaseError: in the words of a case file.
        """
        check_statics(case.model, f"limits.{self.name}")
        every = [joint.name for joint in driven_joints(case.model)]
        if self.actuator and self.actuator not in every:
            fault = f"is no actuator of {case.model.name!r}; {nearest(self.actuator, every)}"
            raise CaseError(f"limits.{self.name}", fault)
        if len({self.dimension(joint) for _, joint in self.limited(case.model)}) > 1:
            fault = "means actuators that turn and actuators that slide; give one table for each, by its name"
            raise CaseError(f"limits.{self.name}", f"{fault}: {', '.join(every)}")
        super().check(case)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the number of each actuator, and under each load case where it depends on loads."""
        for k, joint in self.limited(pose.model):
            name = f"{self.key} actuator {joint.name}"
            reading = Reading(self.dimension(joint), above=self.ranges(pose.model)["max"].above)
            yield from self.of_actuator(pose.forces, k, name, pose.where, reading)

    @abc.abstractmethod
    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return the constraints of one actuator.

        Args:
            forces: of all actuators at the pose.
            k: index of the actuator.
            name: beginning of the names of its constraints.
            where: their end.
            reading: how the number reads.
        """

    def at_most(self, name: str, number: SX, reading: Reading, largest: float) -> BoundedConstraint:
        """Return the constraint that a number is at most the limit's."""
        return between(name, number, reading, ("", f"{self.name}.max"), upper=largest)


@dataclass(frozen=True)
class ActuatorForce(ActuatorLimit):
    """Largest and smallest force of actuators, or torque of those that turn, under every load at every pose.

    A force is positive in the sense of the actuator's rate: a leg that pushes. Without a smallest force the largest one
    bounds the size of both senses.

    Attributes:
        actuator: name of the actuator; empty for all.
        max: largest force; None where there is none.
        min: smallest force, signed; None where there is none.
    """

    _: KW_ONLY
    min: float | None = None

    key: ClassVar[str] = "actuator_force"
    table: ClassVar[Any] = _Intervals
    description: ClassVar[str] = "force or torque of actuators under the loads, of all or by actuator; max bounds sizes"

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of an actuator's force."""
        return dimension_of_force(joint)

    def ranges(self, model: Model) -> Ranges:
        """Return the ranges of both numbers."""
        size = super().ranges(model)["max"]
        signed = size._replace(above=-math.inf)
        # A largest number alone bounds a size.
        return {"min": signed, "max": size if self.min is None else signed}

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return its largest force in both senses, or its largest and its smallest one, under each load case."""
        for case in forces.cases:
            at = f"load {case.case.name}{where}"
            if self.max is not None:
                yield self.at_most(f"{name} {at}", case.largest[k], reading, self.max)
                if self.min is None:
                    yield self.at_most(f"{name} backwards {at}", -case.smallest[k], reading, self.max)
            if self.min is not None:
                key = (f"{self.name}.min", "")
                yield between(f"{name} smallest {at}", case.smallest[k], reading, key, lower=self.min)


@dataclass(frozen=True)
class ActuatorSpeed(ActuatorLimit):
    """Largest speed of actuators in the platform's fastest motions, at every pose."""

    key: ClassVar[str] = "actuator_speed"
    description: ClassVar[str] = "speed of actuators in the fastest motions, of all or by actuator"
    needs_loads: ClassVar[bool] = False
    needs_motion: ClassVar[bool] = True

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of an actuator's speed."""
        return dimension_of_speed(joint)

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return its largest speed."""
        if self.max is not None:
            yield self.at_most(f"{name}{where}", forces.speeds[k], reading, self.max)


@dataclass(frozen=True)
class ActuatorPower(ActuatorLimit):
    """Largest power of actuators: their largest force times their largest speed, at every pose."""

    key: ClassVar[str] = "actuator_power"
    description: ClassVar[str] = "largest force times largest speed of actuators, of all or by actuator"
    needs_motion: ClassVar[bool] = True

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:  # noqa: ARG003 - a power is the same of both kinds
        """Return the dimension of a power."""
        return Dimension.POWER

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return its largest power in both senses under each load case."""
        for case in forces.cases:
            at = f"load {case.case.name}{where}"
            if self.max is not None:
                yield self.at_most(f"{name} {at}", case.largest[k] * forces.speeds[k], reading, self.max)
                yield self.at_most(f"{name} backwards {at}", -case.smallest[k] * forces.speeds[k], reading, self.max)


@dataclass(frozen=True)
class Deflection(LoadedLimit[AtMost]):
    """Largest displacement of the platform's origin under every load, at every pose, as the actuators give way.

    Attributes:
        max: largest displacement, length.
    """

    max: float

    key: ClassVar[str] = "deflection"
    table: ClassVar[Any] = AtMost
    description: ClassVar[str] = "of the platform's origin under the loads, as actuators give way"
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.LENGTH)}
    order: ClassVar[int] = 1

    def check(self, case: LimitedCase) -> None:
        """Refuse a number out of its range, and a case without loads or without stiffness.

        Raises:
            CaseError: in the words of a case file.
        """
        super().check(case)
        if case.loading.stiffness is None:
            raise CaseError(f"limits.{self.key}", "needs robot.actuator_stiffness")

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the displacement under each load case."""
        for case in pose.forces.cases:
            name = f"{self.key} load {case.case.name}{pose.where}"
            number = pose.forces.deflection(case)
            yield between(name, number, LENGTH, ("", f"{self.key}.max"), upper=self.max)

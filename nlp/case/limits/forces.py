"""Limits on forces, speeds and powers of actuators, and on the deflection of the platform.

They hold under the loads and at the largest speeds of the platform, whose expressions are in :mod:`..forces`. A limit
is on all actuators, or on one by its name.
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
    """Return the form of a limit: ``<range>`` for one table for all actuators, ``<list>`` for one table for each."""
    is_each = isinstance(value, dict) and any(isinstance(part, dict | Table) for part in value.values())
    return "<list>" if is_each else "<range>"


def _unmixed(value: object) -> object:
    """Return the value of a limit, or refuse numbers for all actuators together with tables for single ones."""
    if isinstance(value, dict) and len({isinstance(part, dict | Table) for part in value.values()}) > 1:
        raise fault_of("", "has both numbers for all actuators and a table for one; write a table for each actuator")
    return value


_Each = Discriminator(_kind), BeforeValidator(_unmixed)
_Intervals = Annotated[
    Annotated[IntervalTable, Tag("<range>")] | Annotated[dict[str, IntervalTable], Tag("<list>")], *_Each
]
_Largest = Annotated[Annotated[AtMost, Tag("<range>")] | Annotated[dict[str, AtMost], Tag("<list>")], *_Each]


class LoadedLimit(Limit[TableT], abc.ABC):
    """Limit on a quantity that depends on the loads or on the largest speeds of the platform.

    Attributes:
        needs_loads: If true, the limited quantity depends on loads.
    """

    needs_loads: ClassVar[bool] = True

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether the actuators of a robot are known."""
        return bool(driven_joints(model))

    def check(self, case: LimitedCase) -> None:
        """Check the values of the limit, and that the case has loads if the limit needs them.

        Raises:
            CaseError: a value is outside of its range, or loads are missing.
        """
        super().check(case)
        if self.needs_loads and not case.loading.loads:
            raise CaseError(f"limits.{self.name}", "needs a table [[load]] with a load on the platform")


@dataclass(frozen=True)
class ActuatorLimit(LoadedLimit[Table], abc.ABC):
    """Limit on a quantity of all actuators, or of a single actuator.

    Attributes:
        actuator: name of the actuator; empty for all actuators.
        max: largest allowed value, with radians for revolute actuators; None for no upper limit.
    """

    actuator: str = ""
    _: KW_ONLY
    max: float | None = None

    table: ClassVar[Any] = _Largest

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type in a case file."""
        given = getattr(limits, cls.key)
        if given is None:
            return
        tables = given if isinstance(given, dict) else {"": given}
        for name, table in tables.items():
            key = f"{cls.key}.{name}" if name else cls.key
            yield cls.from_table(Written(key, table, limits, model, units))

    @classmethod
    def from_table(cls, written: Written[Table]) -> Self:
        """Return the limit of a case file."""
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
        """Return index and joint of each limited actuator."""
        return [pair for pair in enumerate(driven_joints(model)) if self.actuator in ("", pair[1].name)]

    @classmethod
    @abc.abstractmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of the limited quantity of an actuator."""

    def ranges(self, model: Model) -> Ranges:
        """Return the allowed range of the largest value."""
        joint = next((joint for _, joint in self.limited(model)), None)
        return {"max": NumberRange(Dimension.NUMBER if joint is None else self.dimension(joint))}

    def check(self, case: LimitedCase) -> None:
        """Check the actuator and the values of the limit.

        Raises:
            CaseError: there is no such actuator, revolute and prismatic actuators have the same limit, a value is
                outside of its range, or the loads do not determine the actuator forces of the robot.
        """
        check_statics(case.model, f"limits.{self.name}")
        every = [joint.name for joint in driven_joints(case.model)]
        if self.actuator and self.actuator not in every:
            fault = f"no such actuator of {case.model.name!r}; {nearest(self.actuator, every)}"
            raise CaseError(f"limits.{self.name}", fault)
        if len({self.dimension(joint) for _, joint in self.limited(case.model)}) > 1:
            fault = "matches both revolute and prismatic actuators; give one table for each, by name"
            raise CaseError(f"limits.{self.name}", f"{fault}: {', '.join(every)}")
        super().check(case)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraints on the quantity of each actuator, for each load case if it depends on loads."""
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
            forces: forces and speeds of all actuators at the pose.
            k: index of the actuator.
            name: prefix of the names of the constraints.
            where: suffix of the names of the constraints.
            reading: conversion between bounds and limits.
        """

    def at_most(self, name: str, number: SX, reading: Reading, largest: float) -> BoundedConstraint:
        """Return the constraint for an upper limit.

        Args:
            name: name of the constraint.
            number: (1, 1) limited quantity.
            reading: conversion between bounds and limits.
            largest: upper limit.
        """
        return between(name, number, reading, ("", f"{self.name}.max"), upper=largest)


@dataclass(frozen=True)
class ActuatorForce(ActuatorLimit):
    """Largest and smallest actuator force, or torque of revolute actuators, under every load at every pose.

    A force is positive in the sense of the actuator's rate: a pushing leg. Without ``min``, ``max`` limits the
    magnitude of the force in both senses.

    Attributes:
        actuator: name of the actuator; empty for all actuators.
        max: largest allowed force; None for no upper limit.
        min: smallest allowed force, signed; None for no lower limit.
    """

    _: KW_ONLY
    min: float | None = None

    key: ClassVar[str] = "actuator_force"
    table: ClassVar[Any] = _Intervals
    description: ClassVar[str] = (
        "largest and smallest force or torque of actuators under the loads, for all actuators or by name; without min, "
        "max limits the magnitude"
    )

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of an actuator's force."""
        return dimension_of_force(joint)

    def ranges(self, model: Model) -> Ranges:
        """Return the allowed ranges of ``min`` and ``max``."""
        size = super().ranges(model)["max"]
        signed = size._replace(above=-math.inf)
        # Without min, max limits the magnitude.
        return {"min": signed, "max": size if self.min is None else signed}

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return the constraints on an actuator's force in both senses, or on largest and smallest, by load case."""
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
    """Largest speed of actuators at the largest speeds of the platform, at every pose."""

    key: ClassVar[str] = "actuator_speed"
    description: ClassVar[str] = (
        "largest speed of actuators at the largest speeds of the platform ([motion]), for all actuators or by name"
    )
    needs_loads: ClassVar[bool] = False
    needs_motion: ClassVar[bool] = True

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:
        """Return the dimension of an actuator's speed."""
        return dimension_of_speed(joint)

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return the constraint on an actuator's largest speed."""
        if self.max is not None:
            yield self.at_most(f"{name}{where}", forces.speeds[k], reading, self.max)


@dataclass(frozen=True)
class ActuatorPower(ActuatorLimit):
    """Largest power of actuators: largest force times largest speed of each actuator, at every pose."""

    key: ClassVar[str] = "actuator_power"
    description: ClassVar[str] = (
        "largest power of actuators, as largest force times largest speed, for all actuators or by name"
    )
    needs_motion: ClassVar[bool] = True

    @classmethod
    def dimension(cls, joint: DrivenJoint) -> Dimension:  # noqa: ARG003 - a power is the same of both kinds
        """Return the dimension of a power."""
        return Dimension.POWER

    def of_actuator(
        self, forces: PosedForces, k: int, name: str, where: str, reading: Reading
    ) -> Iterator[BoundedConstraint]:
        """Return the constraints on an actuator's power in both senses, for each load case."""
        for case in forces.cases:
            at = f"load {case.case.name}{where}"
            if self.max is not None:
                yield self.at_most(f"{name} {at}", case.largest[k] * forces.speeds[k], reading, self.max)
                yield self.at_most(f"{name} backwards {at}", -case.smallest[k] * forces.speeds[k], reading, self.max)


@dataclass(frozen=True)
class Deflection(LoadedLimit[AtMost]):
    """Largest displacement of the platform origin under every load, at every pose, by the actuators' compliance.

    Attributes:
        max: largest allowed displacement, length.
    """

    max: float

    key: ClassVar[str] = "deflection"
    table: ClassVar[Any] = AtMost
    description: ClassVar[str] = (
        "largest displacement of the platform origin under the loads, by the compliance of the actuators "
        "(robot.actuator_stiffness)"
    )
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.LENGTH)}
    order: ClassVar[int] = 1

    def check(self, case: LimitedCase) -> None:
        """Check the limit against the case.

        Raises:
            CaseError: the value is outside of its range, or loads or actuator stiffness are missing.
        """
        super().check(case)
        if case.loading.stiffness is None:
            raise CaseError(f"limits.{self.key}", "needs robot.actuator_stiffness, force per displacement")

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the displacement for each load case."""
        for case in pose.forces.cases:
            name = f"{self.key} load {case.case.name}{pose.where}"
            number = pose.forces.deflection(case)
            yield between(name, number, LENGTH, ("", f"{self.key}.max"), upper=self.max)

"""Loads on the platform, and its fastest motions: what forces, speeds and powers of actuators follow from.

A load is what the world does to the platform: a force and a moment at a point, a weight, and on top any force and any
moment up to a size in any direction. Loads are alternatives, each with all that are always there. Angles are radians.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Model
from ...models.parts import PlatformMotions
from ...models.values import dataclass
from ..errors import CaseError, nearest
from ..units import Units
from .checks import check_real, check_size, check_vector

#: Acceleration of gravity: weight of a unit of mass, in newtons and kilograms.
GRAVITY = (0.0, 0.0, -9.81)
#: The units in which it need not be stated.
_KNOWN = ("m", "N")
#: Largest number of loads with both signs that are always there: each doubles the loads that act together.
_MOST_SIGNS = 6
_NONE = (0.0, 0.0, 0.0)
#: A number or an expression.
Length = TypeVar("Length", float, SX)
#: Work below this part of what force and moment could do is none.
_NO_WORK = 1e-9


@dataclass(frozen=True, eq=False)
class Load:
    """A load on the platform.

    Attributes:
        name: a few words.
        force: (3,) force.
        moment: (3,) moment about the point.
        point: (3,) where it acts, in the platform's frame, length; the centre of a mass.
        in_platform: whether force and moment are in the platform's directions, instead of the world's.
        both_signs: whether the opposite load counts too.
        any_force: size of a further force in any direction at the point.
        any_moment: size of a further moment about any axis.
        mass: mass whose weight the load is: force over the acceleration of gravity.
        always: whether it is added to each other load, and stands alone where there is none.
    """

    name: str = "load"
    force: Sequence[float] = _NONE
    moment: Sequence[float] = _NONE
    point: Sequence[float] = _NONE
    in_platform: bool = False
    both_signs: bool = False
    any_force: float = 0.0
    any_moment: float = 0.0
    mass: float = 0.0
    always: bool = False

    def __post_init__(self) -> None:
        for part in ("force", "moment", "point"):
            object.__setattr__(self, part, tuple(getattr(self, part)))

    @property
    def is_fixed(self) -> bool:
        """Whether it has a force, a moment or a weight of one direction."""
        return bool(self.mass or any(self.force) or any(self.moment))

    def check(self, key: str) -> None:
        """Refuse numbers that mean nothing.

        Args:
            key: its dotted key, for messages.

        Raises:
            CaseError: a number is not finite or negative, or the load is nothing.
        """
        for part in ("force", "moment", "point"):
            for index, value in enumerate(check_vector(getattr(self, part), f"{key}.{part}").tolist()):
                check_size(value, f"{key}.{part}[{index}]")
        sizes = (("any.force", self.any_force), ("any.moment", self.any_moment), ("mass", self.mass))
        for name, size in sizes:
            if not (math.isfinite(check_real(size, f"{key}.{name}")) and size >= 0):
                raise CaseError(f"{key}.{name}", "must be at least 0 and finite", size)
            check_size(size, f"{key}.{name}")
        if not (self.is_fixed or self.any_force or self.any_moment):
            raise CaseError(key, "is no load: give force, moment, any or mass")
        if self.both_signs and not self.is_fixed:
            raise CaseError(f"{key}.sign", "means nothing without force or moment", "both")
        beside = (*self.force, *self.moment, self.any_force, self.any_moment, self.in_platform, self.both_signs)
        if self.mass and any(beside):
            fault = "cannot stand beside force, moment, frame, sign or any; write another [[load]]"
            raise CaseError(f"{key}.mass", fault, self.mass)


@dataclass(frozen=True)
class Motion:
    """The platform's fastest motions, in any direction and about any axis, both at once.

    Attributes:
        linear: largest speed of the platform's origin, length per second.
        angular: largest angular speed, radians per second.
    """

    linear: float = 0.0
    angular: float = 0.0

    def length(self, size: Length) -> float | Length:
        """Return the length that makes angular velocities comparable with linear ones: the ratio of both speeds.

        Args:
            size: characteristic size of the robot, length; the result where only one of both speeds is stated.
        """
        return self.linear / self.angular if self.linear and self.angular else size

    def check(self) -> None:
        """Refuse a speed that is negative or not finite, and no motion at all.

        Raises:
            CaseError: in the words of a case file.
        """
        for name, speed in (("linear", self.linear), ("angular", self.angular)):
            if not (math.isfinite(check_real(speed, f"motion.{name}")) and speed >= 0):
                raise CaseError(f"motion.{name}", "must be at least 0 and finite", speed)
            check_size(speed, f"motion.{name}")
        if not (self.linear or self.angular):
            raise CaseError("motion", "must have linear, angular, or both, above 0")


class SignedLoad(NamedTuple):
    """A load with a factor of its fixed part: 1, or -1 for the opposite load."""

    load: Load
    sign: float


class LoadCase(NamedTuple):
    """Loads that act together.

    Attributes:
        name: of the load, and of those whose opposite is meant.
        parts: the loads.
        gravity: (3,) acceleration, force over mass.
    """

    name: str
    parts: tuple[SignedLoad, ...]
    gravity: Sequence[float]

    def wrench(self, rotation: SX) -> SX:
        """Return the force and the moment about the platform's origin, (6, 1), in the world frame.

        Args:
            rotation: (3, 3) platform to world coordinates.
        """
        force, moment = SX.zeros(3), SX.zeros(3)
        for load, sign in self.parts:
            turn = rotation if load.in_platform else SX.eye(3)
            own = sign * (turn @ _vector(load.force) + load.mass * _vector(self.gravity))
            force += own
            moment += sign * (turn @ _vector(load.moment)) + ca.cross(rotation @ _vector(load.point), own)
        return ca.vertcat(force, moment)


def _vector(values: Sequence[float]) -> SX:
    return SX([float(value) for value in values])


class Loading(NamedTuple):
    """What acts on the platform of a case, and how fast it moves.

    Attributes:
        loads: the loads.
        motion: its fastest motions; None where none are stated.
        gravity: (3,) acceleration of gravity, force over mass; None for that in metres, newtons and kilograms.
        stiffness: force of each actuator by its displacement, or torque by radian, by its name; of all under an empty
            name; None where it is not known.
    """

    loads: tuple[Load, ...] = ()
    motion: Motion | None = None
    gravity: Sequence[float] | None = None
    stiffness: Mapping[str, float] | None = None

    def check(self, units: Units) -> None:
        """Refuse loads, motions and a gravity that mean nothing.

        Raises:
            CaseError: in the words of a case file.
        """
        names = [each.name for each in self.loads]
        for index, load in enumerate(self.loads):
            if not load.name:
                raise CaseError(f"load[{index}].name", "must not be empty", load.name)
            if load.name in names[:index]:
                raise CaseError(f"load[{index}].name", "is used by an earlier load", load.name)
            load.check(f"load[{index}]")
        self._check_cases()
        if self.motion is not None:
            self.motion.check()
        self._check_gravity(units)
        for name, value in (self.stiffness or {}).items():
            key = f"robot.actuator_stiffness{f'.{name}' if name else ''}"
            if not (math.isfinite(check_real(value, key)) and value > 0):
                raise CaseError(key, "must be above 0 and finite", value)

    def _check_cases(self) -> None:
        """Refuse more loads that act together than can be told apart, by their number or by their names."""
        signs = sum(load.both_signs for load in self.loads if load.always)
        if signs > _MOST_SIGNS:
            fault = f"has {signs} loads with always and both signs, which act together in 2^{signs} ways; at most"
            raise CaseError("load", f"{fault} {_MOST_SIGNS}")
        names = [each.name for each in self.cases]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise CaseError("load", f"has loads that act together under one name, {twice!r}, twice; rename a load")

    def _check_gravity(self, units: Units) -> None:
        """Refuse a gravity of zero, and a mass without one where the units do not say it."""
        if self.gravity is not None:
            for index, value in enumerate(check_vector(self.gravity, "gravity.acceleration").tolist()):
                check_size(value, f"gravity.acceleration[{index}]")
            if not any(self.gravity):
                raise CaseError("gravity.acceleration", "must not be zero")
        elif (units.length, units.force) != _KNOWN and any(load.mass for load in self.loads):
            fault = f"is missing: a mass times it is a weight in {units.force}"
            known = ", [0, 0, -9.81] for a mass in kg" if units.force == _KNOWN[1] else ""
            raise CaseError("gravity.acceleration", fault + known)

    def check_work(self, model: Model) -> None:
        """Refuse a load that does no work in any motion of the platform, where statics does not say what holds it.

        Its actuators hold nothing of it, as a robot in a plane nothing of a force out of the plane.

        Args:
            model: the robot.

        Raises:
            CaseError: in the words of a case file.
        """
        if model.generic is None or not model.generic.is_shared:
            return
        for index, load in enumerate(self.loads):
            alone = next(self._signed([load], []))
            if not any(_does_work(alone, each) for each in model.generic.motions):
                key, value = _given_part(load)
                fault = f"load {load.name!r} does no work in any motion of {model.name!r}: its actuators do not hold it"
                allowed = _working_parts(model.generic.motions)
                raise CaseError(f"load[{index}]{key}", f"{fault}; allowed is a load with {allowed}", value)

    def stiffness_of(self, actuators: Sequence[str]) -> list[float]:
        """Return the stiffness of actuators by their names.

        Raises:
            CaseError: one has none, or there is no actuator of a name.
        """
        given = self.stiffness or {}
        if given.keys() == {""}:
            return [given[""]] * len(actuators)
        for name in given:
            if name not in actuators:
                fault = f"is no actuator of the robot; {nearest(name, actuators)}"
                raise CaseError(f"robot.actuator_stiffness.{name}", fault)
        missing = next((name for name in actuators if name not in given), None)
        if missing is not None:
            raise CaseError("robot.actuator_stiffness", f"has none for actuator {missing}")
        return [given[name] for name in actuators]

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """The loads that act together: each load with those that are always there; those alone without another."""
        always = [load for load in self.loads if load.always]
        each = [[load] for load in self.loads if not load.always] or ([[]] if always else [])
        return tuple(found for own in each for found in self._signed(own, always))

    def _signed(self, own: Sequence[Load], always: Sequence[Load]) -> Iterator[LoadCase]:
        """Yield the load cases of one load, or of none, with those that are always there."""
        loads = [*own, *always]
        whole = " and ".join(load.name for load in own or always)
        for signs in itertools.product(*((1.0, -1.0) if load.both_signs else (1.0,) for load in loads)):
            parts = tuple(map(SignedLoad, loads, signs))
            turned = [load.name for load, sign in parts if sign < 0]
            ends = [" reversed"] if turned == [whole] else [f", {each} reversed" for each in turned]
            gravity = GRAVITY if self.gravity is None else self.gravity
            yield LoadCase("".join([whole, *ends]), parts, gravity)


def _does_work(case: LoadCase, at: PlatformMotions) -> bool:
    """Return whether one load, or a part of it of any direction, does work in a motion at a configuration."""
    ((load, _),) = case.parts
    force, moment = np.split(np.array(ca.DM(case.wrench(SX(at.rotation)))).ravel(), 2)
    omega, v = np.split(at.twists, 2)
    arm = at.rotation @ np.array(load.point)
    turn, way, moved = (np.linalg.norm(each, axis=0) for each in (omega, v, v - np.cross(arm, omega.T).T))
    size = np.linalg.norm
    parts = (
        (np.abs(force @ v + moment @ omega), size(force) * way + size(moment) * turn),
        (load.any_force * moved, load.any_force * (way + size(arm) * turn)),
        (load.any_moment * turn, load.any_moment * turn),
    )
    return any(bool((work > _NO_WORK * most).any()) for work, most in parts)


def _given_part(load: Load) -> tuple[str, object]:
    """Return key and value of the only part of a load; empty ones where there are several."""
    parts = {
        key: getattr(load, key.replace(".", "_")) for key in ("force", "moment", "any.force", "any.moment", "mass")
    }
    given = [(f".{key}", np.array(value).tolist()) for key, value in parts.items() if np.any(value)]
    return given[0] if len(given) == 1 else ("", None)


def _working_parts(motions: Sequence[PlatformMotions]) -> str:
    """Return the forces and moments along the world's axes that do work in a motion, in words."""
    every = np.hstack([each.twists for each in motions])
    found = []
    for words, along, rows in (("a force", "along", every[3:]), ("a moment", "about", every[:3])):
        axes = [axis for axis, row in zip("xyz", rows, strict=True) if row.any()]
        found += [words if len(axes) == len(rows) else f"{words} {along} {' or '.join(axes)}"] if axes else []
    return ", or ".join(found)


#: No loads, and no motions.
NO_LOADING = Loading()

"""Loads on the platform and its largest speeds, from which forces, speeds and powers of the actuators follow.

A load is an external force and moment at a point, or a weight; a force and a moment of unknown direction may be added.
Loads are alternatives: each acts together with the permanent loads only. Angles are radians.
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
from ..errors import CaseError, load_words, nearest
from ..units import Units
from .checks import check_real, check_size, check_vector

#: Default acceleration of gravity, newtons per kilogram.
GRAVITY = (0.0, 0.0, -9.81)
#: Units of length and force for which the default gravity is used.
_KNOWN = ("m", "N")
#: Largest number of permanent loads with both signs: each one doubles the number of load cases.
_MOST_SIGNS = 6
_NONE = (0.0, 0.0, 0.0)
#: A number or an expression.
Length = TypeVar("Length", float, SX)
#: Work below this fraction of the largest possible work of force and moment counts as zero.
_NO_WORK = 1e-9


@dataclass(frozen=True, eq=False)
class Load:
    """External load on the platform.

    Attributes:
        name: name of the load.
        force: (3,) force on the platform.
        moment: (3,) moment on the platform, about the point.
        point: (3,) point at which the force acts, or centre of the mass, in the platform frame, length.
        in_platform: If true, force and moment are in the platform frame; if false, in the world frame.
        both_signs: If true, the opposite force and moment count too.
        any_force: magnitude of an additional force of unknown direction at the point.
        any_moment: magnitude of an additional moment about an unknown axis.
        mass: mass whose weight is the load, force per acceleration of gravity; 0 for no mass.
        always: If true, the load is permanent: it acts together with each of the other loads.
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
        """True if the load has a force, a moment or a weight of known direction."""
        return bool(self.mass or any(self.force) or any(self.moment))

    def check(self, key: str) -> None:
        """Check the values of the load.

        Args:
            key: dotted key of the load, for messages.

        Raises:
            CaseError: a value is not finite, a magnitude is negative, the load is empty, or a mass has a force too.
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
            raise CaseError(key, "is empty: give force, moment, any or mass")
        if self.both_signs and not self.is_fixed:
            raise CaseError(f"{key}.sign", "has no effect without force or moment; remove it", "both")
        beside = (*self.force, *self.moment, self.any_force, self.any_moment, self.in_platform, self.both_signs)
        if self.mass and any(beside):
            fault = "conflicts with force, moment, frame, sign and any; write another [[load]]"
            raise CaseError(f"{key}.mass", fault, self.mass)


@dataclass(frozen=True)
class Motion:
    """Largest speeds of the platform, in any direction and about any axis at the same time.

    Attributes:
        linear: largest speed of the platform origin, length per second.
        angular: largest angular speed of the platform, radians per second.
    """

    linear: float = 0.0
    angular: float = 0.0

    def length(self, size: Length) -> float | Length:
        """Return the ratio of linear to angular speed, by which angular velocities become comparable with linear ones.

        Args:
            size: characteristic size of the robot, length; the result if one of the two speeds is 0.
        """
        return self.linear / self.angular if self.linear and self.angular else size

    def check(self) -> None:
        """Check both speeds.

        Raises:
            CaseError: a speed is negative or not finite, or both are 0.
        """
        for name, speed in (("linear", self.linear), ("angular", self.angular)):
            if not (math.isfinite(check_real(speed, f"motion.{name}")) and speed >= 0):
                raise CaseError(f"motion.{name}", "must be at least 0 and finite", speed)
            check_size(speed, f"motion.{name}")
        if not (self.linear or self.angular):
            raise CaseError("motion", "is empty: give linear, angular, or both, above 0")


class SignedLoad(NamedTuple):
    """Load, and the sign of its force and moment of known direction: 1, or -1 for the opposite load."""

    load: Load
    sign: float


class LoadCase(NamedTuple):
    """Load case: loads that act together.

    Attributes:
        name: name of the load, followed by the names of reversed loads.
        parts: loads with their signs.
        gravity: (3,) acceleration of gravity, force per mass.
    """

    name: str
    parts: tuple[SignedLoad, ...]
    gravity: Sequence[float]

    def wrench(self, rotation: SX) -> SX:
        """Return the wrench (6, 1) of the loads of known direction: force, then moment about the platform origin.

        Args:
            rotation: (3, 3) rotation from platform to world coordinates.

        Returns:
            Wrench in the world frame.
        """
        force, moment = SX.zeros(3), SX.zeros(3)
        for load, sign in self.parts:
            turn = rotation if load.in_platform else SX.eye(3)
            pull = sign * (turn @ _vector(load.force) + load.mass * _vector(self.gravity))
            force += pull
            moment += sign * (turn @ _vector(load.moment)) + ca.cross(rotation @ _vector(load.point), pull)
        return ca.vertcat(force, moment)


def _vector(values: Sequence[float]) -> SX:
    return SX([float(value) for value in values])


class Loading(NamedTuple):
    """Loads on the platform, its largest speeds, gravity, and stiffness of the actuators.

    Attributes:
        loads: external loads on the platform.
        motion: largest speeds of the platform; None if not stated.
        gravity: (3,) acceleration of gravity, force per mass; None for 9.81 N/kg along -z.
        stiffness: stiffness of each actuator by name, force per displacement or torque per radian; the key ``""`` is
            that of all actuators; None if not known.
    """

    loads: tuple[Load, ...] = ()
    motion: Motion | None = None
    gravity: Sequence[float] | None = None
    stiffness: Mapping[str, float] | None = None

    def check(self, units: Units) -> None:
        """Check loads, motion, gravity and stiffness.

        Args:
            units: units of the case, which decide if masses need a gravity.

        Raises:
            CaseError: a value is missing or not allowed, or two loads have the same name.
        """
        names = [each.name for each in self.loads]
        for index, load in enumerate(self.loads):
            if not load.name:
                raise CaseError(f"load[{index}].name", "must not be empty", load.name)
            if load.name in names[:index]:
                raise CaseError(f"load[{index}].name", "is used by an earlier load; rename one", load.name)
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
        """Refuse too many load cases, and load cases with the same name."""
        signs = sum(load.both_signs for load in self.loads if load.always)
        if signs > _MOST_SIGNS:
            fault = f"must have at most {_MOST_SIGNS} loads with always = true and both signs, got {signs}"
            raise CaseError("load", f"{fault}: they give 2^{signs} load cases")
        names = [each.name for each in self.cases]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise CaseError("load", f"gives two load cases with the name {twice!r}; rename a load")

    def _check_gravity(self, units: Units) -> None:
        """Refuse a gravity of zero, and masses without gravity in units other than m and N."""
        if self.gravity is not None:
            for index, value in enumerate(check_vector(self.gravity, "gravity.acceleration").tolist()):
                check_size(value, f"gravity.acceleration[{index}]")
            if not any(self.gravity):
                raise CaseError("gravity.acceleration", "must not be zero; remove the masses for no gravity")
        elif (units.length, units.force) != _KNOWN and any(load.mass for load in self.loads):
            fault = (
                f"is missing: give [gravity] acceleration in units in which mass times acceleration is in {units.force}"
            )
            known = ", such as [0, 0, -9.81] for a mass in kg" if units.force == _KNOWN[1] else ""
            raise CaseError("gravity.acceleration", fault + known)

    def check_work(self, model: Model) -> None:
        """Refuse a load that does no work in any motion of the platform, such as a force normal to a planar robot.

        The actuators do not balance such a load, and statics does not determine the joint forces that do.

        Args:
            model: the robot.

        Raises:
            CaseError: a load does no work.
        """
        if model.generic is None or not model.generic.is_shared:
            return
        for index, load in enumerate(self.loads):
            single = next(self._signed([load], []))
            if not any(_does_work(single, each) for each in model.generic.motions):
                key, value = _given_part(load)
                fault = (
                    f"{load_words(load.name)} does no work in any motion of {model.name!r}, so no actuator balances it"
                )
                allowed = _working_parts(model.generic.motions)
                raise CaseError(f"load[{index}]{key}", f"{fault}; give {allowed}", value)

    def stiffness_of(self, actuators: Sequence[str]) -> list[float]:
        """Return the stiffness of each actuator.

        Args:
            actuators: names of all actuators.

        Raises:
            CaseError: an actuator has no stiffness, or there is no actuator with a given name.
        """
        given = self.stiffness or {}
        if given.keys() == {""}:
            return [given[""]] * len(actuators)
        for name in given:
            if name not in actuators:
                fault = f"no such actuator; {nearest(name, actuators)}"
                raise CaseError(f"robot.actuator_stiffness.{name}", fault)
        missing = next((name for name in actuators if name not in given), None)
        if missing is not None:
            fault = f"is missing for actuator {missing}: give one number for all, or one for each actuator"
            raise CaseError("robot.actuator_stiffness", fault)
        return [given[name] for name in actuators]

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """Load cases: each load together with the permanent loads; the permanent loads only, if there are no others."""
        always = [load for load in self.loads if load.always]
        each = [[load] for load in self.loads if not load.always] or ([[]] if always else [])
        return tuple(case for variable in each for case in self._signed(variable, always))

    def _signed(self, variable: Sequence[Load], always: Sequence[Load]) -> Iterator[LoadCase]:
        """Yield the load cases of one load, or of none, with the permanent loads, for all combinations of signs."""
        loads = [*variable, *always]
        whole = " and ".join(load.name for load in variable or always)
        for signs in itertools.product(*((1.0, -1.0) if load.both_signs else (1.0,) for load in loads)):
            parts = tuple(map(SignedLoad, loads, signs))
            turned = [load.name for load, sign in parts if sign < 0]
            ends = [" reversed"] if turned == [whole] else [f", {each} reversed" for each in turned]
            gravity = GRAVITY if self.gravity is None else self.gravity
            yield LoadCase("".join([whole, *ends]), parts, gravity)


def _does_work(case: LoadCase, at: PlatformMotions) -> bool:
    """Return whether a single load, or its part of unknown direction, does work in a motion at a configuration."""
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
    """Return key and value of a load's only part, such as its force; an empty key for several parts."""
    parts = {
        key: getattr(load, key.replace(".", "_")) for key in ("force", "moment", "any.force", "any.moment", "mass")
    }
    given = [(f".{key}", np.array(value).tolist()) for key, value in parts.items() if np.any(value)]
    return given[0] if len(given) == 1 else ("", None)


def _working_parts(motions: Sequence[PlatformMotions]) -> str:
    """Return a description of the forces and moments along the world axes that do work in a motion."""
    every = np.hstack([each.twists for each in motions])
    found = []
    for words, along, rows in (("a force", "along", every[3:]), ("a moment", "about", every[:3])):
        axes = [axis for axis, row in zip("xyz", rows, strict=True) if row.any()]
        found += [words if len(axes) == len(rows) else f"{words} {along} {' or '.join(axes)}"] if axes else []
    return ", or ".join(found)


#: No loads and no motion.
NO_LOADING = Loading()

"""Conventions of a controller: units, zero and sense of each actuator, and its world frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from types import MappingProxyType
from typing import Literal

from ...models import Dimension
from ...models.statics import DrivenJoint
from ...models.values import dataclass
from ..errors import CaseError, nearest
from ..units import Units
from .checks import check_real, check_vector
from .toml import TomlValue

#: Metres in a unit of length, for units with a known size.
METRES: Mapping[str, float] = MappingProxyType(
    {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "km": 1e3, "in": 0.0254, "ft": 0.3048}
)
#: No value for any actuator.
_NONE: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Controller:
    """Conventions of a controller that differ from those of the case; they apply to generated kinematics in C.

    Attributes:
        length: unit of length; empty for the length unit of the case.
        angle: unit of actuator angles and of roll, pitch and yaw.
        zero: coordinate of the controller at which the coordinate of the case is 0, by actuator; radians or length of
            the case. An empty name stands for all actuators.
        sign: 1 or -1, sense of the controller's coordinate relative to the case, by actuator; an empty name stands for
            all actuators.
        origin: origin of the controller's world frame in the world frame of the case, length of the case.
        rpy: roll, pitch and yaw of the controller's world frame in the world frame of the case, radians.
    """

    length: str = ""
    angle: Literal["deg", "rad"] = "rad"
    zero: Mapping[str, float] = field(default_factory=lambda: _NONE)
    sign: Mapping[str, float] = field(default_factory=lambda: _NONE)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def zero_of(self, actuator: str) -> float:
        """Return the zero of an actuator by its name."""
        return self.zero.get(actuator, self.zero.get("", 0.0))

    def sign_of(self, actuator: str) -> int:
        """Return the sense of an actuator by its name."""
        return 1 if self.sign.get(actuator, self.sign.get("", 1)) > 0 else -1

    def scale(self, units: Units) -> float:
        """Return the length unit of the controller, in the length unit of the case.

        Raises:
            CaseError: a unit has no known size.
        """
        if self.length in ("", units.length):
            return 1.0
        for key, label in (("controller.length", self.length), ("units.length", units.length)):
            if label not in METRES:
                raise CaseError(key, f"must be one of {', '.join(METRES)}", label)
        # A quotient of the larger one by the smaller one is exact for decimal units.
        case, own = METRES[units.length], METRES[self.length]
        return round(case / own, 9) if case >= own else 1 / round(own / case, 9)

    def check(self, drives: Sequence[DrivenJoint], units: Units) -> None:
        """Refuse conventions that are not finite or name no actuator of the robot.

        Raises:
            CaseError: a convention is not allowed; the message names its key in a case file.
        """
        if self.angle not in ("deg", "rad"):
            raise CaseError("controller.angle", "must be one of 'deg', 'rad'", self.angle)
        self.scale(units)
        names = [each.name for each in drives]
        for key, given in (("zero", self.zero), ("sign", self.sign)):
            for name, value in given.items():
                where = f"controller.{key}{f'.{name}' if name else ''}"
                if name and name not in names:
                    raise CaseError(where, f"is no actuator of the robot; {nearest(name, names)}")
                if not math.isfinite(check_real(value, where)):
                    raise CaseError(where, "must be finite", value)
                if key == "sign" and value not in (1, -1):
                    raise CaseError(where, "must be 1 or -1", value)
        if "" in self.zero and len({each.dimension for each in drives}) > 1:
            fault = "is one value, but the robot has revolute and prismatic actuators: give zero = { NAME = value }"
            raise CaseError("controller.zero", fault, self.zero[""])
        for key, values in (("origin", self.origin), ("rpy", self.rpy)):
            check_vector(values, f"controller.{key}")

    def to_keys(self, drives: Sequence[DrivenJoint], units: Units) -> Mapping[str, TomlValue | None]:
        """Return the keys of ``[controller]`` that state these conventions, without the conventions of the case."""
        dimensions = {each.name: each.dimension for each in drives} | {"": _common(drives)}

        def stated(given: Mapping[str, float]) -> TomlValue | None:
            return None if not given else given[""] if given.keys() == {""} else dict(given)

        zero = {name: units.written(value, dimensions[name]) for name, value in self.zero.items()}
        rpy = [units.written(each, Dimension.ANGLE) for each in self.rpy]
        return {
            "length": self.length or None,
            "angle": self.angle if self.angle != Controller.angle else None,
            "zero": stated(zero),
            "sign": stated({name: int(value) for name, value in self.sign.items()}),
            "origin": list(self.origin) if any(self.origin) else None,
            "rpy": rpy if any(rpy) else None,
        }


def _common(drives: Sequence[DrivenJoint]) -> Dimension:
    """Return the dimension of all actuators; a length for actuators of both kinds, which a check refuses."""
    return Dimension.ANGLE if all(each.dimension is Dimension.ANGLE for each in drives) else Dimension.LENGTH


def controller_of(
    drives: Sequence[DrivenJoint],
    units: Units,
    *,
    length: str,
    angle: Literal["deg", "rad"],
    zero: float | Mapping[str, float] | None,
    sign: float | Mapping[str, float] | None,
    origin: Sequence[float],
    rpy: Sequence[float],
) -> Controller:
    """Return conventions from the values of a case file, which are in its units.

    Args:
        drives: the actuators of the robot.
        units: units of the file.
        length: unit of length of the controller.
        angle: unit of angles of the controller.
        zero: coordinate of the controller at which the coordinate of the case is 0, for all actuators or by name.
        sign: sense of the controller's coordinates, for all actuators or by name.
        origin: (3,) origin of the controller's world frame.
        rpy: (3,) roll, pitch and yaw of the controller's world frame.
    """
    dimensions = {each.name: each.dimension for each in drives} | {"": _common(drives)}

    def by_name(given: float | Mapping[str, float] | None) -> Mapping[str, float]:
        if given is None:
            return _NONE
        return dict(given) if isinstance(given, Mapping) else {"": given}

    zeros = {
        name: units.to_internal(value, dimensions.get(name, Dimension.LENGTH)) for name, value in by_name(zero).items()
    }
    x, y, z = origin
    a, b, c = (units.to_internal(each, Dimension.ANGLE) for each in rpy)
    return Controller(
        length, angle, MappingProxyType(zeros), MappingProxyType(dict(by_name(sign))), (x, y, z), (a, b, c)
    )


#: The conventions of the case itself, with angles in radians.
SAME = Controller()

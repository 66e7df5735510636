"""Names of the numbers of actuators that loads and motions demand."""

from __future__ import annotations

import enum
from typing import NamedTuple


class MotorNumber(enum.Enum):
    """A number of an actuator; each value is the word in results."""

    COORDINATE = "coordinate"
    FORCE = "force"
    SPEED = "speed"
    POWER = "power"


class Motor(NamedTuple):
    """A number of an actuator.

    Attributes:
        number: the number.
        place: index of the actuator.
        actuator: its name.
        load: name of the load case; empty for a number that depends on none.
        is_backwards: whether a power is that of forces below 0.
    """

    number: MotorNumber = MotorNumber.FORCE
    place: int = 0
    actuator: str = ""
    load: str = ""
    is_backwards: bool = False

    @property
    def whose(self) -> tuple[int, str]:
        """The actuator and the load, whose numbers are searched together."""
        return self.place, self.load

"""Robots by name: the shipped ones, and those that other packages offer.

Another package offers a robot by an entry point in the group ``screwsynth.models``: its name is the robot's name in
case files, its object is a function that takes the robot's options as keyword arguments and returns a
:class:`~screwsynth.models.model.Model`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from .hexapod import hexapod
from .model import Model
from .stewart_gough import stewart_gough
from .three_upu import three_upu


class UnknownModelError(KeyError):
    """Error of a name that no robot has."""


RobotFunction = Callable[..., Model]

GROUP = "screwsynth.models"

SHIPPED: Mapping[str, RobotFunction] = MappingProxyType(
    {"stewart-gough": stewart_gough, "hexapod": hexapod, "three-upu": three_upu}
)


def model_names() -> tuple[str, ...]:
    """Return the names of all robots on this machine, the shipped ones first, without importing any robot."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and most runs do not need it

    return (*SHIPPED, *sorted({point.name for point in entry_points(group=GROUP)} - set(SHIPPED)))


def robot_function(name: str) -> RobotFunction:
    """Return the function that builds the named robot. Another package cannot replace a shipped robot.

    Args:
        name: the robot's name in case files.

    Raises:
        UnknownModelError: no robot has that name.
    """
    if name in SHIPPED:
        return SHIPPED[name]
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and most runs do not need it

    for point in entry_points(group=GROUP, name=name):
        function: RobotFunction = point.load()
        return function
    raise UnknownModelError(name)

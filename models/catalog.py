"""Finding a robot by name: the shipped ones, and those that other packages offer.

Another package offers a robot by an entry point in the group ``screwsynth.models``: its name is the robot's name in
case files, its object a function that takes the robot's options as keyword arguments and returns a
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
    """No robot has that name."""


RobotFunction = Callable[..., Model]

GROUP = "screwsynth.models"

SHIPPED: Mapping[str, RobotFunction] = MappingProxyType(
    {"stewart-gough": stewart_gough, "hexapod": hexapod, "three-upu": three_upu}
)


def model_names() -> tuple[str, ...]:
    """Names of all robots on this machine, the shipped ones first; nothing is imported to find out."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and most runs never ask

    return (*SHIPPED, *sorted({point.name for point in entry_points(group=GROUP)} - set(SHIPPED)))


def robot_function(name: str) -> RobotFunction:
    """The function that builds the named robot. A shipped name cannot be taken over by another package.

    Raises:
        UnknownModelError: no robot has that name.
    """
    if name in SHIPPED:
        return SHIPPED[name]
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and most runs never ask

    for point in entry_points(group=GROUP, name=name):
        function: RobotFunction = point.load()
        return function
    raise UnknownModelError(name)

"""Robots with joint-centre errors as further parameters: robots as they are built."""

from __future__ import annotations

from dataclasses import dataclass, replace

from casadi import SX

from .drawing import Scene
from .legs import legged_platform
from .model import Model
from .parts import Dimension, Parameter


@dataclass(frozen=True, eq=False)
class Centre:
    """Joint centre with an error.

    Attributes:
        name: label of the joint, such as ``2:3``; or name of a leg and its plate.
        error: (3, 1) symbols of the joint-centre error, length: in the world frame at home, or in the frame of the
            leg's plate.
    """

    name: str
    error: SX


@dataclass(frozen=True, eq=False)
class DisplacedRobot:
    """Robot with joint-centre errors.

    Attributes:
        model: the robot; the joint-centre errors are its last parameters, in the order of ``centres``.
        centres: joint centre of each of these parameters.
    """

    model: Model
    centres: tuple[Centre, ...]


def error_parameter(centre: Centre) -> Parameter:
    """Return the error of a joint centre as a parameter of a model."""
    return Parameter(f"error {centre.name}", centre.error, Dimension.LENGTH, "error of a joint centre", (0.0, 0.0, 0.0))


def displaced_legs(model: Model) -> DisplacedRobot:
    """Return a robot given by its rows, with joint-centre errors of its legs.

    Its quantities are those of the legs only.

    Args:
        model: the robot, with its rows ``built``.
    """
    centres = [
        Centre(name, error)
        for leg in model.legs
        for name, error in zip(leg.centres, (leg.base_error, leg.platform_error), strict=True)
    ]
    legs = [leg.built for leg in model.legs]
    of_legs = {each.name: each for each in legged_platform(legs, model.pose).quantities}
    found = replace(
        model,
        parameters=(*model.parameters, *map(error_parameter, centres)),
        wrenches=model.built,
        built=(),
        legs=tuple(legs),
        quantities=tuple(of_legs[each.name] for each in model.quantities if each.name in of_legs),
        scene=Scene(),
    )
    return DisplacedRobot(found, tuple(centres))

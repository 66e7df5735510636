"""A mechanism as a graph: links, and elementary joints between two of them, at one configuration in the world frame.

Every description of a robot passes through this form when it is read or written: universal, cylindrical and
parallelogram joints are made of the elementary ones, with links between them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..arrays import FloatArray

#: Hinge, slide, screw, ball, and a rigid connection.
ElementaryKind = Literal["R", "P", "H", "S", "weld"]


class MechanismError(ValueError):
    """A mechanism that contradicts itself.

    Attributes:
        place: link or joint in words; empty for the whole mechanism.
        fault: clause that says what is wrong.
    """

    def __init__(self, place: str, fault: str) -> None:
        super().__init__(f"{place}: {fault}" if place else fault)
        self.place = place
        self.fault = fault


@dataclass(frozen=True, eq=False)
class MechanismLink:
    """A rigid body.

    Attributes:
        name: unique among the links.
        position: (3,) origin of its frame in the world.
        rotation: (3, 3) its frame's axes as columns, in the world.
    """

    name: str
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def local(self, point: FloatArray) -> FloatArray:
        """Return a point (3,) of the world in the link's frame."""
        return np.asarray(self.rotation.T @ (point - self.position))


@dataclass(frozen=True, eq=False)
class MechanismJoint:
    """A joint of one of the elementary kinds between two links.

    Attributes:
        name: unique among the joints.
        kind: ``R``, ``P``, ``H``, ``S`` or ``weld``.
        inner: name of the link on the base's side.
        outer: name of the other link, whose motion relative to ``inner`` the coordinate counts.
        point: (3,) its centre, or a point of its axis, in the world.
        axis: (3,) unit direction of its axis in the world; zero for ``S`` and ``weld``.
        pitch: way per radian of an ``H``.
        actuated: whether an actuator drives it.
        range: smallest and largest coordinate, counted from the stated configuration, radians or length; None for no
            limit.
        outer_point: (3,) the joint's point as the outer link has it, where the description leaves the loop open; the
            same as ``point`` in a closed one.
    """

    name: str
    kind: ElementaryKind
    inner: str
    outer: str
    point: FloatArray
    axis: FloatArray = field(default_factory=lambda: np.zeros(3))
    pitch: float = 0.0
    actuated: bool = False
    range: tuple[float, float] | None = None
    outer_point: FloatArray | None = None


@dataclass(frozen=True)
class Coupling:
    """A linear relation of joint coordinates: the sum of factors times coordinates stays as it is.

    Attributes:
        name: unique among the couplings.
        factors: pairs of a joint's name and its factor; radians and lengths.
    """

    name: str
    factors: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A robot of any topology at one configuration.

    Attributes:
        name: of the robot.
        links: with the base and the platform among them.
        joints: between them.
        base: name of the base.
        platform: name of the platform.
        couplings: relations of joint coordinates.
    """

    name: str
    links: tuple[MechanismLink, ...]
    joints: tuple[MechanismJoint, ...]
    base: str
    platform: str
    couplings: tuple[Coupling, ...] = ()

    def link(self, name: str) -> MechanismLink:
        """Return a link by its name."""
        return next(link for link in self.links if link.name == name)

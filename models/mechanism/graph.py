"""A mechanism as a graph: links, and elementary joints between two of them, at one configuration in the world frame.

Every description of a robot passes through this form when it is read or written: universal, cylindrical and
parallelogram joints are made of the elementary ones, with links between them. The premises of the other modules are
checked here; each fault is refused with one sentence.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..arrays import FloatArray
from .topology import bridges_between, reached

#: Largest difference of the length of a unit axis from 1: an axis that is typed with six decimals is one.
_UNIT = 1e-6

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


def check_mechanism(mechanism: Mechanism) -> None:
    """Refuse a mechanism that contradicts itself, or that is no robot.

    Raises:
        MechanismError: the first fault: a name that is given twice or is unknown, a joint without place or axis, a link
            that nothing joins to the base, a platform on an open chain, or no actuated joint.
    """
    links = [link.name for link in mechanism.links]
    _refuse_twice("link", links)
    _refuse_twice("joint", [joint.name for joint in mechanism.joints])
    _refuse_twice("coupling", [coupling.name for coupling in mechanism.couplings])
    for role, name in (("base", mechanism.base), ("platform", mechanism.platform)):
        if name not in links:
            raise MechanismError(role, f"is {name!r}, which is no link; links are {_listing(links)}")
    if mechanism.base == mechanism.platform:
        raise MechanismError("platform", f"is {mechanism.platform!r}, which is the base; two links are needed")
    for link in mechanism.links:
        if not (np.isfinite(link.position).all() and np.isfinite(link.rotation).all()):
            raise MechanismError(f"link {link.name}", "has a place or rotation that is not finite")
    for joint in mechanism.joints:
        _check_joint(joint, links)
    _check_couplings(mechanism)
    edges = [(joint.inner, joint.outer) for joint in mechanism.joints]
    joined = reached(mechanism.base, edges)
    loose = [name for name in links if name not in joined]
    if loose:
        raise MechanismError(f"link {loose[0]}", "is joined to the base by no joint, directly or through other links")
    if not any(joint.actuated for joint in mechanism.joints):
        raise MechanismError("actuated", "is given at no joint; at least one actuator must drive the robot")
    path = bridges_between(mechanism.base, mechanism.platform, edges)
    coupled = {name for coupling in mechanism.couplings for name, _ in coupling.factors}
    if path.is_open and not any(mechanism.joints[k].name in coupled for k in path.bridges):
        names = _listing([mechanism.joints[k].name for k in path.bridges])
        fault = f"is {mechanism.platform!r}, at the end of an open chain ({names}); a parallel robot has closed loops"
        raise MechanismError("platform", fault)


def _check_joint(joint: MechanismJoint, links: Iterable[str]) -> None:
    """Refuse a joint with unknown links, or without place or axis."""
    place = f"joint {joint.name}"
    for name in (joint.inner, joint.outer):
        if name not in links:
            raise MechanismError(place, f"has the link {name!r}, which is unknown; links are {_listing(links)}")
    if joint.inner == joint.outer:
        raise MechanismError(place, f"joins the link {joint.inner!r} to itself; two links are needed")
    points = [joint.point] if joint.outer_point is None else [joint.point, joint.outer_point]
    if not all(np.isfinite(point).all() for point in points):
        raise MechanismError(place, "has a point that is not finite")
    if joint.kind in ("R", "P", "H"):
        length = float(np.linalg.norm(joint.axis))
        if not abs(length - 1.0) <= _UNIT:
            fault = (
                "is zero; a direction is needed" if length == 0 else f"has length {length:g}; a unit vector is needed"
            )
            raise MechanismError(f"{place}, axis", fault)
    elif joint.actuated:
        raise MechanismError(f"{place} ({joint.kind})", "is actuated; only R, P and H can be")
    if not math.isfinite(joint.pitch):
        raise MechanismError(f"{place}, pitch", f"is {joint.pitch}; a finite number is needed")
    if joint.range is not None and not joint.range[0] <= joint.range[1]:
        raise MechanismError(f"{place}, range", f"is {joint.range}; the first number must not be above the second")


def _check_couplings(mechanism: Mechanism) -> None:
    """Refuse couplings of joints that are unknown, or that have no coordinate."""
    joints = {joint.name: joint for joint in mechanism.joints}
    for coupling in mechanism.couplings:
        place = f"coupling {coupling.name}"
        for name, factor in coupling.factors:
            if name not in joints:
                raise MechanismError(place, f"has the joint {name!r}, which is unknown; joints are {_listing(joints)}")
            if joints[name].kind not in ("R", "P", "H"):
                kind = joints[name].kind
                raise MechanismError(
                    place, f"has the joint {name!r} ({kind}), which has no coordinate; R, P and H have"
                )
            if not math.isfinite(factor) or factor == 0:
                raise MechanismError(place, f"has the factor {factor:g} of {name!r}; a number that is not 0 is needed")
        _refuse_twice(f"{place}: joint", [name for name, _ in coupling.factors])
        if len(coupling.factors) < 2:
            raise MechanismError(place, "couples fewer than two joints; remove it, or weld the joint")


def _refuse_twice(what: str, names: Iterable[str]) -> None:
    """Refuse a name that is given twice."""
    for name, count in Counter(names).items():
        if count > 1:
            raise MechanismError(f"{what} {name}", "is given twice; each needs a name of its own")


def _listing(names: Iterable[str], most: int = 8) -> str:
    """Return names in a row, at most a few of them."""
    found = list(names)
    return ", ".join(found[:most]) + (", ..." if len(found) > most else "")

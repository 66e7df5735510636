"""Mechanism as a graph: links, and elementary joints between two of them, at one configuration in the world frame.

All robot formats are read and written through this form: universal, cylindrical and parallelogram joints consist of
elementary joints with links between them. The assumptions of the other modules are checked here; each fault is one
sentence.
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

#: Largest deviation of the length of a unit axis from 1, for axes typed with six decimals.
_UNIT = 1e-6

#: Kinds of joints: hinge, slide, screw, ball, and rigid connection.
ElementaryKind = Literal["R", "P", "H", "S", "weld"]


class MechanismError(ValueError):
    """Error of an inconsistent mechanism.

    Attributes:
        place: name of the link or joint with the fault, in words; empty for the whole mechanism.
        fault: description of the fault, as a clause.
    """

    def __init__(self, place: str, fault: str) -> None:
        super().__init__(f"{place}: {fault}" if place else fault)
        self.place = place
        self.fault = fault


@dataclass(frozen=True, eq=False)
class MechanismLink:
    """Rigid body of a mechanism.

    Attributes:
        name: unique name among the links.
        position: (3,) origin of the link frame in the world frame, length.
        rotation: (3, 3) axes of the link frame as columns, in the world frame.
    """

    name: str
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def local(self, point: FloatArray) -> FloatArray:
        """Return a world point (3,) in the link frame."""
        return np.asarray(self.rotation.T @ (point - self.position))


@dataclass(frozen=True, eq=False)
class MechanismJoint:
    """Elementary joint between two links.

    Attributes:
        name: unique name among the joints.
        kind: kind of the joint: ``R``, ``P``, ``H``, ``S`` or ``weld``.
        inner: name of the link on the base side.
        outer: name of the other link; the joint coordinate is the motion of ``outer`` relative to ``inner``.
        point: (3,) centre of the joint, or point of its axis, in the world frame, length.
        axis: (3,) unit vector along the axis in the world frame; zero for ``S`` and ``weld``.
        pitch: translation per radian of an ``H`` joint, length.
        actuated: True if an actuator drives the joint.
        range: smallest and largest coordinate from the stated configuration, radians or length; None for no limit.
        outer_point: (3,) point of the joint on the outer link, length; None if it equals ``point``, as in a closed
            loop.
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
    """Linear relation of joint coordinates: the sum of factors times coordinates is constant.

    Attributes:
        name: unique name among the couplings.
        factors: pairs of a joint's name and its factor; radians and lengths.
    """

    name: str
    factors: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Robot of any topology at one configuration.

    Attributes:
        name: name of the robot.
        links: links, including base and platform.
        joints: joints between the links.
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
    """Refuse an inconsistent mechanism, or one that is not a parallel robot.

    Raises:
        MechanismError: the first fault: a repeated or unknown name, a joint without position or axis, a link without a
            connection to the base, a platform on an open chain, or no actuated joint.
    """
    links = [link.name for link in mechanism.links]
    _refuse_twice("link", links)
    _refuse_twice("joint", [joint.name for joint in mechanism.joints])
    _refuse_twice("coupling", [coupling.name for coupling in mechanism.couplings])
    for role, name in (("base", mechanism.base), ("platform", mechanism.platform)):
        if name not in links:
            raise MechanismError(role, f"is {name!r}, which is not a link; links are {_listing(links)}")
    if mechanism.base == mechanism.platform:
        raise MechanismError("platform", f"is {mechanism.platform!r}, which is the base; two links are needed")
    for link in mechanism.links:
        if not (np.isfinite(link.position).all() and np.isfinite(link.rotation).all()):
            raise MechanismError(f"link {link.name}", "has a position or rotation that is not finite")
    for joint in mechanism.joints:
        _check_joint(joint, links)
    _check_couplings(mechanism)
    edges = [(joint.inner, joint.outer) for joint in mechanism.joints]
    joined = reached(mechanism.base, edges)
    loose = [name for name in links if name not in joined]
    if loose:
        raise MechanismError(
            f"link {loose[0]}", "is not connected to the base, neither directly nor through other links"
        )
    if not any(joint.actuated for joint in mechanism.joints):
        raise MechanismError("actuated", "is given at no joint; at least one actuator must drive the robot")
    path = bridges_between(mechanism.base, mechanism.platform, edges)
    coupled = {name for coupling in mechanism.couplings for name, _ in coupling.factors}
    if path.is_open and not any(mechanism.joints[k].name in coupled for k in path.bridges):
        names = _listing([mechanism.joints[k].name for k in path.bridges])
        fault = f"is {mechanism.platform!r}, at the end of an open chain ({names}); a parallel robot has closed loops"
        raise MechanismError("platform", fault)


def _check_joint(joint: MechanismJoint, links: Iterable[str]) -> None:
    """Refuse a joint with unknown links, or without position or axis."""
    place = f"joint {joint.name}"
    for name in (joint.inner, joint.outer):
        if name not in links:
            raise MechanismError(place, f"has the link {name!r}, which is unknown; links are {_listing(links)}")
    if joint.inner == joint.outer:
        raise MechanismError(place, f"connects the link {joint.inner!r} to itself; two different links are needed")
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
        raise MechanismError(f"{place} ({joint.kind})", "is actuated; only R, P and H joints can be actuated")
    if not math.isfinite(joint.pitch):
        raise MechanismError(f"{place}, pitch", f"is {joint.pitch}; a finite number is needed")
    if joint.range is not None and not joint.range[0] <= joint.range[1]:
        raise MechanismError(f"{place}, range", f"is {joint.range}; the first number must not be above the second")


def _check_couplings(mechanism: Mechanism) -> None:
    """Refuse couplings of unknown joints, and of joints without a coordinate."""
    joints = {joint.name: joint for joint in mechanism.joints}
    for coupling in mechanism.couplings:
        place = f"coupling {coupling.name}"
        for name, factor in coupling.factors:
            if name not in joints:
                raise MechanismError(place, f"has the joint {name!r}, which is unknown; joints are {_listing(joints)}")
            if joints[name].kind not in ("R", "P", "H"):
                kind = joints[name].kind
                raise MechanismError(
                    place, f"has the joint {name!r} ({kind}), which has no coordinate; only R, P and H joints have one"
                )
            if not math.isfinite(factor) or factor == 0:
                raise MechanismError(place, f"has the factor {factor:g} of {name!r}; a nonzero number is needed")
        _refuse_twice(f"{place}: joint", [name for name, _ in coupling.factors])
        if len(coupling.factors) < 2:
            raise MechanismError(place, "couples fewer than two joints; remove it, or weld the joint")


def _refuse_twice(what: str, names: Iterable[str]) -> None:
    """Refuse a name that is given twice."""
    for name, count in Counter(names).items():
        if count > 1:
            raise MechanismError(f"{what} {name}", "is given twice; each needs a name of its own")


def _listing(names: Iterable[str], most: int = 8) -> str:
    """Return names separated by commas, shortened to a few."""
    found = list(names)
    return ", ".join(found[:most]) + (", ..." if len(found) > most else "")

"""Robots at a pose as mechanisms: names that are valid in all formats, and frames of links.

The origin of a link's frame is at its joint on the base side. The x axis points to the farthest other joint of the
link. The z axis is the axis of the first joint, or of another joint, or a world axis, projected normal to x.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink

#: Distance, relative to the robot's size, below which two points coincide; and sine of the angle below which two
#: directions are parallel.
_NEAR = 1e-9
_PARALLEL = 1e-3


@dataclass(frozen=True)
class ExportedJoint:
    """Elementary joint of an exported mechanism, with its names in the case.

    Attributes:
        name: name of the elementary joint in the mechanism.
        label: label of the joint in the robot file, such as ``2:3``: limb and number.
        part: name of the joint coordinate, such as ``first``; empty for a joint with one coordinate.
        actuator: name of the actuator in results; empty for a passive joint.
        coordinate: coordinate from home at the pose, radians or length; None for a spherical joint or a joint of a leg.
        lever: length of a parallelogram's rod, if limits are on its displacement instead of its angle; otherwise None.
        follows: True if another hinge of the parallelogram has the coordinate of the limits.
    """

    name: str
    label: str
    part: str = ""
    actuator: str = ""
    coordinate: float | None = None
    lever: float | None = None
    follows: bool = False


@dataclass(frozen=True)
class Travel:
    """Travel of a prismatic joint over the poses of a case.

    Attributes:
        joint: name of the joint.
        is_leg: True if the values are lengths of a straight leg; False for coordinates from home.
        value: value at the exported pose, length.
        used: smallest and largest value over all poses of the case, length.
        allowed: smallest and largest value within the limits of the case, length; None for no limit.
        stroke: largest stroke within the limits of the case, length; None for no limit.
    """

    joint: str
    is_leg: bool
    value: float
    used: tuple[float, float]
    allowed: tuple[float | None, float | None]
    stroke: float | None


@dataclass(frozen=True, eq=False)
class RobotMechanism:
    """Robot as a mechanism at a pose.

    Attributes:
        mechanism: mechanism at the pose.
        joints: joints of the mechanism with their names in the case, in the same order.
        size: largest extent of the joint centres, length.
        notes: notes about assumptions that the case does not determine.
    """

    mechanism: Mechanism
    joints: tuple[ExportedJoint, ...]
    size: float
    notes: tuple[str, ...]


def joint_name(label: str, part: str = "") -> str:
    """Return the name of an elementary joint.

    Args:
        label: label of the joint in the robot file, such as ``2:3``.
        part: suffix for one of several elementary joints, such as ``first``.
    """
    return f"joint_{clean_name(label.replace(':', '_'))}{f'_{part}' if part else ''}"


def link_name(joint: str) -> str:
    """Return the name of the outer link of a joint with a name of :func:`joint_name`."""
    return joint.replace("joint_", "link_", 1)


def clean_name(text: str) -> str:
    """Return a text as a name that is valid in all formats: letters, digits, dots, minus, plus and underscores."""
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text)


def unique_names(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return unique names, different from those already taken; duplicates get underscores."""
    known, found = set(taken), []
    for name in names:
        one = name
        while one in known:
            one += "_"
        known.add(one)
        found.append(one)
    return found


def extent_of(mechanism: Mechanism) -> float:
    """Return the largest extent of the joint centres and the platform origin; 1 if all coincide."""
    platform = mechanism.link(mechanism.platform)
    points = np.array([platform.position, *(joint.point for joint in mechanism.joints)])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def framed(mechanism: Mechanism, coordinates: Mapping[str, float], size: float) -> Mechanism:
    """Return a mechanism with link frames at joints, and points of prismatic and helical joints on inner links.

    Args:
        mechanism: mechanism with the points of prismatic and helical joints on outer links.
        coordinates: joint coordinates by name, 0 if the points on both links coincide; radians or length.
        size: length comparable to the robot's size.
    """
    joints = tuple(_on_inner_link(joint, coordinates.get(joint.name, 0.0)) for joint in mechanism.joints)

    def link(each: MechanismLink) -> MechanismLink:
        if each.name in (mechanism.base, mechanism.platform):
            return each
        first = next(joint for joint in mechanism.joints if joint.outer == each.name)
        others = [joint for joint in joints if joint.inner == each.name]
        points, axes = [first, *others], [first.axis, *(joint.axis for joint in others)]
        return replace(each, position=first.point, rotation=_rotation([one.point for one in points], axes, size))

    # Links are in the order of the joints that lead to them; the platform is last.
    order = dict.fromkeys((mechanism.base, *(joint.outer for joint in joints if joint.outer != mechanism.platform)))
    links = {each.name: link(each) for each in mechanism.links}
    return replace(mechanism, links=tuple(links[name] for name in (*order, mechanism.platform)), joints=joints)


def renamed(mechanism: Mechanism, names: Mapping[str, str]) -> Mechanism:
    """Return a mechanism with renamed links, valid in all formats; base and platform are ``base`` and ``platform``.

    Args:
        mechanism: the mechanism.
        names: new names of links by their old names; other links keep their names.
    """
    ends = {mechanism.base: "base", mechanism.platform: "platform"}
    inner = [link.name for link in mechanism.links if link.name not in ends]
    new = unique_names((clean_name(names.get(name, name)) for name in inner), ends.values())
    called = ends | dict(zip(inner, new, strict=True))
    links = tuple(replace(link, name=called[link.name]) for link in mechanism.links)
    joints = tuple(replace(joint, inner=called[joint.inner], outer=called[joint.outer]) for joint in mechanism.joints)
    return replace(mechanism, links=links, joints=joints, base="base", platform="platform")


def _on_inner_link(joint: MechanismJoint, coordinate: float) -> MechanismJoint:
    """Return a joint with its point on the inner link instead of the outer link."""
    way = {"P": coordinate, "H": joint.pitch * coordinate}.get(joint.kind, 0.0)
    return replace(joint, point=joint.point - way * joint.axis) if way else joint


def _rotation(points: Sequence[FloatArray], axes: Sequence[FloatArray], size: float) -> FloatArray:
    """Return the axes of a link's frame as columns (3, 3), in the world frame.

    Args:
        points: (3,) each, centres of the link's joints in the world frame; the first one is the origin of the frame.
        axes: (3,) each, unit axes of these joints in the world frame; zero for spherical joints.
        size: length comparable to the robot's size.
    """
    ways = [point - points[0] for point in points[1:]]
    farthest = max((float(np.linalg.norm(way)) for way in ways), default=0.0)
    # Among equally distant joints, the first one is used: otherwise rounding would choose differently at each pose.
    far = next((way for way in ways if float(np.linalg.norm(way)) >= (1 - _NEAR) * farthest), np.zeros(3))
    known = [axis for axis in axes if axis.any()]
    world = [np.eye(3)[k] for k in (2, 0, 1)]
    if farthest > _NEAR * size:
        x = far / np.linalg.norm(far)
        z = _across((*known, *world), x)
    else:
        z = known[0] if known else world[0]
        x = _across((*known, *world[1:], world[0]), z)
    return np.column_stack([x, np.cross(z, x), z])


def _across(directions: Sequence[FloatArray], axis: FloatArray) -> FloatArray:
    """Return the unit vector (3,) of the first direction not parallel to a unit axis, projected normal to it."""
    parts = (direction - axis * float(direction @ axis) for direction in directions)
    # The directions include three world axes, of which at least one is not parallel to the axis.
    part = next(part for part in parts if float(np.linalg.norm(part)) > _PARALLEL)
    return np.asarray(part / np.linalg.norm(part))

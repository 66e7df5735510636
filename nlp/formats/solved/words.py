"""A robot at a pose as a mechanism in the words of the case: names that every format takes, and frames of links.

The origin of a link's frame is at the joint by which the link hangs from the base's side. The x axis points to the
link's farthest other joint. The z axis is the axis of the first joint, or of another, as far as it is normal to x; else
the world's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink

#: Distance, in parts of the robot's size, below which two joints are at one place; and sine of the angle between two
#: directions below which they are parallel.
_NEAR = 1e-9
_PARALLEL = 1e-3


@dataclass(frozen=True)
class ExportedJoint:
    """A joint of an exported mechanism in the words of the case.

    Attributes:
        name: in the mechanism.
        label: of the joint in the robot file, such as ``2:3``; limb and number for a leg.
        part: name of its coordinate, such as ``first``; empty for the only one.
        actuator: name of its actuator in results; empty for none.
        coordinate: its coordinate from home at the pose, radians or length; None for a ball or a leg's joint.
        lever: length of a parallelogram's rod, where limits read its way instead of its angle; else None.
        follows: whether another hinge of its parallelogram has the coordinate that limits read.
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
    """The travel of a slide over the poses of a case.

    Attributes:
        joint: name of the slide.
        is_leg: whether its numbers are lengths of a straight leg, and not its coordinate from home.
        value: at the exported pose, length.
        used: smallest and largest value over all poses of the case.
        allowed: smallest and largest value within the limits of the case; None for a side without one.
        stroke: largest stroke within the limits of the case; None without one.
    """

    joint: str
    is_leg: bool
    value: float
    used: tuple[float, float]
    allowed: tuple[float | None, float | None]
    stroke: float | None


@dataclass(frozen=True, eq=False)
class RobotMechanism:
    """A robot as a mechanism at a pose.

    Attributes:
        mechanism: at that pose.
        joints: its joints in the words of the case, in the mechanism's order.
        size: largest extent of the joints' centres, length.
        notes: sentences for people about choices that the case leaves open.
    """

    mechanism: Mechanism
    joints: tuple[ExportedJoint, ...]
    size: float
    notes: tuple[str, ...]


def joint_name(label: str, part: str = "") -> str:
    """Return the name of an elementary joint: of the label of its joint, and of its part of that."""
    return f"joint_{clean_name(label.replace(':', '_'))}{f'_{part}' if part else ''}"


def link_name(joint: str) -> str:
    """Return the name of the link behind a joint with a name of :func:`joint_name`."""
    return joint.replace("joint_", "link_", 1)


def clean_name(text: str) -> str:
    """Return a text as a name that every format takes: letters, digits, dots, minus and plus signs, underscores."""
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text)


def unique_names(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return names of which no two are the same, nor one of those taken: the later ones get underscores."""
    known, found = set(taken), []
    for name in names:
        one = name
        while one in known:
            one += "_"
        known.add(one)
        found.append(one)
    return found


def extent_of(mechanism: Mechanism) -> float:
    """Return the largest extent of the joints' centres and of the platform's origin; 1 where all are at one place."""
    platform = mechanism.link(mechanism.platform)
    points = np.array([platform.position, *(joint.point for joint in mechanism.joints)])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def framed(mechanism: Mechanism, coordinates: Mapping[str, float], size: float) -> Mechanism:
    """Return a mechanism whose links have frames at their joints; slides and screws state their points on inner links.

    Args:
        mechanism: whose slides and screws state their points on outer links.
        coordinates: of its joints by name, from where both links have them at one point, radians or length.
        size: length of the order of the robot's own.
    """
    joints = tuple(_on_inner_link(joint, coordinates.get(joint.name, 0.0)) for joint in mechanism.joints)

    def link(each: MechanismLink) -> MechanismLink:
        if each.name in (mechanism.base, mechanism.platform):
            return each
        first = next(joint for joint in mechanism.joints if joint.outer == each.name)
        others = [joint for joint in joints if joint.inner == each.name]
        points, axes = [first, *others], [first.axis, *(joint.axis for joint in others)]
        return replace(each, position=first.point, rotation=_rotation([one.point for one in points], axes, size))

    # Links in the order of the joints behind which they are; the platform is the last one.
    order = dict.fromkeys((mechanism.base, *(joint.outer for joint in joints if joint.outer != mechanism.platform)))
    links = {each.name: link(each) for each in mechanism.links}
    return replace(mechanism, links=tuple(links[name] for name in (*order, mechanism.platform)), joints=joints)


def renamed(mechanism: Mechanism, names: Mapping[str, str]) -> Mechanism:
    """Return a mechanism whose links have other names, that every format takes; its ends are ``base`` and ``platform``.

    Args:
        mechanism: the mechanism.
        names: of links by the old ones; those that are missing keep theirs.
    """
    ends = {mechanism.base: "base", mechanism.platform: "platform"}
    inner = [link.name for link in mechanism.links if link.name not in ends]
    new = unique_names((clean_name(names.get(name, name)) for name in inner), ends.values())
    called = ends | dict(zip(inner, new, strict=True))
    links = tuple(replace(link, name=called[link.name]) for link in mechanism.links)
    joints = tuple(replace(joint, inner=called[joint.inner], outer=called[joint.outer]) for joint in mechanism.joints)
    return replace(mechanism, links=links, joints=joints, base="base", platform="platform")


def _on_inner_link(joint: MechanismJoint, coordinate: float) -> MechanismJoint:
    """Return a joint with the point that its inner link has, in the place of that of its outer one."""
    way = {"P": coordinate, "H": joint.pitch * coordinate}.get(joint.kind, 0.0)
    return replace(joint, point=joint.point - way * joint.axis) if way else joint


def _rotation(points: Sequence[FloatArray], axes: Sequence[FloatArray], size: float) -> FloatArray:
    """Return the axes of a link's frame as columns (3, 3), in the world.

    Args:
        points: (3,) each, centres of its joints in the world; the first one is the frame's origin.
        axes: (3,) each, their unit axes in the world; zero for spherical joints.
        size: length of the order of the robot's own.
    """
    ways = [point - points[0] for point in points[1:]]
    farthest = max((float(np.linalg.norm(way)) for way in ways), default=0.0)
    # Of joints that are equally far the first one counts: rounding would choose another one at each pose.
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
    """Return the unit vector (3,) of the part normal to a unit axis of the first direction that is not along it."""
    parts = (direction - axis * float(direction @ axis) for direction in directions)
    # Of the world's three directions, which are among them, one at least is not along the axis.
    part = next(part for part in parts if float(np.linalg.norm(part)) > _PARALLEL)
    return np.asarray(part / np.linalg.norm(part))

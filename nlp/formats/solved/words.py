"""A robot at a pose as a mechanism in the words of the case, and names that files of every format take."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from ....models.mechanism import Mechanism


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

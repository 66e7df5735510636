"""Description of a robot in MJCF or URDF: a tree of bodies with joints, and joints that close loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from itertools import takewhile

from ....models.mechanism import Coupling, MechanismJoint
from ..frames import Frame

#: Largest coordinate, in the file's unit of length: beyond it, rounding of squared distances exceeds the gaps of loops.
LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class Body:
    """Body of the tree of a description.

    Attributes:
        name: name of the body, unique among all bodies.
        parent: name of the parent body; empty for the root, and for a floating body.
        place: frame of the body in the world, with all joints at their stated coordinates.
    """

    name: str
    parent: str
    place: Frame


class Closing(Enum):
    """Kinds of joints that close loops; their axis is z of both frames."""

    BALL = "ball"
    WELD = "weld"
    HINGE = "hinge"
    SLIDE = "slide"
    CYLINDER = "cylinder"
    UNIVERSAL = "universal"


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """Joint that closes a loop, with a frame on each of its two bodies.

    In a closed loop, the two frames coincide up to the motion of the joint. The axis of a hinge, slide or cylinder is z
    of both frames. The first axis of a universal joint is z of the first frame, the second axis is z of the second
    frame; their angle is that of the stated configuration.

    Attributes:
        name: name of the closure, unique among joints and closures.
        closing: kind of the joint.
        first: name of the first body.
        second: name of the second body.
        first_frame: frame on the first body, in body coordinates.
        second_frame: frame on the second body, in body coordinates.
    """

    name: str
    closing: Closing
    first: str
    second: str
    first_frame: Frame
    second_frame: Frame


@dataclass(frozen=True, eq=False)
class Description:
    """Robot in a file.

    Attributes:
        name: name of the robot.
        source: name of the file, for messages.
        root: name of the fixed body.
        bodies: bodies of the tree, parents before children.
        joints: joint between each body (the outer link) and its parent, at the stated coordinates; none for a floating
            body.
        closures: joints that close loops.
        couplings: linear relations of joint coordinates.
        offsets: value of each coupling at the stated configuration, by name; 0 if missing.
        driven: names of the actuated joints.
        frames: named frames on bodies: name of the body, and frame in body coordinates.
        keyframes: names of the configurations of the file.
        notes: notes about omitted elements and assumptions.
    """

    name: str
    source: str
    root: str
    bodies: tuple[Body, ...]
    joints: tuple[MechanismJoint, ...]
    closures: tuple[LoopClosure, ...]
    couplings: tuple[Coupling, ...] = ()
    offsets: Mapping[str, float] = field(default_factory=dict)
    driven: frozenset[str] = frozenset()
    frames: Mapping[str, tuple[str, Frame]] = field(default_factory=dict)
    keyframes: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def place_of(self, name: str) -> Frame:
        """Return the frame of a body in the world; the world frame for a massless body between two joints."""
        return self._places.get(name) or Frame()

    @cached_property
    def _places(self) -> dict[str, Frame]:
        """Frames of all bodies by name."""
        return {body.name: body.place for body in self.bodies}


def unique_name(wanted: str, taken: Mapping[str, object] | set[str]) -> str:
    """Return a name, with a number appended if it is taken."""
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}_{number}", number + 1
    return name


def common_name(names: Sequence[str]) -> str:
    """Return the common prefix of names such as ``closing_a_1`` and ``closing_a_2``; empty for none."""
    common = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in common).rstrip("_-. ")

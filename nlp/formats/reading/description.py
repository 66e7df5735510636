"""A robot as both formats state it: a tree of bodies with joints, and loops that equations close."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from itertools import takewhile

from ....models.mechanism import Coupling, MechanismJoint
from ..frames import Frame

#: Largest coordinate, in the file's unit of length: beyond it, squares of distances lose what a loop is open by.
LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class Body:
    """A body of the tree.

    Attributes:
        name: unique among the bodies.
        parent: name of the body that it hangs on; empty for the root, and for one that floats freely.
        place: its frame in the world, with all joints at their stated positions.
    """

    name: str
    parent: str
    place: Frame


class Closing(Enum):
    """The joint that closes a loop, with z as its axis in both frames."""

    BALL = "ball"
    WELD = "weld"
    HINGE = "hinge"
    SLIDE = "slide"
    CYLINDER = "cylinder"
    UNIVERSAL = "universal"


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """A joint that closes a loop, with a frame on each of its bodies, in the body's own frame.

    The two frames coincide where the loop is closed, but for the freedom of the joint. The axis of a hinge, slide or
    cylinder is z of both frames. A universal joint has its first axis along z of the first frame, its second along z
    of the other; at the stated configuration they have the angle that they keep.

    Attributes:
        name: unique among joints and closures.
        closing: its kind.
        first: name of the body on one side.
        second: name of the other body.
        first_frame: frame on the first body.
        second_frame: frame on the second body.
    """

    name: str
    closing: Closing
    first: str
    second: str
    first_frame: Frame
    second_frame: Frame


@dataclass(frozen=True, eq=False)
class Description:
    """A robot as a file states it.

    Attributes:
        name: of the robot.
        source: name of the file, for messages.
        root: name of the fixed body.
        bodies: parents before children.
        joints: between a body, the outer link, and its parent, at their stated positions; a body that floats freely has
            none.
        closures: joints that close loops.
        couplings: linear relations of joint coordinates.
        offsets: value of each coupling at the stated configuration, by its name; 0 where it has none.
        driven: names of the joints with an actuator.
        frames: named places on bodies, as name of the body and the frame in it.
        keyframes: names of the configurations in which the file can be read.
        notes: sentences about what was left out or assumed.
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
        """Return the place of a body in the world; of one without size between two joints, the world's own."""
        return self._places.get(name) or Frame()

    @cached_property
    def _places(self) -> dict[str, Frame]:
        """The places of all bodies."""
        return {body.name: body.place for body in self.bodies}


def unique_name(wanted: str, taken: Mapping[str, object] | set[str]) -> str:
    """Return a name, with a number behind it where it is taken."""
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}_{number}", number + 1
    return name


def common_name(names: Sequence[str]) -> str:
    """Return the common beginning of names such as ``closing_a_1`` and ``closing_a_2``; empty for none."""
    common = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in common).rstrip("_-. ")

"""A mechanism as URDF: the tree of its links; the loops are in a file of YAML beside it.

URDF has a link's frame at its joint. Where a link's own frame is elsewhere, a fixed joint leads to it. A ball is three
hinges about the axes of the frame behind it. A screw is a hinge and a slide that mimics it.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink
from ...errors import InputError
from ..frames import axis_frame, roll_pitch_yaw_of
from .numbers import direction, number, numbers, plain_name
from .shapes import ROD, SMALL_MASS, Shape, extent, shape_of
from .tree import Edge, spanning_tree

#: Largest way of a slide without a limit, in parts of the robot's size: URDF has no slide without limits.
_FAR = 100.0
#: Largest force and speed of every joint: URDF has no joint without them.
_EFFORT, _SPEED = 1e6, 1e6
#: Distance, in parts of the robot's size, below which a link's frame is at its joint.
_NEAR = 1e-12

_COMMENT = (
    " Written by screwsynth. Lengths are in the unit of the case, see README.md; the loops are in robot.yaml. Masses,"
    " efforts, speeds and shapes are placeholders: the case has no such numbers. "
)


@dataclass(frozen=True)
class LoopFrames:
    """Two frames that a loop holds together.

    Attributes:
        first, second: names of their links in the URDF.
        kind: ``3d`` for a common point, ``6d`` for a common frame.
    """

    first: str
    second: str
    kind: str


@dataclass(frozen=True)
class Urdf:
    """A mechanism as URDF.

    Attributes:
        text: of the file.
        loops: pairs of frames that close the loops.
    """

    text: str
    loops: tuple[LoopFrames, ...]

    def loops_text(self, mechanism: Mechanism) -> str:
        """Return the loops and the actuated joints as YAML.

        The keys are those of the parallel robots of Gepetto (github.com/Gepetto/example-parallel-robots).
        """
        driven = [joint.name for joint in mechanism.joints if joint.actuated]
        pairs = ", ".join(f"[{_quoted(each.first)}, {_quoted(each.second)}]" for each in self.loops)
        lines = [
            f"closed_loop: [{pairs}]",
            f"type: [{', '.join(_quoted(each.kind) for each in self.loops)}]",
            f"name_mot: [{', '.join(map(_quoted, driven))}]",
            "joint_name: []",
            "joint_type: []",
        ]
        return "\n".join(lines) + "\n"


def urdf_of(mechanism: Mechanism) -> Urdf:
    """Return a mechanism as URDF.

    Raises:
        MechanismError: a link is not connected with the base.
        InputError: a coupling has more than two joints.
    """
    return _Writer(mechanism).urdf()


class _Writer:
    """The elements of the file while the tree is walked."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism, self._tree, self._size = mechanism, spanning_tree(mechanism), extent(mechanism)
        self._root = ET.Element("robot", name=plain_name(mechanism.name))
        self._root.append(ET.Comment(_COMMENT))
        #: Follower of each coupled joint: the joint that it mimics, and the factor.
        self._mimics: dict[str, tuple[str, float]] = {}

    def urdf(self) -> Urdf:
        """Return the file and its loops."""
        self._find_mimics()
        base = self._tree.base
        self._link(base.name, base, shape_of(self._mechanism, base.name, self._size))
        self._children(base)
        loops = []
        links = {link.name: link for link in self._mechanism.links}
        for each in self._tree.closings:
            first, second = f"closing_{each.name}_1", f"closing_{each.name}_2"
            # Both frames are at the joint, with the axes of its outer link.
            outer = links[each.first] if each.kind == "connect" else links[each.second]
            frame = MechanismLink("", each.point, outer.rotation)
            if each.first in links:
                self._fixed(first, frame, links[each.first])
            self._fixed(second, frame, links[each.second])
            loops.append(LoopFrames(first, second, "3d" if each.kind == "connect" else "6d"))
        ET.indent(self._root)
        return Urdf(ET.tostring(self._root, encoding="unicode") + "\n", tuple(loops))

    def _find_mimics(self) -> None:
        """Find the joint that each coupled joint follows.

        Raises:
            InputError: a coupling has more than two joints.
        """
        for coupling in self._mechanism.couplings:
            if len(coupling.factors) != 2:
                fault = f"has {len(coupling.factors)} joints; a joint of a URDF can follow one other joint"
                raise InputError(f"coupling {coupling.name!r} cannot be written as URDF: it {fault}")
            (leader, one), (follower, other) = coupling.factors
            self._mimics[follower] = (leader, -one / other)

    def _children(self, parent: MechanismLink) -> None:
        """Add the links behind a link."""
        for edge in self._tree.below(parent.name):
            frame = MechanismLink(edge.child.name, edge.joint.point, edge.child.rotation)
            if edge.is_copy:
                frame = replace(frame, name=f"closing_{edge.joint.name}_1")
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, Shape((), (), SMALL_MASS, SMALL_MASS * self._size**2 * 1e-2))
                continue
            shape = shape_of(self._mechanism, edge.child.name, self._size)
            if float(np.linalg.norm(edge.child.position - frame.position)) > _NEAR * self._size:
                # The mass is at the joint's frame: the link's own frame is one more link without a mass.
                frame = replace(frame, name=f"{edge.child.name}_at_joint")
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, shape)
                self._fixed(edge.child.name, edge.child, frame)
            else:
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, shape)
            self._children(edge.child)

    def _joints(self, edge: Edge, parent: MechanismLink, frame: MechanismLink) -> None:
        """Add the joint between two links, with links between where it is several."""
        joint, own = edge.joint, frame.rotation.T @ edge.axis
        origin = _origin(frame, parent)
        if joint.kind == "S":
            at: Mapping[str, str] = origin
            before = parent.name
            for k, axis in enumerate("xyz"):
                behind = frame.name if k == 2 else f"{joint.name}_{axis}_link"
                if k < 2:
                    self._cross(behind)
                self._joint(f"{joint.name}_{axis}", "continuous", before, behind, at, np.eye(3)[k])
                at, before = _NOWHERE, behind
            return
        if joint.kind == "weld":
            self._joint(joint.name, "fixed", parent.name, frame.name, origin, None)
            return
        if joint.kind == "P":
            self._joint(joint.name, "prismatic", parent.name, frame.name, origin, own, joint)
            return
        kind = "continuous" if joint.range is None else "revolute"
        if joint.kind == "H":
            self._cross(f"{joint.name}_link")
            self._joint(joint.name, kind, parent.name, f"{joint.name}_link", origin, own, joint)
            slide = MechanismJoint(f"{joint.name}_slide", "P", "", "", joint.point)
            self._mimics[slide.name] = (joint.name, joint.pitch)
            self._joint(slide.name, "prismatic", f"{joint.name}_link", frame.name, _NOWHERE, own, slide)
            return
        self._joint(joint.name, kind, parent.name, frame.name, origin, own, joint)

    def _joint(
        self,
        name: str,
        kind: str,
        parent: str,
        child: str,
        origin: Mapping[str, str],
        axis: FloatArray | None,
        joint: MechanismJoint | None = None,
    ) -> None:
        """Add one joint of URDF."""
        element = ET.SubElement(self._root, "joint", name=name, type=kind)
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=child)
        ET.SubElement(element, "origin", dict(origin))
        if axis is not None:
            ET.SubElement(element, "axis", xyz=direction(axis))
        if kind in ("revolute", "prismatic"):
            far = _FAR * self._size
            lower, upper = (-far, far) if joint is None or joint.range is None else joint.range
            limits = {"lower": number(lower), "upper": number(upper)}
            ET.SubElement(element, "limit", limits | {"effort": number(_EFFORT), "velocity": number(_SPEED)})
        if name in self._mimics:
            leader, factor = self._mimics[name]
            ET.SubElement(element, "mimic", joint=leader, multiplier=number(factor), offset="0")

    def _fixed(self, name: str, link: MechanismLink, parent: MechanismLink) -> None:
        """Add a link without a mass that is fixed to another one."""
        ET.SubElement(self._root, "link", name=name)
        self._joint(f"{name}_fixed", "fixed", parent.name, name, _origin(link, parent), None)

    def _cross(self, name: str) -> None:
        """Add a small link between two joints at one place."""
        self._link(name, None, Shape((), (), SMALL_MASS, SMALL_MASS * self._size**2 * 1e-2))

    def _link(self, name: str, frame: MechanismLink | None, shape: Shape) -> None:
        """Add a link with its mass and its lines."""
        element = ET.SubElement(self._root, "link", name=name)
        inertial = ET.SubElement(element, "inertial")
        middle = np.zeros(3)
        if frame is not None and shape.points:
            middle = frame.local(np.mean(shape.points, axis=0))
        ET.SubElement(inertial, "origin", xyz=numbers(middle), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=number(shape.mass))
        moments = {"ixx": shape.inertia, "iyy": shape.inertia, "izz": shape.inertia, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
        ET.SubElement(inertial, "inertia", {key: number(value) for key, value in moments.items()})
        for start, end in shape.lines:
            if frame is None:
                break
            one, other = (frame.local(shape.points[k]) for k in (start, end))
            visual = ET.SubElement(element, "visual")
            turn = numbers(roll_pitch_yaw_of(axis_frame(one, other - one).rotation))
            ET.SubElement(visual, "origin", xyz=numbers((one + other) / 2), rpy=turn)
            geometry = ET.SubElement(visual, "geometry")
            length = float(np.linalg.norm(other - one))
            ET.SubElement(geometry, "cylinder", radius=number(ROD * self._size), length=number(length))


_NOWHERE: Mapping[str, str] = {"xyz": "0 0 0", "rpy": "0 0 0"}


def _quoted(text: str) -> str:
    """Return a text as YAML has it in single quotes."""
    doubled = text.replace("'", "''")
    return f"'{doubled}'"


def _origin(link: MechanismLink, parent: MechanismLink) -> dict[str, str]:
    """Return the attributes of a frame's place in another one."""
    place = parent.local(link.position)
    turn = roll_pitch_yaw_of(parent.rotation.T @ link.rotation)
    return {"xyz": numbers(place), "rpy": direction(turn)}

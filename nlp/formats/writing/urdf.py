"""Writer of URDF: a tree of links, and a YAML file with the loops.

In URDF, the frame of a link is at its joint. If the link has a different frame, a fixed joint leads to it. A spherical
joint is three hinges about the axes of the outer link's frame. A helical joint is a hinge and a slide that mimics it.
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

#: Limit of a prismatic joint without limits, relative to the robot's size: URDF requires limits.
_FAR = 100.0
#: Placeholders of the largest force and speed of every joint, which URDF requires.
_EFFORT, _SPEED = 1e6, 1e6
#: Distance, relative to the robot's size, below which the frame of a link is at its joint.
_NEAR = 1e-12

_COMMENT = (
    " Written by screwsynth. Lengths are in the unit of the case, see README.md; the loops are in robot.yaml. Masses,"
    " efforts, speeds and shapes are placeholders, because the case does not define them. "
)


@dataclass(frozen=True)
class LoopFrames:
    """Pair of frames that close a loop.

    Attributes:
        first: link of the first frame in the URDF.
        second: link of the second frame in the URDF.
        kind: ``3d`` for a common point, ``6d`` for a common frame.
    """

    first: str
    second: str
    kind: str


@dataclass(frozen=True)
class Urdf:
    """URDF of a mechanism.

    Attributes:
        text: text of the URDF file.
        loops: pairs of frames that close the loops.
    """

    text: str
    loops: tuple[LoopFrames, ...]

    def loops_text(self, mechanism: Mechanism) -> str:
        """Return the YAML file of the loops and the actuated joints.

        The keys are those of github.com/Gepetto/example-parallel-robots.

        Args:
            mechanism: the mechanism.
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
    """Return the URDF of a mechanism.

    Raises:
        MechanismError: a link is not connected to the base.
        InputError: a coupling has more than two joints.
    """
    return _Writer(mechanism).urdf()


class _Writer:
    """Writer of one file, which walks the spanning tree."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism, self._tree, self._size = mechanism, spanning_tree(mechanism), extent(mechanism)
        self._root = ET.Element("robot", name=plain_name(mechanism.name))
        self._root.append(ET.Comment(_COMMENT))
        #: Mimicked joint and factor of each coupled joint.
        self._mimics: dict[str, tuple[str, float]] = {}

    def urdf(self) -> Urdf:
        """Return the URDF with its loops."""
        self._find_mimics()
        base = self._tree.base
        self._link(base.name, base, shape_of(self._mechanism, base.name, self._size))
        self._children(base)
        loops = []
        links = {link.name: link for link in self._mechanism.links}
        for each in self._tree.closings:
            first, second = f"closing_{each.name}_1", f"closing_{each.name}_2"
            # Both frames are at the joint, and parallel to the frame of its outer link.
            outer = links[each.first] if each.kind == "connect" else links[each.second]
            frame = MechanismLink("", each.point, outer.rotation)
            if each.first in links:
                self._fixed(first, frame, links[each.first])
            self._fixed(second, frame, links[each.second])
            loops.append(LoopFrames(first, second, "3d" if each.kind == "connect" else "6d"))
        ET.indent(self._root)
        return Urdf(ET.tostring(self._root, encoding="unicode") + "\n", tuple(loops))

    def _find_mimics(self) -> None:
        """Find the joint that each coupled joint mimics.

        Raises:
            InputError: a coupling has more than two joints.
        """
        for coupling in self._mechanism.couplings:
            if len(coupling.factors) != 2:
                fault = f"it has {len(coupling.factors)} joints, but a URDF joint can mimic only one other joint"
                advice = "export MJCF instead"
                raise InputError(f"coupling {coupling.name!r} cannot be written as URDF: {fault}; {advice}")
            (leader, one), (follower, other) = coupling.factors
            self._mimics[follower] = (leader, -one / other)

    def _children(self, parent: MechanismLink) -> None:
        """Add all links below a link of the tree."""
        for edge in self._tree.below(parent.name):
            frame = MechanismLink(edge.child.name, edge.joint.point, edge.child.rotation)
            if edge.is_copy:
                frame = replace(frame, name=f"closing_{edge.joint.name}_1")
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, Shape((), (), SMALL_MASS, SMALL_MASS * self._size**2 * 1e-2))
                continue
            shape = shape_of(self._mechanism, edge.child.name, self._size)
            if float(np.linalg.norm(edge.child.position - frame.position)) > _NEAR * self._size:
                # The link at the joint has the mass; the frame of the link is an additional link without mass.
                frame = replace(frame, name=f"{edge.child.name}_at_joint")
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, shape)
                self._fixed(edge.child.name, edge.child, frame)
            else:
                self._joints(edge, parent, frame)
                self._link(frame.name, frame, shape)
            self._children(edge.child)

    def _joints(self, edge: Edge, parent: MechanismLink, frame: MechanismLink) -> None:
        """Add the joint between two links, or several joints with small links between them."""
        joint, axis = edge.joint, frame.rotation.T @ edge.axis
        origin = _origin(frame, parent)
        if joint.kind == "S":
            at: Mapping[str, str] = origin
            before = parent.name
            for k, letter in enumerate("xyz"):
                behind = frame.name if k == 2 else f"{joint.name}_{letter}_link"
                if k < 2:
                    self._cross(behind)
                self._joint(f"{joint.name}_{letter}", "continuous", before, behind, at, np.eye(3)[k])
                at, before = _NOWHERE, behind
            return
        if joint.kind == "weld":
            self._joint(joint.name, "fixed", parent.name, frame.name, origin, None)
            return
        if joint.kind == "P":
            self._joint(joint.name, "prismatic", parent.name, frame.name, origin, axis, joint)
            return
        kind = "continuous" if joint.range is None else "revolute"
        if joint.kind == "H":
            self._cross(f"{joint.name}_link")
            self._joint(joint.name, kind, parent.name, f"{joint.name}_link", origin, axis, joint)
            slide = MechanismJoint(f"{joint.name}_slide", "P", "", "", joint.point)
            self._mimics[slide.name] = (joint.name, joint.pitch)
            self._joint(slide.name, "prismatic", f"{joint.name}_link", frame.name, _NOWHERE, axis, slide)
            return
        self._joint(joint.name, kind, parent.name, frame.name, origin, axis, joint)

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
        """Add a URDF joint."""
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
        """Add a link without mass, fixed to another link."""
        ET.SubElement(self._root, "link", name=name)
        self._joint(f"{name}_fixed", "fixed", parent.name, name, _origin(link, parent), None)

    def _cross(self, name: str) -> None:
        """Add a small link between two joints with the same centre."""
        self._link(name, None, Shape((), (), SMALL_MASS, SMALL_MASS * self._size**2 * 1e-2))

    def _link(self, name: str, frame: MechanismLink | None, shape: Shape) -> None:
        """Add a link with its mass and its displayed lines."""
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
    """Return a text as a single-quoted YAML string."""
    doubled = text.replace("'", "''")
    return f"'{doubled}'"


def _origin(link: MechanismLink, parent: MechanismLink) -> dict[str, str]:
    """Return the attributes of a frame's pose in another frame."""
    place = parent.local(link.position)
    turn = roll_pitch_yaw_of(parent.rotation.T @ link.rotation)
    return {"xyz": numbers(place), "rpy": direction(turn)}

"""Writer of MJCF, the format of MuJoCo.

All joint coordinates are 0 at the exported pose. Loops are closed by ``connect`` for spherical joints and by ``weld``
for others; MuJoCo takes the relative poses of these constraints from the exported pose. A helical joint is a hinge and
a slide, coupled by a ``joint`` constraint.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink
from ....models.rotation import quaternion_from_matrix
from .numbers import direction, number, numbers, plain_name
from .shapes import MARK, PIN, ROD, extent, shape_of
from .tree import Edge, spanning_tree

#: Time step, and time constant of the constraints, seconds; MuJoCo needs at least two steps per time constant.
_STEP, _TIME_CONSTANT = 0.001, 0.002
#: Natural frequency of a position actuator that moves the placeholder masses, radians per second.
_FREQUENCY = 60.0

_BASE, _LIMB, _PLATFORM, _JOINT, _DRIVEN = (
    ".45 .45 .5 1",
    ".7 .72 .75 1",
    ".25 .5 .8 1",
    ".2 .2 .2 1",
    ".85 .35 .1 1",
)
#: MuJoCo's type of each kind of joint.
_TYPES: Mapping[str, str] = {"R": "hinge", "H": "hinge", "P": "slide", "S": "ball"}
_COMMENT = (
    " Written by screwsynth. Lengths are in the unit of the case, see README.md. Masses, gains and shapes are"
    " placeholders, and gravity is 0, because the case does not define them. "
)


def mjcf_text(mechanism: Mechanism) -> str:
    """Return the text of an MJCF file of a mechanism.

    Raises:
        MechanismError: a link is not connected to the base.
    """
    return _Writer(mechanism).text()


class _Writer:
    """Writer of one file, which walks the spanning tree."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism, self._tree, self._size = mechanism, spanning_tree(mechanism), extent(mechanism)
        self._home: list[str] = []
        #: Names of the spherical joints that close a loop.
        self._shared = {each.name for each in self._tree.closings if each.kind == "connect"}

    def text(self) -> str:
        """Return the text of the file."""
        root = ET.Element("mujoco", model=plain_name(self._mechanism.name))
        root.append(ET.Comment(_COMMENT))
        ET.SubElement(root, "compiler", angle="radian", autolimits="true")
        option = ET.SubElement(root, "option", gravity="0 0 0", timestep=number(_STEP), integrator="implicitfast")
        ET.SubElement(option, "flag", contact="disable")
        default = ET.SubElement(root, "default")
        ET.SubElement(default, "geom", contype="0", conaffinity="0", mass="0", group="1")
        ET.SubElement(default, "equality", solref=f"{number(_TIME_CONSTANT)} 1")
        visual = ET.SubElement(root, "visual")
        ET.SubElement(visual, "headlight", ambient=".4 .4 .4", diffuse=".5 .5 .5")
        statistic = ET.SubElement(root, "statistic", extent=number(self._size))
        statistic.set("center", numbers(np.mean([joint.point for joint in self._mechanism.joints], axis=0)))
        world = ET.SubElement(root, "worldbody")
        ET.SubElement(world, "light", pos=numbers([0.0, 0.0, 4 * self._size]), dir="0 0 -1")
        base = self._tree.base
        body = ET.SubElement(world, "body", {"name": self._body(base.name)} | _placed(base, None))
        self._shape(body, base, _BASE)
        self._children(body, base)
        self._equalities(root)
        self._actuators(root)
        keys = ET.SubElement(root, "keyframe")
        ET.SubElement(keys, "key", name="solved", qpos=" ".join(self._home))
        ET.indent(root)
        return ET.tostring(root, encoding="unicode") + "\n"

    def _body(self, link: str) -> str:
        """Return the name of a link's body, different from MuJoCo's own body ``world``."""
        names = {each.name for each in self._mechanism.links}
        name = link
        while name == "world" or (name != link and name in names):
            name += "_"
        return name

    def _children(self, body: ET.Element, link: MechanismLink) -> None:
        """Add the bodies of all links below a link of the tree, nested."""
        for edge in self._tree.below(link.name):
            child = edge.child
            inner = ET.SubElement(body, "body", {"name": self._body(child.name)} | _placed(child, link))
            self._joint(inner, edge)
            shape = shape_of(self._mechanism, child.name, self._size)
            middle = np.mean(shape.points, axis=0) if shape.points else edge.joint.point
            place = numbers(child.local(middle))
            inertia = numbers([shape.inertia] * 3)
            ET.SubElement(inner, "inertial", pos=place, mass=number(shape.mass), diaginertia=inertia)
            if not edge.is_copy:
                self._shape(inner, child, _PLATFORM if child.name == self._mechanism.platform else _LIMB)
            self._mark(inner, child, edge.joint, edge.axis)
            for joint in self._mechanism.joints:
                if joint.name in self._shared and joint.outer == child.name:
                    self._mark(inner, child, joint, joint.axis)
            self._children(inner, child)

    def _joint(self, body: ET.Element, edge: Edge) -> None:
        """Add the joint of a body, and its coordinates in the key frame."""
        joint, child = edge.joint, edge.child
        if joint.kind == "weld":
            return
        place = numbers(child.local(joint.point))
        element = ET.SubElement(body, "joint", name=joint.name, type=_TYPES[joint.kind], pos=place)
        if joint.kind == "S":
            self._home.append("1 0 0 0")
            return
        axis = direction(child.rotation.T @ edge.axis)
        element.set("axis", axis)
        self._home.append("0")
        if joint.range is not None:
            element.set("range", numbers(joint.range))
        if joint.kind == "H":
            ET.SubElement(body, "joint", name=_slide_name(joint), type="slide", axis=axis)
            self._home.append("0")

    def _shape(self, body: ET.Element, link: MechanismLink, colour: str) -> None:
        """Add the lines of a link."""
        shape = shape_of(self._mechanism, link.name, self._size)
        for start, end in shape.lines:
            ends = [link.local(shape.points[k]) for k in (start, end)]
            line = numbers(np.concatenate(ends))
            ET.SubElement(body, "geom", type="capsule", fromto=line, size=number(ROD * self._size), rgba=colour)

    def _mark(self, body: ET.Element, link: MechanismLink, joint: MechanismJoint, axis: FloatArray) -> None:
        """Add the displayed mark of a joint to a link: a sphere, or a pin along the axis (3,)."""
        place = link.local(joint.point)
        colour = _DRIVEN if joint.actuated else _JOINT
        if joint.kind == "S":
            ET.SubElement(body, "geom", type="sphere", pos=numbers(place), size=number(MARK * self._size), rgba=colour)
        elif joint.kind in ("R", "H", "P"):
            half = PIN * self._size * (link.rotation.T @ axis)
            line = numbers(np.concatenate([place - half, place + half]))
            ET.SubElement(body, "geom", type="cylinder", fromto=line, size=number(MARK * self._size), rgba=colour)

    def _equalities(self, root: ET.Element) -> None:
        """Add the constraints that close loops and couple coordinates."""
        equality = ET.SubElement(root, "equality")
        for each in self._tree.closings:
            ends = {"name": each.name, "body1": self._body(each.first), "body2": self._body(each.second)}
            if each.kind == "connect":
                body = self._mechanism.link(each.first)
                anchor = numbers(body.local(each.point))
                ET.SubElement(equality, "connect", ends, anchor=anchor)
            else:
                # Rotations are scaled by the robot's size, so that all rows of the weld have the same magnitude.
                ET.SubElement(equality, "weld", ends, torquescale=number(self._size))
        for joint in self._mechanism.joints:
            if joint.kind == "H":
                _couple(equality, f"{joint.name}_pitch", (joint.name, -joint.pitch), (_slide_name(joint), 1.0))
        self._couplings(root, equality)
        if not len(equality):
            root.remove(equality)

    def _couplings(self, root: ET.Element, equality: ET.Element) -> None:
        """Add the couplings: of two coordinates by a polynomial, of more by a tendon of constant length."""
        for coupling in self._mechanism.couplings:
            if len(coupling.factors) == 2:
                one, other = coupling.factors
                _couple(equality, coupling.name, one, other)
                continue
            tendons = root.find("tendon")
            tendons = ET.SubElement(root, "tendon") if tendons is None else tendons
            fixed = ET.SubElement(tendons, "fixed", name=coupling.name)
            for name, factor in coupling.factors:
                ET.SubElement(fixed, "joint", joint=name, coef=number(factor))
            ET.SubElement(equality, "tendon", name=coupling.name, tendon1=coupling.name)

    def _actuators(self, root: ET.Element) -> None:
        """Add a position actuator for each actuated joint."""
        driven = [joint for joint in self._mechanism.joints if joint.actuated]
        actuator = ET.SubElement(root, "actuator") if driven else root
        total = sum(shape_of(self._mechanism, link.name, self._size).mass for link in self._mechanism.links)
        for joint in driven:
            inertia = total * (1.0 if joint.kind == "P" else self._size**2)
            element = ET.SubElement(actuator, "position", name=joint.name, joint=joint.name)
            element.set("kp", number(float(f"{inertia * _FREQUENCY**2:.3g}")))
            element.set("kv", number(float(f"{2 * inertia * _FREQUENCY:.3g}")))
            if joint.range is not None and all(map(math.isfinite, joint.range)):
                element.set("ctrlrange", numbers(joint.range))


def _couple(equality: ET.Element, name: str, one: tuple[str, float], other: tuple[str, float]) -> None:
    """Add a constraint that keeps the sum of factors times coordinates of two joints constant."""
    factor = number(-one[1] / other[1])
    ET.SubElement(equality, "joint", name=name, joint1=other[0], joint2=one[0], polycoef=f"0 {factor} 0 0 0")


def _slide_name(joint: MechanismJoint) -> str:
    """Return the name of the slide of a helical joint."""
    return f"{joint.name}_slide"


def _placed(link: MechanismLink, parent: MechanismLink | None) -> dict[str, str]:
    """Return the attributes of a body's pose in its parent, or in the world."""
    origin: FloatArray = np.zeros(3) if parent is None else parent.position
    turn: FloatArray = np.eye(3) if parent is None else parent.rotation
    return {
        "pos": numbers(turn.T @ (link.position - origin)),
        "quat": direction(quaternion_from_matrix(turn.T @ link.rotation)),
    }

"""Mechanisms in numbers from the tables of robot files, with each joint split into elementary joints.

A universal joint becomes two hinges, a cylindrical joint a hinge and a slide, and a parallelogram four hinges with two
rods, which form a nested loop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...mechanism.graph import Coupling, ElementaryKind, Mechanism, MechanismError, MechanismJoint, MechanismLink
from ...parts import Dimension
from ..written.words import read_robot
from .chain import HomeGraph, HomeRobot, Joint, home_of

#: Distance of a parallelogram's rods from its middle line, relative to their length.
_APART = 0.1
#: Function that returns the values of a vector (3, 1) of expressions.
Values = Callable[[SX], FloatArray]


def mechanism_of(tables: Mapping[str, object], dimensions: Mapping[str, float] | None = None) -> Mechanism:
    """Return the mechanism of a robot file at home.

    Joint names are limb and place, such as ``2:3``; the hinges of one joint are ``2:3.1``, ``2:3.2`` and so on. An
    actuated parallelogram is driven at its first hinge: its rate is that of an angle, not the length per unit of time
    of the robot file.

    Args:
        tables: tables of the robot file.
        dimensions: values that replace the typical ones, degrees for angles.

    Raises:
        RobotError: the tables have a fault.
        MechanismError: a dimension is unknown, or a point or axis has no finite value.
    """
    return mechanism_at_home(home_of(read_robot(tables)), dimensions)


def mechanism_at_home(robot: HomeRobot, dimensions: Mapping[str, float] | None = None) -> Mechanism:
    """Return the mechanism of a robot at home; the arguments and errors are those of :func:`mechanism_of`."""
    values = _values(robot, dimensions or {})
    if robot.graph is not None:
        return _mechanism_of_graph(robot, robot.graph, values)
    parts = Parts(["base", "platform"], values)
    for limb in robot.limbs:
        known: dict[int, str] = {}
        for number, path in enumerate(limb.paths):
            at = "base"
            for j, joint in enumerate(path):
                label = limb.label(number, j)
                is_last = j == len(path) - 1
                target = "platform" if is_last else known.get(id(joint), f"link {label}")
                if id(joint) not in known:
                    known[id(joint)] = target
                    if not is_last:
                        parts.links.append(target)
                    parts.add(label, joint, at, target)
                at = target
    return parts.mechanism(robot.words.name, values(robot.home))


def _mechanism_of_graph(robot: HomeRobot, graph: HomeGraph, values: Values) -> Mechanism:
    """Return the mechanism of a robot given by links and joints, which keep their names."""
    parts = Parts(list(graph.links), values)
    for each in graph.joints:
        if each.joint is None:
            parts.joints.append(MechanismJoint(each.name, "weld", each.inner, each.outer, np.zeros(3)))
        else:
            parts.add(each.name, each.joint, each.inner, each.outer)
    couplings = tuple(
        Coupling(
            f"coupling {number + 1}",
            tuple((graph.joints[k].name, float(values(factor)[0])) for k, factor in coupling),
        )
        for number, coupling in enumerate(graph.couplings)
    )
    found = parts.mechanism(robot.words.name, values(robot.home), (graph.base, graph.platform))
    return replace(found, couplings=couplings)


def _values(robot: HomeRobot, dimensions: Mapping[str, float]) -> Values:
    """Return the function that evaluates vectors at given dimensions."""
    numbers = robot.typical.copy()
    names = list(robot.words.dimensions)
    for name, value in dimensions.items():
        if name not in names:
            raise MechanismError(f"dimension {name}", f"is unknown; dimensions are {', '.join(names)}")
        is_angle = robot.words.dimensions[name].kind is Dimension.ANGLE
        numbers[names.index(name)] = math.radians(value) if is_angle else value

    def values(expression: SX) -> FloatArray:
        function = ca.Function("values", [robot.symbols], [ca.densify(expression)])
        found = np.asarray(function(numbers).full(), dtype=np.float64).ravel()
        if not np.isfinite(found).all():
            raise MechanismError("", "has a point or axis without a finite value at these dimensions")
        return found

    return values


@dataclass(eq=False)
class Parts:
    """Links and joints of a mechanism under construction.

    Attributes:
        links: names of the links.
        values: function that returns the numeric value of a vector expression.
        joints: elementary joints.
    """

    links: list[str]
    values: Values
    joints: list[MechanismJoint] = field(default_factory=list)

    def add(self, name: str, joint: Joint, inner: str, outer: str) -> None:
        """Split a joint between two links into elementary joints, and add these."""
        point = self.values(joint.point)
        axes = [self.values(axis.axis) for axis in joint.axes]
        driven = joint.actuated
        match joint.type:
            case "S":
                self.joints.append(MechanismJoint(name, "S", inner, outer, point))
            case "R" | "P":
                kind: ElementaryKind = "R" if joint.type == "R" else "P"
                self.joints.append(MechanismJoint(name, kind, inner, outer, point, axes[0], actuated=driven))
            case "H":
                pitch = float(self.values(joint.axes[0].pitch)[0])
                self.joints.append(MechanismJoint(name, "H", inner, outer, point, axes[0], pitch, actuated=driven))
            case "Pa":
                self._add_parallelogram(name, point, axes[0], self.values(joint.axes[0].rod), (inner, outer), driven)
            case _:
                middle = f"{name} between"
                self.links.append(middle)
                second = MechanismJoint(f"{name}.2", "P" if joint.type == "C" else "R", middle, outer, point, axes[1])
                self.joints += [MechanismJoint(f"{name}.1", "R", inner, middle, point, axes[0]), second]

    def _add_parallelogram(
        self, name: str, point: FloatArray, axis: FloatArray, rod: FloatArray, ends: tuple[str, str], driven: bool
    ) -> None:
        """Add a parallelogram as four hinges and two rods."""
        aside = _APART * np.cross(axis, rod)
        rods = [(f"{name} rod {k + 1}", 2 * k + 1, side) for k, side in enumerate((aside, -aside))]
        self.links += [link for link, _, _ in rods]
        for link, number, side in rods:
            is_driven = driven and number == 1
            self.joints.append(
                MechanismJoint(f"{name}.{number}", "R", ends[0], link, point + side, axis, actuated=is_driven)
            )
        for link, number, side in rods:
            self.joints.append(MechanismJoint(f"{name}.{number + 1}", "R", link, ends[1], point + rod + side, axis))

    def mechanism(self, name: str, home: FloatArray, ends: Sequence[str] = ("base", "platform")) -> Mechanism:
        """Return the mechanism of these parts; the platform frame is at home, parallel to the world frame."""
        base, platform = ends
        links = [MechanismLink(each, home) if each == platform else MechanismLink(each) for each in self.links]
        return Mechanism(name, tuple(links), tuple(self.joints), base, platform)

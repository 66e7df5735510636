"""Joints and links of a chain for limits: coordinates from home, cone directions, and segments.

Unknowns are coordinates of their joint. A joint at which the chain is opened, and rotations merged into a spherical
joint, have coordinates from the displacements of both adjacent bodies: sine and cosine in closed form, each times one
positive factor. For a universal joint at the end of a rod they follow from the rod's direction. A rod between two
spherical joints spins freely. Links are segments between joint centres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...limbjoints import JointCone, JointCoordinate, LimbJoint, LimbLink
from ...parts import Dimension
from ..home.chain import Joint, Limb
from ..home.generic import PathFrame
from ..home.motion import AxisKind, JointAxis, Motion
from .opened import OpenedPath, slide_length

#: Names of the two coordinates of a joint with two axes.
COORDINATE_PARTS: Mapping[str, tuple[str, ...]] = {"U": ("first", "second"), "C": ("angle", "stroke")}
#: Value of ``a1 . (a2 x d)`` at home above which the solution of an angle that is 0 at home differs from the other one:
#: rounding leaves 1e-16.
_DISTINCT = 1e-6
_ROD = "the joint is at an end of a rod between two spherical joints, and this rod spins freely"
_PLANE = "the three axes of the joint are in one plane at home, where its three angles are not determined"


class Angle(NamedTuple):
    """Angle given by its sine and cosine (1, 1), both times the same positive factor."""

    sine: SX
    cosine: SX

    @property
    def reversed(self) -> Angle:
        """Angle with the opposite sign."""
        return Angle(-self.sine, self.cosine)


def angle_about(axis: SX, before: SX, after: SX) -> Angle:
    """Return the angle of the rotation about a unit axis (3, 1) that takes one vector (3, 1) to another.

    The vectors have equal components along the axis, and nonzero components normal to it.
    """
    across, turned = before - axis * ca.dot(axis, before), after - axis * ca.dot(axis, after)
    return Angle(ca.dot(axis, ca.cross(across, turned)), ca.dot(across, turned))


def rotation_angle(axis: SX, rotation: SX) -> Angle:
    """Return the angle of a rotation (3, 3) about its unit axis (3, 1): ``sin`` and ``cos`` times 2."""
    return Angle(ca.dot(axis, ca.inv_skew(rotation - rotation.T)), ca.trace(rotation) - 1)


def two_angles(axes: tuple[SX, SX], before: SX, after: SX, sign: float) -> tuple[Angle, Angle]:
    """Return the angles q1 and q2 with ``after = R(a1, q1) R(a2, q2) before``.

    ``a1 . after = a1 . R(a2, q2) before`` is ``A + B cos q2 + C sin q2`` and has two solutions; at home, where
    ``after = before``, one of them is 0. The solutions coincide where a1 lies in the plane of a2 and the vector.

    Args:
        axes: (3, 1) unit axes a1 and a2 at home.
        before: (3, 1) unit vector at home.
        after: (3, 1) current unit vector.
        sign: sign of ``C = a1 . (a2 x before)`` at home.
    """
    a1, a2 = axes
    A = ca.dot(a1, a2) * ca.dot(a2, before)
    B, C = ca.dot(a1, before) - A, ca.dot(a1, ca.cross(a2, before))
    n = ca.dot(a1, after) - A
    w = sign * ca.sqrt(B * B + C * C - n * n)
    second = Angle(C * n - B * w, B * n + C * w)
    square = B * B + C * C
    sine, cosine = second.sine / square, second.cosine / square
    turned = before + sine * ca.cross(a2, before) + (1 - cosine) * (a2 * ca.dot(a2, before) - before)
    return angle_about(a1, turned, after), second


class _Coordinates(NamedTuple):
    """Coordinates of all axes of a joint in order; empty if they are not known, with the reason."""

    values: Sequence[JointCoordinate]
    unknown: str = ""


class PathJoints:
    """Coordinates and cone directions of the joints of an opened chain, for limits.

    Args:
        limb: the limb.
        path: the chain.
        known: coordinates that are unknowns, by the joint's identity and the number of the axis.
        frame: common data of all chains of the robot.
    """

    def __init__(self, limb: Limb, path: OpenedPath, known: Mapping[tuple[Joint, int], SX], frame: PathFrame) -> None:
        self._limb, self._path, self._known, self._frame = limb, path, known, frame

    def states(self, labels: Mapping[int, str]) -> list[LimbJoint]:
        """Return the states of the chain's joints as they are written; ``labels`` has a label by a joint's identity."""
        found = []
        for j, joint in enumerate(self._path.joints):
            coordinates = self._coordinates(j)
            written = joint.parts or (joint,)
            start = 0
            for each in written:
                if id(each) not in labels:
                    continue
                own = [] if each.type == "S" else coordinates.values[start : start + len(each.axes)]
                start += len(each.axes)
                names = COORDINATE_PARTS.get(each.type, ("",))
                named = [
                    JointCoordinate(name, one.dimension, one.value, one.cosine)
                    for name, one in zip(names, own, strict=False)
                ]
                cone = self._cone(j) if each.type in ("U", "S") and len(written) == 1 else None
                unknown = coordinates.unknown if each.type != "S" else ""
                if each.type in ("U", "S") and cone is None:
                    unknown = unknown or "the joint has no link of nonzero length"
                label = labels[id(each)]
                found.append(LimbJoint(label, each.name, self._limb.name, each.type, tuple(named), cone, unknown))
        return found

    def _coordinates(self, j: int) -> _Coordinates:
        """Return the coordinates of a joint's axes."""
        path, joint = self._path, self._path.joints[j]
        axes = [axis for part in joint.parts or (joint,) for axis in part.axes]
        if j == path.cut.slide:
            way = slide_length(path, self._frame)
            return _Coordinates([] if way is None else [JointCoordinate("", Dimension.LENGTH, way)])
        if joint.type == "S" and not joint.parts:
            return _Coordinates([])
        if joint.type != "S" and (joint, 0) in self._known:
            values = [self._known[joint, a] for a in range(len(joint.axes))]
            return _Coordinates([_coordinate(axis, value) for axis, value in zip(joint.axes, values, strict=True)])
        if path.cut.far is not None and j in (path.cut.joint, path.cut.far):
            return self._at_rod(j)
        return self._between(axes, self._before(j).rotation.T @ self._behind(j).rotation)

    def _between(self, axes: Sequence[JointAxis], turn: SX) -> _Coordinates:
        """Return the angles about one, two or three axes from the rotation (3, 3) of the body behind these axes."""
        a = [axis.axis for axis in axes]
        if len(a) == 1:
            return _Coordinates([_angle(rotation_angle(a[0], turn))])
        if len(a) == 2:
            first, second = angle_about(a[0], a[1], turn @ a[1]), angle_about(a[1], turn.T @ a[0], a[0])
            return _Coordinates([_angle(first), _angle(second)])
        sign = self._sign(a[0], a[1], a[2])
        if sign == 0:
            return _Coordinates([], _PLANE)
        first, second = two_angles((a[0], a[1]), a[2], turn @ a[2], sign)
        size = ca.sqrt(second.sine**2 + second.cosine**2)
        sine, cosine = second.sine / size, second.cosine / size
        back = a[0] - sine * ca.cross(a[1], a[0]) + (1 - cosine) * (a[1] * ca.dot(a[1], a[0]) - a[0])
        return _Coordinates([_angle(first), _angle(second), _angle(angle_about(a[2], turn.T @ a[0], back))])

    def _at_rod(self, j: int) -> _Coordinates:
        """Return the angles of a universal joint at an end of the chain's rod."""
        path, joint = self._path, self._path.joints[j]
        rod, end = path.rod, path.cut.joint if j == path.cut.far else path.cut.far
        if joint.type != "U" or rod is None or end is None:
            return _Coordinates([], _ROD)
        home = path.joints[end].point - joint.point
        now = rod if j == path.cut.far else -rod
        is_base_side = j < end
        if path.cut.slide is not None:
            way = slide_length(path, self._frame)
            axis = path.joints[path.cut.slide].axes[0].axis
            home = home if way is None else home + axis * (way if is_base_side else -way)
        body = self._before(j) if is_base_side else self._behind(j)
        a1, a2 = (axis.axis for axis in (joint.axes if is_base_side else joint.axes[::-1]))
        sign = self._sign(a1, a2, path.joints[end].point - joint.point)
        if sign == 0:
            return _Coordinates([], "the joint's two axes and the rod are in one plane at home")
        first, second = two_angles((a1, a2), home / ca.norm_2(home), body.rotation.T @ now / ca.norm_2(now), sign)
        if is_base_side:
            return _Coordinates([_angle(first), _angle(second)])
        # Seen from the platform, the rotations have the reverse order and opposite signs.
        return _Coordinates([_angle(second.reversed), _angle(first.reversed)])

    def _sign(self, a1: SX, a2: SX, vector: SX) -> float:
        """Return the sign of ``a1 . (a2 x vector)`` at the typical dimensions; 0 if this product is too small."""
        unit = vector / ca.norm_2(vector)
        value = self._frame.typical_value(ca.dot(a1, ca.cross(a2, unit))).item()
        return 0.0 if abs(value) < _DISTINCT else float(np.sign(value))

    def _cone(self, j: int) -> JointCone | None:
        """Return the directions that a cone limit on a universal or spherical joint compares.

        The direction of a link points to the platform.
        """
        path, place = self._path, self._path.joints[j].point
        turn = self._limb.turn
        if path.cut.far is not None and path.rod is not None and j in (path.cut.joint, path.cut.far):
            end = path.cut.joint if j == path.cut.far else path.cut.far
            rod, home = path.rod, path.joints[path.cut.joint].point - path.joints[path.cut.far].point
            sign = 1 if path.cut.far < path.cut.joint else -1
            other = self._before(j) if j < end else self._behind(j)
            return _cone(sign * rod, sign * home, other, turn)
        for others, sign, link, opposite in (
            (range(j + 1, len(path.joints)), 1, self._behind, self._before),
            (range(j - 1, -1, -1), -1, self._before, self._behind),
        ):
            for k in others:
                home = sign * (path.joints[k].point - place)
                if not self._frame.is_zero(ca.norm_2(home) / self._frame.size):
                    return _cone(link(j).rotation @ home, home, opposite(j), turn)
        # All joints share one centre at home: a slide next to the joint has the direction of its link.
        for k, link, opposite in ((j + 1, self._behind, self._before), (j - 1, self._before, self._behind)):
            if 0 <= k < len(path.joints) and path.joints[k].type == "P":
                axis = path.joints[k].axes[0].axis
                return _cone(link(j).rotation @ axis, axis, opposite(j), turn)
        return None

    def _before(self, j: int) -> Motion:
        """Return the displacement of the body on the base side of a joint outside a rod."""
        return self._path.body_before(j) or Motion.none()

    def _behind(self, j: int) -> Motion:
        """Return the displacement of the body on the platform side of a joint outside a rod."""
        return self._path.body_behind(j) or self._path.sides[1]


def _cone(link: SX, home: SX, other: Motion, turn: FloatArray) -> JointCone:
    """Return the directions of a cone limit from vectors along a link, at the pose and at home."""
    return JointCone(link / ca.norm_2(link), home / ca.norm_2(home), other.rotation, turn)


def _angle(angle: Angle) -> JointCoordinate:
    return JointCoordinate("", Dimension.ANGLE, angle.sine, angle.cosine)


def _coordinate(axis: JointAxis, value: SX) -> JointCoordinate:
    """Return the coordinate of an axis; for a parallelogram the angle of its rods, or its travel if it is actuated."""
    if axis.kind is AxisKind.PARALLELOGRAM and axis.actuated:
        return JointCoordinate("", Dimension.LENGTH, axis.travel(value))
    return JointCoordinate("", Dimension.LENGTH if axis.kind is AxisKind.TRANSLATION else Dimension.ANGLE, value)


def limb_links(path: OpenedPath, labels: Mapping[int, str], frame: PathFrame) -> list[LimbLink]:
    """Return the links of a chain, from the base on.

    Links end at joints; of several joints with a common centre at home, only at the joint nearest the base. A slide
    along the line between its neighbours is not an end of a link: the link includes the travel of the slide.

    Args:
        path: the chain.
        labels: labels of the joints, by identity.
        frame: common data of all chains of the robot.
    """
    ends: list[int] = []
    for j, joint in enumerate(path.joints):
        if not any(frame.coincide(joint.point, path.joints[k].point) for k in ends[-1:]):
            ends.append(j)
    ends = [
        j for i, j in enumerate(ends) if not (0 < i < len(ends) - 1 and _is_along(path, ends[i - 1 : i + 2], frame))
    ]
    links = []
    for one, other in pairwise(ends):
        names = [labels[id((path.joints[j].parts or (path.joints[j],))[0])] for j in (one, other)]
        start = _place(path, one)
        links.append(LimbLink(" to ".join(names), frozenset(names), start, _place(path, other) - start))
    return links


def _place(path: OpenedPath, j: int) -> SX:
    """Return the current position (3, 1) of a joint on the body after it, which includes the travel of a slide."""
    behind = path.behind[j]
    return path.points[j] if behind is None else behind.point(path.joints[j].point)


def _is_along(path: OpenedPath, joints: Sequence[int], frame: PathFrame) -> bool:
    """Return True if the second of three joints is a slide along the line between the others."""
    before, slide, behind = (path.joints[j] for j in joints)
    if slide.type != "P":
        return False
    axis = slide.axes[0].axis
    off = ca.vertcat(ca.cross(slide.point - before.point, axis), ca.cross(behind.point - slide.point, axis))
    return frame.is_zero(ca.norm_2(off) / frame.size)


def with_shared_places(paths: Sequence[tuple[OpenedPath, list[LimbLink]]], frame: PathFrame) -> tuple[LimbLink, ...]:
    """Return the links of all chains.

    Joints of the base with a common centre get one name, and so do joints of the platform.

    Args:
        paths: each chain with its links.
        frame: common data of all chains of the robot.
    """
    found = [link for _, links in paths for link in links]
    names: dict[str, str] = {}
    for side in (0, -1):
        known: list[tuple[str, SX]] = []
        for path, links in paths:
            if not links:
                continue
            label = links[side].name.split(" to ")[side]
            point = path.joints[side].point
            same = next((name for name, other in known if frame.coincide(point, other)), None)
            known += [] if same else [(label, point)]
            names.setdefault(label, same or label)
    unique = {link.name: link for link in found}
    return tuple(
        LimbLink(link.name, frozenset(names.get(end, end) for end in link.ends), link.start, link.span)
        for link in unique.values()
    )

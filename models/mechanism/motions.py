"""Displacements and screws of all links and joints of a mechanism at any joint coordinates.

Links are placed along a spanning tree from the base. A joint outside the tree closes a loop: its residual is the
displacement between its two sides. Angles are in radians and lengths relative to the mechanism's size, so that
residuals and coordinates are dimensionless.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import FloatArray
from ..rotation import axis_angle_from_matrix
from .graph import ElementaryKind, Mechanism, MechanismJoint
from .topology import spanning_tree

#: Number of coordinates of each kind of joint. Those of a spherical joint are steps of a rotation, which is stored as a
#: matrix: three angles would be singular somewhere.
WIDTHS: dict[ElementaryKind, int] = {"R": 1, "P": 1, "H": 1, "S": 3, "weld": 0}


def rotation_matrix(vector: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,), radians."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K))


def rotation_vector(matrix: FloatArray) -> FloatArray:
    """Return the rotation vector (3,), radians, of a rotation matrix (3, 3)."""
    axis, angle = axis_angle_from_matrix(matrix)
    return axis * angle


def size_of(mechanism: Mechanism) -> float:
    """Return the size of a mechanism, length: the largest extent of its joints; 1 if all are at one point."""
    points = np.array([joint.point for joint in mechanism.joints if joint.kind != "weld"]).reshape(-1, 3)
    return float(np.max(np.ptp(points, axis=0), initial=0.0)) or 1.0 if len(points) else 1.0


def about(rotation: FloatArray, point: FloatArray, shift: FloatArray) -> FloatArray:
    """Return the displacement (4, 4) that rotates about a point (3,) and then translates."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation, point - rotation @ point + shift
    return found


def moved(displacement: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point (3,) after a displacement (4, 4)."""
    return np.asarray(displacement[:3, :3] @ point + displacement[:3, 3])


def inverse(displacement: FloatArray) -> FloatArray:
    """Return the inverse displacement (4, 4)."""
    found = np.eye(4)
    found[:3, :3] = displacement[:3, :3].T
    found[:3, 3] = -displacement[:3, :3].T @ displacement[:3, 3]
    return found


class Coordinates(NamedTuple):
    """Values of all joint coordinates.

    Attributes:
        values: (n,) coordinates by column, radians and lengths relative to the mechanism's size; 0 for those of
            spherical joints.
        balls: (3, 3) rotation of each spherical joint, by the joint's index.
    """

    values: FloatArray
    balls: dict[int, FloatArray]


class Equations(NamedTuple):
    """Equations of a mechanism at given coordinates.

    Attributes:
        residual: (m,) scaled left sides, zero at a solution.
        slopes: (m, n) derivatives with respect to scaled coordinates, exact at a solution.
    """

    residual: FloatArray
    slopes: FloatArray


class Placed(NamedTuple):
    """Mechanism at given coordinates.

    Attributes:
        displacements: (4, 4) displacement of each link from the stated configuration, by name.
        joints: (4, 4) displacement of each joint's outer link relative to its inner link.
        screws: (6, k) current unit screws of each joint's axes, as twists about the world origin.
        twists: (6, n) twists of each link for unit rates of the tree's coordinates, by name.
    """

    displacements: dict[str, FloatArray]
    joints: list[FloatArray]
    screws: list[FloatArray]
    twists: dict[str, FloatArray]


def joint_screws(joint: MechanismJoint, rotation: FloatArray, point: FloatArray) -> FloatArray:
    """Return the unit screws (6, k) of a joint's axes as twists.

    Args:
        joint: the joint.
        rotation: (3, 3) rotation of the inner link from the stated configuration of the joint.
        point: (3,) current position of the joint, length.
    """
    if joint.kind == "weld":
        return np.zeros((6, 0))
    if joint.kind == "S":
        return np.vstack([np.eye(3), np.cross(point, np.eye(3)).T])
    axis = rotation @ joint.axis
    if joint.kind == "P":
        return np.concatenate([np.zeros(3), axis])[:, None]
    pitch = joint.pitch if joint.kind == "H" else 0.0
    return np.concatenate([axis, np.cross(point, axis) + pitch * axis])[:, None]


class Motions:
    """Motions of a mechanism along a spanning tree from its base.

    Args:
        mechanism: the mechanism.

    Attributes:
        columns: slice of each joint's coordinates among all coordinates.
        count: number of coordinates.
        size: reference length of coordinates and residuals.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.size = mechanism, size_of(mechanism)
        edges = [(joint.inner, joint.outer) for joint in mechanism.joints]
        widths = [WIDTHS[joint.kind] for joint in mechanism.joints]
        self.tree = spanning_tree([mechanism.base], edges, lambda k: widths[k])
        ends = np.cumsum([0, *widths])
        self.columns = [slice(int(ends[k]), int(ends[k + 1])) for k in range(len(widths))]
        self.count = int(ends[-1])
        self._index = {joint.name: k for k, joint in enumerate(mechanism.joints)}
        unit = [
            self.size if joint.kind == "P" else 1.0 for joint in mechanism.joints for _ in range(WIDTHS[joint.kind])
        ]
        #: (n,) factors from scaled coordinates to radians and lengths.
        self.units = np.array(unit)

    @property
    def stated(self) -> Coordinates:
        """Coordinates of the stated configuration."""
        balls = {k: np.eye(3) for k, joint in enumerate(self.mechanism.joints) if joint.kind == "S"}
        return Coordinates(np.zeros(self.count), balls)

    def column(self, joint: str) -> int:
        """Return the column of the coordinate of an R, P or H joint."""
        return self.columns[self._index[joint]].start

    def placed(self, at: Coordinates) -> Placed:
        """Return the mechanism at given coordinates."""
        joints = self.mechanism.joints
        own = [self._relative_displacement(k, at) for k in range(len(joints))]
        displacements = {self.mechanism.base: np.eye(4)}
        twists = {self.mechanism.base: np.zeros((6, self.count))}
        screws: list[FloatArray] = [np.zeros((6, 0))] * len(joints)
        for k, parent, child in self.tree.branches:
            outward = joints[k].inner == parent
            displacements[child] = displacements[parent] @ (own[k] if outward else inverse(own[k]))
            screws[k] = self._screws(k, displacements)
            twist = twists[parent].copy()
            twist[:, self.columns[k]] += screws[k] if outward else -screws[k]
            twists[child] = twist
        for k in self.tree.chords:
            screws[k] = self._screws(k, displacements)
        return Placed(displacements, own, screws, twists)

    def loops(self, placed: Placed) -> Equations:
        """Return the closure errors, rotation vector and displacement, of each of the c joints that close a loop."""
        residuals, slopes = [np.zeros(0)], [np.zeros((0, self.count))]
        for k in self.tree.chords:
            joint = self.mechanism.joints[k]
            inner, outer = placed.displacements[joint.inner], placed.displacements[joint.outer]
            relative = placed.twists[joint.outer] - placed.twists[joint.inner]
            relative[:, self.columns[k]] -= placed.screws[k]
            point = moved(inner @ placed.joints[k], joint.point if joint.outer_point is None else joint.outer_point)
            residuals.append(self._mismatch(outer @ inverse(inner @ placed.joints[k]), point))
            slopes.append(self.at_point(relative, point))
        return Equations(np.concatenate(residuals), np.vstack(slopes))

    def towards(self, placed: Placed, link: str, target: FloatArray) -> Equations:
        """Return the error of a link's displacement relative to a target (4, 4), as for a joint in :meth:`loops`."""
        origin = next(each.position for each in self.mechanism.links if each.name == link)
        residual = self._mismatch(placed.displacements[link] @ inverse(target), moved(target, origin))
        return Equations(residual, self.at_point(placed.twists[link], moved(target, origin)))

    def stepped(self, at: Coordinates, step: FloatArray, placed: Placed) -> Coordinates:
        """Return coordinates after a step (n,)."""
        balls = {}
        for k, ball in at.balls.items():
            inner = placed.displacements[self.mechanism.joints[k].inner][:3, :3]
            balls[k] = inner.T @ rotation_matrix(step[self.columns[k]]) @ inner @ ball
        values = at.values + step
        for k in at.balls:
            values[self.columns[k]] = 0.0
        return Coordinates(values, balls)

    def at_point(self, twists: FloatArray, point: FloatArray) -> FloatArray:
        """Return twists (6, n) with the velocities of a point relative to the size, for scaled coordinates."""
        velocities = twists[3:] + np.cross(twists[:3].T, point).T
        return np.asarray(np.vstack([twists[:3], velocities / self.size]) * self.units)

    def _mismatch(self, displacement: FloatArray, point: FloatArray) -> FloatArray:
        """Return a displacement (4, 4) as rotation vector and relative translation of a point, (6,)."""
        turn = rotation_vector(displacement[:3, :3])
        return np.concatenate([turn, (moved(displacement, point) - point) / self.size])

    def _relative_displacement(self, k: int, at: Coordinates) -> FloatArray:
        """Return the displacement (4, 4) of a joint's outer link at the stated configuration of its inner one."""
        joint, value = self.mechanism.joints[k], at.values[self.columns[k]]
        outer = joint.point if joint.outer_point is None else joint.outer_point
        turn, shift = np.eye(3), joint.point - outer
        if joint.kind == "S":
            turn = at.balls[k]
        elif joint.kind == "P":
            shift = shift + self.size * float(value[0]) * joint.axis
        elif joint.kind in ("R", "H"):
            angle = float(value[0])
            turn = rotation_matrix(angle * joint.axis)
            shift = shift + (joint.pitch * angle * joint.axis if joint.kind == "H" else 0.0)
        return about(turn, outer, shift)

    def _screws(self, k: int, displacements: dict[str, FloatArray]) -> FloatArray:
        joint = self.mechanism.joints[k]
        inner = displacements[joint.inner]
        return joint_screws(joint, inner[:3, :3], moved(inner, joint.point))

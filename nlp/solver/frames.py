"""Frames in which the poses of an exchange are given, in the variables of its program: path frame, or stated pose.

The frame of a path also rotates positions. A workspace about a pose has excursions along the axes of the world, which
rotate the platform of that pose: see :mod:`screwsynth.nlp.case.excursions`.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from ...models import FloatArray, axis_angle_from_matrix
from ..path.path import SymbolicPose
from ..program.nlp import Nlp
from ..proof.workspace.robot.pose_box import PoseNumbers


def pose_of(position: FloatArray, rotation: FloatArray) -> PoseNumbers:
    """Return a pose from its position (3,) and its rotation matrix (3, 3)."""
    return PoseNumbers(position, rotation, *axis_angle_from_matrix(rotation))


def excursion_to(
    stated: tuple[FloatArray, FloatArray], position: FloatArray, rotation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the position and rotation in the world of an excursion from a stated pose."""
    return stated[0] + position, rotation @ stated[1]


def excursion_from(
    stated: tuple[FloatArray, FloatArray], position: FloatArray, rotation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the position and rotation of the excursion from a stated pose to a given pose in the world."""
    return position - stated[0], rotation @ stated[1].T


@dataclass(frozen=True, eq=False)
class Frame:
    """Frame in which the poses of an exchange are given.

    Attributes:
        place: pose of the frame in the world, as expressions of a program.
        is_path: If true, this is the frame of a path; otherwise, the reference pose of a workspace.
    """

    place: SymbolicPose
    is_path: bool = False

    def in_world(self, position: SX, rotation: SX) -> SymbolicPose:
        """Return a pose in the world, from its position (3, 1) and its rotation (3, 3) in this frame."""
        origin, R = self.place
        if self.is_path:
            return SymbolicPose(origin + R @ position, R @ rotation)
        return SymbolicPose(origin + position, rotation @ R)

    def placed(self, pose: PoseNumbers) -> SymbolicPose:
        """Return a pose of this frame in the world."""
        return self.in_world(SX(pose.position.tolist()), SX(pose.rotation.tolist()))

    def carried(self, at: SymbolicPose, nlp: Nlp, x: FloatArray) -> SymbolicPose:
        """Return a world pose that is fixed in this frame, and equals ``at`` at a point of a program.

        Args:
            at: pose in the world, whose expressions are no variables of the frame.
            nlp: the nonlinear program.
            x: (n,) the point at which the pose has its value.
        """
        position, rotation = self.at(self.place, nlp, x)
        return self.in_world(at.position - SX(position.tolist()), at.rotation @ SX(rotation.T.tolist()))

    def returned(self, at: SymbolicPose, nlp: Nlp, x: FloatArray) -> SymbolicPose:
        """Undo :meth:`carried`: return the world pose for the frame at its pose at a point (n,) of a program."""
        position, rotation = self.at(self.place, nlp, x)
        turned = at.rotation @ self.place.rotation.T @ SX(rotation.tolist())
        return SymbolicPose(at.position - self.place.position + SX(position.tolist()), turned)

    @staticmethod
    def at(pose: SymbolicPose, nlp: Nlp, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return position (3,) and rotation (3, 3) of a pose at a point (n,) of a program."""
        program = nlp.program
        function = ca.Function("placed", [program.x, program.p], [ca.densify(each) for each in pose])
        position, rotation = (each.full() for each in function(x, nlp.arguments))
        return position.ravel(), rotation

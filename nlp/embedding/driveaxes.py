"""Axes of actuators at home: the axis about which one turns, or the direction in which one slides."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...models import FloatArray, Substitution
from .kinematics import Kinematics

#: Largest component that is printed as 0.
_ZERO = 1e-9


class DriveAxis(NamedTuple):
    """Axis of an actuator at home, in the conventions of the case.

    Attributes:
        direction: (3,) unit vector of the turning axis, or of the slide, for a positive coordinate.
        before: (6, k) screws of the joints between base and actuator.
    """

    direction: FloatArray
    before: FloatArray


def drive_axes(robot: Kinematics) -> dict[str, DriveAxis]:
    """Return the axes of actuators by name.

    Actuators of robots that are not given joint by joint are missing.
    """
    model, start = robot.robot.model, robot.start
    joints = {each.joint: each.name for each in model.actuators}
    parameters = robot.case.fixed_parameters("axes of actuators are computed with fixed dimensions")
    axes: dict[str, DriveAxis] = {}
    for path in model.joint_screws:
        screws = ca.Function("screws", Substitution.identity(model).all, [ca.densify(path.all)])
        at_start = np.array(screws(parameters, start[12:], start[:9].reshape(3, 3).T, start[9:12]), dtype=np.float64)
        for column in path.driven:
            name, screw = joints.get(path.joints[column], ""), at_start[:, column]
            line = screw[:3] if np.linalg.norm(screw[:3]) else screw[3:]
            if np.linalg.norm(line):
                axes.setdefault(name, DriveAxis(line / np.linalg.norm(line), at_start[:, :column]))
    # A motor that moves the platform by couplings alone has no screw of the platform, but a symbol in the drawing.
    for symbol in model.scene.joints:
        name = joints.get(symbol.name, "")
        if name and name not in axes and len(symbol.axes) == 1:
            axis = ca.Function("axis", Substitution.identity(model).all, [ca.densify(symbol.axes[0])])
            line = np.array(axis(parameters, start[12:], start[:9].reshape(3, 3).T, start[9:12])).ravel()
            axes[name] = DriveAxis(line / np.linalg.norm(line), np.zeros((6, 0)))
    return axes


def direction_texts(robot: Kinematics) -> list[str]:
    """Return the axis of each actuator for a positive coordinate of the controller, in the controller's world frame.

    The texts are empty for a robot that is not given joint by joint.
    """
    axes = drive_axes(robot)
    if any(each.name not in axes for each in robot.drives):
        return [""] * len(robot.drives)
    return list(_texts(robot, axes))


def _texts(robot: Kinematics, axes: dict[str, DriveAxis]) -> Iterator[str]:
    for each in robot.drives:
        yield vector_text(robot.controller.sign_of(each.name) * robot.transform.turn.T @ axes[each.name].direction)


def vector_text(vector: FloatArray) -> str:
    """Return a unit vector with four decimals."""
    return f"({', '.join(f'{round(float(each), 4) + 0.0:.4g}' for each in vector)})"


def axis_words(direction: FloatArray) -> str:
    """Return the name of a coordinate axis that is parallel to a direction, otherwise its components."""
    for name, unit in zip("xyz", np.eye(3), strict=True):
        along = float(direction @ unit)
        if np.linalg.norm(direction - along * unit) < _ZERO:
            return name if along > 0 else f"-{name}"
    return vector_text(direction)

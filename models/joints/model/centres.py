"""Model of a robot given joint by joint, with joint-centre errors of manufacturing.

The robot is assembled at home with an error of each joint centre and the nominal directions of all axes; joint
coordinates count from there. Joints of a limb with a common centre at home, such as the hinges of a spherical joint,
share one error. The centre of a slide, and an error along the parallel axes of a joint, have no effect and are left
out. A parallelogram has two centres, at the ends of its rods; the rods stay equal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...displaced import Centre, DisplacedRobot, error_parameter
from ...model import Model
from ...parts import Leg
from ..home.chain import Joint, Limb, home_of
from ..home.generic import PathFrame, sampled_dimensions
from ..home.motion import AxisKind, Motion
from ..written.forms import RobotError
from ..written.words import read_robot
from .robot import joint_labels, model_of_home

#: Joint-centre errors at which ranks are measured, relative to the robot's size: small enough for loops to close.
_OFF = 0.01
_SEED = 0


def displaced_robot(model: Model, definition: Mapping[str, object]) -> DisplacedRobot:
    """Return the model of a robot given joint by joint, with joint-centre errors as parameters.

    Args:
        model: the robot.
        definition: tables of the robot file; empty if they are not known.

    Raises:
        RobotError: the robot has no such tables, is given by links and joints, or cannot be assembled near home with
            joint-centre errors.
    """
    if not definition:
        raise RobotError(
            "joint",
            "is missing: the limbs are rows of the Jacobian, but a tolerance needs a robot given joint by joint",
        )
    robot = home_of(read_robot(definition))
    if robot.graph is not None:
        raise RobotError(
            "joint", "belongs to a robot given by links and joints, but a tolerance needs a robot given by limbs"
        )
    exact = sampled_dimensions(robot)
    displaced = _Displaced(PathFrame(robot, exact, Motion.none()))
    limbs = tuple(displaced.limb(limb) for limb in robot.limbs)
    errors = ca.vertcat(SX(0, 1), *[each.error for each in displaced.centres])
    count = int(errors.numel())
    with_errors = replace(
        robot,
        symbols=ca.vertcat(robot.symbols, errors),
        typical=np.concatenate([robot.typical, np.zeros(count)]),
        limbs=limbs,
    )
    sizes = ca.Function("size", [robot.symbols], [robot.size])
    off = np.random.default_rng(_SEED).uniform(-_OFF, _OFF, (len(exact), count))
    off *= np.array([[float(sizes(each))] for each in exact])
    parameters = [error_parameter(each) for each in displaced.centres]
    legs = _displaced_legs(model, robot.symbols, displaced.centres)
    found = model_of_home(with_errors, np.hstack([exact, off]), definition, parameters, legs)
    # Among dependent equations, the model keeps the same ones as the nominal robot, even if others would be as good.
    every = {each.name: each for each in found.loops}
    closure = tuple(replace(every[f"{each.name} in full"], name=each.name) for each in model.closure)
    return DisplacedRobot(replace(found, closure=closure), tuple(displaced.centres))


def _displaced_legs(model: Model, dimensions: SX, centres: Sequence[Centre]) -> tuple[Leg, ...]:
    """Return the straight legs of a robot, with joint-centre errors.

    Args:
        model: the robot.
        dimensions: (d, 1) symbols that replace the dimensions.
        centres: joint centres with errors. For a hinge this is the full error, including the component along the axis.
    """
    errors, found = {each.name: each.error for each in centres}, []
    for leg in model.legs:
        ends = ca.Function("ends", [model.symbols], [leg.base, leg.platform]).call([dimensions])
        base, platform = (end + errors[centre] for end, centre in zip(ends, leg.centres, strict=True))
        found.append(replace(leg, base=base, platform=platform))
    return tuple(found)


class _Displaced:
    """Adds joint-centre errors to joints, one limb after the other.

    Args:
        frame: common data of all chains of the robot.

    Attributes:
        centres: joint centres with an error so far.
    """

    def __init__(self, frame: PathFrame) -> None:
        self._frame = frame
        self.centres: list[Centre] = []
        # By identity: paths of a limb share the joints of its stem.
        self._joints: dict[int, Joint] = {}

    def limb(self, limb: Limb) -> Limb:
        """Return a limb with joint-centre errors."""
        labels: dict[int, str] = {}
        joints: list[Joint] = []
        for index, path in enumerate(limb.paths):
            labels |= joint_labels(limb, index, path, labels)
            joints += [joint for joint in path if not any(joint is each for each in joints)]
        for group in self._groups(joints):
            error = self._error(labels[id(group[0])], group)
            for joint in group:
                self._joints[id(joint)] = self._moved(joint, labels[id(joint)], error)
        return replace(
            limb,
            stem=tuple(self._joints[id(each)] for each in limb.stem),
            branches=tuple(tuple(self._joints[id(each)] for each in branch) for branch in limb.branches),
        )

    def _groups(self, joints: list[Joint]) -> list[list[Joint]]:
        """Return a limb's joints in groups; the joints of a group have a common centre at home."""
        groups: list[list[Joint]] = []
        for joint in joints:
            for group in groups:
                if self._frame.coincide(joint.point, group[0].point):
                    group.append(joint)
                    break
            else:
                groups.append([joint])
        return groups

    def _error(self, name: str, group: list[Joint]) -> SX:
        """Return the error (3, 1) of the centre of a group of joints; components without effect are 0."""
        axes = [axis for joint in group for axis in joint.axes if axis.kind is not AxisKind.TRANSLATION]
        if not axes:
            return SX.zeros(3)
        error = self._new(name)
        first = axes[0]
        turns = all(axis.kind is AxisKind.ROTATION for axis in axes)
        if turns and all(self._frame.are_parallel(first.axis, axis.axis) for axis in axes[1:]):
            return error - first.axis * ca.dot(first.axis, error)
        return error

    def _new(self, name: str) -> SX:
        """Add a joint centre, and return the symbols (3, 1) of its error."""
        self.centres.append(Centre(name, SX.sym(f"error_{len(self.centres)}", 3)))
        return self.centres[-1].error

    def _moved(self, joint: Joint, name: str, error: SX) -> Joint:
        """Return a joint whose centre is displaced by a joint-centre error."""
        axes = []
        for axis in joint.axes:
            rod = axis.rod
            if axis.kind is AxisKind.PARALLELOGRAM:
                rod = rod + self._new(f"{name}, other end") - error
            axes.append(replace(axis, point=axis.point + error, rod=rod))
        return replace(joint, point=joint.point + error, axes=tuple(axes))

"""Joint coordinates of a limb in the place of the pose, such as pitch and roll of an ankle.

The limb has as many joint coordinates as the platform has degrees of freedom. The pose is a product of exponentials of
the screws of its joints at home.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, Substitution
from ...models.limbjoints import JointCoordinate, LimbJoint
from ...models.rotation import matrix_from_axis_angle
from ..errors import CaseError, listing
from .ctext import comment_text, name_cases
from .kinematics import Kinematics
from .templates import fill_template, prototype

#: Joint types with screws that move with their links alone.
_TYPES = frozenset(("R", "P", "H", "C", "U"))
#: Joint coordinates at which the pose is compared with the joints of the model, and the largest difference.
_TRIAL, _SAME = 0.02, 1e-9


class LimbCoordinates(NamedTuple):
    """Joint coordinates of a limb as functions for C.

    Attributes:
        names: names of the coordinates.
        dimensions: their dimensions.
        values: (k, 1) symbols of the coordinates, in the controller's units.
        pose: (12, 1) rotation row by row, then position, as expressions of these symbols.
        twists: (6, k) twist of the platform for a unit rate of each coordinate, as expressions of these symbols.
        measured: (k, 1) coordinates as expressions of a point of the kinematics.
        directions: (k, 3) axes of turns and directions of slides at home, in the controller's world frame.
    """

    names: tuple[str, ...]
    dimensions: tuple[Dimension, ...]
    values: SX
    pose: SX
    twists: SX
    measured: SX
    directions: FloatArray


def limb_coordinates(robot: Kinematics, limb: str) -> LimbCoordinates:
    """Return the joint coordinates of a limb.

    Raises:
        CaseError: the robot has no such limb, or the coordinates of the limb do not determine the pose.
    """
    model, source = robot.robot.model, robot.case.source
    paths = {each.limb: each for each in model.joint_screws if not each.is_nested}
    if limb not in paths:
        allowed = ["pose", *paths]
        raise CaseError("--coordinates", f"must be one of {listing(allowed)}", limb, source)
    path = paths[limb]
    joints = {each.label: each for each in robot.robot.robot.joints}
    labels = list(dict.fromkeys(path.joints))
    own = [joints[each] for each in labels if each in joints]
    counts = {label: len(list(group)) for label, group in itertools.groupby(path.joints)}
    fault = _fault(robot, own, counts)
    if fault:
        raise CaseError("--coordinates", f"limb {limb!r} {fault}", limb, source)
    stated = [(joint, each) for joint in own for each in joint.coordinates]
    parameters = robot.case.fixed_parameters("kinematics are computed with fixed dimensions")
    start = robot.start
    screws = ca.Function("screws", Substitution.identity(model).all, [ca.densify(path.all)])
    at_start = np.array(screws(parameters, start[12:], start[:9].reshape(3, 3).T, start[9:12]), dtype=np.float64)
    measured_world = ca.vertcat(*[each.measured for _, each in stated])
    (measured,) = ca.Function("measured", [robot.robot.z], [ca.densify(measured_world)]).call([robot.world])
    dimensions = tuple(each.dimension for _, each in stated)
    units = np.array(
        [robot.transform.degrees if d is Dimension.ANGLE else 1 / robot.transform.scale for d in dimensions]
    )
    measured = measured / ca.DM(units)
    at_home = np.array(ca.Function("home", [robot.z], [measured])(robot.home), dtype=np.float64).ravel()
    values = SX.sym("c", len(stated))
    pose, twists = _chain(robot, at_start, values, at_home, units)
    turns = [each is Dimension.ANGLE for each in dimensions]
    lines = np.where(turns, at_start[:3], at_start[3:])
    names = tuple(_name(*each) for each in stated)
    directions = (robot.transform.turn.T @ lines / np.linalg.norm(lines, axis=0)).T
    found = LimbCoordinates(names, dimensions, values, pose, twists, measured, directions)
    _check(robot, found, at_home, limb)
    return found


def _name(joint: LimbJoint, coordinate: JointCoordinate) -> str:
    name = joint.name or joint.label
    return f"{name} {coordinate.part}".strip()


def _fault(robot: Kinematics, joints: list[LimbJoint], counts: dict[str, int]) -> str:
    """Return the reason why a limb's joint coordinates cannot replace the pose, as the end of a sentence; or empty."""
    for each in joints:
        if each.type not in _TYPES:
            return (
                f"has the joint {each.label} of type {each.type}, which has no coordinates: allowed are R, P, H, C, U"
            )
        if len(each.coordinates) != counts[each.label]:
            return f"has the joint {each.label}, whose coordinates are not known"
    if sum(counts.values()) != robot.freedoms:
        return (
            f"has {sum(counts.values())} joint coordinates, and the platform {robot.freedoms} degrees of freedom: "
            "both numbers must be equal"
        )
    return ""


def _chain(robot: Kinematics, screws: FloatArray, values: SX, at_home: FloatArray, units: FloatArray) -> tuple[SX, SX]:
    """Return pose (12, 1) and twists (6, k) of the controller as expressions of the coordinates.

    Args:
        robot: the kinematics.
        screws: (6, k) screws of the joints at the start, with the world's origin of the case as reference.
        values: (k, 1) symbols of the coordinates.
        at_home: (k,) coordinates at the start.
        units: (k,) radians or lengths of the case in a unit of each coordinate.
    """
    transform = robot.transform
    R, p = SX.eye(3), SX.zeros(3)
    moved: list[tuple[SX, SX]] = []
    for k in range(screws.shape[1]):
        omega, v = screws[:3, k], screws[3:, k]
        # The screw of the joint after the motions of the joints before it.
        turned = R @ SX(ca.DM(omega))
        moved.append((turned, R @ SX(ca.DM(v)) + ca.cross(p, turned)))
        q = (values[k] - at_home[k]) * units[k]
        size = float(np.linalg.norm(omega))
        if size:
            axis = omega / size
            turn = matrix_from_axis_angle(SX(ca.DM(axis)), q * size)
            foot = np.cross(omega, v) / size**2
            slide = float(omega @ v) / size**2 * omega
            shift = (SX.eye(3) - turn) @ SX(ca.DM(foot)) + q * SX(ca.DM(slide))
        else:
            turn, shift = SX.eye(3), q * SX(ca.DM(v))
        p = p + R @ shift
        R = R @ turn
    start_R, start_p = robot.start[:9].reshape(3, 3).T, robot.start[9:12]
    position = p + R @ SX(ca.DM(start_p))
    rotation = R @ SX(ca.DM(start_R))
    T = SX(ca.DM(transform.turn))
    twists = ca.horzcat(
        *[
            ca.vertcat(T.T @ omega, transform.scale * (T.T @ (v + ca.cross(omega, position)))) * units[k]
            for k, (omega, v) in enumerate(moved)
        ]
    )
    pose = ca.vertcat(
        ca.vec((T.T @ rotation @ T).T), transform.scale * (T.T @ (position - SX(ca.DM(transform.offset))))
    )
    return pose, twists


def _check(robot: Kinematics, found: LimbCoordinates, at_home: FloatArray, limb: str) -> None:
    """Refuse coordinates that differ from those of the model at a pose near home.

    Raises:
        CaseError: the coordinates differ.
    """
    if robot.unknowns and ca.which_depends(found.measured, robot.z, 1, False)[12:].count(True):
        return
    function = ca.Function("pose", [found.values], [found.pose])
    measured = ca.Function("measured", [robot.z], [found.measured])
    turns = [each is Dimension.ANGLE for each in found.dimensions]
    sizes = np.where(turns, 1 / robot.transform.degrees, robot.size)
    for sign in (1.0, -1.0):
        given = at_home + sign * _TRIAL * sizes * np.linspace(0.5, 1.0, len(sizes))
        z = np.concatenate([np.array(function(given), dtype=np.float64).ravel(), robot.home[12:]])
        off = np.abs((np.array(measured(z), dtype=np.float64).ravel() - given) / sizes)
        if not (off <= _SAME).all():
            fault = f"limb {limb!r} has joint coordinates that do not determine the pose"
            raise CaseError("--coordinates", fault, limb, robot.case.source)


def coordinate_texts(
    robot: Kinematics, found: LimbCoordinates | None, limb: str, names: Mapping[str, str]
) -> dict[str, str]:
    """Return the texts for the placeholders about joint coordinates of a limb.

    Args:
        robot: the kinematics.
        found: the coordinates; None if only the coordinates of the pose are used.
        limb: name of the limb.
        names: texts of the other placeholders.
    """
    if found is None:
        keys = ("coordinates_declarations", "coordinates_bodies", "coordinates_prototype", "coordinates_rows")
        return dict.fromkeys(keys, "")
    kin, length = names["kin"], robot.controller.length or robot.case.units.length
    turns = [each is Dimension.ANGLE for each in found.dimensions]
    units = [robot.controller.angle if turn else length for turn in turns]
    labels = [f"{comment_text(name)} ({unit})" for name, unit in zip(found.names, units, strict=True)]
    own = {
        "limb": comment_text(limb),
        "joint_count": str(len(found.names)),
        "joint_lines": "\n".join(f" *   {k}: {label}" for k, label in enumerate(labels)),
        "joint_units": ", ".join(repr(robot.transform.degrees if turn else 1.0) for turn in turns),
        "joint_names": name_cases(found.names),
        **names,
    }
    words = f"Joint coordinates of limb {own['limb']}, for `{kin}_joint_motors` and the like: {', '.join(labels)}."
    return {
        "coordinates_rows": f"\n{words}\n",
        "coordinates_prototype": "\n".join(prototype(kin, each) for each in ("pose", "joints")),
        "coordinates_declarations": fill_template("kinematics/joints.h.in", own),
        "coordinates_bodies": fill_template("kinematics/joints.c.in", own),
    }

"""Joint coordinates of a limb in the place of the pose, such as pitch and roll of an ankle.

The limb has as many joint coordinates as the platform has degrees of freedom. The pose then is a product of exponentials of
the screws of its joints at home.
"""

from __future__ import annotations

import itertools
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
    """

    names: tuple[str, ...]
    dimensions: tuple[Dimension, ...]
    values: SX
    pose: SX
    twists: SX
    measured: SX


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
    units = np.array([robot.transform.degrees if d is Dimension.ANGLE else 1 / robot.transform.scale for d in dimensions])
    measured = measured / ca.DM(units)
    at_home = np.array(ca.Function("home", [robot.z], [measured])(robot.home), dtype=np.float64).ravel()
    values = SX.sym("c", len(stated))
    pose, twists = _chain(robot, at_start, values, at_home, units)
    found = LimbCoordinates(tuple(_name(*each) for each in stated), dimensions, values, pose, twists, measured)
    _check(robot, found, at_home, limb)
    return found


def _name(joint: LimbJoint, coordinate: JointCoordinate) -> str:
    name = joint.name or joint.label
    return f"{name} {coordinate.part}".strip()


def _fault(robot: Kinematics, joints: list[LimbJoint], counts: dict[str, int]) -> str:
    """Return why the joint coordinates of a limb do not serve as coordinates, as the end of a sentence; else empty."""
    for each in joints:
        if each.type not in _TYPES:
            return f"has the joint {each.label} of type {each.type}, which has no coordinates: allowed are R, P, H, C, U"
        if len(each.coordinates) != counts[each.label]:
            return f"has the joint {each.label}, whose coordinates are not known"
    if sum(counts.values()) != robot.freedoms:
        return (
            f"has {sum(counts.values())} joint coordinates, and the platform {robot.freedoms} degrees of freedom: "
            "both numbers must be equal"
        )
    return ""


def _chain(
    robot: Kinematics, screws: FloatArray, values: SX, at_home: FloatArray, units: FloatArray
) -> tuple[SX, SX]:
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
        CaseError: they differ.
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


def coordinate_texts(robot: Kinematics, found: LimbCoordinates | None, limb: str, kin: str) -> dict[str, str]:
    """Return the texts for the placeholders about joint coordinates of a limb."""
    if found is None:
        return dict.fromkeys(
            ("coordinates_declarations", "coordinates_bodies", "coordinates_prototype", "coordinates_rows"), ""
        )
    KIN, count = kin.upper(), len(found.names)
    u, pass_u = ("double *u, ", "u, ") if robot.unknowns else ("", "")
    length = robot.controller.length or robot.case.units.length
    labels = [robot.controller.angle if each is Dimension.ANGLE else length for each in found.dimensions]
    lines = "\n".join(
        f" *   {k}: {comment_text(name)}, {label}"
        for k, (name, label) in enumerate(zip(found.names, labels, strict=True))
    )
    units = [robot.transform.degrees if each is Dimension.ANGLE else 1.0 for each in found.dimensions]
    unit_row = ", ".join(repr(each) for each in units)
    names = name_cases(found.names)
    return {
        "coordinates_rows": (
            f"\nJoint coordinates of limb {comment_text(limb)}, for `{kin}_joint_motors` and the like: "
            + ", ".join(f"{comment_text(n)} ({label})" for n, label in zip(found.names, labels, strict=True))
            + ".\n"
        ),
        "coordinates_prototype": (
            f"int {kin}_CASADI_pose(const real **arg, real **res, int *iw, real *w, int mem);\n"
            f"int {kin}_CASADI_joints(const real **arg, real **res, int *iw, real *w, int mem);"
        ),
        "coordinates_declarations": f"""
/* The same functions with joint coordinates of limb {comment_text(limb)} in the place of the pose:
{lines}
 */
#define {KIN}_JOINTS {count}
const char *{kin}_joint_name(int joint);

/* Pose from joint coordinates, and joint coordinates at a pose. */
int {kin}_pose(const {kin}_real joints[{KIN}_JOINTS], {kin}_real position[3], {kin}_real rotation[9]);
int {kin}_joints(const {kin}_real position[3], const {kin}_real rotation[9], {u}{kin}_real joints[{KIN}_JOINTS]);

int {kin}_joint_motors(const {kin}_real joints[{KIN}_JOINTS], {u}{kin}_real q[{KIN}_ACTUATORS]);

/* Derivatives of the actuator coordinates by the joint coordinates. */
int {kin}_joint_rates(const {kin}_real joints[{KIN}_JOINTS], {u}{kin}_real rates[{KIN}_ACTUATORS][{KIN}_JOINTS]);

/* Torques of the actuators that balance a load of a torque (or force) on each joint coordinate: torques * speeds of actuators
 * + load * speeds of joints = 0, angles in rad. For the torques that make the joints push with a load, give its negative. */
int {kin}_joint_torques(const {kin}_real joints[{KIN}_JOINTS], {u}const {kin}_real load[{KIN}_JOINTS],
                        {kin}_real torques[{KIN}_ACTUATORS]);

/* Joint coordinates from actuator coordinates; in joints is the guess. */
int {kin}_joint_forward(const {kin}_real q[{KIN}_ACTUATORS], {kin}_real joints[{KIN}_JOINTS], {u}int *iterations);
""",
        "coordinates_bodies": f"""
const char *{kin}_joint_name(int joint) {{
    switch (joint) {{
{names}
        default: return "";
    }}
}}

/* Pose (12) and twists (6, joints) at joint coordinates. */
static int pose_at(const real *joints, real *pose, real *twists) {{
    const real *arg[ARGUMENTS];
    real *res[RESULTS], w[WORK + 1];
    int i;
    for (i = 0; i < {KIN}_JOINTS; ++i)
        if (!is_finite(joints[i])) return {KIN}_BAD_INPUT;
    arg[0] = joints;
    res[0] = pose;
    res[1] = twists;
    if ({kin}_CASADI_pose(arg, res, 0, w, 0)) return {KIN}_BAD_INPUT;
    for (i = 0; i < 12; ++i)
        if (!is_finite(pose[i])) return {KIN}_BAD_INPUT;
    return {KIN}_OK;
}}

int {kin}_pose(const {kin}_real joints[{KIN}_JOINTS], {kin}_real position[3], {kin}_real rotation[9]) {{
    real pose[12], twists[6 * {KIN}_JOINTS];
    int i;
    if (pose_at(joints, pose, twists) != {KIN}_OK) return {KIN}_BAD_INPUT;
    for (i = 0; i < 9; ++i) rotation[i] = pose[i];
    for (i = 0; i < 3; ++i) position[i] = pose[9 + i];
    return {KIN}_OK;
}}

int {kin}_joints(const {kin}_real position[3], const {kin}_real rotation[9], {u}{kin}_real joints[{KIN}_JOINTS]) {{
    double z[Z];
    real point[Z], q[A], found[{KIN}_JOINTS], w[WORK + 1];
    const real *arg[ARGUMENTS];
    real *res[RESULTS];
    int i, status = get_point(position, rotation, {pass_u}z);
    if (status == {KIN}_OK) status = motors_at(z, q);
    if (status != {KIN}_OK) return status;
    to_real(z, point, Z);
    arg[0] = point;
    res[0] = found;
    if ({kin}_CASADI_joints(arg, res, 0, w, 0)) return {KIN}_SINGULAR;
    for (i = 0; i < {KIN}_JOINTS; ++i)
        if (!is_finite(found[i])) return {KIN}_SINGULAR;
    for (i = 0; i < {KIN}_JOINTS; ++i) joints[i] = found[i];
    KEEP(z);
    return {KIN}_OK;
}}

int {kin}_joint_motors(const {kin}_real joints[{KIN}_JOINTS], {u}{kin}_real q[{KIN}_ACTUATORS]) {{
    real pose[12], twists[6 * {KIN}_JOINTS];
    const int status = pose_at(joints, pose, twists);
    return status == {KIN}_OK ? {kin}_motors(pose + 9, pose, {pass_u}q) : status;
}}

int {kin}_joint_rates(const {kin}_real joints[{KIN}_JOINTS], {u}{kin}_real rates[{KIN}_ACTUATORS][{KIN}_JOINTS]) {{
    real pose[12], twists[6 * {KIN}_JOINTS], of_pose[A][6];
    int i, j, k, status = pose_at(joints, pose, twists);
    if (status == {KIN}_OK) status = {kin}_rates(pose + 9, pose, {pass_u}of_pose);
    if (status != {KIN}_OK) return status;
    for (i = 0; i < A; ++i)
        for (j = 0; j < {KIN}_JOINTS; ++j) {{
            real sum = 0;
            for (k = 0; k < 6; ++k) sum += of_pose[i][k] * twists[6 * j + k];
            rates[i][j] = sum;
        }}
    return {KIN}_OK;
}}

int {kin}_joint_torques(const {kin}_real joints[{KIN}_JOINTS], {u}const {kin}_real load[{KIN}_JOINTS],
                        {kin}_real torques[{KIN}_ACTUATORS]) {{
#if {KIN}_HAS_TORQUES && {KIN}_ACTUATORS == {KIN}_JOINTS
    static const double units[] = {{{unit_row}}};
    real rates[A][A];
    double matrix[A * A], right[A], found[A];
    int rows[A], columns[A], i, j, status;
    for (j = 0; j < A; ++j)
        if (!is_finite(load[j])) return {KIN}_BAD_INPUT;
    status = {kin}_joint_rates(joints, {pass_u}rates);
    if (status != {KIN}_OK) return status;
    for (i = 0; i < A; ++i)
        for (j = 0; j < A; ++j) matrix[A * i + j] = rates[i][j] * (turns[i] ? UNIT : 1.0) / units[j];
    if (!factor(A, matrix, rows, columns)) return {KIN}_SINGULAR;
    for (j = 0; j < A; ++j) right[j] = -load[j];
    solve_transposed(A, matrix, rows, columns, right, found);
    for (i = 0; i < A; ++i) torques[i] = (real)found[i];
    return {KIN}_OK;
#else
    (void)joints, (void)load, (void)torques{", (void)u" if robot.unknowns else ""};
    return {KIN}_SINGULAR;
#endif
}}

int {kin}_joint_forward(const {kin}_real q[{KIN}_ACTUATORS], {kin}_real joints[{KIN}_JOINTS], {u}int *iterations) {{
    real pose[12], twists[6 * {KIN}_JOINTS];
    int status = pose_at(joints, pose, twists);
    if (status == {KIN}_OK) status = {kin}_forward(q, pose + 9, pose, {pass_u}iterations);
    return status == {KIN}_OK ? {kin}_joints(pose + 9, pose, {pass_u}joints) : status;
}}
""",
    }

"""LinuxCNC's modules genhexkins, rotarydeltakins and lineardeltakins: HAL lines and INI sections for a robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ....models import Dimension, FloatArray
from ....models.statics import driven_joints
from ...case.case import Case
from ..kinematics import Kinematics
from .configuration import (
    Configuration,
    Rules,
    delta_configuration,
    leg_configuration,
    printed,
    printed_home,
    strut_configuration,
)
from .samples import Range
from .texts import conventions_table, frame_words, readme, zero_words

TARGET = "linuxcnc"
_HINT = "linuxcnc-module writes a module for this robot"
_ROTARY = Rules(TARGET, "rotarydeltakins", True, "deg", True, -90.0, False, True, _HINT)
_LINEAR = Rules(TARGET, "lineardeltakins", False, "deg", True, 90.0, True, True, _HINT)
UNCHECKED = (
    "LinuxCNC checks only the end point of a move against joint limits. Within a move, a pose out of reach stops the\n"
    "  robot with `kinematicsInverse failed`."
)


def write(case: Case) -> dict[str, str]:
    """Return HAL lines, INI sections and description for a robot that a module of LinuxCNC describes.

    Raises:
        CaseError: no module of LinuxCNC describes the robot.
    """
    found, module, words = _found(case)
    lines = {"rotarydeltakins": _rotary, "lineardeltakins": _linear, "genhexkins": _joints, "pentakins": _joints}[
        module
    ](found)
    head = f"# {module} for this robot; lengths in {found.case.controller.length}\n"
    ini = ini_text(found.robot, module, words, found.order, found.ranges, found.home)
    hal = head + "".join(f"setp {module}.{name} {printed(value)}\n" for name, value in lines)
    return {"kinematics.hal": hal, "kinematics.ini": ini, "README.md": _readme(found, module)}


def _found(case: Case) -> tuple[Configuration, str, str]:
    """Return the configuration, the module, and the words of the coordinates."""
    drives = driven_joints(case.model)
    if len(drives) == 3:
        rules = _ROTARY if drives[0].dimension is Dimension.ANGLE else _LINEAR
        return delta_configuration(case, rules), rules.kind, "XYZ"
    if len(drives) == 5:
        return strut_configuration(case, TARGET, "pentakins", _HINT), "pentakins", "XYZAB"
    return leg_configuration(case, TARGET, "genhexkins", _HINT), "genhexkins", "XYZABC"


def _rotary(found: Configuration) -> list[tuple[str, float]]:
    # The module reads only the difference of the two radii; the platform's joints count as on the axis.
    values = (found.radius, found.arms[0], found.rods[0], 0.0)
    return list(zip(("platformradius", "thighlength", "shinlength", "footradius"), values, strict=True))


def _linear(found: Configuration) -> list[tuple[str, float]]:
    return [("R", found.radius), ("L", found.rods[0])]


def _joints(found: Configuration) -> list[tuple[str, float]]:
    is_hexapod = found.platform.shape[1] == 3
    plate, axes = ("platform", "xyz") if is_hexapod else ("effector", "rz")
    return [
        (f"{name}.{k}.{axis}", float(value))
        for name, own, points in (("base", "xyz", found.base), (plate, axes, found.platform))
        for k, point in enumerate(points)
        for axis, value in zip(own, point, strict=True)
    ]


def ini_text(
    robot: Kinematics, module: str, words: str, order: Sequence[int], ranges: Sequence[Range], home: Sequence[float]
) -> str:
    """Return the sections KINS, TRAJ and JOINT of an INI file.

    Args:
        robot: kinematics in the conventions of LinuxCNC.
        module: name of the module.
        words: words of the coordinates, such as XYZ.
        order: index of the robot's actuator for each joint.
        ranges: limits of each joint.
        home: coordinate of each joint at home.
    """
    length = "inch" if robot.controller.length == "in" else "mm"
    at_home = pose_words(robot, words)
    lines = [
        "[KINS]",
        f"KINEMATICS = {module}",
        f"JOINTS = {len(order)}",
        "",
        "[TRAJ]",
        f"COORDINATES = {words}",
        f"LINEAR_UNITS = {length}",
        "ANGULAR_UNITS = degree",
        "# Home of the case: forward kinematics begins here after homing.",
        f"HOME = {' '.join(at_home)}",
    ]
    for joint, k in enumerate(order):
        drive = robot.drives[k]
        kind = "ANGULAR" if drive.dimension is Dimension.ANGLE else "LINEAR"
        lines += ["", f"[JOINT_{joint}]", f"# actuator {drive.name}", f"TYPE = {kind}"]
        for name, value in (("MIN_LIMIT", ranges[joint].least), ("MAX_LIMIT", ranges[joint].most)):
            stated = (
                f"{name} = {printed(value)}" if value is not None else f"# {name}: the case has no limit; state one"
            )
            lines.append(stated)
        lines.append(f"HOME = {printed_home(home[joint], float(robot.motor_sizes[k]))}")
    return "\n".join(lines) + "\n"


def pose_words(robot: Kinematics, words: str) -> list[str]:
    """Return the words of the home pose, from X to the last given word; words that are not given are 0."""
    angles = [each / robot.transform.degrees for each in _rpy(robot.home[:9].reshape(3, 3))]
    sizes = [robot.size] * 3 + [1 / robot.transform.degrees] * 3
    values = zip("XYZABC", [*robot.home[9:12].tolist(), *angles], sizes, strict=True)
    shown = [printed_home(value, size) if name in words else "0" for name, value, size in values]
    return shown[: 1 + max("XYZABC".index(each) for each in words)]


def _rpy(R: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation matrix, radians."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def _readme(found: Configuration, module: str) -> str:
    words = {
        "frame": frame_words(found.robot),
        "zero": zero_words(found.robot, found.order),
        "units": f"lengths in {found.case.controller.length}, angles in degrees; A, B, C are roll, pitch, yaw: "
        "R = Rz(C) Ry(B) Rx(A).",
        "unchecked": UNCHECKED,
    }
    what = (
        f"`kinematics.hal` and `kinematics.ini` configure LinuxCNC's module `{module}`: load the HAL file after the "
        f"module, and merge the INI sections into yours. At poses near home, its formula with these numbers differs "
        f"from the robot by at most {found.difference:.1g} of the robot's size (angles: rad)."
    )
    table = conventions_table(found.robot)
    more = [f"This table in the case gives generated C the same conventions:\n\n```toml\n{table}```"]
    if module == "genhexkins":
        more.insert(0, "Leave the pins of tool offset, spindle offset and screw lead at 0.")
    if module == "pentakins":
        more.insert(0, "Leave the pin of tool offset at 0. Turns about the spindle do not change the struts.")
    if module == "rotarydeltakins":
        more.insert(0, "`platformradius` is the radius of the motor axes less that of the platform's joints.")
    return readme(found.case, what, words, "\n\n".join(more))

"""Transmission of ros2_control: a package with plug-in that converts position, velocity and effort."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from ....models import Dimension
from ...case.case import Case
from ...errors import CaseError
from ..ctext import comment_text, identifier, string_literal
from ..driveaxes import axis_words
from ..kinematicsjoints import LimbCoordinates, limb_coordinates
from ..templates import fill_template
from .library import Library, library_of
from .texts import frame_words, readme, zero_words

TARGET = "ros2"
_WORDS = ("x", "y", "z", "roll", "pitch", "yaw")
_VERSION = "0.1.0"
#: Names of turns about the axes of the world frame.
_ROTATIONS = {"x": " (roll)", "y": " (pitch)", "z": " (yaw)"}


def write(case: Case, coordinates: str) -> dict[str, str]:
    """Return the files of a package with a transmission.

    Args:
        case: the case.
        coordinates: ``pose``, or the name of a limb whose joints are those of the transmission.

    Raises:
        CaseError: the robot has more or fewer actuators than joints, or no forward kinematics.
        InputError: an actuator coordinate is not known.
    """
    library = library_of(case, length="m", angle="rad", coordinates=coordinates)
    robot, names = library.robot, library.names
    package = f"{identifier(case.name)}_transmission"
    cls = "".join(part.capitalize() for part in package.split("_"))
    actuators = [each.name for each in robot.drives]
    limb = None if coordinates == "pose" else limb_coordinates(robot, coordinates)
    joints = [_WORDS[k] for k in robot.coordinates] if limb is None else list(limb.names)
    if len(joints) != len(actuators) or robot.forward is None:
        fault = f"a transmission needs as many actuators as joints: the robot has {len(actuators)} and {len(joints)}"
        if robot.forward is None:
            fault = "a transmission needs forward kinematics, and the actuators of this robot do not determine the pose"
        raise CaseError("--target", fault, TARGET, case.source)
    texts = {
        **names,
        "package": package,
        "cls": cls,
        "count": str(len(joints)),
        "joint_list": ", ".join(comment_text(each) for each in joints),
        "actuator_list": ", ".join(comment_text(each) for each in actuators),
        "joint_names": ", ".join(string_literal(each) for each in joints),
        "actuator_names": ", ".join(string_literal(each) for each in actuators),
        "header": library.header,
        "state": f"  double u_[{12 + robot.unknowns}];\n" if robot.unknowns else "",
        "pass_u": "u_, " if robot.unknowns else "",
        "complete": _complete(library),
        "start": _start(library, coordinates),
        "word_indices": ", ".join(str(k) for k in robot.coordinates),
    }
    kind = "pose" if coordinates == "pose" else "joints"
    texts["conversions"] = fill_template(f"targets/ros2-{kind}.cpp.in", texts)
    sources = {f"src/{name}": text for name, text in library.files.items()}
    return {
        f"include/{package}/transmission.hpp": fill_template("targets/ros2.hpp.in", texts),
        "src/transmission.cpp": fill_template("targets/ros2.cpp.in", texts),
        **sources,
        "ros2_control_plugins.xml": _plugins(package, cls),
        "CMakeLists.txt": _cmake(package, [name for name in sources if name.endswith(".c")]),
        "package.xml": _package(package, case),
        "transmission.urdf": _urdf(package, cls, joints, actuators),
        "README.md": _readme(library, package, limb),
    }


def _complete(library: Library) -> str:
    """Return the lines that compute the dependent coordinates of the pose."""
    if library.robot.complete is None:
        return ""
    kin, u = library.names["kin"], ", u_" if library.robot.unknowns else ""
    call = f"const int completed = {kin}_complete(position, rotation{u}); completed != 0"
    return f"  if ({call}) return completed;\n"


def _start(library: Library, coordinates: str) -> str:
    """Return the lines of the constructor that set the joints to home."""
    kin, unknowns = library.names["kin"], library.robot.unknowns
    lines = ["double position[3], rotation[9];", f"{kin}_home(position, rotation);"]
    if unknowns:
        lines.insert(0, f"{kin}_start(u_);")
    if coordinates == "pose":
        lines.append("double words[6] = {position[0], position[1], position[2], 0.0, 0.0, 0.0};")
        lines.append(f"{kin}_to_rpy(rotation, words + 3);")
        lines += [f"last_[{i}] = words[{k}];" for i, k in enumerate(library.robot.coordinates)]
    else:
        lines.append(f"status_ = {kin}_joints(position, rotation, {'u_, ' if unknowns else ''}last_.data());")
    return "".join(f"  {each}\n" for each in lines)


def _plugins(package: str, cls: str) -> str:
    base = "transmission_interface::TransmissionLoader"
    return (
        f'<library path="{package}">\n'
        f'  <class name="{package}/{cls}" type="{package}::{cls}Loader" base_class_type="{base}">\n'
        "    <description>Transmission of a parallel robot.</description>\n"
        "  </class>\n"
        "</library>\n"
    )


def _cmake(package: str, sources: list[str]) -> str:
    dependencies = ("hardware_interface", "pluginlib", "transmission_interface")
    found = "\n".join(f"find_package({each} REQUIRED)" for each in ("ament_cmake", *dependencies))
    files = " ".join(["src/transmission.cpp", *sources])
    return f"""cmake_minimum_required(VERSION 3.16)
project({package} LANGUAGES C CXX)
set(CMAKE_C_STANDARD 99)
set(CMAKE_CXX_STANDARD 17)
{found}
add_library({package} SHARED {files})
target_include_directories({package} PUBLIC
  $<BUILD_INTERFACE:${{CMAKE_CURRENT_SOURCE_DIR}}/include> $<INSTALL_INTERFACE:include>)
target_link_libraries({package} PUBLIC
  ${{hardware_interface_TARGETS}} ${{transmission_interface_TARGETS}} ${{pluginlib_TARGETS}})
pluginlib_export_plugin_description_file(transmission_interface ros2_control_plugins.xml)
install(DIRECTORY include/ DESTINATION include)
install(TARGETS {package} ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin)
ament_export_dependencies({" ".join(dependencies)})
ament_package()
"""


def _package(package: str, case: Case) -> str:
    dependencies = "\n".join(
        f"  <depend>{each}</depend>" for each in ("hardware_interface", "pluginlib", "transmission_interface")
    )
    return f"""<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>{_VERSION}</version>
  <description>Transmission of {escape(case.name)}, generated by screwsynth</description>
  <maintainer email="nobody@example.com">Your name</maintainer>
  <license>MIT</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
{dependencies}
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""


def _urdf(package: str, cls: str, joints: list[str], actuators: list[str]) -> str:
    lines = [
        "<!-- Goes into <ros2_control>. Names are those of your robot; roles stay as they are. -->",
        f'<transmission name="{package}">',
        f"  <plugin>{package}/{cls}</plugin>",
        *(f"  <actuator name={quoteattr(each)} role={quoteattr(each)}/>" for each in actuators),
        *(f"  <joint name={quoteattr(each)} role={quoteattr(each)}/>" for each in joints),
        "</transmission>",
    ]
    return "\n".join(lines) + "\n"


def _joint_words(library: Library, limb: LimbCoordinates | None) -> str:
    """Return sentences about the joints of the transmission and their order."""
    if limb is None:
        joints = ", ".join(_WORDS[k] for k in library.robot.coordinates)
        return (
            f"Joints are coordinates of the pose, in this order: {joints}; R = Rz(yaw) Ry(pitch) Rx(roll).\n"
            "  `--coordinates LIMB` takes the joints of a limb instead, whose order may differ."
        )
    turns = []
    for name, dimension, direction in zip(limb.names, limb.dimensions, limb.directions, strict=True):
        axis, kind = axis_words(direction), "slides along"
        if dimension is Dimension.ANGLE:
            kind, axis = "turns about", axis + _ROTATIONS.get(axis, "")
        turns.append(f"{name} {kind} {axis}")
    return (
        f"Joints, in this order, with their axes at home: {'; '.join(turns)}.\n"
        "  Without `--coordinates`, joints are coordinates of the pose in another order: x, y, z, roll, pitch, yaw."
    )


def _readme(library: Library, package: str, limb: LimbCoordinates | None) -> str:
    robot = library.robot
    words = {
        "frame": f"{frame_words(robot)}\n  {_joint_words(library, limb)}",
        "zero": zero_words(robot, range(len(robot.drives))) + " `mechanical_reduction` and `offset` are not read.",
        "units": "lengths in m, angles in rad, efforts in N and N m; velocities and efforts keep the power equal.",
        "unchecked": "ros2_control does not load transmissions by itself: the hardware component does. Its\n"
        "  controllers check limits of these joints; nothing checks limits of passive joints.",
    }
    what = (
        f"`{package}` is a package for ros2_control: build it with colcon, and copy `transmission.urdf` into the "
        "robot's description. Handles are taken by name. A value out of reach leaves the last "
        "outputs, and `fault()` is true."
    )
    return readme(library.case, what, words)

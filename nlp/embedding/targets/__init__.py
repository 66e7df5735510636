"""Exports of a robot's kinematics in the form of a controller, by the names of ``codegen --target``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from ...case.case import Case
from ...errors import InputError, nearest, one_line
from ..kinematicsfiles import generate_kinematics
from . import arduino, firmware, klipper, klipper_patch, linuxcnc, linuxcnc_module, ros2


class Request(NamedTuple):
    """Options of an export of kinematics.

    Attributes:
        single: If true, positions, rates and torques are in single precision.
        coordinates: ``pose``, or the name of a limb whose joint coordinates are used too.
    """

    single: bool = False
    coordinates: str = "pose"


class Target(NamedTuple):
    """Export in the form of one controller.

    Attributes:
        write: function from a case and a request to the texts of the files by name.
        has_single: If true, single precision is allowed.
        has_coordinates: If true, joint coordinates of a limb are allowed.
    """

    write: Callable[[Case, Request], dict[str, str]]
    has_single: bool = False
    has_coordinates: bool = False


#: Targets by name.
TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        "c": Target(
            lambda case, of: generate_kinematics(case, "", single=of.single, coordinates=of.coordinates),
            has_single=True,
            has_coordinates=True,
        ),
        linuxcnc.TARGET: Target(lambda case, _: linuxcnc.write(case)),
        linuxcnc_module.TARGET: Target(lambda case, _: linuxcnc_module.write(case)),
        klipper.TARGET: Target(lambda case, _: klipper.write(case)),
        klipper_patch.TARGET: Target(lambda case, _: klipper_patch.write(case)),
        firmware.MARLIN: Target(lambda case, _: firmware.write_marlin(case)),
        firmware.REPRAP: Target(lambda case, _: firmware.write_reprapfirmware(case)),
        ros2.TARGET: Target(lambda case, of: ros2.write(case, of.coordinates), has_coordinates=True),
        arduino.TARGET: Target(
            lambda case, of: arduino.write(case, of.coordinates, single=of.single),
            has_single=True,
            has_coordinates=True,
        ),
    }
)


def export_kinematics(case: Case, source: str, target: str, request: Request | None = None) -> dict[str, str]:
    """Return the texts of a folder in the form of a controller, by file name.

    Args:
        case: case with fixed dimensions.
        source: text of its case file, which goes into the folder as ``case.toml``.
        target: name in :data:`TARGETS`.
        request: options; double precision and the pose if left out.

    Raises:
        CaseError: the robot does not fit the target, a dimension is free, or a unit is unknown.
        InputError: the target is unknown, or does not take an option.
    """
    of = request or Request()
    if target not in TARGETS:
        raise InputError(f"--target {target}: no such target; {nearest(target, list(TARGETS))}")
    found = TARGETS[target]
    for option, given, allowed in (
        ("--single", of.single, found.has_single),
        ("--coordinates", of.coordinates != "pose", found.has_coordinates),
    ):
        if given and not allowed:
            raise InputError(f"{option}: is not for --target {target}; leave {option} out")
    return {**{name: _printable(text) for name, text in found.write(case, of).items()}, "case.toml": source}


def _printable(text: str) -> str:
    """Return a text without control characters, such as those of a title."""
    return "\n".join("\t".join(map(one_line, line.split("\t"))) for line in text.split("\n"))

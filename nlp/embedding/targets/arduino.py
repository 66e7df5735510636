"""Library folder for Arduino and PlatformIO, with one example."""

from __future__ import annotations

import json

from ... import __version__
from ...case.case import Case
from ..ctext import identifier
from ..templates import fill_template
from .library import Library, library_of
from .texts import frame_words, readme, robot_of, zero_words

TARGET = "arduino"


def write(case: Case, coordinates: str, *, single: bool) -> dict[str, str]:
    """Return the files of a library.

    Args:
        case: the case.
        coordinates: ``pose``, or the name of a limb whose joint coordinates are used too.
        single: If true, positions, rates and torques are in single precision.

    Raises:
        CaseError: as for :func:`~.library.library_of`.
        InputError: as for :func:`~.library.library_of`.
    """
    controller = case.controller
    library = library_of(case, length=controller.length, angle=controller.angle, single=single, coordinates=coordinates)
    name, names = identifier(case.name), library.names
    texts = {
        **names,
        "name": name,
        "header": library.header,
        "GUARD": f"{name.upper()}_ARDUINO_H",
        "state": f"static double u[{names['KIN']}_STATE];\n" if library.robot.unknowns else "",
        "start": f"    {names['kin']}_start(u);\n" if library.robot.unknowns else "",
        "pass_u": "u, " if library.robot.unknowns else "",
    }
    sentence = f"Kinematics of a parallel robot: {robot_of(case)}"
    properties = {
        "name": name,
        "version": __version__,
        "author": "screwsynth",
        "maintainer": "screwsynth",
        "sentence": sentence,
        "paragraph": "Generated C99: motors, rates, torques and forward kinematics, without memory allocation.",
        "category": "Device Control",
        "url": "",
        "architectures": "*",
        "includes": f"{name}.h",
    }
    described = {
        "name": name,
        "version": __version__,
        "description": sentence,
        "keywords": "kinematics, parallel robot",
        "license": "MIT",
        "headers": f"{name}.h",
        "frameworks": "*",
        "platforms": "*",
    }
    return {
        **{f"src/{file}": text for file, text in library.files.items()},
        f"src/{name}.h": fill_template("targets/arduino.h.in", texts),
        "examples/motors/motors.ino": fill_template("targets/arduino.ino.in", texts),
        "library.properties": "".join(f"{key}={value}\n" for key, value in properties.items()),
        "library.json": json.dumps(described, indent=2) + "\n",
        "README.md": _readme(library, name, single=single),
    }


def _readme(library: Library, name: str, *, single: bool) -> str:
    robot = library.robot
    length = robot.controller.length or robot.case.units.length
    words = {
        "frame": frame_words(robot),
        "zero": zero_words(robot, range(len(robot.drives))),
        "units": f"lengths in {length}, angles in {robot.controller.angle}; angular velocities in rad/s.",
        "unchecked": "the library computes single poses. The sketch must check points between them, joint limits\n"
        f"  and speeds; `{library.names['kin']}_limits` exists if the case limits joints.",
    }
    what = (
        f"A library for Arduino and PlatformIO: put this folder into `libraries/` or `lib/`, and include `{name}.h`. "
        "Boards with a `double` of 4 bytes, such as AVR, are refused by the compiler."
    )
    kind = "single precision; Newton's method stays in double" if single else "double precision; --single writes float"
    return readme(library.case, what, words, f"Positions, rates and torques are in {kind}.")

"""LinuxCNC module of one source file for halcompile, with forward and inverse kinematics and the Jacobian."""

from __future__ import annotations

from ...case.case import Case
from ..ctext import identifier
from ..templates import fill_template
from .configuration import length_unit
from .library import library_of
from .linuxcnc import UNCHECKED, ini_text
from .samples import ranges_of, samples_of
from .texts import frame_words, readme, zero_words

TARGET = "linuxcnc-module"
#: Largest number of characters of a case's name in the name of a module: HAL allows 47 in all.
_LONGEST = 40
#: Number of joint coordinates without a closed form from which matrices exceed the stack frames of LinuxCNC's build.
_LARGE = 12


def write(case: Case) -> dict[str, str]:
    """Return the source of a module, INI sections and a description.

    Raises:
        CaseError: as for :func:`~.library.library_of`.
        InputError: as for :func:`~.library.library_of`.
    """
    library = library_of(case, length=length_unit(case), angle="deg")
    robot, names = library.robot, library.names
    module = f"{identifier(case.name)[:_LONGEST]}_kins"
    words = "".join("XYZABC"[k] for k in robot.coordinates)
    texts = {
        **names,
        "module": module,
        "words": " ".join(words),
        "library": library.whole,
        "complete": "",
        "type": "KINEMATICS_BOTH" if robot.forward is not None else "KINEMATICS_INVERSE_ONLY",
        "state": "",
        "start": "",
    }
    if robot.complete is not None:
        call = f"{names['kin']}_complete(position, rotation{', u' if robot.unknowns else ''})"
        texts["complete"] = f"    if ({call} != {names['KIN']}_OK) return -1;\n"
    if robot.unknowns:
        texts["state"] = f"static double u[{names['KIN']}_STATE];\n"
        texts["start"] = f"    {names['kin']}_start(u);\n"
    order = range(len(robot.drives))
    ranges = ranges_of(robot, samples_of(robot))
    ini = ini_text(robot, module, words, order, ranges, robot.home_coordinates.tolist())
    about = {
        "frame": frame_words(robot),
        "zero": zero_words(robot, order),
        "units": f"lengths in {robot.controller.length}, angles in degrees; A, B, C are roll, pitch, yaw: "
        f"R = Rz(C) Ry(B) Rx(A). Programs use {', '.join(words)}.",
        "unchecked": UNCHECKED,
    }
    what = (
        f"`{module}.c` is a kinematics module for LinuxCNC: `sudo halcompile --install {module}.c` builds it, and "
        "`kinematics.ini` has its INI sections."
    )
    more = (
        "Angles of joints are within half a turn of home. Out of reach, and where the robot is singular, the functions "
        "return -1 and leave their results unchanged. Releases of LinuxCNC without `kinematicsJacobian` ignore it."
    )
    if robot.unknowns >= _LARGE:
        more += (
            f" With {robot.unknowns} joint coordinates without a closed form, some functions have a stack frame of "
            "more than 2,560 bytes, and the build warns of it."
        )
    return {
        f"{module}.c": fill_template("targets/linuxcnc.c.in", texts),
        "kinematics.ini": ini,
        "README.md": readme(library.case, what, about, more),
    }

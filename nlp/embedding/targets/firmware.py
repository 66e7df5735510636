"""Marlin and RepRapFirmware: commands M665, M666 and M669 for a linear or rotary Delta."""

from __future__ import annotations

import math

from ....models import Dimension
from ....models.statics import driven_joints
from ...case.case import Case
from .configuration import Configuration, Rules, delta_configuration, printed
from .texts import conventions_table, frame_words, readme, zero_words

MARLIN, REPRAP = "marlin", "reprapfirmware"
#: Direction of the first tower in the frame of both firmwares, degrees; the others follow anticlockwise.
_FIRST = 210.0
_HINT = "arduino writes C for this robot"
UNCHECKED = (
    "The firmware checks only that end points are within a radius and a height. It checks neither points\n"
    "  between them nor joint limits."
)


def _rules(target: str, kind: str, *, turns: bool) -> Rules:
    return Rules(target, kind, turns, "deg", False, _FIRST, True, not turns, _HINT)


def write_marlin(case: Case) -> dict[str, str]:
    """Return M665 and M666 for a linear Delta, and a description.

    Raises:
        CaseError: the robot is not such a Delta.
    """
    found = delta_configuration(case, _rules(MARLIN, "Marlin's delta", turns=False))
    words = [f"L{printed(found.rods[0])}", f"R{printed(found.radius)}"]
    height = _height(found)
    if height is not None:
        words.append(f"H{printed(height)}")
    lines = ["; Marlin, DELTA: rods, radius, height", f"M665 {' '.join(words)} X0 Y0 Z0", "M666 X0 Y0 Z0"]
    return {"marlin.gcode": "\n".join(lines) + "\n", "README.md": _readme(found, "marlin.gcode", "Marlin", height)}


def write_reprapfirmware(case: Case) -> dict[str, str]:
    """Return M665 and M666 for a linear Delta or M669 for a rotary one, and a description.

    Raises:
        CaseError: the robot is not such a Delta.
    """
    turns = any(each.dimension is Dimension.ANGLE for each in driven_joints(case.model)[:1])
    kind = "the rotary Delta of RepRapFirmware" if turns else "the linear Delta of RepRapFirmware"
    found = delta_configuration(case, _rules(REPRAP, kind, turns=turns))
    height = None if turns else _height(found)
    lines = _rotary(found) if turns else _linear(found, height)
    text = "\n".join(["; geometry for config.g", *lines]) + "\n"
    return {"config.g": text, "README.md": _readme(found, "config.g", "RepRapFirmware", height)}


def _linear(found: Configuration, height: float | None) -> list[str]:
    words = [f"L{printed(found.rods[0])}", f"R{printed(found.radius)}"]
    if height is not None:
        words.append(f"H{printed(height)}")
    return [f"M665 {' '.join(words)} X0 Y0 Z0", "M666 X0 Y0 Z0"]


def _rotary(found: Configuration) -> list[str]:
    def each(values: tuple[float, ...]) -> str:
        return ":".join(printed(value) for value in values)

    # Corrections of the directions -150, -30 and 90 degrees.
    turned = [math.remainder(angle - _FIRST - 120 * k, 360) for k, angle in enumerate(found.angles)]
    corrections = " ".join(f"{axis}{printed(value)}" for axis, value in zip("XYZ", turned, strict=True))
    words = [f"U{each(found.arms)}", f"L{each(found.rods)}", f"R{printed(found.radius)}"]
    words.append(f"H{each((found.height,) * 3)}")
    least = [one.least for one in found.ranges if one.least is not None]
    most = [one.most for one in found.ranges if one.most is not None]
    if len(least) == len(most) == 3:
        words.append(f"A{printed(max(least))}:{printed(min(most))}")
    return [f"M669 K10 {' '.join(words)} {corrections}", "M666 X0 Y0 Z0"]


def _height(found: Configuration) -> float | None:
    """Return the height of the platform's origin on the axis with all carriages at their upper limits."""
    tops = [each.most for each in found.ranges]
    if None in tops:
        return None
    return min(each for each in tops if each is not None) - math.sqrt(found.rods[0] ** 2 - found.radius**2)


def _readme(found: Configuration, file: str, firmware: str, height: float | None) -> str:
    turns = bool(max(found.arms))
    words = {
        "frame": frame_words(found.robot) + "\n  Towers X, Y, Z are at 210, 330 and 90 degrees.",
        "zero": zero_words(found.robot, found.order),
        "units": f"lengths in {found.case.controller.length}, angles in degrees"
        + (", positive upwards from the horizontal." if turns else "."),
        "unchecked": UNCHECKED,
    }
    what = (
        f"`{file}` has the geometry for {firmware}. At poses near home, its formula with these numbers differs from "
        f"the robot by at most {found.difference:.1g} of the robot's size (angles: rad). The firmware has single "
        "precision."
    )
    more = ["State the printable radius yourself; `screwsynth workspace` proves it."]
    if not turns and height is None:
        more.append("The case has no upper limit of the carriages: add the height H that you measure.")
    more.append(
        f"Generated C has the same conventions with this table:\n\n```toml\n{conventions_table(found.robot)}```"
    )
    return readme(found.case, what, words, "\n\n".join(more))

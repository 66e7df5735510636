"""Klipper's kinematics delta and rotary_delta: the geometry in a printer.cfg."""

from __future__ import annotations

import math

from ....models import Dimension
from ....models.statics import driven_joints
from ...case.case import Case
from .configuration import Configuration, Rules, delta_configuration, printed, refused
from .texts import conventions_table, frame_words, readme, zero_words

TARGET = "klipper"
_HINT = "klipper-patch writes kinematics for robots of three translations"
_ROTARY = Rules(TARGET, "rotary_delta", True, "rad", False, None, True, False, _HINT)
_LINEAR = Rules(TARGET, "delta", False, "rad", False, None, True, False, _HINT)
#: Klipper's angles of towers or arms, degrees, and the largest difference from them.
_USUAL = {"delta": (210.0, 330.0, 90.0), "rotary_delta": (30.0, 150.0, 270.0)}
_SAME_ANGLE = 1e-6
UNCHECKED = (
    "Klipper checks only the end point of a move, by radius and height. If a move leaves the reach,\n"
    "  its step generator reports no error."
)


def write(case: Case) -> dict[str, str]:
    """Return the sections of a printer.cfg and a description for a rotary or linear Delta.

    Raises:
        CaseError: the robot is not such a Delta, or its motor axes are not above the bed.
    """
    turns = any(each.dimension is Dimension.ANGLE for each in driven_joints(case.model)[:1])
    found = delta_configuration(case, _ROTARY if turns else _LINEAR)
    if turns and found.height <= 0:
        height = f"{printed(found.height)} {found.case.controller.length}"
        fault = f"its motor axes are at height {height}, but Klipper needs motor axes above the bed"
        raise refused(case, TARGET, "rotary_delta", fault, "controller.origin of the case states the bed")
    text = _rotary(found) if turns else _linear(found)
    return {"printer.cfg": text, "README.md": _readme(found, "rotary_delta" if turns else "delta")}


def _rotary(found: Configuration) -> str:
    lines = [
        "[printer]",
        "kinematics: rotary_delta",
        f"shoulder_radius: {printed(found.radius)}",
        f"shoulder_height: {printed(found.height)}",
    ]
    for k, letter in enumerate("abc"):
        lines += [
            "",
            f"[stepper_{letter}]",
            f"# actuator {found.robot.drives[k].name}",
            f"angle: {printed(found.angles[k])}",
            f"upper_arm_length: {printed(found.arms[k])}",
            f"lower_arm_length: {printed(found.rods[k])}",
            "# position_endstop: height of the nozzle above the bed on the axis where the endstop triggers; measure it",
        ]
    return "\n".join(lines) + "\n"


def _linear(found: Configuration) -> str:
    lines = ["[printer]", "kinematics: delta", f"delta_radius: {printed(found.radius)}"]
    for k, letter in enumerate("abc"):
        top, rod = found.ranges[k].most, found.rods[k]
        endstop = "# position_endstop: height of the nozzle on the axis where the endstop triggers; measure it"
        if top is not None:
            endstop = f"position_endstop: {printed(top - math.sqrt(rod**2 - found.radius**2))}"
        lines += [
            "",
            f"[stepper_{letter}]",
            f"# actuator {found.robot.drives[k].name}",
            f"angle: {printed(found.angles[k])}",
            f"arm_length: {printed(rod)}",
            endstop,
        ]
    return "\n".join(lines) + "\n"


def _readme(found: Configuration, kind: str) -> str:
    turns = kind == "rotary_delta"
    words = {
        "frame": frame_words(found.robot),
        "zero": zero_words(found.robot, found.order),
        "units": "lengths in mm, `angle` in degrees; positions of steppers are in "
        + ("radians, positive upwards from the horizontal." if turns else "mm above the bed."),
        "unchecked": UNCHECKED,
    }
    what = (
        f"`printer.cfg` has the geometry for Klipper's `{kind}`; add pins, endstops and speeds. At poses near home, "
        f"its formula with these numbers differs from the robot by at most {found.difference:.1g} of the robot's size "
        "(angles: rad)."
    )
    table = conventions_table(found.robot)
    return readme(
        found.case,
        what,
        words,
        f"{_printer_words(found, kind)}Generated C has the same conventions with this table:\n\n```toml\n{table}```",
    )


def _printer_words(found: Configuration, kind: str) -> str:
    """Return items about settings that a printer.cfg in use has already."""
    turns = kind == "rotary_delta"
    usual, own = _USUAL[kind], list(found.angles)
    items = []
    if max(abs(a - b) for a, b in zip(own, usual, strict=True)) > _SAME_ANGLE:
        shown, theirs = (", ".join(printed(each) for each in angles) for angles in (own, usual))
        items.append(
            f"- **Angles**: {'arms' if turns else 'towers'} are at {shown} degrees; Klipper's defaults are {theirs}.\n"
            "  With other angles than before, x and y turn on the bed. Keep the angles of your `printer.cfg` if all\n"
            "  three differ from these by the same angle."
        )
    if not turns:
        items.append(
            "- **Radius**: `print_radius` is not written, and its default is `delta_radius`. State `print_radius`\n"
            "  yourself; `screwsynth workspace` with a disc proves it."
        )
    return "".join(f"{each}\n" for each in items) + "\n" * bool(items)

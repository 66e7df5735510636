"""Texts that all targets share: the description of a folder, and words about its conventions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ....models import Dimension
from ... import __version__
from ...case.case import Case
from ...case.toml import toml_document
from ...system.markdown import markdown_text
from ..ctext import comment_text
from ..kinematics import Kinematics
from ..templates import fill_template


def title_of(case: Case) -> str:
    """Return the title of a case in one line."""
    return " ".join((case.title or case.name).split())


def robot_of(case: Case) -> str:
    """Return the description of a case's robot for a comment."""
    return comment_text(case.model.description or case.model.name)


def readme(case: Case, what: str, words: Mapping[str, str], more: str = "") -> str:
    """Return the description of a folder.

    Args:
        case: the case.
        what: sentence about the content of the folder.
        words: sentences for the keys ``frame``, ``zero``, ``units`` and ``unchecked``.
        more: further text.
    """
    names = {"title": markdown_text(title_of(case)), "robot": markdown_text(robot_of(case)), "version": __version__}
    return fill_template("targets/README.md.in", {**names, "what": what, "more": more, **words}).rstrip() + "\n"


def frame_words(robot: Kinematics) -> str:
    """Return a sentence about the world frame of the controller in that of the case."""
    units, controller = robot.case.units, robot.controller
    if not any((*controller.rpy, *controller.origin)):
        return "the world frame is that of the case; a position is the origin of the platform frame."
    shown = ", ".join(units.text(each, Dimension.LENGTH) for each in controller.origin)
    turned = ", ".join(units.text(each, Dimension.ANGLE) for each in controller.rpy)
    return (
        f"the origin of the controller's world frame is at ({shown}) in the world frame of the case, with roll, pitch\n"
        f"  and yaw of ({turned}). A position is the origin of the platform frame."
    )


def zero_words(robot: Kinematics, order: Sequence[int]) -> str:
    """Return a sentence about zero and sense of each joint of the controller."""
    units, controller = robot.case.units, robot.controller
    joints: dict[str, list[str]] = {}
    for joint, k in enumerate(order):
        drive = robot.drives[k]
        zero, sign = controller.zero_of(drive.name), "+" if controller.sign_of(drive.name) > 0 else "-"
        text = f"{units.text(zero, drive.dimension)} {sign} q" if zero else f"{sign} q".removeprefix("+ ")
        joints.setdefault(text, []).append(f"{joint} (actuator {markdown_text(drive.name)})")
    shown = "; ".join(f"{text} for {', '.join(names)}" for text, names in joints.items())
    measured = (
        "the length of the leg" if "leg_length" in robot.robot.measures else "the actuator's coordinate from home"
    )
    return f"the joint coordinate is {shown}. In the case, q is {measured}."


def conventions_table(robot: Kinematics) -> str:
    """Return the table of a case file that gives generated C the same conventions."""
    keys = robot.controller.to_keys(robot.drives, robot.case.units)
    return toml_document({"controller": {key: value for key, value in keys.items() if value is not None}})

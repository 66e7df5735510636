"""Generated kinematics as a library for a target: sources in the target's conventions, and as one text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal, NamedTuple

from ... import __version__
from ...case.case import Case
from ..ctext import comment_text
from ..kinematics import Kinematics
from ..kinematicsfiles import kinematics_files
from .texts import robot_of, title_of


class Library(NamedTuple):
    """Kinematics in C of a case with the conventions of a target.

    Attributes:
        case: case with these conventions.
        robot: kinematics of the robot.
        files: header and sources by name.
        names: texts for the placeholders of templates.
    """

    case: Case
    robot: Kinematics
    files: Mapping[str, str]
    names: Mapping[str, str]

    @property
    def header(self) -> str:
        """Name of the header."""
        return next(name for name in self.files if name.endswith(".h"))

    @property
    def whole(self) -> str:
        """Header and sources as one text, without includes of the header."""
        own = re.compile(rf'^#include "{re.escape(self.header)}"\n', re.MULTILINE)
        ordered = [self.header, *(name for name in self.files if name != self.header)]
        return "\n".join(own.sub("", self.files[name]) for name in ordered)


def library_of(
    case: Case,
    *,
    length: str,
    angle: Literal["deg", "rad"],
    single: bool = False,
    coordinates: str = "pose",
) -> Library:
    """Return the kinematics of a case in the units of a target; zeros, senses and frame are those that the case states.

    Raises:
        CaseError: a dimension is free, a unit is unknown, or no closed configuration is known.
        InputError: an actuator coordinate is not known.
    """
    own = replace(case, controller=replace(case.controller, length=length, angle=angle))
    robot = Kinematics(own)
    files, names = kinematics_files(own, single=single, coordinates=coordinates)
    texts = {**names, "title": comment_text(title_of(case)), "robot": robot_of(case), "version": __version__}
    return Library(own, robot, files, texts)

"""README of an exported robot: files, units, frames, assumptions and joints."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence

import casadi as ca
import numpy as np

from ....models import Dimension
from ....models.mechanism import MechanismJoint
from ... import __version__
from ...system.markdown import markdown_text
from ..solved.mechanism_of import Exported
from ..solved.words import ExportedJoint
from .plates import Plate

_FILES: Mapping[str, str] = {
    "robot.xml": """MJCF model for MuJoCo. Joint coordinates are 0 at this pose, which is the key frame `solved`. Loops
        are closed by `connect` for spherical joints, and otherwise by `weld`, which joins a copy `end_of_...` of a link
        to the link. Actuators control positions; their ranges are limits of the case.""",
    "robot.urdf": """URDF model of the tree of links. A spherical joint is three hinges. If the frame of a link is not
        at its joint, a fixed joint leads to the frame. The frames `closing_..._1` and `closing_..._2` of a closed loop
        coincide.""",
    "robot.yaml": """Loops and actuated joints of `robot.urdf`: pairs of frames, `3d` for a common point and `6d` for a
        common frame, with the keys of github.com/Gepetto/example-parallel-robots.""",
    "joints.csv": "Centre and axis of every joint in the frames of base, platform, and the two links of the joint.",
    "links.csv": "Frame of every link in the frame of the base.",
    "cut-list.csv": """Distances of joint centres on every link between base and platform, with equal links listed once;
        leg lengths and displacements of prismatic joints from home: at this pose, over all poses, and within the
        limits.""",
    "plates.csv": "Joint centres of base and platform in the plane of their plate, with distances from the plane.",
    "base.dxf": "Outline and joint centres of the base, in its plane.",
    "platform.dxf": "Outline and joint centres of the platform, in its plane.",
}
_LINK = "Outline and joint centres of this link, in the plane of its joint centres."
_UNITS = """Lengths are in {length} in all files, without conversion. Angles are in radians in MJCF and URDF, and in
    {angle} in tables."""
_FRAMES = """The base frame is the world frame of the case. The platform frame is that of the case, at this pose. Every
    other link has a frame with its origin at the joint on the base side; its x axis points to the farthest other joint
    of the link; its z axis is the axis of the first or the next joint, projected normal to x."""
_COORDINATES = """A joint coordinate is the motion of the outer link relative to the inner link, 0 at this pose. `from
    home` is the coordinate of this pose relative to the home configuration. Ranges are relative to this pose."""
_PLACEHOLDERS = """Masses, inertias, gains, efforts, speeds and shapes are placeholders, and gravity is 0. Limits other
    than joint ranges (cones, strokes, clearances, rates) are not exported."""
_WIDTH = 120
#: Links with joint centres in plates.csv.
_ENDS = ("base", "platform")


def readme_text(exported: Exported, files: Iterable[str], plates: Sequence[Plate]) -> str:
    """Return the text of the README.

    Args:
        exported: the robot as a mechanism.
        files: names of the other exported files.
        plates: plates with a drawing.
    """
    case, units = exported.case, exported.case.units
    pose = f", pose {exported.pose} of {case.pose_count}" if case.pose_count > 1 else ""
    versions = f"screwsynth {__version__} with CasADi {ca.CasadiMeta.version()} and NumPy {np.__version__}"
    length, angle = markdown_text(units.label(Dimension.LENGTH)), units.label(Dimension.ANGLE)
    parts = [
        f"# {markdown_text(case.model.name)} from the case {markdown_text(case.name)}{pose}",
        _paragraph(f"Written by {versions}."),
        "## Files",
        "\n".join(_paragraph(f"- `{name}`: {_FILES.get(name, _LINK)}", "  ") for name in files),
        "## Units",
        _paragraph(_UNITS.format(length=length, angle=angle)),
        "## Frames",
        _paragraph(_FRAMES),
        _paragraph(_COORDINATES),
        "## Assumptions and placeholders",
        _paragraph(_PLACEHOLDERS),
        *map(_paragraph, exported.notes),
        *(_paragraph(_offsets(plate, length)) for plate in plates if not plate.is_flat(exported.size)),
        "## Joints",
        "\n".join(
            [
                "| joint | kind | links | joint in the robot file | actuator |",
                "|---|---|---|---|---|",
                *map(_row, exported.mechanism.joints, exported.joints),
            ]
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _paragraph(text: str, indent: str = "") -> str:
    """Return a text in lines of the README's width."""
    words = " ".join(text.split())
    return textwrap.fill(words, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def _row(joint: MechanismJoint, words: ExportedJoint) -> str:
    """Return the table row of a joint."""
    label, actuator = markdown_text(f"{words.label} {words.part}".rstrip()), markdown_text(words.actuator)
    name, inner, outer = map(markdown_text, (joint.name, joint.inner, joint.outer))
    return f"| {name} | {joint.kind} | {inner}, {outer} | {label} | {actuator} |"


def _offsets(plate: Plate, unit: str) -> str:
    """Return the note on a plate with joint centres out of its plane."""
    largest = float(np.abs(plate.offsets).max())
    return (
        f"The joint centres of the {plate.name} are not in one plane. The drawing shows their projections; they are up"
        f" to {largest:.6g} {unit} off the plane, see {'plates.csv' if plate.name in _ENDS else 'joints.csv'}."
    )

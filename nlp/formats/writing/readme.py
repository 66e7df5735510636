"""The page that explains the files of an exported robot: frames, units, joints, choices and versions."""

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
    "robot.xml": """MJCF for MuJoCo. Coordinates are 0 at this pose, which is the key frame `solved`. Loops are
        closed by `connect` (balls) and by `weld` (`end_of_...`, the end of a limb, to the link that it is). Actuators
        hold positions; their ranges are limits of the case.""",
    "robot.urdf": """The tree of the links. A ball is three hinges. Where a link's frame is not at its joint, a fixed
        joint leads to it. Frames `closing_..._1` and `closing_..._2` coincide where a loop is closed.""",
    "robot.yaml": """Loops and actuated joints of `robot.urdf`: pairs of frames, `3d` for a common point and `6d` for a
        common frame, with the keys of github.com/Gepetto/example-parallel-robots.""",
    "joints.csv": "Centre and axis of every joint in the frames of base, platform, and the two links of the joint.",
    "links.csv": "Frame of every link in the frame of the base.",
    "cut-list.csv": """Distances of joint centres on every link between base and platform, equal links once, and
        lengths of legs and ways of slides from home: at this pose, over all poses, and within the limits.""",
    "plates.csv": "Joint centres of base and platform in the plane of their plate, and their distances from it.",
    "base.dxf": "Outline and joint centres of the base, in its plane.",
    "platform.dxf": "Outline and joint centres of the platform, in its plane.",
}
_LINK = "Outline and joint centres of this link, in the plane of its joint centres."
_UNITS = """Lengths are in {length} everywhere; nothing is converted. MJCF and URDF have angles in radians; tables have
    them in {angle}."""
_FRAMES = """The base's frame is the world's of the case. The platform's frame is that of the case, at this pose. The
    frame of another link has its origin at the joint on the base's side, and its x axis points to the link's farthest
    other joint. Its z axis is the first joint's axis, or the next joint's, as far as it is normal to x."""
_COORDINATES = """A joint's coordinate is the motion of its outer link relative to its inner link, 0 at this pose. `from
    home` is its coordinate at this pose as the case counts it. Ranges count from this pose."""
_PLACEHOLDERS = """Masses, inertias, gains, efforts, speeds and shapes are placeholders, and there is no gravity. Limits
    other than ranges of a joint (cones, strokes, clearances, rates) are not exported."""
_WIDTH = 120
#: The links whose joint centres are in plates.csv.
_ENDS = ("base", "platform")


def readme_text(exported: Exported, files: Iterable[str], plates: Sequence[Plate]) -> str:
    """Return the page.

    Args:
        exported: the robot.
        files: names of the files beside the page.
        plates: the plates that are drawn.
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
        "## Not from the case",
        _paragraph(_PLACEHOLDERS),
        *map(_paragraph, exported.notes),
        *(_paragraph(_offsets(plate, length)) for plate in plates if not plate.is_flat(exported.size)),
        "## Joints",
        "\n".join(
            [
                "| joint | kind | between | in the robot file | actuator |",
                "|---|---|---|---|---|",
                *map(_row, exported.mechanism.joints, exported.joints),
            ]
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _paragraph(text: str, indent: str = "") -> str:
    """Return a text in lines of the page's width."""
    words = " ".join(text.split())
    return textwrap.fill(words, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def _row(joint: MechanismJoint, words: ExportedJoint) -> str:
    """Return the row of a joint."""
    label, actuator = markdown_text(f"{words.label} {words.part}".rstrip()), markdown_text(words.actuator)
    name, inner, outer = map(markdown_text, (joint.name, joint.inner, joint.outer))
    return f"| {name} | {joint.kind} | {inner}, {outer} | {label} | {actuator} |"


def _offsets(plate: Plate, unit: str) -> str:
    """Return the note on a plate whose joint centres are not in one plane."""
    largest = float(np.abs(plate.offsets).max())
    return (
        f"The joint centres of the {plate.name} are not in one plane. Its drawing shows them projected; they are up to"
        f" {largest:.6g} {unit} away from it, see {'plates.csv' if plate.name in _ENDS else 'joints.csv'}."
    )

"""An imported robot as the text of a robot file, which is read again before it is returned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .checking import SAME_ROBOT, check_text
from .filetext import robot_file_text
from .freeing import with_dimensions
from .importing import Imported
from .symmetry import Offers

#: Largest difference of work rates where copies of one limb stand for limbs that are copies but for decimals.
_COPIES = 1e-2


class Written(NamedTuple):
    """Text of a robot file, and lines about it as label and text."""

    text: str
    lines: tuple[tuple[str, str], ...]


#: Beginning of the comment at the head of an imported robot file, and of the file itself.
_IMPORTED = "Imported by screwsynth from "
BEGINNING = f"# {_IMPORTED}"


def robot_file(found: Imported, source: str, wanted: Sequence[str], offers: Offers | None) -> Written:
    """Return the text of the robot file of an imported robot.

    Args:
        found: the robot.
        source: name of the file that it is from, for the comment at the head.
        wanted: numbers that become dimensions, as :func:`.freeing.with_dimensions` takes them.
        offers: circles and symmetries; None where nothing is wanted.

    Raises:
        InputError: a name means nothing, or the text would not state this robot.
    """
    tables = found.tables if offers is None else with_dimensions(found.tables, wanted, offers)
    remarks = [f"{_IMPORTED}{source}, with its numbers, in the frame and the units of that file."]
    text = robot_file_text(tables, remarks)
    is_folded = any("repeat" in limb for limb in tables.get("limb", ()))
    difference = check_text(text, found.mechanism, found.size, _COPIES if is_folded else SAME_ROBOT)
    if not is_folded:
        return Written(text, ())
    words = f"work rates differ by up to {difference:.2g} from those of the model, as its limbs are not exact copies"
    return Written(text, (("copies", words),))

"""An imported robot as the text of a robot file, laid out as people write it, and read again before it is returned."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ....models.arrays import FloatArray
from ....models.joints import RobotError
from ....models.mechanism import Mechanism, MechanismError, mechanism_of, wrenches_of
from ...case.robotfile import check_form, model_of_definition
from ...case.toml import toml_key, toml_lines, toml_table, toml_tables, toml_text
from ...errors import CaseError, InputError, one_line
from .freeing import with_dimensions
from .importing import Imported
from .symmetry import Offers

#: Largest difference of the work rates of two equal robots, in parts of the largest: numbers are written with all
#: their digits, and rounding of closed loops of six-digit models is 1e-12.
SAME_ROBOT = 1e-9
#: Robots with more joints than this are not built symbolically when their file is checked: with 60 joints it takes 2 s.
_MOST_BUILT = 40
#: Largest difference of work rates where copies of one limb stand for limbs that are copies but for decimals.
_COPIES = 1e-2
#: Beginning of the comment at the head of an imported robot file, and of the file itself.
_IMPORTED = "Imported by screwsynth from "
BEGINNING = f"# {_IMPORTED}"
#: Longest line of a list that is written on one line.
_LONGEST = 110


def robot_file(
    found: Imported, source: str, wanted: Sequence[str], offers: Offers | None
) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return the text of the robot file of an imported robot, and lines about it as label and text.

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
        return text, ()
    words = f"work rates differ by up to {difference:.2g} from those of the model, as its limbs are not exact copies"
    return text, (("copies", words),)


def robot_file_text(tables: Mapping[str, Any], remarks: Sequence[str] = ()) -> str:
    """Return the text of a robot file.

    Args:
        tables: of the robot file.
        remarks: sentences for the comment at its head.
    """
    lines = [f"# {one_line(each)}" for each in remarks]
    named = ("dimensions", "derived", "limb", "joint", "coupling")
    lines += toml_lines({key: value for key, value in tables.items() if key not in named})
    for key in ("dimensions", "derived"):
        lines += toml_table(f"[{key}]", tables.get(key, {}))
    for limb in tables.get("limb", ()):
        lines += ["", "[[limb]]", *_limb_lines(limb)]
    for key in ("joint", "coupling"):
        lines += toml_tables(f"[[{key}]]", tables.get(key, ()))
    return "\n".join(lines) + "\n"


def _limb_lines(limb: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a limb."""
    for key, value in limb.items():
        if key in ("joints", "branch"):
            yield from _list_lines(key, value)
        else:
            yield f"{toml_key(key)} = {toml_text(value)}"


def _list_lines(key: str, values: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a list of tables, each on a line of its own where one line is too short."""
    whole = f"{key} = {toml_text(values)}"
    if len(whole) <= _LONGEST:
        yield whole
        return
    yield f"{key} = ["
    for value in values:
        # TOML wants a table within a list on one line; only lists within it may be broken.
        if "joints" in value:
            yield "    { joints = ["
            yield from (f"        {toml_text(joint)}," for joint in value["joints"])
            yield "    ] },"
        else:
            yield f"    {toml_text(value)},"
    yield "]"


def check_text(text: str, mechanism: Mechanism, size: float, allowed: float = SAME_ROBOT) -> float:
    """Read the text of a robot file, and return the difference of its work rates from those of a mechanism.

    The difference is that of ``J'J``, from which F of every motion follows, and of ``Q'Q``, with ``Q`` the actuators'
    rates for six motions, in parts of their largest entries.

    Args:
        text: of the robot file.
        mechanism: the robot that it must state.
        size: of the robot, as characteristic length.
        allowed: largest difference.

    Raises:
        InputError: the text is no robot file, or states a robot with other work rates.
    """
    tables = tomllib.loads(text)
    try:
        check_form(tables)
        if len(mechanism.joints) <= _MOST_BUILT:
            model_of_definition(tables, "robot file")
        again = mechanism_of(tables)
    except (CaseError, RobotError, MechanismError) as error:
        raise InputError(f"the robot file would not be read: {error}") from None
    pairs = zip(_measures(again, size), _measures(mechanism, size), strict=True)
    difference = max(float(np.abs(found - expected).max() / np.abs(expected).max()) for found, expected in pairs)
    if not difference <= allowed:
        fault = "the robot file, read again, differs from the model: its work rates are off by"
        advice = "--snap makes axes meet that nearly do"
        raise InputError(f"{fault} {difference:.2g} of the largest, and {allowed:.2g} is allowed; {advice}")
    return difference


def _measures(mechanism: Mechanism, size: float) -> tuple[FloatArray, FloatArray]:
    """Return ``J'J`` and ``Q'Q`` (6, 6), with twists about the platform's origin and lengths in parts of the size.

    Neither depends on the order of members and actuators. An actuator that cannot drive the platform has no rate.
    """
    platform = mechanism.link(mechanism.platform)
    wrenches = wrenches_of(mechanism, size)
    forces, moments = wrenches.jacobian[:, :3], wrenches.jacobian[:, 3:]
    rows = np.hstack([forces, (moments - np.cross(platform.position, forces)) / size])
    rates = []
    for w, v in ((each[:3] / size, each[3:]) for each in np.eye(6)):
        found = wrenches.rates(np.concatenate([w, v + np.cross(platform.position, w)]))
        rates.append([value if np.isfinite(value) else 0.0 for value in found.values()])
    Q = np.array(rates)
    return np.asarray(rows.T @ rows), np.asarray(Q @ Q.T)

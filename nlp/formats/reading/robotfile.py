"""Writer of robot files for imported robots; each text is checked by reading it again."""

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

#: Largest relative difference of the work rates of equal robots: numbers are written with all digits, and rounding of
#: closed loops of six-digit models is 1e-12.
SAME_ROBOT = 1e-9
#: Largest number of joints of a robot that is built symbolically in the check: 60 joints take 2 s.
_MOST_BUILT = 40
#: Largest relative difference of work rates if copies of a limb replace limbs that are copies up to rounding.
_COPIES = 1e-2
#: Beginning of the comment at the head of an imported robot file, and of the file.
_IMPORTED = "Imported by screwsynth from "
BEGINNING = f"# {_IMPORTED}"
#: Longest line of a list that is written on one line.
_LONGEST = 110


def robot_file(
    found: Imported, source: str, wanted: Sequence[str], offers: Offers | None
) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return the text of the robot file of an imported robot, and summary lines as label and text.

    Args:
        found: imported robot.
        source: name of the imported file, for the comment at the head.
        wanted: values that become dimensions, as for :func:`.freeing.with_dimensions`.
        offers: detected circles and symmetries; None if no value becomes a dimension.

    Raises:
        InputError: a name is unknown, or the robot file would give another robot.
    """
    tables = found.tables if offers is None else with_dimensions(found.tables, wanted, offers)
    remarks = [f"{_IMPORTED}{source}, with its numbers, in the frame and the units of that file."]
    text = robot_file_text(tables, remarks)
    is_folded = any("repeat" in limb for limb in tables.get("limb", ()))
    difference = check_text(text, found.mechanism, found.size, _COPIES if is_folded else SAME_ROBOT)
    if not is_folded:
        return text, ()
    words = f"work rates differ by up to {difference:.2g} from those of the model, whose limbs are not exact copies"
    return text, (("copies", words),)


def robot_file_text(tables: Mapping[str, Any], remarks: Sequence[str] = ()) -> str:
    """Return the text of a robot file.

    Args:
        tables: tables of the robot file.
        remarks: lines of the comment at the head.
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
    """Yield the lines of a list of tables: one line, or one line for each table if that is too long."""
    whole = f"{key} = {toml_text(values)}"
    if len(whole) <= _LONGEST:
        yield whole
        return
    yield f"{key} = ["
    for value in values:
        # TOML allows no line breaks in an inline table, except in lists within it.
        if "joints" in value:
            yield "    { joints = ["
            yield from (f"        {toml_text(joint)}," for joint in value["joints"])
            yield "    ] },"
        else:
            yield f"    {toml_text(value)},"
    yield "]"


def check_text(text: str, mechanism: Mechanism, size: float, allowed: float = SAME_ROBOT) -> float:
    """Return the relative difference of work rates between a robot file and a mechanism.

    The difference is the larger one of ``J'J``, which gives F for every motion, and of ``Q'Q``, with ``Q`` the actuator
    rates for six motions, relative to their largest entries.

    Args:
        text: text of the robot file.
        mechanism: expected robot.
        size: characteristic length of the robot.
        allowed: largest allowed difference.

    Raises:
        InputError: the text is not a robot file, or gives a robot with other work rates.
    """
    tables = tomllib.loads(text)
    try:
        check_form(tables)
        if len(mechanism.joints) <= _MOST_BUILT:
            model_of_definition(tables, "robot file")
        again = mechanism_of(tables)
    except (CaseError, RobotError, MechanismError) as error:
        raise InputError(f"the robot cannot be written as a robot file: {error}") from None
    pairs = zip(_measures(again, size), _measures(mechanism, size), strict=True)
    difference = max(float(np.abs(found - expected).max() / np.abs(expected).max()) for found, expected in pairs)
    if not difference <= allowed:
        fault = f"work rates of the robot file must differ by at most {allowed:.2g} from those of the model"
        advice = "--snap makes nearly intersecting axes meet"
        raise InputError(f"{fault}, got {difference:.2g}; {advice}")
    return difference


def _measures(mechanism: Mechanism, size: float) -> tuple[FloatArray, FloatArray]:
    """Return ``J'J`` and ``Q'Q`` (6, 6), with twists about the platform origin and lengths relative to the size.

    Neither depends on the order of members and actuators. Undetermined actuator rates are set to 0.
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

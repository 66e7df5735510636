"""A robot in MJCF or URDF as a robot file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ....models.mechanism import Mechanism, MechanismError, robot_tables
from ...errors import InputError
from .description import Description
from .meeting import with_meeting_joints
from .mjcf import read_mjcf
from .newton import Gap, close
from .reduction import Ends, Reduced, reduce
from .universal import with_universal_joints
from .urdf import read_urdf
from .xmltext import read_xml

#: Loops that are open by more than this, in parts of the robot's size, are refused: decimals of six digits are nearer.
OPEN = 1e-6
#: Entries below this are rounding of rotations, and are written as 0; lengths in parts of the robot's size.
_ROUNDING = 1e-14
#: Keys whose values hold tables.
_NESTED = ("limb", "joints", "branch", "joint")


@dataclass(frozen=True)
class Request:
    """The robot to import, and how.

    Attributes:
        path: of the file.
        ends: base, platform and actuators.
        closes: whether Newton's method closes the loops.
        loops: YAML file of a URDF file's loops; None for the one beside it.
    """

    path: Path
    ends: Ends
    closes: bool = False
    loops: Path | None = None


class Imported(NamedTuple):
    """A robot that was imported.

    Attributes:
        tables: of the robot file, with numbers.
        mechanism: the same robot as links and joints.
        size: largest distance of two joints, length.
        gaps: how far its loops are open in the description.
        notes: sentences about what was found, assumed or left out.
    """

    tables: dict[str, Any]
    mechanism: Mechanism
    size: float
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]


def import_robot(request: Request) -> Imported:
    """Return the robot that a file describes, as the tables of a robot file.

    Raises:
        InputError: the file cannot be read, or describes no robot with closed loops between base and platform.
    """
    given = _read(request)
    reduced = reduce(given, request.ends)
    gaps, notes = reduced.gaps, list(reduced.notes)
    if request.closes:
        closed = close(given, reduced.size)
        reduced = reduce(closed.description, request.ends)
        moved = f"joints moved by up to {math.degrees(closed.turn):.3g} deg"
        moved += f" and {closed.way:.3g}" if closed.way else ""
        kept = "driven joints stayed" if closed.kept else "driven joints moved too"
        notes.append(f"loops were closed by Newton's method: {moved}; {kept}")
    _refuse_open(given, reduced, closes=request.closes)
    met = with_meeting_joints(reduced.mechanism, reduced.size)
    try:
        tables = robot_tables(met.mechanism)
    except MechanismError as error:
        raise InputError(f"{given.source}: {error}") from None
    tables = _without_rounding(with_universal_joints(tables, reduced.size), reduced.size)
    return Imported(_with_limb_names(tables), met.mechanism, reduced.size, gaps, (*notes, *met.notes))


def _read(request: Request) -> Description:
    """Return the description in a file of either format."""
    root = read_xml(request.path)
    if root.tag in ("mujoco", "mujocoinclude"):
        if request.loops is not None:
            raise InputError(f"--loops {request.loops}: is for URDF files; {request.path} is MJCF")
        return read_mjcf(root, request.path)
    if root.tag == "robot":
        return read_urdf(root, request.path, request.loops)
    tag = root.tag[:40]
    raise InputError(f"{request.path}: begins with <{tag}>; <mujoco> of MJCF or <robot> of URDF is needed")


def _refuse_open(given: Description, reduced: Reduced, *, closes: bool) -> None:
    """Refuse loops that are open, with the largest of them.

    Raises:
        InputError: a loop is open by more than the tolerance.
    """
    worst = max(reduced.gaps, key=lambda gap: gap_share(gap, reduced.size), default=None)
    if worst is None or gap_share(worst, reduced.size) <= OPEN:
        return
    fault = f"the loop {worst.name} is open by {worst.distance:.3g} and {math.degrees(worst.angle):.3g} deg"
    advice = "Newton's method did not close it" if closes else "--close closes it by Newton's method"
    raise InputError(f"{given.source}: {fault}, more than {OPEN:g} of the robot's size {reduced.size:.3g}; {advice}")


def gap_share(gap: Gap, size: float) -> float:
    """Return how far a loop is open, in parts of the robot's size."""
    return max(gap.distance / size, gap.angle)


def _without_rounding(value: Any, size: float) -> Any:  # noqa: ANN401 - tables of any depth
    """Return tables with numbers of the size of rounding errors as 0; the size is that of a list's numbers."""
    if isinstance(value, Mapping):
        own = {key: size if key in ("at", "to", "home") else 1.0 for key in value}
        return {key: _without_rounding(each, size if key in _NESTED else own[key]) for key, each in value.items()}
    if isinstance(value, list):
        return [_without_rounding(each, size) for each in value]
    if isinstance(value, float):
        return 0.0 if abs(value) < _ROUNDING * size else value
    return value


def _with_limb_names(tables: dict[str, Any]) -> dict[str, Any]:
    """Return tables with each limb called by its first driven joint, or by its first joint."""
    if "limb" not in tables:
        return tables
    taken: set[str] = set()
    limbs = []
    for limb in tables["limb"]:
        joints = [*limb.get("joints", []), *(joint for branch in limb.get("branch", []) for joint in branch["joints"])]
        named = [joint for joint in joints if "name" in joint]
        chosen = next((each["name"] for each in named if each.get("actuated")), named[0]["name"] if named else "")
        name = chosen if chosen and chosen not in taken else ""
        taken.add(name)
        limbs.append({**({"name": name} if name else {}), **limb})
    return {**tables, "limb": limbs}

"""A robot in MJCF or URDF as a robot file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ....models.mechanism import (
    Mechanism,
    MechanismError,
    SingularityType,
    generic_ranks,
    robot_tables,
    singularities_of,
    wrenches_of,
)
from ...errors import InputError, listing
from .closing import CLOSED, LEAST, Closed, Gap, close, close_from_other_starts, least_gaps
from .description import Description
from .meeting import with_meeting_joints, with_universal_joints
from .mjcf import read_mjcf
from .reduction import Ends, Reduced, reduce
from .snapping import near_misses, snapped
from .symmetry import joints_of_limb
from .urdf import read_urdf
from .xmltext import read_xml

#: Loops that are open by more than this, in parts of the robot's size, are closed only if asked for: decimals of six
#: digits are nearer.
OPEN = 1e-6
#: Most names that a message lists.
_MOST_NAMES = 12
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
        keyframe: of an MJCF file, by its name; empty for its reference configuration.
        snap: largest distance by which axes are moved so that they meet or are parallel, length; 0 for none.
    """

    path: Path
    ends: Ends
    closes: bool = False
    loops: Path | None = None
    keyframe: str = ""
    snap: float = 0.0


@dataclass(frozen=True, eq=False)
class Imported(Reduced):
    """A robot that was imported, with how far its loops are open in the description.

    Attributes:
        tables: of the robot file, with numbers.
    """

    tables: dict[str, Any]


def import_robot(request: Request) -> Imported:
    """Return the robot that a file describes, as the tables of a robot file.

    Raises:
        InputError: the file cannot be read, or describes no robot with closed loops between base and platform.
    """
    given = _read(request)
    reduced = reduce(given, request.ends)
    gaps, notes = reduced.gaps, list(reduced.notes)
    worst = reduced.worst.share(reduced.size)
    if worst > OPEN and not request.closes:
        advice = f"--close closes it by Newton's method{_other_keyframes(given, request.keyframe)}"
        raise InputError(f"{_open_loop(given, reduced)}; {advice}")
    if worst > CLOSED:
        loops = _with_loops(given, gaps)
        closed = close(loops, reduced.size)
        moved = _reduced_at(closed, given, request)
        if moved.worst.share(moved.size) > LEAST:
            found = close_from_other_starts(loops, reduced.size)
            if found is None:
                raise InputError(_not_closed(given, loops, moved, request))
            closed, moved = found, _reduced_at(found, given, request)
        reduced = moved
        notes.append(_closed_words(closed, reduced))
    mechanism = reduced.mechanism
    if request.snap:
        mechanism, note = snapped(mechanism, reduced.size, request.snap)
        notes.append(note)
    mechanism, more = with_meeting_joints(mechanism, reduced.size)
    notes += more
    try:
        tables = robot_tables(mechanism)
    except MechanismError as error:
        raise InputError(f"{given.source}: {error}") from None
    notes += [*near_misses(mechanism, reduced.size), *_singular(mechanism, reduced.size)]
    tables = _without_rounding(with_universal_joints(tables, reduced.size), reduced.size)
    return Imported(mechanism, reduced.size, gaps, tuple(notes), _with_limb_names(tables))


def _read(request: Request) -> Description:
    """Return the description in a file of either format."""
    root = read_xml(request.path)
    if root.tag in ("mujoco", "mujocoinclude"):
        if request.loops is not None:
            raise InputError(f"--loops {request.loops}: is for URDF files; {request.path} is MJCF")
        return read_mjcf(root, request.path, request.keyframe)
    if root.tag == "robot":
        if request.keyframe:
            raise InputError(f"--keyframe {request.keyframe}: is for MJCF files; {request.path} is URDF")
        return read_urdf(root, request.path, request.loops)
    tag = root.tag[:40]
    raise InputError(f"{request.path}: begins with <{tag}>; <mujoco> of MJCF or <robot> of URDF is needed")


def _with_loops(given: Description, gaps: Sequence[Gap]) -> Description:
    """Return a description with the loops of the mechanism alone: those of side chains stay as they are."""
    names = {gap.name for gap in gaps}
    return replace(
        given,
        closures=tuple(each for each in given.closures if each.name in names),
        couplings=tuple(each for each in given.couplings if each.name in names),
    )


def _reduced_at(closed: Closed, given: Description, request: Request) -> Reduced:
    """Return a robot at the configuration in which its loops were closed, with all loops that the file has."""
    return reduce(replace(closed.description, closures=given.closures, couplings=given.couplings), request.ends)


def _not_closed(given: Description, loops: Description, reduced: Reduced, request: Request) -> str:
    """Return the sentence about loops that stay open: the smallest gap found, which loops cannot close, what to do."""
    apart = least_gaps(loops, reduced.size)
    others = _other_keyframes(given, request.keyframe)
    words = f"{_open_loop(given, reduced)} after Newton's method, which came no closer from other starts"
    if apart:
        each = [f"{name} by {value:.3g}" for name, value in list(apart.items())[:_MOST_NAMES]]
        words += f"; even by itself, with every joint free, a loop stays open by parts of the size: {', '.join(each)}"
        return f"{words}; correct the frames of these loops or the joints between them in the file{others}"
    return f"{words}; each loop closes by itself, but not with the others: correct the lengths in the file{others}"


def _open_loop(given: Description, reduced: Reduced) -> str:
    """Return the sentence that says which loop is open most."""
    fault = f"the loop {reduced.worst.name} is open by {reduced.worst.words}"
    return f"{given.source}: {fault}, more than {OPEN:g} of the robot's size {reduced.size:.3g}"


def _other_keyframes(given: Description, keyframe: str) -> str:
    """Return the words on the other configurations that a file has; empty without any."""
    others = [each for each in given.keyframes if each != keyframe][:_MOST_NAMES]
    return f", --keyframe takes another configuration: {listing(others)}" if others else ""


def _closed_words(closed: Closed, reduced: Reduced) -> str:
    """Return the note on loops that were closed."""
    moved = f"joints moved by up to {math.degrees(closed.turn):.3g} deg"
    moved += f" and {closed.way:.3g}" if closed.way else ""
    kept = "driven joints stayed" if closed.kept else "driven joints moved too"
    words = f"loops were closed by Newton's method: {moved}; {kept}"
    left = reduced.worst
    if left.share(reduced.size) <= CLOSED:
        return words
    fault = f"{left.name} stays open by {left.words}, the least squares of numbers that contradict each other"
    return f"{words}; {fault}: the robot file has the joint where its first body has it"


def _singular(mechanism: Mechanism, size: float) -> Iterator[str]:
    """Yield a note for each singularity that a mechanism is in where it stands."""
    try:
        generic = generic_ranks(mechanism)
    except MechanismError:
        fault = "its loops close nowhere else near where the model stands"
        yield f"{fault}: the robot cannot move, or its numbers contradict each other"
        return
    for each in singularities_of(wrenches_of(mechanism, size).ranks, generic):
        where = "" if each.type is SingularityType.ARCHITECTURE else " where it stands"
        whose = "the robot" if each.member is None else f"member {each.member + 1}"
        yield f"{whose} is singular{where}: {each.type.value}"


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
        named = [joint for joint in joints_of_limb(limb) if "name" in joint]
        chosen = next((each["name"] for each in named if each.get("actuated")), named[0]["name"] if named else "")
        name = chosen if chosen and chosen not in taken else ""
        taken.add(name)
        limbs.append({**({"name": name} if name else {}), **limb})
    return {**tables, "limb": limbs}

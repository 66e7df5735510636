"""Import of a robot in MJCF or URDF as the tables of a robot file."""

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

#: Gap, relative to the robot's size, above which loops are closed only on request: rounding of values with six digits
#: is smaller.
OPEN = 1e-6
#: Largest number of names in a message.
_MOST_NAMES = 12
#: Largest rounding error of rotations, and of lengths relative to the robot's size; smaller values are written as 0.
_ROUNDING = 1e-14
#: Keys with tables as values.
_NESTED = ("limb", "joints", "branch", "joint")


@dataclass(frozen=True)
class Request:
    """Request of an import.

    Attributes:
        path: path of the file.
        ends: base, platform and actuators.
        closes: If true, open loops are closed by Newton's method.
        loops: YAML file with the loops of a URDF file; None for a file with the same name, if there is one.
        keyframe: name of a keyframe of an MJCF file; empty for the reference configuration.
        snap: largest distance by which axes are moved to make them meet or parallel, length; 0 for no correction.
    """

    path: Path
    ends: Ends
    closes: bool = False
    loops: Path | None = None
    keyframe: str = ""
    snap: float = 0.0


@dataclass(frozen=True, eq=False)
class Imported(Reduced):
    """Imported robot.

    Attributes:
        tables: tables of the robot file, with numbers.
    """

    tables: dict[str, Any]


def import_robot(request: Request) -> Imported:
    """Return the robot of a file as the tables of a robot file.

    Args:
        request: file, ends and options of the import.

    Raises:
        InputError: the file cannot be read, or has no robot with closed loops between base and platform.
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
    """Return the description in an MJCF or URDF file."""
    root = read_xml(request.path)
    if root.tag in ("mujoco", "mujocoinclude"):
        if request.loops is not None:
            raise InputError(f"--loops {request.loops}: is only for URDF files, and {request.path} is MJCF")
        return read_mjcf(root, request.path, request.keyframe)
    if root.tag == "robot":
        if request.keyframe:
            raise InputError(f"--keyframe {request.keyframe}: is only for MJCF files, and {request.path} is URDF")
        return read_urdf(root, request.path, request.loops)
    tag = root.tag[:40]
    raise InputError(f"{request.path}: expected <mujoco> of MJCF or <robot> of URDF as root element, got <{tag}>")


def _with_loops(given: Description, gaps: Sequence[Gap]) -> Description:
    """Return a description with only the loops of the mechanism, without those of side chains."""
    names = {gap.name for gap in gaps}
    return replace(
        given,
        closures=tuple(each for each in given.closures if each.name in names),
        couplings=tuple(each for each in given.couplings if each.name in names),
    )


def _reduced_at(closed: Closed, given: Description, request: Request) -> Reduced:
    """Return the mechanism at the configuration with closed loops, with all loops of the file."""
    return reduce(replace(closed.description, closures=given.closures, couplings=given.couplings), request.ends)


def _not_closed(given: Description, loops: Description, reduced: Reduced, request: Request) -> str:
    """Return the message about loops that cannot be closed: smallest gap, loops at fault, and advice."""
    apart = least_gaps(loops, reduced.size)
    others = _other_keyframes(given, request.keyframe)
    words = f"{_open_loop(given, reduced)} after Newton's method, also from other starts"
    if apart:
        each = [f"{name} by {value:.3g}" for name, value in list(apart.items())[:_MOST_NAMES]]
        words += f"; some loops cannot be closed even separately (gaps relative to the size: {', '.join(each)})"
        return f"{words}; correct the frames or joints of these loops in the file{others}"
    return f"{words}; each loop can be closed separately, but not all together: correct the lengths in the file{others}"


def _open_loop(given: Description, reduced: Reduced) -> str:
    """Return the message about the loop with the largest gap."""
    fault = f"the loop {reduced.worst.name} is open by {reduced.worst.words}"
    return f"{given.source}: {fault}, more than {OPEN:g} of the robot's size {reduced.size:.3g}"


def _other_keyframes(given: Description, keyframe: str) -> str:
    """Return a hint at the other configurations of a file; empty if there are none."""
    others = [each for each in given.keyframes if each != keyframe][:_MOST_NAMES]
    return f", or choose another configuration with --keyframe: {listing(others)}" if others else ""


def _closed_words(closed: Closed, reduced: Reduced) -> str:
    """Return the note on closed loops."""
    moved = f"joints moved by up to {math.degrees(closed.turn):.3g} deg"
    moved += f" and {closed.way:.3g}" if closed.way else ""
    kept = "actuated joints did not move" if closed.kept else "actuated joints moved too"
    words = f"loops were closed by Newton's method: {moved}; {kept}"
    left = reduced.worst
    if left.share(reduced.size) <= CLOSED:
        return words
    fault = f"{left.name} stays open by {left.words} (least squares), because dimensions in the file are inconsistent"
    return f"{words}; {fault}; the robot file has this joint at its place on the first body"


def _singular(mechanism: Mechanism, size: float) -> Iterator[str]:
    """Yield a note for each singularity of a mechanism at the stated configuration."""
    try:
        generic = generic_ranks(mechanism)
    except MechanismError:
        fault = "no closed configuration near the stated one"
        yield f"{fault}: check that the mechanism is mobile and its dimensions are consistent"
        return
    for each in singularities_of(wrenches_of(mechanism, size).ranks, generic):
        where = "" if each.type is SingularityType.ARCHITECTURE else " at the stated configuration"
        part = "the robot" if each.member is None else f"member {each.member + 1}"
        yield f"{part} is singular{where}: {each.type.value}"


def _without_rounding(value: Any, size: float) -> Any:  # noqa: ANN401 - tables of any depth
    """Return tables with 0 for rounding errors; ``size`` is the magnitude of the numbers in a list."""
    if isinstance(value, Mapping):
        sizes = {key: size if key in ("at", "to", "home", *_NESTED) else 1.0 for key in value}
        return {key: _without_rounding(each, sizes[key]) for key, each in value.items()}
    if isinstance(value, list):
        return [_without_rounding(each, size) for each in value]
    if isinstance(value, float):
        return 0.0 if abs(value) < _ROUNDING * size else value
    return value


def _with_limb_names(tables: dict[str, Any]) -> dict[str, Any]:
    """Return tables with each limb named after its first actuated joint, or its first joint."""
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

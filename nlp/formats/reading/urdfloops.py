"""Closed loops of URDF files, in four conventions.

- a YAML file beside the URDF with pairs of frames ``closed_loop``, their ``type`` (``3d`` or ``6d``), the actuated
  joints ``name_mot``, and joints of another kind ``joint_name`` and ``joint_type``
  (github.com/Gepetto/example-parallel-robots), - frames ``closing_NAME_1`` and ``closing_NAME_2``, with a second pair
  ``closing_NAME_1_z`` for a hinge (github.com/Rhoban/onshape-to-robot, docs/source/kinematic_loops.rst and
  onshape_to_robot/assembly.py), - elements ``<constraint>`` with ``parent``, ``parent_origin``, ``parent_axis`` and the
  same for ``child``, as github.com/ros/urdfdom/pull/264 proposes (the allowed types are not agreed yet), - elements
  ``<loop_joint>`` with ``link1`` and ``link2``, each with ``link``, ``xyz`` and ``rpy``, as in Isaac Sim, and with an
  ``axis`` in both, as Drake had.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ...errors import InputError, listing
from ...system.reading import read_limited
from ..extra import required
from ..frames import Frame, axis_frame
from .description import Closing, LoopClosure, common_name, unique_name
from .urdfelements import axis_of, link_of, name_of, origin_of

#: Largest YAML file, bytes: published files have 2 kB.
_LARGEST_YAML = 2**20
_CLOSING_FRAME = re.compile(r"(closing_.+)_1")
_PAIR_TYPES = {"3d": Closing.BALL, "6d": Closing.WELD}
_CONSTRAINTS = {
    "spherical": Closing.BALL,
    "ball": Closing.BALL,
    "fixed": Closing.WELD,
    "revolute": Closing.HINGE,
    "continuous": Closing.HINGE,
    "prismatic": Closing.SLIDE,
    "cylindrical": Closing.CYLINDER,
    "universal": Closing.UNIVERSAL,
}
_JOINT_TYPE = re.compile(r"SPHERICAL|FIXED|UJOINT_[XYZ][XYZ]")


@dataclass(frozen=True)
class LoopFile:
    """YAML file of loops.

    Attributes:
        path: path of the file.
        pairs: names of the two frames of each loop, with the kind of its joint.
        driven: names of the actuated joints; None if the file does not list them.
        kinds: type by name of joints with another type than in the URDF file: ``SPHERICAL``, ``FIXED`` or
            ``UJOINT_XY``.
    """

    path: Path
    pairs: tuple[tuple[str, str, Closing], ...]
    driven: tuple[str, ...] | None
    kinds: Mapping[str, str]


def read_loop_file(path: Path) -> LoopFile:
    """Return the content of a YAML file of loops.

    Raises:
        InputError: the file cannot be read, or a key has a wrong value.
    """
    yaml = required("yaml", "YAML files of loops", "pyyaml")
    try:
        tables = yaml.safe_load(read_limited(path, _LARGEST_YAML, is_regular=True))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = str(error).splitlines() or [""]
        raise InputError(f"{path}: is not valid YAML: {reason[0]}") from None
    if not isinstance(tables, dict):
        raise InputError(f"{path}: must be a table of loops with the key closed_loop, got {type(tables).__name__}")
    pairs = tables.get("closed_loop") or []
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        raise InputError(f"{path}: closed_loop: must be a list of pairs of names")
    kinds = _texts(path, tables, "type") or ["6d"] * len(pairs)
    if len(kinds) != len(pairs):
        raise InputError(f"{path}: type: must have {len(pairs)} entries, one for each loop, got {len(kinds)}")
    for kind in kinds:
        if kind.lower() not in _PAIR_TYPES:
            raise InputError(f'{path}: type = "{kind[:60]}": must be 3d or 6d')
    names, types = _texts(path, tables, "joint_name") or [], _texts(path, tables, "joint_type") or []
    if len(names) != len(types):
        fault = f"must have {len(names)} entries, one for each name in joint_name, got {len(types)}"
        raise InputError(f"{path}: joint_type: {fault}")
    for kind in types:
        if not _JOINT_TYPE.fullmatch(kind):
            fault = "must be SPHERICAL, FIXED or UJOINT_ with two of the letters X, Y and Z"
            raise InputError(f'{path}: joint_type = "{kind[:60]}": {fault}')
    driven = _texts(path, tables, "name_mot")
    return LoopFile(
        path,
        tuple((str(a), str(b), _PAIR_TYPES[kind.lower()]) for (a, b), kind in zip(pairs, kinds, strict=True)),
        None if driven is None else tuple(driven),
        dict(zip(names, types, strict=True)),
    )


def _texts(path: Path, tables: Mapping[str, object], key: str) -> list[str] | None:
    """Return a list of texts; None if the key is missing."""
    value = tables.get(key)
    if value is None:
        return None
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise InputError(f"{path}: {key}: must be a list of names")
    return value


def closures_of_pairs(loops: LoopFile, frames: Mapping[str, tuple[str, Frame]]) -> list[LoopClosure]:
    """Return the closures of a YAML file.

    Args:
        loops: content of the file.
        frames: frame on a link for each name of a link or joint.

    Raises:
        InputError: a name is unknown.
    """
    found: list[LoopClosure] = []
    for first, second, closing in loops.pairs:
        for name in (first, second):
            if name not in frames:
                fault = "no such link or joint in the URDF file"
                raise InputError(f'{loops.path}: closed_loop = "{name[:60]}": {fault}')
        (one, one_frame), (other, other_frame) = frames[first], frames[second]
        name = unique_name(
            common_name([first, second]) or f"{first} {second}", {each.name for each in found} | set(frames)
        )
        found.append(LoopClosure(name, closing, one, other, one_frame, other_frame))
    return found


def closures_of_frames(
    frames: Mapping[str, tuple[str, Frame]], taken: Sequence[str], places: Mapping[str, Frame]
) -> tuple[list[LoopClosure], list[str]]:
    """Return the closures by frames ``closing_NAME_1`` and ``closing_NAME_2``, and notes.

    Args:
        frames: named frames on links: name of the link, and frame in link coordinates.
        taken: names already in use.
        places: frames of the links in the world.
    """
    found: list[LoopClosure] = []
    notes: list[str] = []
    for name, (one, one_frame) in frames.items():
        match = _CLOSING_FRAME.fullmatch(name)
        if match is None or f"{match[1]}_2" not in frames:
            continue
        other, other_frame = frames[f"{match[1]}_2"]
        closing, first_frame, second_frame = Closing.BALL, one_frame, other_frame
        if {f"{name}_z", f"{match[1]}_2_z"} <= set(frames):
            # The second pair is on the axis of the hinge.
            closing = Closing.HINGE
            first_frame = _towards(one_frame, one, frames[f"{name}_z"], places)
            second_frame = _towards(other_frame, other, frames[f"{match[1]}_2_z"], places)
        else:
            notes.append(f"{match[1]} is assumed to be a ball joint, because its two frames do not give its kind")
        chosen = unique_name(match[1], {*taken, *(each.name for each in found)})
        found.append(LoopClosure(chosen, closing, one, other, first_frame, second_frame))
    return found, notes


def _towards(frame: Frame, link: str, end: tuple[str, Frame], places: Mapping[str, Frame]) -> Frame:
    """Return a frame of a link with its z axis towards the origin of another frame; unchanged if both coincide."""
    at = places[link].inverse() @ places[end[0]] @ end[1]
    direction = at.position - frame.position
    return axis_frame(frame.position, direction) if np.linalg.norm(direction) > 0 else frame


def closures_of_elements(root: Element, links: set[str], taken: Collection[str], source: str) -> list[LoopClosure]:
    """Return the closures of the elements ``<constraint>`` and ``<loop_joint>``.

    Raises:
        InputError: a link or type is unknown, a loop joint needs an axis, or a value is not a number.
    """
    found: dict[str, LoopClosure] = {}
    for element in (*root.findall("constraint"), *root.findall("loop_joint")):
        is_joint = element.tag == "loop_joint"
        name = name_of(element, source)
        place = f"{source}: {element.tag} {name}"
        kind = element.get("type", "")
        allowed = [key for key in _CONSTRAINTS if not (is_joint and key == "universal")]
        if kind not in allowed:
            raise InputError(f'{place}, type = "{kind[:60]}": must be one of {listing(allowed)}')
        closing, sides = _CONSTRAINTS[kind], ("link1", "link2") if is_joint else ("parent", "child")
        first, second = (link_of(element, side, links, place) for side in sides)
        frames = [origin_of(element, side if is_joint else f"{side}_origin", place) for side in sides]
        if is_joint and closing not in (Closing.BALL, Closing.WELD) and element.find("axis") is None:
            fault = f"is missing: a joint of type {kind} needs an axis, in the frame of each link"
            raise InputError(f"{place}, axis: {fault}")
        axes = [axis_of(element, "axis" if is_joint else f"{side}_axis", place) for side in sides]
        if closing is not Closing.WELD:
            turned = [axis_frame(np.zeros(3), axis).rotation for axis in axes]
            frames = [Frame(each.position, each.rotation @ turn) for each, turn in zip(frames, turned, strict=True)]
        chosen = unique_name(name, {*taken, *found})
        found[chosen] = LoopClosure(chosen, closing, first, second, *frames)
    return list(found.values())

"""Reader of URDF with closed loops."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism import Coupling, MechanismJoint
from ....models.rotation import perpendiculars
from ...errors import InputError, listing
from ..frames import Frame
from .description import Body, Description, LoopClosure, unique_name
from .urdfelements import axis_of, link_of, name_of, number_of, origin_of
from .urdfloops import (
    LoopFile,
    closures_of_elements,
    closures_of_frames,
    closures_of_pairs,
    read_loop_file,
)

if TYPE_CHECKING:
    from ....models.mechanism.graph import ElementaryKind

#: Types of joints, with the kind of each elementary joint that they consist of.
_TYPES: dict[str, tuple[ElementaryKind, ...]] = {
    "revolute": ("R",),
    "continuous": ("R",),
    "prismatic": ("P",),
    "fixed": ("weld",),
    "floating": (),
    "planar": ("P", "P", "R"),
    "spherical": ("S",),
    "ball": ("S",),
}


def read_urdf(root: Element, path: Path, loops: Path | None = None) -> Description:
    """Return the robot of a URDF file, with all joint coordinates 0.

    Args:
        root: root element of the file.
        path: path of the file.
        loops: YAML file of loops; None for a file with the same name in the same folder, if there is one.

    Raises:
        InputError: the links are not a tree, or a value is not allowed.
    """
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise InputError(f"{path}: has xacro elements, which are not supported; convert it to plain URDF first")
    if loops is None:
        loops = next((each for each in (path.with_suffix(".yaml"), path.with_suffix(".yml")) if each.is_file()), None)
    return _Reader(root, path, None if loops is None else read_loop_file(loops)).description()


class _Reader:
    """Reader of a URDF file, which walks its tree of links."""

    def __init__(self, root: Element, path: Path, loops: LoopFile | None) -> None:
        self.root, self.source, self.loops = root, str(path), loops
        self.name = root.get("name") or path.stem
        self.links = self._unique(root.findall("link"))
        self.elements = {name_of(each, self.source): each for each in root.findall("joint")}
        self._unique(root.findall("joint"))
        self.bodies: list[Body] = []
        self.joints: list[MechanismJoint] = []
        #: Last elementary joint of each joint, which has the name of the joint.
        self.moved: dict[str, str] = {}

    def _unique(self, elements: Iterable[Element]) -> set[str]:
        """Return the names of elements; raise an error for a duplicate name."""
        names: set[str] = set()
        for each in elements:
            name = name_of(each, self.source)
            if name in names:
                raise InputError(f"{self.source}: has two elements <{each.tag}> with the name {name!r}; rename one")
            names.add(name)
        return names

    def description(self) -> Description:
        """Return the description of the robot."""
        children: dict[str, list[tuple[str, str]]] = {}
        parents: dict[str, str] = {}
        for name, element in self.elements.items():
            where = f"{self.source}: joint {name}"
            parent, child = (link_of(element, tag, self.links, where) for tag in ("parent", "child"))
            if child in parents:
                raise InputError(f"{where}: the link {child!r} is already the child of the joint {parents[child]}")
            parents[child] = name
            children.setdefault(parent, []).append((name, child))
        roots = [
            name
            for name in dict.fromkeys(name_of(e, self.source) for e in self.root.findall("link"))
            if name not in parents
        ]
        if len(roots) != 1:
            fault = "must have exactly one root link (a link that is not the child of a joint)"
            raise InputError(f"{self.source}: {fault}, got {listing(roots[:10])}")
        self.bodies.append(Body(roots[0], "", Frame()))
        waiting = [(roots[0], Frame())]
        while waiting:
            link, place = waiting.pop()
            found = [(child, self._add(name, link, child, place)) for name, child in children.get(link, [])]
            waiting += reversed(found)
        if len(self.bodies) < len(self.links):
            lost = sorted(self.links - {body.name for body in self.bodies})
            raise InputError(
                f"{self.source}: the links {listing(lost[:10])} are in a cycle of joints without connection to the root"
            )
        closures, notes = self._closures()
        couplings = self._couplings()
        return Description(
            name=self.name,
            source=self.source,
            root=roots[0],
            bodies=tuple(self.bodies),
            joints=tuple(self.joints),
            closures=tuple(closures),
            couplings=tuple(couplings),
            offsets={each.name: value for each, value in couplings.items()},
            driven=frozenset(self._driven()),
            notes=tuple(notes),
        )

    def _add(self, name: str, link: str, child: str, place: Frame) -> Frame:
        """Add a joint with its child link, and return the frame of the link."""
        element = self.elements[name]
        where = f"{self.source}: joint {name}"
        kind = element.get("type", "")
        if kind not in _TYPES:
            raise InputError(f'{where}, type = "{kind[:60]}": must be one of {listing(_TYPES)}')
        at = place @ origin_of(element, "origin", where)
        other = self.loops.kinds.get(name, "") if self.loops else ""
        parts = self._parts(element, kind, other, where)
        if not parts:
            self.bodies.append(Body(child, "", at))
        parent = link
        for k, (part, local) in enumerate(parts):
            last = k == len(parts) - 1
            moved = child if last else unique_name(f"{child} behind {name} {k + 1}", self.links)
            part_name = name if last else unique_name(f"{name} {k + 1}", self.elements)
            axis = at.rotation @ local if part in ("R", "P") else np.zeros(3)
            limits = self._limits(element, kind, where) if len(parts) == 1 and part in ("R", "P") else None
            self.joints.append(MechanismJoint(part_name, part, parent, moved, at.position, axis, range=limits))
            self.bodies.append(Body(moved, parent, at))
            parent = moved
        return at

    def _parts(self, element: Element, kind: str, other: str, where: str) -> list[tuple[ElementaryKind, FloatArray]]:
        """Return the kinds of the elementary joints of a joint, each with its axis in the joint's frame.

        Args:
            element: element of the joint.
            kind: type of the joint in the URDF file.
            other: type of the joint in the YAML file, which has priority; empty if not given.
            where: place of the joint, for messages.
        """
        if other == "SPHERICAL":
            return [("S", np.zeros(3))]
        if other == "FIXED":
            return [("weld", np.zeros(3))]
        if other:
            return [("R", np.eye(3)["XYZ".index(letter)]) for letter in other[-2:]]
        parts = _TYPES[kind]
        if kind == "planar":
            normal = axis_of(element, "axis", where)
            across = perpendiculars(normal)
            return [("P", across[0]), ("P", across[1]), ("R", normal)]
        if parts and parts[0] in ("R", "P"):
            return [(parts[0], axis_of(element, "axis", where))]
        return [(each, np.zeros(3)) for each in parts]

    def _limits(self, element: Element, kind: str, where: str) -> tuple[float, float] | None:
        """Return the range of a joint; None without a range."""
        limit = element.find("limit")
        if kind == "continuous" or limit is None or "lower" not in limit.attrib or "upper" not in limit.attrib:
            return None
        place = f"{where}, limit"
        return number_of(limit, "lower", 0.0, place), number_of(limit, "upper", 0.0, place)

    def _closures(self) -> tuple[list[LoopClosure], list[str]]:
        """Return the joints that close loops, and notes about them."""
        places = {body.name: body.place for body in self.bodies}
        links = {name: (name, Frame()) for name in places}
        joints = {joint.name: (joint.outer, Frame()) for joint in self.joints if joint.name not in links}
        taken = {joint.name for joint in self.joints}
        closures = closures_of_elements(self.root, self.links, taken, self.source)
        taken |= {each.name for each in closures}
        if self.loops is not None:
            return [*closures, *closures_of_pairs(self.loops, {**links, **joints})], []
        # A frame is a link that is fixed to its parent.
        fixed = {joint.outer for joint in self.joints if joint.kind == "weld"}
        frames = {name: (name, Frame()) for name in places if name in fixed}
        found, notes = closures_of_frames(frames, sorted(taken), places)
        # The second pair of frames of a hinge is fixed to the same links as the first pair.
        return [*closures, *found], notes

    def _couplings(self) -> dict[Coupling, float]:
        """Return the couplings by ``mimic``, each with its value for all joint coordinates 0."""
        found = {}
        for name, element in self.elements.items():
            mimic = element.find("mimic")
            if mimic is None:
                continue
            place = f"{self.source}: joint {name}, mimic"
            other = mimic.get("joint", "")
            if other not in self.elements or other == name:
                raise InputError(f'{place} = "{other[:60]}": must be the name of another joint')
            factor = number_of(mimic, "multiplier", 1.0, place)
            coupling = Coupling(f"{name} mimic", ((name, 1.0), (other, -factor)))
            found[coupling] = -number_of(mimic, "offset", 0.0, place)
        return found

    def _driven(self) -> set[str]:
        """Return the actuated joints, from the YAML file, or from transmissions and ``ros2_control``."""
        if self.loops is not None and self.loops.driven is not None:
            for name in self.loops.driven:
                if name not in self.elements:
                    raise InputError(f'{self.loops.path}: name_mot = "{name[:60]}": no such joint in the URDF file')
            return set(self.loops.driven)
        named = [each.get("name", "") for each in self.root.iterfind("transmission/joint")]
        named += [
            each.get("name", "")
            for each in self.root.iterfind("ros2_control/joint")
            if each.find("command_interface") is not None
        ]
        return {name for name in named if name in self.elements}

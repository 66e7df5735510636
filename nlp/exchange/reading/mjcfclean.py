"""A MuJoCo model reduced to bodies, joints, sites and equalities, so that no mesh, texture or plugin is needed."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError

#: Elements that remain, by the element that holds them; of a body's children those of ``body``.
_KEPT = {
    "mujoco": ("compiler", "default", "worldbody", "equality"),
    "default": ("default", "joint", "site", "equality"),
    "worldbody": ("body", "frame", "site", "replicate"),
    "body": ("body", "frame", "site", "replicate", "joint", "freejoint"),
    "equality": ("connect", "weld", "joint"),
}
#: Settings of the compiler that change where bodies and joints are.
_COMPILER = ("angle", "eulerseq", "coordinate", "autolimits")
#: Attributes that name something that is left out, or whose length depends on it.
_DROPPED = ("material", "user")
#: Most copies that ``replicate`` may make in all: a robot has dozens of bodies.
_MOST_COPIES = 2000


class CleanModel(NamedTuple):
    """The remaining elements, and what was read from the others.

    Attributes:
        root: elements that MuJoCo compiles without any further file.
        driven: names of the joints that actuators drive, in order.
        notes: sentences about what was left out.
    """

    root: Element
    driven: tuple[str, ...]
    notes: tuple[str, ...]


def clean_model(root: Element, source: str) -> CleanModel:
    """Return a model without what does not matter for its geometry.

    Args:
        root: the model, with its included files.
        source: name of the file, for messages.

    Raises:
        InputError: the model is put together from other models, or copies bodies too often.
    """
    for element in root.iter("attach"):
        fault = f"attaches {element.get('model', 'another model')!r}; write the model as one file first"
        raise InputError(f"{source}: {fault}")
    notes: list[str] = []
    driven = _driven_joints(root, notes)
    for element in root.iter("equality"):
        other = sorted({each.tag for each in element if each.tag not in _KEPT["equality"]})
        notes += [f"equalities of the kind {tag} were left out" for tag in other]
    if any(True for tag in ("composite", "flexcomp", "flex") for _ in root.iter(tag)):
        notes.append("soft bodies were left out")
    result = Element("mujoco", {key: value for key, value in root.attrib.items() if key == "model"})
    _copy_children(root, result, "mujoco", 1, source)
    return CleanModel(result, driven, tuple(dict.fromkeys(notes)))


def _driven_joints(root: Element, notes: list[str]) -> tuple[str, ...]:
    """Return the joints that actuators drive; actuators of anything else become notes."""
    driven: list[str] = []
    for section in root.iter("actuator"):
        for each in section:
            joint = each.get("joint") or each.get("jointinparent")
            if joint:
                driven.append(joint)
            else:
                notes.append(f"the actuator {each.get('name', 'without a name')!r} drives no joint and was left out")
    return tuple(dict.fromkeys(driven))


def _copy_children(given: Element, result: Element, kind: str, copies: int, source: str) -> None:
    """Copy the children that remain."""
    for child in given:
        if child.tag not in _KEPT[kind]:
            continue
        attributes = {key: value for key, value in child.attrib.items() if key not in _DROPPED}
        if child.tag == "compiler":
            attributes = {key: value for key, value in attributes.items() if key in _COMPILER}
        inner_copies = copies
        if child.tag == "replicate":
            count = child.get("count", "1")
            inner_copies = copies * int(count) if count.isdecimal() and len(count) < 9 else _MOST_COPIES + 1
            if inner_copies > _MOST_COPIES:
                raise InputError(f"{source}: replicate count = {count}: at most {_MOST_COPIES} copies in all are read")
        copy = SubElement(result, child.tag, attributes)
        if child.tag == "body":
            # MuJoCo wants a mass of each body that moves; no result here depends on it.
            SubElement(copy, "inertial", {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"})
        if child.tag in ("body", "frame", "replicate"):
            inner = "body" if kind == "body" or child.tag == "body" else "worldbody"
            _copy_children(child, copy, inner, inner_copies, source)
        elif child.tag in _KEPT:
            _copy_children(child, copy, child.tag, copies, source)

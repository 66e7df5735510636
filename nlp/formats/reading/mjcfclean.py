"""The files of a MuJoCo model as one tree of bodies, joints, sites and equalities, which needs no mesh or plugin."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError, nearest
from .xmltext import LARGEST_FILE, read_xml

#: Elements that remain, by the element that holds them; of a body's children those of ``body``.
_KEPT = {
    "mujoco": ("compiler", "default", "worldbody", "tendon", "equality"),
    "default": ("default", "joint", "site", "equality"),
    "worldbody": ("body", "frame", "site", "replicate"),
    "body": ("body", "frame", "site", "replicate", "joint", "freejoint"),
    "tendon": ("fixed",),
    "fixed": ("joint",),
    "equality": ("connect", "weld", "joint", "tendon"),
}
#: Attributes that remain of fixed tendons and of their joints.
_TENDON = {"fixed": ("name",), "joint": ("joint", "coef")}
#: Settings of the compiler that change where bodies and joints are.
_COMPILER = ("angle", "eulerseq", "coordinate", "autolimits")
#: Attributes that name something that is left out, or whose length depends on it.
_DROPPED = ("material", "user")
#: Attributes of a keyframe that say where bodies are.
_KEYFRAME = ("name", "qpos", "mpos", "mquat")
#: What actuators that drive no joint act on, by the attribute that names it.
_TRANSMISSIONS = {
    "tendon": "the tendon",
    "site": "the site",
    "body": "the body",
    "cranksite": "the slider-crank at the site",
}
#: Most copies that ``replicate`` may make in all: a robot has dozens of bodies.
_MOST_COPIES = 2000
#: Deepest chain of files that include each other.
_DEEPEST = 16
#: Most files of one model.
_MOST_FILES = 200
#: Elements whose children stand in the place of an ``include``.
_ROOTS = ("mujoco", "mujocoinclude")


class CleanModel(NamedTuple):
    """The remaining elements, and what was read from the others.

    Attributes:
        root: elements that MuJoCo compiles without any further file.
        driven: names of the joints that actuators drive, in order.
        tendons: names of the fixed tendons that actuators drive, in order.
        keyframes: names of the model's keyframes, or their numbers from 1 on; of these the wanted one alone remains.
        notes: sentences about what was left out.
    """

    root: Element
    driven: tuple[str, ...]
    tendons: tuple[str, ...]
    keyframes: tuple[str, ...]
    notes: tuple[str, ...]


def clean_model(main: Element, path: Path, keyframe: str = "") -> CleanModel:
    """Return a model without what does not matter for its geometry.

    Args:
        main: root of the main file.
        path: of the main file.
        keyframe: name or number of the keyframe that is wanted; empty for none.

    Raises:
        InputError: an included file cannot be read or found, includes itself, or there are too many; the model is put
            together from other models, copies bodies too often, or has no such keyframe.
    """
    root, source = _Files(path).expanded(main, (path,)), str(path)
    for element in root.iter("attach"):
        fault = f"attaches {element.get('model', 'another model')!r}; write the model as one file first"
        raise InputError(f"{source}: {fault}")
    notes: list[str] = []
    fixed = _without_other_tendons(root)
    driven, tendons = _driven(root, fixed, notes)
    for element in root.iter("equality"):
        other = [each for each in element if each.tag not in _KEPT["equality"] or not _ties(each, fixed)]
        notes += [f"the equality {each.get('name', '(unnamed)')} of the kind {each.tag} was left out" for each in other]
        for each in other:
            element.remove(each)
    if any(True for tag in ("composite", "flexcomp", "flex") for _ in root.iter(tag)):
        notes.append("soft bodies were left out")
    result = Element("mujoco", {key: value for key, value in root.attrib.items() if key == "model"})
    _copy_children(root, result, "mujoco", 1, source)
    keys = {key.get("name") or str(k): key for k, key in enumerate(root.iterfind("keyframe/key"), 1)}
    if keyframe:
        if keyframe not in keys:
            hint = nearest(keyframe, list(keys)) if keys else "the model has none"
            raise InputError(f"{source}: --keyframe {keyframe}: no such keyframe; {hint}")
        attributes = {key: value for key, value in keys[keyframe].attrib.items() if key in _KEYFRAME}
        SubElement(SubElement(result, "keyframe"), "key", attributes)
    return CleanModel(result, driven, tendons, tuple(keys), tuple(dict.fromkeys(notes)))


class _Files:
    """The files of one model: how many there are, and how large they are together."""

    def __init__(self, main: Path) -> None:
        self.main, self.files, self.size = main, 0, 0

    def expanded(self, element: Element, chain: tuple[Path, ...]) -> Element:
        """Return an element with the content of included files in the place of each ``include``."""
        result = Element(element.tag, element.attrib)
        result.text = element.text
        for child in element:
            if child.tag == "include":
                result.extend(self._included(child, chain))
            else:
                result.append(self.expanded(child, chain))
        return result

    def _included(self, element: Element, chain: tuple[Path, ...]) -> list[Element]:
        """Return the elements of an included file."""
        name = element.get("file", "")
        if not name:
            raise InputError(f"{chain[-1]}: an include names no file")
        # MuJoCo looks beside the main file; models that are assembled by hand mean the file that includes.
        places = [self.main.parent / name, chain[-1].parent / name]
        path = next((each for each in places if each.is_file()), places[0])
        if any(path.resolve() == each.resolve() for each in chain):
            raise InputError(f"{chain[-1]}: includes {name}, which includes itself")
        if len(chain) > _DEEPEST:
            raise InputError(f"{chain[-1]}: includes {name} more than {_DEEPEST} files deep")
        if not path.is_file():
            raise InputError(f"{chain[-1]}: includes {name}, which cannot be found")
        self.files, self.size = self.files + 1, self.size + path.stat().st_size
        if self.files > _MOST_FILES or self.size > LARGEST_FILE:
            most = f"{_MOST_FILES} files or {LARGEST_FILE // 2**20} MB"
            raise InputError(f"{self.main}: includes more than {most} in all")
        root = read_xml(path)
        if root.tag not in _ROOTS:
            raise InputError(f"{path}: begins with <{root.tag}>; <mujoco> or <mujocoinclude> is needed")
        return list(self.expanded(root, (*chain, path)))


def _without_other_tendons(root: Element) -> set[str]:
    """Remove fixed tendons without a name, or of a joint that the model lacks; return the names of the others."""
    sections = [*root.iter("worldbody")]
    joints = {joint.get("name") for section in sections for joint in section.iter("joint")}
    kept: set[str] = set()
    for section in root.iter("tendon"):
        for each in section.findall("fixed"):
            name = each.get("name", "")
            if name and all(joint.get("joint") in joints for joint in each.iterfind("joint")):
                kept.add(name)
            else:
                section.remove(each)
    return kept


def _ties(equality: Element, fixed: set[str]) -> bool:
    """Return whether an equality is none of tendons, or one of fixed tendons alone."""
    names = [equality.get(key) for key in ("tendon1", "tendon2")]
    return equality.tag != "tendon" or all(name in fixed for name in names if name is not None)


def _driven(root: Element, fixed: set[str], notes: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the joints, and the fixed tendons, that actuators drive; actuators of anything else become notes."""
    driven: list[str] = []
    tendons: list[str] = []
    for section in root.iter("actuator"):
        for each in section:
            joint = each.get("joint") or each.get("jointinparent")
            if joint:
                driven.append(joint)
            elif each.get("tendon") in fixed:
                tendons.append(each.get("tendon", ""))
            else:
                on = next((f"{words} {each.get(key)!r}" for key, words in _TRANSMISSIONS.items() if each.get(key)), "")
                fault = f"acts on {on}, which is not read" if on else "acts on nothing that is read"
                notes.append(
                    f"the actuator {each.get('name', 'without a name')!r} {fault}; --actuated names what it drives"
                )
    return tuple(dict.fromkeys(driven)), tuple(dict.fromkeys(tendons))


def _copy_children(given: Element, result: Element, kind: str, copies: int, source: str) -> None:
    """Copy the children that remain."""
    for child in given:
        if child.tag not in _KEPT[kind]:
            continue
        attributes = {key: value for key, value in child.attrib.items() if key not in _DROPPED}
        if kind in ("tendon", "fixed"):
            attributes = {key: value for key, value in attributes.items() if key in _TENDON[child.tag]}
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

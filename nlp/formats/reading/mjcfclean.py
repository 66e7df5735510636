"""Reduction of a MuJoCo model to bodies, joints, sites and equalities, without meshes, plugins and included files."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from ...errors import InputError, nearest
from .xmltext import LARGEST_FILE, read_xml

#: Elements that are kept, by their parent element.
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
#: Settings of the compiler that affect the poses of bodies and joints.
_COMPILER = ("angle", "eulerseq", "coordinate", "autolimits")
#: Attributes that refer to omitted elements.
_DROPPED = ("material", "user")
#: Attributes of a keyframe that determine the poses of bodies.
_KEYFRAME = ("name", "qpos", "mpos", "mquat")
#: Targets of actuators other than joints, by the attribute with their name.
_TRANSMISSIONS = {
    "tendon": "the tendon",
    "site": "the site",
    "body": "the body",
    "cranksite": "the slider-crank at the site",
}
#: Largest total number of copies by ``replicate``: a robot has dozens of bodies.
_MOST_COPIES = 2000
#: Largest depth of included files.
_DEEPEST = 16
#: Largest number of files of one model.
_MOST_FILES = 200
#: Allowed root elements of included files.
_ROOTS = ("mujoco", "mujocoinclude")


class CleanModel(NamedTuple):
    """MuJoCo model reduced to its geometry.

    Attributes:
        root: root element of a model that MuJoCo compiles without other files, with only the requested keyframe.
        driven: names of the actuated joints, in order.
        tendons: names of the actuated fixed tendons, in order.
        keyframes: names of all keyframes of the model, or their numbers from 1.
        notes: notes about omitted elements.
    """

    root: Element
    driven: tuple[str, ...]
    tendons: tuple[str, ...]
    keyframes: tuple[str, ...]
    notes: tuple[str, ...]


def clean_model(main: Element, path: Path, keyframe: str = "") -> CleanModel:
    """Return a model reduced to its geometry.

    Args:
        main: root element of the main file.
        path: path of the main file.
        keyframe: name or number of the requested keyframe; empty for none.

    Raises:
        InputError: an included file cannot be read, includes itself, or there are too many; the model attaches other
            models, copies bodies too often, or has no such keyframe.
    """
    root, source = _Files(path).expanded(main, (path,)), str(path)
    for element in root.iter("attach"):
        fault = f"attaches {element.get('model', 'another model')!r}, which is not supported"
        raise InputError(f"{source}: {fault}; save the model as a single file first")
    notes: list[str] = []
    fixed = _without_other_tendons(root)
    driven, tendons = _driven(root, fixed, notes)
    for element in root.iter("equality"):
        other = [each for each in element if each.tag not in _KEPT["equality"] or not _is_read(each, fixed)]
        notes += [
            f"equality {each.get('name', '(unnamed)')} was omitted: the kind {each.tag} is not supported"
            for each in other
        ]
        for each in other:
            element.remove(each)
    if any(True for tag in ("composite", "flexcomp", "flex") for _ in root.iter(tag)):
        notes.append("soft bodies were omitted")
    result = Element("mujoco", {key: value for key, value in root.attrib.items() if key == "model"})
    _copy_children(root, result, "mujoco", 1, source)
    keys = {key.get("name") or str(k): key for k, key in enumerate(root.iterfind("keyframe/key"), 1)}
    if keyframe:
        if keyframe not in keys:
            hint = nearest(keyframe, list(keys)) if keys else "the model has no keyframes"
            raise InputError(f"{source}: --keyframe {keyframe}: no such keyframe; {hint}")
        attributes = {key: value for key, value in keys[keyframe].attrib.items() if key in _KEYFRAME}
        SubElement(SubElement(result, "keyframe"), "key", attributes)
    return CleanModel(result, driven, tendons, tuple(keys), tuple(dict.fromkeys(notes)))


class _Files:
    """Included files of one model, with limits on their number and total size."""

    def __init__(self, main: Path) -> None:
        self.main, self.files, self.size = main, 0, 0

    def expanded(self, element: Element, chain: tuple[Path, ...]) -> Element:
        """Return an element with each ``include`` replaced by the content of its file."""
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
            raise InputError(f'{chain[-1]}: <include>: attribute file is missing; write <include file="NAME"/>')
        # MuJoCo searches in the folder of the main file; some models need the folder of the including file.
        places = [self.main.parent / name, chain[-1].parent / name]
        path = next((each for each in places if each.is_file()), places[0])
        if any(path.resolve() == each.resolve() for each in chain):
            raise InputError(f"{chain[-1]}: includes {name}, which includes itself")
        if len(chain) > _DEEPEST:
            raise InputError(f"{chain[-1]}: includes {name} more than {_DEEPEST} files deep")
        if not path.is_file():
            raise InputError(f"{chain[-1]}: includes {name}, which does not exist")
        self.files, self.size = self.files + 1, self.size + path.stat().st_size
        if self.files > _MOST_FILES or self.size > LARGEST_FILE:
            most = f"{_MOST_FILES} files or {LARGEST_FILE // 2**20} MB"
            raise InputError(f"{self.main}: must not include more than {most} in total")
        root = read_xml(path)
        if root.tag not in _ROOTS:
            raise InputError(f"{path}: expected <mujoco> or <mujocoinclude> as root element, got <{root.tag}>")
        return list(self.expanded(root, (*chain, path)))


def _without_other_tendons(root: Element) -> set[str]:
    """Remove fixed tendons without a name, or of a joint that the model lacks; return the names of the kept tendons."""
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


def _is_read(equality: Element, fixed: set[str]) -> bool:
    """Return whether an equality involves no tendons, or fixed tendons only."""
    names = [equality.get(key) for key in ("tendon1", "tendon2")]
    return equality.tag != "tendon" or all(name in fixed for name in names if name is not None)


def _driven(root: Element, fixed: set[str], notes: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the joints, and the fixed tendons, that actuators drive; actuators of other elements become notes."""
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
                fault = f"acts on {on}" if on else "does not act on a joint"
                notes.append(
                    f"actuator {each.get('name', '(unnamed)')!r} was omitted: it {fault}; name a joint by --actuated"
                )
    return tuple(dict.fromkeys(driven)), tuple(dict.fromkeys(tendons))


def _copy_children(given: Element, result: Element, kind: str, copies: int, source: str) -> None:
    """Copy the children that are kept."""
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
                fault = f"must give at most {_MOST_COPIES} copies in total"
                raise InputError(f"{source}: replicate count = {count}: {fault}")
        copy = SubElement(result, child.tag, attributes)
        if child.tag == "body":
            # MuJoCo requires a mass of each moving body; it has no effect here.
            SubElement(copy, "inertial", {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"})
        if child.tag in ("body", "frame", "replicate"):
            inner = "body" if kind == "body" or child.tag == "body" else "worldbody"
            _copy_children(child, copy, inner, inner_copies, source)
        elif child.tag in _KEPT:
            _copy_children(child, copy, child.tag, copies, source)

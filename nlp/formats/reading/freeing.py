"""Conversion of values in a robot file to dimensions, by the name of a joint or of a detected circle or symmetry."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import InputError, nearest
from .symmetry import CircleOffer, FoldOffer, Offers, joints_of, joints_of_limb

#: Largest sine of the angle at which the axis of a slide is parallel to the line between its neighbouring joints.
_ALONG = 1e-9
#: Largest rounding error of a direction's components, which are left out of expressions.
_ROUNDING = 1e-15


def with_dimensions(tables: Mapping[str, Any], wanted: Sequence[str], offers: Offers) -> dict[str, Any]:
    """Return the tables of a robot file with some values converted to dimensions.

    Args:
        tables: tables of the robot file, with numbers only.
        wanted: names of joints for their centres, ``JOINT.axis`` for their axes, and names of detected circles and
            symmetries; each optionally followed by ``=`` and the name of the dimension.
        offers: detected circles and symmetries.

    Raises:
        InputError: a name is unknown, or two names convert the same value.
    """
    found = copy.deepcopy(dict(tables))
    named = [(name.strip(), chosen.strip() or None) for name, _, chosen in (each.partition("=") for each in wanted)]
    fold = offers.fold
    if fold is not None and any(name == fold.name for name, _ in named):
        # Copies are removed first, so that only the remaining limbs get dimensions.
        found = _folded(found, fold)
        named = [each for each in named if each[0] != fold.name]
    slides = _slides(found)
    for name, chosen in named:
        circle = next((each for each in offers.circles if each.name == name), None)
        if circle is not None:
            _free_circle(found, circle, chosen or f"{name}_radius")
        elif name.endswith(".axis"):
            _free_axis(found, name.removesuffix(".axis"), chosen, offers)
        else:
            _free_place(found, name, chosen or name, offers)
    for follow in slides:
        follow()
    return found


def _joint(tables: Mapping[str, Any], name: str, offers: Offers) -> tuple[int, dict[str, Any]]:
    """Return the limb index and the table of a joint.

    Raises:
        InputError: there is no such joint.
    """
    for index, joint in joints_of(tables):
        if joint.get("name") == name:
            return index, joint
    names = [joint["name"] for _, joint in joints_of(tables) if "name" in joint]
    names += [each.name for each in offers.circles] + ([offers.fold.name] if offers.fold else [])
    raise InputError(f"--free {name}: no such joint, circle or symmetry; {nearest(name, names[:40])}")


def _dimension(tables: dict[str, Any], name: str, value: float, kind: str, words: str) -> None:
    """Add a dimension to the tables of a robot file.

    Raises:
        InputError: a dimension with this name exists.
    """
    dimensions = tables.setdefault("dimensions", {})
    if name in dimensions:
        raise InputError(f"--free: the dimension {name} exists already; write NAME=DIMENSION with another name")
    shown = {"typical": value, "kind": kind} if kind != "length" else {"typical": value}
    dimensions[name] = {**shown, "description": words}


def _put(tables: Mapping[str, Any], index: int, joint: dict[str, Any], place: list[Any], name: str) -> None:
    """Replace the centre of a joint by expressions, and the equal centres of other joints of its limb.

    Raises:
        InputError: the centre is a dimension already.
    """
    given = joint["at"]
    if any(isinstance(each, str) for each in given):
        raise InputError(f"--free {name}: the centre of {joint.get('name')} is a dimension already; name it once")
    for other_index, other in joints_of(tables):
        if other_index == index and other["at"] == given and other is not joint:
            other["at"] = list(place)
    joint["at"] = list(place)


def _free_place(tables: dict[str, Any], name: str, chosen: str, offers: Offers) -> None:
    """Convert the coordinates of a joint centre to dimensions."""
    index, joint = _joint(tables, name, offers)
    values = list(joint["at"])
    names = [f"{chosen}_{letter}" for letter in "xyz"]
    _put(tables, index, joint, names, name)
    for each, value, letter in zip(names, values, "xyz", strict=True):
        _dimension(tables, each, value, "length", f"{letter} of {name}")


def _free_axis(tables: dict[str, Any], name: str, chosen: str | None, offers: Offers) -> None:
    """Convert the components of a joint axis to dimensions."""
    _, joint = _joint(tables, name, offers)
    if "axis" not in joint:
        fault = f"the joint is of type {joint['type']}, which has no single axis"
        raise InputError(f"--free {name}.axis: {fault}; name a joint with one axis")
    if any(isinstance(each, str) for each in joint["axis"]):
        raise InputError(f"--free {name}.axis: the axis is a dimension already; name it once")
    names = [f"{chosen or f'{name}_axis'}_{letter}" for letter in "xyz"]
    for each, value, letter in zip(names, joint["axis"], "xyz", strict=True):
        _dimension(tables, each, value, "number", f"{letter} of the axis of {name}")
    joint["axis"] = names


def _free_circle(tables: dict[str, Any], circle: CircleOffer, chosen: str) -> None:
    """Convert the radius of a circle to a dimension; each joint keeps its azimuth and height."""
    by_name = {joint["name"]: (index, joint) for index, joint in joints_of(tables) if "name" in joint}
    for name, point in zip(circle.joints, circle.points, strict=True):
        if name not in by_name:
            continue
        apart = point - circle.centre
        radial = apart - (apart @ circle.axis) * circle.axis
        foot = point - radial
        place = [_sum(float(a), float(b), chosen) for a, b in zip(foot, radial / circle.radius, strict=True)]
        _put(tables, *by_name[name], place, circle.name)
    _dimension(tables, chosen, circle.radius, "length", f"radius of {', '.join(circle.joints)}")


def _sum(value: float, factor: float, name: str) -> str | float:
    """Return ``value + factor*name`` as an expression."""
    if abs(factor) < _ROUNDING:
        return value
    term = f"{abs(factor)!r}*{name}"
    if value == 0:
        return term if factor > 0 else f"-{term}"
    return f"{value!r} {'+' if factor > 0 else '-'} {term}"


def _folded(tables: dict[str, Any], fold: FoldOffer) -> dict[str, Any]:
    """Return tables with only the first limb of each orbit, and copies by ``repeat``."""
    repeat = {"count": fold.count, "axis": fold.axis.tolist(), "through": fold.centre.tolist()}
    limbs = []
    for orbit in fold.orbits:
        first = {key: value for key, value in tables["limb"][orbit[0]].items() if key != "name"}
        limbs.append({"repeat": repeat, **first})
    return {**tables, "limb": limbs}


def _slides(tables: Mapping[str, Any]) -> list[Callable[[], None]]:
    """Return functions that update the axis of each slide along the line between its neighbouring joints."""
    found: list[Callable[[], None]] = []
    for limb in tables.get("limb", []):
        joints = joints_of_limb(limb) if "branch" not in limb else []
        for k, joint in enumerate(joints):
            if joint["type"] != "P" or k + 1 >= len(joints):
                continue
            before = joints[k - 1] if k else joint
            after = joints[k + 1]
            apart = np.array(after["at"], dtype=np.float64) - np.array(before["at"], dtype=np.float64)
            length = float(np.linalg.norm(apart))
            axis = np.array(joint["axis"], dtype=np.float64)
            if length and float(np.linalg.norm(np.cross(axis, apart))) < _ALONG * length:
                ends = (before, after) if axis @ apart > 0 else (after, before)
                found.append(_follower(joint, *ends))
    return found


def _follower(joint: dict[str, Any], start: Mapping[str, Any], end: Mapping[str, Any]) -> Callable[[], None]:
    """Return a function that writes a slide's axis as the difference of two joint centres, if one has dimensions."""

    def follow() -> None:
        if any(isinstance(each, str) for each in (*start["at"], *end["at"])):
            joint["axis"] = [f"({b}) - ({a})" for a, b in zip(start["at"], end["at"], strict=True)]

    return follow

"""Elements of URDF as values: origins, axes, limits and names, each refused with its place where it is wrong."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np

from ....models.arrays import FloatArray
from ...errors import InputError, listing
from ..frames import Frame, rotation_from_roll_pitch_yaw
from .description import LARGEST

#: Shortest vector that is a direction: a shorter one is a zero in decimals.
_SHORTEST = 1e-12


def name_of(element: Element, source: str) -> str:
    """Return the name of an element.

    Raises:
        InputError: it has none.
    """
    name = element.get("name", "")
    if not name:
        raise InputError(f"{source}: a <{element.tag}> has no name")
    return name


def numbers_of(element: Element, key: str, default: str, place: str) -> FloatArray:
    """Return the three numbers of an attribute, (3,).

    Raises:
        InputError: they are not three finite numbers.
    """
    text = element.get(key, default)
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(abs(number) <= LARGEST for number in numbers):
        raise InputError(f'{place}, {key} = "{text[:60]}": must be three finite numbers of {LARGEST:g} or less')
    return np.array(numbers)


def number_of(element: Element, key: str, default: float, place: str) -> float:
    """Return the number of an attribute.

    Raises:
        InputError: it is no finite number.
    """
    text = element.get(key, str(default))
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f'{place}, {key} = "{text[:60]}": must be a finite number')
    return number


def origin_of(element: Element, tag: str, place: str) -> Frame:
    """Return the frame of a child element with ``xyz`` and ``rpy``; the identity where there is none."""
    child = element.find(tag)
    if child is None:
        return Frame()
    where = f"{place}, {tag}"
    angles = numbers_of(child, "rpy", "0 0 0", where)
    return Frame(numbers_of(child, "xyz", "0 0 0", where), rotation_from_roll_pitch_yaw(*angles))


def axis_of(element: Element, tag: str, place: str) -> FloatArray:
    """Return the unit direction (3,) of a child element with ``xyz``; x where there is none, as URDF has it.

    Raises:
        InputError: it is zero.
    """
    child = element.find(tag)
    axis = np.array([1.0, 0.0, 0.0]) if child is None else numbers_of(child, "xyz", "1 0 0", f"{place}, {tag}")
    length = float(np.linalg.norm(axis))
    if length < _SHORTEST:
        raise InputError(f'{place}, {tag} = "0 0 0": must be a direction')
    return axis / length


def link_of(element: Element, tag: str, links: set[str], place: str) -> str:
    """Return the name of the link that a child element means.

    Raises:
        InputError: it is missing, or there is no such link.
    """
    child = element.find(tag)
    name = "" if child is None else child.get("link", "")
    if name not in links:
        shown = listing(sorted(links)[:10])
        raise InputError(f'{place}, {tag} = "{name[:60]}": must be one of the links {shown}')
    return name

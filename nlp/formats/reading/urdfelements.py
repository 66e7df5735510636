"""Values of URDF elements: origins, axes, limits and names, with errors that name the element."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np

from ....models.arrays import FloatArray
from ...errors import InputError, listing
from ..frames import Frame, rotation_from_roll_pitch_yaw
from .description import LARGEST

#: Smallest length of a direction; a shorter vector counts as zero.
_SHORTEST = 1e-12


def name_of(element: Element, source: str) -> str:
    """Return the name of an element.

    Raises:
        InputError: the element has no name.
    """
    name = element.get("name", "")
    if not name:
        raise InputError(f'{source}: an element <{element.tag}> has no attribute name; add name="..."')
    return name


def numbers_of(element: Element, key: str, default: str, place: str) -> FloatArray:
    """Return the three numbers (3,) of an attribute.

    Args:
        element: the element.
        key: name of the attribute.
        default: text of the attribute if it is missing.
        place: place of the element, for messages.

    Raises:
        InputError: the attribute is not three finite numbers.
    """
    text = element.get(key, default)
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(abs(number) <= LARGEST for number in numbers):
        raise InputError(f'{place}, {key} = "{text[:60]}": must be three finite numbers of at most {LARGEST:g}')
    return np.array(numbers)


def number_of(element: Element, key: str, default: float, place: str) -> float:
    """Return the number of an attribute.

    Args:
        element: the element.
        key: name of the attribute.
        default: number of a missing attribute.
        place: place of the element, for messages.

    Raises:
        InputError: the attribute is not a finite number.
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
    """Return the frame of a child element with ``xyz`` and ``rpy``; the identity if it is missing."""
    child = element.find(tag)
    if child is None:
        return Frame()
    where = f"{place}, {tag}"
    angles = numbers_of(child, "rpy", "0 0 0", where)
    return Frame(numbers_of(child, "xyz", "0 0 0", where), rotation_from_roll_pitch_yaw(*angles))


def axis_of(element: Element, tag: str, place: str) -> FloatArray:
    """Return the unit direction (3,) of a child element with ``xyz``; the x axis if it is missing, as in URDF.

    Raises:
        InputError: the direction is zero.
    """
    child = element.find(tag)
    axis = np.array([1.0, 0.0, 0.0]) if child is None else numbers_of(child, "xyz", "1 0 0", f"{place}, {tag}")
    length = float(np.linalg.norm(axis))
    if length < _SHORTEST:
        raise InputError(f'{place}, {tag} = "0 0 0": must be a direction, and not zero')
    return axis / length


def link_of(element: Element, tag: str, links: set[str], place: str) -> str:
    """Return the name of the link in a child element.

    Raises:
        InputError: the child element is missing, or there is no such link.
    """
    child = element.find(tag)
    name = "" if child is None else child.get("link", "")
    if name not in links:
        shown = listing(sorted(links)[:10])
        raise InputError(f'{place}, {tag} = "{name[:60]}": must be one of the links {shown}')
    return name

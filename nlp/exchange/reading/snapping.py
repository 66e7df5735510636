"""Axes that nearly meet, coincide or are parallel, as decimals of a file leave them: found, and moved so that they do.

What a robot can do depends on such relations exactly. Every relation within a tolerance becomes equations in the points
and directions of all axes; Newton's method with least-norm steps finds the nearest joints that satisfy all of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism import Mechanism, MechanismJoint
from ...errors import InputError
from .elements import SAME_POINT
from .frames import cross_matrix
from .meeting import ALMOST, axes_gap

#: Steps of Newton's method, which needs three to five.
_MOST_STEPS = 30
#: Relations hold where no equation, of order 1, is larger: rounding leaves 1e-16.
_HOLDS = 1e-14
#: Relations depend on each other, but for what they are off by: singular values below this many times the tolerance, as a
#: part of the largest one, and below this share in any case, count as zero.
_DEPENDENT = 10.0
_RANK = 1e-6
#: Relations that are off by less, in parts of the size, are meant to be exact: decimals of CAD files are nearer.
_DECIMALS = 1e-5
#: Joints may move this many times farther than the tolerance: beyond it the relations contradict each other.
_FARTHEST = 10.0


class Kind(Enum):
    """A relation of two joints; each value is a clause for people."""

    PARALLEL = "are parallel"
    MEETING = "meet"
    CENTRE = "meet, one of them a ball"
    POINT = "meet, two balls"


class Relation(NamedTuple):
    """A relation of two joints by their numbers, and by how much it is off: a length, or the size times a sine."""

    kind: Kind
    one: int
    other: int
    off: float


def relations_of(joints: Sequence[MechanismJoint], size: float, within: float) -> Iterator[Relation]:
    """Yield the relations of any two joints that are off by less than a length."""
    for j, other in enumerate(joints):
        for i, one in enumerate(joints[:j]):
            kinds = {one.kind, other.kind}
            if kinds == {"S"}:
                found = [(Kind.POINT, float(np.linalg.norm(one.point - other.point)))]
            elif "S" in kinds and kinds & {"R", "H"}:
                ball, hinge = (one, other) if one.kind == "S" else (other, one)
                off = float(np.linalg.norm(np.cross(hinge.axis, ball.point - hinge.point)))
                found = [(Kind.CENTRE, off)]
            elif "S" in kinds or "weld" in kinds:
                continue
            else:
                distance, sine = axes_gap(one, other)
                is_parallel = sine * size < within
                found = [(Kind.PARALLEL, sine * size)] if is_parallel else []
                if "P" not in kinds and (is_parallel or sine >= ALMOST):
                    found.append((Kind.MEETING, distance))
            yield from (Relation(kind, i, j, off) for kind, off in found if off < within)


def near_misses(given: Mechanism, size: float) -> Iterator[str]:
    """Yield a note for each kind of relation that joints of one link nearly have.

    Args:
        given: the mechanism.
        size: of the robot.
    """
    joints = [each for each in given.joints if each.kind != "weld"]
    found: dict[tuple[Kind, bool], list[Relation]] = {}
    for each in relations_of(joints, size, ALMOST * size):
        ends = [{joints[k].inner, joints[k].outer} for k in (each.one, each.other)]
        if each.off >= SAME_POINT * size and ends[0] & ends[1]:
            found.setdefault((each.kind, each.off < _DECIMALS * size), []).append(each)
    for (kind, is_rounding), misses in found.items():
        sizes = sorted(each.off for each in misses)
        first, second = (joints[k].name for k in (misses[0].one, misses[0].other))
        more = f" and {len(misses) - 1} more pairs" if len(misses) > 1 else ""
        by = f"{sizes[0]:.1g}" if len(misses) == 1 else f"{sizes[0]:.1g} to {sizes[-1]:.1g}"
        words = f"the axes of {first} and {second}{more} nearly {kind.value}: off by {by}"
        words += f", {sizes[-1] / size:.1g} of the robot's size, they stay as they are"
        yield f"{words}; --snap {_rounded_up(sizes[-1]):g} makes them exact" if is_rounding else words


def _rounded_up(value: float) -> float:
    """Return the next number above a positive one that has a single digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit * (1 + 1e-9)) * unit


class Snapped(NamedTuple):
    """A mechanism whose axes were moved, and a sentence about it."""

    mechanism: Mechanism
    note: str


def snapped(given: Mechanism, size: float, within: float) -> Snapped:
    """Return a mechanism with the relations that its joints have within a length as exact ones.

    Args:
        given: the mechanism.
        size: of the robot.
        within: largest length by which a relation is off.

    Raises:
        InputError: the relations contradict each other.
    """
    joints = [each for each in given.joints if each.kind != "weld"]
    relations = list(relations_of(joints, size, within))
    points = np.array([each.point for each in joints]) / size
    axes = np.array([each.axis for each in joints])
    rank = max(_RANK, min(_DEPENDENT * within / size, 0.1))
    x = np.stack([points, axes], axis=1)
    for _ in range(_MOST_STEPS):
        values, slopes = _equations(joints, relations, x)
        if float(np.abs(values).max(initial=0.0)) <= _HOLDS:
            break
        x = x - np.linalg.lstsq(slopes, values, rcond=rank)[0].reshape(x.shape)
    way = size * float(np.linalg.norm(x[:, 0] - points, axis=1).max(initial=0.0))
    turn = size * float(np.linalg.norm(x[:, 1] - axes, axis=1).max(initial=0.0))
    if not float(np.abs(values).max(initial=0.0)) <= 10 * _HOLDS or max(way, turn) > _FARTHEST * within:
        fault = "the axes cannot all be made to meet or to be parallel that are so within this length"
        raise InputError(f"--snap {within:g}: {fault}; a smaller length may do")
    moved = iter(x)
    new = []
    for each in given.joints:
        if each.kind == "weld":
            new.append(each)
            continue
        point, axis = next(moved)
        new.append(replace(each, point=size * point, axis=axis / np.linalg.norm(axis) if each.kind != "S" else each.axis))
    count = sum(each.off > SAME_POINT * size for each in relations)
    note = f"{count} relations of axes that were off by up to {within:g} were made exact"
    note += f": joints moved by up to {way:.1g}, their axes turned by up to {turn / size:.1g} rad"
    return Snapped(replace(given, joints=tuple(new)), note)


def _equations(
    joints: Sequence[MechanismJoint], relations: Sequence[Relation], x: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return equations (m,) of relations and unit axes, and their derivatives (m, 6 n) by points and axes (n, 2, 3)."""
    values: list[FloatArray] = []
    rows: list[FloatArray] = []

    def add(value: FloatArray, *slopes: tuple[int, int, FloatArray]) -> None:
        row = np.zeros((len(value), *x.shape))
        for joint, part, slope in slopes:
            row[:, joint, part] += slope
        values.append(value)
        rows.append(row.reshape(len(value), -1))

    for k, joint in enumerate(joints):
        if joint.kind != "S":
            axis = x[k, 1]
            add(np.array([axis @ axis - 1]) / 2, (k, 1, axis[None]))
    for kind, i, j, _ in relations:
        (p, a), (q, b) = x[i], x[j]
        A, B, apart = cross_matrix(a), cross_matrix(b), q - p
        if kind is Kind.POINT:
            add(apart, (i, 0, -np.eye(3)), (j, 0, np.eye(3)))
        elif kind is Kind.PARALLEL:
            add(np.cross(a, b), (i, 1, -B), (j, 1, A))
        elif kind is Kind.CENTRE or np.linalg.norm(np.cross(a, b)) < ALMOST:
            # One axis passes through the other's point; a ball has no axis.
            axis, hinge = (a, i) if joints[i].kind != "S" else (b, j)
            C = cross_matrix(axis)
            add(np.cross(axis, apart), (hinge, 1, -cross_matrix(apart)), (i, 0, -C), (j, 0, C))
        else:
            normal = np.cross(a, b)
            sine = float(np.linalg.norm(normal))
            slopes = (i, 0, -normal[None]), (j, 0, normal[None]), (i, 1, (B @ apart)[None]), (j, 1, -(A @ apart)[None])
            add(np.array([apart @ normal]) / sine, *((k, part, slope / sine) for k, part, slope in slopes))
    return np.concatenate([np.zeros(0), *values]), np.vstack([np.zeros((0, x.size)), *rows])

"""Correction of joint axes that nearly meet, coincide or are parallel, and of hinges that nearly are a parallelogram.

The degrees of freedom of a robot depend on exact relations. Each relation within a tolerance becomes equations in the
points and directions of all axes; Newton's method with least-norm steps finds the nearest joints that satisfy all.
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
from ....models.newton import VectorEquations, newton
from ...errors import InputError
from ..frames import cross_matrix
from .elements import SAME_POINT
from .meeting import ALMOST, axes_gap

#: Largest number of Newton steps, of which three to five are needed.
_MOST_STEPS = 30
#: Largest residual of a satisfied relation: rounding leaves 1e-16.
_HOLDS = 1e-14
#: Relations are dependent up to their errors: relative singular values below this many times the relative tolerance,
#: and at least below ``_RANK``, count as zero.
_DEPENDENT = 10.0
_RANK = 1e-6
#: Error of a relation, relative to the size, below which it is taken for rounding of decimals in CAD files.
_DECIMALS = 1e-5
#: Largest motion of a joint as a multiple of the tolerance: beyond it the relations contradict each other.
_FARTHEST = 3.0


class Kind(Enum):
    """Kinds of relations between two joints; each value is a clause for messages."""

    PARALLEL = "are nearly parallel"
    MEETING = "nearly meet"
    CENTRE = "nearly meet, one of them a ball"
    POINT = "nearly meet, two balls"


class Relation(NamedTuple):
    """Relation between two joints, by their indices, with its error: a length, or the robot's size times a sine."""

    kind: Kind
    one: int
    other: int
    off: float


def relations_of(joints: Sequence[MechanismJoint], size: float, within: float) -> Iterator[Relation]:
    """Yield the relations between all pairs of joints with an error below a length.

    Args:
        joints: joints of the mechanism.
        size: characteristic size of the robot, length.
        within: largest error, length.
    """
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
    """Yield a note for each kind of nearly satisfied relation between joints of one link.

    Args:
        given: the mechanism.
        size: characteristic size of the robot, length.
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
        words = f"the axes of {first} and {second}{more} {kind.value}: off by {by}"
        words += f", {sizes[-1] / size:.1g} of the robot's size; they were not changed"
        yield f"{words}; --snap {_rounded_up(sizes[-1]):g} makes them exact" if is_rounding else words


def _rounded_up(value: float) -> float:
    """Return a positive number rounded up to a single digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit * (1 + 1e-9)) * unit


def _parallelograms(given: Mechanism, joints: Sequence[MechanismJoint], within: float) -> Iterator[tuple[int, ...]]:
    """Yield the indices of four hinges that form a parallelogram up to an error: two of one rod, two of the other."""
    rods: dict[tuple[str, ...], list[tuple[int, int]]] = {}
    for link in given.links:
        hinges = [(k, each) for k, each in enumerate(joints) if link.name in (each.inner, each.outer)]
        if len(hinges) == 2 and all(each.kind == "R" for _, each in hinges):
            ends = sorted((each.outer if each.inner == link.name else each.inner, k) for k, each in hinges)
            rods.setdefault(tuple(name for name, _ in ends), []).append((ends[0][1], ends[1][1]))
    for sides, pairs in rods.items():
        for number, (i, j) in enumerate(pairs):
            for k, m in pairs[:number] if sides[0] != sides[1] else []:
                axis, span, other = joints[i].axis, joints[j].point - joints[i].point, joints[m].point - joints[k].point
                off = [*(span - other), axis @ span, axis @ (joints[k].point - joints[i].point)]
                if np.linalg.norm(off[:3]) < within and max(map(abs, off[3:])) < within < np.linalg.norm(span):
                    yield i, j, k, m


def snapped(given: Mechanism, size: float, within: float) -> tuple[Mechanism, str]:
    """Return a mechanism with all relations within a tolerance satisfied exactly, and a note.

    Args:
        given: the mechanism.
        size: characteristic size of the robot, length.
        within: tolerance, the largest error of a relation that is corrected, length.

    Raises:
        InputError: the relations contradict each other.
    """
    joints = [each for each in given.joints if each.kind != "weld"]
    relations = list(relations_of(joints, size, within))
    parallelograms = list(_parallelograms(given, joints, within))
    points = np.array([each.point for each in joints]) / size
    axes = np.array([each.axis for each in joints])
    rank = max(_RANK, min(_DEPENDENT * within / size, 0.1))
    shape = len(joints), 2, 3
    equations = VectorEquations(lambda z: _equations(joints, relations, parallelograms, z.reshape(shape)), _HOLDS)
    start = np.stack([points, axes], axis=1)
    found = newton(equations, equations.at(start.ravel()), steps=_MOST_STEPS, zeros=[rank])
    x = found.z.reshape(shape)
    way = size * float(np.linalg.norm(x[:, 0] - points, axis=1).max(initial=0.0))
    turn = size * float(np.linalg.norm(x[:, 1] - axes, axis=1).max(initial=0.0))
    if not found.error <= 10 * _HOLDS or max(way, turn) > _FARTHEST * within:
        fault = "not all axes that nearly meet or are nearly parallel can be corrected together"
        raise InputError(f"--snap {within:g}: {fault}; try a smaller length")
    moved = iter(x)
    new = []
    for each in given.joints:
        if each.kind == "weld":
            new.append(each)
            continue
        point, axis = next(moved)
        new.append(
            replace(each, point=size * point, axis=axis / np.linalg.norm(axis) if each.kind != "S" else each.axis)
        )
    count = sum(each.off > SAME_POINT * size for each in relations)
    note = f"{count} relations of axes with errors of up to {within:g} were made exact"
    note += f": joints moved by up to {way:.1g}, axes rotated by up to {turn / size:.1g} rad"
    return replace(given, joints=tuple(new)), note


class _Rows:
    """Equations in the points and axes of joints, x (n, 2, 3), with derivatives."""

    def __init__(self, x: FloatArray) -> None:
        self._shape = x.shape
        self._values: list[FloatArray] = [np.zeros(0)]
        self._slopes: list[FloatArray] = [np.zeros((0, x.size))]

    def add(self, value: FloatArray, *slopes: tuple[int, int, FloatArray]) -> None:
        """Add equations (k,), and derivatives (k, 3) with respect to point (part 0) or axis (part 1) of a joint."""
        row = np.zeros((len(value), *self._shape))
        for joint, part, slope in slopes:
            row[:, joint, part] += slope
        self._values.append(value)
        self._slopes.append(row.reshape(len(value), -1))

    def all(self) -> tuple[FloatArray, FloatArray]:
        """Return equations (m,) and derivatives (m, 6 n)."""
        return np.concatenate(self._values), np.vstack(self._slopes)


def _equations(
    joints: Sequence[MechanismJoint],
    relations: Sequence[Relation],
    parallelograms: Sequence[tuple[int, ...]],
    x: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return equations (m,), and derivatives (m, 6 n) with respect to points and axes (n, 2, 3)."""
    rows = _Rows(x)
    for k, joint in enumerate(joints):
        if joint.kind != "S":
            axis = x[k, 1]
            rows.add(np.array([axis @ axis - 1]) / 2, (k, 1, axis[None]))
    for each in relations:
        _add_relation(rows, each, x, is_ball=joints[each.one].kind == "S")
    for i, j, k, m in parallelograms:
        p, q, r, s = x[[i, j, k, m], 0]
        rows.add(q - p - s + r, *((n, 0, sign * np.eye(3)) for n, sign in ((i, -1), (j, 1), (k, 1), (m, -1))))
        axis = x[i, 1]
        for n, apart in ((j, q - p), (k, r - p)):
            rows.add(np.array([axis @ apart]), (i, 1, apart[None]), (i, 0, -axis[None]), (n, 0, axis[None]))
    return rows.all()


def _add_relation(rows: _Rows, relation: Relation, x: FloatArray, *, is_ball: bool) -> None:
    """Add the equations of a relation; ``is_ball`` is True for a spherical first joint."""
    kind, i, j, _ = relation
    (p, a), (q, b) = x[i], x[j]
    A, B, apart = cross_matrix(a), cross_matrix(b), q - p
    if kind is Kind.POINT:
        rows.add(apart, (i, 0, -np.eye(3)), (j, 0, np.eye(3)))
    elif kind is Kind.PARALLEL:
        rows.add(np.cross(a, b), (i, 1, -B), (j, 1, A))
    elif kind is Kind.CENTRE or np.linalg.norm(np.cross(a, b)) < ALMOST:
        # The axis of one joint passes through the point of the other joint; a spherical joint has no axis.
        axis, hinge = (b, j) if is_ball else (a, i)
        C = cross_matrix(axis)
        rows.add(np.cross(axis, apart), (hinge, 1, -cross_matrix(apart)), (i, 0, -C), (j, 0, C))
    else:
        normal = np.cross(a, b)
        sine = float(np.linalg.norm(normal))
        slopes = (i, 0, -normal[None]), (j, 0, normal[None]), (i, 1, (B @ apart)[None]), (j, 1, -(A @ apart)[None])
        rows.add(np.array([apart @ normal]) / sine, *((k, part, slope / sine) for k, part, slope in slopes))

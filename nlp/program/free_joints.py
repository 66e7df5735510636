"""Driven joints whose positions the pose does not determine: variables of the program, with ranges from their limits.

A limit on the position of one such joint gives the range of its variable, which is a little wider than the limit: a
bound that coincides with a constraint would share its multiplier. A joint without a limit is searched in the range that
the robot gives its unknown.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

from ...models import Dimension, FloatArray, frozen_vector
from ..case.limits.constraint import BoundedConstraint
from ..case.pose import Free
from ..system.jsonvalues import Hidden, JsonObject, Shown
from .nlp import Nlp
from .places import SymbolTable

#: Part of its width by which the range of a variable is wider than the limits of the joint, on each side.
_BEYOND = 0.25


class _Side(NamedTuple):
    """A limit on the position of a joint: its value, whether it is an upper one, and the name of its constraint."""

    value: float
    is_upper: bool
    name: str


class FreeJoint(JsonObject):
    """Position of a driven joint that the pose does not determine, at one pose: a variable of the program.

    Attributes:
        name: of the variable.
        joint: limb and place of the joint.
        kind: ``angle`` or ``length``.
        value: position from home.
        lower: smallest position: of the limits on it, or where there is none, of the search.
        upper: likewise the largest.
        limits: names of the limits on it; empty where it has none.
        lower_is_limit: whether the smallest position is a limit of the case.
        upper_is_limit: whether the largest position is a limit of the case.
        dimension: of the positions, in radians for an angle.
    """

    name: str
    joint: str
    kind: Literal["angle", "length"]
    value: Shown
    lower: Shown
    upper: Shown
    limits: tuple[str, ...]
    lower_is_limit: bool
    upper_is_limit: bool
    dimension: Hidden[Dimension] = Dimension.NUMBER


def free_joints(nlp: Nlp, x: FloatArray) -> Iterator[FreeJoint]:
    """Yield the driven joints whose positions at a point (n,) are variables of a program, pose after pose."""
    program = nlp.program
    if not program.model.free_joints:
        return
    bounded = [
        BoundedConstraint(each, float(low), float(high))
        for each, low, high in zip(program.constraints, nlp.g_lower, nlp.g_upper, strict=True)
    ]
    indices = [k for at_pose in program.places.joints for k in at_pose]
    found = _sides(bounded, [program.x, program.p], nlp.arguments.tolist(), indices)
    for at_pose in program.places.joints:
        for k, joint in zip(at_pose, program.model.free_joints, strict=True):
            lower = [each.value for each in found[k] if not each.is_upper]
            upper = [each.value for each in found[k] if each.is_upper]
            dimension = program.variables[k].dimension
            yield FreeJoint(
                name=program.variables[k].name,
                joint=joint,
                kind="angle" if dimension is Dimension.ANGLE else "length",
                value=float(x[k]),
                lower=max(lower, default=float(nlp.lower[k])),
                upper=min(upper, default=float(nlp.upper[k])),
                limits=tuple(dict.fromkeys(each.name for each in found[k])),
                lower_is_limit=bool(lower),
                upper_is_limit=bool(upper),
                dimension=dimension,
            )


def begun_at(nlp: Nlp, joints: Mapping[str, float]) -> Nlp:
    """Return a program whose start has some positions of free joints, by the names of their variables."""
    start = [joints.get(each.name, value) for each, value in zip(nlp.program.variables, nlp.start, strict=True)]
    return replace(nlp, start=frozen_vector(start))


def set_ranges(table: SymbolTable, indices: Sequence[int], limits: Iterable[BoundedConstraint]) -> None:
    """Set the ranges of the variables of free joints from the limits of a case, each with home as its start.

    Args:
        table: the numbers of the program, of which the ranges are set.
        indices: of the variables.
        limits: of the case.
    """
    found = _sides(list(limits), [table.variables_vector, table.arguments_vector], table.values, indices)
    for k, sides in found.items():
        searched = table.bounds[k]
        lower = max((each.value for each in sides if not each.is_upper), default=None)
        upper = min((each.value for each in sides if each.is_upper), default=None)
        low, high = searched.lower if lower is None else lower, searched.upper if upper is None else upper
        if not low < high:
            # One limit is beyond the range that is searched, or two exclude each other: a search then shows it.
            low, high = min(low, high, searched.lower), max(low, high, searched.upper)
        room = _BEYOND * (high - low)
        first = min(max(0.0, low), high)
        low, high = (low if lower is None else low - room), (high if upper is None else high + room)
        table.bounds[k] = Free(low, high, first)


def _sides(
    limits: Sequence[BoundedConstraint], symbols: Sequence[ca.SX], arguments: Sequence[float], indices: Sequence[int]
) -> Mapping[int, list[_Side]]:
    """Return the limits on each variable that are bounds of a linear function of this variable alone."""
    found: dict[int, list[_Side]] = {k: [] for k in indices}
    if not limits or not indices:
        return found
    x, p = symbols
    hashes = {x[k].element_hash(): k for k in indices}
    variables = {each.element_hash() for each in ca.vertsplit(x)}
    for item in limits:
        expression = item.constraint.expression
        own = {each.element_hash() for each in ca.symvar(expression)} & variables
        if len(own) != 1 or not own <= hashes.keys():
            continue
        k = hashes[own.pop()]
        slope = ca.jacobian(expression, x[k])
        if ca.depends_on(slope, x):
            continue
        offset, per_unit = (float(each) for each in ca.Function("line", [x, p], [expression, slope])(0, arguments))
        for limit, is_upper, key in zip((item.lower, item.upper), (False, True), item.constraint.keys, strict=True):
            if np.isfinite(limit) and per_unit and key:
                found[k].append(_Side((limit - offset) / per_unit, is_upper == (per_unit > 0), item.constraint.name))
    return found

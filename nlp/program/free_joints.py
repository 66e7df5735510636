"""Free actuator coordinates: variables of the program that the pose does not determine, with ranges from limits.

A limit on a free actuator coordinate gives the range of its variable, slightly wider than the limit, because a bound
that coincides with a constraint would share its multiplier. Without a limit, the range is that of the robot's unknown.
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

#: Relative widening of a variable's range on each side of the limits.
_BEYOND = 0.25


class _Side(NamedTuple):
    """Limit on a joint coordinate: value, True for an upper limit, and name of the constraint."""

    value: float
    is_upper: bool
    name: str


class FreeJoint(JsonObject):
    """Free actuator coordinate at one pose: a variable of the program that the pose does not determine.

    Attributes:
        name: name of the variable.
        joint: limb of the joint, and its number in the limb.
        kind: kind of the coordinate: ``angle`` or ``length``.
        value: coordinate, 0 at home.
        lower: smallest coordinate: its lower limit, or the end of the search range without a limit.
        upper: largest coordinate: its upper limit, or the end of the search range without a limit.
        limits: names of the limits on the coordinate; empty without limits.
        lower_is_limit: True if ``lower`` is a limit of the case.
        upper_is_limit: True if ``upper`` is a limit of the case.
        dimension: dimension of the coordinate; angles are in radians.
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
    """Yield the free actuator coordinates at a point (n,) of a program, pose after pose."""
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
    """Return a program whose start has the given free actuator coordinates, by the names of their variables."""
    start = [joints.get(each.name, value) for each, value in zip(nlp.program.variables, nlp.start, strict=True)]
    return replace(nlp, start=frozen_vector(start))


def set_ranges(table: SymbolTable, indices: Sequence[int], limits: Iterable[BoundedConstraint]) -> None:
    """Set the ranges of free actuator coordinates from the limits of a case, each with home as its start.

    Args:
        table: symbols of the program with the ranges to set.
        indices: indices of the variables.
        limits: limits of the case.
    """
    found = _sides(list(limits), [table.variables_vector, table.arguments_vector], table.values, indices)
    for k, sides in found.items():
        searched = table.bounds[k]
        lower = max((each.value for each in sides if not each.is_upper), default=None)
        upper = min((each.value for each in sides if each.is_upper), default=None)
        low, high = searched.lower if lower is None else lower, searched.upper if upper is None else upper
        if not low < high:
            # A limit lies outside the search range, or two limits exclude each other: a search then shows it.
            low, high = min(low, high, searched.lower), max(low, high, searched.upper)
        room = _BEYOND * (high - low)
        first = min(max(0.0, low), high)
        low, high = (low if lower is None else low - room), (high if upper is None else high + room)
        table.bounds[k] = Free(low, high, first)


def _sides(
    limits: Sequence[BoundedConstraint], symbols: Sequence[ca.SX], arguments: Sequence[float], indices: Sequence[int]
) -> Mapping[int, list[_Side]]:
    """Return the limits on each variable that bound a linear function of this variable only."""
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

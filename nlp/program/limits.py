"""Limits of a case as constraints of its program."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, RobotInstance
from ...models.instance import length_of
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, PairFamily
from ..case.limits.limit import Design, Limit, Plate, PlateJoint, PosedRobot
from ..errors import CaseError
from .places import SymbolTable
from .repeated import without_repeated

#: Largest number of values for which every pair is a constraint from the start: 3 poses have 6 pairs. With 4, choosing
#: pairs already halves the time.
_ALL_PAIRS = 3
#: Relative tolerance on a limit that involves only fixed parameters. A proof allows more, so that an evaluation at a
#: pose that refutes a claim shows the violated limit too.
_ROUNDING = 1e-10
#: Absolute tolerance on such a limit near 0, relative to the robot's size: parameters are written with a dozen digits.
_WRITTEN = 1e-11


class NamedSymbols(NamedTuple):
    """Parameters of a case by name, for limits: of the whole case, or of one task whose values are its own.

    Attributes:
        case: the case, or the case of the task.
        symbols: symbols of its parameters by name, radians for angles.
        poses: indices of its poses.
        task: name of the task; empty for the whole case.
    """

    case: Case
    symbols: Mapping[str, SX]
    poses: Sequence[int]
    task: str = ""


class LimitConstraints(NamedTuple):
    """Limits of a case as constraints.

    Attributes:
        varying: limits that depend on the variables, and violated limits of fixed parameters.
        constant: satisfied limits of fixed parameters only.
        families: limits on many pairs of values; the constraints on these pairs are not in ``varying``.
        fixed_families: families of fixed values; the tightest pair of each is in ``varying`` or ``constant``.
    """

    varying: tuple[BoundedConstraint, ...]
    constant: tuple[BoundedConstraint, ...]
    families: tuple[PairFamily, ...] = ()
    fixed_families: tuple[PairFamily, ...] = ()


def limit_constraints(
    case: Case, robots: Sequence[RobotInstance], named: Sequence[NamedSymbols], table: SymbolTable
) -> LimitConstraints:
    """Return the limits of a case as constraints, without repetitions.

    Args:
        case: the case.
        robots: the robot at each pose.
        named: symbols of the case's parameters by name; for each task, if these change from task to task.
        table: symbols of the variables and arguments.

    Raises:
        CaseError: a limit of fixed parameters only has no finite value, or a limit on speeds has no motion.
    """
    if not case.limits:
        return LimitConstraints((), ())
    case.require_motion()
    x, p = table.variables_vector, table.arguments_vector
    few, deferred, fixed = _sorted_families(list(_families(case, robots, named[0].symbols)), table)
    limits = without_repeated(list(_constraints(case, robots, named, few)), x, p)
    if not limits:
        return LimitConstraints((), (), deferred, fixed)
    expressions = ca.vertcat(*[item.constraint.expression for item in limits])
    free = ca.which_depends(expressions, x, 1, True) if table.bounds else [False] * len(limits)
    values = ca.Function("limits", [x, p], [ca.densify(expressions)])(0, table.values).full().ravel()
    size = length_of(case.model, robots[0].reference or ())
    varying: list[BoundedConstraint] = []
    constant: list[BoundedConstraint] = []
    for item, varies, value in zip(limits, free, values, strict=True):
        estimated = item.constraint.spectral is not None and not varies
        number = value
        if estimated:
            measured = item.constraint.measured_at((x, p), (0.0, table.values))
            number = float(item.constraint.reading.to_value(SX(measured)))
        least = _WRITTEN * _size_of(item, size)
        low, high = (max(_ROUNDING * abs(end), least) for end in (item.lower, item.upper))
        holds = item.lower - low <= number <= item.upper + high
        if holds and not varies and not math.isfinite(value):
            # An infinite value exceeds every bound.
            key = next(filter(None, item.constraint.keys))
            raise CaseError(f"limits.{key}", f"has no finite value: {item.constraint.name}", source=case.source)
        (constant if holds and not varies else varying).append(item)
    return LimitConstraints(tuple(varying), tuple(constant), deferred, fixed)


def _size_of(item: BoundedConstraint, length: float) -> float:
    """Return the typical magnitude of a limited quantity; 0 if unknown.

    Args:
        item: the limit.
        length: characteristic size of the robot.
    """
    reading = item.constraint.reading
    if reading.dimension is Dimension.LENGTH:
        return float(length**reading.power)
    return 1.0 if reading.dimension in (Dimension.ANGLE, Dimension.NUMBER) or not reading.power else 0.0


def _sorted_families(
    families: Sequence[PairFamily], table: SymbolTable
) -> tuple[list[tuple[BoundedConstraint, ...]], tuple[PairFamily, ...], tuple[PairFamily, ...]]:
    """Divide the limits on pairs: constraints from the start, families with pairs added on demand, and fixed families.

    Constraints from the start are all pairs of small families, and the tightest pair of each fixed family.
    """
    x, p = table.variables_vector, table.arguments_vector
    pairs: list[tuple[BoundedConstraint, ...]] = []
    deferred: list[PairFamily] = []
    fixed: list[PairFamily] = []
    for family in families:
        count = int(family.values.numel())
        if count <= _ALL_PAIRS:
            pairs += [family.pair(a, b) for a, b in itertools.permutations(range(count), 2)]
        elif table.bounds and any(ca.which_depends(family.values, x, 1, True)):
            deferred.append(family)
        else:
            function = ca.Function("values", [x, p], [ca.densify(family.values)])
            order = np.argsort(function(0, table.values).full().ravel(), kind="stable")
            pairs.append(family.pair(int(order[0]), int(order[-1])))
            fixed.append(family)
    return pairs, tuple(deferred), tuple(fixed)


def _families(case: Case, robots: Sequence[RobotInstance], named: Mapping[str, SX]) -> Iterator[PairFamily]:
    design = Design(case.as_limited, tuple(robots), named)
    for limit in sorted(case.limits, key=attrgetter("order")):
        yield from limit.on_pairs(design)


def _constraints(
    case: Case,
    robots: Sequence[RobotInstance],
    named: Sequence[NamedSymbols],
    pairs: Sequence[tuple[BoundedConstraint, ...]],
) -> Iterator[BoundedConstraint]:
    """Yield the constraints of every limit: on both plates, on the whole design, on few pairs, then on each pose."""
    limits = sorted(case.limits, key=attrgetter("order"))
    for part in named:
        for item in _of_design(part, robots, limits):
            if part.task and _is_of_task(item, part, named):
                yield replace(
                    item, constraint=replace(item.constraint, name=f"{item.constraint.name} task {part.task}")
                )
            elif part is named[0]:
                yield item
    for pair in pairs:
        yield from pair
    for part in named:
        for k in part.poses:
            robot = robots[k]
            tasks = tuple(task.name for task in part.case.tasks[: robot.rates.shape[1]])
            pose = PosedRobot(case.model, robot, tasks, f" pose {k + 1}" if len(robots) > 1 else "", case.loading)
            for limit in limits:
                for item in limit.at_pose(pose):
                    yield replace(item, constraint=replace(item.constraint, pose=k))


def _of_design(
    part: NamedSymbols, robots: Sequence[RobotInstance], limits: Sequence[Limit[Any]]
) -> Iterator[BoundedConstraint]:
    """Yield the constraints on both plates, then on the whole design, with the parameters of a case or of a task."""
    own = [robots[k] for k in part.poses]
    others = [robot for k, robot in enumerate(robots) if k not in part.poses]
    legs = own[0].legs
    base = Plate("base", tuple(PlateJoint(leg.name, leg.base) for leg in legs))
    platform = Plate("platform", tuple(PlateJoint(leg.name, leg.platform) for leg in legs))
    design = Design(part.case.as_limited, (*own, *others), part.symbols)
    for plate in (base, platform):
        for limit in limits:
            yield from limit.on_plate(plate)
    for limit in limits:
        yield from limit.of_design(design)


def _is_of_task(item: BoundedConstraint, part: NamedSymbols, named: Sequence[NamedSymbols]) -> bool:
    """Return whether a constraint depends on a parameter that other tasks do not share."""
    shared = {symbol.element_hash() for other in named if other is not part for symbol in other.symbols.values()}
    own = [symbol for symbol in part.symbols.values() if symbol.element_hash() not in shared]
    return bool(own) and bool(ca.depends_on(item.constraint.expression, ca.vertcat(*own)))

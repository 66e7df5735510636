"""Goals of a front, such as ``max F:NAME`` and ``min limits.KEY``, and programs of the epsilon-constraint method.

Each program optimises one goal within bounds on the other goals.

Source of the method: Y. Y. Haimes, L. S. Lasdon and D. A. Wismer, On a bicriterion formulation of the problems of
integrated system identification and system optimization, IEEE Trans. Syst. Man Cybern. 1 (1971) 296-297.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading, in_parts
from ..case.pose import Free, OverPoses
from ..case.task import Sense
from ..errors import InputError, listing, nearest
from ..program.epigraph import F_of_tasks, total_over_poses
from ..program.formulation import formulate
from ..program.layout import Layout, assemble, lay_out
from ..program.nlp import Nlp

_TASK, _LIMIT = "F:", "limits."
#: Largest number of goals: more goals have too many boxes, and a front that is hard to read.
MOST = 6


@dataclass(frozen=True)
class Goal:
    """Goal of a front: F of a task, or the value of a limit.

    Attributes:
        sense: maximisation or minimisation.
        label: text of the goal without the sense, such as ``F:drive``.
        task: index of the task; None for a limit.
        key: dotted key below ``limits``; empty for a task.
    """

    sense: Sense
    label: str
    task: int | None = None
    key: str = ""

    @property
    def sign(self) -> float:
        """Factor that turns the goal into a cost to be minimised."""
        return -self.sense.sign


def read_goals(texts: Sequence[str], case: Case) -> tuple[Goal, ...]:
    """Return the goals of a case; ``F`` without a name is F of the only task.

    Raises:
        InputError: a text is not a goal of the case, or there are fewer than two different goals or more than ``MOST``.
    """
    goals = tuple(_read_goal(text, case) for text in texts)
    if not 2 <= len(goals) <= MOST:
        verb = "is" if len(goals) == 1 else "are"
        raise InputError(f"--goal: a front has 2 to {MOST} goals, and {len(goals)} {verb} given")
    labels = [goal.label for goal in goals]
    twice = next((label for k, label in enumerate(labels) if label in labels[:k]), None)
    if twice is not None:
        raise InputError(f"--goal: {twice} is given twice")
    return goals


def _read_goal(text: str, case: Case) -> Goal:
    """Return one goal; errors as for :func:`read_goals`."""
    word, _, rest = text.strip().partition(" ")
    label = rest.strip()
    if word not in ("max", "min") or not (label == "F" or label.startswith((_TASK, _LIMIT))):
        raise InputError(f"--goal {text!r}: must be 'max F:TASK', 'min F:TASK', 'min limits.KEY' or 'max limits.KEY'")
    sense = Sense(word)
    if label.startswith(_LIMIT):
        return Goal(sense, label, key=label.removeprefix(_LIMIT))
    if case.tasks[0].measure:
        raise InputError(f"--goal {text!r}: F is not the objective; the case optimises {case.tasks[0].measure}")
    names = [task.name for task in case.tasks]
    name = label.removeprefix(_TASK) if label != "F" else (names[0] if len(names) == 1 else "")
    if name not in names:
        raise InputError(f"--goal {text!r}: the case has no such task; {nearest(name, names)}")
    if names.count(name) > 1:
        raise InputError(f"--goal {text!r}: several tasks have this name; tasks: {listing(names)}")
    return Goal(sense, f"{_TASK}{name}", task=names.index(name))


@dataclass(frozen=True, eq=False)
class GoalProgram:
    """Program of a front.

    Attributes:
        nlp: nonlinear program; the value of an optimised limit is its last variable, in the case's unit.
        optimised: index of the optimised goal.
        values: function from ``(x, p)`` to the expressions of each goal, (k, 1); for a limit, of its constraints.
        readings: conversions of these expressions to readable values, for each goal.
        goals: all goals.
    """

    nlp: Nlp
    optimised: int
    values: ca.Function
    readings: tuple[tuple[Reading, ...], ...]
    goals: tuple[Goal, ...]

    def measure(self, x: FloatArray) -> FloatArray:
        """Return the goals (k,) at a point (n,), lengths in the case's unit and angles in radians."""
        found = self.values(x, self.nlp.arguments)
        values = []
        for goal, raw, readings in zip(self.goals, found, self.readings, strict=True):
            each = [r.from_value(float(v)) for r, v in zip(readings, raw.full().ravel(), strict=True)]
            # The value of a limit is the worst value of its constraints.
            values.append(each[0] if goal.task is not None else max(each) if goal.sense is Sense.MIN else min(each))
        return np.array(values)


def loosest_numbers(case: Case, goals: Sequence[Goal]) -> FloatArray:
    """Return the worst value (k,) of each goal in the case: the value of a limit; NaN for F.

    Limits that cannot be goals are refused.

    Raises:
        InputError: a limit is not in the case or cannot be a goal, or the case has the worst F of several poses.
    """
    if case.over_poses is OverPoses.WORST and case.poses_per_task > 1:
        raise InputError("pareto: combine.over_poses = 'worst' is not supported; use 'sum' or 'mean'")
    layout = lay_out(case, case.tasks)
    found = []
    for goal in goals:
        least, most = (math.nan, math.nan) if goal.task is not None else _range(layout, goal)
        found.append(most if goal.sense is Sense.MIN else least)
    return np.array(found)


def program_of(case: Case, goals: tuple[Goal, ...], optimised: int, bounds: Sequence[float | None]) -> GoalProgram:
    """Return the program that optimises one goal.

    Args:
        case: case of the front; its limits apply too.
        goals: all goals.
        optimised: index of the optimised goal.
        bounds: bound on each goal; None for no bound, and for the optimised goal.

    Raises:
        CaseError: the case contradicts itself.
        InputError: a limit is not in the case or cannot be a goal.
    """
    best = goals[optimised]
    # Without a goal F, one task remains, because a layout needs the rates of a task.
    tasks = [goal.task for goal in (best, *goals) if goal.task is not None] or [0]
    tasks = list(range(len(case.tasks))) if case.changes else list(dict.fromkeys(tasks))
    layout = lay_out(case, [case.tasks[task] for task in tasks])
    added: list[BoundedConstraint] = []
    for goal, bound in zip(goals, bounds, strict=True):
        if bound is not None and goal.task is not None:
            # Scaled to order 1, like constraints that are not limits of the case.
            part = 1 / formulate(case, goal.task).objective_scale
            F = part * _total(layout, tasks.index(goal.task))
            sides = (part * bound, math.inf) if goal.sense is Sense.MAX else (-math.inf, part * bound)
            added.append(BoundedConstraint(Constraint(f"F of {goal.label[2:]}", F, in_parts(part)), *sides))
        if bound is not None and goal.task is None:
            layout = replace(layout, constraints=tuple(_moved(item, goal, bound) for item in layout.constraints))
    raw, readings = zip(*[_raw(layout, goal, tasks) for goal in goals], strict=True)
    if best.task is not None:
        objective, size = _total(layout, tasks.index(best.task)), formulate(case, best.task).objective_scale
    else:
        least, most = _range(layout, best)
        # In the case's unit, like all objectives, and so are its bounds and multipliers.
        unit = case.units.to_internal(1.0, readings[optimised][0].dimension)
        level = layout.table.add(best.label, Dimension.NUMBER, Free(least / unit, most / unit)).symbols
        layout = replace(
            layout,
            constraints=tuple(
                each for item in layout.constraints for each in _below(item, best, unit * level, (least, most))
            ),
        )
        objective, size = level, (most - least) / unit
    nlp = replace(assemble(layout, objective, best.sense, added), size=size)
    values = ca.Function("goals", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in raw])
    return GoalProgram(nlp, optimised, values, readings, goals)


def _total(layout: Layout, task: int) -> SX:
    """Return F of a task of a layout over all poses."""
    return total_over_poses(ca.horzsplit(F_of_tasks(layout)[task, :]), layout.case.over_poses)


def _raw(layout: Layout, goal: Goal, tasks: Sequence[int]) -> tuple[SX, tuple[Reading, ...]]:
    """Return the stacked expressions of a goal, and their readings."""
    if goal.task is not None:
        return _total(layout, tasks.index(goal.task)), (Reading(Dimension.NUMBER),)
    found = [item.constraint for item in layout.constraints if _is_of(item, goal)]
    return ca.vertcat(*[each.expression for each in found]), tuple(each.reading for each in found)


def _is_of(item: BoundedConstraint, goal: Goal) -> bool:
    """Return whether a constraint belongs to a goal's limit: an upper one for a minimum, a lower one for a maximum."""
    return item.constraint.keys[int(goal.sense is Sense.MIN)] == goal.key


def _range(layout: Layout, goal: Goal) -> tuple[float, float]:
    """Return the smallest and the largest value of a limit; the value of the case is the loosest.

    Raises:
        InputError: the case has no such limit, or its value is unbounded in the goal's direction.
    """
    found = [item for item in layout.constraints if _is_of(item, goal)]
    if not found:
        side = int(goal.sense is Sense.MIN)
        keys = sorted({item.constraint.keys[side] for item in layout.constraints} - {""})
        fault = f"the case has no such limit that can be {'minimised' if side else 'maximised'}"
        raise InputError(f"--goal {goal.sense.value} {goal.label}: {fault}; allowed: {listing(keys)}")
    reading = found[0].constraint.reading
    if any(item.constraint.exact is not None or item.constraint.measure is not None for item in found):
        raise InputError(
            f"--goal {goal.label}: cannot be a goal: the nonlinear program has only a smooth approximation of it"
        )
    if goal.sense is Sense.MIN:
        least, most = reading.above, min(reading.from_value(item.upper) for item in found)
    else:
        least, most = max(reading.from_value(item.lower) for item in found), reading.most
        upper = [reading.from_value(item.upper) for item in found if math.isfinite(item.upper)]
        most = min([most, *upper])
    if not (math.isfinite(least) and math.isfinite(most) and least < most):
        raise InputError(
            f"--goal {goal.label}: the range of this goal is infinite; set both .min and .max of the limit"
        )
    return least, most


def _moved(item: BoundedConstraint, goal: Goal, bound: float) -> BoundedConstraint:
    """Return a constraint; if it belongs to the limit of a goal, its bound is the value of the goal."""
    if not _is_of(item, goal):
        return item
    value = float(item.constraint.reading.to_value(SX(bound)))
    return replace(item, upper=value) if goal.sense is Sense.MIN else replace(item, lower=value)


def _below(item: BoundedConstraint, goal: Goal, level: SX, ends: tuple[float, float]) -> tuple[BoundedConstraint, ...]:
    """Return a constraint of a goal's limit with a variable as its bound, and its other side."""
    if not _is_of(item, goal):
        return (item,)
    constraint, is_upper = item.constraint, goal.sense is Sense.MIN
    least, most = (float(constraint.reading.to_value(SX(end))) for end in ends)
    # Scaled to order 1: a bound of 0 does not give the size of an expression such as a squared length.
    expression = (constraint.expression - constraint.reading.to_value(level)) / (most - least)
    plain = Constraint(constraint.name, expression, Reading(Dimension.NUMBER), pose=constraint.pose)
    moved = BoundedConstraint(plain, -math.inf, 0.0) if is_upper else BoundedConstraint(plain, 0.0, math.inf)
    rest = replace(item, upper=math.inf) if is_upper else replace(item, lower=-math.inf)
    return (moved, rest) if math.isfinite(rest.lower) or math.isfinite(rest.upper) else (moved,)

"""One robot of a comparison with its answer: its freedom for the tasks, the rates of its actuators, its strokes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...models import Dimension
from ..case.task import Sense
from ..evidence.mobility import Mobility, mobility_of
from ..evidence.state import evaluate
from ..proof.certificate.certificate import Certificate
from ..proof.workspace.judgement import Judgement
from ..proof.workspace.verdict import Outcome
from ..solver.certified import Certified
from ..solver.solution import Solution, TaskOutcome
from .robots import Contender, Placed


class Rate(NamedTuple):
    """The rate of an actuator for a task.

    Attributes:
        actuator: name of the actuator, or of the leg that is driven along its axis.
        dimension: of its coordinate.
        value: rate, radians or length per unit of the task's motion; infinite where it cannot drive the platform, and
            not a number where the motion does not determine it.
    """

    actuator: str
    dimension: Dimension
    value: float


class Stroke(NamedTuple):
    """A stroke: a length, or radians."""

    value: float
    dimension: Dimension


class TaskFit(NamedTuple):
    """A task at a robot's design, at the first pose.

    Attributes:
        name: of the task.
        F: objective; None without an answer.
        can_move: whether the platform can make the motion with free actuators; None where it is not known.
        constraint: part of F that constraints carry, 0 to 1: the platform cannot make the motion where it is above 0;
            None where it is not known.
        rates: of the actuators; empty where the robot's actuators are not known.
    """

    name: str
    F: float | None
    can_move: bool | None
    constraint: float | None
    rates: tuple[Rate, ...]

    @property
    def largest_rate(self) -> Rate | None:
        """The rate that is largest in size, one that is no number first; None where no rate is known."""
        return max(self.rates, key=lambda each: (math.isnan(each.value), abs(each.value)), default=None)


@dataclass(frozen=True, eq=False)
class Entry:
    """A robot of a comparison.

    Attributes:
        contender: the robot.
        factor: by which its typical lengths are multiplied.
        size: at home with typical dimensions times the factor, length.
        final_size: at the design, length; None without an answer.
        placed: the case with this robot; None where the case contradicts itself with it.
        solution: None where the case contradicts itself with this robot.
        freedoms: of the platform at the first pose; those of almost all poses without an answer; None where they are
            not known.
        tasks: each task at the design; empty without an answer.
        singularities: clauses about the design.
        fault: sentence of the reason why there is no solution; else empty.
        certified: certificates; None where none were asked for, or they are refused.
        certificate_fault: sentence of the reason why there is no certificate; else empty.
        judgement: of the design over the workspace; None where the case has none, or it is not judged.
        outcome: verdict on the workspace: regular poses and limits; None where it is not judged.
        workspace_fault: sentence of the reason why it is not judged; else empty.
        seconds: wall time.
        strokes: largest stroke by measure: over the workspace from proven bounds, else over several poses.
    """

    contender: Contender
    factor: float
    size: float
    final_size: float | None = None
    placed: Placed | None = None
    solution: Solution | None = None
    freedoms: int | None = None
    tasks: tuple[TaskFit, ...] = ()
    singularities: tuple[str, ...] = ()
    fault: str = ""
    certified: Certified | None = None
    certificate_fault: str = ""
    judgement: Judgement | None = None
    outcome: Outcome | None = None
    workspace_fault: str = ""
    seconds: float = 0.0
    strokes: Mapping[str, Stroke] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def has_answer(self) -> bool:
        """Whether the solve gave an answer."""
        return self.solution is not None and self.solution.status.is_answer

    @property
    def keeps_limits(self) -> bool:
        """Whether an answer keeps every limit of the case: the robot can have them all."""
        return self.placed is not None and not self.placed.left_out

    @property
    def can_move(self) -> bool | None:
        """Whether the platform can make every task's motion; None where that is not known."""
        if not self.tasks:
            return None
        known = [task.can_move for task in self.tasks]
        return False if False in known else None if None in known else True

    @property
    def value(self) -> float | None:
        """F of one task, or the value of the combination of several; None without one."""
        if self.solution is None or not self.has_answer:
            return None
        combination = self.solution.combination
        found = self.solution.F if combination is None else combination.value
        return found if found is not None and math.isfinite(found) else None

    @property
    def sense(self) -> Sense:
        """Whether the value is maximised or minimised."""
        if self.solution is None or self.solution.decided_by is None:
            return Sense.MAX
        return self.solution.decided_by.nlp.sense

    @property
    def certificate(self) -> Certificate | None:
        """Certificate of the program that decides; None without one."""
        return None if self.certified is None else self.certified.certificate


def generic_freedoms(contender: Contender) -> int | None:
    """Return the freedoms of a robot's platform at almost all poses; None where the model does not tell them.

    A robot given by its rows tells them where each row is that of a driven leg.
    """
    model = contender.model
    if model.generic is not None:
        return 6 - model.generic.constraints
    return 6 if _is_legs(contender) else None


def _is_legs(contender: Contender) -> bool:
    """Return whether each row of a robot given by its rows is the force of a leg that is driven along its axis."""
    model = contender.model
    return not model.has_couples and 0 < len(model.legs) == len(model.wrenches) and not model.members


def task_fit(contender: Contender, outcome: TaskOutcome) -> tuple[TaskFit, Mobility | None]:
    """Return a task at a robot's design, and the robot's mobility there; no mobility for one given by its rows.

    Args:
        contender: the robot.
        outcome: of the task, whose robot exists at the design.
    """
    nlp, x, state = outcome.own.nlp, outcome.x, outcome.state
    if state is None:
        return TaskFit(outcome.task.name, None, None, None, ()), None
    found = mobility_of(nlp, x, state)
    if found is not None:
        kinds = {each.name: each.dimension for each in contender.model.actuators}
        rates = tuple(Rate(name, kinds[name], value) for name, value in found.actuator_rates.items())
        return TaskFit(outcome.task.name, outcome.F, found.constrained == 0, found.constrained, rates), found
    if not _is_legs(contender):
        return TaskFit(outcome.task.name, outcome.F, None, None, ()), None
    names = [row.limb for row in contender.model.rows]
    rates = tuple(Rate(name, Dimension.LENGTH, float(value)) for name, value in zip(names, state.rates, strict=True))
    return TaskFit(outcome.task.name, outcome.F, True, 0.0, rates), None


def driven_wrenches(contender: Contender) -> int:
    """Return the number of terms of F in a motion that a robot can make: wrenches that its actuators work in."""
    model = contender.model
    if not model.structure:
        return len(model.rows)
    return sum(path.wrenches - path.constraints for path in model.structure)


def outcome_of(judgement: Judgement) -> Outcome:
    """Return the verdict on a design over its workspace."""
    if judgement.is_refuted:
        return Outcome.REFUTED
    return Outcome.PROVED if judgement.is_proved else Outcome.OPEN


def strokes_over_poses(contender: Contender, outcome: TaskOutcome, quantities: tuple[str, ...]) -> dict[str, Stroke]:
    """Return the largest stroke of each measure over the poses of a case; none for a single pose.

    Args:
        contender: the robot.
        outcome: of a task, whose robot exists at the design.
        quantities: names of the measures.
    """
    nlp = outcome.own.nlp
    count = len(nlp.program.robots)
    if count == 1:
        return {}
    states = [evaluate(nlp, outcome.x, pose) for pose in range(count)]
    dimensions = {each.name: each.dimension for each in contender.model.quantities}
    return {
        name: Stroke(float(np.ptp([state.quantities[name] for state in states], axis=0).max()), dimensions[name])
        for name in quantities
    }


def proven_strokes(judgement: Judgement, quantities: tuple[str, ...]) -> Mapping[str, Stroke]:
    """Return the largest stroke of each measure over a workspace, from proven bounds only.

    Args:
        judgement: of the design.
        quantities: names of the measures.
    """
    ends: dict[str, dict[Sense, float]] = {}
    dimensions: dict[str, Dimension] = {}
    for each in judgement.extremes:
        measure = next((name for name in quantities if each.name.startswith(f"{name} limb ")), None)
        if measure is not None and np.isfinite(each.bound):
            ends.setdefault(each.name, {})[each.sense] = each.bound
            dimensions[each.name] = each.dimension
    found: dict[str, Stroke] = {}
    for name, both in ends.items():
        if len(both) == 2:
            measure = name.partition(" limb ")[0]
            stroke = both[Sense.MAX] - both[Sense.MIN]
            if measure not in found or stroke > found[measure][0]:
                found[measure] = Stroke(stroke, dimensions[name])
    return found

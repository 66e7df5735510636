"""Robot of a comparison with its results: degrees of freedom, tasks, actuator rates, strokes, proofs."""

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
    """Rate of an actuator for a task.

    Attributes:
        actuator: name of the actuator, or of the actuated leg.
        dimension: dimension of the actuator coordinate.
        value: rate, radians or length per unit of the task's motion; infinite if the actuator cannot drive the
            platform, NaN if the motion does not determine it.
    """

    actuator: str
    dimension: Dimension
    value: float


class Stroke(NamedTuple):
    """Stroke of an actuator, a length or an angle in radians."""

    value: float
    dimension: Dimension


class TaskFit(NamedTuple):
    """Task at a robot's design, at the first pose.

    Attributes:
        name: name of the task.
        F: objective; None without an optimum.
        can_move: True if the platform can follow the motion with unlocked actuators; None if unknown.
        constraint: fraction of F from constraint wrenches, 0 to 1; above 0 the platform cannot follow the motion.
            None if unknown.
        rates: rates of the actuators; empty if the robot's actuators are unknown.
    """

    name: str
    F: float | None
    can_move: bool | None
    constraint: float | None
    rates: tuple[Rate, ...]

    @property
    def largest_rate(self) -> Rate | None:
        """Rate with the largest magnitude, or a rate that is NaN; None without known rates."""
        return max(self.rates, key=lambda each: (math.isnan(each.value), abs(each.value)), default=None)


@dataclass(frozen=True, eq=False)
class Entry:
    """Robot of a comparison with its results.

    Attributes:
        contender: robot of the comparison.
        factor: scale factor of the typical lengths.
        size: size at home with scaled typical dimensions, length.
        final_size: size at the design, length; None without an optimum.
        placed: case with this robot; None if the case contradicts itself with the robot.
        solution: solution of the case with this robot; None if the case contradicts itself.
        freedoms: degrees of freedom of the platform at the first pose, or at almost all poses without an
            optimum; None if unknown.
        tasks: tasks at the design; empty without an optimum.
        singularities: descriptions of singularities of the design.
        fault: reason why there is no solution; otherwise empty.
        certified: certificates; None if not requested or impossible.
        certificate_fault: reason why there is no certificate; otherwise empty.
        judgement: judgement of the design over the workspace; None without a workspace or without a proof.
        outcome: verdict on ranks and limits over the workspace; None without a proof.
        workspace_fault: reason why there is no verdict over the workspace; otherwise empty.
        seconds: wall time.
        strokes: largest stroke of each quantity: proved over the workspace; without a workspace, over several poses.
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
        """True if the solve found an optimum."""
        return self.solution is not None and self.solution.status.is_answer

    @property
    def keeps_limits(self) -> bool:
        """True if the optimum satisfies all limits of the case, without omitted limits."""
        return self.placed is not None and not self.placed.left_out

    @property
    def can_move(self) -> bool | None:
        """True if the platform can follow the motions of all tasks; None if unknown."""
        if not self.tasks:
            return None
        known = [task.can_move for task in self.tasks]
        return False if False in known else None if None in known else True

    @property
    def value(self) -> float | None:
        """F of a single task, or the combined value of several tasks; None without a value."""
        if self.solution is None or not self.has_answer:
            return None
        combination = self.solution.combination
        found = self.solution.F if combination is None else combination.value
        return found if found is not None and math.isfinite(found) else None

    @property
    def sense(self) -> Sense:
        """Maximisation or minimisation of the value."""
        if self.solution is None or self.solution.decided_by is None:
            return Sense.MAX
        return self.solution.decided_by.nlp.sense

    @property
    def certificate(self) -> Certificate | None:
        """Certificate of the final nonlinear program; None without a certificate."""
        return None if self.certified is None else self.certified.certificate


def generic_degrees_of_freedom(contender: Contender) -> int | None:
    """Return the degrees of freedom of a robot's platform at almost all poses; None if unknown.

    They are known for a robot defined by its rows if each row is that of an actuated leg.
    """
    model = contender.model
    if model.generic is not None:
        return 6 - model.generic.constraints
    return 6 if _is_legs(contender) else None


def _is_legs(contender: Contender) -> bool:
    """Return whether all rows of a robot defined by rows of J are forces of actuated legs."""
    model = contender.model
    return not model.has_couples and 0 < len(model.legs) == len(model.wrenches) and not model.members


def task_fit(contender: Contender, outcome: TaskOutcome) -> tuple[TaskFit, Mobility | None]:
    """Return a task at a robot's design, and the robot's mobility; None as mobility of a robot defined by its rows.

    Args:
        contender: robot of the comparison.
        outcome: outcome of the task, with a robot that exists at the design.
    """
    nlp, x, state = outcome.own.nlp, outcome.at, outcome.state
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
    """Return the number of actuation wrenches, the terms of F in a motion that the robot can follow."""
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
    """Return the largest stroke of each quantity over the poses of a case; empty for a single pose.

    Args:
        contender: robot of the comparison.
        outcome: outcome of a task, with a robot that exists at the design.
        quantities: names of the quantities.
    """
    nlp = outcome.own.nlp
    count = len(nlp.program.robots)
    if count == 1:
        return {}
    states = [evaluate(nlp, outcome.at, pose) for pose in range(count)]
    dimensions = {each.name: each.dimension for each in contender.model.quantities}
    return {
        name: Stroke(float(np.ptp([state.quantities[name] for state in states], axis=0).max()), dimensions[name])
        for name in quantities
    }


def proven_strokes(judgement: Judgement, quantities: tuple[str, ...]) -> Mapping[str, Stroke]:
    """Return the largest stroke of each quantity over a workspace, from proved bounds only.

    Args:
        judgement: judgement of the design.
        quantities: names of the quantities.
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

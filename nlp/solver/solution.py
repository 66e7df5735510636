"""Answer to a case: one type for one task and for several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...models import FloatArray
from ...models.shown import Shown
from ...models.values import dataclass
from ...models.whole import Whole
from ..case.case import Case
from ..case.choices import ChosenDimension, Ranges, catalogue_dimensions, within_ranges
from ..case.names import name_of_task, pose_names
from ..case.task import Method, Task
from ..errors import EvaluationError, InputError, nearest
from ..evidence.evaluation import shown_parameters, shown_values
from ..evidence.optimality import Evidence
from ..evidence.state import RobotState
from ..program.nlp import Nlp
from ..program.relaxation import RelaxedLimit
from ..system.jsonvalues import Vector
from .multistart import ProgramSolution
from .scheduled import Schedule
from .starts import Optimum, Start
from .status import Status

if TYPE_CHECKING:
    from .. import Picture
    from .semi_infinite import ExchangeProof


class Answer:
    """Display methods of an answer to a case: a solution, with or without certificates.

    The package imports the functions behind these methods when they are first used.
    """

    def table(self, width: int = 80) -> str:
        """Return the tables of the answer as text, as ``solve --all`` prints them.

        Args:
            width: number of columns.
        """
        from .. import text_of  # noqa: PLC0415 - outputs come after answers

        return text_of(self._shown, width)

    def plot(self, file: str | Path | None = None) -> Picture:
        """Return the drawing of the robot with its tasks; a notebook shows it.

        Args:
            file: file for the drawing, as PNG, SVG or PDF by the ending of its name; None to write no file.

        Raises:
            InputError: the ending is not allowed, Matplotlib is not installed, or the file cannot be written.
            EvaluationError: the robot's loops cannot be closed at the point of the answer.
        """
        from .. import picture_of, plot  # noqa: PLC0415 - outputs come after answers

        solution = getattr(self._shown, "solution", self._shown)
        if file is not None:
            plot(solution, file)
        return picture_of(solution)

    def report(self, file: str | Path | None = None) -> str:
        """Return an HTML page about the answer, which opens without a network.

        Args:
            file: file for the page; None to write no file.

        Raises:
            InputError: Plotly is not installed, or the file cannot be written.
        """
        from .. import report  # noqa: PLC0415 - outputs come after answers

        return report(self._shown, file=file)

    def to_dict(self) -> dict[str, object]:
        """Return the result as plain JSON types, as ``--json`` writes it."""
        from .. import json_data, result_of  # noqa: PLC0415 - outputs come after answers

        return {**json_data(result_of(self._shown))}

    @property
    def _shown(self) -> Any:  # noqa: ANN401 - importing both kinds of answers here would be a circular import
        return self


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """Outcome of one task at the point of a solution.

    Attributes:
        task: task with its scaled weight.
        own: solution of the separate program of the task.
        unique: If true, the task has only one separate optimum.
        x: (n,) point of the task's optimal set that is combined with those of other tasks.
        state: state of the robot at the solution's point, with this task's rates, at the first pose; None if the
            loops cannot be closed.
        F: objective of the task at the solution's point; NaN where the loops cannot be closed.
        evidence: evidence of optimality at the solution for this task only; None without free variables.
        loss: loss of F compared with the task's separate optimum; negative if the combined search reached a better
            optimum; 0 for a case with one task.
        at: (m,) point of the solution in the variables of the task's program; these are only a part of the solution's
            variables if dimensions or the pose change from task to task.
        exchanged: solution of the task's separate program with constraints at the poses that the exchange added; only
            for several tasks with limits over a workspace or along a path, otherwise None. The program of ``own`` has
            no such constraints.
    """

    task: Task
    own: ProgramSolution
    unique: bool
    x: FloatArray
    state: RobotState | None
    F: float
    evidence: Evidence | None
    loss: float
    at: FloatArray
    exchanged: ProgramSolution | None = None


@dataclass(frozen=True, eq=False)
class Combination:
    """Combination of several tasks in a solution.

    Attributes:
        method: method that combines the tasks.
        value: value of the combined objective: the weighted sum, or the level of the worst task; None for an average.
        weights: weight of each task, scaled to sum to the number of tasks.
        violated: names of the bounds and constraints that the combined point violates.
        notices: sentences about scaled weights and optima that are not unique.
        combined: solution of the combined program; None for an average, or if a task has no separate optimum.
        whole: program with the variables and limits of the solution: that of the first task, or a program of all tasks
            if dimensions or the pose change from task to task.
    """

    method: Method
    value: float | None
    weights: tuple[float, ...]
    violated: tuple[str, ...]
    notices: tuple[str, ...]
    combined: ProgramSolution | None
    whole: Nlp


@dataclass(frozen=True, eq=False)
class SharedInstead:
    """Comparison with the same problem in which one dimension, or the pose, is the same for every task.

    Attributes:
        name: name of the dimension; ``pose`` for the pose.
        solution: answer to this problem; None if no value is allowed for every task.
        gain: relative gain of the combined objective by the change; None for an average and without an answer.
        reason: reason why there is no answer; empty with an answer.
    """

    name: str
    solution: Solution | None
    gain: float | None
    reason: str = ""


class PointAtPose(NamedTuple):
    """Program of a task, a point (n,) in its variables, and the index of one of its poses."""

    nlp: Nlp
    x: FloatArray
    pose: int


class ChoicePart(NamedTuple):
    """Group of combinations of a case's listed parameter values.

    Attributes:
        ranges: index range of the values of each parameter; the second index is exclusive.
        cost: objective as a cost to be minimised. For a group of several combinations, it is the best objective with
            the parameters free between their smallest and largest values. None without an answer.
    """

    ranges: Ranges
    cost: float | None


@dataclass(frozen=True)
class Choice:
    """Search over the combinations of a case's listed parameter values.

    Attributes:
        combinations: number of all combinations.
        solved: number of solved combinations.
        relaxed: number of parts that were solved with the parameters free between their smallest and largest values.
        is_complete: If true, every combination was solved, or belongs to a part without a better combination.
        parts: parts that together cover all combinations.
        chosen: combination of the solution.
    """

    combinations: int
    solved: int
    relaxed: int
    is_complete: bool
    parts: tuple[ChoicePart, ...]
    chosen: Ranges


@dataclass(frozen=True)
class Rounding:
    """Rounding of a solution's dimensions.

    Attributes:
        step: step of the multiples, in the case's unit of length, and in degrees for angles.
        before: objective before rounding, as a cost to be minimised.
        after: objective of the rounded design, as a cost to be minimised; infinite without an answer.
        farther: number of additional multiples on each side of the nearest ones that were searched.
        numbers: rounded dimensions; their values are NaN without an answer.
        choice: search over the combinations of multiples; None if each dimension has only one multiple.
    """

    step: float
    before: float
    after: float
    farther: int
    numbers: tuple[ChosenDimension, ...]
    choice: Choice | None


@dataclass(frozen=True, eq=False)
class Solution(Whole, Shown, Answer):
    """The answer to a case.

    For a case with one task, ``F``, ``nlp``, ``starts``, ``optima`` and ``relaxation`` are those of its program. For
    several tasks, ``F`` raises an error, and the other attributes are those of the combined program; for an average
    they raise an error too.

    ``solution["x1"]`` is a parameter or pose coordinate at the point, in the units of the case, by its name for
    ``--set``: a parameter, a component such as ``base_1_x``, ``p_x``, ``p_y``, ``p_z``, ``angle``, or ``axis``.

    Attributes:
        case: the case.
        status: outcome of the solve.
        x: (n,) best point, in the variables of a single task's program. The status says whether it is an optimum or
            only the point that a failed solve reached.
        outcomes: outcome of each task.
        combination: combination of several tasks; None for one task.
        seconds: wall time.
        workspace: proof that the design satisfies its limits over the workspace; None if no limit applies to the
            workspace, or the program has no answer.
        path: proof that the design satisfies its limits along the path; None if no limit applies to the path, or the
            program has no answer.
        choice: search over listed parameter values; None without listed values.
        rounding: rounding of dimensions; None without rounding.
        changes: for each dimension or pose that changes from task to task, the answer with it shared.
        schedule: values that change along the path, if the objective is over the path; the point is then the robot at
            the first point of the path. Otherwise None.
    """

    case: Case
    status: Status
    x: FloatArray
    outcomes: tuple[TaskOutcome, ...]
    combination: Combination | None
    seconds: float
    workspace: ExchangeProof | None = None
    path: ExchangeProof | None = None
    choice: Choice | None = None
    rounding: Rounding | None = None
    changes: tuple[SharedInstead, ...] = ()
    schedule: Schedule | None = None

    def __repr__(self) -> str:
        if self.combination is None:
            found = f", F = {self.F:.7g}" if self.status.is_answer else ""
        else:
            value = self.combination.value
            found = f", {len(self.outcomes)} tasks by {self.combination.method.value}"
            found += "" if value is None else f", value {value:.7g}"
        return f"<Solution of {self.case.name!r}: {self.status.value}{found}>"

    # Values have names but no indices: without this, Python would iterate over solution[0], solution[1], ...
    __iter__ = None

    def __getitem__(self, name: str) -> float | Vector:
        """Return a parameter or pose coordinate at the point, in the units of the case.

        Args:
            name: name of the value for ``--set``.

        Raises:
            InputError: the case has no value of this name.
            EvaluationError: the robot's loops cannot be closed at the point.
        """
        numbers = shown_values(self.outcomes[0].own.nlp, self.outcomes[0].at, self._state())
        if self.case.changes:
            numbers = values_of_tasks(self.case, self.settings)
        if name not in numbers:
            raise InputError(f"{name}: no such value; {nearest(str(name), numbers)}")
        return numbers[name]

    @property
    def parameters(self) -> Mapping[str, float | Vector]:
        """Parameters of the robot at the point, in the units of the case; a point or direction has several components.

        Raises:
            EvaluationError: the robot's loops cannot be closed at the point.
        """
        return shown_parameters(self.case, self._state())

    @property
    def settings(self) -> tuple[Mapping[str, float | Vector], ...]:
        """Parameters and pose coordinates of each task at the point, in the case's units, by their names for ``--set``.

        Raises:
            EvaluationError: the robot's loops cannot be closed at the point.
        """
        self._state()
        return tuple(
            shown_values(outcome.own.nlp, outcome.at, outcome.state)
            for outcome in self.outcomes
            if outcome.state is not None
        )

    @property
    def jacobian(self) -> FloatArray:
        """Jacobian (m, 6) at the first pose: unit wrenches, force, then moment about the world origin.

        Forces have no unit, and moments the case's unit of length.

        Raises:
            EvaluationError: the robot's loops cannot be closed at the point.
        """
        return self._state().jacobian

    def at_pose(self, pose: int) -> PointAtPose:
        """Return the program of the task of a pose, the point in its variables, and the pose's index in the program.

        Args:
            pose: index of the pose in the case.
        """
        stations = self.case.stations
        task = stations[pose].task or 0
        before = sum(station.task == stations[pose].task for station in stations[:pose])
        outcome = self.outcomes[task]
        return PointAtPose(outcome.own.nlp, outcome.at, before)

    @property
    def whole(self) -> Nlp:
        """Program with the variables of the solution: that of the first task, or of all tasks if a robot changes."""
        return self.outcomes[0].own.nlp if self.combination is None else self.combination.whole

    @property
    def chosen_case(self) -> Case:
        """Case with the chosen catalogue values; the case itself if it has none."""
        if not self.case.changes:
            return self.outcomes[0].own.nlp.case
        if self.choice is None:
            return self.case
        return within_ranges(self.case, catalogue_dimensions(self.case), self.choice.chosen)

    @property
    def keeps_limits(self) -> bool:
        """True if all limits over a workspace or along a path are proved."""
        return all(proof is None or proof.is_proved for proof in (self.workspace, self.path))

    @property
    def decided_by(self) -> ProgramSolution | None:
        """Solution of the deciding program: the only task, or the combined program; None for an average."""
        return self.outcomes[0].own if self.combination is None else self.combination.combined

    @property
    def all_solved(self) -> bool:
        """True if all nonlinear programs of the method are solved, so that the point is an answer.

        An interrupted search, for example over listed values, is not an answer, even if its best program is solved.
        """
        has_answers = all(outcome.own.status.is_answer for outcome in self.outcomes)
        decisive = self.decided_by
        is_whole = self.status is not Status.INTERRUPTED
        return is_whole and has_answers and (decisive is None or decisive.status.is_answer)

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        """Objective at the optimum, for a case with one task.

        Raises:
            EvaluationError: the solve failed, or the case has several tasks.
        """
        if self.combination is not None:
            raise EvaluationError("F: a case with several tasks has no single F: see outcomes and combination.value")
        if self.schedule is not None:
            return self.schedule.value
        return self.outcomes[0].own.F

    @property
    def state(self) -> RobotState | None:
        """State of the robot at the point, with the rates of the first task; None if loops cannot be closed."""
        return self.outcomes[0].state

    @property
    def evidence(self) -> Evidence | None:
        """Evidence of optimality of the deciding program; None for an average, and without free variables."""
        return None if self.decided_by is None else self.decided_by.evidence

    @property
    def nlp(self) -> Nlp:
        """Nonlinear program of the only task, or of the combination of several tasks."""
        return self._decisive_solution().nlp

    @property
    def starts(self) -> tuple[Start, ...]:
        """Result of every search of the deciding program, one for each starting point, in order."""
        return self._decisive_solution().starts

    @property
    def optima(self) -> tuple[Optimum, ...]:
        """Distinct optima of the deciding program, best first."""
        return self._decisive_solution().optima

    @property
    def relaxation(self) -> tuple[RelaxedLimit, ...]:
        """Smallest known relaxation of the limits that makes an infeasible program feasible."""
        return self._decisive_solution().relaxation

    @property
    def seed(self) -> int:
        """Seed of the starting points."""
        return self.outcomes[0].own.seed

    def _state(self) -> RobotState:
        """Return the state of the robot at the point.

        Raises:
            EvaluationError: the robot's loops cannot be closed at the point.
        """
        if self.state is None:
            raise EvaluationError(f"the robot does not exist at the point of this solution ({self.status.value})")
        return self.state

    def _decisive_solution(self) -> ProgramSolution:
        """Return the solution of the deciding program.

        Raises:
            EvaluationError: there is no single program, as for an average.
        """
        if self.decided_by is None:
            fault = "an average of tasks has no combined program; solution.outcomes has the program of each task"
            raise EvaluationError(fault)
        return self.decided_by


def values_of_tasks(case: Case, settings: Sequence[Mapping[str, float | Vector]]) -> Mapping[str, float | Vector]:
    """Return the values of a case whose dimensions or pose change from task to task, by their names for ``--set``.

    Args:
        case: the case.
        settings: values of each task by their names in the case of the task.
    """
    changing = {case.parameter_name(name) for name in case.dimensions_per_task}
    poses = set(pose_names(len(case.poses) // len(case.tasks))) if case.pose_per_task else set[str]()
    found = {name: value for name, value in settings[0].items() if name not in changing | poses}
    for task, values in enumerate(settings):
        found |= {name_of_task(name, task): value for name, value in values.items() if name in changing}
    if case.pose_per_task:
        stated = [values[name] for values in settings for name in values if name in poses]
        parts = [f"{prefix}{part}" for prefix in case.pose_prefixes for part in ("p_x", "p_y", "p_z", "angle", "axis")]
        found |= dict(zip(parts, stated, strict=True))
    return found


def interrupted(solution: Solution) -> Solution:
    """Return the best solution so far of an interrupted search, which is not an answer."""
    if not solution.status.is_answer:
        return solution
    outcomes = solution.outcomes
    if solution.combination is None:
        (outcome,) = outcomes
        outcomes = (replace(outcome, own=replace(outcome.own, status=Status.INTERRUPTED)),)
    return replace(solution, status=Status.INTERRUPTED, outcomes=outcomes)

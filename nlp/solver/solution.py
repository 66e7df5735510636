"""The answer to a case: one type for one task or several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...models import FloatArray
from ...models.shown import Shown
from ...models.values import dataclass
from ...models.whole import Whole
from ..case.case import Case
from ..case.choices import ChosenNumber, Ranges
from ..case.task import Method, Task
from ..errors import EvaluationError, InputError, nearest
from ..evidence.evaluation import shown_numbers, shown_parameters
from ..evidence.optimality import Evidence
from ..evidence.state import RobotState
from ..program.nlp import Nlp
from ..program.relaxation import RelaxedLimit
from ..system.jsonvalues import Vector
from .multistart import ProgramSolution
from .starts import Optimum, Start
from .status import Status

if TYPE_CHECKING:
    from .. import Picture
    from .semi_infinite import ExchangeProof


class Answer:
    """An answer to a case that can show itself: a solution, alone or with its certificates.

    The index of the package finds the functions that show it when they are needed.
    """

    def table(self, width: int = 80) -> str:
        """Return the tables of the answer as text, as ``solve --all`` prints them.

        Args:
            width: number of columns.
        """
        from .. import text_of  # noqa: PLC0415 - outputs come after answers

        return text_of(self._found, width)

    def plot(self, file: str | Path | None = None) -> Picture:
        """Return the drawing of the robot with its tasks, which a notebook shows.

        Args:
            file: file that the drawing is written to, by the name's ending as PNG, SVG or PDF; None for none.

        Raises:
            InputError: the ending is another one, Matplotlib is not installed, or the file cannot be written.
            EvaluationError: the robot does not exist at the point reached.
        """
        from .. import picture_of, plot  # noqa: PLC0415 - outputs come after answers

        solution = getattr(self._found, "solution", self._found)
        if file is not None:
            plot(solution, file)
        return picture_of(solution)

    def report(self, file: str | Path | None = None) -> str:
        """Return the page about the answer as HTML, which opens without a network.

        Args:
            file: file that the page is written to; None for none.

        Raises:
            InputError: Plotly is not installed, or the file cannot be written.
        """
        from .. import report  # noqa: PLC0415 - outputs come after answers

        return report(self._found, file=file)

    def to_dict(self) -> dict[str, object]:
        """Return the result as JSON's own types, as ``--json`` writes it."""
        from .. import json_data, result_of  # noqa: PLC0415 - outputs come after answers

        return {**json_data(result_of(self._found))}

    @property
    def _found(self) -> Any:  # noqa: ANN401 - naming both kinds of answers here would import what imports this
        return self


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """One task at the point of a solution.

    Attributes:
        task: the task, with its scaled weight.
        own: solution of the task's own program.
        unique: whether the task's own optimum is the only one.
        x: (n,) the member of the task's optimal set that is combined with those of other tasks.
        state: the robot at the solution's point, with this task's rates, at the first pose; None where the robot does
            not exist.
        F: the task's objective at the solution's point; NaN where the robot does not exist.
        evidence: evidence at the solution's point for this task alone; None when nothing is free.
        loss: difference by which F is worse than the task's own optimum; negative where the combined search found a
            better optimum, and 0 for a case with one task.
        exchanged: of several tasks with limits over a workspace or along a path, the solution of the task's own program
            with the poses of the exchange as constraints, which ``own`` is without; else None.
    """

    task: Task
    own: ProgramSolution
    unique: bool
    x: FloatArray
    state: RobotState | None
    F: float
    evidence: Evidence | None
    loss: float
    exchanged: ProgramSolution | None = None


@dataclass(frozen=True, eq=False)
class Combination:
    """Combination of several tasks: the part of a solution that a case with one task does not have.

    Attributes:
        method: method that combines the tasks.
        value: value of the combined objective: the weighted sum, or the level of the worst task; None for an average.
        weights: one for each task, scaled to sum to the number of tasks.
        violated: names of the bounds and constraints that the combined point violates.
        notices: sentences for the user about scaled weights and optima that are not unique.
        combined: solution of the combined program; None for an average, or where a task has no optimum of its own.
    """

    method: Method
    value: float | None
    weights: tuple[float, ...]
    violated: tuple[str, ...]
    notices: tuple[str, ...]
    combined: ProgramSolution | None


class ChoicePart(NamedTuple):
    """A part of the combinations of a case's listed numbers.

    Attributes:
        ranges: for each number, the place of its first value, and that behind the last one.
        cost: objective, the smaller the better, of the combination or with the numbers free between the ends of their
            values; None without an answer.
    """

    ranges: Ranges
    cost: float | None


@dataclass(frozen=True)
class Choice:
    """The search over the combinations of a case's listed numbers.

    Attributes:
        combinations: number of all.
        solved: number of those solved.
        relaxed: number of parts that were solved with the numbers free between the ends of their values.
        is_complete: whether every combination is solved, or left out as it is in a part that is no better.
        parts: that hold all combinations together.
        chosen: the combination of the solution.
    """

    combinations: int
    solved: int
    relaxed: int
    is_complete: bool
    parts: tuple[ChoicePart, ...]
    chosen: Ranges


@dataclass(frozen=True)
class Rounding:
    """The rounding of a solution's dimensions.

    Attributes:
        step: whose multiples the numbers are, in the case's unit of length, and degrees for angles.
        before: objective before, the smaller the better.
        after: the same of the rounded design; infinite without an answer.
        farther: number of multiples on each side, beside the nearest ones, that were searched.
        numbers: that were rounded, with values that are NaN where there is no robot.
        choice: the search over the multiples; None where each number has only one.
    """

    step: float
    before: float
    after: float
    farther: int
    numbers: tuple[ChosenNumber, ...]
    choice: Choice | None


@dataclass(frozen=True, eq=False)
class Solution(Whole, Shown, Answer):
    """The answer to a case.

    For a case with one task, ``F``, ``nlp``, ``starts``, ``optima`` and ``relaxation`` are those of its program. For
    several tasks, ``F`` raises an error, and the others are those of the combined program; an average has none, and
    they raise an error.

    ``solution["x1"]`` is a number of the case at the point, in the units of the case. Its names are those of ``--set``:
    a parameter, one of its components such as ``base_1_x``, ``p_x``, ``p_y``, ``p_z``, ``angle``, or ``axis``.

    Attributes:
        case: the case.
        status: how the solve ended.
        x: (n,) the best point, in the variables of a single task's program. The status says whether it is an optimum
            or only the point that a failed solve reached.
        outcomes: one for each task.
        combination: the combination of several tasks; None for one task.
        seconds: wall time.
        workspace: proof that the design keeps its limits over the workspace; None where no limit holds there, or the
            program has no answer.
        path: proof that it keeps its limits along the path; None in the same cases.
        choice: how values of its listed numbers were chosen, which the programs have fixed; None without such numbers.
        rounding: how its dimensions were rounded, which the programs have fixed; None where they were not.
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

    def __repr__(self) -> str:
        if self.combination is None:
            found = f", F = {self.F:.7g}" if self.status.is_answer else ""
        else:
            value = self.combination.value
            found = f", {len(self.outcomes)} tasks by {self.combination.method.value}"
            found += "" if value is None else f", value {value:.7g}"
        return f"<Solution of {self.case.name!r}: {self.status.value}{found}>"

    # Numbers have names, and no places: without this, Python would iterate over solution[0], solution[1], ...
    __iter__ = None

    def __getitem__(self, name: str) -> float | Vector:
        """Return a number of the case at the point, in the units of the case.

        Args:
            name: its name, as for ``--set``.

        Raises:
            InputError: the case has no number of this name.
            EvaluationError: the robot does not exist at the point.
        """
        numbers = shown_numbers(self.outcomes[0].own.nlp, self.x, self._state())
        if name not in numbers:
            raise InputError(f"{name}: no such number; {nearest(str(name), numbers)}")
        return numbers[name]

    @property
    def parameters(self) -> Mapping[str, float | Vector]:
        """Parameters of the robot at the point, in the units of the case: several numbers for a point or direction.

        Raises:
            EvaluationError: the robot does not exist at the point.
        """
        return shown_parameters(self.case, self._state())

    @property
    def jacobian(self) -> FloatArray:
        """Jacobian (m, 6) at the first pose: unit wrenches, force, then moment about the world origin.

        Forces have no unit, and moments the case's unit of length.

        Raises:
            EvaluationError: the robot does not exist at the point.
        """
        return self._state().jacobian

    @property
    def keeps_limits(self) -> bool:
        """Whether no limit over a workspace or along a path stays without proof."""
        return all(proof is None or proof.is_proved for proof in (self.workspace, self.path))

    @property
    def decided_by(self) -> ProgramSolution | None:
        """Solution of the program that decided: of the only task, or of the combined program; None for an average."""
        return self.outcomes[0].own if self.combination is None else self.combination.combined

    @property
    def all_solved(self) -> bool:
        """Whether every program that the method needs is solved, so that the point is an answer of the method.

        An interrupted search, as among the values of a catalogue, is no answer, though its best program is solved.
        """
        alone = all(outcome.own.status.is_answer for outcome in self.outcomes)
        decisive = self.decided_by
        is_whole = self.status is not Status.INTERRUPTED
        return is_whole and alone and (decisive is None or decisive.status.is_answer)

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        """Objective at the optimum, for a case with one task.

        Raises:
            EvaluationError: the solve failed, or the case has several tasks.
        """
        if self.combination is not None:
            raise EvaluationError("the case has several tasks, each with its own F: see outcomes and combination.value")
        return self.outcomes[0].own.F

    @property
    def state(self) -> RobotState | None:
        """The robot at the point, with the rates of the first task; None where the robot does not exist."""
        return self.outcomes[0].state

    @property
    def evidence(self) -> Evidence | None:
        """Evidence of the program that decided; None for an average, and when nothing is free."""
        return None if self.decided_by is None else self.decided_by.evidence

    @property
    def nlp(self) -> Nlp:
        """The program that decided."""
        return self._decisive_solution().nlp

    @property
    def starts(self) -> tuple[Start, ...]:
        """Every start of the program that decided, in order."""
        return self._decisive_solution().starts

    @property
    def optima(self) -> tuple[Optimum, ...]:
        """Distinct optima of the program that decided, best first."""
        return self._decisive_solution().optima

    @property
    def relaxation(self) -> tuple[RelaxedLimit, ...]:
        """Smallest relaxation found that makes an infeasible program feasible."""
        return self._decisive_solution().relaxation

    @property
    def seed(self) -> int:
        """Seed of the starting points."""
        return self.outcomes[0].own.seed

    def _state(self) -> RobotState:
        """Return the robot at the point.

        Raises:
            EvaluationError: the robot does not exist there.
        """
        if self.state is None:
            raise EvaluationError(f"the robot does not exist at the point of this solution ({self.status.value})")
        return self.state

    def _decisive_solution(self) -> ProgramSolution:
        """Return the solution of the program that decided.

        Raises:
            EvaluationError: no single program decided, as for an average.
        """
        if self.decided_by is None:
            raise EvaluationError("no single program gave this point: see outcomes for each task's own")
        return self.decided_by


def interrupted(solution: Solution) -> Solution:
    """Return the best solution so far of an interrupted search, which is no answer."""
    if not solution.status.is_answer:
        return solution
    outcomes = solution.outcomes
    if solution.combination is None:
        (outcome,) = outcomes
        outcomes = (replace(outcome, own=replace(outcome.own, status=Status.INTERRUPTED)),)
    return replace(solution, status=Status.INTERRUPTED, outcomes=outcomes)

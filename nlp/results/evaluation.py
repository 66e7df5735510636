"""Result of an evaluation at one point: types and construction. Nothing is optimised."""

from collections.abc import Callable, Sequence

from ...models import FloatArray
from ..case.case import Case
from ..evidence.evaluation import starting_point
from ..evidence.margins import Margin
from ..evidence.principal_motions import TaskAnalysis, analyse_tasks
from ..evidence.state import RobotState, evaluate
from ..program.formulation import formulate_tasks, formulate_whole
from ..program.nlp import Nlp
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector, vector
from .design import limits_data, margins_data
from .objective import ObjectiveData, objective_data
from .parts import HeadData, LimitData, RobotData, TaskData, VersionsData, ViolationData
from .point import head_data, objective, robot_data, task_data, versions, violations


class EvaluatedTaskData(JsonObject):
    """Task at the evaluated point.

    Attributes:
        task: the task.
        F: objective of the task.
        rates: work rate of each row of J in the task's motion.
        task_is_free: If true, F is zero: nothing resists the task's motion.
        principal_motions: motions that the robot of the task resists least and most, if dimensions or the pose change
            from task to task; otherwise absent.
    """

    task: Inline[TaskData]
    F: float
    rates: Vector
    task_is_free: bool
    principal_motions: Absent[TaskAnalysis]


class EvaluationResult(JsonObject):
    """Result of evaluating a case at one point.

    Attributes:
        head: the case.
        F: objective of the first task.
        objective: objective of a solve, if it is not F at the stated poses; otherwise absent.
        robot: robot at the point, with the first task.
        tasks: every task at the point.
        violated: violated bounds and constraints.
        margins: margin of every limit at every leg, joint and pose.
        limits: limits of the case, one row for each limit.
        principal_motions: motions that the robot resists least and most, for the first task.
        settings: robot of each task, if dimensions or the pose change from task to task; otherwise absent.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    F: float
    objective: Absent[ObjectiveData]
    robot: Inline[RobotData]
    tasks: tuple[EvaluatedTaskData, ...]
    violated: tuple[ViolationData, ...]
    margins: tuple[Margin, ...]
    limits: tuple[LimitData, ...]
    principal_motions: TaskAnalysis
    settings: Absent[tuple[RobotData, ...]]
    versions: VersionsData


def evaluation_at(case: Case, begun: Callable[[Nlp], Nlp] = lambda nlp: nlp) -> EvaluationResult:
    """Return the result of an evaluation of a case at its start.

    Args:
        case: the case.
        begun: function that sets the start of the program with the variables of all tasks.

    Raises:
        CaseError: the fixed values of the case contradict each other.
        EvaluationError: a value is not finite at the start, or loops cannot be closed.
    """
    nlps, whole = formulate_tasks(case), begun(formulate_whole(case))
    x = starting_point(whole)
    if not case.changes:
        return evaluation_of(nlps, x, [evaluate(nlp, x) for nlp in nlps])
    points = [x[whole.program.places.of_task(j, len(x))] for j in range(len(nlps))]
    return _evaluation(nlps, points, [evaluate(nlp, at) for nlp, at in zip(nlps, points, strict=True)], whole, x)


def evaluation_of(nlps: Sequence[Nlp], x: FloatArray, states: Sequence[RobotState]) -> EvaluationResult:
    """Return the result of an evaluation: the robot at a point, every task, and the motions at which F is stationary.

    Args:
        nlps: nonlinear program of each task, all with the same variables.
        x: (n,) point.
        states: robot at the point, with the rates of each task, in order.
    """
    return _evaluation(nlps, [x] * len(nlps), states, nlps[0], x)


def _evaluation(
    nlps: Sequence[Nlp], points: Sequence[FloatArray], states: Sequence[RobotState], whole: Nlp, x: FloatArray
) -> EvaluationResult:
    """Return the result of an evaluation, from the program and the point of each task, and from those of all tasks."""
    nlp, case = nlps[0], whole.case
    margins = margins_data(whole, x, optimal=False)
    return EvaluationResult(
        head=head_data(case),
        F=objective(nlp, points[0], states[0]),
        objective=objective_data(case, objective(nlp, x, states[0])) if case.tasks[0].measure else None,
        robot=robot_data(nlp, points[0], states[0], 0),
        tasks=tuple(
            EvaluatedTaskData(
                task=task_data(case, j),
                F=objective(nlps[j], points[j], state),
                rates=vector(state.rates),
                task_is_free=state.is_zero,
                principal_motions=analyse_tasks(state.jacobian) if case.changes else None,
            )
            for j, state in enumerate(states)
            if not case.tasks[j].measure
        ),
        violated=violations(whole, x),
        margins=margins,
        limits=limits_data(margins),
        principal_motions=analyse_tasks(states[0].jacobian),
        settings=tuple(map(robot_data, nlps, points, states, [0] * len(nlps))) if case.changes else None,
        versions=versions(),
    )

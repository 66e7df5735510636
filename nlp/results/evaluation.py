"""Result of an evaluation at one point: types and construction. Nothing is optimised."""

from collections.abc import Sequence

from ...models import FloatArray
from ..evidence.margins import Margin
from ..evidence.principal_motions import TaskAnalysis, analyse_tasks
from ..evidence.state import RobotState
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
    """

    task: Inline[TaskData]
    F: float
    rates: Vector
    task_is_free: bool


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
        principal_motions: motions that the robot resists least and most.
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
    versions: VersionsData


def evaluation_of(nlps: Sequence[Nlp], x: FloatArray, states: Sequence[RobotState]) -> EvaluationResult:
    """Return the result of an evaluation: the robot at a point, every task, and the motions at which F is stationary.

    Args:
        nlps: nonlinear program of each task.
        x: (n,) point.
        states: robot at the point, with the rates of each task, in order.
    """
    nlp, case = nlps[0], nlps[0].case
    margins = margins_data(nlp, x, optimal=False)
    return EvaluationResult(
        head=head_data(case),
        F=objective(nlp, x, states[0]),
        objective=objective_data(case, objective(nlp, x, states[0])) if case.tasks[0].measure else None,
        robot=robot_data(nlp, x, states[0], 0),
        tasks=tuple(
            EvaluatedTaskData(
                task=task_data(case, j),
                F=objective(nlps[j], x, state),
                rates=vector(state.rates),
                task_is_free=state.is_zero,
            )
            for j, state in enumerate(states)
            if not case.tasks[j].measure
        ),
        violated=violations(nlp, x),
        margins=margins,
        limits=limits_data(margins),
        principal_motions=analyse_tasks(states[0].jacobian),
        versions=versions(),
    )

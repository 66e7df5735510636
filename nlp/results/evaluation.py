"""The robot at one given point as a result: the types and their construction. Nothing is optimised."""

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
    """A task at the point.

    Attributes:
        task: the task.
        F: its objective.
        rates: work rate of each row in the task's motion.
        task_is_free: whether F is zero, so that nothing resists the task's motion.
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
        objective: what a solve optimises instead of F; absent for F.
        robot: at the point, with the first task.
        tasks: every task at the point.
        violated: bounds and constraints that the point lies outside of.
        margins: every limit at every leg, joint and pose.
        limits: one row for each limiting number of the case.
        principal_motions: motions that the robot resists least and most.
        versions: of the programs.
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
    """Return the robot at one point: with its first task, then every task, and the motions at which F is stationary.

    Args:
        nlps: the program of each task.
        x: (n,) the point.
        states: the robot there with each task's rates, in order.
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

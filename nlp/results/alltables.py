"""Every table of a result, by name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..case.case import Case
from .data import CombinedResult
from .designtable import combined_design_table
from .jointwording import limb_part_table
from .robottables import plural_name, robot_tables
from .summary import case_summary, evaluation_summary
from .tables import margin_table
from .text import TextTable

if TYPE_CHECKING:
    from .data import CaseResult
    from .evaluation import EvaluationResult
    from .parts import MarginData, RobotData


def table_names(case: Case, *, at_point: bool) -> tuple[str, ...]:
    """Return the names of the tables that a result of a case can have.

    Args:
        case: the case.
        at_point: whether it is evaluated at a point, and not solved.
    """
    names = ["design"]
    if case.pose_count == 1:
        names.append("limbs")
    else:
        names += ["poses", *(["rates"] if at_point or len(case.tasks) == 1 else [])]
        names += [plural_name(item.name) for item in case.model.quantities]
    if case.model.generic is not None and (at_point or len(case.tasks) == 1):
        names.append("actuation")
    if case.limits:
        names += ["limits", "margins"]
    if at_point:
        return (*names, "jacobian", "motions")
    return tuple(names) if len(case.tasks) == 1 else (*names, "tasks")


def case_tables(case: Case, result: CaseResult) -> Iterator[TextTable]:
    """Yield the tables of a solve: those of its summary, then every margin."""
    yield from _tables(case_summary(case, result))
    if not isinstance(result, CombinedResult) and result.robot is not None:
        yield from _limb_parts(case, result.robot, is_shown=result.reached is None)
    if isinstance(result, CombinedResult) and result.robot is not None:
        if result.combined.method_point is None:
            # The summary shows no design without an answer.
            yield combined_design_table(case, result.combined, result.robot)
        yield from robot_tables(case, result.robot)
    yield from _margins(result.margins)


def evaluation_tables(case: Case, result: EvaluationResult) -> Iterator[TextTable]:
    """Yield the tables of an evaluation: those of its summary, then every margin."""
    yield from _tables(evaluation_summary(case, result))
    yield from _limb_parts(case, result.robot, is_shown=True)
    yield from _margins(result.margins)


def _limb_parts(case: Case, robot: RobotData, *, is_shown: bool) -> Iterator[TextTable]:
    """Yield actuation and constraints by limb, unless a summary that may show them does so."""
    table = limb_part_table(case, robot)
    if table is not None and not (is_shown and robot.joints is not None and robot.joints.constrained):
        yield table


def _tables(items: Iterator[object]) -> Iterator[TextTable]:
    return (item for item in items if isinstance(item, TextTable))


def _margins(margins: Sequence[MarginData]) -> Iterator[TextTable]:
    if margins:
        yield margin_table(margins)

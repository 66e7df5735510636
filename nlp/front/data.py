"""Front as a result, and as a table of designs in the case's units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from types import MappingProxyType

from ..case.task import Sense
from ..evidence.optimality import Evidence
from ..program.places import Scalar
from ..program.program import design_indices, design_names
from ..proof.certificate.certificate import CertificateStatus
from ..results.evidence import certificate_data
from ..results.explorations import FrontGoalData, FrontPointData, FrontResult
from ..results.objective import unit_of_objective
from ..results.point import head_data, stated_pose_notice, versions
from ..system.jsonvalues import finite_or_none
from ..words.designs import SEPARATOR, Cell, Column, ColumnKind, Designs, DrawnDesign, Join, PageWords, design_values
from ..words.numbers import key_words
from ..words.text import Line
from .front import Front, FrontPoint
from .goals import Goal

#: Prefix of the name of a constraint that bounds F of a task.
_GOAL = "F of "


def front_result(front: Front) -> FrontResult:
    """Return a front as a result."""
    goals = tuple(
        FrontGoalData.of(goal, name=goal.label, unit=unit)
        for goal, unit in zip(front.goals, goal_units(front), strict=True)
    )
    return FrontResult.of(
        front,
        head=head_data(front.case),
        notice=stated_pose_notice(front.case),
        front=goals,
        points=tuple(_point(front, each) for each in front.points),
        versions=versions(),
    )


def goal_values(front: Front, point: FrontPoint) -> list[float]:
    """Return the goals of a point in the case's units."""
    return [shown_goal(front, k, float(value)) for k, value in enumerate(point.values)]


def goal_units(front: Front) -> list[str]:
    """Return the unit of each goal; empty for a dimensionless goal."""
    readings = [each[0].dimension for each in front.points[0].program.readings]
    return [
        front.case.units.label(dimension) if goal.task is None else unit_of_objective(front.case, goal.task)
        for goal, dimension in zip(front.goals, readings, strict=True)
    ]


def shown_goal(front: Front, k: int, value: float) -> float:
    """Return the value of a goal in the case's unit."""
    readings = front.points[0].program.readings[k]
    return front.case.units.shown(value, readings[0].dimension)


def design_places(front: Front) -> list[tuple[int, Scalar]]:
    """Return place and name of each design variable, without joint coordinates and the level of a goal."""
    point = front.points[0]
    program = point.solution.nlp.program
    # If a limit is the goal, the nonlinear program has its value as the last variable.
    last = len(program.variables) - (front.goals[point.program.optimised].task is None)
    return [(k, program.variables[k]) for k in design_indices(program) if k < last]


def front_designs(front: Front, result: FrontResult) -> Designs[int]:
    """Return a front as a table of designs; the rows are the indices of its points.

    Args:
        front: front with its points.
        result: front as a result.
    """
    several, lines = len(front.goals) > 2, _lines(front, result)
    rule = (
        "Each point is an optimum with evidence: one goal is optimised within bounds on the others. No point "
        "is better than another in all goals."
    )
    below = "the two goals; gaps have no line."
    if several:
        below = "one panel for each pair of goals" + (
            "; the colour shows the third goal." if len(front.goals) == 3 else "."
        )
    return Designs(
        "front",
        front.case,
        "points: goals and active limits",
        tuple(_columns(front, result)),
        range(len(front.points)),
        Join.CLOUD if several else Join.CURVE,
        PageWords(
            f"Pareto front: {front.case.name}, robot {front.case.model.name}",
            f"{lines[0]}.",
            ("front", "Pareto front"),
            ("points", "All points"),
            rules=(rule, *(f"{line}." for line in lines[1:])),
            below=below,
            designs="Designs",
            # Only a front of two goals has an order.
            bends="" if several else "Changes of active limits",
        ),
        before=[Line(line) for line in lines],
        drawn=lambda: [_drawn(front, each) for each in front.points],
        gaps=front.gaps,
    )


def _lines(front: Front, result: FrontResult) -> list[str]:
    """Return a summary of a front."""
    count, goals = len(result.points), [_words(goal) for goal in front.goals]
    lines = [f"Pareto front of {count} point{'s' * (count > 1)}: {', '.join(goals[:-1])} and {goals[-1]}"]
    for goal, unit in zip(front.goals, goal_units(front), strict=True):
        values = [point.goals[goal.label] for point in result.points]
        # The ends of a front of two goals have the extreme values.
        low, high = (values[0], values[-1]) if len(goals) == 2 else (min(values), max(values))
        lines.append(f"{_quantity(goal)}: {low:.7g} to {high:.7g} {unit}".rstrip())
    lines += [] if result.notice is None else [result.notice]
    if front.gaps:
        lines.append(f"gaps of the front, without points between two neighbours: {len(front.gaps)}")
    if front.failed:
        lines.append(f"searches without an optimum: {front.failed}")
    proofs = [point.certificate for point in result.points if point.certificate is not None]
    if proofs:
        proved = sum(each.status is CertificateStatus.PROVED for each in proofs)
        lines.append(
            f"{proved} of {len(proofs)} points are proved global optima within their bounds on the other goals"
        )
    return lines


def _columns(front: Front, result: FrontResult) -> Iterator[Column[int]]:
    """Yield the columns: goals, design, active limits, evidence, and the certificate."""
    points, rows, goals = front.points, result.points, front.goals
    proofs = ColumnKind.PROOF

    def status(k: int) -> str | None:
        return None if (proof := points[k].certificate) is None else proof.status.value

    def of_evidence(name: str, cell: Callable[[Evidence], Cell], holds: type[float | str] = float) -> Column[int]:
        def cell_of(k: int) -> Cell:
            return None if (evidence := points[k].solution.evidence) is None else cell(evidence)

        return Column(name, cell_of, ColumnKind.EVIDENCE, holds)

    def of_goal(goal: Goal, unit: str) -> Column[int]:
        def cell(k: int) -> float:
            return rows[k].goals[goal.label]

        return Column(
            goal.label, cell, ColumnKind.OBJECTIVE, label=_words(goal), unit=unit, text=lambda k: f"{cell(k):.7g}"
        )

    def of_number(name: str, numbers: str, kind: ColumnKind, head: str = "") -> Column[int]:
        return Column(f"{head}{name}", lambda k: getattr(rows[k], numbers).get(name), kind)

    yield from map(of_goal, goals, goal_units(front))
    yield Column(
        "optimised",
        lambda k: rows[k].optimised,
        holds=str,
        label="optimum of",
        text=lambda k: _quantity(goals[points[k].program.optimised]),
    )
    if len(goals) == 2:  # one alone has a bound
        yield Column("bound", lambda k: next(iter(rows[k].bounds.values()), None))
    else:
        yield from (of_number(goal.label, "bounds", ColumnKind.OTHER, "bound of ") for goal in goals)
    yield Column("status", lambda k: rows[k].status.value, holds=str)
    yield from (of_number(name, "design", ColumnKind.VARIABLE) for name in rows[0].design)
    if any(row.certificate is not None for row in rows):
        yield Column("", status, proofs, label="certificate", text=lambda k: status(k) or "")
    yield Column(
        "active",
        lambda k: None if rows[k].kind is None else SEPARATOR.join(rows[k].active),
        ColumnKind.ACTIVE,
        holds=str,
        label="active",
        text=lambda k: ", ".join(_counted(points[k])),
    )
    units = front.case.units
    yield of_evidence("multipliers", lambda found: SEPARATOR.join(map(repr, found.multipliers_in(units))), str)
    yield of_evidence("verdict", lambda found: found.kind.value, str)
    yield of_evidence("stationarity", lambda found: found.stationarity)
    yield of_evidence("feasibility", lambda found: found.feasibility)
    yield of_evidence("curvature", lambda found: next(iter(found.eigenvalues.tolist()), None))
    yield Column("certificate", status, proofs, holds=str)
    yield Column("proven_bound", lambda k: None if (proof := points[k].certificate) is None else proof.bound, proofs)
    yield Column("starts", lambda k: len(points[k].solution.starts), ColumnKind.EVIDENCE, int)
    yield Column("seconds", lambda k: points[k].solution.seconds)


def _drawn(front: Front, point: FrontPoint) -> DrawnDesign:
    """Return the design of a point for a drawing."""
    solution = point.solution
    units = (f" {unit}" if unit else "" for unit in goal_units(front))
    pairs = zip(front.goals, goal_values(front, point), units, strict=True)
    names = design_names(solution.nlp.program)
    sides = () if solution.evidence is None else solution.evidence.active
    return DrawnDesign(
        ", ".join(f"{_shown(goal)} = {value:.6g}{unit}" for goal, value, unit in pairs),
        f"optimum of {_shown(front.goals[point.program.optimised])}",
        design_values(solution.nlp, solution.x),
        tuple(f"{side.name} {side.bound}" for side in sides if side.name in names),
        solution.nlp,
        solution.x,
        solution.state,
        next((goal.task for goal in front.goals if goal.task is not None), 0),
    )


def _counted(point: FrontPoint) -> list[str]:
    """Return the active sides without the names of limbs and joints, with their counts.

    Loop equations and bounds of joint coordinates are ignored.
    """
    evidence, names = point.solution.evidence, design_names(point.solution.nlp.program)
    sides = [] if evidence is None else [side for side in evidence.active if side.name in names]
    # The bound of a goal has the name of its task.
    shown = (side.name if side.name.startswith(_GOAL) else side.name.split()[0] for side in sides)
    counts = Counter(f"{name} {side.bound}" for name, side in zip(shown, sides, strict=True))
    return [name if count == 1 else f"{name} ({count})" for name, count in counts.items()]


def _words(goal: Goal) -> str:
    """Return a goal in words, such as ``smallest leg_length.max``."""
    return f"{'largest' if goal.sense is Sense.MAX else 'smallest'} {_quantity(goal)}"


def _quantity(goal: Goal) -> str:
    """Return the quantity of a goal in words, such as ``F of drive`` for ``F:drive``."""
    return goal.label.removeprefix("limits.") if goal.task is None else goal.label.replace("F:", "F of ", 1)


def _shown(goal: Goal) -> str:
    """Return the quantity of a goal for a page, with the key of a limit in words."""
    return key_words(_quantity(goal)) if goal.task is None else _quantity(goal)


def _point(front: Front, point: FrontPoint) -> FrontPointData:
    evidence, names = point.solution.evidence, [goal.label for goal in front.goals]
    units = front.case.units
    design = {
        each.name: units.shown(float(point.solution.x[place]), each.dimension) for place, each in design_places(front)
    }
    return FrontPointData(
        goals=MappingProxyType(dict(zip(names, goal_values(front, point), strict=True))),
        optimised=names[point.program.optimised],
        bounds=MappingProxyType(
            {
                name: shown_goal(front, k, bound)
                for k, (name, bound) in enumerate(zip(names, point.bounds, strict=True))
                if bound is not None
            }
        ),
        status=point.solution.status,
        design=MappingProxyType(design),
        active=() if evidence is None else tuple(f"{side.name} {side.bound}" for side in evidence.active),
        multipliers=() if evidence is None else evidence.multipliers_in(units),
        kind=None if evidence is None else evidence.kind,
        stationarity=None if evidence is None else finite_or_none(evidence.stationarity),
        feasibility=None if evidence is None else finite_or_none(evidence.feasibility),
        certificate=certificate_data(point.certificate),
    )

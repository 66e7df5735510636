"""The front of several goals as CSV, in words, and as a table of text."""

from __future__ import annotations

from collections import Counter

from ..evidence.optimality import Evidence
from ..front.data import design_places, goal_bounds, goal_units, goal_values
from ..front.front import Front, FrontPoint
from ..front.goals import Goal
from ..program.program import design_names
from ..proof.certificate.certificate import CertificateStatus
from ..results.point import stated_pose_notice
from ..results.text import TextTable
from ..system.csvtext import csv_text
from ..units import Units

_SEPARATOR = "; "
#: Begins the name of the constraint that bounds F of a task.
_GOAL = "F of "


def front_csv(front: Front) -> str:
    """Return a row for each point of a front: goals, design, active limits, evidence, and the certificate."""
    units, places = front.case.units, design_places(front)
    # With two goals, one alone has a bound.
    bounds = ["bound"] if len(front.goals) == 2 else [f"bound of {goal.label}" for goal in front.goals]
    head = [
        *(goal.label for goal in front.goals),
        *("optimised", *bounds, "status", *(each.name for _, each in places), "active", "multipliers", "verdict"),
        *("stationarity", "feasibility", "curvature", "certificate", "proven_bound", "starts", "seconds"),
    ]
    rows: list[list[object]] = []
    for point in front.points:
        evidence, certificate = point.solution.evidence, point.certificate
        design = [units.shown(float(point.solution.x[place]), each.dimension) for place, each in places]
        given = goal_bounds(front, point)
        if len(given) == 2:
            given = [given[1 - point.program.optimised]]
        rows.append([
            *map(repr, goal_values(front, point)),
            front.goals[point.program.optimised].label,
            *given,
            point.solution.status.value,
            *design,
            *([None] * 6 if evidence is None else _evidence_cells(evidence, units)),
            *([None] * 2 if certificate is None else [certificate.status.value, certificate.bound]),
            len(point.solution.starts),
            point.solution.seconds,
        ])  # fmt: skip
    return csv_text(head, rows)


def front_words(front: Front) -> list[str]:
    """Return a front in a few lines."""
    values = [goal_values(front, point) for point in front.points]
    count = len(front.points)
    *first, last = map(_words, front.goals)
    lines = [f"{count} point{'s' * (count > 1)} on the front of {', '.join(first)} and {last}"]
    # A front of two goals runs from one end to the other.
    ends = [(values[0][k], values[-1][k]) for k in range(len(front.goals))]
    if len(front.goals) > 2:
        ends = [(min(column), max(column)) for column in zip(*values, strict=True)]
    lines += [f"{goal.label}: {low:.7g} to {high:.7g}" for goal, (low, high) in zip(front.goals, ends, strict=True)]
    notice = stated_pose_notice(front.case)
    lines += [] if notice is None else [notice]
    if front.gaps:
        lines.append(f"pairs of neighbours with a gap between them, in which no point was found: {len(front.gaps)}")
    if front.failed:
        lines.append(f"searches that found no optimum: {front.failed}")
    proofs = [point.certificate for point in front.points if point.certificate is not None]
    if proofs:
        proved = sum(each.status is CertificateStatus.PROVED for each in proofs)
        lines.append(f"{proved} of {len(proofs)} points are proved: no point of the box within its bound is better")
    return lines


def front_table(front: Front) -> TextTable:
    """Return a row for each point of a front: goals, whose optimum it is, its proof and its active limits."""
    proved = any(point.certificate is not None for point in front.points)
    units = (f"\n{unit}" if unit else "" for unit in goal_units(front))
    named = (f"{name}{unit}" for name, unit in zip(goal_names(front), units, strict=True))
    headers = (*named, "optimum of", *(("certificate",) if proved else ()), "active")
    rows = tuple(
        (
            *(f"{value:.7g}" for value in goal_values(front, point)),
            front.goals[point.program.optimised].label,
            *((point.certificate.status.value if point.certificate is not None else "",) if proved else ()),
            ", ".join(_counted(point)),
        )
        for point in front.points
    )
    return TextTable(headers, rows, extra=1, is_curve=True)


def goal_names(front: Front) -> list[str]:
    """Return each goal with its sense."""
    return [_words(goal) for goal in front.goals]


def _evidence_cells(evidence: Evidence, units: Units) -> list[object]:
    """Return the active sides, their multipliers, the verdict and the numbers that it rests on."""
    return [
        _SEPARATOR.join(f"{side.name} {side.bound}" for side in evidence.active),
        _SEPARATOR.join(repr(each) for each in evidence.multipliers_in(units)),
        *(evidence.kind.value, evidence.stationarity, evidence.feasibility),
        float(evidence.eigenvalues[0]) if len(evidence.eigenvalues) else None,
    ]


def _counted(point: FrontPoint) -> list[str]:
    """Return the active sides without the limbs and joints that they are about, and how many each stands for.

    Closed loops and joints of a robot say nothing about its design.
    """
    evidence, names = point.solution.evidence, design_names(point.solution.nlp.program)
    sides = [] if evidence is None else [side for side in evidence.active if side.name in names]
    # The bound of a goal has the name of its task.
    shown = (side.name if side.name.startswith(_GOAL) else side.name.split()[0] for side in sides)
    counts = Counter(f"{name} {side.bound}" for name, side in zip(shown, sides, strict=True))
    return [name if count == 1 else f"{name} ({count})" for name, count in counts.items()]


def _words(goal: Goal) -> str:
    return f"{goal.sense.value} {goal.label}"

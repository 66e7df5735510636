"""The front of two goals as CSV, in words, and as a table of text."""

from __future__ import annotations

import csv
import io
from collections import Counter

from ..certificate.certificate import CertificateStatus
from ..front.front import Front, FrontPoint
from ..front.goals import Goal
from ..program.places import Scalar
from ..results.text import TextTable
from ..results.tradeoffwording import unit_of_objective

_SEPARATOR = "; "


def front_csv(front: Front) -> str:
    """Return a row for each point of a front: goals, design, active limits, evidence, and the certificate."""
    units, variables = front.case.units, _variables(front)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([
        *(goal.label for goal in front.goals),
        *("optimised", "bound", "status", *(each.name for each in variables), "active", "multipliers", "verdict"),
        *("stationarity", "feasibility", "curvature", "certificate", "proven_bound", "starts", "seconds"),
    ])  # fmt: skip
    for point in front.points:
        evidence, certificate = point.solution.evidence, point.certificate
        design = [units.shown(float(v), each.dimension) for v, each in zip(point.solution.x, variables, strict=False)]
        writer.writerow([
            *map(repr, goal_values(front, point)),
            front.goals[point.program.optimised].label,
            "" if point.bound is None else _shown(front, 1 - point.program.optimised, point.bound),
            point.solution.status.value,
            *design,
            "" if evidence is None else _SEPARATOR.join(_active(point)),
            "" if evidence is None else _SEPARATOR.join(repr(side.multiplier) for side in evidence.active),
            "" if evidence is None else evidence.kind.value,
            "" if evidence is None else evidence.stationarity,
            "" if evidence is None else evidence.feasibility,
            "" if evidence is None or not len(evidence.eigenvalues) else float(evidence.eigenvalues[0]),
            "" if certificate is None else certificate.status.value,
            "" if certificate is None else certificate.bound,
            len(point.solution.starts),
            point.solution.seconds,
        ])  # fmt: skip
    return text.getvalue()


def goal_values(front: Front, point: FrontPoint) -> list[float]:
    """Return the goals of a point in the case's units."""
    return [_shown(front, k, float(value)) for k, value in enumerate(point.values)]


def front_words(front: Front) -> list[str]:
    """Return a front in a few lines."""
    ends = [goal_values(front, point) for point in (front.points[0], front.points[-1])]
    count = len(front.points)
    lines = [f"{count} point{'s' * (count > 1)} on the front of {_words(front.goals[0])} and {_words(front.goals[1])}"]
    lines += [f"{goal.label}: {ends[0][k]:.7g} to {ends[1][k]:.7g}" for k, goal in enumerate(front.goals)]
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
    return TextTable(headers, rows)


def goal_names(front: Front) -> list[str]:
    """Return each goal with its sense."""
    return [_words(goal) for goal in front.goals]


def goal_units(front: Front) -> list[str]:
    """Return the unit of each goal; an empty text for a plain number."""
    readings = [each[0].dimension for each in front.points[0].program.readings]
    return [
        front.case.units.label(dimension) if goal.task is None else unit_of_objective(front.case, goal.task)
        for goal, dimension in zip(front.goals, readings, strict=True)
    ]


def _active(point: FrontPoint) -> list[str]:
    evidence = point.solution.evidence
    return [] if evidence is None else [f"{side.name} {side.bound}" for side in evidence.active]


def _counted(point: FrontPoint) -> list[str]:
    """Return the active sides without the limbs and joints that they are about, and how many each stands for."""
    evidence = point.solution.evidence
    sides = [] if evidence is None else [f"{side.name.split()[0]} {side.bound}" for side in evidence.active]
    return [name if count == 1 else f"{name} ({count})" for name, count in Counter(sides).items()]


def _words(goal: Goal) -> str:
    return f"{goal.sense.value} {goal.label}"


def _shown(front: Front, k: int, value: float) -> float:
    """Return the value of a goal in the case's unit."""
    readings = front.points[0].program.readings[k]
    return front.case.units.shown(value, readings[0].dimension)


def _variables(front: Front) -> tuple[Scalar, ...]:
    """Return the free numbers of the case: those that the programs of both goals have."""
    return min((point.solution.nlp.program.variables for point in front.points), key=len)

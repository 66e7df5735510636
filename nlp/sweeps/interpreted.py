"""Points of a sweep solved one at a time by Ipopt from many starts, as the command ``solve`` does."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

from ..errors import CaseError, InputError, UncoveredError
from ..evidence.optimality import Evidence
from ..program.program import design_indices
from ..solver.certified import Certified, certify
from ..solver.solution import Solution
from ..solver.solve import solve
from .rows import REFUSED, Row, finite, with_evidence
from .source import CaseSource


def solve_point(
    source: CaseSource,
    settings: Mapping[str, float | list[float]],
    index: int,
    starts: int,
    seed: int | None,
    proof_seconds: float | None = None,
    *,
    at_stated_pose: bool = False,
) -> Row:
    """Return the row of one point.

    Args:
        source: the case.
        settings: the point's numbers by name.
        index: of the point.
        starts: number of starting points.
        seed: seed instead of the case's.
        proof_seconds: seconds for the certificate of the point; None for no certificate.
        at_stated_pose: whether limits over a workspace are taken at the stated pose alone.
    """
    began = time.perf_counter()
    try:
        case = source.case_at(settings)
        if at_stated_pose and case.workspace is not None:
            case = replace(case, workspace=replace(case.workspace, has_limits=False))
        solution = solve(case, starts=starts, seed=seed, jobs=1)
    except CaseError as error:
        return Row(index, REFUSED, None, seconds=time.perf_counter() - began, note=str(error))
    if proof_seconds is None:
        return row_of_solution(solution, index, time.perf_counter() - began)
    try:
        found = certify(solution, time_limit=proof_seconds, jobs=1)
    except (UncoveredError, InputError) as error:
        return row_of_solution(solution, index, time.perf_counter() - began)._replace(note=str(error))
    row = row_of_solution(found.solution, index, time.perf_counter() - began)
    return _with_certificate(row, found)


def _with_certificate(row: Row, found: Certified) -> Row:
    """Return a row with the certificate of the program that decides."""
    certificate = found.certificate
    if certificate is None:
        note = "tasks that are averaged have no one program: no one bound"
        return row._replace(note=note)
    return row._replace(
        certificate=certificate.status.value, bound=finite(certificate.bound), gap=finite(certificate.gap)
    )


def row_of_solution(solution: Solution, index: int, seconds: float) -> Row:
    """Return the row of a solution."""
    units, own = solution.case.units, solution.outcomes[0].own
    program = own.nlp.program
    decided = solution.decided_by
    evidence: Evidence | None = solution.evidence
    is_unproved = solution.workspace is not None and not solution.workspace.is_proved
    note = "not proved over the workspace" if is_unproved else ""
    row = Row(index, solution.status.value, None, engine="ipopt", seconds=seconds, note=note)
    row = row._replace(
        x=tuple(units.shown(float(solution.x[k]), program.variables[k].dimension) for k in design_indices(program))
    )
    if solution.status.is_answer:
        value = solution.F if solution.combination is None else solution.combination.value
        row = row._replace(F=None if value is None else finite(value))
    if decided is not None:
        converged = sum(optimum.count for optimum in decided.optima)
        row = row._replace(starts=len(decided.starts), converged=converged)
    return row if evidence is None else with_evidence(row, evidence)

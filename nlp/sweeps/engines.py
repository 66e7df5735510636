"""Engines of a sweep, made from a job that other processes and computers can read.

Ipopt solves points one at a time from many starts, like the command ``solve``. Compiled C solves many points at a time;
the evidence of the nonlinear program then judges each best point. Ipopt solves the points without convergence or
without evidence of an optimum again.
"""

from __future__ import annotations

import enum
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...models import Dimension, FloatArray
from ..case.task import Sense
from ..embedding.codegen import generate_c
from ..embedding.library import CompiledCase, CompiledSolutions, load_compiled
from ..errors import CaseError, EvaluationError, InputError, UncoveredError
from ..evidence.many import Verdicts, judge_many
from ..evidence.optimality import Evidence, PointKind, examine
from ..interruption import within
from ..program.program import design_indices
from ..proof.enclosure.engine import kernel
from ..solver.certified import Certified, certify
from ..solver.solution import Solution
from ..solver.solve import solve
from ..solver.status import Status
from ..system.jsonvalues import finite_or_none
from .journal import REFUSED, Row, with_evidence
from .places import Block, NotPlacedError, Places, existing_cases, place
from .points import CaseSource, PointBlock, Points


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
        source: case as text.
        settings: values of the varied quantities at the point, by name.
        index: index of the point.
        starts: number of starting points.
        seed: seed that replaces the seed of the case.
        proof_seconds: seconds for the certificate of the point; None for no certificate.
        at_stated_pose: If true, check limits over a workspace or along a path only at the stated pose.
    """
    began = time.perf_counter()
    try:
        case = source.case_at(settings)
        if at_stated_pose:
            case = case.at_stated_poses()
        solution = solve(case, starts=starts, seed=seed, jobs=1)
    except (CaseError, EvaluationError) as error:  # includes a robot that does not exist at the point
        return Row(index, REFUSED, None, seconds=time.perf_counter() - began, note=str(error))
    if proof_seconds is None:
        return row_of_solution(solution, index, time.perf_counter() - began)
    try:
        found = certify(solution, time_limit=proof_seconds, jobs=1)
    except (UncoveredError, InputError) as error:
        return row_of_solution(solution, index, time.perf_counter() - began)._replace(note=str(error))
    row = row_of_solution(found.solution, index, time.perf_counter() - began)
    return _with_certificate(row, found)


def _with_certificate(row: Row, certified: Certified) -> Row:
    """Return a row with the certificate of the final nonlinear program."""
    certificate = certified.certificate
    if certificate is None:
        note = "no certificate: averaged tasks are not one nonlinear program"
        return row._replace(note=note)
    return row._replace(
        certificate=certificate.status.value,
        bound=finite_or_none(certificate.bound),
        gap=finite_or_none(certificate.gap),
    )


def row_of_solution(solution: Solution, index: int, seconds: float) -> Row:
    """Return the row of a solution."""
    units, program = solution.case.units, solution.whole.program
    decided = solution.decided_by
    evidence: Evidence | None = solution.evidence
    note = "" if solution.keeps_limits else f"not proved {solution.case.limits_where}"
    row = Row(index, solution.status.value, None, engine="ipopt", seconds=seconds, note=note)
    row = row._replace(
        x=tuple(units.shown(float(solution.x[k]), program.variables[k].dimension) for k in design_indices(program))
    )
    if solution.status.is_answer:
        value = solution.F if solution.combination is None else solution.combination.value
        row = row._replace(F=None if value is None else finite_or_none(value))
    if decided is not None:
        converged = sum(optimum.count for optimum in decided.optima)
        row = row._replace(starts=len(decided.starts), converged=converged)
    return row if evidence is None else with_evidence(row, evidence, units)


#: Number of starting points in the table of the generated C.
MOST_STARTS = 16


class Solved(NamedTuple):
    """Points after their solve in compiled C.

    Attributes:
        indices: indices of the points.
        values: (N, m) varied values at the points.
        block: data of the nonlinear program at the points.
        found: results of the solver in C.
        seconds: wall time of the block.
    """

    indices: Sequence[int]
    values: FloatArray
    block: Block
    found: CompiledSolutions
    seconds: float


class CompiledEngine:
    """Engine that solves blocks of points by compiled C; points without evidence of optimality are solved by Ipopt.

    Args:
        source: case as text.
        chosen: points at which the nonlinear program is compared with newly formulated ones.
        starts: number of searches per point, at most ``MOST_STARTS``.
        seed: seed of Ipopt's starting points that replaces the seed of the case.
        threads: number of threads; None for the number of processors.

    Raises:
        NotPlacedError: a single nonlinear program does not cover all points, or C cannot be generated.
        CaseError: a name is unknown in the case, or a value is not allowed.
        InputError: there is no C compiler, or it fails.
    """

    def __init__(
        self, source: CaseSource, chosen: Points, starts: int, seed: int | None, threads: int | None = None
    ) -> None:
        if starts > MOST_STARTS:
            raise NotPlacedError(f"compiled C has at most {MOST_STARTS} starting points, but {starts} are requested")
        self.source, self.names, self.starts, self.seed, self.threads = source, chosen.names, starts, seed, threads
        self.places: Places = place(source, chosen)
        self.library = _compile(self.places)
        sides = self.places.nlp.sides.sides
        self._side_names = [f"{side.name} {side.bound}" for side in sides]
        # Ipopt treats its points in the same way.
        self._note = self.places.nlp.case.stated_pose_notice
        self._slopes: dict[tuple[int, float], float] = {}

    def solve(self, indices: Sequence[int], values: FloatArray) -> Solved:
        """Solve points with values (N, m) by compiled C."""
        began = time.perf_counter()
        block = self.places.block(values)
        numbers = block.numbers
        bounded = bool(self.places.bounds)  # true if bounds of variables vary
        found = self.library.solve(
            p=numbers.arguments,
            lower=numbers.lower if bounded else None,
            upper=numbers.upper if bounded else None,
            limits=block.limits,
            seeds=self.starts,
            threads=self.threads,
        )
        return Solved(indices, values, block, found, time.perf_counter() - began)

    def rows(self, solved: Solved) -> list[Row]:
        """Return the rows of solved points."""
        began = time.perf_counter()
        found, block = solved.found, solved.block
        verdicts = judge_many(self.places.nlp, found.x, block.numbers)
        is_good = found.ok & block.is_placed
        nlp, unit = self.places.nlp, self.places.nlp.case.units
        shown = found.x.copy()
        for j, each in enumerate(nlp.program.variables):
            if each.dimension is Dimension.ANGLE and unit.angle == "deg":
                shown[:, j] = np.degrees(shown[:, j])
        strict = PointKind.STRICT_MAXIMUM if nlp.sense is Sense.MAX else PointKind.STRICT_MINIMUM
        share = (solved.seconds + time.perf_counter() - began) / len(solved.indices)
        rows: list[Row] = []
        for k, index in enumerate(solved.indices):
            row = Row(
                index,
                Status.OPTIMAL.value,
                float(verdicts.F[k]),
                x=tuple(shown[k].tolist()),
                starts=int(found.runs[k]),
                converged=int(found.converged[k]),
                engine="compiled",
                seconds=share,
                note=self._note,
            )
            if is_good[k] and verdicts.is_strict[k]:
                rows.append(self._with_verdict(row, verdicts, block, k, strict))
                continue
            examined = self._with_evidence(row, block, found.x[k], k) if is_good[k] else None
            if examined is None:
                settings = dict(zip(self.names, solved.values[k].tolist(), strict=True))
                examined = solve_point(
                    self.source, settings, index, self.starts, self.seed, at_stated_pose=bool(self._note)
                )
                examined = examined._replace(note=examined.note or self._note)
            rows.append(examined)
        return rows

    def _with_verdict(self, row: Row, verdicts: Verdicts, block: Block, k: int, kind: PointKind) -> Row:
        """Return a row with the evidence of a strict optimum."""
        sides = np.flatnonzero(verdicts.active[k])
        return row._replace(
            active=tuple(self._side_names[j] for j in sides),
            multipliers=tuple(self._multiplier(verdicts, block, k, int(j)) for j in sides),
            verdict=kind.value,
            stationarity=finite_or_none(verdicts.stationarity[k]),
            feasibility=finite_or_none(verdicts.feasibility[k]),
            curvature=finite_or_none(verdicts.curvature[k]),
        )

    def _with_evidence(self, row: Row, block: Block, x: FloatArray, k: int) -> Row | None:
        """Return a row with evidence that is computed for a single point; None if the point is not an optimum."""
        evidence = examine(block.numbers.put_into(self.places.nlp, k), x)
        return with_evidence(row, evidence, self.places.nlp.case.units) if evidence.kind.is_optimum else None

    def _multiplier(self, verdicts: Verdicts, block: Block, k: int, j: int) -> float:
        """Return the multiplier of side j at point k in F per unit of its limit."""
        value = float(verdicts.multipliers[k, j] * verdicts.weights[k, j])
        nlp = self.places.nlp
        side, units = nlp.sides.sides[j], nlp.case.units
        if side.constraint is None:
            return units.per_unit(value, nlp.program.variables[side.variable or 0].dimension)
        reading = nlp.program.constraints[side.constraint].reading
        bounds = block.numbers.g_lower if side.bound == "min" else block.numbers.g_upper
        limit = float(bounds[k, side.constraint])
        key = (side.constraint, limit)
        if key not in self._slopes:
            self._slopes[key] = units.per_unit(reading.slope(limit), reading.dimension)
        return value * self._slopes[key]


def _compile(places: Places) -> CompiledCase:
    """Return the compiled solver of the nonlinear program of the places.

    Raises:
        NotPlacedError: C cannot be generated for the case, or differs from the program in variables or parameters.
        InputError: there is no C compiler, or it fails.
    """
    with tempfile.TemporaryDirectory(prefix="screwsynth.") as folder:
        try:
            files = generate_c(places.nlp.case)
        except CaseError as error:
            raise NotPlacedError(f"C cannot be generated for this case: {error}") from None
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        library = load_compiled(folder)
    program = places.nlp.program
    wanted = [each.name for each in program.variables], [each.name for each in program.arguments]
    if wanted != ([each.name for each in library.variables], [each.name for each in library.parameters]):
        raise NotPlacedError("the generated C has other parameters than the nonlinear program")
    return library


class EngineKind(enum.Enum):
    """Kind of an engine; each value is the word of ``--engine``."""

    COMPILED = "compiled"
    IPOPT = "ipopt"

    @classmethod
    def of(cls, word: str | None) -> EngineKind | None:
        """Return the kind of a word; None for None.

        Raises:
            InputError: there is no such kind.
        """
        if word not in (None, *(kind.value for kind in cls)):
            raise InputError(f"--engine {word}: must be compiled or ipopt")
        return None if word is None else cls(word)


class Job(NamedTuple):
    """Sweep without points: case, names and settings.

    Attributes:
        source: case as text.
        names: varied parameters, bounds and limits.
        chosen: values at the points at which nonlinear programs are compared.
        starts: number of searches per point.
        seed: seed that replaces the seed of the case.
        kind: kind of the engine.
        certified: If true, also compute a certificate for each point.
    """

    source: CaseSource
    names: tuple[str, ...]
    chosen: tuple[tuple[float, ...], ...]
    starts: int
    seed: int | None
    kind: EngineKind
    certified: bool = False

    @property
    def points(self) -> Points:
        """Points at which nonlinear programs are compared."""
        return Points(self.names, np.array(self.chosen))


class Choice(NamedTuple):
    """Kind of engine, and the reason why Ipopt is used; the reason is empty for a compiled or a requested engine."""

    kind: EngineKind
    reason: str


def choose_engine(job: Job, wanted: EngineKind | None, threads: int | None) -> Choice:
    """Return the kind of engine for a job: the compiled engine if it covers the job.

    Args:
        job: job of the sweep.
        wanted: requested kind; None for none.
        threads: number of threads, as for :func:`compiled_engine`.

    Raises:
        CaseError: a name is unknown in the case, or a value is not allowed.
        InputError: the requested compiled engine is not available, or certificates are requested and not available.
    """
    if job.certified and wanted is EngineKind.COMPILED:
        raise InputError("--engine compiled: conflicts with --certify; leave out one of them")
    if wanted is EngineKind.IPOPT or job.certified:
        cases = [case for _, case in existing_cases(job.source, job.points)]
        if job.certified or any(each.limits_over for each in cases):
            kernel()  # an error before any solve if it is missing
        return Choice(EngineKind.IPOPT, "" if wanted else "certificates need solves by Ipopt")
    try:
        compiled_engine(job, threads)
    except CaseError:
        raise
    except (NotPlacedError, InputError) as error:
        if wanted is EngineKind.COMPILED:
            raise InputError(f"--engine compiled: {error}") from None
        for _ in existing_cases(job.source, job.points):
            pass
        return Choice(EngineKind.IPOPT, str(error))
    return Choice(EngineKind.COMPILED, "")


def answer(job: Job, block: PointBlock) -> list[Row]:
    """Return the rows of a block of points, solved by one thread."""
    if job.kind is EngineKind.COMPILED:
        engine = compiled_engine(job, 1)
        return engine.rows(engine.solve(block.indices, block.values))
    seconds, names = block.proof_seconds if job.certified else None, job.names
    with within(block.seconds):
        return [
            solve_point(job.source, dict(zip(names, row.tolist(), strict=True)), index, job.starts, job.seed, seconds)
            for index, row in zip(block.indices, block.values, strict=True)
        ]


@lru_cache(maxsize=2)
def _engine(job: Job, threads: int | None) -> CompiledEngine:
    return CompiledEngine(job.source, job.points, job.starts, job.seed, threads)


def compiled_engine(job: Job, threads: int | None) -> CompiledEngine:
    """Return the compiled engine of a job, made once per process.

    Args:
        job: job of any kind.
        threads: number of threads; None for the number of processors.

    Raises:
        NotPlacedError: a single nonlinear program does not cover all points.
        CaseError: a name is unknown in the case, or a value is not allowed.
        InputError: there is no C compiler, or it fails.
    """
    return _engine(job._replace(kind=EngineKind.COMPILED), threads)

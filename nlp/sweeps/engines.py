"""Engines of a sweep, made from a job that other processes and machines can read.

Ipopt solves points one at a time from many starts, as the command ``solve`` does. The compiled program solves many at a
time, each winner judged by the program's own evidence. A point whose search did not converge, or whose winner the
evidence does not call an optimum, is given to Ipopt.
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
        source: the case.
        settings: the point's numbers by name.
        index: of the point.
        starts: number of starting points.
        seed: seed instead of the case's.
        proof_seconds: seconds for the certificate of the point; None for no certificate.
        at_stated_pose: whether limits over a workspace or along a path are taken at the stated pose alone.
    """
    began = time.perf_counter()
    try:
        case = source.case_at(settings)
        if at_stated_pose:
            case = case.at_stated_poses()
        solution = solve(case, starts=starts, seed=seed, jobs=1)
    except (CaseError, EvaluationError) as error:  # also a robot that does not exist there
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
        certificate=certificate.status.value,
        bound=finite_or_none(certificate.bound),
        gap=finite_or_none(certificate.gap),
    )


def row_of_solution(solution: Solution, index: int, seconds: float) -> Row:
    """Return the row of a solution."""
    units, own = solution.case.units, solution.outcomes[0].own
    program = own.nlp.program
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
    """Points as the compiled solver left them.

    Attributes:
        indices: of the points.
        values: (N, m) numbers of the sweep there.
        block: numbers of the program there.
        found: answers of the solver in C.
        seconds: wall time.
    """

    indices: Sequence[int]
    values: FloatArray
    block: Block
    found: CompiledSolutions
    seconds: float


class CompiledEngine:
    """Engine that solves a block of points by compiled C, and gives Ipopt what the evidence does not accept.

    Args:
        source: the case.
        chosen: points of the sweep at which its program is compared with those of cases read anew.
        starts: number of searches at each point, at most ``MOST_STARTS``.
        seed: of Ipopt's starting points instead of the case's.
        threads: number of threads; as many as there are processors where None.

    Raises:
        NotPlacedError: one program does not serve all points, or no compiler does.
        CaseError: the case has no number of a name, or does not allow a value.
        InputError: there is no C compiler, or it fails.
    """

    def __init__(
        self, source: CaseSource, chosen: Points, starts: int, seed: int | None, threads: int | None = None
    ) -> None:
        if starts > MOST_STARTS:
            raise NotPlacedError(f"compiled C has {MOST_STARTS} starting points, and {starts} are wanted")
        self.source, self.names, self.starts, self.seed, self.threads = source, chosen.names, starts, seed, threads
        self.places: Places = place(source, chosen)
        self.library = _compile(self.places)
        sides = self.places.nlp.sides.sides
        self._side_names = [f"{side.name} {side.bound}" for side in sides]
        # All points are solved in one way, those that Ipopt solves too.
        self._note = self.places.nlp.case.stated_pose_notice
        self._slopes: dict[tuple[int, float], float] = {}

    def solve(self, indices: Sequence[int], values: FloatArray) -> Solved:
        """Solve points with values (N, m) by compiled C."""
        began = time.perf_counter()
        block = self.places.block(values)
        numbers = block.numbers
        bounded = bool(self.places.bounds)  # whether bounds of variables change
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
        """Return a row with evidence that is computed for its point alone; None where that is no optimum."""
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
    """Return the solver in C of the places' program.

    Raises:
        NotPlacedError: C is not generated for the case, or has other variables or numbers than the program.
        InputError: there is no C compiler, or it fails.
    """
    with tempfile.TemporaryDirectory(prefix="screwsynth.") as folder:
        try:
            files = generate_c(places.nlp.case)
        except CaseError as error:
            raise NotPlacedError(f"C is not generated for this case: {error}") from None
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        library = load_compiled(folder)
    program = places.nlp.program
    wanted = [each.name for each in program.variables], [each.name for each in program.arguments]
    if wanted != ([each.name for each in library.variables], [each.name for each in library.parameters]):
        raise NotPlacedError("the generated C has other numbers than the program")
    return library


class EngineKind(enum.Enum):
    """Kind of an engine; each value is the word of ``--engine``."""

    COMPILED = "compiled"
    IPOPT = "ipopt"

    @classmethod
    def of(cls, word: str | None) -> EngineKind | None:
        """Return the kind of a word; None where none is given.

        Raises:
            InputError: there is no such kind.
        """
        if word not in (None, *(kind.value for kind in cls)):
            raise InputError(f"--engine {word}: must be compiled or ipopt")
        return None if word is None else cls(word)


class Job(NamedTuple):
    """A sweep without its points.

    Attributes:
        source: the case.
        names: numbers that change.
        chosen: their values at the points at which programs are compared.
        starts: number of searches at each point.
        seed: seed instead of the case's.
        kind: of the engine.
        certified: whether the optimum at each point is proved too.
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
        """The points at which programs are compared."""
        return Points(self.names, np.array(self.chosen))


class Choice(NamedTuple):
    """A kind of engine, and the reason why it is not the compiled one; empty where it is, or was asked for."""

    kind: EngineKind
    reason: str


def choose_engine(job: Job, wanted: EngineKind | None, threads: int | None) -> Choice:
    """Return the kind of engine for a job: the compiled one where it covers the job.

    Args:
        job: the job.
        wanted: the kind that is asked for; None for none.
        threads: as for :func:`compiled_engine`.

    Raises:
        CaseError: the case has no number of a name, or does not allow a value.
        InputError: the compiled engine is asked for and cannot be had, or something is to be proved and cannot be.
    """
    if job.certified and wanted is EngineKind.COMPILED:
        raise InputError("--engine compiled: has no certificates; leave it out, or leave out --certify")
    if wanted is EngineKind.IPOPT or job.certified:
        cases = [case for _, case in existing_cases(job.source, job.points)]
        if job.certified or any(each.limits_over for each in cases):
            kernel()  # before any solve where it is missing
        return Choice(EngineKind.IPOPT, "" if wanted else "a certificate is of one solve by Ipopt")
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
    """Return the rows of a block of points by one thread."""
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
    """Return the compiled engine of a job, made once in each process.

    Args:
        job: the job; its kind does not matter.
        threads: number of threads; as many as there are processors where None.

    Raises:
        NotPlacedError: one program does not serve all points.
        CaseError: the case has no number of a name, or does not allow a value.
        InputError: there is no C compiler, or it fails.
    """
    return _engine(job._replace(kind=EngineKind.COMPILED), threads)

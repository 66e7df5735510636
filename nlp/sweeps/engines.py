"""Engines of a sweep, made from a job that other processes and machines can read."""

from __future__ import annotations

import enum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..errors import CaseError, InputError
from ..interruption import within
from ..proof.enclosure.engine import kernel
from .compiled import CompiledEngine
from .interpreted import solve_point
from .places import NotPlacedError
from .points import PointBlock, Points
from .rows import Row
from .source import CaseSource


class EngineKind(enum.Enum):
    """Kind of an engine; each value is the word of ``--engine``."""

    COMPILED = "compiled"
    IPOPT = "ipopt"


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
        cases = [job.source.case_at(dict(zip(job.names, values, strict=True))) for values in job.chosen]
        if job.certified or any(each.workspace and each.workspace.has_limits for each in cases):
            kernel()  # before any solve where it is missing
        return Choice(EngineKind.IPOPT, "" if wanted else "a certificate is of one solve by Ipopt")
    try:
        compiled_engine(job, threads)
    except CaseError:
        raise
    except (NotPlacedError, InputError) as error:
        if wanted is EngineKind.COMPILED:
            raise InputError(f"--engine compiled: {error}") from None
        for values in job.chosen:
            job.source.case_at(dict(zip(job.names, values, strict=True)))
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
    chosen = Points(job.names, np.array(job.chosen))
    return CompiledEngine(job.source, chosen, job.starts, job.seed, threads)


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

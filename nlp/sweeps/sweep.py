"""Run of a sweep, from its points to the rows of its journal."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from .. import __version__
from ..case.case import Case
from ..interruption import is_interrupted, is_requested, one_call, seconds_left
from ..program.formulation import formulate_whole
from ..program.program import design_indices
from .engines import EngineKind, Job, answer, choose_engine, compiled_engine
from .journal import ENDING, Journal, Row
from .points import CaseSource, PointBlock, Points
from .workers import answer_in_processes, answer_on_cluster

#: Number of points in a block: enough for efficient arrays, and about a third of a second of work.
_BLOCK = 512
#: Largest time for the certificate of a point, seconds.
PROOF_SECONDS = 60.0
#: Number of searches per point without ``--starts``.
STARTS = 8

#: Function called after each block with the number of points solved before this run, the number solved in this run, the
#: number missing at its beginning, and its seconds.
SweepProgress = Callable[[int, int, int, float], None]


@dataclass(frozen=True, eq=False)
class Sweep:
    """Sweep before its run.

    Attributes:
        source: case as text.
        points: points of the sweep.
        variables: names of the design variables.
        starts: number of searches per point.
        seed: seed that replaces the seed of the case.
        certified: If true, also compute a certificate for each point.
    """

    source: CaseSource
    points: Points
    variables: tuple[str, ...]
    starts: int = STARTS
    seed: int | None = None
    certified: bool = False

    @classmethod
    def of(
        cls,
        source: CaseSource,
        points: Points,
        starts: int | None = None,
        seed: int | None = None,
        *,
        certified: bool = False,
    ) -> Sweep:
        """Return the sweep of a case.

        Raises:
            CaseError: a name is unknown in the case, or the values of the first point are not allowed.
        """
        program = formulate_whole(source.case_at(points.settings(0))).program
        names = tuple(program.variables[k].name for k in design_indices(program))
        return cls(source, points, names, STARTS if starts is None else starts, seed, certified)

    @property
    def fingerprint(self) -> str:
        """Hash of everything that determines the rows: case, points, starts, seed, certificates and version."""
        parts = (__version__, *self.source, self.points.names, self.starts, self.seed, self.certified)
        hashed = hashlib.sha256(repr(parts).encode())
        hashed.update(np.ascontiguousarray(self.points.values).tobytes())
        return hashed.hexdigest()[:32]

    @property
    def case(self) -> Case:
        """Case at the first point."""
        return self.source.case_at(self.points.settings(0))

    def journal_of(self, out: str, file: str | None = None) -> Journal:
        """Return the journal beside the file of a table, or in the given file.

        Raises:
            InputError: the journal belongs to another sweep, is locked by another process, or cannot be written.
        """
        return Journal(Path(file or f"{out}{ENDING}"), self.fingerprint, len(self.points))


@one_call
def run_sweep(
    sweep: Sweep,
    journal: Journal,
    *,
    engine: EngineKind | None = None,
    jobs: int | None = None,
    dask: str | None = None,
    progress: SweepProgress | None = None,
    notice: Callable[[str], None] | None = None,
) -> None:
    """Solve the missing points of a journal, and append their rows, until the time ends.

    Args:
        sweep: sweep to run.
        journal: journal of the sweep.
        engine: requested engine; None for the compiled engine if it covers the sweep.
        jobs: number of threads, or of processes for Ipopt; None for the number of processors.
        dask: address of a Dask cluster for the computation; None for this computer.
        progress: function called after each block.
        notice: function called with the reason if Ipopt replaces the compiled engine.

    Raises:
        CaseError: a name is unknown in the case, or the smallest or largest value of a name is not allowed.
        InputError: the engine or the cluster is not available, or the journal cannot be written.
    """
    missing = journal.missing
    if not len(missing):
        return
    chosen = tuple(map(tuple, sweep.points.chosen().values.tolist()))
    job = Job(sweep.source, sweep.points.names, chosen, sweep.starts, sweep.seed, EngineKind.COMPILED, sweep.certified)
    choice = choose_engine(job, engine, jobs)
    if choice.reason and notice is not None:
        notice(f"Ipopt solves the points one by one: {choice.reason}")
    job = job._replace(kind=choice.kind)
    count = jobs or os.cpu_count() or 1
    blocks = _blocks(sweep.points, missing, _BLOCK if choice.kind is EngineKind.COMPILED else 1, count)
    if dask is not None:
        answers = answer_on_cluster(job, blocks, dask)
    elif choice.kind is EngineKind.COMPILED:
        answers = _answer_in_threads(job, blocks, jobs)
    elif min(count, len(missing)) > 1:
        answers = answer_in_processes(job, blocks, min(count, len(missing)))
    else:
        answers = (answer(job, block) for block in blocks)
    began, before, done = time.perf_counter(), len(sweep.points) - len(missing), 0
    for rows in answers:
        if is_requested():  # a stopped search gives no result
            if is_interrupted():
                raise KeyboardInterrupt
            return
        journal.add(rows)
        done += len(rows)
        if progress is not None:
            progress(before, done, len(missing), time.perf_counter() - began)


def _blocks(
    points: Points, missing: np.ndarray[tuple[int, ...], np.dtype[np.intp]], size: int, count: int
) -> Iterator[PointBlock]:
    """Yield blocks of the missing points until the time ends: points with the same quotient of index and block size.

    Each of the points that are solved at a time has an equal part of the remaining time for its certificate.
    """
    left = len(missing)
    for _, group in groupby(missing.tolist(), key=lambda index: index // size):
        if is_requested():
            return
        # One more than needed, so that the last proof ends before the time, after which no result is accepted.
        indices, seconds, rounds = list(group), seconds_left(), 1 + math.ceil(left / count)
        yield PointBlock(indices, points.values[indices], seconds, min(PROOF_SECONDS, seconds / rounds))
        left -= len(indices)


def _answer_in_threads(job: Job, blocks: Iterator[PointBlock], threads: int | None) -> Iterator[list[Row]]:
    """Solve blocks by the compiled engine, while the evidence for the previous block is computed."""
    engine = compiled_engine(job, threads)
    with ThreadPoolExecutor(1) as ahead:
        following = next(blocks, None)
        solving = None if following is None else ahead.submit(engine.solve, following.indices, following.values)
        while solving is not None:
            solved = solving.result()
            following = next(blocks, None)
            solving = None if following is None else ahead.submit(engine.solve, following.indices, following.values)
            yield engine.rows(solved)

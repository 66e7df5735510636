"""A sweep from its points to the rows of its journal."""

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
from ..program.formulation import formulate
from ..program.program import design_indices
from .engines import EngineKind, Job, answer, choose_engine, compiled_engine
from .journal import ENDING, Journal, Row
from .points import CaseSource, PointBlock, Points
from .workers import answer_in_processes, answer_on_cluster

#: Points that are solved and judged together: enough for arrays to pay, and about a third of a second of work.
_BLOCK = 512
#: Seconds that the proof of a point takes at most.
PROOF_SECONDS = 60.0
#: Searches at each point without ``--starts``.
STARTS = 8

#: Called after each block with the numbers of points done before this run, done now and to be done, and seconds.
SweepProgress = Callable[[int, int, int, float], None]


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep before its run.

    Attributes:
        source: the case.
        points: its points.
        variables: names of the free numbers of a design.
        starts: number of searches at each point.
        seed: seed instead of the case's.
        certified: whether the optimum at each point is proved too.
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
            CaseError: the case has no number of a name, or does not allow the first point's.
        """
        program = formulate(source.case_at(points.settings(0))).program
        names = tuple(program.variables[k].name for k in design_indices(program))
        return cls(source, points, names, STARTS if starts is None else starts, seed, certified)

    @property
    def fingerprint(self) -> str:
        """Hash of what the rows depend on: case, points, starts, seed, certificates and version."""
        parts = (__version__, *self.source, self.points.names, self.starts, self.seed, self.certified)
        hashed = hashlib.sha256(repr(parts).encode())
        hashed.update(np.ascontiguousarray(self.points.values).tobytes())
        return hashed.hexdigest()[:32]

    @property
    def case(self) -> Case:
        """The case at the first point."""
        return self.source.case_at(self.points.settings(0))

    def journal_of(self, out: str, file: str | None = None) -> Journal:
        """Return the journal beside a table's file, or in a file of its own.

        Raises:
            InputError: it belongs to another sweep, is held by another process, or cannot be written.
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
    """Solve the points that a journal lacks, and append their rows as they finish, until the time is over.

    Args:
        sweep: the sweep.
        journal: its journal.
        engine: the engine; None for the compiled one where it covers the sweep.
        jobs: number of threads, or of processes for Ipopt; as many as there are processors where None.
        dask: address of a Dask cluster that does the work; None for this machine.
        progress: called after each block.
        notice: called with the reason where Ipopt does the work of the compiled engine.

    Raises:
        CaseError: the case has no number of a name, or does not allow one's smallest or largest value.
        InputError: the engine, the cluster or the journal's file is not to be had.
    """
    missing = journal.missing
    if not len(missing):
        return
    chosen = tuple(map(tuple, sweep.points.chosen().values.tolist()))
    job = Job(sweep.source, sweep.points.names, chosen, sweep.starts, sweep.seed, EngineKind.COMPILED, sweep.certified)
    choice = choose_engine(job, engine, jobs)
    if choice.reason and notice is not None:
        notice(f"Ipopt solves each point by itself: {choice.reason}")
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
        if is_requested():  # a search that was stopped is no answer
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
    """Yield blocks of the missing points until the time is over: those with the same quotient of index by size.

    So many points are answered at a time: each has an equal part of the time left for its proof.
    """
    left = len(missing)
    for _, group in groupby(missing.tolist(), key=lambda index: index // size):
        if is_requested():
            return
        # One more than needed: the last proof ends before the time does, after which no answer is taken.
        indices, seconds, rounds = list(group), seconds_left(), 1 + math.ceil(left / count)
        yield PointBlock(indices, points.values[indices], seconds, min(PROOF_SECONDS, seconds / rounds))
        left -= len(indices)


def _answer_in_threads(job: Job, blocks: Iterator[PointBlock], threads: int | None) -> Iterator[list[Row]]:
    """Answer blocks by the compiled engine: the next one is solved while the evidence judges one."""
    engine = compiled_engine(job, threads)
    with ThreadPoolExecutor(1) as ahead:
        following = next(blocks, None)
        solving = None if following is None else ahead.submit(engine.solve, following.indices, following.values)
        while solving is not None:
            solved = solving.result()
            following = next(blocks, None)
            solving = None if following is None else ahead.submit(engine.solve, following.indices, following.values)
            yield engine.rows(solved)

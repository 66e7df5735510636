"""Blocks of a sweep solved in several processes, or on a Dask cluster.

A worker process reads its blocks from a pipe, and ends when the other end is closed, so a killed run leaves no process
behind. If a worker dies, a new worker gets its block.
"""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

from ..errors import InputError
from ..interruption import WRITING
from .engines import Job, answer
from .journal import Row
from .points import PointBlock

#: Number of workers that may die with one block; then the block is the cause.
_DEATHS = 3


class _Worker(NamedTuple):
    """Worker process with this end of its pipe."""

    process: BaseProcess
    pipe: Connection


def answer_in_processes(job: Job, blocks: Iterable[PointBlock], count: int) -> Iterator[list[Row]]:
    """Solve blocks in several processes.

    Args:
        job: job of the sweep.
        blocks: blocks of points.
        count: number of processes.

    Yields:
        Rows of each block, in the order of completion.

    Raises:
        InputError: a block ends every process that tries to solve it.
    """
    waiting, source = deque[PointBlock](), iter(blocks)
    busy: dict[Connection, tuple[_Worker, PointBlock]] = {}
    deaths: dict[int, int] = {}
    idle = deque(_start(job) for _ in range(count))
    workers = set(idle)
    try:
        while True:
            while idle:
                block = waiting.popleft() if waiting else next(source, None)
                if block is None:
                    break
                worker = idle.popleft()
                worker.pipe.send(block)
                busy[worker.pipe] = worker, block
            if not busy:
                return
            ready = wait(list(busy))
            for worker, block in [busy.pop(pipe) for pipe in list(busy) if pipe in ready]:
                try:
                    rows = worker.pipe.recv()
                except (EOFError, OSError):
                    first = block.indices[0]
                    deaths[first] = deaths.get(first, 0) + 1
                    if deaths[first] >= _DEATHS:
                        fault = f"{_DEATHS} processes ended without a result; the results of earlier points are kept"
                        raise InputError(f"point {first}: {fault}") from None
                    workers.discard(worker)
                    waiting.append(block)
                    idle.append(_start(job))
                    workers.add(idle[-1])
                    continue
                idle.append(worker)
                yield rows
    finally:
        for worker in workers:
            worker.pipe.close()
            worker.process.terminate()
            worker.process.join()


def _start(job: Job) -> _Worker:
    """Start a worker as a new process, because a copy of this process would lose its threads."""
    context = get_context("spawn")
    mine, its = context.Pipe()
    process = context.Process(target=_serve, args=(its, job), daemon=True)
    # Without the job, the worker would show an error: this process must not end before it sends the job.
    with WRITING, _without_interrupts():
        process.start()
    its.close()
    return _Worker(process, mine)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block interrupts in processes that start in this block: Ctrl-C goes to every process, also during its start."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Otherwise it starts with the first worker, and unblocks interrupts.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection, job: Job) -> None:
    """Solve blocks until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # if it could not be blocked; the main process closes the pipe
    while True:
        try:
            block = pipe.recv()
            pipe.send(answer(job, block))
        except (EOFError, OSError):
            return


#: Seconds to wait for an answer of the cluster's scheduler.
_WAIT = 5
#: Blocks at the cluster per thread: enough to keep it busy, few enough for the memory of this computer.
_AHEAD = 3
#: Number of repetitions of a block after the loss of its worker.
_RETRIES = 5


def answer_on_cluster(job: Job, blocks: Iterable[PointBlock], address: str) -> Iterator[list[Row]]:
    """Solve blocks on a cluster, whose workers need this package and, for the compiled engine, a C compiler.

    Args:
        job: job of the sweep.
        blocks: blocks of points.
        address: address of the scheduler, such as ``tcp://10.0.0.1:8786``.

    Yields:
        Rows of each block, in the order of completion.

    Raises:
        InputError: Dask is not installed, no cluster answers, or a block is lost repeatedly.
    """
    if find_spec("distributed") is None:
        raise InputError("--dask needs distributed, which is not installed: pip install 'screwsynth[dask]'")
    import distributed  # noqa: PLC0415 - few sweeps need a cluster

    dask: Any = distributed  # its functions have no type annotations

    try:
        client = dask.Client(address, timeout=_WAIT, set_as_default=False)
    except (OSError, ValueError, TypeError):
        raise InputError(
            f"--dask {address}: no Dask scheduler answers at this address within {_WAIT} seconds"
        ) from None
    source = iter(blocks)
    with client:
        given: dict[str, tuple[PointBlock, int]] = {}

        def submit(block: PointBlock, tries: int) -> Any:  # noqa: ANN401 - a future of Dask's
            future = client.submit(answer, job, block, pure=False, retries=1)
            given[future.key] = block, tries
            return future

        threads = max(1, sum(client.nthreads().values()))
        first = [submit(block, 0) for _, block in zip(range(_AHEAD * threads), source, strict=False)]
        running = dask.as_completed(first, loop=client.loop)
        for future in running:
            block, tries = given.pop(future.key)
            error = future.exception() if future.status != "cancelled" else OSError("cancelled")
            if error is not None:
                if tries >= _RETRIES:
                    fault = (
                        f"the worker that solved point {block.indices[0]} was lost {tries + 1} times: "
                        f"{type(error).__name__}: {error}"
                    )
                    raise InputError(f"--dask {address}: {fault}; the results of earlier points are kept")
                running.add(submit(block, tries + 1))
                continue
            yield future.result()
            following = next(source, None)
            if following is not None:
                running.add(submit(following, 0))

"""Blocks of a sweep answered on a Dask cluster by its address."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from typing import Any

from ..errors import InputError
from .engines import Job, answer
from .points import PointBlock
from .rows import Row

#: Seconds to wait for an answer of the cluster's scheduler.
_WAIT = 5
#: Blocks at the cluster for each of its threads: enough to keep it busy, few enough to fit into this memory.
_AHEAD = 3
#: Number of times that a block is given to the cluster again after its worker was lost.
_RETRIES = 5


def answer_on_cluster(job: Job, blocks: Iterable[PointBlock], address: str) -> Iterator[list[Row]]:
    """Answer blocks on a cluster, whose workers need this package and, for the compiled engine, a C compiler.

    Args:
        job: the job.
        blocks: the blocks.
        address: of the scheduler, such as ``tcp://10.0.0.1:8786``.

    Yields:
        The rows of each block, in the order in which they finish.

    Raises:
        InputError: Dask is not installed, no cluster answers, or a block is lost again and again.
    """
    if find_spec("distributed") is None:
        raise InputError("--dask needs distributed, which is not installed: pip install 'screwsynth[dask]'")
    import distributed  # noqa: PLC0415 - few sweeps need a cluster

    dask: Any = distributed  # its functions have no types

    try:
        client = dask.Client(address, timeout=_WAIT, set_as_default=False)
    except (OSError, ValueError, TypeError):
        raise InputError(f"--dask {address}: no Dask scheduler answers there within {_WAIT} seconds") from None
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
                    fault = f"point {block.indices[0]} was lost {tries + 1} times: {type(error).__name__}: {error}"
                    raise InputError(f"--dask {address}: {fault}; the points before it are kept")
                running.add(submit(block, tries + 1))
                continue
            yield future.result()
            following = next(source, None)
            if following is not None:
                running.add(submit(following, 0))

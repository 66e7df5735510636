"""Growth of times with the size of a problem, and the exponent of the power that fits them best.

The sizes of a series run by turns, and the median of each counts. An exponent is the slope of a line through the
logarithms by least squares, over the sizes that were measured.
"""

from __future__ import annotations

import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from certificate import case_with
from poses import case_of as case_with_poses

from screwsynth.nlp import Case, Limits, Task, certify_program, load_case, solve

from .shares import shared

_HELICAL = "paper-4.1-helical"
#: Starts of a solve where something else grows.
_STARTS = 8


class Series(NamedTuple):
    """A quantity that grows.

    Attributes:
        name: in the table.
        sizes: in order.
        measure: prepares a size and returns the call that is timed; the call returns a count to show, or None.
        is_exponential: whether the time is fitted by a factor for each unit in the place of a power.
        turns: how often each size is timed.
    """

    name: str
    sizes: tuple[int, ...]
    measure: Callable[[int], Callable[[], int | None]]
    is_exponential: bool = False
    turns: int = 3


class Plan(NamedTuple):
    """The series, and seconds of the whole section."""

    series: tuple[Series, ...]
    seconds: float


def _starts_of(name: str) -> Callable[[int], Callable[[], None]]:
    """Return a measure: a solve on one thread with a number of starts."""

    def prepare(size: int) -> Callable[[], None]:
        case = load_case(name)

        def call() -> None:
            solve(case, starts=size, jobs=1)

        return call

    return prepare


def _jobs(size: int) -> Callable[[], None]:
    """Return a solve with 128 starts on a number of threads."""
    case = load_case("hexapod-machining")

    def call() -> None:
        solve(case, starts=128, jobs=size)

    return call


def _tasks(size: int) -> Callable[[], None]:
    """Return a solve of a number of tasks of equal weight about random axes: each by itself, then together."""
    random = np.random.default_rng(3)
    tasks = [
        Task.screw("max", axis=random.normal(size=3).tolist(), point=random.uniform(-5, 5, 3).tolist(), pitch=1.0)
        for _ in range(size)
    ]
    named = [replace(task, name=f"task {k + 1}") for k, task in enumerate(tasks)]
    return _solve_one(replace(load_case(_HELICAL), tasks=named))


def _poses(size: int) -> Callable[[], None]:
    """Return a solve of a hexapod at a number of poses, twelve coordinates of its joints free."""
    return _solve_one(case_with_poses(size, Limits()))


def _solve_one(case: Case) -> Callable[[], None]:
    def call() -> None:
        solve(case, starts=_STARTS, jobs=1)

    return call


def _free_variables(size: int) -> Callable[[], int]:
    """Return a certificate of a number of free variables, which says how many boxes it took."""
    solution = solve(case_with(size), starts=16, jobs=1)

    def call() -> int:
        return certify_program(solution.nlp, solution.x, gap=1e-4, jobs=1, time_limit=60.0).boxes

    return call


def _rows(size: int) -> Callable[[], None]:
    """Return a sweep of a number of pitches as a whole command, compiled before."""

    def sweep(count: int) -> None:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-P", "-m", "screwsynth.nlp", "sweep", _HELICAL]
            command += ["--over", f"task.pitch=0:2:{count}", "--out", str(Path(folder) / "rows.csv")]
            subprocess.run(command, check=True, capture_output=True)

    sweep(2)
    return lambda: sweep(size)


def _series(scale: int) -> tuple[Series, ...]:
    """Return all series, longer ones for a larger scale."""
    cores = os.cpu_count() or 1
    return (
        Series("starts, paper-4.1-helical", (8, 16, 32, 64, 128, 256)[: 2 * scale], _starts_of(_HELICAL)),
        Series("starts, hexapod-machining", (8, 16, 32, 64, 128)[: 2 * scale], _starts_of("hexapod-machining")),
        Series("threads, hexapod-machining with 128 starts", tuple(range(1, cores + 1)) if scale > 1 else (), _jobs),
        Series(f"tasks, {_STARTS} starts", (1, 2, 4, 8, 16)[: 2 * scale], _tasks),
        Series(f"poses, {_STARTS} starts", (1, 2, 4, 8, 16, 32)[: 2 * scale], _poses),
        Series(
            "free variables of a certificate", (2, 3, 4, 5, 6, 7)[: 2 * scale], _free_variables, is_exponential=True
        ),
        Series("rows of a sweep", (500, 2000, 8000)[:scale], _rows),
    )


QUICK = Plan(tuple(each._replace(turns=1) for each in _series(1)), 15.0)
FULL = Plan(_series(3), 210.0)


def run(plan: Plan, keep: Callable[[object], None]) -> None:
    """Measure each series and hand over those so far; a size that would begin after the end of the time is left out."""
    found: list[dict[str, object]] = []
    for series, end in shared(plan.seconds, [each for each in plan.series if each.sizes]):
        print(f"  {series.name}", file=sys.stderr, flush=True)
        try:
            found.append(_measured(series, end))
        except Exception as fault:  # the other series are measured all the same
            found.append({"name": series.name, "note": f"failed: {type(fault).__name__}: {fault}"[:160]})
        keep({"series": found})


def _measured(series: Series, deadline: float) -> dict[str, object]:
    """Return the medians of a series, and its exponent or factor; the two least sizes are measured in any case."""
    calls = {
        size: series.measure(size) for size in series.sizes if size in series.sizes[:2] or time.monotonic() < deadline
    }
    times: dict[int, list[float]] = {size: [] for size in calls}
    counts: dict[int, int | None] = {}
    for turn in range(series.turns):
        for size in list(calls)[:: -1 if turn % 2 else 1]:
            if time.monotonic() > deadline and (turn or size not in series.sizes[:2]):
                continue
            began = time.perf_counter()
            counts[size] = calls[size]()
            times[size].append(time.perf_counter() - began)
    sizes = [size for size in times if times[size]]
    medians = [statistics.median(times[size]) for size in sizes]
    shown = [counts[size] for size in sizes]
    fitted = [float(count) for count in shown if count is not None]
    return {
        "name": series.name,
        "sizes": sizes,
        "seconds": medians,
        "counts": shown,
        "turns": min((len(times[size]) for size in sizes), default=0),
        "is_exponential": series.is_exponential,
        "exponent": slope(sizes, fitted or medians, is_exponential=series.is_exponential),
        "note": "" if len(sizes) == len(series.sizes) else "cut short: no time",
    }


def slope(sizes: Sequence[float], values: Sequence[float], *, is_exponential: bool) -> float | None:
    """Return the exponent of a power, or the factor for each unit, that fits values best by least squares.

    Args:
        sizes: positive.
        values: positive, one for each size.
        is_exponential: whether a factor is fitted.

    Returns:
        None for fewer than two sizes.
    """
    if len(sizes) < 2:
        return None
    across = np.array(sizes, dtype=float) if is_exponential else np.log(sizes)
    found = float(np.polyfit(across, np.log(values), 1)[0])
    return math.exp(found) if is_exponential else found

"""Progress of commands on standard error, where standard error is a terminal; solves and certificates with progress."""

from __future__ import annotations

import math
import sys
import time
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ..case.case import Case
    from ..solver.certified import Certified
    from ..solver.solution import Solution

#: Leaves the cursor at the beginning of an empty line.
_CLEAR_LINE = "\r\033[K"


@contextmanager
def counting_line() -> Iterator[Callable[[str], None]]:
    """Give a function that shows a text in place of the previous text; the line is empty at the end."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return

    def show(text: str) -> None:
        sys.stderr.write(f"{_CLEAR_LINE}{text}")
        sys.stderr.flush()

    try:
        yield show
    finally:
        sys.stderr.write(_CLEAR_LINE)


@contextmanager
def spinner(first: str) -> Iterator[Callable[[str], None]]:
    """Give a function that shows a text next to a spinner, with the remaining time of limited work.

    Args:
        first: text at the beginning.
    """
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
    from rich.text import Text

    from ..errors import one_line
    from ..interruption import seconds_left

    class TimeLeft(ProgressColumn):
        """Column with the remaining seconds of a time limit; empty without a time limit."""

        def render(self, task: Task) -> Text:
            left = task.fields.get("end", math.inf) - time.perf_counter()
            return Text("" if left == math.inf else f"at most {max(left, 0.0):.0f} s left")

    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeLeft()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task(first, total=None)

        def show(text: str) -> None:
            bar.update(line, description=escape(one_line(text)), end=time.perf_counter() + seconds_left())

        yield show


class SolveOutcome(NamedTuple):
    """Outcome of a solve.

    Attributes:
        solution: the solution.
        found: the solution with its certificates; without certification, the solution.
        is_proved: If true, every certificate is proved, or none is requested.
    """

    solution: Solution
    found: Solution | Certified
    is_proved: bool


def tell_workspace(case: Case) -> None:
    """Warn on standard error if the workspace of a case contains no pose of the case, probably by mistake.

    A workspace without limits may lie elsewhere on purpose, unless its ranges look like excursions from the pose.
    """
    from ..errors import one_line

    found = case.outside_workspace
    if found is not None and (case.limits_over == "workspace" or found.may_be_excursions):
        sys.stderr.write(f"{one_line(found.sentence)}\n")


def solve_with_progress(
    case: Case, jobs: int | None, *, certify: bool = False, gap: float = 1e-4, step: float | None = None
) -> SolveOutcome:
    """Solve a case; round its dimensions if a step is given, and compute certificates if ``certify`` is true.

    Raises:
        CaseError: the case contradicts itself.
        InputError: the objective cannot be compiled.
    """
    from ..errors import InputError
    from ..solver.solve import solve

    if case.limits_over == "workspace":
        tell_workspace(case)
    if step is not None:
        if case.over_path is not None:
            raise InputError("--round: is for designs at stated poses; F of this case is optimised along its path")
        from ..solver.rounding import round_design

        rounded = round_design(solve_with_progress(case, jobs).solution, step, jobs=jobs)
        if not (certify and rounded.status.is_answer):
            return SolveOutcome(rounded, rounded, not certify)
        certified = certify_with_progress(rounded, jobs=jobs, gap=gap)
        return SolveOutcome(certified.solution, certified, certified.is_proved)
    if certify and case.over_path is None:
        found: Case | Solution = case
        if case.changes:  # the answer also says what each change is worth
            solution = solve_with_progress(case, jobs).solution
            found = solution if solution.status.is_answer else case
        certified = certify_with_progress(found, jobs=jobs, gap=gap)
        return SolveOutcome(certified.solution, certified, certified.is_proved)
    along = gap if certify else None
    if not sys.stderr.isatty():
        solution = solve(case, jobs=jobs, gap=along)
        return SolveOutcome(solution, solution, _is_bounded(solution, along))
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    from ..errors import one_line
    from ..solver.status import Phase

    with Progress(console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("formulating", total=None)

        def show(name: str, done: int, total: int, best: float | None) -> None:
            label = "starts" if len(case.tasks) == 1 else escape(one_line(name))
            best_text = "" if best is None else f", best {best:.7g}"
            bar.update(line, completed=done, total=total, description=f"{label}{best_text}")

        def show_phase(phase: Phase, done: int, total: int) -> None:
            bar.update(line, completed=done, total=total, description=phase.value)

        solution = solve(case, jobs=jobs, progress=show, phase=show_phase, gap=along)
    return SolveOutcome(solution, solution, _is_bounded(solution, along))


def _is_bounded(solution: Solution, gap: float | None) -> bool:
    """Return whether the bound of all schedules is within a relative gap; true without a gap."""
    if gap is None or solution.schedule is None:
        return True
    return solution.schedule.gap is not None and solution.schedule.gap <= gap


def certify_with_progress(case: Case | Solution, **options: Any) -> Certified:  # noqa: ANN401 - the options of `certify`
    """Certify a case; the options are those of :func:`screwsynth.nlp.certify`.

    Raises:
        InputError: an option is out of range, or does not apply to the case.
        UncoveredError: the case's expressions have an operation without a rule.
    """
    from ..solver.certified import certify

    with spinner("solving for the best known point") as show:

        def show_search(name: str, seconds: float, bound: float, incumbent: float, boxes: int, left: int) -> None:
            # The time comes first: narrow terminals cut the end.
            text = f"{name}: {seconds:.0f} s, bound {bound:.7g}, best {incumbent:.7g}, gap {abs(bound - incumbent):.2g}"
            show(f"{text}, {boxes:,} boxes, {left:,} left")

        return certify(case, **options, progress=lambda name: partial(show_search, name))

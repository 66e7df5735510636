"""Outputs of the commands that make tables of designs: ``sweep``, ``tradeoff``, ``pareto`` and ``compare``."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

from . import contents
from .commandline import print_notice

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from ..system.jsonvalues import JsonObject
    from ..words.designs import Designs, Row
    from ..words.text import Line, TextTable
    from .options import Outputs


def deliver(
    files: Outputs,
    found: Designs[Row],
    result: Callable[[], JsonObject],
    *,
    whole: bool,
    done: bool,
    shown: Callable[[], Iterable[Line | TextTable]] | None = None,
) -> NoReturn:
    """Write a table of designs into the files that are asked for, show it, and exit.

    Args:
        files: the files.
        found: the table.
        result: returns the result for JSON.
        whole: whether everything is shown, and not the answer alone.
        done: whether the exit status is 0, and not 1.
        shown: returns the lines for the terminal; the table with the lines around it where it is left out.

    Raises:
        InputError: a file cannot be written.
        SystemExit: at the end, with the exit status.
    """
    files.deliver(
        shown or (lambda: contents.designs_summary(found)),
        whole=whole,
        done=done,
        json=result,
        csv=lambda: contents.designs_csv(found),
        markdown=lambda: contents.designs_markdown(found),
        html=lambda: contents.designs_page(found),
        plot=lambda: contents.designs_figure(found),
    )


@contextmanager
def resumed(journal: str | None) -> Iterator[None]:
    """Take searches of a block from a journal of an earlier run, and keep those that are new in it.

    The journal is removed where the block delivers a result that no stop has cut short.

    Args:
        journal: its file; None without one.

    Raises:
        InputError: the file cannot be written, is something else, or is held by another process.
    """
    if journal is None:
        yield
        return
    from pathlib import Path

    from ..interruption import is_requested, say_on_leaving
    from ..solver.kept import kept_in
    from ..solver.searchjournal import SearchJournal

    searches = SearchJournal(Path(journal))
    if len(searches):
        print_notice(f"{searches.count} already")
    say_on_leaving(lambda: searches.words)
    try:
        with kept_in(searches):
            yield
    except SystemExit:
        if is_requested():
            print_notice(searches.words)
        else:
            searches.remove()
        raise
    finally:
        searches.close()

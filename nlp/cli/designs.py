"""Outputs of the commands with tables of designs: ``sweep``, ``tradeoff``, ``pareto`` and ``compare``."""

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
    """Write a table of designs into the requested files, show it, and exit.

    Args:
        files: the files.
        found: the table.
        result: function that returns the result for JSON.
        whole: If true, everything is shown, not only the answer.
        done: If true, the exit status is 0; otherwise 1.
        shown: function that returns the lines for the terminal; None for the table with its lines.

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
    """Take the searches of a block from the journal of an earlier run, and add new searches to the journal.

    The journal is removed after a result that no stop has cut short.

    Args:
        journal: file of the journal; None without a journal.

    Raises:
        InputError: the file cannot be written, is no journal, or is used by another process.
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

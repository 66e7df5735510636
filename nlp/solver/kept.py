"""Journal in force, from which searches are taken and in which new ones are kept; none in most commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol

from ...models import FloatArray
from ..case.settings import Search
from ..program.nlp import Nlp


class Keeper(Protocol):
    """A journal of searches."""

    def search(
        self, nlp: Nlp, search: Search, first: Sequence[FloatArray], solve: Callable[[], Any], make: Callable[..., Any]
    ) -> Any:  # noqa: ANN401 - the solution's type stands above this module
        """Return the solution of a search that is kept, or the one of a function, which is then kept.

        Args:
            nlp: the program.
            search: settings of the search.
            first: points (n,) to start from.
            solve: searches the program.
            make: returns a solution from its fields.
        """
        ...


_journal: ContextVar[Keeper | None] = ContextVar("journal", default=None)


@contextmanager
def kept_in(journal: Keeper | None) -> Iterator[None]:
    """Take searches of a block from a journal, and keep those that are new in it; None for no journal."""
    token = _journal.set(journal)
    try:
        yield
    finally:
        _journal.reset(token)


def journal_in_force() -> Keeper | None:
    """Return the journal of the block; None without one."""
    return _journal.get()

"""Active journal of searches: earlier searches are read from the journal, new searches are added to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol

from ...models import FloatArray
from ..case.settings import Search
from ..program.nlp import Nlp


class Keeper(Protocol):
    """Interface of a journal of searches."""

    def search(
        self, nlp: Nlp, search: Search, first: Sequence[FloatArray], solve: Callable[[], Any], make: Callable[..., Any]
    ) -> Any:  # noqa: ANN401 - the type of a solution is defined in a module that imports this one
        """Return the solution of a search from the journal; without an entry, search and add the solution.

        Args:
            nlp: the nonlinear program.
            search: settings of the search.
            first: points (n,) to start from.
            solve: function that searches the program.
            make: function that returns a solution from its fields.
        """
        ...


_journal: ContextVar[Keeper | None] = ContextVar("journal", default=None)


@contextmanager
def kept_in(journal: Keeper | None) -> Iterator[None]:
    """Use a journal inside a block: read kept searches, and add new searches; None for no journal."""
    token = _journal.set(journal)
    try:
        yield
    finally:
        _journal.reset(token)


def journal_in_force() -> Keeper | None:
    """Return the journal of the enclosing block, or None."""
    return _journal.get()

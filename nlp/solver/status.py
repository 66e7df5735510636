"""How a solve ended. It stands alone, so that results are shown without loading a solver."""

from __future__ import annotations

import enum


class Status(enum.Enum):
    """How a solve ended; each value is the word in results."""

    OPTIMAL = "optimal"
    AVERAGED = "averaged"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"
    INTERRUPTED = "interrupted"

    @property
    def is_answer(self) -> bool:
        """Whether the solve gave what was asked for."""
        return self in (Status.OPTIMAL, Status.AVERAGED, Status.EVALUATED)

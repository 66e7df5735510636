"""Status of a solve: a module of its own, so that results are shown without loading a solver."""

from __future__ import annotations

import enum


class Status(enum.Enum):
    """Status of a solve; each value is the word in results; interrupted is also one whose time was over."""

    OPTIMAL = "optimal"
    AVERAGED = "averaged"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    LIMB_SINGULAR = "singular limb"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"
    INTERRUPTED = "interrupted"

    @property
    def is_answer(self) -> bool:
        """Whether the point is an answer: optimal, averaged, or evaluated."""
        return self in (Status.OPTIMAL, Status.AVERAGED, Status.EVALUATED)

"""Status and phases of a solve: a module of its own, so that results are shown without loading a solver."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import TypeAlias


class Status(enum.Enum):
    """Status of a solve; each value is the word in results.

    ``locally optimal`` stands for the best optimum found where a search that did not converge reached a better point;
    ``interrupted`` also stands for a solve whose time was over, and ``not proved`` for a design whose limits over a
    workspace or along a path are refuted or open.
    """

    OPTIMAL = "optimal"
    LOCAL = "locally optimal"
    AVERAGED = "averaged"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    LIMB_SINGULAR = "singular limb"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"
    NOT_PROVED = "not proved"
    INTERRUPTED = "interrupted"

    @property
    def is_answer(self) -> bool:
        """Whether the point is an answer: optimal, locally optimal, averaged, or evaluated."""
        return self in (Status.OPTIMAL, Status.LOCAL, Status.AVERAGED, Status.EVALUATED)


class Phase(enum.Enum):
    """What a solve is busy with; each value is a word for people."""

    FORMULATING = "formulating"
    STARTS = "starts"
    RELAXATION = "relaxation"
    EVIDENCE = "evidence"


#: Called at the beginning of a phase, and during it, with the phase, and how many of how many of its parts are done:
#: programs, starts, starts, and optima.
PhaseProgress: TypeAlias = Callable[[Phase, int, int], None]


def no_phase(phase: Phase, done: int, total: int) -> None:
    """Report nothing."""

"""Status and phases of a solve, in a separate module so that results can be shown without loading a solver."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import TypeAlias


class Status(enum.Enum):
    """Status of a solve; each value is the word in results.

    ``locally optimal``: best known optimum, although a search that did not converge reached a better point.
    ``interrupted``: stopped by the user or by a time limit. ``not proved``: limits over a workspace or along a path are
    refuted or undecided for this design.
    """

    OPTIMAL = "optimal"
    LOCAL = "locally optimal"
    AVERAGED = "averaged"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    LIMB_SINGULAR = "singular limb"
    SINGULAR = "singular"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"
    NOT_PROVED = "not proved"
    INTERRUPTED = "interrupted"

    @property
    def is_answer(self) -> bool:
        """Whether the point is an answer: optimal, locally optimal, averaged, or evaluated."""
        return self in (Status.OPTIMAL, Status.LOCAL, Status.AVERAGED, Status.EVALUATED)


class Phase(enum.Enum):
    """Phase of a solve; each value is a word for progress messages."""

    FORMULATING = "formulating"
    STARTS = "starts"
    RELAXATION = "relaxation"
    EVIDENCE = "evidence"


#: Function to call at the beginning of a phase and during it, with the phase, the number of parts done, and the number
#: of all parts. The parts are programs, starts, starts, and optima.
PhaseProgress: TypeAlias = Callable[[Phase, int, int], None]


def no_phase(phase: Phase, done: int, total: int) -> None:
    """Ignore the progress of a phase."""

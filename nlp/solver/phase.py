"""The phases of a solve, for those who wait for it."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import TypeAlias


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

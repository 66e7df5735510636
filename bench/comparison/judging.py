"""The judgement of an answer by the program's own conditions: nothing that a method reports is taken for it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp import Nlp
from screwsynth.nlp.evidence.kkt import linearise
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.proof.statement.standard_form import is_in_home_mode

#: Largest violation of a feasible answer, in half ranges: ten times what this program demands of its own.
FEASIBLE = 1e-8
#: Largest difference of a correct F from the best known: relative, or in parts of F's scale where the best is 0.
SAME_F = 1e-6
#: Part of its scale below which F is 0.
ZERO = 1e-9


class Verdict(NamedTuple):
    """The judgement of an answer.

    Attributes:
        F: objective there.
        violation: largest distance outside a bound or constraint, in half ranges.
        closed: whether all loops of the robot are closed there.
        in_home_mode: whether no limb is known to be bent the other way than at home, to which certificates keep too.
    """

    F: float
    violation: float
    closed: bool
    in_home_mode: bool

    @property
    def is_feasible(self) -> bool:
        """Whether the answer is a point of the case in home's working mode."""
        return self.in_home_mode and self.is_assembled

    @property
    def is_assembled(self) -> bool:
        """Whether the answer is a point of the case in any working mode."""
        return self.closed and self.violation <= FEASIBLE


#: The verdict where there is no answer.
NOTHING = Verdict(float("nan"), float("inf"), closed=False, in_home_mode=False)


class Reference(NamedTuple):
    """The best F known of a case, whether it is proved, the sense, and F's scale."""

    F: float
    is_proved: bool
    sign: float
    scale: float

    @property
    def unit(self) -> float:
        """Size in whose parts differences of F are: that of F, or F's scale where F is 0."""
        return abs(self.F) if abs(self.F) > ZERO * self.scale else self.scale

    @property
    def tolerance(self) -> float:
        """Largest difference of F between a correct answer and this one."""
        return SAME_F * self.unit

    def accepts(self, verdict: Verdict) -> bool:
        """Whether an answer is correct: feasible, and as good as the best known."""
        return verdict.is_feasible and self.sign * (verdict.F - self.F) <= self.tolerance

    def is_beaten_by(self, verdict: Verdict) -> bool:
        """Whether a feasible answer is better than this one by more than the tolerance."""
        return verdict.is_feasible and self.sign * (self.F - verdict.F) > self.tolerance


def judge(nlp: Nlp, x: FloatArray) -> Verdict:
    """Return the verdict on a point (n,) in the program's units; one that is not finite is not feasible."""
    x = np.asarray(x, dtype=np.float64)
    if x.shape != (nlp.n,) or not np.isfinite(x).all():
        return NOTHING
    at = linearise(nlp, x)
    if not np.isfinite(at.violation):
        return NOTHING
    return Verdict(at.F, at.violation, loops_are_closed(nlp, x), is_in_home_mode(nlp, x) is not False)

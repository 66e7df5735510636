"""What a search of the whole box proved: a value with a sentence that says what it means and what it does not."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from ...models import FloatArray
from ..case.task import Sense
from ..program.nlp import Nlp

#: What every statement is about: the proof covers the expressions as CasADi holds them, not the machine.
SCOPE = "for the double-precision expression graph of this case"


class CertificateStatus(enum.Enum):
    """How a search ended; each value is the word in results."""

    PROVED = "proved"
    INCOMPLETE = "incomplete"
    INFEASIBLE = "infeasible"
    REFUSED = "refused"


@dataclass(frozen=True, eq=False)
class Certificate:
    """A proven bound.

    Attributes:
        status: ``proved``: the gap that was asked for holds, or F is above the value on the whole box; ``incomplete``:
            the bound holds, but is not as tight as asked; ``infeasible``: no point of the box keeps the limits;
            ``refused``: a point shows that what was claimed is wrong.
        nlp: the program.
        x: (n,) the best point known, or None. It differs from the incumbent that was given where that was beaten.
        incumbent: objective at ``x``; NaN without a point.
        bound: no feasible point of the box has a better objective; infinite where nothing is known.
        allowed: the gap that was asked for, in the objective's own unit.
        is_relative: whether it was asked for as a part of the incumbent; near 0 it is a part of the objective's scale.
        above: the value that F was to be shown to be above, if any.
        was_beaten: whether the search came upon a better point than the one it was given.
        engine: ``c`` or ``numpy``.
        boxes: number of boxes examined.
        open: number of boxes that the search did not come to.
        seconds: wall time.
        reason: why the search ended before it was done, or why the claim is refused; else empty.
        history: (seconds, bound, incumbent) on the way, finite numbers only.
    """

    status: CertificateStatus
    nlp: Nlp
    x: FloatArray | None
    incumbent: float
    bound: float
    allowed: float
    is_relative: bool
    above: float | None
    was_beaten: bool
    engine: str
    boxes: int
    open: int
    seconds: float
    reason: str
    history: tuple[tuple[float, float, float], ...]

    @property
    def gap(self) -> float:
        """How far the bound is from the incumbent; not negative."""
        return abs(self.bound - self.incumbent)

    @property
    def relative_gap(self) -> float | None:
        """The gap as a part of the incumbent; None near 0, or without a finite gap."""
        if not (self.is_relative and math.isfinite(self.gap)):
            return None
        return self.gap / abs(self.incumbent)

    @property
    def statement(self) -> str:
        """What is proved, in one sentence, with its limits."""
        word = "larger" if self.nlp.sense is Sense.MAX else "smaller"
        best = "" if math.isnan(self.incumbent) else f"; the best point known has {self.incumbent:.10g}"
        beaten = ", better than the one given" if self.was_beaten else ""
        if self.status is CertificateStatus.INFEASIBLE:
            return f"proved: no point of the box keeps all limits, {SCOPE}"
        if self.status is CertificateStatus.REFUSED:
            return f"refused: {self.reason}"
        if self.above is not None and self.status is CertificateStatus.PROVED:
            return f"proved: F is above {self.above:.10g} on the whole box within the limits{best}, {SCOPE}"
        if not math.isfinite(self.bound):
            return f"nothing is proved: {self.reason}{best}"
        what = f"no point of the box within the limits has F {word} than {self.bound + 0.0:.10g}{best}{beaten}"
        if self.status is CertificateStatus.PROVED:
            return f"proved: {what}, {SCOPE}"
        return f"incomplete ({self.reason}), but proved: {what}, {SCOPE}"

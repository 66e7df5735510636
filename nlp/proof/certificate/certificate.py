"""Certificates: proven bounds, each with a sentence that states its meaning and its limits."""

from __future__ import annotations

import enum
import math

from ....models import FloatArray
from ....models.shown import Shown
from ....models.values import dataclass
from ....models.whole import Whole
from ...case.task import Sense
from ...evidence.state import ZERO_F
from ...program.nlp import Nlp

#: Part of the incumbent below which a lower bound is as good as 0.
_OBVIOUS = 1e-9
#: Scope of every statement: the expressions as CasADi holds them, not the machine.
SCOPE = "for the double-precision expression graph of this case"


class CertificateStatus(enum.Enum):
    """Result of a search; each value is the word in results."""

    PROVED = "proved"
    INCOMPLETE = "incomplete"
    INFEASIBLE = "infeasible"
    REFUSED = "refused"


@dataclass(frozen=True, eq=False)
class Certificate(Whole, Shown):
    """A proven bound.

    Attributes:
        status: ``proved``: the gap asked for holds, or F is above the value on the whole box; ``incomplete``: the bound
            holds, but is wider than asked for; ``infeasible``: no point of the box keeps the limits; ``refused``: the
            claim is wrong, as a point shows.
        nlp: the program.
        x: (n,) the incumbent; None without one. It may be another point than the one given: see ``was_beaten``.
        incumbent: objective at ``x``; NaN without a point.
        bound: no feasible point of the box has a better objective; infinite where nothing is known.
        allowed: the gap asked for, in the objective's own unit.
        is_relative: whether that gap is a part of the incumbent; near 0 it is a part of the objective's scale.
        above: the value that F is claimed to be above; None without such a claim.
        was_beaten: whether the search found a better point than the one given.
        engine: ``c``, or ``none`` for a program without variables.
        boxes: number of boxes examined.
        open: number of boxes that are still open.
        seconds: wall time.
        reason: for stopping before every box was closed, or for refusing the claim; else empty.
        history: (seconds, bound, incumbent) during the search, finite numbers only.
        bound_of_tree: upper bound that the search's boxes show of the value that is maximised in standard form; above 0
            for a sum of squares whose ``bound`` is 0.
        in_other_mode: whether the incumbent is in another working mode than home's.
        scope: dimensions that the bound holds for, as words such as ``with the rounded dimensions``; empty where the
            box has them all.
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
    bound_of_tree: float = math.inf
    in_other_mode: bool = False
    scope: str = ""

    def __repr__(self) -> str:
        return f"<Certificate of {self.nlp.case.name!r}: {self.statement}>"

    @property
    def gap(self) -> float:
        """Distance of the bound from the incumbent; not negative."""
        return abs(self.bound - self.incumbent)

    @property
    def relative_gap(self) -> float | None:
        """The gap as a part of the incumbent; None near 0, or without a finite gap."""
        if not (self.is_relative and math.isfinite(self.gap)):
            return None
        return self.gap / abs(self.incumbent)

    @property
    def is_obvious(self) -> bool:
        """Whether the bound says no more than that F, a sum of squares, is at least 0, and the best F is above that."""
        # A gap that is not relative is one beside 0: the bound 0 proves it.
        met = self.status is CertificateStatus.PROVED and not self.is_relative
        floor = 0.0 if math.isnan(self.incumbent) else _OBVIOUS * abs(self.incumbent)
        reached = abs(self.incumbent) <= ZERO_F * self.nlp.objective_size
        return self.nlp.sense is Sense.MIN and self.bound <= floor and not (met or reached)

    @property
    def statement(self) -> str:
        """The proven statement in one sentence, with its limits."""
        if self.status is CertificateStatus.INFEASIBLE:
            return f"proved: no point of the box keeps all limits{self._mode}, {SCOPE}"
        if self.status is CertificateStatus.REFUSED:
            return f"refused: {self.reason}"
        return self._bound_statement

    @property
    def _mode(self) -> str:
        """The set that the statement is about, where it is not the box itself, as words at the end of a clause."""
        scope = f" {self.scope}" if self.scope else ""
        return f"{scope} in home's working mode" if self.nlp.in_home_mode else scope

    @property
    def _bound_statement(self) -> str:
        """The statement of a bound."""
        word = "larger" if self.nlp.sense is Sense.MAX else "smaller"
        value = 0.0 if abs(self.incumbent) <= ZERO_F * self.nlp.objective_size else self.incumbent
        best = "" if math.isnan(value) else f"; the best point known has {value:.10g}"
        beaten = ", better than the one given" if self.was_beaten else ""
        beaten += ", in another working mode than home's" if self.in_other_mode else ""
        if self.above is not None and self.status is CertificateStatus.PROVED:
            obvious = ", which says nothing useful: F is at least 0" if self.above < 0 else ""
            where = f"on the whole box within the limits{self._mode}"
            return f"proved: F is above {self.above:.10g} {where}{obvious}{best}, {SCOPE}"
        if not math.isfinite(self.bound):
            return f"nothing is proved: {self.reason}{best}"
        if self.is_obvious:
            return (
                f"nothing useful is proved yet ({self.reason or 'the gap asked for allows it'}): F is at least 0{best}"
            )
        # A lower bound may be rounded down to 0, an upper one may not.
        is_noise = self.nlp.sense is Sense.MIN and 0 < self.bound <= ZERO_F * self.nlp.objective_size
        bound = 0.0 if is_noise else self.bound + 0.0
        what = f"no point of the box within the limits{self._mode} has F {word} than {bound:.10g}{best}{beaten}"
        if self.status is CertificateStatus.PROVED:
            return f"proved: {what}, {SCOPE}"
        return f"incomplete ({self.reason}), but proved: {what}, {SCOPE}"

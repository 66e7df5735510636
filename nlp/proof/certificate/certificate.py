"""Certificates: proved bounds of the global optimum, each with a sentence about its meaning and scope."""

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

#: Fraction of the incumbent below which a lower bound counts as 0.
_OBVIOUS = 1e-9
#: Scope of every statement: CasADi's expressions of the robot, in double precision.
SCOPE = "for the double-precision expression graph of this case"


class CertificateStatus(enum.Enum):
    """Status of a search; the values are the words in results."""

    PROVED = "proved"
    INCOMPLETE = "incomplete"
    INFEASIBLE = "infeasible"
    REFUSED = "refused"


@dataclass(frozen=True, eq=False)
class Certificate(Whole, Shown):
    """Proved bound of the global optimum.

    Attributes:
        status: ``proved``: the requested gap is reached, or F is above the requested value on the whole box;
            ``incomplete``: the bound is proved, but its gap is larger than requested; ``infeasible``: no point of the
            box satisfies the limits; ``refused``: a known point contradicts the claim.
        nlp: the nonlinear program.
        x: (n,) incumbent; None without an incumbent. If ``was_beaten`` is true, the incumbent is not the given point.
        incumbent: objective at ``x``; NaN without a point.
        bound: proved bound of the objective over all feasible points of the box; infinite without a proof.
        allowed: requested gap, in the unit of the objective.
        is_relative: whether the gap is relative to the incumbent. Near 0 the gap is relative to the objective's scale.
        above: requested lower bound of F; None for a search of the optimum.
        was_beaten: whether the search found a better point than the given one.
        engine: ``c``, or ``none`` for a program without variables.
        boxes: number of examined boxes.
        open: number of open boxes at the end.
        seconds: wall time.
        reason: reason why the search stopped before every box was closed, or why the claim is refused; otherwise empty.
        history: (seconds, bound, incumbent) during the search; only finite values.
        bound_of_tree: upper bound of the maximised value of the standard form, from all boxes of the search tree. For
            a sum of squares, it may be above 0 although ``bound`` is 0.
        in_other_mode: whether the incumbent is in another working mode than the home working mode.
        scope: dimensions for which the bound is valid, such as ``with the rounded dimensions``; empty for all
            dimensions of the box.
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
        """Gap relative to the incumbent; None near 0, or without a finite gap."""
        if not (self.is_relative and math.isfinite(self.gap)):
            return None
        return self.gap / abs(self.incumbent)

    @property
    def is_obvious(self) -> bool:
        """Whether the bound only states that F is at least 0, as a sum of squares, while the best known F is larger."""
        # An absolute gap is used near 0, where the bound 0 is a proof of it.
        met = self.status is CertificateStatus.PROVED and not self.is_relative
        floor = 0.0 if math.isnan(self.incumbent) else _OBVIOUS * abs(self.incumbent)
        reached = abs(self.incumbent) <= ZERO_F * self.nlp.objective_size
        return self.nlp.sense is Sense.MIN and self.bound <= floor and not (met or reached)

    @property
    def statement(self) -> str:
        """Proved statement in one sentence, with its scope."""
        if self.status is CertificateStatus.INFEASIBLE:
            return f"proved: no point of the box satisfies all limits{self._mode}, {SCOPE}"
        if self.status is CertificateStatus.REFUSED:
            return f"refused: {self.reason}"
        return self._bound_statement

    @property
    def _mode(self) -> str:
        """Restriction of the statement to some dimensions or to the home working mode, as words at the end of a clause.

        The text is empty without a restriction.
        """
        scope = f" {self.scope}" if self.scope else ""
        return f"{scope} in the home working mode" if self.nlp.in_home_mode else scope

    @property
    def _bound_statement(self) -> str:
        """Sentence about the bound, for a certificate with a bound."""
        word = "larger" if self.nlp.sense is Sense.MAX else "smaller"
        value = 0.0 if abs(self.incumbent) <= ZERO_F * self.nlp.objective_size else self.incumbent
        best = "" if math.isnan(value) else f"; the best known point has {value:.10g}"
        beaten = ", better than the given point" if self.was_beaten else ""
        beaten += ", in another working mode than the home working mode" if self.in_other_mode else ""
        if self.above is not None and self.status is CertificateStatus.PROVED:
            obvious = ", which is trivial: F is at least 0" if self.above < 0 else ""
            where = f"on the whole box within the limits{self._mode}"
            return f"proved: F is above {self.above:.10g} {where}{obvious}{best}, {SCOPE}"
        if not math.isfinite(self.bound):
            return f"nothing is proved: {self.reason}{best}"
        if self.is_obvious:
            return f"only the trivial bound is proved ({self.reason or 'the gap allows it'}): F is at least 0{best}"
        # A lower bound may be rounded down to 0; an upper bound may not.
        is_noise = self.nlp.sense is Sense.MIN and 0 < self.bound <= ZERO_F * self.nlp.objective_size
        bound = 0.0 if is_noise else self.bound + 0.0
        what = f"no point of the box within the limits{self._mode} has F {word} than {bound:.10g}{best}{beaten}"
        if self.status is CertificateStatus.PROVED:
            return f"proved: {what}, {SCOPE}"
        return f"incomplete ({self.reason}), but proved: {what}, {SCOPE}"

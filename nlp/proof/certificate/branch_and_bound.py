"""A proven bound of the global optimum, by branch and bound over the whole box.

Boxes are examined in blocks by the C kernel. A box is closed when its bound does not exceed the incumbent by more than
the gap, when a condition cannot hold in it, or when no maximum can lie in it; otherwise it is bisected. A search that
stops early has a bound too, from the boxes that are open: it is wider, and as certain as that at the end.

No solver is trusted: the value of an incumbent is that of the program's own functions at the point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from ....models import FloatArray, frozen_array
from ...case.task import Sense
from ...evidence.kkt import FEASIBLE, linearise
from ...evidence.state import ZERO_F
from ...interruption import one_search, reason_of, reason_to_stop
from ...program.nlp import Nlp
from ..boxes.engine import Engine
from ..boxes.incumbent import Incumbent, IncumbentError
from ..boxes.limbs.independent import IndependentSearch
from ..boxes.limbs.shared import shared_search
from ..boxes.optimum import optimum_search
from ..boxes.search import TOO_SMALL, Effort, Search
from ..boxes.symmetry import halved
from ..boxes.tree import TreeRecord
from ..enclosure.engine import ENGINE, kernel
from ..statement.limb_separation import separate
from ..statement.standard_form import StandardForm, is_in_home_mode, standard_form
from .certificate import Certificate, CertificateStatus

#: The gap asked for when none is given: a ten-thousandth.
GAP = 1e-4
#: Part of itself by which every bound moves outwards in the end: constants that CasADi folded when it built the graph
#: are rounded doubles of their own.
_FOLDED = 1e-12
#: Part of the objective's scale below which an incumbent counts as 0: a gap relative to it would have no meaning.
_NEAR_ZERO = 1e-6
#: Part of a gap by which a bound may exceed it and still count as met: rounding of sums.
_GAP_ROUNDING = 1e-9
#: Number of variables up to which the whole box is searched although limbs share variables: it takes fewer boxes then.
_WHOLE_BOX = 12
#: Largest number of entries in a history.
_HISTORY = 200

#: A search of the whole box.
_Method = Search[Any] | IndependentSearch
#: Callback with seconds, bound, incumbent, number of boxes examined, number of boxes open.
CertifyProgress = Callable[[float, float, float, int, int], None]


def certify_program(
    nlp: Nlp,
    x: FloatArray | None = None,
    *,
    claimed: float | None = None,
    gap: float = GAP,
    above: float | None = None,
    time_limit: float | None = None,
    jobs: int | None = None,
    progress: CertifyProgress | None = None,
    recorder: TreeRecord | None = None,
) -> Certificate:
    """Prove a bound of a program's global optimum.

    Args:
        nlp: the program.
        x: (n,) the best point known, as from :func:`screwsynth.nlp.solve`; without one a few are tried.
        claimed: the objective claimed there; the claim is refused when it is wrong.
        gap: largest difference of bound and incumbent, as a part of the incumbent; near 0, of the objective's scale.
        above: prove, instead, that F is above this value on the whole box. The program must be a minimisation.
        time_limit: seconds after which the search stops with the bound reached.
        jobs: threads; the result does not depend on it. Left out, one for each processor.
        progress: called about ten times a second.
        recorder: records the search's tree for a proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: ``above`` for a maximisation.
        InputError: the C kernel was not built.
    """
    if above is not None and nlp.sense is not Sense.MIN:
        raise ValueError("above is proved by minimising: the program's sense must be min")
    with one_search(time_limit):
        effort = Effort()
        if nlp.n == 0:
            return _certify_point(nlp, above, effort.seconds)
        kernel()  # before any work where it is missing
        form = standard_form(nlp)
        incumbent = Incumbent(form)
        # The method in use takes the place of this one: what it sets up can be stopped.
        whole = optimum_search(form, partial(Engine, form, jobs), incumbent)
        search = _Search(form, incumbent, whole, gap, above, effort)
        try:
            search.incumbent.start(x, claimed)
        except IncumbentError as error:
            return replace(search.certificate(str(error)), status=CertificateStatus.REFUSED)

        def run() -> str:
            reason = reason_to_stop(effort.seconds)
            while not reason:
                search.restart(_method(form, incumbent, jobs, recorder))
                reason = search.run(progress)
                if reason or not search.is_short():
                    break
                if recorder is not None:
                    recorder.clear()
            return reason

        return search.certificate(reason_of(run))


def _certify_point(nlp: Nlp, above: float | None, seconds: float) -> Certificate:
    """Return the certificate of a program without variables: its value at the one point is the bound."""
    x = frozen_array(nlp.start, (0,))
    F, violation = nlp.evaluate(x)[0], linearise(nlp, x).violation
    status, reason = CertificateStatus.PROVED, ""
    if not violation <= FEASIBLE:
        status = CertificateStatus.INFEASIBLE
    elif not math.isfinite(F):
        status, reason = CertificateStatus.INCOMPLETE, "F has no finite value at the one point there is"
    elif above is not None and above >= F:
        status, reason = CertificateStatus.REFUSED, f"F is {F:.10g} at the one point there is, not above {above:.10g}"
    known = F if math.isfinite(F) else math.nan
    return Certificate(
        status, nlp, x, known, known, 0.0, bool(F), above, False, "none", 0, 0, seconds, reason, ((seconds, F, F),)
    )


def _method(form: StandardForm, incumbent: Incumbent, jobs: int | None, recorder: TreeRecord | None) -> _Method:
    """Return the search for a form: by limbs where it separates, else of the whole box.

    A proof covers the whole box where mirrors would leave a part of it, and boxes are closed without tangents to
    squares, which its checker does not have.
    """
    form = halved(form) if recorder is None else form
    separation = separate(form)
    if separation is not None and not separation.shared:
        return IndependentSearch(separation, incumbent, jobs, recorder)
    if separation is None or form.n <= _WHOLE_BOX:
        build = partial(Engine, form, jobs, tangents=recorder is None)
        return optimum_search(form, build, incumbent, recorder)
    return shared_search(form, separation, incumbent, jobs, recorder)


@dataclass
class _Search:
    """The state of a search; all values are those of the standard form, which is maximised.

    Attributes:
        form: the form.
        incumbent: the best feasible point known.
        method: examines boxes.
        gap: as for :func:`certify_program`.
        above: as for :func:`certify_program`.
        effort: the clock, and the time there is.
        history: (seconds, bound, incumbent) in the program's own sense.
        first_value: value of the incumbent when the method began.
        boxes_before: number of boxes that methods before this one examined.
    """

    form: StandardForm
    incumbent: Incumbent
    method: _Method
    gap: float
    above: float | None
    effort: Effort
    history: list[tuple[float, float, float]] = field(default_factory=list)
    first_value: float = -math.inf
    boxes_before: int = 0

    @property
    def threshold(self) -> float:
        """Largest bound of a box that may be closed."""
        if self.above is not None:
            # Strictly below, and by more than the bound moves outwards in the end.
            return math.nextafter(-self.above - 2 * _FOLDED * abs(self.above), -math.inf)
        if self.incumbent.x is None:
            return -math.inf
        # The bound moves outwards in the end, and the gap must hold with that.
        return self.incumbent.value + self._allowed_gap()[0] - 2 * _FOLDED * abs(self.incumbent.value)

    def _has_counterexample(self) -> bool:
        """Return whether F is not above the value at a known point; an F that is rounding error counts as 0."""
        if self.above is None or self.incumbent.x is None:
            return False
        return self.incumbent.value >= -self.above - ZERO_F * self.form.nlp.objective_size

    def _allowed_gap(self) -> tuple[float, bool]:
        """Return the largest difference of bound and incumbent, and whether it is a part of the incumbent."""
        floor, value = _NEAR_ZERO * self.form.nlp.objective_size, abs(self.incumbent.value)
        if floor < value < math.inf:
            return self.gap * value, True
        return self.gap * floor, False

    @property
    def bound(self) -> float:
        """Upper bound of the maximum, at this state of the search."""
        known = max(self.method.bound, self.incumbent.value)
        return known + _FOLDED * abs(known) if math.isfinite(known) else known

    def is_short(self) -> bool:
        """Return whether every box is closed with a bound that is too wide, and a better point is known by now.

        Limbs that were closed before it was known may leave too little of the gap for the others.
        """
        if self.method.left or self._has_counterexample() or self.method.bound == -math.inf:
            return False
        return not self._is_met() and self.incumbent.value > self.first_value

    def restart(self, method: _Method) -> None:
        """Begin again with a new search of the whole box, and the best point known by now."""
        self.boxes_before += self.method.boxes
        self.method, self.first_value = method, self.incumbent.value

    def _is_met(self) -> bool:
        """Return whether the bound is as good as asked for, once no box is open."""
        if self.above is not None:
            return self.bound < -self.above
        return self.method.bound <= self.threshold + _GAP_ROUNDING * self._allowed_gap()[0]

    def run(self, progress: CertifyProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        effort = replace(self.effort, progress=lambda seconds: self._report(seconds, progress))
        return effort.run(self.method, self._ending, lambda: self.threshold)

    def _ending(self) -> str | None:
        """Return the reason for ending; None for going on."""
        if self.method.fault:
            return self.method.fault
        if not self.method.is_open:
            return TOO_SMALL if self.method.left else ""
        if self._has_counterexample():
            return f"F is {self.form.sign * self.incumbent.value:.10g} at a point of the box"
        return None

    def _report(self, seconds: float, progress: CertifyProgress | None) -> None:
        """Report progress, and add to the history; a full history loses every second entry."""
        bound, incumbent = self.form.sign * self.bound, self.form.sign * self.incumbent.value
        if math.isfinite(bound) and math.isfinite(incumbent):
            if len(self.history) >= _HISTORY:
                del self.history[1::2]
            self.history.append((seconds, bound, incumbent))
        if progress is not None:
            progress(seconds, bound, incumbent, self.boxes_before + self.method.boxes, self.method.left)

    def certificate(self, reason: str) -> Certificate:
        """Return the certificate at this state of the search."""
        nlp, sign = self.form.nlp, self.form.sign
        seconds = self.effort.seconds
        self._report(seconds, None)
        left = self.method.left
        known = self.incumbent.x is not None
        if self._has_counterexample():
            status = CertificateStatus.REFUSED
            at = ", ".join(
                f"{variable.name} = {value:.6g}"
                for variable, value in zip(nlp.program.variables, self.incumbent.program_point(), strict=True)
            )
            reason = f"F is {sign * self.incumbent.value:.10g} at {at}, not above {self.above:.10g}"
        elif left or reason:
            status = CertificateStatus.INCOMPLETE
        elif not known and self.method.bound == -math.inf:
            status = CertificateStatus.INFEASIBLE
        else:
            status = CertificateStatus.PROVED if self._is_met() else CertificateStatus.INCOMPLETE
            reason = "" if self._is_met() else "the bounds of the limbs do not add up to the one asked for"
        allowed, is_relative = self._allowed_gap()
        own = self.incumbent.x
        in_other_mode = not nlp.in_home_mode and own is not None and is_in_home_mode(nlp, own) is False
        return Certificate(
            status=status,
            nlp=nlp,
            x=None if self.incumbent.x is None else frozen_array(self.incumbent.program_point(), (nlp.n,)),
            incumbent=sign * self.incumbent.value if known else math.nan,
            bound=sign * self.bound if status is not CertificateStatus.INFEASIBLE else math.nan,
            allowed=allowed,
            is_relative=is_relative,
            above=self.above,
            was_beaten=self.incumbent.was_beaten,
            engine=ENGINE,
            boxes=self.boxes_before + self.method.boxes,
            open=left,
            seconds=seconds,
            reason=reason,
            history=tuple(self.history),
            in_other_mode=in_other_mode,
        )

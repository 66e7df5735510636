"""Proved bound of the global optimum, by branch and bound over the whole box.

The C kernel examines boxes in blocks. A box is closed in three cases: its bound does not exceed the incumbent by more
than the gap, a condition is violated everywhere in the box, or no maximum lies in the box. Otherwise the box is
bisected. A search that stops early has a bound from the open boxes, which is weaker, but also proved.

No solver is trusted: the value of an incumbent is computed by the program's functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ....models import FloatArray, frozen_array
from ...case.task import Sense
from ...evidence.kkt import FEASIBLE, linearise
from ...evidence.state import ZERO_F
from ...interruption import one_search, reason_of, reason_to_stop
from ...program.epigraph import with_exact_level
from ...program.nlp import Nlp
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

#: Default of the relative gap.
GAP = 1e-4
#: Relative outward shift of every final bound: constants that CasADi folded into the graph are rounded.
_FOLDED = 1e-12
#: Fraction of the objective's scale below which an incumbent counts as 0, and a relative gap has no meaning.
_NEAR_ZERO = 1e-6
#: Relative excess of a gap that counts as rounding of sums.
_GAP_ROUNDING = 1e-9
#: Largest number of variables for a search of the whole box if limbs share variables; this search needs fewer boxes.
_WHOLE_BOX = 12
#: Largest number of entries in a history.
_HISTORY = 200

#: Callback with seconds, bound, incumbent, number of examined boxes, number of open boxes.
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
        x: (n,) best known point, such as the result of :func:`screwsynth.nlp.solve`; if None, a few points are tried.
        claimed: claimed objective at this point; a wrong claim is refused.
        gap: largest difference of bound and incumbent, relative to the incumbent. Near 0 it is relative to the
            objective's scale.
        above: lower bound of F to be proved on the whole box, instead of the optimum. The program must be a
            minimisation.
        time_limit: seconds after which the search stops with its present bound.
        jobs: number of threads; if left out, one for each processor. The result does not depend on this number.
        progress: function that is called about ten times a second.
        recorder: recorder of the search's tree for a proof.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
        ValueError: ``above`` is given for a maximisation.
        InputError: the C kernel was not built.
    """
    if above is not None and nlp.sense is not Sense.MIN:
        raise ValueError("above needs a nonlinear program that minimises F, but this one maximises F")
    with one_search(time_limit):
        effort = Effort()
        if nlp.n == 0:
            return _certify_point(nlp, above, effort.seconds)
        kernel()  # fails at once if it is missing
        form = standard_form(nlp)
        if form.n == 0:  # only the level of a worst case is free, and it follows from the single point
            return _certify_point(nlp, above, effort.seconds)
        search = _Search(form, gap, above, effort, jobs, progress)
        try:
            search.incumbent.start(x, claimed)
        except IncumbentError as error:
            return replace(search.certificate(str(error)), status=CertificateStatus.REFUSED)
        return search.certificate(reason_of(lambda: search.run(recorder)))


def _certify_point(nlp: Nlp, above: float | None, seconds: float) -> Certificate:
    """Return the certificate of a nonlinear program without variables of the case: the value at its single point."""
    x = frozen_array(with_exact_level(nlp, nlp.start), (nlp.n,))
    F, violation = nlp.evaluate(x)[0], linearise(nlp, x).violation
    status, reason = CertificateStatus.PROVED, ""
    if not ((nlp.lower <= x) & (x <= nlp.upper)).all():  # ends of a level are estimates, not limits of the case
        status, reason = CertificateStatus.INCOMPLETE, "the level of the worst case is beyond its estimated range"
    elif not violation <= FEASIBLE:
        status = CertificateStatus.INFEASIBLE
    elif not math.isfinite(F):
        status, reason = CertificateStatus.INCOMPLETE, "F has no finite value at the only point"
    elif above is not None and above >= F:
        status, reason = CertificateStatus.REFUSED, f"F is {F:.10g} at the only point, not above {above:.10g}"
    known = F if math.isfinite(F) else math.nan
    return Certificate(
        status, nlp, x, known, known, 0.0, bool(F), above, False, "none", 0, 0, seconds, reason, ((seconds, F, F),)
    )


class _Search:
    """State of a search; all values are maximised values of the standard form.

    Args:
        form: the form.
        gap, above, jobs, progress: arguments of :func:`certify_program`.
        effort: clock of the search.

    Attributes:
        incumbent: best known feasible point.
    """

    def __init__(
        self,
        form: StandardForm,
        gap: float,
        above: float | None,
        effort: Effort,
        jobs: int | None,
        progress: CertifyProgress | None,
    ) -> None:
        self._form, self._gap, self._above, self._jobs, self._progress = form, gap, above, jobs, progress
        self._effort, self.incumbent = replace(effort, progress=self._report), Incumbent(form)
        # Another method may replace this one; the set-up of a method can be interrupted.
        self._method: Search[Any] | IndependentSearch = optimum_search(form, self.incumbent, jobs, None)
        # (seconds, bound, incumbent) as objectives of the program, and number of boxes of earlier methods.
        self._history: list[tuple[float, float, float]] = []
        self._boxes_before = 0

    def run(self, recorder: TreeRecord | None) -> str:
        """Run the search until no box is open; return the reason for an earlier stop, or an empty text.

        A worse incumbent may have closed limbs with too large a part of the gap, or may have caused boxes to be
        bisected until they were too small. The search then begins again with the better point.
        """
        while not (reason := reason_to_stop(self._effort.seconds)):
            self._boxes_before += self._method.boxes
            self._method, first = self._new_method(recorder), self.incumbent.value
            reason = self._effort.run(self._method, self._ending, lambda: self._threshold)
            is_short = reason == TOO_SMALL or not (reason or self._method.bound == -math.inf or self._is_met())
            if not is_short or self._has_counterexample() or self.incumbent.value <= first:
                return reason
            if recorder is not None:
                recorder.clear()
        return reason

    def _new_method(self, recorder: TreeRecord | None) -> Search[Any] | IndependentSearch:
        """Return a new search of the form: by limbs if the form separates into limbs, otherwise of the whole box.

        A proof covers the whole box, without the use of mirror symmetries.
        """
        form, jobs = halved(self._form) if recorder is None else self._form, self._jobs
        separation = separate(form)
        if separation is not None and not separation.shared:
            return IndependentSearch(separation, self.incumbent, jobs, recorder)
        if separation is None or form.n <= _WHOLE_BOX:
            return optimum_search(form, self.incumbent, jobs, recorder)
        return shared_search(form, separation, self.incumbent, jobs, recorder)

    @property
    def _threshold(self) -> float:
        """Largest bound of a box that may be closed."""
        if self._above is not None:
            # The bound must be strictly below, by more than the final outward shift.
            value = self._form.value_of(self._above)
            return math.nextafter(value - 2 * _FOLDED * abs(value), -math.inf)
        if self.incumbent.x is None:
            return -math.inf
        # The gap must include the final outward shift of the bound.
        return self.incumbent.value + self._allowed_gap()[0] - 2 * _FOLDED * abs(self.incumbent.value)

    def _has_counterexample(self) -> bool:
        """Return whether a known point refutes the requested lower bound of F; rounding errors count as F = 0."""
        if self._above is None or self.incumbent.x is None:
            return False
        return self.incumbent.value >= self._form.value_of(self._above) - ZERO_F * self._form.size

    def _allowed_gap(self) -> tuple[float, bool]:
        """Return the largest difference of bound and incumbent, and whether it is relative to the incumbent."""
        floor, value = _NEAR_ZERO * self._form.size, abs(self.incumbent.value)
        is_relative = floor < value < math.inf
        # The relative gap of a square is gap (2 - gap), with the gap of its root.
        gap = self._gap if self._form.power == 1 else self._gap * (2 - self._gap)
        return gap * (value if is_relative else floor), is_relative

    @property
    def _bound(self) -> float:
        """Upper bound of the maximum, in the present state of the search."""
        bound = self._bound_of_tree
        # The signs of a long expression take time, and few searches need them.
        return min(bound, self._form.ceiling) if 0 < bound < math.inf else bound

    @property
    def _bound_of_tree(self) -> float:
        """Upper bound of the maximum from the boxes, which may be above 0 for a negative sum of squares."""
        known = max(self._method.bound, self.incumbent.value)
        return known + _FOLDED * abs(known) if math.isfinite(known) else known

    def _is_met(self) -> bool:
        """Return whether the bound meets the requested gap; tested when no box is open."""
        if self._above is not None:
            return self._bound_of_tree < self._form.value_of(self._above)
        return self._method.bound <= self._threshold + _GAP_ROUNDING * self._allowed_gap()[0]

    def _ending(self) -> str | None:
        """Return the reason for ending the search; None to continue."""
        if self._method.fault:
            return self._method.fault
        if not self._method.is_open:
            return TOO_SMALL if self._method.left else ""
        if self._has_counterexample():
            return f"F is {self._form.objective_of(self.incumbent.value):.10g} at a point of the box"
        return None

    def _report(self, seconds: float) -> None:
        """Call the progress function, and add the present bound and incumbent to the history."""
        bound, incumbent = self._noted(seconds)
        if self._progress is not None:
            self._progress(seconds, bound, incumbent, self._boxes_before + self._method.boxes, self._method.left)

    def _noted(self, seconds: float) -> tuple[float, float]:
        """Return bound and incumbent after adding them to the history; a full history loses every second entry."""
        bound, incumbent = map(self._form.objective_of, (self._bound, self.incumbent.value))
        if math.isfinite(bound) and math.isfinite(incumbent):
            if len(self._history) >= _HISTORY:
                del self._history[1::2]
            self._history.append((seconds, bound, incumbent))
        return bound, incumbent

    def certificate(self, reason: str) -> Certificate:
        """Return the certificate for the present state of the search."""
        nlp, x, seconds, left = self._form.nlp, self.incumbent.program_point(), self._effort.seconds, self._method.left
        bound, incumbent = self._noted(seconds)
        if x is not None and self._has_counterexample():
            status, named = CertificateStatus.REFUSED, zip(nlp.program.variables, x, strict=True)
            at = ", ".join(f"{variable.name} = {value:.6g}" for variable, value in named)
            reason = f"F is {incumbent:.10g} at {at}, not above {self._above:.10g}"
        elif left or reason:
            status = CertificateStatus.INCOMPLETE
        elif x is None and self._method.bound == -math.inf:
            status = CertificateStatus.INFEASIBLE
        elif self._is_met():
            status = CertificateStatus.PROVED
        else:
            status, reason = CertificateStatus.INCOMPLETE, "the sum of the limbs' bounds misses the requested gap"
        allowed, is_relative = self._allowed_gap()
        allowed = self._gap * abs(incumbent) if is_relative else allowed
        return Certificate(
            status=status,
            nlp=nlp,
            x=None if x is None else frozen_array(x, (nlp.n,)),
            incumbent=math.nan if x is None else incumbent,
            bound=math.nan if status is CertificateStatus.INFEASIBLE else bound,
            allowed=allowed,
            is_relative=is_relative,
            above=self._above,
            was_beaten=self.incumbent.was_beaten,
            engine=ENGINE,
            boxes=self._boxes_before + self._method.boxes,
            open=left,
            seconds=seconds,
            reason=reason,
            history=tuple(self._history),
            bound_of_tree=self._bound_of_tree,
            in_other_mode=not nlp.in_home_mode and x is not None and is_in_home_mode(nlp, x) is False,
        )

"""A proven bound of the global optimum, by branch and bound over the whole box.

Boxes are examined in blocks by the C kernel. A box is closed when its bound does not exceed the incumbent by more than
the gap, when a condition cannot hold in it, or when no maximum can lie in it; otherwise it is bisected. A search that
stops early has a bound too, from the boxes that are open: it is wider, and as certain as that at the end.

No solver is trusted: the value of an incumbent is that of the program's own functions at the point.
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
        if form.n == 0:  # the level of a worst case alone, which follows from the one point there is
            return _certify_point(nlp, above, effort.seconds)
        search = _Search(form, gap, above, effort, jobs, progress)
        try:
            search.incumbent.start(x, claimed)
        except IncumbentError as error:
            return replace(search.certificate(str(error)), status=CertificateStatus.REFUSED)
        return search.certificate(reason_of(lambda: search.run(recorder)))


def _certify_point(nlp: Nlp, above: float | None, seconds: float) -> Certificate:
    """Return the certificate of a program without variables of the case: its value at the one point is the bound."""
    x = frozen_array(with_exact_level(nlp, nlp.start), (nlp.n,))
    F, violation = nlp.evaluate(x)[0], linearise(nlp, x).violation
    status, reason = CertificateStatus.PROVED, ""
    if not ((nlp.lower <= x) & (x <= nlp.upper)).all():  # ends of a level are estimates, and no limits of the case
        status, reason = CertificateStatus.INCOMPLETE, "the level of the worst case is beyond its estimated ends"
    elif not violation <= FEASIBLE:
        status = CertificateStatus.INFEASIBLE
    elif not math.isfinite(F):
        status, reason = CertificateStatus.INCOMPLETE, "F has no finite value at the one point there is"
    elif above is not None and above >= F:
        status, reason = CertificateStatus.REFUSED, f"F is {F:.10g} at the one point there is, not above {above:.10g}"
    known = F if math.isfinite(F) else math.nan
    return Certificate(
        status, nlp, x, known, known, 0.0, bool(F), above, False, "none", 0, 0, seconds, reason, ((seconds, F, F),)
    )


class _Search:
    """The state of a search; all values are those of the standard form, which is maximised.

    Args:
        form: the form.
        gap, above, jobs, progress: as for :func:`certify_program`.
        effort: the clock.

    Attributes:
        incumbent: the best feasible point known.
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
        # The method in use takes the place of this one: what it sets up can be stopped.
        self._method: Search[Any] | IndependentSearch = optimum_search(form, self.incumbent, jobs, None)
        # (seconds, bound, incumbent) in the program's own sense, and the boxes that methods before this one examined.
        self._history: list[tuple[float, float, float]] = []
        self._boxes_before = 0

    def run(self, recorder: TreeRecord | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text.

        Before a better point was known, limbs may have been closed that leave too little of the gap for the others, or
        boxes divided until they were too small. Then the search begins again with that point.
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
        """Return the search for the form: by limbs where it separates, else of the whole box.

        A proof covers the whole box where mirrors would leave a part of it.
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
            # Strictly below, and by more than the bound moves outwards in the end.
            value = self._form.value_of(self._above)
            return math.nextafter(value - 2 * _FOLDED * abs(value), -math.inf)
        if self.incumbent.x is None:
            return -math.inf
        # The bound moves outwards in the end, and the gap must hold with that.
        return self.incumbent.value + self._allowed_gap()[0] - 2 * _FOLDED * abs(self.incumbent.value)

    def _has_counterexample(self) -> bool:
        """Return whether F is not above the value at a known point; an F that is rounding error counts as 0."""
        if self._above is None or self.incumbent.x is None:
            return False
        return self.incumbent.value >= self._form.value_of(self._above) - ZERO_F * self._form.size

    def _allowed_gap(self) -> tuple[float, bool]:
        """Return the largest difference of bound and incumbent, and whether it is a part of the incumbent."""
        floor, value = _NEAR_ZERO * self._form.size, abs(self.incumbent.value)
        is_relative = floor < value < math.inf
        # A square has a gap of (2 - gap) times that of its root.
        gap = self._gap if self._form.power == 1 else self._gap * (2 - self._gap)
        return gap * (value if is_relative else floor), is_relative

    @property
    def _bound(self) -> float:
        """Upper bound of the maximum, at this state of the search."""
        bound = self._bound_of_tree
        # Signs of a long expression take a while, and matter to few searches.
        return min(bound, self._form.ceiling) if 0 < bound < math.inf else bound

    @property
    def _bound_of_tree(self) -> float:
        """The same as the boxes show it, which may be above 0 for minus a sum of squares."""
        known = max(self._method.bound, self.incumbent.value)
        return known + _FOLDED * abs(known) if math.isfinite(known) else known

    def _is_met(self) -> bool:
        """Return whether the bound is as good as asked for, once no box is open."""
        if self._above is not None:
            return self._bound_of_tree < self._form.value_of(self._above)
        return self._method.bound <= self._threshold + _GAP_ROUNDING * self._allowed_gap()[0]

    def _ending(self) -> str | None:
        """Return the reason for ending; None for going on."""
        if self._method.fault:
            return self._method.fault
        if not self._method.is_open:
            return TOO_SMALL if self._method.left else ""
        if self._has_counterexample():
            return f"F is {self._form.objective_of(self.incumbent.value):.10g} at a point of the box"
        return None

    def _report(self, seconds: float) -> None:
        """Report progress, and add to the history."""
        bound, incumbent = self._noted(seconds)
        if self._progress is not None:
            self._progress(seconds, bound, incumbent, self._boxes_before + self._method.boxes, self._method.left)

    def _noted(self, seconds: float) -> tuple[float, float]:
        """Return bound and incumbent, added to the history; a full one loses every second entry."""
        bound, incumbent = map(self._form.objective_of, (self._bound, self.incumbent.value))
        if math.isfinite(bound) and math.isfinite(incumbent):
            if len(self._history) >= _HISTORY:
                del self._history[1::2]
            self._history.append((seconds, bound, incumbent))
        return bound, incumbent

    def certificate(self, reason: str) -> Certificate:
        """Return the certificate at this state of the search."""
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
            status, reason = CertificateStatus.INCOMPLETE, "the bounds of the limbs do not add up to the one asked for"
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

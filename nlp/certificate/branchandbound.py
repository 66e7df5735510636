"""A proven bound of the global optimum, by branch and bound over the whole box.

Boxes are examined in blocks by :mod:`screwsynth.nlp.certificate.bounding`, or by the C kernel with the same formulas. A
box is closed when its bound does not exceed the incumbent by more than the gap, when a condition cannot hold in it, or
when no maximum can lie in it; otherwise it is bisected. A search that stops early has a bound too, from the boxes that
are open: it is wider, and as certain as that at the end.

No solver is trusted: the value of an incumbent is that of the program's own functions at the point.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.task import Sense
from ..evidence.kkt import FEASIBLE, linearise
from ..evidence.state import ZERO_F
from ..interruption import Milestone, is_requested, reached
from ..program.nlp import Nlp
from .certificate import Certificate, CertificateStatus
from .engines import Engine, engine_for
from .examination import Examination, Verdict
from .incumbent import Incumbent, IncumbentError
from .openboxes import Boxes, OpenBoxes
from .proofwriter import ProofWriter
from .standardform import StandardForm, is_in_home_mode, standard_form

#: The gap asked for when none is given: a ten-thousandth.
GAP = 1e-4
#: Part of itself by which every bound moves outwards in the end: constants that CasADi folded when it built the graph
#: are rounded doubles of their own.
_FOLDED = 1e-12
#: Part of the objective's scale below which an incumbent counts as 0: a gap relative to it would have no meaning.
_NEAR_ZERO = 1e-6
#: Width, in parts of the whole box, below which a box without a finite bound is taken to hold a point without a value.
_SINGULAR_WIDTH = 2.0**-16
#: Width, in parts of the whole box, below which a box is not bisected.
_LEAST_WIDTH = 2.0**-40
#: Seconds between two reports of progress, and the largest number of entries in a history.
_REPORT_EVERY = 0.1
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
    engine: str | None = None,
    progress: CertifyProgress | None = None,
    recorder: ProofWriter | None = None,
) -> Certificate:
    """Prove a bound of a program's global optimum.

    Args:
        nlp: the program.
        x: (n,) the best point known, as from :func:`screwsynth.nlp.solve`; without one a few are tried.
        claimed: the objective claimed there; the claim is refused when it is wrong.
        gap: largest difference of bound and incumbent, as a part of the incumbent; near 0, of the objective's scale.
        above: prove, instead, that F is above this value on the whole box. The program must be a minimisation.
        time_limit: seconds after which the search stops with the bound reached.
        jobs: threads of the C kernel; the result does not depend on it. Left out, one for each processor.
        engine: ``"c"`` or ``"numpy"``; left out, the C kernel where it was built.
        progress: called about ten times a second.
        recorder: records the search's tree for a proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: ``above`` for a maximisation, or an engine that does not exist here.
    """
    began = time.perf_counter()
    if above is not None and nlp.sense is not Sense.MIN:
        raise ValueError("above is proved by minimising: the program's sense must be min")
    if nlp.n == 0:
        return _certify_point(nlp, above, time.perf_counter() - began)
    form = standard_form(nlp)
    chosen = engine_for(form, engine, jobs)
    search = _Search(form, chosen, gap, above, began, recorder)
    try:
        search.incumbent.start(x, claimed)
    except IncumbentError as error:
        return replace(search.certificate(str(error)), status=CertificateStatus.REFUSED)
    reason = ""
    try:
        reason = search.run(time_limit, progress)
    except KeyboardInterrupt:
        reason = "interrupted"
    finally:
        chosen.close()
    return search.certificate(reason)


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


class _Gap(NamedTuple):
    """Largest difference of bound and incumbent, in the objective's unit, and whether it is a part of the incumbent."""

    size: float
    is_relative: bool


@dataclass
class _Search:
    """The state of a search; all values are those of the standard form, which is maximised.

    Attributes:
        form: the form.
        engine: examines boxes.
        gap: as for :func:`certify_program`.
        above: as for :func:`certify_program`.
        began: time at the start.
        recorder: records the search's tree for a proof.
        incumbent: the best feasible point known.
        opened: boxes to be examined.
        current: boxes under examination; None between two blocks.
        undivided: open boxes that are too small to bisect.
        closed_bound: largest bound of all boxes that were closed because of their bounds.
        boxes, nodes: number of boxes examined, and of nodes in the tree.
        history: (seconds, bound, incumbent) in the program's own sense.
    """

    form: StandardForm
    engine: Engine
    gap: float
    above: float | None
    began: float
    recorder: ProofWriter | None

    def __post_init__(self) -> None:
        form = self.form
        self.incumbent = Incumbent(form)
        self.opened = OpenBoxes()
        root = np.zeros(1, dtype=np.int64)
        self.opened.push(Boxes(form.lower[:, None], form.upper[:, None], np.array([np.inf]), root))
        self.current: Boxes | None = None
        self.undivided: list[Boxes] = []
        self.closed_bound = -math.inf
        self.boxes, self.nodes = 0, 1
        self.history: list[tuple[float, float, float]] = []

    @property
    def threshold(self) -> float:
        """Largest bound of a box that may be closed."""
        if self.above is not None:
            # Strictly below, and by more than the bound moves outwards in the end.
            return math.nextafter(-self.above - 2 * _FOLDED * abs(self.above), -math.inf)
        if self.incumbent.x is None:
            return -math.inf
        # The bound moves outwards in the end, and the gap must hold with that.
        return self.incumbent.value + self._allowed_gap().size - 2 * _FOLDED * abs(self.incumbent.value)

    def _has_counterexample(self) -> bool:
        """Return whether F is not above the value at a known point; an F that is rounding error counts as 0."""
        if self.above is None or self.incumbent.x is None:
            return False
        return self.incumbent.value >= -self.above - ZERO_F * self.form.nlp.objective_size

    def _allowed_gap(self) -> _Gap:
        floor, value = _NEAR_ZERO * self.form.nlp.objective_size, abs(self.incumbent.value)
        if floor < value < math.inf:
            return _Gap(self.gap * value, is_relative=True)
        return _Gap(self.gap * floor, is_relative=False)

    @property
    def bound(self) -> float:
        """Upper bound of the maximum, at this state of the search."""
        others = [float(boxes.bound.max()) for boxes in self.undivided]
        if self.current is not None:
            others.append(float(self.current.bound.max()))
        known = max(self.closed_bound, self.opened.bound, *others, self.incumbent.value)
        return known + _FOLDED * abs(known) if math.isfinite(known) else known

    def run(self, time_limit: float | None, progress: CertifyProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        reported = -math.inf
        turn = 0
        reached(Milestone.BOUND)
        while self.opened.count:
            if is_requested():
                return "interrupted"
            if self._has_counterexample():
                return f"F is {self.form.sign * self.incumbent.value:.10g} at a point of the box"
            seconds = time.perf_counter() - self.began
            if time_limit is not None and seconds >= time_limit:
                return f"stopped after {seconds:.3g} s"
            if seconds - reported >= _REPORT_EVERY:
                reported = seconds
                self._report(seconds, progress)
            self.current = self.opened.pop(self.engine.block if turn else 1)
            turn += 1
            found = self.engine.examine(self.current.lower, self.current.upper, self.threshold)
            self._improve(found, turn)
            self._branch(self.current, found)
            self.current = None
            undefined = [boxes for boxes in self.undivided if not np.isfinite(boxes.bound).all()]
            if undefined:
                return self._reason_without_bound(undefined[0])
        return "boxes are left that are too small to cut" if self.undivided else ""

    def _improve(self, found: Examination, turn: int) -> None:
        """Improve the incumbent from the best centre of a block, or from the centre of the box with the largest bound.

        The latter costs more, and is tried at turns 1, 2, 4, 8 and so on.
        """
        best = int(np.argmax(found.value))
        if found.value[best] > self.incumbent.value:
            self.incumbent.consider(found.centre[:, best])
        if turn & (turn - 1) == 0:
            self.incumbent.improve_near(found.centre[:, int(np.argmax(np.nan_to_num(found.bound, posinf=-math.inf)))])

    def _branch(self, boxes: Boxes, found: Examination) -> None:
        """Bisect the open boxes, and account for the others."""
        threshold = self.threshold
        closed = found.verdict == Verdict.BOUNDED
        if closed.any():
            self.closed_bound = max(self.closed_bound, float(found.bound[closed].max()))
        if self._is_contracted_by_value(found):
            self.closed_bound = max(self.closed_bound, threshold)
        self.boxes += boxes.count
        bound = np.fmin(found.bound, boxes.bound)
        lower, upper, split = found.lower, found.upper, found.split
        every = np.arange(boxes.count)
        low, high = lower[split, every], upper[split, every]
        middle = 0.5 * low + 0.5 * high
        whole = (self.form.upper - self.form.lower)[:, None]
        width = ((upper - lower) / whole).max(axis=0)
        least = np.where(np.isfinite(bound), _LEAST_WIDTH, _SINGULAR_WIDTH)
        is_open = found.verdict == Verdict.OPEN
        small = is_open & ((width < least) | ~((low < middle) & (middle < high)))
        # A box that collapsed to one that cannot be bisected, such as a corner, has not been examined as that box yet.
        again = small & ((lower != boxes.lower) | (upper != boxes.upper)).any(axis=0)
        once, done, cut = (np.flatnonzero(which) for which in (again, small & ~again, is_open & ~small))
        first_child = np.full(boxes.count, -1, dtype=np.int64)
        first_child[cut] = self.nodes + 2 * np.arange(cut.size)
        first_child[once] = self.nodes + 2 * cut.size + np.arange(once.size)
        self.nodes += 2 * cut.size + once.size
        if self.recorder is not None:
            is_cut = is_open & ~small
            self.recorder.record(boxes, found, np.where(is_cut, middle, np.nan), first_child)
        if done.size:
            self.undivided.append(Boxes(lower[:, done], upper[:, done], bound[done], boxes.place[done]))
        self.opened.push(Boxes(lower[:, once], upper[:, once], bound[once], first_child[once]))
        left, right = upper[:, cut].copy(), lower[:, cut].copy()
        columns = np.arange(cut.size)
        left[split[cut], columns] = right[split[cut], columns] = middle[cut]
        self.opened.push(
            Boxes(
                np.concatenate([lower[:, cut], right], axis=1),
                np.concatenate([left, upper[:, cut]], axis=1),
                np.concatenate([bound[cut], bound[cut]]),
                np.concatenate([first_child[cut], first_child[cut] + 1]),
            )
        )

    def _is_contracted_by_value(self, found: Examination) -> bool:
        """Return whether a contraction excluded points because of their value, which is at most the threshold."""
        count = len(self.form.functions)
        return any(bool(((why >= 0) & (why < count)).any()) for why in (found.cut_lower, found.cut_upper))

    def _reason_without_bound(self, boxes: Boxes) -> str:
        """Return the reason for stopping at boxes without a finite bound, with the place of the first."""
        which = int(np.argmin(np.isfinite(boxes.bound)))
        point = 0.5 * (boxes.lower[:, which] + boxes.upper[:, which])
        at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.form.names, point, strict=True))
        return f"the expressions have no finite bound near {at}, as where a limb has zero length"

    def _report(self, seconds: float, progress: CertifyProgress | None) -> None:
        """Report progress, and add to the history; a full history loses every second entry."""
        bound, incumbent = self.form.sign * self.bound, self.form.sign * self.incumbent.value
        if math.isfinite(bound) and math.isfinite(incumbent):
            if len(self.history) >= _HISTORY:
                del self.history[1::2]
            self.history.append((seconds, bound, incumbent))
        if progress is not None:
            progress(seconds, bound, incumbent, self.boxes, self.opened.count)

    def certificate(self, reason: str) -> Certificate:
        """Return the certificate at this state of the search."""
        nlp, sign = self.form.nlp, self.form.sign
        seconds = time.perf_counter() - self.began
        self._report(seconds, None)
        left = self.opened.count + sum(boxes.count for boxes in self.undivided)
        left += 0 if self.current is None else self.current.count
        known = self.incumbent.x is not None
        if self._has_counterexample():
            status = CertificateStatus.REFUSED
            at = ", ".join(
                f"{name} = {value:.6g}"
                for name, value in zip(self.form.names, self.incumbent.program_point(), strict=False)
            )
            reason = f"F is {sign * self.incumbent.value:.10g} at {at}, not above {self.above:.10g}"
        elif left:
            status = CertificateStatus.INCOMPLETE
        else:
            status = CertificateStatus.PROVED if known else CertificateStatus.INFEASIBLE
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
            engine=self.engine.name,
            boxes=self.boxes,
            open=left,
            seconds=seconds,
            reason=reason,
            history=tuple(self.history),
            in_other_mode=in_other_mode,
        )

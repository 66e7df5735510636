"""A proven bound of the global optimum, by branch and bound over the whole box.

Boxes are examined in blocks by :mod:`screwsynth.nlp.certificate.bounding`, or by the C kernel that does the same. A box
is closed when its bound does not exceed the best value known by more than the gap, when a condition cannot hold in it,
or when no maximum can lie in it; otherwise it is cut in two. What is left when the search is stopped still gives a
bound, which is as sure as that at the end.

Nothing here trusts a solver: an incumbent is a point at which the program's own functions are evaluated.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.task import Sense
from ..evidence.kkt import FEASIBLE, linearise
from ..evidence.state import ZERO_F
from ..program.nlp import Nlp
from .bounding import Examined, Verdict
from .certificate import Certificate, CertificateStatus
from .engines import Engine, engine_for
from .incumbent import Incumbent, IncumbentError
from .openboxes import Boxes, OpenBoxes
from .standardform import StandardForm, standard_form

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: The gap that is asked for when none is given: a ten-thousandth.
GAP = 1e-4
#: What every bound is moved outwards by in the end, in parts of itself: constants that CasADi folded when it built the
#: graph are rounded doubles of their own.
_FOLDED = 1e-12
#: An incumbent below this part of the objective's scale counts as 0 when a gap is asked for as a part of it.
_NEAR_ZERO = 1e-6
#: A box all of whose sides are below this part of the whole box's and that has no finite bound holds, for every
#: practical purpose, a point without a value.
_SINGULAR_WIDTH = 2.0**-16
#: A box below this is not cut further.
_LEAST_WIDTH = 2.0**-40
#: Seconds between two reports of progress, and the most entries of a history.
_REPORT_EVERY = 0.1
_HISTORY = 200

#: Called with seconds, bound, incumbent, boxes examined, boxes open.
CertifyProgress = Callable[[float, float, float, int, int], None]


class Recorder(Protocol):
    """Takes down what became of every box: see :mod:`screwsynth.nlp.certificate.proof`."""

    def record(self, boxes: Boxes, found: Examined, cut: FloatArray, first_child: NDArray[np.int64]) -> None:
        """A block of examined boxes.

        Args:
            boxes: as they were.
            found: what became of them.
            cut: (B,) where ``found.split`` was cut in two; NaN where it was not.
            first_child: (B,) place of the lower half, of which the upper half's is the next; without a cut, of what is
                left of the box; -1 where nothing follows.
        """


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
    recorder: Recorder | None = None,
) -> Certificate:
    """Prove a bound of a program's global optimum.

    Args:
        nlp: the program.
        x: (n,) the best point known, as from :func:`screwsynth.nlp.solve`; without one a few are tried.
        claimed: what the objective is said to be there; refused when it is not.
        gap: part of the incumbent that the bound may be off by, or of the objective's scale where the incumbent is 0.
        above: prove, instead, that F is above this value on the whole box. The program must be a minimisation.
        time_limit: seconds after which the search stops with what it has.
        jobs: threads of the C kernel; the result does not depend on it. Left out, one for each processor.
        engine: ``"c"`` or ``"numpy"``; left out, the C kernel where it was built.
        progress: called now and then.
        recorder: takes down the proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: ``above`` for a maximisation, or an engine that is not there.
    """
    began = time.perf_counter()
    if above is not None and nlp.sense is not Sense.MIN:
        raise ValueError("above is proved by minimising: the program's sense must be min")
    if nlp.n == 0:
        return _fixed(nlp, above, time.perf_counter() - began)
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


def _fixed(nlp: Nlp, above: float | None, seconds: float) -> Certificate:
    """Nothing is free: the value at the one point is its own bound."""
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


@dataclass
class _Search:
    """The state of a search; all values are those of the standard form, which is maximised."""

    form: StandardForm
    engine: Engine
    gap: float
    above: float | None
    began: float
    recorder: Recorder | None

    def __post_init__(self) -> None:
        form = self.form
        self.incumbent = Incumbent(form)
        self.opened = OpenBoxes()
        root = np.zeros(1, dtype=np.int64)
        self.opened.push(Boxes(form.lower[:, None], form.upper[:, None], np.array([np.inf]), root))
        self.taken: Boxes | None = None
        self.aside: list[Boxes] = []
        self.proved = -math.inf
        self.boxes, self.places = 0, 1
        self.history: list[tuple[float, float, float]] = []

    @property
    def threshold(self) -> float:
        """Boxes are closed when their bound is at most this."""
        if self.above is not None:
            # Strictly below, and by more than the bound is moved outwards in the end.
            return math.nextafter(-self.above - 2 * _FOLDED * abs(self.above), -math.inf)
        if self.incumbent.x is None:
            return -math.inf
        # Less what the bound is moved outwards by in the end, so that the gap holds with it.
        return self.incumbent.value + self._allowed()[0] - 2 * _FOLDED * abs(self.incumbent.value)

    def _refuted(self) -> bool:
        """Whether a point is known where F is not above the value; an F that is rounding error counts as 0."""
        if self.above is None or self.incumbent.x is None:
            return False
        return self.incumbent.value >= -self.above - ZERO_F * self.form.nlp.objective_scale

    def _allowed(self) -> tuple[float, bool]:
        """The absolute gap, and whether it is a part of the incumbent."""
        floor, value = _NEAR_ZERO * self.form.nlp.objective_scale, abs(self.incumbent.value)
        return (self.gap * value, True) if floor < value < math.inf else (self.gap * floor, False)

    @property
    def bound(self) -> float:
        """Upper bound of the maximum as it stands."""
        waiting = [float(boxes.bound.max()) for boxes in self.aside]
        if self.taken is not None:
            waiting.append(float(self.taken.bound.max()))
        known = max(self.proved, self.opened.bound, *waiting, self.incumbent.value)
        return known + _FOLDED * abs(known) if math.isfinite(known) else known

    def run(self, time_limit: float | None, progress: CertifyProgress | None) -> str:
        """Search until nothing is left; returns why it stopped before, or nothing."""
        reported = -math.inf
        turn = 0
        while self.opened.count:
            if self._refuted():
                return f"F is {self.form.sign * self.incumbent.value:.10g} at a point of the box"
            seconds = time.perf_counter() - self.began
            if time_limit is not None and seconds >= time_limit:
                return f"stopped after {seconds:.3g} s"
            if seconds - reported >= _REPORT_EVERY:
                reported = seconds
                self._report(seconds, progress)
            self.taken = self.opened.pop(self.engine.block if turn else 1)
            turn += 1
            found = self.engine.examine(self.taken.lower, self.taken.upper, self.threshold)
            self._improve(found, turn)
            self._branch(self.taken, found)
            self.taken = None
            undefined = [boxes for boxes in self.aside if not np.isfinite(boxes.bound).all()]
            if undefined:
                return self._undefined(undefined[0])
        return "boxes are left that are too small to cut" if self.aside else ""

    def _improve(self, found: Examined, turn: int) -> None:
        """Take a better point where one is met; now and then look for one near the most promising box."""
        best = int(np.argmax(found.value))
        if found.value[best] > self.incumbent.value:
            self.incumbent.take(found.centre[:, best])
        if turn & (turn - 1) == 0:
            self.incumbent.look_near(found.centre[:, int(np.argmax(np.nan_to_num(found.bound, posinf=-math.inf)))])

    def _branch(self, boxes: Boxes, found: Examined) -> None:
        """Cut the open boxes in two, and keep account of the others."""
        threshold = self.threshold
        closed = found.verdict == Verdict.BOUNDED
        if closed.any():
            self.proved = max(self.proved, float(found.bound[closed].max()))
        if self._cut_by_value(found):
            self.proved = max(self.proved, threshold)
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
        # A box that collapsed to less than can be cut, such as a corner, was not examined as what it is now.
        again = small & ((lower != boxes.lower) | (upper != boxes.upper)).any(axis=0)
        once, done, cut = (np.flatnonzero(which) for which in (again, small & ~again, is_open & ~small))
        first_child = np.full(boxes.count, -1, dtype=np.int64)
        first_child[cut] = self.places + 2 * np.arange(cut.size)
        first_child[once] = self.places + 2 * cut.size + np.arange(once.size)
        self.places += 2 * cut.size + once.size
        if self.recorder is not None:
            is_cut = is_open & ~small
            self.recorder.record(boxes, found, np.where(is_cut, middle, np.nan), first_child)
        if done.size:
            self.aside.append(Boxes(lower[:, done], upper[:, done], bound[done], boxes.place[done]))
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

    def _cut_by_value(self, found: Examined) -> bool:
        """Whether a contraction took off points because of their value, which is then at most the threshold."""
        count = len(self.form.functions)
        return any(bool(((why >= 0) & (why < count)).any()) for why in (found.cut_lower, found.cut_upper))

    def _undefined(self, boxes: Boxes) -> str:
        which = int(np.argmin(np.isfinite(boxes.bound)))
        point = 0.5 * (boxes.lower[:, which] + boxes.upper[:, which])
        at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.form.names, point, strict=True))
        return f"the expressions have no finite bound near {at}, as where a limb has zero length"

    def _report(self, seconds: float, progress: CertifyProgress | None) -> None:
        bound, incumbent = self.form.sign * self.bound, self.form.sign * self.incumbent.value
        if math.isfinite(bound) and math.isfinite(incumbent):
            if len(self.history) >= _HISTORY:
                del self.history[1::2]
            self.history.append((seconds, bound, incumbent))
        if progress is not None:
            progress(seconds, bound, incumbent, self.boxes, self.opened.count)

    def certificate(self, reason: str) -> Certificate:
        """What is known now."""
        nlp, sign = self.form.nlp, self.form.sign
        seconds = time.perf_counter() - self.began
        self._report(seconds, None)
        left = self.opened.count + sum(boxes.count for boxes in self.aside)
        left += 0 if self.taken is None else self.taken.count
        known = self.incumbent.x is not None
        if self._refuted():
            status = CertificateStatus.REFUSED
            at = ", ".join(
                f"{name} = {value:.6g}" for name, value in zip(self.form.names, self.incumbent.full(), strict=False)
            )
            reason = f"F is {sign * self.incumbent.value:.10g} at {at}, not above {self.above:.10g}"
        elif left:
            status = CertificateStatus.INCOMPLETE
        else:
            status = CertificateStatus.PROVED if known else CertificateStatus.INFEASIBLE
        allowed, is_relative = self._allowed()
        return Certificate(
            status=status,
            nlp=nlp,
            x=None if self.incumbent.x is None else frozen_array(self.incumbent.full(), (nlp.n,)),
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
        )

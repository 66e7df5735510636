"""Search of a form whose limbs share no variable: one search for each limb, and the sum of their bounds.

The maximum of the sum is the sum of the limbs' maxima. Each limb gets an equal part of the gap: it is closed when no
bound of its boxes exceeds the limb's value at the incumbent by more than this part.
"""

from __future__ import annotations

import math
from functools import partial

from ...statement.limb_separation import Separation
from ..incumbent import Incumbent, LimbPoint
from ..optimum import optimum_search
from ..symmetry import grouped
from ..tree import TreeRecord

#: Rounding error of a sum of a few terms, relative to their absolute values; many times the largest possible one.
_SUM = 1e-14


class IndependentSearch:
    """Searches of limbs without shared variables.

    Args:
        separation: limbs of the form.
        incumbent: best known point, which the search improves.
        jobs: number of threads.
        recorder: recorder of the limbs' trees for a proof.
    """

    def __init__(
        self, separation: Separation, incumbent: Incumbent, jobs: int | None, recorder: TreeRecord | None = None
    ) -> None:
        self._constant, limbs = separation.constant, separation.limbs
        # A proof needs a tree for each limb, also for copies.
        groups = grouped([limb.form for limb in limbs]) if recorder is None else [[k] for k in range(len(limbs))]
        self._copies, self._incumbent = [len(group) for group in groups], incumbent
        self._searches = [
            optimum_search(
                limbs[group[0]].form,
                LimbPoint([limbs[each] for each in group], incumbent),
                jobs,
                None if recorder is None else recorder.limb(partial(self._limb_bound, k)),
            )
            for k, group in enumerate(groups)
        ]

    @property
    def _is_infeasible(self) -> bool:
        """Whether a limb has no feasible point."""
        return self._incumbent.x is None and any(each.left == 0 and each.bound == -math.inf for each in self._searches)

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined; False if a limb has no feasible point."""
        return not self._is_infeasible and any(each.is_open for each in self._searches)

    @property
    def left(self) -> int:
        """Number of open boxes of all limbs."""
        return 0 if self._is_infeasible else sum(each.left for each in self._searches)

    @property
    def boxes(self) -> int:
        """Number of boxes examined."""
        return sum(each.boxes for each in self._searches)

    @property
    def bound(self) -> float:
        """Upper bound of the maximum: the sum of the limbs' bounds, rounded up."""
        if self._is_infeasible:
            return -math.inf
        bounds = [*(count * self._limb_bound(k) for k, count in enumerate(self._copies)), self._constant]
        return math.fsum(bounds) + _SUM * math.fsum(map(abs, bounds))

    def _limb_bound(self, k: int) -> float:
        """Return the upper bound of one limb."""
        return max(self._searches[k].bound, self._searches[k].rule.incumbent.value)

    @property
    def fault(self) -> str:
        """Reason for stopping at boxes without a finite bound; empty without such boxes."""
        return next((each.fault for each in self._searches if each.fault), "")

    def step(self, target: float) -> None:
        """Examine a block of boxes of the limb that exceeds its part of the target most."""
        values = [each.rule.incumbent.value for each in self._searches]
        every = [*(count * value for count, value in zip(self._copies, values, strict=True)), self._constant]
        room = target - math.fsum(every) if all(map(math.isfinite, values)) else -math.inf
        # Twice, as the sum of the bounds is rounded up too.
        rounding = 2 * _SUM * math.fsum(map(abs, [*every, room]))
        part = (room - rounding) / sum(self._copies) if math.isfinite(room) else -math.inf
        openest = max(
            (k for k, each in enumerate(self._searches) if each.is_open),
            key=lambda k: self._searches[k].bound - values[k] if math.isfinite(values[k]) else math.inf,
        )
        self._searches[openest].step(values[openest] + part if math.isfinite(part) else -math.inf)

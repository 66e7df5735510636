"""Search of a form whose limbs share no variable: each limb's box by itself, and the sum of their bounds.

The best of the sum is the sum of the limbs' bests. Each limb gets an equal part of the gap: it is closed where no box
of it has a bound above the limb's value at the incumbent by more than this part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from .....models import FloatArray
from ...statement.limb_separation import Limb, Separation
from ...statement.standard_form import StandardForm
from ..engine import Engine
from ..incumbent import Incumbent
from ..optimum import optimum_search
from ..symmetry import grouped
from ..tree import TreeRecord

#: Rounding of a sum of a few terms, in parts of their sizes: many times the largest possible.
_SUM = 1e-14


class LimbPoint:
    """The part of the incumbent that belongs to one limb, or to its copies too.

    Args:
        limbs: the limb and its copies.
        whole: the incumbent, which a better part improves.
        parts: the best known part of each limb while there is no incumbent; shared by all limbs.
    """

    def __init__(self, limbs: Sequence[Limb], whole: Incumbent, parts: dict[tuple[int, ...], FloatArray]) -> None:
        self._limbs, self._whole, self._parts = limbs, whole, parts
        self._at: FloatArray | None = None
        self._value = -math.inf

    @property
    def value(self) -> float:
        """Value of the limb at the incumbent, the mean where it has copies; -inf without one."""
        if self._whole.x is not self._at and self._whole.x is not None:
            at = self._whole.x
            values = [each.form.value_at(at[list(each.own)]) for each in self._limbs]
            # The point last: an interrupt before it leaves the value to be computed again.
            self._value = math.fsum(values) / len(values)
            self._at = at
        return self._value

    def consider(self, point: FloatArray) -> None:
        """Improve the incumbent by a part (d,) of it, if that is feasible and better."""
        whole = self._with_part(point)
        if whole is not None:
            self._whole.consider(whole)

    def improve_near(self, point: FloatArray) -> None:
        """Improve the incumbent from a part (d,) of it that is not feasible yet."""
        whole = self._with_part(point)
        if whole is not None:
            self._whole.improve_near(whole)

    def _with_part(self, point: FloatArray) -> FloatArray | None:
        """Return the incumbent with another part; without one, the limbs' parts together, once there is one of each."""
        if self._whole.x is not None:
            whole = self._whole.x.copy()
            for each in self._limbs:
                whole[list(each.own)] = point
            return whole
        for each in self._limbs:
            self._parts[each.own] = point
        whole = np.full(self._whole.size, np.nan)
        for places, part in self._parts.items():
            whole[list(places)] = part
        return whole if np.isfinite(whole).all() else None


class IndependentSearch:
    """Searches of limbs without shared variables.

    Args:
        form: the whole form.
        separation: its limbs.
        incumbent: the best point known, which the search improves.
        jobs: threads.
        recorder: records the limbs' trees for a proof.
    """

    def __init__(
        self,
        form: StandardForm,
        separation: Separation,
        incumbent: Incumbent,
        jobs: int | None,
        recorder: TreeRecord | None = None,
    ) -> None:
        self._constant, limbs = separation.constant, separation.limbs
        # A proof has a tree for each limb.
        groups = grouped([limb.form for limb in limbs]) if recorder is None else [[k] for k in range(len(limbs))]
        self._copies = [len(group) for group in groups]
        parts: dict[tuple[int, ...], FloatArray] = {}
        self._searches = [
            optimum_search(
                limbs[group[0]].form,
                partial(Engine, limbs[group[0]].form, jobs, tangents=recorder is None),
                LimbPoint([limbs[each] for each in group], incumbent, parts),
                None if recorder is None else recorder.limb(partial(self._limb_bound, k)),
            )
            for k, group in enumerate(groups)
        ]
        self._form, self._incumbent = form, incumbent

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined; none are once a limb has no feasible point."""
        return not self._is_infeasible and any(each.is_open for each in self._searches)

    @property
    def _is_infeasible(self) -> bool:
        """Whether some limb has no feasible point."""
        return self._incumbent.x is None and any(each.left == 0 and each.bound == -math.inf for each in self._searches)

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
        bounds = [count * self._limb_bound(k) for k, count in enumerate(self._copies)]
        total = math.fsum([*bounds, self._constant])
        return total + _SUM * math.fsum(map(abs, [*bounds, self._constant]))

    def _limb_bound(self, k: int) -> float:
        """Return the upper bound of one limb."""
        return max(self._searches[k].bound, self._searches[k].rule.incumbent.value)

    @property
    def fault(self) -> str:
        """Reason for stopping at boxes without a finite bound; empty without any."""
        return next((each.fault for each in self._searches if each.fault), "")

    def step(self, threshold: float) -> None:
        """Examine a block of boxes of the limb that is furthest from its part of the threshold."""
        values = [each.rule.incumbent.value for each in self._searches]
        every = [*(count * value for count, value in zip(self._copies, values, strict=True)), self._constant]
        room = threshold - math.fsum(every) if all(map(math.isfinite, values)) else -math.inf
        # Twice, since the sum of the bounds is rounded up too.
        rounding = 2 * _SUM * math.fsum(map(abs, [*every, room]))
        part = (room - rounding) / sum(self._copies) if math.isfinite(room) else -math.inf
        openest = max(
            (k for k, each in enumerate(self._searches) if each.is_open),
            key=lambda k: self._searches[k].bound - values[k] if math.isfinite(values[k]) else math.inf,
        )
        self._searches[openest].step(values[openest] + part if math.isfinite(part) else -math.inf)

    def close(self) -> None:
        """Stop the engines."""
        for each in self._searches:
            each.close()

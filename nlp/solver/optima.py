"""The distinct optima that the starts of a search converged to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ..evidence.assembly import Assembly, assembly_over_poses
from ..evidence.optimality import Evidence, PointKind, examine
from ..evidence.workingmode import turned_over_poses
from ..program.nlp import Nlp
from .starts import SAME_POINT, Start, StartStatus
from .status import Phase, PhaseProgress

#: Two optima have the same F when it differs by less than this part of F's scale.
SAME_VALUE = 1e-9


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum that starts converged to.

    Attributes:
        F: objective.
        count: number of starts that ended there.
        x: (n,) one of the points.
        spread: largest distance between its points along one variable, as a part of that variable's range: 0 for an
            isolated optimum, up to 1 for a set of them, which may have several pieces.
        evidence: the evidence at ``x``.
        nlp: the program.
    """

    F: float
    count: int
    x: FloatArray
    spread: float
    evidence: Evidence
    nlp: Nlp

    @cached_property
    def assembly(self) -> Assembly | None:
        """The way in which the joints are assembled at ``x``, found when it is first used; None without loops."""
        return assembly_over_poses(self.nlp, self.x)


def same_value(nlp: Nlp) -> float:
    """Return the largest difference of F between optima that have the same F."""
    return max(SAME_VALUE, nlp.rounding) * nlp.objective_scale


class Distinct(NamedTuple):
    """Starts, with saddles and singular limbs marked by their status, and the distinct optima, best first."""

    starts: list[Start]
    optima: list[Optimum]


def distinct_optima(nlp: Nlp, done: Sequence[Start], phase: PhaseProgress) -> Distinct:
    """Group converged starts by value and point, and examine one point of each group, once.

    Where an optimum is not isolated, all points of its F count as one set; it may have several pieces. Points in
    different working modes of a robot's limbs count as different sets.
    """
    optima: list[Optimum] = []
    refused: dict[int, StartStatus] = {}
    converged = [start for start in done if start.status is StartStatus.CONVERGED]
    remaining = sorted(converged, key=lambda start: nlp.sign * start.F)
    while remaining:
        phase(Phase.EVIDENCE, len(converged) - len(remaining), len(converged))
        best = remaining[0].F
        # In the order of the starts: rounding chooses none of those with the same F.
        level = [start for start in converged if start in remaining and abs(start.F - best) <= same_value(nlp)]
        lead = level[0]
        evidence = examine(nlp, lead.x)
        # The lead is the first start of the level, and so of the first group: its evidence serves that group.
        isolated = evidence.kind is not PointKind.NOT_ISOLATED
        groups = _group_by_point(nlp, level) if isolated else _group_by_mode(nlp, level)
        examined = [evidence, *(examine(nlp, group[0].x) for group in groups[1:])]
        for each, group in zip(examined, groups, strict=True):
            if not each.kind.is_optimum:
                is_singular = each.kind is PointKind.LIMB_SINGULAR
                refused |= dict.fromkeys(
                    map(id, group), StartStatus.LIMB_SINGULAR if is_singular else StartStatus.SADDLE
                )
                continue
            x = np.array([start.x for start in group])
            spread = float(np.max(np.ptp(x, axis=0) / (2 * nlp.scale)))
            optima.append(Optimum(group[0].F, len(group), group[0].x, spread, each, nlp))
        remaining = [start for start in remaining if start not in level]
    starts = [replace(start, status=refused.get(id(start), start.status)) for start in done]
    return Distinct(starts, optima)


def _group_by_point(nlp: Nlp, starts: Sequence[Start]) -> list[list[Start]]:
    """Group starts whose points count as the same, in the order of the first of each group."""
    groups: list[list[Start]] = []
    for start in starts:
        same = next((group for group in groups if _largest_distance(nlp, group[0].x, start.x) <= SAME_POINT), None)
        if same is None:
            groups.append([start])
        else:
            same.append(start)
    return groups


def _group_by_mode(nlp: Nlp, starts: Sequence[Start]) -> list[list[Start]]:
    """Group starts whose points are in the same working modes, in the order of the first of each group."""
    groups: dict[tuple[tuple[str, ...], ...], list[Start]] = {}
    for start in starts:
        groups.setdefault(turned_over_poses(nlp, start.x), []).append(start)
    return list(groups.values())


def _largest_distance(nlp: Nlp, one: FloatArray, other: FloatArray) -> float:
    """Return the largest distance along one variable, in half ranges."""
    return float(np.max(np.abs(one - other) / nlp.scale))

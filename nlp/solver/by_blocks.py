"""Block-by-block search of a program, for example pose by pose: combined starting points, and the best blocks.

The fast search in C starts each block from its part of every starting point. The best results of all blocks together
are the first start of the whole program, the second best are the second start, and so on. These starts are corrected
and judged by the conditions of the whole program, like the results of any other search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ..case.settings import Search
from ..interruption import is_requested
from ..program.blocks import Block, Blocks
from ..program.epigraph import with_exact_level
from ..program.nlp import Nlp
from ..screening.screening import Screened, can_screen, screen
from .interface import Solver, SolverResult, StopReason
from .ipopt import constraint_sizes, ipopt
from .screened import SCREEN
from .starts import Start, StartStatus, judge


class SearchedStarts(NamedTuple):
    """Starting points of a nonlinear program that is searched block by block, and their results.

    Attributes:
        points: (k, n) starting points of the whole program.
        starts: results of converged searches, by index of the starting point; they need no further search.
    """

    points: FloatArray
    starts: dict[int, Start]


def searched_starts(
    nlp: Nlp, blocks: Blocks, points: FloatArray, search: Search, solver: Solver, jobs: int | None
) -> SearchedStarts:
    """Return the starts of a program whose blocks are searched separately; without blocks, the given points.

    Args:
        nlp: the nonlinear program.
        blocks: blocks of the program.
        points: (k, n) starting points.
        search: settings of the search.
        solver: local solver of the whole program; blocks are searched only if this solver is Ipopt.
        jobs: number of threads; if left out, as many as processors and starts allow.
    """
    if not blocks.blocks:
        return SearchedStarts(points, {})
    found = _BlockResults(nlp, points)
    for block in blocks.blocks if solver is ipopt and search.screen else ():
        program, columns = blocks.program(block), blocks.columns(block)
        if is_requested() or not can_screen(program):
            return SearchedStarts(points, {})
        own = points[:, columns]
        found.take(block, screen(program, own, constraint_sizes(program, own), search.max_iterations, jobs))
    found.sort(blocks)
    starts = {} if nlp.program.places.epigraph is not None else found.judged()
    return SearchedStarts(found.x, starts)


class _BlockResults:
    """Results of the searches of all blocks, combined in the order of the starting points.

    Args:
        nlp: the nonlinear program.
        points: (k, n) starting points.
    """

    def __init__(self, nlp: Nlp, points: FloatArray) -> None:
        self._nlp, self.x = nlp, points.copy()
        self._bounds = np.zeros_like(points)
        self._constraints = np.zeros((len(points), len(nlp.program.constraints)))
        self._iterations = np.zeros(len(points), dtype=np.intp)
        self._converged = np.zeros((0, len(points)), dtype=bool)
        self._is_whole = False

    def take(self, block: Block, found: Screened) -> None:
        """Store the results of the searches of a block; a search that did not converge keeps its starting point."""
        count, kept, of_block = len(block.variables), found.converged[:, None], list(block.variables)
        x = np.clip(found.x[:, :count], self._nlp.lower[of_block], self._nlp.upper[of_block])
        self.x[:, of_block] = np.where(kept, x, self.x[:, of_block])
        self._bounds[:, of_block] = found.multipliers[:, :count]
        self._constraints[:, list(block.constraints)] = found.multipliers[:, found.x.shape[1] :]
        self._iterations += found.iterations
        self._converged = np.vstack([self._converged, found.converged])

    def sort(self, blocks: Blocks) -> None:
        """Combine the best results of all blocks, then the second best, and so on; failed searches are left out.

        A block with fewer good results than starting points repeats its results, the best first.
        """
        is_known = len(self._converged) == len(blocks.blocks)
        orders = list(blocks.orders(self.x))
        for k, (block, order) in enumerate(zip(blocks.blocks, orders, strict=True)):
            good = order[self._converged[k][order]] if is_known else order
            taken = np.resize(good if len(good) else order, len(order))
            if is_known and not len(good):
                is_known = False
            variables, constraints = list(block.variables), list(block.constraints)
            self.x[:, variables] = self.x[taken][:, variables]
            self._bounds[:, variables] = self._bounds[taken][:, variables]
            self._constraints[:, constraints] = self._constraints[taken][:, constraints]
        self._is_whole = is_known
        self.x = np.array([with_exact_level(self._nlp, x) for x in self.x])

    def judged(self) -> dict[int, Start]:
        """Return the results of converged starts by index; empty if a block has no converged result."""
        starts: dict[int, Start] = {}
        for k in range(len(self.x)) if self._is_whole else ():
            if is_requested():
                break
            end = SolverResult(
                x=self.x[k],
                bound_multipliers=self._bounds[k],
                constraint_multipliers=self._constraints[k],
                reason=StopReason.SUCCEEDED,
                iterations=int(self._iterations[k]),
            )
            start = judge(self._nlp, end)
            if start.status is StartStatus.CONVERGED:
                starts[k] = replace(start, solver=SCREEN)
        return starts


def from_best_blocks(
    nlp: Nlp, blocks: Blocks, ends: Sequence[FloatArray], best: float | None, better: float
) -> FloatArray | None:
    """Combine the best blocks of all results into a point (n,); None if this is no better than the best optimum.

    Args:
        nlp: the nonlinear program.
        blocks: blocks of the program.
        ends: points (n,) at which searches ended.
        best: objective of the best optimum; None without an optimum.
        better: smallest difference of the scaled objective that is more than rounding.
    """
    if not blocks.blocks or not ends:
        return None
    points = np.array(ends)
    x = points[0].copy()
    for block, order in zip(blocks.blocks, blocks.orders(points), strict=True):
        x[list(block.variables)] = points[order[0], block.variables]
    x = with_exact_level(nlp, x)
    is_better = best is None or nlp.sign * (best - nlp.evaluate(x)[0]) > better * nlp.objective_scale
    return x if is_better else None

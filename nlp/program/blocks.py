"""Blocks of a program: independent parts with their own variables, objective terms and constraints.

If only the poses are free, each pose has its own optimum. A search of the whole program from a sampled point finds few
of these optima at once: hardly any point is good for all of 160 poses, and most violate a limit of some pose. Starting
points and end points of searches are therefore combined block by block.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, frozen_vector
from ..case.pose import OverPoses
from .epigraph import slack_levels
from .nlp import Nlp
from .places import Places
from .program import Program

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest violation, in half ranges, that counts as none.
_FEASIBLE = 1e-9


class Block(NamedTuple):
    """Independent part of a program.

    Attributes:
        variables: indices of the variables of the block.
        terms: indices of the terms of the objective.
        constraints: indices of the constraints.
    """

    variables: tuple[int, ...]
    terms: tuple[int, ...]
    constraints: tuple[int, ...]


class Blocks:
    """Blocks of a program; none if the program has no independent parts.

    The level of a worst case belongs to no block.

    Args:
        nlp: the program.
    """

    def __init__(self, nlp: Nlp) -> None:
        self._nlp = nlp
        is_possible = len(nlp.program.robots) > 1 and not nlp.families
        terms = self._terms = _terms(nlp) if is_possible else []
        self.blocks: tuple[Block, ...] = ()
        if terms:
            self._function = ca.Function("terms", [nlp.program.x, nlp.program.p], [ca.densify(ca.vertcat(*terms))])
            self.blocks = self._blocks()

    def columns(self, block: Block) -> list[int]:
        """Return the indices of the variables of a block's program."""
        epigraph = self._nlp.program.places.epigraph
        return [*block.variables, *(() if epigraph is None else (epigraph.level,))]

    def program(self, block: Block) -> Nlp:
        """Return the program of a single block, with its variables, then the level of a worst case.

        The program has no places of the case's parameters, so it serves for searches, not for evidence.
        """
        nlp, program, places = self._nlp, self._nlp.program, self._nlp.program.places
        columns, rows = self.columns(block), list(block.constraints)
        own = Program(
            variables=tuple(program.variables[k] for k in columns),
            arguments=program.arguments,
            x=program.x[columns],
            p=program.p,
            objective=program.objective
            if places.epigraph
            else ca.sum1(ca.vertcat(SX(0), *[self._terms[k] for k in block.terms])),
            constraints=tuple(program.constraints[k] for k in rows),
            robots=program.robots[:1],
            model=program.model,
            places=Places(numbers=(), rotations=(), unknowns=(), twists=places.twists),
        )
        return Nlp(
            program=own,
            case=nlp.case,
            sense=nlp.sense,
            arguments=nlp.arguments,
            lower=frozen_vector(nlp.lower[columns]),
            upper=frozen_vector(nlp.upper[columns]),
            start=frozen_vector(nlp.start[columns]),
            g_lower=frozen_vector(nlp.g_lower[rows]),
            g_upper=frozen_vector(nlp.g_upper[rows]),
            size=nlp.objective_scale,
        )

    def orders(self, points: FloatArray) -> Iterator[NDArray[np.intp]]:
        """Yield the order (k,) of points (k, n) for each block, from the best feasible to the most violated point."""
        nlp = self._nlp
        epigraph = nlp.program.places.epigraph
        values = slack_levels(nlp, points.T) if epigraph else self._function(points.T, nlp.arguments).full()
        g = nlp.program.values(points.T, nlp.arguments)[1].full()
        sizes = np.where(nlp.row_sizes > 0, nlp.row_sizes, 1.0)[:, None]
        outside = np.maximum(nlp.g_lower[:, None] - g, g - nlp.g_upper[:, None]) / sizes
        own = {nlp.program.constraints.index(each) for each in epigraph.constraints} if epigraph else set[int]()
        for block in self.blocks:
            terms = nlp.sign * values[list(block.terms)]
            # In a worst case the largest of the terms counts, for both senses. A block without terms, such as a
            # dimension that changes nothing but limits, has no cost.
            cost = terms.max(axis=0) if epigraph and len(terms) else terms.sum(axis=0)
            limits = [k for k in block.constraints if k not in own]
            violation = outside[limits].max(axis=0, initial=0.0)
            violation = np.where(np.isfinite(violation) & np.isfinite(cost), violation, np.inf)
            yield np.lexsort((cost, np.where(violation <= _FEASIBLE, 0.0, violation)))

    def _blocks(self) -> tuple[Block, ...]:
        """Return the blocks from the sparsity of objective and constraints."""
        nlp = self._nlp
        epigraph = nlp.program.places.epigraph
        of_terms = _dependence(self._function, 0)
        of_constraints = _dependence(nlp.program.values, 1)
        if epigraph is not None:
            own = [nlp.program.constraints.index(each) for each in epigraph.constraints]
            of_constraints[:, epigraph.level] = False
            of_terms = of_constraints[own]
        labels = _labels(np.vstack([of_terms, of_constraints]))
        if epigraph is not None:
            labels[epigraph.level] = -1
        numbers = sorted(set(labels[labels >= 0].tolist()))
        if len(numbers) < 2:
            return ()
        return tuple(
            Block(
                tuple(np.flatnonzero(labels == number).tolist()),
                tuple(k for k, row in enumerate(of_terms) if (row & (labels == number)).any()),
                tuple(k for k, row in enumerate(of_constraints) if (row & (labels == number)).any()),
            )
            for number in numbers
        )


def _terms(nlp: Nlp) -> list[SX]:
    """Return the terms of an objective that is a sum over poses, the weighted F of each pose; empty without a sum.

    With a level, the terms are those of its constraints.
    """
    program = nlp.program
    epigraph = program.places.epigraph
    if epigraph is not None:
        # The relaxation of a program with a level has another objective.
        of_level = np.flatnonzero(_dependence(program.values, 0)[0]).tolist() == [epigraph.level]
        return [each.expression for each in epigraph.constraints] if of_level else []
    if program.objective_call is None:
        return []
    weights = ca.vertcat(*([program.p[k] for k in program.places.weights] or [SX(1)]))
    if tasks := program.places.tasks:
        count = len(program.robots) // (max(tasks) + 1)
        part = 1 / count if nlp.case.over_poses is OverPoses.MEAN else 1.0
        return [part * weights[task] * robot.F[0] for task, robot in zip(tasks, program.robots, strict=True)]
    part = 1 / len(program.robots) if nlp.case.over_poses is OverPoses.MEAN else 1.0
    return [part * ca.dot(weights, robot.F) for robot in program.robots]


def _dependence(function: ca.Function, output: int) -> NDArray[np.bool_]:
    """Return the dependence (k, n), booleans, of the entries of an output (k, 1) on the variables."""
    return np.asarray(ca.DM(function.jac_sparsity(output, 0)).full() != 0)


def _labels(rows: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return a label (n,) for each variable, equal for variables connected by common rows."""
    labels = np.arange(rows.shape[1])
    while True:
        before = labels.copy()
        for row in rows:
            labels[row] = labels[row].min(initial=rows.shape[1])
        if np.array_equal(labels, before):
            return labels

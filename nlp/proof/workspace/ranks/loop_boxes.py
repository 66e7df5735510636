"""Boxes of a search: ends of the independent coordinates, and where the dependent ones are known, theirs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import casadi as ca
import numpy as np

from .....models import FloatArray
from ...boxes.engine import MOST_VARIABLES
from ...boxes.rows import some
from ...enclosure.forms import Encloser, Forms
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import ToleranceModel
from .entry_change import EntryChange, is_polynomial
from .krawczyk import (
    Coordinates,
    Relation,
    are_contractions,
    by_centres,
    inverses,
    no_relation,
    relation_of,
    with_relation,
)
from .rank_rule import RankTest, Tested

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Factors by which widths of dependent coordinates are made wider: the first guess, from slopes at the middle of a box,
#: and later ones, from the relation that was found with the guess before.
_WIDER, _AGAIN = 1.1, 1.05
#: Attempts to find widths of dependent coordinates in which they surely stay.
_ATTEMPTS = 8
#: Smallest half width of a dependent coordinate, in parts of its size: more than rounding.
_LEAST = 1e-10
#: Largest one: beyond it, the box of the pose is divided first.
_MOST = 1.0
#: Part of itself by which an end of a dependent coordinate moves outwards: several roundings.
_ROUNDING = 1e-14
#: Part of their widths by which computed dependent coordinates may be beyond their ends: rounding of Newton's method.
_CLOSE = 1e-9
#: Contractions of the closed point at the common face of two boxes: each one squares its width.
_CONTRACTIONS = 3


class LoopBoxes(NamedTuple):
    """B boxes.

    Attributes:
        lower, upper: (B, n) ends of all coordinates; those of dependent ones are NaN until they are known.
        near: (B, n) a closed point in or near the box.
        is_known: (B,) whether each pose of the box surely has one, and only one, closed point between the ends.
    """

    lower: FloatArray
    upper: FloatArray
    near: FloatArray
    is_known: NDArray[np.bool_]

    @property
    def centre(self) -> FloatArray:
        """Centres (B, n)."""
        return np.clip(0.5 * self.lower + 0.5 * self.upper, self.lower, self.upper)


def are_between(z: FloatArray, boxes: LoopBoxes, dependent: Sequence[int]) -> NDArray[np.bool_]:
    """Return whether closed points (B, n) are those of boxes: others may be of another assembly of the joints."""
    lower, upper, own = boxes.lower[:, dependent], boxes.upper[:, dependent], z[:, dependent]
    room = _CLOSE * (upper - lower)
    return np.asarray(((own >= lower - room) & (own <= upper + room)).all(axis=1))


class Examined(NamedTuple):
    """Results for B boxes.

    Attributes:
        boxes: the boxes, with dependent coordinates where they are known.
        relation: of these; its rest is infinite where they are not known.
        is_regular: (B,) whether the matrix has full rank at every pose of the box.
        shares: (B, f) share of each independent coordinate in the bounds.
        smallest: (B,) smallest singular value at the middle, in parts of the largest; infinite where it is not known.
            Of K numbers: (B, K) their bounds.
        signs: (B,) those of :class:`~.rank_rule.Tested`.
    """

    boxes: LoopBoxes
    relation: Relation
    is_regular: NDArray[np.bool_]
    shares: FloatArray
    smallest: FloatArray
    signs: NDArray[np.int32]


class Test(Protocol):
    """A test of expressions over boxes.

    Attributes:
        entries: (R, 1) the expressions.
    """

    entries: ca.SX

    def unknown(self, count: int, f: int) -> Tested:
        """Return the results for boxes of which nothing is known."""

    def examine(self, forms: Forms, f: int) -> Tested:
        """Return the results for boxes from forms of the entries in f independent coordinates, then errors."""


class Examiner:
    """Examination of boxes of a robot by one test, as for the rank of a matrix.

    Args:
        problem: the robot.
        test: its entries are in the coordinates of the problem, or of all machines.
        family: all machines that are meant; None for the design alone.

    Attributes:
        of: the coordinates.
        loops: the loop equations as functions.
        second: forms of second order of the entries; None where forms of first order are used.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, problem: Problem, test: Test, family: ToleranceModel | None = None) -> None:
        self.problem, self._test, self._family = problem, test, family
        n, coordinates = int(problem.z.numel()), problem.z if family is None else family.coordinates
        errors = list(range(n, int(coordinates.numel())))
        self.of = Coordinates(list(problem.independent), list(problem.dependent), errors)
        self._tolerance = 0.0 if family is None else family.tolerance
        self._rank: RankTest | None = None
        self.second: Encloser | None = None
        self._change: EntryChange | None = None
        if not problem.dependent and n <= MOST_VARIABLES:
            self._use_second_order(test)
        if self.second is None:
            _ = self._encloser  # refuses an operation without a rule at once
        self._machines = None if family is None else family.loops
        self.loops = problem.loops

    @cached_property
    def _encloser(self) -> Encloser:
        """Forms of first order of the equations, their derivatives by dependent coordinates, and the entries."""
        z = self.problem.z
        equations, coordinates = (
            (self.problem.equations, z) if self._family is None else (self._family.equations, self._family.coordinates)
        )
        slopes = [ca.jacobian(equations, z)[:, k] for k in self.of.dependent]
        own = ca.densify(ca.vertcat(ca.SX(0, 1), *slopes))
        # A last entry that is not used, for a matrix that is constant.
        return Encloser(coordinates, ca.vertcat(equations, own, self._test.entries, z[0]))

    def _use_second_order(self, test: Test) -> None:
        """Examine by forms of second order; with errors, of the polynomials of a matrix alone."""
        family, entries = self._family, test.entries
        if isinstance(test, RankTest):
            if family is not None and not is_polynomial(entries, family.coordinates):
                return
            self._rank, self._change = test, None if family is None else EntryChange(family, entries)
        elif family is not None:
            return
        self.second = Encloser(self.problem.z, entries if self._change is None else self._change.exact)

    def examine(self, boxes: LoopBoxes) -> Examined:
        """Examine boxes."""
        B, f, k = len(boxes.lower), len(self.of.independent), len(self.of.dependent)
        relation = no_relation(B, self.of)
        if self.second is not None and B:
            ends = boxes.lower.T, boxes.upper.T
            if self._rank is None:
                return Examined(boxes, relation, *self._test.examine(self.second.second(*ends).as_terms(), f))
            change = None if self._change is None else self._change.over(*ends)
            return Examined(boxes, relation, *self._rank.examine_second(self.second, *ends, change))
        lower, upper, near, known = some(boxes, np.arange(B))
        tested = self._test.unknown(B, f)
        columns: tuple[NDArray[Any], ...] = (*relation, *tested)
        new = np.flatnonzero(~known)
        if new.size:
            tested.shares[new] = self._guess(new, lower, upper, near)
        for attempt in range(1 + (_ATTEMPTS if k else 0)):
            # The first round is of boxes that are known already.
            rows = np.flatnonzero(known if attempt == 0 else ~known & np.isfinite(lower).all(axis=1))
            if not rows.size:
                continue
            forms = self._forms(lower[rows], upper[rows])
            own = relation_of(forms.part(slice(0, k)), self.of)
            if attempt:
                good = self._is_single(forms, own, lower[rows], upper[rows])
                known[rows[good]] = True
                self._widen(rows[~good], own.reach[~good], lower, upper)
                rows, forms, own = rows[good], some(forms, good), some(own, good)
            if not rows.size:
                continue
            entries = with_relation(forms.part(slice(k + k * k, -1)), own, self.of)
            found = self._test.examine(entries, f)
            for whole, part in zip(columns, (*own, *found), strict=True):
                whole[rows] = part
        for j in self.of.dependent:
            lower[~known, j] = upper[~known, j] = np.nan
        finite = np.asarray(np.isfinite(near).all(axis=1))
        near = np.where(finite[:, None], near, boxes.near)
        return Examined(LoopBoxes(lower, upper, near, known), relation, *tested)

    def _forms(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return the forms of all entries over boxes (B, n), for all machines."""
        errors = np.full((len(lower), len(self.of.errors)), self._tolerance)
        return self._encloser(np.hstack([lower, -errors]).T, np.hstack([upper, errors]).T)

    def _guess(self, rows: NDArray[np.int64], lower: FloatArray, upper: FloatArray, near: FloatArray) -> FloatArray:
        """Set ends of dependent coordinates about closed loops at the middle of boxes; return shares (rows, f)."""
        (own, D, errors), size = self.of, self.problem.size
        z = near[rows].copy()
        middle, half = 0.5 * (lower[rows] + upper[rows])[:, own], 0.5 * (upper[rows] - lower[rows])[:, own]
        with np.errstate(all="ignore"):
            before = self.loops.slopes(z.T) * size
            step = (middle - z[:, own]) / size[own]
            z[:, own] = middle
            z[:, D] -= size[D] * (inverses(before[:, :, D]) @ before[:, :, own] @ step[:, :, None])[:, :, 0]
            z = self.loops.all_closed(z.T, D).T
            slopes = self.loops.slopes(z.T) * size
            Y = inverses(slopes[:, :, D])
            reach = np.abs(Y @ slopes[:, :, own]) * (half / size[own])[:, None, :]
            whole = reach.sum(axis=2)
            if self._machines is not None:
                # Errors move dependent coordinates too, here to first order.
                points = np.hstack([z, np.zeros((len(z), len(errors)))])
                whole += by_centres(Y @ self._machines.slopes(points.T)[:, :, errors] * self._tolerance)
        near[rows] = z
        self._set_widths(rows, z[:, D], _WIDER * whole, lower, upper)
        shares = np.nan_to_num(reach.sum(axis=1))
        return np.asarray(np.where(shares.any(axis=1, keepdims=True), shares, half / size[own]))

    def _set_widths(
        self, rows: NDArray[np.int64], middle: FloatArray, half: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> None:
        """Set ends of dependent coordinates from their middles and half widths in parts of their sizes, (rows, k)."""
        D, half = self.of.dependent, np.maximum(half, _LEAST)
        width = np.where(half <= _MOST, half, np.nan) * self.problem.size[D]
        lower[rows[:, None], D], upper[rows[:, None], D] = middle - width, middle + width

    def _widen(self, rows: NDArray[np.int64], reach: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        """Set the widths of dependent coordinates to those that were found to be needed."""
        D = self.of.dependent
        low, high = lower[rows][:, D], upper[rows][:, D]
        half = 0.5 * (high - low) / self.problem.size[D]
        self._set_widths(rows, 0.5 * (low + high), half * np.maximum(_AGAIN * reach, 0.5), lower, upper)

    def _is_single(self, forms: Forms, relation: Relation, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return whether each pose of a box surely has one closed point between the ends, and only one."""
        k = len(self.of.dependent)
        stays = (relation.reach < 1).all(axis=1)
        c, a, r = forms.part(slice(k, k + k * k))
        half = 0.5 * (upper - lower)[:, self.of.dependent]
        # Columns of the derivatives by dependent coordinates, one after the other.
        G = c.reshape(-1, k, k).transpose(0, 2, 1) * half[:, None, :]
        spread = (np.abs(a).sum(axis=2) + r).reshape(-1, k, k).transpose(0, 2, 1) * half[:, None, :]
        Y = inverses(G)
        with np.errstate(all="ignore"):
            B = np.abs(Y @ G - np.eye(k)) + np.abs(Y) @ (spread * (1 + 1e-12) + 1e-12 * np.abs(G))
        is_regular, _ = are_contractions(np.where(np.isfinite(B), B, np.inf))
        return np.asarray(stays & is_regular)

    def tied(self, one: LoopBoxes, other: LoopBoxes) -> NDArray[np.bool_]:
        """Return whether neighbours have the same closed point somewhere on their common face.

        Args:
            one: (B,) boxes with known dependent coordinates.
            other: as many, whose independent coordinates overlap those of the first in pairs.
        """
        own, D, _ = self.of
        lower, upper = one.lower.copy(), one.upper.copy()
        place = 0.5 * np.maximum(one.lower, other.lower) + 0.5 * np.minimum(one.upper, other.upper)
        lower[:, own] = upper[:, own] = place[:, own]
        for _ in range(_CONTRACTIONS):
            relation = relation_of(self._forms(lower, upper).part(slice(0, len(D))), self.of)
            lower[:, D], upper[:, D] = _parts(lower[:, D], upper[:, D], relation.off, relation.rho + relation.of_errors)
        return np.asarray(((lower >= other.lower) & (upper <= other.upper))[:, D].all(axis=1))

    def narrowed(self, boxes: LoopBoxes, relation: Relation, sides: FloatArray) -> LoopBoxes:
        """Return parts of boxes with the ends of their dependent coordinates.

        Args:
            boxes: parts (B,) of boxes, with the dependent coordinates of the whole.
            relation: of the whole.
            sides: (B, f) -1 or 1 for an independent coordinate in its lower or upper half, 0 for a whole one.
        """
        D, known = self.of.dependent, boxes.is_known[:, None]
        if not D or not known.any():
            return boxes
        (off, T, rho, _), size = relation, np.abs(relation.T)
        rho = rho + relation.of_errors
        total = size.sum(axis=2)
        # A half lies in [-1, 0] or [0, 1] of the whole box, and a little beyond for rounding.
        reach = total - 0.5 * (size @ np.abs(sides)[:, :, None])[:, :, 0] + rho
        reach = reach + 1e-12 * (np.abs(off) + total + rho)
        centre = off - (T @ (0.5 * sides)[:, :, None])[:, :, 0]
        low, high = _parts(boxes.lower[:, D], boxes.upper[:, D], centre, reach)
        lower, upper = boxes.lower.copy(), boxes.upper.copy()
        lower[:, D], upper[:, D] = np.where(known, low, np.nan), np.where(known, high, np.nan)
        return boxes._replace(lower=lower, upper=upper)


def _parts(
    lower: FloatArray, upper: FloatArray, centre: FloatArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the parts of ranges that are near centres, in parts of their half widths, with ends moved outwards."""
    middle, half = 0.5 * lower + 0.5 * upper, 0.5 * (upper - lower) * (1 + _ROUNDING)
    slack = _ROUNDING * np.abs(middle)
    with np.errstate(all="ignore"):
        low = middle + half * np.maximum(centre - reach, -1.0) - slack
        high = middle + half * np.minimum(centre + reach, 1.0) + slack
    return np.minimum(low, high), np.maximum(low, high)

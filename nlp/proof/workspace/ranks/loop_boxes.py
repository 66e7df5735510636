"""Boxes of a search: ends of the independent coordinates, and where the dependent ones are known, theirs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Protocol

import casadi as ca
import numpy as np

from .....models import FloatArray
from ...boxes.engine import MOST_VARIABLES
from ...enclosure.forms import Encloser, Forms
from ..robot.closed_loops import Loops
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from .entry_change import EntryChange, is_polynomial
from .krawczyk import Relation, are_contractions, by_centres, inverses, relation_of
from .rank_rule import RankTest, Tested

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Factors by which widths of dependent coordinates are made wider: the first guess, from slopes at the middle of a box,
#: and later ones, from the relation that was found with the guess before.
_WIDER, _AGAIN = 1.1, 1.05
#: Attempts to find widths of dependent coordinates in which they surely stay.
_ATTEMPTS = 3
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


class Cells(NamedTuple):
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


def are_between(z: FloatArray, cells: Cells, dependent: Sequence[int]) -> NDArray[np.bool_]:
    """Return whether closed points (B, n) are those of boxes: others may be of another assembly of the joints."""
    lower, upper, own = cells.lower[:, dependent], cells.upper[:, dependent], z[:, dependent]
    room = _CLOSE * (upper - lower)
    return np.asarray(((own >= lower - room) & (own <= upper + room)).all(axis=1))


class Examined(NamedTuple):
    """Results for B boxes.

    Attributes:
        cells: the boxes, with dependent coordinates where they are known.
        relation: of these; its rest is infinite where they are not known.
        is_regular: (B,) whether the matrix has full rank at every pose of the box.
        shares: (B, f) share of each independent coordinate in the bounds.
        smallest: (B,) smallest singular value at the middle, in parts of the largest; infinite where it is not known.
        signs: (B,) those of :class:`~.rank_rule.Tested`.
    """

    cells: Cells
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

    def examine(
        self, forms: Forms, relation: Relation, independent: list[int], dependent: list[int], errors: list[int]
    ) -> Tested:
        """Return the results for boxes from forms of the entries; see :meth:`~.rank.RankTest.examine`."""


class Examiner:
    """Examination of boxes of a robot by one test, as for the rank of a matrix.

    Args:
        problem: the robot.
        test: its entries are in the coordinates of the problem, or of all machines.
        family: all machines that are meant; None for the design alone.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, problem: Problem, test: Test, family: Family | None = None) -> None:
        self.problem, self._test = problem, test
        self._rank: RankTest | None = None
        self._independent, self._dependent = list(problem.independent), list(problem.dependent)
        self.count = len(self._dependent)
        equations = problem.equations if family is None else family.equations
        coordinates = problem.z if family is None else family.coordinates
        n, whole = int(problem.z.numel()), int(coordinates.numel())
        self._errors, self._tolerance = list(range(n, whole)), 0.0 if family is None else family.tolerance
        self._forms_of = equations, coordinates
        self.second: Encloser | None = None
        self._change: EntryChange | None = None
        if isinstance(test, RankTest) and not self.count and n <= MOST_VARIABLES:
            self._use_second_order(test, family)
        if self.second is None:
            _ = self._encloser  # refuses an operation without a rule at once
        self._machines = None if family is None else family.loops
        self.loops = Loops(problem.z, problem.equations, problem.equations, ca.SX(0, 1), problem.size)

    @cached_property
    def _encloser(self) -> Encloser:
        """Forms of first order of the equations, their derivatives by dependent coordinates, and the entries."""
        (equations, coordinates), z = self._forms_of, self.problem.z
        slopes = [ca.jacobian(equations, z)[:, k] for k in self._dependent]
        own = ca.densify(ca.vertcat(ca.SX(0, 1), *slopes))
        # A last entry that is not used, for a matrix that is constant.
        return Encloser(coordinates, ca.vertcat(equations, own, self._test.entries, z[0]))

    def _use_second_order(self, test: RankTest, family: Family | None) -> None:
        """Examine by forms of second order; with errors, of polynomials alone."""
        if family is not None and not is_polynomial(test.entries, family):
            return
        self._rank, self._change = test, None if family is None else EntryChange(family, test.entries)
        self.second = Encloser(self.problem.z, test.entries if self._change is None else self._change.exact)

    def examine(self, cells: Cells) -> Examined:
        """Examine boxes."""
        if self.second is not None and self._rank is not None and len(cells.lower):
            ends = cells.lower.T, cells.upper.T
            change = None if self._change is None else self._change.over(*ends)
            found = self._rank.examine_second(self.second, *ends, change)
            B, f = found.shares.shape
            none = Relation(np.zeros((B, 0)), np.zeros((B, 0, f)), np.zeros((B, 0)), np.zeros((B, 0, 0)))
            return Examined(cells, none, *found)
        f, k = len(self._independent), self.count
        B = len(cells.lower)
        lower, upper = cells.lower.copy(), cells.upper.copy()
        known, near = cells.is_known.copy(), cells.near.copy()
        of_errors = np.zeros((B, k, len(self._errors)))
        relation = Relation(np.zeros((B, k)), np.zeros((B, k, f)), np.full((B, k), np.inf), of_errors)
        shares, smallest, regular = np.zeros((B, f)), np.full(B, np.inf), np.zeros(B, dtype=bool)
        signs = np.zeros(B, dtype=np.int32)
        if k and not known.all():
            new = np.flatnonzero(~known)
            slopes = self._guess(new, lower, upper, near)
            shares[new] = slopes
        for attempt in range(1 + (_ATTEMPTS if k else 0)):
            # The first round is of boxes that are known already.
            rows = np.flatnonzero(known if attempt == 0 else ~known & np.isfinite(lower).all(axis=1))
            if not rows.size:
                continue
            forms = self._forms(lower[rows], upper[rows])
            own = relation_of(forms.part(slice(0, k)), self._independent, self._dependent, self._errors)
            if attempt:
                good = self._is_single(forms, own, lower[rows], upper[rows])
                known[rows[good]] = True
                again = rows[~good]
                self._widen(again, own.reach[~good], lower, upper)
                keep = np.flatnonzero(good)
                rows = rows[good]
                forms = Forms(*(each[keep] for each in forms))
                own = Relation(*(each[keep] for each in own))
            if not rows.size:
                continue
            for whole, part in zip(relation, own, strict=True):
                whole[rows] = part
            entries = forms.part(slice(k + k * k, -1))
            found = self._test.examine(entries, own, self._independent, self._dependent, self._errors)
            regular[rows], shares[rows], smallest[rows], signs[rows] = found
        for j in self._dependent:
            lower[~known, j] = upper[~known, j] = np.nan
        finite = np.asarray(np.isfinite(near).all(axis=1))
        near = np.where(finite[:, None], near, cells.near)
        return Examined(Cells(lower, upper, near, known), relation, regular, shares, smallest, signs)

    def _forms(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return the forms of all entries over boxes (B, n), for all machines."""
        errors = np.full((len(lower), len(self._errors)), self._tolerance)
        return self._encloser(np.hstack([lower, -errors]).T, np.hstack([upper, errors]).T)

    def _guess(self, rows: NDArray[np.int64], lower: FloatArray, upper: FloatArray, near: FloatArray) -> FloatArray:
        """Set ends of dependent coordinates about closed loops at the middle of boxes; return shares (rows, f)."""
        own, D, size = self._independent, self._dependent, self.problem.size
        z = near[rows].copy()
        half = 0.5 * (upper[rows] - lower[rows])[:, own]
        with np.errstate(all="ignore"):
            before = self.loops.slopes(z.T) * size
            step = (0.5 * (lower[rows] + upper[rows])[:, own] - z[:, own]) / size[own]
            z[:, own] = 0.5 * (lower[rows] + upper[rows])[:, own]
            z[:, D] -= size[D] * (inverses(before[:, :, D]) @ before[:, :, own] @ step[:, :, None])[:, :, 0]
            z = self.loops.all_closed(z.T, D).T
            slopes = self.loops.slopes(z.T) * size
            T = inverses(slopes[:, :, D]) @ slopes[:, :, own]
            reach = np.abs(T) * (half / size[own])[:, None, :]
            whole = reach.sum(axis=2) + self._reach_of_errors(z, inverses(slopes[:, :, D]))
        width = np.maximum(_WIDER * whole, _LEAST)
        width = np.where(width <= _MOST, width, np.nan) * size[D]
        near[rows] = z
        lower[rows[:, None], D], upper[rows[:, None], D] = z[:, D] - width, z[:, D] + width
        shares = np.nan_to_num(reach.sum(axis=1))
        return np.asarray(np.where(shares.any(axis=1, keepdims=True), shares, half / size[own]))

    def _reach_of_errors(self, z: FloatArray, Y: FloatArray) -> FloatArray:
        """Return how far errors move dependent coordinates (B, k), in parts of their sizes, to first order.

        Args:
            z: (B, n) closed points of the design.
            Y: (B, k, k) inverses of the derivatives by these coordinates.
        """
        if self._machines is None:
            return np.zeros(Y.shape[:2])
        points = np.hstack([z, np.zeros((len(z), len(self._errors)))])
        return by_centres(Y @ self._machines.slopes(points.T)[:, :, self._errors] * self._tolerance)

    def _is_single(self, forms: Forms, relation: Relation, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return whether each pose of a box surely has one closed point between the ends, and only one."""
        k = self.count
        stays = (relation.reach < 1).all(axis=1)
        c, a, r = forms.part(slice(k, k + k * k))
        half = 0.5 * (upper - lower)[:, self._dependent]
        # Columns of the derivatives by dependent coordinates, one after the other.
        G = c.reshape(-1, k, k).transpose(0, 2, 1) * half[:, None, :]
        spread = (np.abs(a).sum(axis=2) + r).reshape(-1, k, k).transpose(0, 2, 1) * half[:, None, :]
        Y = inverses(G)
        with np.errstate(all="ignore"):
            B = np.abs(Y @ G - np.eye(k)) + np.abs(Y) @ (spread * (1 + 1e-12) + 1e-12 * np.abs(G))
        is_regular, _ = are_contractions(np.where(np.isfinite(B), B, np.inf))
        return np.asarray(stays & is_regular)

    def _widen(self, rows: NDArray[np.int64], reach: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        """Set the widths of dependent coordinates to those that were found to be needed."""
        D, size = self._dependent, self.problem.size
        middle = 0.5 * (lower[rows] + upper[rows])[:, D]
        half = 0.5 * (upper[rows] - lower[rows])[:, D]
        width = np.maximum(half * np.maximum(_AGAIN * reach, 0.5), _LEAST * size[D])
        width = np.where(width <= _MOST * size[D], width, np.nan)
        lower[rows[:, None], D], upper[rows[:, None], D] = middle - width, middle + width

    def tied(self, one: Cells, other: Cells) -> NDArray[np.bool_]:
        """Return whether neighbours have the same closed point somewhere on their common face.

        Args:
            one: (B,) boxes with known dependent coordinates.
            other: as many, whose independent coordinates overlap those of the first in pairs.
        """
        own, D = self._independent, self._dependent
        lower, upper = one.lower.copy(), one.upper.copy()
        place = 0.5 * np.maximum(one.lower, other.lower) + 0.5 * np.minimum(one.upper, other.upper)
        lower[:, own] = upper[:, own] = place[:, own]
        for _ in range(_CONTRACTIONS):
            relation = relation_of(self._forms(lower, upper).part(slice(0, self.count)), own, D, self._errors)
            rho = relation.rho + relation.of_errors
            middle, half = 0.5 * (lower + upper)[:, D], 0.5 * (upper - lower)[:, D] * (1 + _ROUNDING)
            slack = _ROUNDING * np.abs(middle)
            with np.errstate(all="ignore"):
                low = middle + half * np.maximum(relation.off - rho, -1.0) - slack
                high = middle + half * np.minimum(relation.off + rho, 1.0) + slack
            lower[:, D], upper[:, D] = np.minimum(low, high), np.maximum(low, high)
        return np.asarray(((lower >= other.lower) & (upper <= other.upper))[:, D].all(axis=1))

    def narrowed(self, cells: Cells, relation: Relation, sides: FloatArray) -> Cells:
        """Return parts of boxes with the ends of their dependent coordinates.

        Args:
            cells: parts (B,) of boxes, with the dependent coordinates of the whole.
            relation: of the whole.
            sides: (B, f) -1 or 1 for an independent coordinate in its lower or upper half, 0 for a whole one.
        """
        D, known = self._dependent, cells.is_known
        if not D or not known.any():
            return cells
        (off, T, rho, _), size = relation, np.abs(relation.T)
        rho = rho + relation.of_errors
        total = size.sum(axis=2)
        # A half lies in [-1, 0] or [0, 1] of the whole box, and a little beyond for rounding.
        reach = total - 0.5 * (size @ np.abs(sides)[:, :, None])[:, :, 0] + rho
        reach = reach + 1e-12 * (np.abs(off) + total + rho)
        centre = off - (T @ (0.5 * sides)[:, :, None])[:, :, 0]
        middle = 0.5 * cells.lower[:, D] + 0.5 * cells.upper[:, D]
        half = 0.5 * (cells.upper[:, D] - cells.lower[:, D]) * (1 + _ROUNDING)
        slack = _ROUNDING * np.abs(middle)
        with np.errstate(all="ignore"):
            low = middle + half * np.maximum(centre - reach, -1.0) - slack
            high = middle + half * np.minimum(centre + reach, 1.0) + slack
        lower, upper = cells.lower.copy(), cells.upper.copy()
        lower[:, D] = np.where(known[:, None], np.minimum(low, high), np.nan)
        upper[:, D] = np.where(known[:, None], np.maximum(low, high), np.nan)
        return cells._replace(lower=lower, upper=upper)

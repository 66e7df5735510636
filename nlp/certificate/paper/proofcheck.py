"""Check of a proof, without trust in who made it.

The boxes of the tree start from the program's own bounds, so that the leaves cover them by construction. Every leaf
and every face is a *claim* about one box, and the check shows each claim again with the interval slopes of
:mod:`screwsynth.nlp.certificate.paper.slopes`; it bisects the box where they are too wide. It uses neither the
arithmetic of the search nor its multipliers. Search and check share the case's expressions, and CasADi's derivatives
of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....models import FloatArray
from ...program.nlp import Nlp
from ..kinks import refuse_jumps
from ..standardform import StandardForm, standard_form
from .limbs.limbpart import ClaimChecker, LimbPartChecker, is_one_square
from .limbs.sharedcheck import check_shared
from .proof import Node, Proof, ProofError, fingerprint, is_same_program
from .prooftree import Claim, read_parts
from .slopebounds import sum_model
from .slopecut import cut_off
from .slopes import Slope, SlopeArithmetic
from .slopeweights import lagrangian_weights

#: Number of boxes that are evaluated at once.
_BLOCK = 512
#: Largest number of pieces of a claim's box, and of bisections on the way to one of them.
_MOST_PIECES, _MOST_BISECTIONS = 5_000, 60
#: Error of a difference of two rounded numbers, in parts of their sizes.
_SUMS = 1e-13
#: Callback with the number of claims checked, and of those to be checked.
CheckProgress = Callable[[int, int], None]


@dataclass(frozen=True)
class VerifiedProof:
    """A proof that holds.

    Attributes:
        leaves: number of claims in the tree.
        pieces: number of boxes that were evaluated to show them.
        bound: upper bound of the maximised value over the feasible part of the root; -inf without a feasible point.
    """

    leaves: int
    pieces: int
    bound: float


def check_proof(proof: Proof, nlp: Nlp, progress: CheckProgress | None = None) -> VerifiedProof:
    """Check a proof, by showing each of its claims again.

    Args:
        proof: the proof.
        nlp: the program that it is about, built from the case.
        progress: called after each group of claims.

    Raises:
        ProofError: the proof is for another program, its bytes are no tree, or a claim could not be shown.
    """
    if not is_same_program(fingerprint(nlp), proof.graph):
        raise ProofError("the proof is for other expressions or bounds than this case's")
    form = standard_form(nlp)
    bound = -np.inf if proof.bound is None else proof.bound
    if proof.tree[:1] == bytes([Node.SHARED]):
        shared = check_shared(proof.tree, form, bound, progress)
        return VerifiedProof(shared.leaves, shared.pieces, bound)
    parts = read_parts(proof.tree, form, bound)
    leaves, pieces, done = sum(len(part.claims) for part in parts), 0, 0
    for part in parts:
        checker: ClaimChecker = _Checker(part.form, part.bound)
        if part.form is not form or is_one_square(form):
            checker = LimbPartChecker(part.form, part.bound, checker)
        groups: dict[tuple[Node, int], list[Claim]] = {}
        for claim in part.claims:
            groups.setdefault((claim.kind, claim.index), []).append(claim)
        for (kind, index), group in groups.items():
            for start in range(0, len(group), 4 * _BLOCK):
                some = group[start : start + 4 * _BLOCK]
                pieces += checker.show(kind, index, some)
                done += len(some)
                if progress is not None:
                    progress(done, leaves - done)
    return VerifiedProof(leaves, pieces, bound)


class _Shown(NamedTuple):
    """What is shown of a claim on N boxes.

    Attributes:
        holds: (N,) whether the claim is shown.
        change: (n, N) how much the claim can gain from halving each variable.
        lower, upper: (n, N) ends of the part of each box that is left to be shown; crossed where nothing is.
    """

    holds: NDArray[np.bool_]
    change: FloatArray
    lower: FloatArray
    upper: FloatArray


class _Attempt(NamedTuple):
    """An attempt to show a claim on N boxes.

    Attributes:
        holds: (N,) whether the claim is shown.
        is_wrong: (N,) whether a box's centre shows that the claim is wrong.
        along: (N,) the variable to bisect.
        lower, upper: (n, N) ends of the part of each box that is left to be shown.
    """

    holds: FloatArray
    is_wrong: FloatArray
    along: FloatArray
    lower: FloatArray
    upper: FloatArray


class _Checker:
    """A check of claims about boxes of one form.

    Args:
        form: the form.
        bound: the proven bound of the value that is maximised.
    """

    def __init__(self, form: StandardForm, bound: float) -> None:
        self._form, self._bound = form, bound
        self._functions, self._count = len(form.functions), len(form.functions) + len(form.conditions)
        self._equation = form.is_equation
        refuse_jumps(form.expressions, form.x)
        outputs = ca.cse([form.expressions, form.jacobian.T])
        self._arithmetic = SlopeArithmetic(ca.Function("claims", [form.x], outputs))

    def show(self, kind: Node, index: int, claims: list[Claim]) -> int:
        """Show claims of one kind, bisecting boxes until each holds, and return the number of boxes evaluated.

        Raises:
            ProofError: a claim could not be shown.
        """
        if kind in (Node.FACE_UPPER, Node.FACE_LOWER):
            self._check_faces(kind, index, claims)
        lower = np.stack([claim.lower for claim in claims], axis=1)
        upper = np.stack([claim.upper for claim in claims], axis=1)
        owner = np.arange(len(claims))
        depth = np.zeros(len(claims), dtype=int)
        used = np.zeros(len(claims), dtype=int)
        total = 0
        while owner.size:
            size = min(_BLOCK, owner.size)
            part = slice(owner.size - size, owner.size)
            a, b, of, deep = lower[:, part], upper[:, part], owner[part], depth[part]
            np.add.at(used, of, 1)
            total += size
            holds, is_wrong, along, a, b = self._attempt(kind, index, a, b)
            left = np.logical_not(holds)
            at_limit = (used[of] > _MOST_PIECES) | (deep >= _MOST_BISECTIONS)
            failed = np.logical_and(left, np.logical_or(is_wrong, at_limit))
            if failed.any():
                claim = claims[int(of[failed.argmax()])]
                ends = ", ".join(
                    f"{name} in [{x:.6g}, {y:.6g}]"
                    for name, x, y in zip(self._form.names, claim.lower, claim.upper, strict=True)
                )
                raise ProofError(f"the reason '{kind.name.lower()} {index}' could not be shown for the box {ends}")
            a, b, of, deep, along = a[:, left], b[:, left], of[left], deep[left] + 1, along[left]
            columns = np.arange(of.size)
            middle = 0.5 * a[along, columns] + 0.5 * b[along, columns]
            low, high = b.copy(), a.copy()
            low[along, columns] = high[along, columns] = middle
            lower = np.concatenate([lower[:, : part.start], a, high], axis=1)
            upper = np.concatenate([upper[:, : part.start], low, b], axis=1)
            owner = np.concatenate([owner[: part.start], of, of])
            depth = np.concatenate([depth[: part.start], deep, deep])
        return total

    def _check_faces(self, kind: Node, i: int, claims: list[Claim]) -> None:
        """Check that boxes collapse on faces of the root only.

        Raises:
            ProofError: a box collapses on another face.
        """
        for claim in claims:
            end, whole = (claim.upper, self._form.upper) if kind == Node.FACE_UPPER else (claim.lower, self._form.lower)
            if end[i] != whole[i]:
                raise ProofError(f"a box is collapsed on a face of {self._form.names[i]} that is not the case's")

    def _attempt(self, kind: Node, index: int, lower: FloatArray, upper: FloatArray) -> _Attempt:
        """Try to show a claim on boxes with ends (n, N)."""
        values = self._arithmetic(lower, upper)
        expressions, derivatives = values[: self._count], values[self._count :]
        n = self._form.n
        gradients = [derivatives[r * n : (r + 1) * n] for r in range(self._count)]
        with np.errstate(all="ignore"):
            if kind == Node.BOUNDED:
                shown = self._show_bound(expressions, gradients, lower, upper)
            elif kind == Node.INFEASIBLE:
                shown = self._show_infeasible(index, expressions[index], gradients[index], lower, upper)
            else:
                shown = self._show_monotone(kind, index, expressions, gradients, lower, upper)
            holds = np.logical_or(shown.holds, (shown.lower > shown.upper).any(axis=0))
            radius = 0.5 * (shown.upper - shown.lower)
            part = radius / np.where(upper > lower, 0.5 * (upper - lower), 1.0)
            score = shown.change * part
            relative = radius / (self._form.upper - self._form.lower)[:, None]
            score = np.where(np.isfinite(score).all(axis=0) & (score > 0).any(axis=0), score, relative)
        is_wrong = self._is_wrong_at_centre(kind, index, expressions, gradients)
        return _Attempt(holds, is_wrong, np.asarray(score.argmax(axis=0)), shown.lower, shown.upper)

    def _is_wrong_at_centre(
        self, kind: Node, index: int, expressions: list[Slope], gradients: list[list[Slope]]
    ) -> FloatArray:
        """Return whether the centre of a box is a counterexample to a claim."""
        J = self._functions
        if kind == Node.INFEASIBLE:
            return np.asarray((expressions[index].C[1] <= 0) & (not self._equation[index]))
        if kind == Node.BOUNDED:
            feasible = np.all([expression.C[1] <= 0 for expression in expressions[J:]], axis=0)
            above = np.min([expression.C[0] for expression in expressions[:J]], axis=0) > self._bound
            return np.asarray(feasible & above & (not any(self._equation)))
        # A function that falls there, or a condition that does not hold strictly and grows, excludes a direction.
        excluded = []
        for side in {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(kind, (1, -1)):
            stopped = np.zeros(len(expressions[0].C[0]), dtype=bool)
            for r, (expression, gradient) in enumerate(zip(expressions, gradients, strict=True)):
                low, high = gradient[index].C
                falls, grows = (high <= 0, low >= 0) if side > 0 else (low >= 0, high <= 0)
                if r < J:
                    stopped |= falls
                elif self._form.dependence[r][index]:
                    stopped |= (expression.C[0] >= 0) & grows
            excluded.append(stopped)
        return np.asarray(np.all(excluded, axis=0))

    def _feasible_part(
        self, expressions: list[Slope], lower: FloatArray, upper: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return ends (n, N) of the part of each box where no single condition excludes a point; crossed if none is."""
        low, high = lower, upper
        for each, is_equation in zip(expressions[self._functions :], self._equation[self._functions :], strict=True):
            (C_low, C_high), (S_low, S_high) = each.C, each.S
            ends = [cut_off(C_low, S_low, S_high, lower, upper)]
            if is_equation:
                ends.append(cut_off(-C_high, -S_high, -S_low, lower, upper))
            for below, above in ends:
                low, high = np.fmax(low, below), np.fmin(high, above)
        return low, high

    def _show_bound(
        self, expressions: list[Slope], gradients: list[list[Slope]], lower: FloatArray, upper: FloatArray
    ) -> _Shown:
        """Show that no feasible point has a value above the bound.

        A function is at most the bound, or a condition cannot hold, or a weighted sum of all is at most the bound.
        """
        J = self._functions
        defined = np.all([np.isfinite(expression.V[1]) for expression in expressions[:J]], axis=0)
        holds = np.min([expression.V[1] for expression in expressions[:J]], axis=0) <= self._bound
        for expression, is_equation in zip(expressions[J:], self._equation[J:], strict=True):
            holds |= (expression.V[0] > 0) | (is_equation & (expression.V[1] < 0))
        low, high = self._feasible_part(expressions, lower, upper)
        change = np.zeros_like(lower)
        if not holds.all():
            for weights in lagrangian_weights(J, self._equation, expressions, gradients, 0.5 * (upper - lower)):
                L = sum_model(weights, expressions, gradients, lower, upper)
                holds |= L.bound() <= self._bound
                change = np.fmax(change, L.change())
                # Points where the sum is at most the bound need no more: the others are left.
                above = self._bound - L.total - _SUMS * (abs(self._bound) + np.abs(L.total))
                ends = cut_off(above, -L.slope_high, -L.slope_low, lower, upper)
                low, high = np.fmax(low, ends[0]), np.fmin(high, ends[1])
        # Where a function may have no value, no sum bounds it.
        low, high = np.where(defined, low, lower), np.where(defined, high, upper)
        return _Shown(np.asarray(holds & defined, dtype=bool), change, low, high)

    def _show_infeasible(
        self, r: int, condition: Slope, gradient: list[Slope], lower: FloatArray, upper: FloatArray
    ) -> _Shown:
        """Show that a condition is positive on the whole box; for an equation, positive or negative."""
        (C_low, C_high), (S_low, S_high) = condition.C, condition.S
        holds, change = condition.V[0] > 0, np.zeros_like(lower)
        low, high = cut_off(C_low, S_low, S_high, lower, upper)
        if self._equation[r]:
            holds |= condition.V[1] < 0
            ends = cut_off(-C_high, -S_high, -S_low, lower, upper)
            low, high = np.fmax(low, ends[0]), np.fmin(high, ends[1])
        for direction in (-1.0, 1.0) if self._equation[r] else (-1.0,):
            weights = np.full((1, lower.shape[1]), direction)
            sign = sum_model(weights, [condition], [gradient], lower, upper)
            holds |= sign.bound() < 0
            change = sign.change()
        return _Shown(np.asarray(holds, dtype=bool), change, low, high)

    def _show_monotone(
        self,
        kind: Node,
        i: int,
        expressions: list[Slope],
        gradients: list[list[Slope]],
        lower: FloatArray,
        upper: FloatArray,
    ) -> _Shown:
        """Show that every function rises along a variable in a direction that no condition and no face stops."""
        form, J = self._form, self._functions
        holds = np.zeros(lower.shape[1], dtype=bool)
        radius = 0.5 * (upper - lower)
        steep = np.max([np.fmax(np.abs(each[i].S[0]), np.abs(each[i].S[1])) for each in gradients[:J]], axis=0)
        change = steep * radius
        sides = {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(kind, (1, -1))
        for side in sides:
            rises = np.ones_like(holds)
            for r in range(self._count):
                low, high = gradients[r][i].V
                if r < J:
                    rises &= (low > 0) if side > 0 else (high < 0)
                elif form.dependence[r][i]:
                    free = expressions[r].V[1] < 0
                    if not self._equation[r]:
                        free |= (high < 0) if side > 0 else (low > 0)
                    # The functions rise, and this condition may stop a point: it decides where to cut.
                    reach = np.fmax(np.abs(expressions[r].S[0]), np.abs(expressions[r].S[1])) * radius
                    change = np.where(rises & ~free, reach, change)
                    rises &= free
            if kind == Node.MONOTONE:
                rises &= (upper[i] < form.upper[i]) if side > 0 else (lower[i] > form.lower[i])
            holds |= rises
        return _Shown(np.asarray(holds, dtype=bool), change, *self._feasible_part(expressions, lower, upper))

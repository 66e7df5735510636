"""Checking a proof without trusting who made it.

The tree of boxes is unfolded from the program's own bounds, so that its leaves cover them by construction; every leaf
and every face is then a *claim* about one box, and each claim is shown anew with the interval slopes of
:mod:`screwsynth.nlp.certificate.slopes`, halving the box where that is too coarse. Nothing of the search is used,
neither its
arithmetic nor its multipliers; what both share is the case's expressions and CasADi's derivatives of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...models import FloatArray
from ..program.nlp import Nlp
from .proof import Node, Proof, ProofError, fingerprint
from .prooftree import Claim, unfolded
from .slopebounds import quadratic_bound
from .slopes import Slope, SlopeArithmetic
from .standardform import StandardForm, standard_form

#: Boxes that are evaluated at once.
_BLOCK = 512
#: A claim may be shown on so many pieces of its box, and no piece is halved more often than that.
_MOST_PIECES, _MOST_HALVINGS = 5_000, 60
#: Called with the number of boxes checked and how many are waiting.
CheckProgress = Callable[[int, int], None]


@dataclass(frozen=True)
class Checked:
    """A proof that holds.

    Attributes:
        leaves: claims about boxes in the tree.
        pieces: boxes that were evaluated to show them.
        bound: no feasible point of the root has a value above it; -inf when there is none.
    """

    leaves: int
    pieces: int
    bound: float


def check_proof(proof: Proof, nlp: Nlp, progress: CheckProgress | None = None) -> Checked:
    """Show every claim of a proof again.

    Args:
        proof: the proof.
        nlp: the program that it is about, built from the case.
        progress: called now and then.

    Raises:
        ProofError: the proof is for another program, its tree is not whole, or a claim could not be shown.
    """
    if fingerprint(nlp) != proof.graph:
        raise ProofError("the proof is for other expressions or bounds than this case's")
    form = standard_form(nlp)
    bound = -np.inf if proof.bound is None else proof.bound
    claims = unfolded(proof.tree, form)
    checker = _Checker(form, bound)
    pieces = 0
    waiting: dict[tuple[Node, int], list[Claim]] = {}
    for claim in claims:
        waiting.setdefault((claim.kind, claim.index), []).append(claim)
    done = 0
    for (kind, index), group in waiting.items():
        for start in range(0, len(group), 4 * _BLOCK):
            part = group[start : start + 4 * _BLOCK]
            pieces += checker.show(kind, index, part)
            done += len(part)
            if progress is not None:
                progress(done, len(claims) - done)
    return Checked(len(claims), pieces, bound)


class _Checker:
    """Shows claims about boxes of one form."""

    def __init__(self, form: StandardForm, bound: float) -> None:
        self._form, self._bound = form, bound
        self._functions, self._count = len(form.functions), len(form.functions) + len(form.rows)
        self._equation = [False] * self._functions + [row.is_equation for row in form.rows]
        outputs = ca.cse([form.expressions, form.jacobian.T])
        self._arithmetic = SlopeArithmetic(ca.Function("claims", [form.x], outputs))

    def show(self, kind: Node, index: int, claims: list[Claim]) -> int:
        """Show claims of one kind, halving boxes until they hold; returns the boxes that it took.

        Raises:
            ProofError: one could not be shown.
        """
        if kind in (Node.FACE_UPPER, Node.FACE_LOWER):
            self._on_the_root(kind, index, claims)
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
            held, wrong, along = self._holds(kind, index, a, b)
            left = np.logical_not(held)
            tired = (used[of] > _MOST_PIECES) | (deep >= _MOST_HALVINGS)
            hopeless = np.logical_and(left, np.logical_or(wrong, tired))
            if hopeless.any():
                claim = claims[int(of[hopeless.argmax()])]
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

    def _on_the_root(self, kind: Node, i: int, claims: list[Claim]) -> None:
        for claim in claims:
            end, whole = (claim.upper, self._form.upper) if kind == Node.FACE_UPPER else (claim.lower, self._form.lower)
            if end[i] != whole[i]:
                raise ProofError(f"a box is collapsed on a face of {self._form.names[i]} that is not the case's")

    def _holds(
        self, kind: Node, index: int, lower: FloatArray, upper: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Whether a claim is shown on boxes (n, N), whether their centres show it to be wrong, and what to halve."""
        values = self._arithmetic(lower, upper)
        expressions, derivatives = values[: self._count], values[self._count :]
        n = self._form.n
        gradients = [derivatives[r * n : (r + 1) * n] for r in range(self._count)]
        radius = 0.5 * (upper - lower)
        with np.errstate(all="ignore"):
            if kind == Node.BOUNDED:
                held = self._bounded(expressions, gradients, lower, upper)
                shown = 0
            elif kind == Node.INFEASIBLE:
                sign = 1.0 if not self._equation[index] else None
                held = self._impossible(expressions[index], gradients[index], lower, upper, sign)
                shown = index
            else:
                held, shown = self._rises(kind, index, expressions, gradients, lower, upper), 0
            if kind in (Node.BOUNDED, Node.INFEASIBLE):
                # What a slope leaves open, with its own slopes: the curvature counts more than the slope itself.
                weight = np.array(
                    [
                        sum(
                            np.fmax(np.abs(g.S[0][i]), np.abs(g.S[1][i])) * radius[k]
                            for k, g in enumerate(gradients[shown])
                        )
                        + 0.3 * np.fmax(np.abs(gradients[shown][i].V[0]), np.abs(gradients[shown][i].V[1]))
                        for i in range(n)
                    ]
                )
            else:
                slopes = [gradients[r][index].S for r in range(self._functions)]
                weight = np.max([np.fmax(np.abs(low), np.abs(high)) for low, high in slopes], axis=0)
            score = weight * radius
            relative = radius / (self._form.upper - self._form.lower)[:, None]
            score = np.where(np.isfinite(score).all(axis=0) & (score > 0).any(axis=0), score, relative)
        return held, self._disproved(kind, index, expressions, gradients), np.asarray(score.argmax(axis=0))

    def _disproved(self, kind: Node, index: int, expressions: list[Slope], gradients: list[list[Slope]]) -> FloatArray:
        """Whether the centre of a box is a point that a claim says does not exist."""
        J = self._functions
        if kind == Node.INFEASIBLE:
            return np.asarray((expressions[index].C[1] <= 0) & (not self._equation[index]))
        if kind == Node.BOUNDED:
            feasible = np.all([expression.C[1] <= 0 for expression in expressions[J:]], axis=0)
            above = np.min([expression.C[0] for expression in expressions[:J]], axis=0) > self._bound
            return np.asarray(feasible & above & (not any(self._equation)))
        # A function that falls there, or a row that is not kept strictly and grows, forbids a direction.
        forbidden = []
        for side in {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(kind, (1, -1)):
            stopped = np.zeros(len(expressions[0].C[0]), dtype=bool)
            for r, (expression, gradient) in enumerate(zip(expressions, gradients, strict=True)):
                low, high = gradient[index].C
                falls, grows = (high <= 0, low >= 0) if side > 0 else (low >= 0, high <= 0)
                if r < J:
                    stopped |= falls
                elif self._form.dependence[r][index]:
                    stopped |= (expression.C[0] >= 0) & grows
            forbidden.append(stopped)
        return np.asarray(np.all(forbidden, axis=0))

    def _bounded(
        self, expressions: list[Slope], gradients: list[list[Slope]], lower: FloatArray, upper: FloatArray
    ) -> FloatArray:
        """Some function is at most the bound, or a row cannot hold, or a weighted sum with the rows is at most that."""
        J = self._functions
        least = np.min([expression.V[1] for expression in expressions[:J]], axis=0)
        held = least <= self._bound
        for expression, is_equation in zip(expressions[J:], self._equation[J:], strict=True):
            held |= (expression.V[0] > 0) | (is_equation & (expression.V[1] < 0))
        if not held.all():
            weights = self._multipliers(expressions, gradients, upper - lower)
            held |= quadratic_bound(weights, expressions, gradients, lower, upper) <= self._bound
        # A function without a value has no bound, whatever a sum says.
        return np.asarray(held & np.all([np.isfinite(expression.V[1]) for expression in expressions[:J]], axis=0))

    def _impossible(
        self, row: Slope, gradient: list[Slope], lower: FloatArray, upper: FloatArray, sign: float | None
    ) -> FloatArray:
        """The row is positive all over the box; or, for an equation, negative."""
        held = (row.V[0] > 0) | ((row.V[1] < 0) if sign is None else False)
        for direction in (-1.0,) if sign is not None else (-1.0, 1.0):
            weights = np.full((1, lower.shape[1]), direction)
            held |= quadratic_bound(weights, [row], [gradient], lower, upper) < 0
        return np.asarray(held)

    def _rises(
        self,
        kind: Node,
        i: int,
        expressions: list[Slope],
        gradients: list[list[Slope]],
        lower: FloatArray,
        upper: FloatArray,
    ) -> FloatArray:
        """Every function rises along a variable, in a direction in which no row stops a point, and no face does."""
        form, J = self._form, self._functions
        held = np.zeros(lower.shape[1], dtype=bool)
        sides = {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(kind, (1, -1))
        for side in sides:
            rises = np.ones_like(held)
            for r in range(self._count):
                low, high = gradients[r][i].V
                if r < J:
                    rises &= (low > 0) if side > 0 else (high < 0)
                elif form.dependence[r][i]:
                    free = expressions[r].V[1] < 0
                    if not self._equation[r]:
                        free |= (high < 0) if side > 0 else (low > 0)
                    rises &= free
            if kind == Node.MONOTONE:
                rises &= (upper[i] < form.upper[i]) if side > 0 else (lower[i] > form.lower[i])
            held |= rises
        return held

    def _multipliers(self, expressions: list[Slope], gradients: list[list[Slope]], width: FloatArray) -> FloatArray:
        """(R, N) weights: of functions, not negative with sum 1; of rows, not positive on inequalities.

        Any will do. These make the gradient at the centre small, by projected gradient descent.
        """
        J, R = self._functions, self._count
        G = np.array([[0.5 * (g.C[0] + g.C[1]) for g in row] for row in gradients]) * width
        G = np.where(np.isfinite(G), G, 0.0)
        weights = np.zeros((R, width.shape[1]))
        weights[:J] = 1.0 / J
        for r in range(J, R):
            if not self._equation[r]:
                # A row that is far from binding gets no weight.
                G[r] = np.where(expressions[r].V[1] < 0, 0.0, G[r])
        if R == 1:
            return weights
        lipschitz = np.maximum((G * G).sum(axis=(0, 1)), 1e-300)
        for _ in range(200):
            left = np.einsum("rb,rib->ib", weights, G)
            step = np.einsum("rib,ib->rb", G, left) / lipschitz
            weights -= step
            weights[:J] = _on_simplex(weights[:J])
            for r in range(J, R):
                if not self._equation[r]:
                    weights[r] = np.minimum(weights[r], 0.0)
        return weights


def _on_simplex(weights: FloatArray) -> FloatArray:
    """The nearest columns that are not negative and sum to 1."""
    ordered = -np.sort(-weights, axis=0)
    sums = np.cumsum(ordered, axis=0) - 1
    counts = np.arange(1, len(weights) + 1)[:, None]
    last = np.maximum((ordered - sums / counts > 0).sum(axis=0), 1)
    level = sums[last - 1, np.arange(weights.shape[1])] / last
    positive = np.maximum(weights - level, 0.0)
    return np.asarray(positive / positive.sum(axis=0))

"""Check of a proof, without trust in who made it.

The boxes of the tree start from the program's own bounds, so that the leaves cover them by construction. Every leaf and
every face is a *claim* about one box, and the check shows each claim again with the interval slopes of
:mod:`screwsynth.nlp.certificate.slopes`; it bisects the box where they are too wide. It uses neither the arithmetic of
the search nor its multipliers. Search and check share the case's expressions, and CasADi's derivatives of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...models import FloatArray
from ..program.nlp import Nlp
from .proof import Node, Proof, ProofError, fingerprint
from .prooftree import Claim, read_claims
from .slopebounds import quadratic_bound
from .slopes import Slope, SlopeArithmetic
from .standardform import StandardForm, standard_form

#: Number of boxes that are evaluated at once.
_BLOCK = 512
#: Largest number of pieces of a claim's box, and of bisections on the way to one of them.
_MOST_PIECES, _MOST_BISECTIONS = 5_000, 60
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
    if fingerprint(nlp) != proof.graph:
        raise ProofError("the proof is for other expressions or bounds than this case's")
    form = standard_form(nlp)
    bound = -np.inf if proof.bound is None else proof.bound
    claims = read_claims(proof.tree, form)
    checker = _Checker(form, bound)
    pieces = 0
    groups: dict[tuple[Node, int], list[Claim]] = {}
    for claim in claims:
        groups.setdefault((claim.kind, claim.index), []).append(claim)
    done = 0
    for (kind, index), group in groups.items():
        for start in range(0, len(group), 4 * _BLOCK):
            part = group[start : start + 4 * _BLOCK]
            pieces += checker.show(kind, index, part)
            done += len(part)
            if progress is not None:
                progress(done, len(claims) - done)
    return VerifiedProof(len(claims), pieces, bound)


class _Attempt(NamedTuple):
    """An attempt to show a claim on N boxes, (N,) each.

    Attributes:
        holds: whether the claim is shown.
        is_wrong: whether a box's centre shows that the claim is wrong.
        along: the variable to bisect.
    """

    holds: FloatArray
    is_wrong: FloatArray
    along: FloatArray


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
            holds, is_wrong, along = self._attempt(kind, index, a, b)
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
        radius = 0.5 * (upper - lower)
        with np.errstate(all="ignore"):
            if kind == Node.BOUNDED:
                holds = self._shows_bound(expressions, gradients, lower, upper)
                decisive = 0
            elif kind == Node.INFEASIBLE:
                sign = 1.0 if not self._equation[index] else None
                holds = self._shows_infeasible(expressions[index], gradients[index], lower, upper, sign)
                decisive = index
            else:
                holds, decisive = self._shows_monotone(kind, index, expressions, gradients, lower, upper), 0
            if kind in (Node.BOUNDED, Node.INFEASIBLE):
                # The bound is wide by the slopes of the gradient, and less by the gradient itself.
                weight = np.array(
                    [
                        sum(
                            np.fmax(np.abs(g.S[0][i]), np.abs(g.S[1][i])) * radius[k]
                            for k, g in enumerate(gradients[decisive])
                        )
                        + 0.3 * np.fmax(np.abs(gradients[decisive][i].V[0]), np.abs(gradients[decisive][i].V[1]))
                        for i in range(n)
                    ]
                )
            else:
                slopes = [gradients[r][index].S for r in range(self._functions)]
                weight = np.max([np.fmax(np.abs(low), np.abs(high)) for low, high in slopes], axis=0)
            score = weight * radius
            relative = radius / (self._form.upper - self._form.lower)[:, None]
            score = np.where(np.isfinite(score).all(axis=0) & (score > 0).any(axis=0), score, relative)
        is_wrong = self._is_wrong_at_centre(kind, index, expressions, gradients)
        return _Attempt(holds, is_wrong, np.asarray(score.argmax(axis=0)))

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

    def _shows_bound(
        self, expressions: list[Slope], gradients: list[list[Slope]], lower: FloatArray, upper: FloatArray
    ) -> FloatArray:
        """Return whether no feasible point has a value above the bound.

        A function is at most the bound, or a condition cannot hold, or a weighted sum of all is at most the bound.
        """
        J = self._functions
        least = np.min([expression.V[1] for expression in expressions[:J]], axis=0)
        holds = least <= self._bound
        for expression, is_equation in zip(expressions[J:], self._equation[J:], strict=True):
            holds |= (expression.V[0] > 0) | (is_equation & (expression.V[1] < 0))
        if not holds.all():
            weights = self._multipliers(expressions, gradients, upper - lower)
            holds |= quadratic_bound(weights, expressions, gradients, lower, upper) <= self._bound
        # Where a function may have no value, no sum bounds it.
        return np.asarray(holds & np.all([np.isfinite(expression.V[1]) for expression in expressions[:J]], axis=0))

    def _shows_infeasible(
        self, condition: Slope, gradient: list[Slope], lower: FloatArray, upper: FloatArray, sign: float | None
    ) -> FloatArray:
        """Return whether a condition is positive on the whole box; for an equation, positive or negative."""
        holds = (condition.V[0] > 0) | ((condition.V[1] < 0) if sign is None else False)
        for direction in (-1.0,) if sign is not None else (-1.0, 1.0):
            weights = np.full((1, lower.shape[1]), direction)
            holds |= quadratic_bound(weights, [condition], [gradient], lower, upper) < 0
        return np.asarray(holds)

    def _shows_monotone(
        self,
        kind: Node,
        i: int,
        expressions: list[Slope],
        gradients: list[list[Slope]],
        lower: FloatArray,
        upper: FloatArray,
    ) -> FloatArray:
        """Return whether every function rises along a variable in a direction that no condition and no face stops."""
        form, J = self._form, self._functions
        holds = np.zeros(lower.shape[1], dtype=bool)
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
                    rises &= free
            if kind == Node.MONOTONE:
                rises &= (upper[i] < form.upper[i]) if side > 0 else (lower[i] > form.lower[i])
            holds |= rises
        return holds

    def _multipliers(self, expressions: list[Slope], gradients: list[list[Slope]], width: FloatArray) -> FloatArray:
        """Return weights (R, N): of functions, not negative with sum 1; of inequalities, not positive.

        All such weights give bounds. These make the gradient at the centre small, by projected gradient descent.
        """
        J, R = self._functions, self._count
        G = np.array([[0.5 * (g.C[0] + g.C[1]) for g in row] for row in gradients]) * width
        G = np.where(np.isfinite(G), G, 0.0)
        weights = np.zeros((R, width.shape[1]))
        weights[:J] = 1.0 / J
        for r in range(J, R):
            if not self._equation[r]:
                # A condition that cannot bind gets no weight.
                G[r] = np.where(expressions[r].V[1] < 0, 0.0, G[r])
        if R == 1:
            return weights
        lipschitz = np.maximum((G * G).sum(axis=(0, 1)), 1e-300)
        for _ in range(200):
            left = np.einsum("rb,rib->ib", weights, G)
            step = np.einsum("rib,ib->rb", G, left) / lipschitz
            weights -= step
            weights[:J] = _project_on_simplex(weights[:J])
            for r in range(J, R):
                if not self._equation[r]:
                    weights[r] = np.minimum(weights[r], 0.0)
        return weights


def _project_on_simplex(weights: FloatArray) -> FloatArray:
    """Return the nearest columns (J, N) that are not negative and sum to 1."""
    ordered = -np.sort(-weights, axis=0)
    sums = np.cumsum(ordered, axis=0) - 1
    counts = np.arange(1, len(weights) + 1)[:, None]
    last = np.maximum((ordered - sums / counts > 0).sum(axis=0), 1)
    level = sums[last - 1, np.arange(weights.shape[1])] / last
    positive = np.maximum(weights - level, 0.0)
    return np.asarray(positive / positive.sum(axis=0))

"""What enclosures say about boxes: bounds, conditions that cannot hold, monotone directions, contraction, where to cut.

For each box: an upper bound of what is maximised over the feasible part of the box. With ``h = r e``, ``|e_i| <= 1``,
the forms of a gradient, ``grad L in G + A t e + t^2 [p, q]``, integrated along the ray from the centre, give

    L(c + h) in L(c) + sum_i b_i e_i + 1/2 sum_ij H_ij e_i e_j +- sum_i w_i |e_i|,
    b_i = r_i (G_i + (p_i + q_i) / 6),   H = sym(r_i A_ij),   w_i = r_i (q_i - p_i) / 6,

a quadratic model with a remainder of third order, without second derivatives. With ``mu`` on the simplex and
``lambda_k >= 0`` on inequalities, ``L = sum_j mu_j phi_j - sum_k lambda_k h_k`` is at least ``min phi`` wherever the
rows hold, so that its bound holds there, whatever the multipliers are. They are chosen to make the gradient small at
the centre.

This is the reference; ``_bounds.c`` does the same. Every formula is explained in ``docs/certificate.md``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from . import instructions
from .enclosure import ULP, Forms, enclose, midpoints
from .quadratic import GradientModel, Quadratic, largest, reaching_affine
from .standardform import StandardForm

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...models import FloatArray

#: Rounds of the coordinate-wise searches for multipliers and for a tangent point: any result of them is sound.
_MULTIPLIER_ROUNDS = 8
_TANGENT_ROUNDS = 3
#: What the linear part of the Lagrangian counts for beside the curved part when a box is cut.
_LINEAR = 0.3
#: A contraction that takes off less than this part of a side is not made.
_WORTH = 0.1


class Verdict(enum.IntEnum):
    """What became of a box."""

    OPEN = 0
    BOUNDED = 1  # its bound does not exceed the threshold
    INFEASIBLE = 2  # a row cannot hold in it
    MONOTONE = 3  # the function increases in a direction in which one can go on
    EMPTIED = 4  # contraction along a variable left nothing of it


@dataclass(frozen=True, eq=False)
class Examined:
    """What was found out about B boxes.

    Attributes:
        verdict: (B,) :class:`Verdict`.
        reason: (B,) the expression that cannot hold, or the variable that is monotone or emptied.
        bound: (B,) upper bound over the feasible part of the box; infinite where a value may be undefined.
        lower, upper: (n, B) what is left of the box after contraction, or the face that it collapsed on.
        cut_lower, cut_upper: (n, B) why that end was moved: -2 not at all, -1 collapsed, or the index of an expression.
        split: (B,) the variable to cut next.
        value: (B,) a lower bound of what is maximised at the centre; -inf where a row may be violated.
        centre: (n, B).
    """

    verdict: NDArray[np.int32]
    reason: NDArray[np.int32]
    bound: FloatArray
    lower: FloatArray
    upper: FloatArray
    cut_lower: NDArray[np.int32]
    cut_upper: NDArray[np.int32]
    split: NDArray[np.int32]
    value: FloatArray
    centre: FloatArray


def search_tape(form: StandardForm) -> instructions.Tape:
    """The instructions of a form's R expressions and then of their derivatives, row by row.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    return instructions.lower(ca.Function("search", [form.x], ca.cse([form.expressions, form.jacobian.T])))


class NumpyEngine:
    """The reference engine: everything on arrays with the boxes last.

    Args:
        form: what is searched.
    """

    name = "numpy"
    #: Boxes that fit the processor's cache with all their registers.
    block = 1024

    def __init__(self, form: StandardForm) -> None:
        self.form = form
        self._tape = search_tape(form)
        self.functions = len(form.functions)
        self.equation = np.array([False] * self.functions + [row.is_equation for row in form.rows])
        self.depends = np.array(form.dependence, dtype=bool)

    def close(self) -> None:
        """Nothing to let go."""

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examined:
        """Examine boxes against a value that their bounds must not exceed.

        Args:
            lower: (n, B) ends.
            upper: (n, B) ends.
            threshold: boxes whose bound is at most this are closed.
        """
        with np.errstate(all="ignore"):
            return self._examine(lower, upper, threshold)

    def _examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examined:
        J = self.functions
        centre, radius = midpoints(lower, upper)
        model = self._model(lower, upper, radius)
        # Ranges of the expressions: of their forms, and by the mean value theorem.
        steep = np.maximum(np.abs(model.slope_lo), np.abs(model.slope_hi)).sum(axis=1) * (1 + 64 * ULP)
        middle, error = model.value.c, model.value.s
        spread = (error + steep) * (1 + ULP) + ULP * np.abs(middle)
        high = np.fmin(model.value.hi, middle + spread * (1 + ULP) + ULP * np.abs(middle))
        low = np.fmax(model.value.lo, middle - spread * (1 + ULP) - ULP * np.abs(middle))
        defined = (error[:J] < np.inf).all(axis=0)
        verdict = np.zeros(lower.shape[1], dtype=np.int32)
        reason = np.zeros(lower.shape[1], dtype=np.int32)
        bound = high[:J].min(axis=0)
        multipliers = self._multipliers(model, high)
        lagrangian, L = self._quadratic_bound(model, multipliers)
        bound = np.where(defined, np.fmin(bound, lagrangian), np.inf)

        impossible = (low > 0) | (self.equation[:, None] & (high < 0))
        impossible[:J] = False
        binding = (~(high < 0)) & ~impossible
        binding[:J] = False
        lo, hi, cut_lower, cut_upper = self._monotone(model, binding, lower, upper, verdict, reason)
        self._contract(model, L, lo, hi, cut_lower, cut_upper, (centre, radius), threshold, verdict, reason)
        verdict[impossible.any(axis=0)] = Verdict.INFEASIBLE
        reason[impossible.any(axis=0)] = impossible.argmax(axis=0)[impossible.any(axis=0)]
        verdict[~defined & (verdict != Verdict.INFEASIBLE)] = Verdict.OPEN
        for array, original in ((lo, lower), (hi, upper)):
            array[:, ~defined] = original[:, ~defined]
        cut_lower[:, ~defined] = cut_upper[:, ~defined] = -2
        closed = bound <= threshold
        verdict[closed], reason[closed] = Verdict.BOUNDED, 0
        rows_hold = (middle[J:] + error[J:] <= 0).all(axis=0)
        value = np.where(rows_hold, (middle[:J] - error[:J]).min(axis=0), -np.inf)
        return Examined(
            verdict, reason, bound, lo, hi, cut_lower, cut_upper, self._split(L, lower, upper, lo, hi), value, centre
        )

    def _model(self, lower: FloatArray, upper: FloatArray, radius: FloatArray) -> GradientModel:
        n, R = self.form.n, len(self.equation)
        box = enclose(self._tape, lower, upper)
        shape = (R, n, lower.shape[1])
        r = radius[None]

        def scaled(values: FloatArray) -> FloatArray:
            return np.where(r > 0, values[R:].reshape(shape) * r, 0.0)

        return GradientModel(
            value=Forms(*(each[:R] for each in vars(box).values())),
            b=scaled(box.c),
            A=box.a[R:].reshape(R, n, n, lower.shape[1]) * radius[None, :, None],
            p=scaled(box.p),
            q=scaled(box.q),
            s=scaled(box.s),
            slope_lo=scaled(box.lo),
            slope_hi=scaled(box.hi),
            gradient_lo=box.lo[R:].reshape(shape),
            gradient_hi=box.hi[R:].reshape(shape),
        )

    def _multipliers(self, model: GradientModel, high: FloatArray) -> FloatArray:
        """(R, B) weights that make the combined gradient small: of functions on the simplex, of rows negated.

        Coordinate descent on the least squares of the scaled gradient at the centre.
        """
        J, R = self.functions, len(self.equation)
        weights = np.zeros_like(high)
        weights[0] = 1.0
        left = model.b[0].copy()
        directions = model.b.copy()
        directions[:J] -= model.b[0]
        sizes = np.einsum("rib,rib->rb", directions, directions)
        usable = (sizes > 0) & (sizes < np.inf) & (high >= 0)
        usable[:J] = (sizes[:J] > 0) & (sizes[:J] < np.inf)
        for _ in range(_MULTIPLIER_ROUNDS if R > 1 else 0):
            for r in range(1, R):
                step = -np.einsum("ib,ib->b", directions[r], left) / sizes[r]
                new = weights[r] + step
                if r < J:
                    new = np.clip(new, 0.0, weights[r] + weights[0])
                elif not self.equation[r]:
                    new = np.minimum(new, 0.0)
                new = np.where(usable[r] & np.isfinite(new), new, weights[r])
                change = new - weights[r]
                left += change * np.where(usable[r], directions[r], 0.0)
                weights[r] = new
                if r < J:
                    weights[0] = np.maximum(weights[0] - change, 0.0)
        # The weights of the functions must sum to 1, and rounding may have moved that.
        weights[0] += 1.0 - weights[:J].sum(axis=0)
        bad = weights[0] < 0
        weights[:J, bad], weights[0, bad] = 0.0, 1.0
        return weights

    def _quadratic_bound(self, model: GradientModel, weights: FloatArray) -> tuple[FloatArray, Quadratic]:
        """Upper bound of the Lagrangian over the box, and its model."""
        L = Quadratic.combined(model, weights)
        mean = L.middle + np.maximum(np.abs(L.slope_lo), np.abs(L.slope_hi)).sum(axis=0)
        # Where the slope has a sign, the largest value is on that face.
        s = np.where(L.slope_lo >= 0, 1.0, np.where(L.slope_hi <= 0, -1.0, 0.0))
        free = s == 0
        Hs = np.einsum("ijb,jb->ib", L.H, s)
        fixed = L.middle + (L.b * s).sum(axis=0) + 0.5 * (s * Hs).sum(axis=0) + (L.w * np.abs(s)).sum(axis=0)
        b = np.where(free, L.b + Hs, 0.0)
        w = np.where(free, L.w, 0.0)
        H = np.where(free[:, None] & free[None], L.H, 0.0)
        diagonal = np.einsum("iib->ib", H).copy()
        others = np.abs(H).sum(axis=1) - np.abs(diagonal)
        separate = fixed + (largest(np.abs(b) + w, diagonal) + 0.5 * others).sum(axis=0)
        shift = np.maximum(diagonal + others, 0.0)
        tangent = fixed + self._tangent(b, H, diagonal - shift) + (0.5 * shift + w).sum(axis=0)
        best = np.fmin(mean, np.fmin(separate, tangent))
        return best + L.rounding, L

    def _tangent(self, b: FloatArray, H: FloatArray, diagonal: FloatArray) -> FloatArray:
        """Largest value over the box of a tangent plane to the concave ``b e + 1/2 e' C e``, C = H but its diagonal.

        Any tangent plane of a concave function lies above it; this one touches near its maximum.
        """
        n = len(b)
        t = np.zeros_like(b)
        gradient = b.copy()
        for _ in range(_TANGENT_ROUNDS):
            for i in range(n):
                curvature = diagonal[i]
                new = np.where(curvature < 0, t[i] - gradient[i] / curvature, np.sign(gradient[i]))
                new = np.clip(np.where(np.isfinite(new), new, 0.0), -1.0, 1.0)
                change = new - t[i]
                t[i] = new
                gradient += change * H[i]
                gradient[i] += change * (curvature - H[i, i])
        # The plane at t: b t + 1/2 t'Ct + gradient (e - t), where gradient = b + C t.
        Ct = np.einsum("ijb,jb->ib", H, t) + (diagonal - np.einsum("iib->ib", H)) * t
        gradient = b + Ct
        return np.asarray(-0.5 * (t * Ct).sum(axis=0) + np.abs(gradient).sum(axis=0))

    def _monotone(
        self,
        model: GradientModel,
        binding: NDArray[np.bool_],
        lower: FloatArray,
        upper: FloatArray,
        verdict: NDArray[np.int32],
        reason: NDArray[np.int32],
    ) -> tuple[FloatArray, FloatArray, NDArray[np.int32], NDArray[np.int32]]:
        """Collapse boxes in which every function rises along a variable and no row stops a point from following.

        A point where that holds is no maximum, unless it lies on the face of the whole box. A row stops it when it may
        bind and may grow in that direction; an equation always does, if it depends on the variable.
        """
        lo, hi = lower.copy(), upper.copy()
        cut_lower = np.full(lower.shape, -2, dtype=np.int32)
        cut_upper = cut_lower.copy()
        J = self.functions
        for i in range(self.form.n):
            width = upper[i] > lower[i]
            for side in (1, -1):
                g_lo, g_hi = model.gradient_lo[:, i], model.gradient_hi[:, i]
                if side > 0:
                    rises, falls = (g_lo[:J] > 0).all(axis=0), g_hi < 0
                else:
                    rises, falls = (g_hi[:J] < 0).all(axis=0), g_lo > 0
                stopped = binding & self.depends[:, i, None] & ~(falls & ~self.equation[:, None])
                applies = rises & ~stopped.any(axis=0) & width & (verdict == Verdict.OPEN)
                whole = self.form.upper[i] if side > 0 else self.form.lower[i]
                at_face = (upper[i] if side > 0 else lower[i]) == whole
                dropped, moved = applies & ~at_face, applies & at_face
                verdict[dropped], reason[dropped] = Verdict.MONOTONE, i
                (lo if side > 0 else hi)[i, moved] = whole
                (cut_lower if side > 0 else cut_upper)[i, moved] = -1
        return lo, hi, cut_lower, cut_upper

    def _contract(
        self,
        model: GradientModel,
        L: Quadratic,
        lo: FloatArray,
        hi: FloatArray,
        cut_lower: NDArray[np.int32],
        cut_upper: NDArray[np.int32],
        box: tuple[FloatArray, FloatArray],
        threshold: float,
        verdict: NDArray[np.int32],
        reason: NDArray[np.int32],
    ) -> None:
        """Move ends of boxes past points where a function is at most the threshold, or a row cannot hold."""
        centre, radius = box
        J = self.functions
        e_lo, e_hi = np.full(lo.shape, -1.0), np.full(lo.shape, 1.0)
        why_lo, why_hi = cut_lower.copy(), cut_upper.copy()

        def keep(part: tuple[FloatArray, FloatArray], r: int) -> None:
            raised, lowered = part[0] > e_lo, part[1] < e_hi
            e_lo[raised], e_hi[lowered] = part[0][raised], part[1][lowered]
            why_lo[raised], why_hi[lowered] = r, r

        for r in range(len(self.equation)):
            for sign in (1.0, -1.0):
                if (r < J and sign < 0) or (r >= J and sign > 0 and not self.equation[r]):
                    continue
                level = threshold if r < J else 0.0
                keep(reaching_affine(model.value, r, sign, level), r)
                keep(model.expression(r, sign).reaching(level), r)
        if len(self.equation) > 1:
            keep(L.reaching(threshold), 0)
        new_lo = centre + radius * e_lo
        new_lo -= (np.abs(centre) + radius) * (4 * ULP)
        new_hi = centre + radius * e_hi
        new_hi += (np.abs(centre) + radius) * (4 * ULP)
        # A cut is worth its leaf in a proof when it takes off a part that one can see.
        worth = _WORTH * (hi - lo)
        moved = (why_lo >= 0) & (cut_lower == -2) & (cut_upper == -2) & (new_lo - lo > worth)
        lo[moved], cut_lower[moved] = new_lo[moved], why_lo[moved]
        moved = (why_hi >= 0) & (cut_upper == -2) & (cut_lower != -1) & (hi - new_hi > worth)
        hi[moved], cut_upper[moved] = new_hi[moved], why_hi[moved]
        emptied = lo > hi
        which = emptied.any(axis=0)
        verdict[which], reason[which] = Verdict.EMPTIED, emptied.argmax(axis=0)[which]

    def _split(
        self, L: Quadratic, lower: FloatArray, upper: FloatArray, lo: FloatArray, hi: FloatArray
    ) -> NDArray[np.int32]:
        """The variable along which the Lagrangian can change most on what is left of the box."""
        width = upper - lower
        left = (hi - lo) / np.where(width > 0, width, 1.0)
        score = (_LINEAR * np.abs(L.b) + np.abs(L.H).sum(axis=0) + L.w) * left
        relative = (hi - lo) / (self.form.upper - self.form.lower)[:, None]
        finite = np.isfinite(score).all(axis=0)
        score = np.where(finite, score, relative)
        # Where nothing changes, the longest side.
        score = np.where((score > 0).any(axis=0), score, relative)
        score[~(hi > lo)] = -1.0
        return np.asarray(score.argmax(axis=0), dtype=np.int32)

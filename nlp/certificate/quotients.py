"""Functions that are sums of squared quotients, and their upper models from those of numerators and denominators.

The work rate of a row in a twist is ``N / |d|``, with N and ``D = |d|^2`` polynomials in joint coordinates and position:

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D,    for any number rho, with D > 0.

With ``rho = N / D`` at the centre of a box, the first part is linear in N and D, whose models are accurate. E is 0 at the
centre: with ``a.e`` its part of first order and ``|E - a.e| <= rest``,

    (1 - t) (a.e)^2 - (1 / t - 1) rest^2  <=  E^2  <=  (1 + t) (a.e)^2 + (1 + 1 / t) rest^2    for any t > 0.

With ``t = rest / reach`` and ``reach`` the largest of ``|a.e|``, these are ``(reach -+ rest)^2`` at its corner, the best bounds
there. A square is at least 0 too, the better bound where rest is larger than reach.

Enclosures of the quotient and its derivatives, operation by operation, are tens of times as wide on large boxes: there
the terms of second order of each factor are bounded by themselves.

The gradient of ``N^2 / D`` is ``r (2 grad N - r grad D)`` with ``r = N / D``. The factor in brackets is linear in r, so that
its ends are those at the two ends of r, and each of these two is one model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .enclosure import Enclosures
from .intervals import TINY, ULP
from .kinks import without_ties
from .separation import terms_of

if TYPE_CHECKING:
    from ...models import FloatArray
    from .quadratic import GradientModel
    from .standardform import StandardForm

#: Rounding of a sum of fewer than a hundred products, in parts of the sum of their sizes: several times the largest.
_SUM = 64 * ULP


class Quotient(NamedTuple):
    """A term ``sign * N^2 / D`` of a function.

    Attributes:
        N, D: (1, 1).
        sign: 1 or -1.
        function: number of the function.
    """

    N: SX
    D: SX
    sign: int
    function: int


@dataclass(frozen=True, eq=False)
class SearchRows:
    """A form's expressions as a search encloses them.

    Attributes:
        expressions: (E, 1) functions without their quotients, conditions, then N and D of each quotient.
        jacobian: (E, n) derivatives, dense.
        quotients: the terms that are missing in the functions.
    """

    expressions: SX
    jacobian: SX
    quotients: tuple[Quotient, ...]


def search_rows(form: StandardForm, *, apart: bool = True) -> SearchRows:
    """Return the expressions of a form, with the squared quotients of its functions taken apart if so wanted."""
    found: list[Quotient] = []
    rests: list[SX] = []
    for j, function in enumerate(form.functions if apart else ()):
        rest = SX(0)
        for term in terms_of(function):
            quotient = _as_quotient(term, j)
            if quotient is None:
                rest = rest + term
            else:
                found.append(quotient)
        rests.append(rest)
    if not found:
        return SearchRows(form.expressions, form.jacobian, ())
    conditions = [each.expression for each in form.conditions]
    parts = [part for each in found for part in (each.N, each.D)]
    expressions = ca.densify(ca.vertcat(*rests, *conditions, *parts))
    jacobian = ca.densify(without_ties(ca.jacobian(expressions, form.x), form.x))
    return SearchRows(expressions, jacobian, tuple(found))


def _as_quotient(term: SX, function: int) -> Quotient | None:
    """Return a term as a squared quotient; None for another one."""
    factor = 1.0
    while True:
        if term.is_op(ca.OP_NEG):
            term, factor = term.dep(0), -factor
        elif term.is_op(ca.OP_TWICE):
            term, factor = term.dep(0), 2 * factor
        elif term.is_op(ca.OP_MUL) and term.dep(0).is_constant():
            term, factor = term.dep(1), factor * float(term.dep(0))
        elif term.is_op(ca.OP_MUL) and term.dep(1).is_constant():
            term, factor = term.dep(0), factor * float(term.dep(1))
        else:
            break
    if not (term.is_op(ca.OP_DIV) and term.dep(0).is_op(ca.OP_SQ)) or term.dep(1).is_constant() or factor == 0:
        return None
    N, D = term.dep(0).dep(0), term.dep(1)
    return Quotient(N, D if abs(factor) == 1 else D / abs(factor), 1 if factor > 0 else -1, function)


@dataclass(frozen=True, eq=False)
class SquareSums:
    """Upper models of the quotients of J functions over B boxes, beside what :class:`GradientModel` has of them.

    Attributes:
        H: (J, n, n, B) matrices of the models.
        w: (J, n, B) bounds of their remainders.
    """

    H: FloatArray
    w: FloatArray


class _Part(NamedTuple):
    """The model ``c + b e + 1/2 e'He +- w |e| +- s`` of one expression over B boxes, and its ends over the box."""

    c: FloatArray
    s: FloatArray
    b: FloatArray
    H: FloatArray
    w: FloatArray
    lo: FloatArray
    hi: FloatArray
    slope_lo: FloatArray
    slope_hi: FloatArray


def with_quotients(
    model: GradientModel, quotients: Sequence[Quotient], R: int, radius: FloatArray, least: FloatArray | None = None
) -> GradientModel:
    """Return the model of R expressions, given that of their E rows.

    A function's value at the centre is enclosed as ``c +- s``, c + s being the middle of the upper model. The ends of its
    gradient, times the radii, are for the whole box; those that are not scaled are for its points that matter.

    Args:
        model: of the rows, as in :class:`SearchRows`.
        quotients: the terms of the functions.
        R: number of functions and conditions.
        radius: (n, B) half widths of the boxes.
        least: (B,) points of the only quotient with a lesser value do not matter; None where all do.
    """
    if not quotients:
        return model
    rows = {name: values.copy() for name, values in vars(model).items() if isinstance(values, np.ndarray)}
    value = {name: values[:R].copy() for name, values in vars(model.value).items()}
    J, n, B = 1 + max(each.function for each in quotients), radius.shape[0], radius.shape[1]
    sums = SquareSums(np.zeros((J, n, n, B)), np.zeros((J, n, B)))
    whole = {name: values[:R] for name, values in rows.items()}
    for k, quotient in enumerate(quotients):
        N, D = _part(model, R + 2 * k), _part(model, R + 2 * k + 1)
        _add_square(whole, value, sums, N, D, quotient, radius, least)
    return replace(model, value=Enclosures(**value), **whole, squares=sums)


def _part(model: GradientModel, r: int) -> _Part:
    """Return the model of a row."""
    value, p, q = model.value, model.p[r], model.q[r]
    A = model.A[r]
    b, w, H = model.b[r] + (p + q) / 6, (q - p) / 6 + model.s[r], 0.5 * (A + np.swapaxes(A, 0, 1))
    c, s = value.c[r], value.s[r]
    reach = (np.abs(b) + w).sum(axis=0) + 0.5 * np.abs(H).sum(axis=(0, 1)) + s
    reach = reach + _SUM * (np.abs(c) + reach)
    lo, hi = np.fmax(value.lo[r], c - reach), np.fmin(value.hi[r], c + reach)
    return _Part(c, s, b, H, w, lo, hi, model.slope_lo[r], model.slope_hi[r])


def _add_square(
    whole: dict[str, FloatArray],
    value: dict[str, FloatArray],
    sums: SquareSums,
    N: _Part,
    D: _Part,
    quotient: Quotient,
    radius: FloatArray,
    least: FloatArray | None,
) -> None:
    """Add a quotient to the rows of its function; writes to the arrays."""
    j, sign = quotient.function, quotient.sign
    rho = N.c / D.c
    size = np.abs(rho)
    a, HE = N.b - rho * D.b, N.H - rho * D.H
    # Sizes of all terms of E, which may cancel.
    terms = np.abs(N.c) + size * np.abs(D.c) + (np.abs(N.b) + size * np.abs(D.b)).sum(axis=0)
    terms = terms + (np.abs(N.H) + size * np.abs(D.H)).sum(axis=(0, 1)) + (N.w + size * D.w).sum(axis=0)
    offset = N.s + size * D.s + _SUM * terms
    rest = 0.5 * np.abs(HE).sum(axis=(0, 1)) + (N.w + size * D.w).sum(axis=0) + offset
    reach = np.abs(a).sum(axis=0)
    reach, rest = reach * (1 + _SUM), rest * (1 + _SUM)
    # r = N / D = rho + E / D over the box.
    quotients = np.stack([N.lo / D.lo, N.lo / D.hi, N.hi / D.lo, N.hi / D.hi])
    far = (reach + rest) / D.lo
    r_lo, r_hi = np.fmax(quotients.min(axis=0), rho - far), np.fmin(quotients.max(axis=0), rho + far)
    r_lo, r_hi = r_lo - _SUM * (np.abs(r_lo) + size), r_hi + _SUM * (np.abs(r_hi) + size)
    # rho (2 N - rho D), and its rounding.
    b, H, w = 2 * rho * N.b - rho**2 * D.b, 2 * rho * N.H - rho**2 * D.H, 2 * size * N.w + rho**2 * D.w
    middle = rho * (2 * N.c - rho * D.c)
    error = 2 * size * offset + 3 * _SUM * size * terms + TINY
    square = a[:, None] * a[None]
    part = np.where(reach > 0, rest / reach, 0.0)
    numerator = np.maximum(np.abs(N.c) - N.s, 0.0) if sign > 0 else np.abs(N.c) + N.s
    denominator = D.c + D.s if sign > 0 else D.c - D.s
    at_centre = sign * numerator**2 / denominator
    at_centre = at_centre - _SUM * np.abs(at_centre)
    if sign > 0:
        kept, more = 2 * (1 + part) / D.lo, rest * (reach + rest) / D.lo
    else:
        known = rest < reach
        kept, more = np.where(known, 2 * (1 - part) / D.hi, 0.0), np.where(known, rest * (reach - rest) / D.hi, 0.0)
    added = square * kept
    error = error + _SUM * (more + np.abs(added).sum(axis=(0, 1)))
    high = sign * middle + more + error
    both = np.maximum(r_lo**2, r_hi**2)
    none = np.where((r_lo > 0) | (r_hi < 0), np.minimum(r_lo**2, r_hi**2), 0.0)
    most = np.fmin(both * D.hi, np.maximum(N.lo**2, N.hi**2) / D.lo) * (1 + _SUM)
    fewest = none * D.lo * (1 - _SUM)
    g_lo, g_hi = _gradient_factor(N, D, r_lo, r_hi)
    slope_lo, slope_hi = _product(r_lo, r_hi, g_lo, g_hi, sign)
    p_lo, p_hi = (r_lo, r_hi) if least is None else _where_it_matters(r_lo, r_hi, D, sign, least)
    if least is not None:
        g_lo, g_hi = _gradient_factor(N, D, p_lo, p_hi)
    matter_lo, matter_hi = _product(p_lo, p_hi, g_lo, g_hi, sign)
    wide = radius > 0
    scale = np.where(wide, radius, 1.0)
    grad_lo = np.where(wide, matter_lo / scale, -np.inf)
    grad_hi = np.where(wide, matter_hi / scale, np.inf)
    defined = (D.lo > 0) & (N.s < np.inf) & (D.s < np.inf)
    defined &= np.isfinite(rho) & np.isfinite(reach) & np.isfinite(rest)
    half = 0.5 * (high - at_centre) + _SUM * (np.abs(high) + np.abs(at_centre))
    value["c"][j] += 0.5 * (high + at_centre)
    value["s"][j] += np.where(defined & ~np.isnan(half), half, np.inf)
    value["lo"][j] += fewest if sign > 0 else -most
    value["hi"][j] += most if sign > 0 else -fewest
    value["a"][j] += sign * b
    matrix = sign * (H + added)
    value["q"][j] += (0.5 * np.abs(matrix).sum(axis=(0, 1)) + w.sum(axis=0)) * (1 + _SUM)
    whole["b"][j] += sign * b
    sums.H[j] += matrix
    sums.w[j] += np.where(defined, w + _SUM * (np.abs(b) + np.abs(H).sum(axis=1) + w), np.inf)
    whole["slope_lo"][j] += slope_lo
    whole["slope_hi"][j] += slope_hi
    whole["gradient_lo"][j] += grad_lo - _SUM * np.abs(grad_lo)
    whole["gradient_hi"][j] += grad_hi + _SUM * np.abs(grad_hi)


def _where_it_matters(
    r_lo: FloatArray, r_hi: FloatArray, D: _Part, sign: int, least: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the ``r`` for which ``sign r^2 D`` can be at least a value (B,)."""
    if sign < 0:
        edge = np.sqrt(np.maximum(-least, 0.0) / D.lo) * (1 + _SUM)
        edge = np.where(np.isnan(edge), np.inf, edge)
        return np.maximum(r_lo, -edge), np.minimum(r_hi, edge)
    edge = np.sqrt(np.maximum(least, 0.0) / D.hi) * (1 - _SUM)
    edge = np.where(np.isnan(edge), 0.0, edge)
    up, down = r_hi >= edge, -r_lo >= edge
    low = np.where(up & ~down, np.maximum(r_lo, edge), r_lo)
    high = np.where(down & ~up, np.minimum(r_hi, -edge), r_hi)
    return low, high


def _gradient_factor(N: _Part, D: _Part, r_lo: FloatArray, r_hi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends (n, B) of ``2 grad N - r grad D``, times the radii, over r in an interval."""
    lows, highs = [], []
    for r in (r_lo, r_hi):
        b, H = 2 * N.b - r * D.b, 2 * N.H - r * D.H
        size = np.abs(r)
        # A gradient's terms of second order lie in [p, q]; w is at least (q - p) / 6, and b has (p + q) / 6 in it.
        w = 5 * (2 * N.w + size * D.w)
        terms = 2 * np.abs(N.b) + size * np.abs(D.b) + (2 * np.abs(N.H) + size * np.abs(D.H)).sum(axis=1) + w
        reach = np.abs(H).sum(axis=1) + w + _SUM * terms
        ends = r * D.slope_lo, r * D.slope_hi
        lows.append(np.fmax(b - reach, 2 * N.slope_lo - np.maximum(*ends) - _SUM * np.abs(ends).max(axis=0)))
        highs.append(np.fmin(b + reach, 2 * N.slope_hi - np.minimum(*ends) + _SUM * np.abs(ends).max(axis=0)))
    low, high = np.minimum(*lows), np.maximum(*highs)
    return low - _SUM * np.abs(low), high + _SUM * np.abs(high)


def _product(
    r_lo: FloatArray, r_hi: FloatArray, g_lo: FloatArray, g_hi: FloatArray, sign: int
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of ``sign`` times the product of two intervals, outwards."""
    ends = np.stack([r_lo * g_lo, r_lo * g_hi, r_hi * g_lo, r_hi * g_hi])
    low, high = ends.min(axis=0), ends.max(axis=0)
    low, high = low - _SUM * np.abs(low), high + _SUM * np.abs(high)
    return (low, high) if sign > 0 else (-high, -low)

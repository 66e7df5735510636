"""Polynomials of second order with a ball: the arithmetic of the check of a proof.

On boxes ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, every value v is enclosed by

    v(e) in c + sum_i a_i e_i + sum_{i <= j} Q_ij e_i e_j + [-s, s]     and     v(e) in V.

``s`` holds all terms of third and higher order, bounded by sums of sizes, and all rounding. A function of one variable
is its Taylor polynomial with Lagrange's remainder of third order, or an identity that replaces it. A value keeps only
the coefficients of the variables that it depends on. Coefficients are computed in round to nearest, and ``s`` grows by
the number of roundings that an operation makes of each of its terms, counted with a margin, in parts of the sizes of
its operands.

A work rate squared is a quotient ``N^2 / D`` of polynomials. Its square and its division one after the other would have
terms of third order many times as large as the quotient's, so the two are one operation. For any number rho,

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D.

The first part is linear in N and D. With rho near ``N / D`` at the centre, E is small in the whole box.

A value that may be undefined has NaN for ``s`` and ``V``, and so has every value computed from it; NaN proves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import intervals as ends

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray
    from .intervals import Ends

#: Rounding unit of doubles.
UNIT = 2.0**-53
#: More than underflow can cost an operation.
_TINY = 1e-290
#: Roundings of each term of an operation, in parts of its size, with a margin. A sum, a multiple and a shift make one,
#: a product and a square at most three, a quotient at most six, and a Taylor polynomial at most twelve with those of
#: its slope and its curve.
_ONCE, _PRODUCT, _QUOTIENT, _TAYLOR = 2 * UNIT, 6 * UNIT, 12 * UNIT, 16 * UNIT


class Places(NamedTuple):
    """Places of the m coefficients of polynomials in d variables: constant, linear, squares, and products of two.

    Attributes:
        linear, squares, products: slices of rows.
        first, second: (d (d - 1) / 2,) the two variables of each product.
        slack: bound of the relative rounding error of sums of sizes of m coefficients and of a formula of them.
    """

    linear: slice
    squares: slice
    products: slice
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    slack: float

    @property
    def total(self) -> int:
        """Number m of coefficients."""
        return int(self.products.stop)


@cache
def places(d: int) -> Places:
    """Return the places of coefficients of polynomials in d variables."""
    first, second = np.triu_indices(d, 1)
    count = 1 + 2 * d + len(first)
    return Places(
        slice(1, 1 + d),
        slice(1 + d, 1 + 2 * d),
        slice(1 + 2 * d, count),
        first,
        second,
        2 * (count + 32) * UNIT,
    )


@cache
def _rows_in(few: tuple[int, ...], many: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the rows of coefficients in some variables among those in more variables; both sorted."""
    at = {variable: k for k, variable in enumerate(many)}
    d, small, large = len(many), places(len(few)), places(len(many))
    own = [at[variable] for variable in few]
    pair = np.zeros((d, d), dtype=np.intp)
    pair[large.first, large.second] = np.arange(large.products.start, large.total)
    products = [int(pair[own[i], own[j]]) for i, j in zip(small.first, small.second, strict=True)]
    return np.array([0, *(1 + k for k in own), *(1 + d + k for k in own), *products], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A value over N boxes; a constant has 1 in the place of N.

    Attributes:
        on: the d variables that it depends on, in order.
        P: (m, N) coefficients at :func:`places`.
        s: (N,) radius of the ball; NaN where the value may be undefined.
        V: ends (N,) of the range.
        rad: (N,) sum of the sizes of linear coefficients.
        curved: (N,) largest size of the part of second order.
        size: (N,) sum of the sizes of all coefficients.
        root: the value whose square this is; None where it is not known to be one.
    """

    on: tuple[int, ...]
    P: FloatArray
    s: FloatArray
    V: Ends
    rad: FloatArray
    curved: FloatArray
    size: FloatArray
    root: Polynomial | None = None

    def select(self, which: NDArray[np.intp]) -> Polynomial:
        """Return the value over some boxes; a constant is one number for all."""
        if self.P.shape[1] == 1:
            return self
        V = self.V[0][which], self.V[1][which]
        rad, curved, size = self.rad[which], self.curved[which], self.size[which]
        return Polynomial(self.on, self.P[:, which], self.s[which], V, rad, curved, size)

    def spread(self, on: tuple[int, ...]) -> FloatArray:
        """Return the coefficients (M, N) in more variables."""
        if on == self.on:
            return self.P
        P = np.zeros((places(len(on)).total, self.P.shape[1]))
        P[_rows_in(self.on, on)] = self.P
        return P


def middles(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres and radii (n, N) of boxes with ends (n, N); a radius is rounded up."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, np.nextafter(radius, np.inf), 0.0)


def settled(on: tuple[int, ...], P: FloatArray, s: FloatArray, V: Ends) -> Polynomial:
    """Return a value, its range intersected with that of its polynomial; undefined unless that is finite."""
    at = places(len(on))
    sizes = np.abs(P)
    size = sizes.sum(axis=0)
    grown = 1 + at.slack
    rad = sizes[at.linear].sum(axis=0) * grown
    squares, products = P[at.squares], sizes[at.products].sum(axis=0)
    up = (np.maximum(squares, 0.0).sum(axis=0) + products) * grown
    down = (products - np.minimum(squares, 0.0).sum(axis=0)) * grown
    s = s * grown
    low, high = ends.out(P[0] - (rad + down + s) * grown, P[0] + (rad + up + s) * grown)
    undefined = 0.0 * (s + size)
    V = np.fmax(V[0], low) + undefined, np.fmin(V[1], high) + undefined
    return Polynomial(on, P, s + undefined, V, rad, np.maximum(up, down), size)


def variable(i: int, lower: FloatArray, upper: FloatArray) -> Polynomial:
    """Return variable number i, over boxes with these ends (N,) of it."""
    centre, radius = middles(lower, upper)
    P = np.zeros((places(1).total, lower.size))
    P[0], P[1] = centre, radius
    none = np.zeros(lower.size)
    return Polynomial((i,), P, none, (lower, upper), radius, none, np.abs(centre) + radius)


def constant(value: float) -> Polynomial:
    """Return a constant."""
    flat, none = np.array([value]), np.zeros(1)
    return Polynomial(
        (), flat[:, None], none if np.isfinite(value) else flat * np.nan, (flat, flat), none, none, np.abs(flat)
    )


def number_of(u: Polynomial) -> float | None:
    """Return the number that a constant is; None for what is not known to be one."""
    return float(u.V[0][0]) if not u.on and u.V[0].size == 1 and u.V[0][0] == u.V[1][0] else None


def add(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return u + v."""
    for one, other in ((u, v), (v, u)):
        number = number_of(one)
        if number is not None:
            return shift(other, number)
    on, P, R = _together(u, v)
    return settled(on, P + R, u.s + v.s + _ONCE * (u.size + v.size), ends.add(u.V, v.V))


def sub(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return u - v."""
    by = number_of(v)
    if by is not None:
        return shift(u, -by)
    on, P, R = _together(u, v)
    return settled(on, P - R, u.s + v.s + _ONCE * (u.size + v.size), ends.sub(u.V, v.V))


def scale(u: Polynomial, by: float) -> Polynomial:
    """Return a multiple of u."""
    if abs(by) == 1:
        V = u.V if by > 0 else (-u.V[1], -u.V[0])
        return Polynomial(u.on, by * u.P, u.s, V, u.rad, u.curved, u.size)
    slack, factor = places(len(u.on)).slack, np.array([by])
    size = abs(by) * (1 + slack)
    s = size * u.s + (_ONCE * (size * u.size) + _TINY)
    V = ends.mul(u.V, (factor, factor))
    return Polynomial(
        u.on, u.P * by, s + 0.0 * size, V, size * u.rad + _TINY, size * u.curved + _TINY, size * u.size + _TINY
    )


def shift(u: Polynomial, by: float) -> Polynomial:
    """Return u plus a number."""
    P, number = u.P.copy(), np.array([by])
    P[0] += by
    s = u.s * (1 + _ONCE) + _ONCE * np.abs(P[0])
    # Taken from u.size, a large constant would leave its rounding, in which small coefficients are lost.
    size = np.abs(P).sum(axis=0)
    return Polynomial(u.on, P, s, ends.add(u.V, (number, number)), u.rad, u.curved, size)


def mul(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return u v."""
    for one, other in ((u, v), (v, u)):
        number = number_of(one)
        if number is not None:
            return scale(other, number)
    on, X, Y = _together(u, v)
    at = places(len(on))
    P = X[0] * Y
    P[1:] += Y[0] * X[1:]
    _add_product(P, X[at.linear], Y[at.linear], at)
    rest = _size_of_rest(u, v) + _PRODUCT * (u.size * v.size) + _TINY
    return settled(on, P, u.size * v.s + v.size * u.s + u.s * v.s + rest, ends.mul(u.V, v.V))


def square(u: Polynomial) -> Polynomial:
    """Return the square of u."""
    at = places(len(u.on))
    P = (2 * u.P[0]) * u.P
    P[0] *= 0.5
    _add_square(P, u.P[at.linear], at, 1.0)
    rest = (2 * u.rad + u.curved) * u.curved + _PRODUCT * (u.size * u.size) + _TINY
    found = settled(u.on, P, (2 * u.size + u.s) * u.s + rest, ends.square(u.V))
    return replace(found, root=u)


def div(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return ``u / v = P + (u - P v) / v``, P the quotient's polynomial: ``u - P v`` has no terms below the third.

    The ball of P v, and what rounding leaves of those below, are divided by the smallest size of v.
    """
    number = number_of(v)
    if number is not None and abs(np.frexp(number)[0]) == 0.5:
        # A power of 2 has an exact inverse.
        return scale(u, 1 / number)
    if u.root is not None and number is None:
        return _squared_quotient(u.root, v, u.V)
    on, X, Y = _together(u, v)
    at = places(len(on))
    inverse = 1 / Y[0]
    ratio = X[0] * inverse
    P = (X - ratio * Y) * inverse
    P[0] = ratio
    _add_product(P, -P[at.linear], Y[at.linear] * inverse, at)
    parts = np.abs(P)
    rad, curved = parts[at.linear].sum(axis=0), parts[at.squares.start :].sum(axis=0)
    size = np.abs(ratio) + rad + curved
    near = np.maximum(v.V[0], -v.V[1])
    near = np.where(near > 0, near, np.nan)
    rest = rad * v.curved + curved * (v.rad + v.curved) + u.s + size * v.s
    rest = rest + (_QUOTIENT * (u.size + size * v.size) + _TINY * (1 + v.size))
    return settled(on, P, rest / near, ends.mul(u.V, ends.inverse(v.V)))


def _squared_quotient(N: Polynomial, D: Polynomial, square: Ends) -> Polynomial:
    """Return ``N^2 / D``, by the identity of this module's docstring, with the range of ``N^2``.

    With a the linear part of E and ``|E - a.e| <= rest``, ``E^2`` is ``(a.e)^2`` to ``rest (2 sum |a_i| + rest)``.
    """
    on, X, Y = _together(N, D)
    at = places(len(on))
    rho = X[0] / Y[0]
    size = np.abs(rho)
    E = X - rho * Y
    error = N.s + size * D.s + _PRODUCT * (N.size + size * D.size) + _TINY
    a, parts = E[at.linear], np.abs(E)
    reach, rest = parts[at.linear].sum(axis=0), parts[at.squares.start :].sum(axis=0) + parts[0] + error
    inverse = ends.inverse(D.V)
    middle, half = 0.5 * (inverse[0] + inverse[1]), 0.5 * (inverse[1] - inverse[0])
    far = np.maximum(-inverse[0], inverse[1])
    P = rho * (X + E)
    _add_square(P, a, at, middle)
    # Multiplied in this order, no small factor is lost beside a large one.
    s = reach * (reach * (half + _QUOTIENT * far)) + rest * ((2 * reach + rest) * far)
    s = s + size * (N.s + error + _QUOTIENT * (2 * N.size + size * D.size)) + _TINY * (1 + far + reach + rest)
    return settled(on, P, s, ends.mul(square, inverse))


def _taylor(
    u: Polynomial,
    V: Ends,
    terms: tuple[FloatArray, FloatArray, FloatArray],
    third: FloatArray | float,
    error: FloatArray | float,
) -> Polynomial:
    """Return ``f(c + Y) = f(c) + f'(c) Y + curve Y^2 +- third |Y|^3``, Y being u without its constant c.

    Args:
        u: the value.
        V: range of ``f(u)``.
        terms: ``f(c)``, ``f'(c)`` and ``curve``, half of ``f''(c)``, (N,) each.
        third: bound of the rest in parts of ``|Y|^3``.
        error: error of the three terms beyond that of arithmetic.
    """
    value, slope, curve = terms
    at, moved = places(len(u.on)), u.rad + u.curved
    reach = np.fmin(moved + u.s, np.maximum(u.V[1] - u.P[0], u.P[0] - u.V[0]))
    P = slope * u.P
    P[0] = value
    _add_square(P, u.P[at.linear], at, curve)
    steep, bent = np.abs(slope), np.abs(curve)
    s = steep * u.s + bent * ((2 * u.rad + u.curved) * u.curved + (2 * moved + u.s) * u.s)
    s = s + third * (reach * reach * reach)
    far = moved + u.s
    # Underflow takes less than _TINY from each power of what moved.
    s = s + (error + _TINY * (1 + bent + third)) * (1 + far + far * far)
    s = s + _TAYLOR * (np.abs(value) + steep * u.size + bent * (u.size * u.size))
    return settled(u.on, P, s, V)


def sqrt(u: Polynomial) -> Polynomial:
    """Return the root.

    ``S = sqrt(c + Y) = r + Y / 2r - Y^2 / 8r^3 + Y^3 (S + 3r) / (8 r^3 (S + r)^3)`` with ``r = sqrt(c)``.
    """
    V, root = ends.sqrt(u.V), np.sqrt(u.P[0])
    slope = 0.5 / root
    curve = -0.25 * slope / u.P[0]
    third = (V[0] + 3 * root) / (V[0] + root) ** 3 * -curve * (1 + 1e-13)
    return _taylor(u, V, (root, slope, curve), third, 0.0)


def sin(u: Polynomial) -> Polynomial:
    """Return the sine of u."""
    sine, cosine = np.sin(u.P[0]), np.cos(u.P[0])
    return _taylor(u, ends.wave(u.V, np.sin), (sine, cosine, -0.5 * sine), 1 / 6 + 1e-15, ends.LIBRARY)


def cos(u: Polynomial) -> Polynomial:
    """Return the cosine of u."""
    sine, cosine = np.sin(u.P[0]), np.cos(u.P[0])
    return _taylor(u, ends.wave(u.V, np.cos), (cosine, -sine, -0.5 * cosine), 1 / 6 + 1e-15, ends.LIBRARY)


def exp(u: Polynomial) -> Polynomial:
    """Return the exponential of u."""
    V, value = ends.exp(u.V), np.exp(u.P[0])
    third = np.maximum(V[1], value) * (1 / 6 + 1e-13)
    return _taylor(u, V, (value, value, 0.5 * value), third, 2 * ends.LIBRARY * value)


def log(u: Polynomial) -> Polynomial:
    """Return the natural logarithm of u."""
    c = u.P[0]
    low = np.minimum(np.where(u.V[0] > 0, u.V[0], np.nan), c)
    value, slope = np.log(c), 1 / c
    third, error = (1 / 3 + 1e-13) / low**3, ends.LIBRARY * (1 + np.abs(value))
    return _taylor(u, ends.log(u.V), (value, slope, -0.5 * slope * slope), third, error)


def atan(u: Polynomial) -> Polynomial:
    """Return the arc tangent; its third derivative is at most 2 in size."""
    value, slope = np.arctan(u.P[0]), 1 / (1 + u.P[0] * u.P[0])
    terms = value, slope, -u.P[0] * slope * slope
    return _taylor(u, ends.atan(u.V), terms, 1 / 3 + 1e-15, ends.LIBRARY)


def ramp(u: Polynomial) -> Polynomial:
    """Return max(u, 0): with any number k from 0 to 1 it exceeds k u by 0 to max(-k lo, (1 - k) hi)."""
    low, high = u.V
    part = np.where(low >= 0, 1.0, np.where(high <= 0, 0.0, high / (high - low)))
    part = np.clip(part, 0.0, 1.0)
    half = np.where((low < 0) & (high > 0), 0.5 * np.maximum(-part * low, (1 - part) * high), 0.0)
    P = part * u.P
    P[0] += half
    s = part * u.s + half + (2 * _ONCE * (u.size + half) + _TINY)
    return settled(u.on, P, s, (np.maximum(low, 0.0), np.maximum(high, 0.0)))


def step(u: Polynomial) -> Polynomial:
    """Return 1 where u is not negative, else 0."""
    least, most = np.where(u.V[0] > 0, 1.0, 0.0), np.where(u.V[1] < 0, 0.0, 1.0)
    P = np.zeros_like(u.P)
    P[0] = 0.5 * (least + most)
    return settled(u.on, P, 0.5 * (most - least) + 0.0 * u.s, (least, most))


def _size_of_rest(x: Polynomial, y: Polynomial) -> FloatArray:
    """Return a bound (N,) of the terms of third and fourth order of a product of two polynomials."""
    return x.rad * y.curved + y.rad * x.curved + x.curved * y.curved


def _together(u: Polynomial, v: Polynomial) -> tuple[tuple[int, ...], FloatArray, FloatArray]:
    """Return the variables of two values, and the coefficients of both in these."""
    if u.on == v.on:
        return u.on, u.P, v.P
    on = tuple(sorted({*u.on, *v.on}))
    return on, u.spread(on), v.spread(on)


def _add_product(P: FloatArray, a: FloatArray, b: FloatArray, at: Places) -> None:
    """Add the product of two linear parts (d, N) to coefficients, in place."""
    P[at.squares] += a * b
    P[at.products] += a[at.first] * b[at.second] + a[at.second] * b[at.first]


def _add_square(P: FloatArray, a: FloatArray, at: Places, by: FloatArray | float) -> None:
    """Add a multiple of the square of a linear part (d, N) to coefficients, in place."""
    scaled = a * by
    P[at.squares] += scaled * a
    P[at.products] += (2 * scaled)[at.first] * a[at.second]

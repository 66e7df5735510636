"""Polynomials of second order with an error ball: the arithmetic of the check of a proof.

On boxes ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, every value v is enclosed by

    v(e) in c + sum_i a_i e_i + sum_{i <= j} Q_ij e_i e_j + [-s, s]     and     v(e) in V.

``s`` bounds all terms of third and higher order, and all rounding. A function of one variable is its Taylor polynomial
with Lagrange's remainder of third order, or an identity that replaces it. A value keeps only the coefficients of the
variables on which it depends. Coefficients are rounded to nearest, and ``s`` grows by the number of roundings of each
term, counted with a margin: the last one relative to the coefficient, the earlier ones relative to the operands. Ends
of ranges move outwards by one double at every operation, or by the error of a library.

A squared work rate is a quotient ``N^2 / D`` of polynomials. Squaring and dividing separately would give much larger
terms of third order than the quotient has, so both are one operation. For any number rho,

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D.

The first part is linear in N and D. With rho near ``N / D`` at the centre, E is small over the whole box.

A value that may be undefined has NaN for ``s`` and ``V``. So has every value computed from such a value. NaN proves
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from ....models import FloatArray

#: Rounding unit of doubles.
UNIT = 2.0**-53
#: Upper bound of the effect of underflow on an operation.
_TINY = 1e-290
#: Relative rounding of a number, with a margin: the last rounding of each coefficient, and that of a sum.
_ONCE = 2 * UNIT
#: Number of roundings of each term of an operation before the last one, with a margin. A product and a square make at
#: most two, a quotient five, and a Taylor polynomial eleven, including those of its slope and its curvature.
_PRODUCT, _QUOTIENT, _TAYLOR = 4 * UNIT, 10 * UNIT, 14 * UNIT
#: Error of a library's sine, cosine, exponential, logarithm and arc tangent, relative to the value or to 1.
_LIBRARY = 4e-15
#: Outward directions of the lower and the upper bound of a range, as infinite numbers.
_SIDES = np.array([[-1.0], [1.0]])
_ENDS = _SIDES * np.inf


class Places(NamedTuple):
    """Positions of the m coefficients of polynomials in d variables: constant, linear, squares, and mixed products.

    Attributes:
        linear, squares, products: slices of rows.
        first, second: (d (d - 1) / 2,) the two variables of each product.
        slack: bound of the relative rounding error of sums of m absolute values and of a formula of such sums.
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
    """Return the positions of the coefficients of polynomials in d variables."""
    first, second = np.triu_indices(d, 1)
    count = 1 + 2 * d + len(first)
    return Places(
        slice(1, 1 + d), slice(1 + d, 1 + 2 * d), slice(1 + 2 * d, count), first, second, 2 * (count + 32) * UNIT
    )


@cache
def _rows_in(few: tuple[int, ...], many: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the rows of coefficients in a few variables among those in more variables; both are sorted."""
    at = {variable: k for k, variable in enumerate(many)}
    d, small, large = len(many), places(len(few)), places(len(many))
    own = [at[variable] for variable in few]
    pair = np.zeros((d, d), dtype=np.intp)
    pair[large.first, large.second] = np.arange(large.products.start, large.total)
    products = [int(pair[own[i], own[j]]) for i, j in zip(small.first, small.second, strict=True)]
    return np.array([0, *(1 + k for k in own), *(1 + d + k for k in own), *products], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A value over N boxes; for a constant, N is 1.

    Attributes:
        on: the d variables on which the value depends, in order.
        P: (m, N) coefficients at :func:`places`.
        s: (N,) radius of the error ball; NaN where the value may be undefined.
        V: (2, N) ends of the range.
        rad: (N,) sum of the absolute linear coefficients.
        curved: (N,) largest absolute value of the part of second order.
        size: (N,) sum of the absolute values of all coefficients.
        root: known square root of this value (of either sign); None if no square root is known.
    """

    on: tuple[int, ...]
    P: FloatArray
    s: FloatArray
    V: FloatArray
    rad: FloatArray
    curved: FloatArray
    size: FloatArray
    root: Polynomial | None = None

    def select(self, which: NDArray[np.intp]) -> Polynomial:
        """Return the value over some boxes; a constant stays the same."""
        if self.P.shape[1] == 1:
            return self
        P, s, V, rad, curved, size = (
            each[..., which] for each in (self.P, self.s, self.V, self.rad, self.curved, self.size)
        )
        return Polynomial(self.on, P, s, V, rad, curved, size)

    def spread(self, on: tuple[int, ...]) -> FloatArray:
        """Return the coefficients (M, N) in a larger set of variables."""
        if on == self.on:
            return self.P
        P = np.zeros((places(len(on)).total, self.P.shape[1]))
        P[_rows_in(self.on, on)] = self.P
        return P

    @property
    def number(self) -> float | None:
        """Value of a constant; None for another value."""
        return float(self.P[0, 0]) if not self.on and self.s.size == 1 and self.s[0] == 0 else None

    def __add__(self, other: Polynomial) -> Polynomial:
        """Return the sum."""
        on, X, Y = _together(self, other)
        V = _out(self.V + other.V)
        # Rounding makes no sum of squares negative: the sum keeps its root if both terms can be 0.
        V[0] = np.where((self.V[0] >= 0) & (other.V[0] >= 0), np.maximum(V[0], 0.0), V[0])
        return settled(on, X + Y, self.s + other.s, V)

    def __sub__(self, other: Polynomial) -> Polynomial:
        """Return the difference."""
        on, X, Y = _together(self, other)
        return settled(on, X - Y, self.s + other.s, _out(self.V - other.V[::-1]))

    def __mul__(self, other: Polynomial | float) -> Polynomial:
        """Return the product."""
        if isinstance(other, float):
            return _multiple(self, other)
        for u, v in ((self, other), (other, self)):
            if v.number is not None:
                return _multiple(u, v.number)
        return _product(self, other)

    def __truediv__(self, other: Polynomial) -> Polynomial:
        """Return the quotient."""
        return _quotient(self, other) if self.root is None else _squared_quotient(self.root, other, self.V)


def middles(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres and radii (n, N) of boxes with ends (n, N); a radius is rounded up."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, np.nextafter(radius, np.inf), 0.0)


def settled(
    on: tuple[int, ...], P: FloatArray, s: FloatArray | float, V: FloatArray, rounding: float = _ONCE
) -> Polynomial:
    """Return a value with its range intersected with its polynomial's range; undefined unless the latter is finite.

    Args:
        on: variables of the value.
        P: (m, N) coefficients.
        s: (N,) radius of the error ball without the last rounding of each coefficient.
        V: (2, N) range of the value.
        rounding: relative last rounding error of each coefficient; 0 for exact coefficients.
    """
    at = places(len(on))
    sizes = np.abs(P)
    size = sizes.sum(axis=0)
    grown = 1 + at.slack
    rad = sizes[at.linear].sum(axis=0) * grown
    squares, products = P[at.squares], sizes[at.products].sum(axis=0)
    up = (np.maximum(squares, 0.0).sum(axis=0) + products) * grown
    down = (products - np.minimum(squares, 0.0).sum(axis=0)) * grown
    s = (s + rounding * size) * grown
    reach = rad + s
    low, high = P[0] - (reach + down) * grown, P[0] + (reach + up) * grown
    undefined = 0.0 * (s + size)
    V = np.array([np.fmax(V[0], np.nextafter(low, -np.inf)), np.fmin(V[1], np.nextafter(high, np.inf))]) + undefined
    return Polynomial(on, P, s + undefined, V, rad, np.maximum(up, down), size)


def variable(i: int, lower: FloatArray, upper: FloatArray) -> Polynomial:
    """Return variable number i over boxes, from its lower and upper bounds (N,)."""
    centre, radius = middles(lower, upper)
    none = np.zeros(lower.size)
    P = np.array([centre, radius, none])
    return Polynomial((i,), P, none, np.array([lower, upper]), radius, none, np.abs(centre) + radius)


def constant(value: float) -> Polynomial:
    """Return a constant."""
    return settled((), np.array([[value]]), 0.0, np.array([[value], [value]]), 0.0)


def _multiple(u: Polynomial, by: float) -> Polynomial:
    """Return a multiple of u."""
    V = by * (u.V if by > 0 else u.V[::-1])
    if abs(by) == 1:
        return Polynomial(u.on, by * u.P, u.s, V, u.rad, u.curved, u.size)
    factor = abs(by) * (1 + places(len(u.on)).slack)
    rad, curved, size = (factor * each + _TINY for each in (u.rad, u.curved, u.size))
    return Polynomial(u.on, by * u.P, factor * u.s + _ONCE * size + _TINY, _out(V), rad, curved, size)


def _product(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return u v."""
    on, X, Y = _together(u, v)
    at = places(len(on))
    P = X[0] * Y
    P[1:] += Y[0] * X[1:]
    _add_product(P, X[at.linear], Y[at.linear], at)
    rest = u.rad * v.curved + v.rad * u.curved + u.curved * v.curved + _PRODUCT * (u.size * v.size) + _TINY
    return settled(on, P, u.size * v.s + v.size * u.s + u.s * v.s + rest, _ends_of_product(u.V, v.V))


def square(u: Polynomial) -> Polynomial:
    """Return the square of u."""
    at = places(len(u.on))
    P = (2 * u.P[0]) * u.P
    P[0] *= 0.5
    _add_square(P, u.P[at.linear], at, 1.0)
    rest = (2 * u.rad + u.curved) * u.curved + _PRODUCT * (u.size * u.size) + _TINY
    one, other = u.V * u.V
    V = _out(np.array([np.minimum(one, other), np.maximum(one, other)]))
    V[0] = np.where((u.V[0] <= 0) & (u.V[1] >= 0), 0.0, np.maximum(V[0], 0.0))
    return replace(settled(u.on, P, (2 * u.size + u.s) * u.s + rest, V), root=u)


def _quotient(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return ``u / v = P + (u - P v) / v`` with the quotient's polynomial P; ``u - P v`` has only third-order terms.

    The error ball of P v, and rounding in its lower terms, are divided by the smallest absolute value of v.
    """
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
    rest = rad * v.curved + curved * (v.rad + v.curved) + u.s + size * v.s
    rest = rest + (_QUOTIENT * (u.size + size * v.size) + _TINY * (1 + v.size))
    return settled(on, P, rest / np.where(near > 0, near, np.nan), _ends_of_product(u.V, _ends_of_inverse(v.V)))


def _squared_quotient(N: Polynomial, D: Polynomial, square: FloatArray) -> Polynomial:
    """Return ``N^2 / D``, by the identity of this module's docstring, with the range (2, N) of ``N^2``.

    With a the linear part of E and ``|E - a.e| <= rest``, ``E^2`` is ``(a.e)^2`` up to ``rest (2 sum |a_i| + rest)``.
    """
    on, X, Y = _together(N, D)
    at = places(len(on))
    rho = X[0] / Y[0]
    size = np.abs(rho)
    E = X - rho * Y
    error = N.s + size * D.s + _PRODUCT * (N.size + size * D.size) + _TINY
    a, parts = E[at.linear], np.abs(E)
    reach, rest = parts[at.linear].sum(axis=0), parts[at.squares.start :].sum(axis=0) + parts[0] + error
    inverse = _ends_of_inverse(D.V)
    middle, half = 0.5 * (inverse[0] + inverse[1]), 0.5 * (inverse[1] - inverse[0])
    far = np.abs(inverse).max(axis=0)
    P = rho * (X + E)
    _add_square(P, a, at, middle)
    # In this order of the products, no small factor underflows before a large one.
    s = reach * (reach * (half + _QUOTIENT * far)) + rest * ((2 * reach + rest) * far)
    s = s + size * (N.s + error + _QUOTIENT * (2 * N.size + size * D.size)) + _TINY * (1 + far + reach + rest)
    return settled(on, P, s, _ends_of_product(square, inverse))


def _taylor(
    u: Polynomial,
    V: FloatArray,
    terms: tuple[FloatArray, FloatArray, FloatArray],
    third: FloatArray | float,
    error: FloatArray | float,
) -> Polynomial:
    """Return ``f(c + Y) = f(c) + f'(c) Y + curve Y^2 +- third |Y|^3``, Y being u without its constant c.

    Args:
        u: the argument of f.
        V: (2, N) range of ``f(u)``.
        terms: ``f(c)``, ``f'(c)`` and ``curve``, half of ``f''(c)``, (N,) each.
        third: bound of the remainder relative to ``|Y|^3``.
        error: relative error of the three terms in addition to that of arithmetic.
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
    # Underflow takes less than _TINY from each power of the shifted value.
    s = s + (error + _TINY * (1 + bent + third)) * (1 + far + far * far)
    s = s + _TAYLOR * (np.abs(value) + steep * u.size + bent * (u.size * u.size))
    return settled(u.on, P, s, V)


def sqrt(u: Polynomial) -> Polynomial:
    """Return the root.

    ``S = sqrt(c + Y) = r + Y / 2r - Y^2 / 8r^3 + Y^3 (S + 3r) / (8 r^3 (S + r)^3)`` with ``r = sqrt(c)``.
    """
    V, root = np.maximum(_out(np.sqrt(u.V)), 0.0), np.sqrt(u.P[0])
    slope = 0.5 / root
    curve = -0.25 * slope / u.P[0]
    third = (V[0] + 3 * root) / (V[0] + root) ** 3 * -curve * (1 + 1e-13)
    return _taylor(u, V, (root, slope, curve), third, 0.0)


def sin(u: Polynomial) -> Polynomial:
    """Return the sine of u."""
    sine, cosine = np.sin(u.P[0]), np.cos(u.P[0])
    return _taylor(u, _ends_of_wave(u.V, np.sin), (sine, cosine, -0.5 * sine), 1 / 6 + 1e-15, _LIBRARY)


def cos(u: Polynomial) -> Polynomial:
    """Return the cosine of u."""
    sine, cosine = np.sin(u.P[0]), np.cos(u.P[0])
    return _taylor(u, _ends_of_wave(u.V, np.cos), (cosine, -sine, -0.5 * cosine), 1 / 6 + 1e-15, _LIBRARY)


def exp(u: Polynomial) -> Polynomial:
    """Return the exponential of u."""
    V, value = _near(np.exp(u.V)), np.exp(u.P[0])
    third = np.maximum(V[1], value) * (1 / 6 + 1e-13)
    return _taylor(u, V, (value, value, 0.5 * value), third, 2 * _LIBRARY * value)


def log(u: Polynomial) -> Polynomial:
    """Return the natural logarithm of u."""
    c = u.P[0]
    low = np.minimum(np.where(u.V[0] > 0, u.V[0], np.nan), c)
    value, slope = np.log(c), 1 / c
    third, error = (1 / 3 + 1e-13) / low**3, _LIBRARY * (1 + np.abs(value))
    return _taylor(u, _near(np.log(u.V), 1.0), (value, slope, -0.5 * slope * slope), third, error)


def atan(u: Polynomial) -> Polynomial:
    """Return the arc tangent; the absolute value of its third derivative is at most 2."""
    value, slope = np.arctan(u.P[0]), 1 / (1 + u.P[0] * u.P[0])
    terms = value, slope, -u.P[0] * slope * slope
    return _taylor(u, _near(np.arctan(u.V)), terms, 1 / 3 + 1e-15, _LIBRARY)


def ramp(u: Polynomial) -> Polynomial:
    """Return max(u, 0), for u from lo to hi: for any k from 0 to 1 it exceeds k u by 0 to max(-k lo, (1 - k) hi)."""
    low, high = u.V
    part = np.where(low >= 0, 1.0, np.where(high <= 0, 0.0, high / (high - low)))
    part = np.clip(part, 0.0, 1.0)
    half = np.where((low < 0) & (high > 0), 0.5 * np.maximum(-part * low, (1 - part) * high), 0.0)
    P = part * u.P
    P[0] += half
    return settled(u.on, P, part * u.s + half + (_ONCE * (u.size + half) + _TINY), np.maximum(u.V, 0.0))


def step(u: Polynomial) -> Polynomial:
    """Return 1 where u is not negative, and 0 elsewhere."""
    V = np.array([u.V[0] > 0, ~(u.V[1] < 0)], dtype=float)
    P = np.zeros_like(u.P)
    P[0] = 0.5 * (V[0] + V[1])
    return settled(u.on, P, 0.5 * (V[1] - V[0]) + 0.0 * u.s, V)


def _together(u: Polynomial, v: Polynomial) -> tuple[tuple[int, ...], FloatArray, FloatArray]:
    """Return the variables of two values, and the coefficients of both in these variables."""
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


def _out(V: FloatArray) -> FloatArray:
    """Return bounds (2, N) moved outwards by one double."""
    return np.nextafter(V, _ENDS)


def _near(V: FloatArray, least: float = 1e-280) -> FloatArray:
    """Return bounds (2, N) from a library, moved outwards by its relative error and at least by a minimum."""
    return V + _SIDES * (_LIBRARY * (np.abs(V) + least))


def _ends_of_product(U: FloatArray, V: FloatArray) -> FloatArray:
    """Return the ends of the product of two ranges."""
    one, other = U[0] * V, U[1] * V
    least, most = np.minimum(one, other), np.maximum(one, other)
    return _out(np.array([np.minimum(*least), np.maximum(*most)]))


def _ends_of_inverse(V: FloatArray) -> FloatArray:
    """Return the ends of the inverse of a range; NaN for a range that contains 0."""
    return _out(np.where((V[0] > 0) | (V[1] < 0), 1 / V[::-1], np.nan))


def _ends_of_wave(V: FloatArray, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the range of sine or cosine, from the Lipschitz constant 1 about the middle and the second derivative."""
    middle = 0.5 * (V[0] + V[1])
    radius = np.nextafter(np.maximum(V[1] - middle, middle - V[0]), np.inf)
    value = function(middle)
    steep = np.sqrt(np.maximum(1 - value * value, 0.0)) + 1e-7
    spread = np.minimum(radius, steep * radius + 0.5 * radius * radius) * (1 + 1e-12) + 4 * _LIBRARY
    return np.asarray(np.clip(value + _SIDES * spread, -1.0, 1.0))

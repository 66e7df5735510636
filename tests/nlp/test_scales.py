"""Enclosures of numbers from 1e-300 to 1e300 against 200-bit balls: in both engines, and in the checkers' arithmetics."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.certificate.boxes.bounding import NumpyEngine
from screwsynth.nlp.certificate.boxes.engines import KernelEngine, kernel
from screwsynth.nlp.certificate.boxes.firstpass import value_tape
from screwsynth.nlp.certificate.enclosing import enclosure
from screwsynth.nlp.certificate.enclosing.enclosure import Enclosures, enclose, midpoints
from screwsynth.nlp.certificate.enclosing.instructions import compile_tape
from screwsynth.nlp.certificate.enclosing.secondorder import Forms, enclose_second, monomials
from screwsynth.nlp.certificate.enclosing.tape import Tape
from screwsynth.nlp.certificate.paper.polynomialrules import PolynomialArithmetic
from screwsynth.nlp.certificate.paper.polynomials import middles, places
from screwsynth.nlp.certificate.paper.slopes import SlopeArithmetic
from screwsynth.nlp.certificate.standardform import StandardForm
from screwsynth.nlp.workspace.general.enclosing import Encloser

flint = pytest.importorskip("flint")
balls = pytest.importorskip("balls")

N = 3
#: Products, quotients, roots and others of numbers that may be very small or very large.
GRAPHS = {
    "product": lambda x, y, z: x * y,
    "products": lambda x, y, z: x * y * z,
    "square": lambda x, y, z: x**2,
    "squares": lambda x, y, z: x * x + y * y - z * z,
    "quotient": lambda x, y, z: x / y,
    "quotients": lambda x, y, z: (x * y) / (y + z),
    "inverse": lambda x, y, z: 1 / x,
    "root": lambda x, y, z: ca.sqrt(x) * y,
    "length": lambda x, y, z: ca.sqrt(x * x + y * y + z * z),
    "unit": lambda x, y, z: x / ca.sqrt(x * x + y * y),
    "work": lambda x, y, z: (x * y - z * z) ** 2 / (x * x + y * y),
    "logarithm": lambda x, y, z: ca.log(x) * y,
    "exponential": lambda x, y, z: ca.exp(x) - ca.exp(y),
    "waves": lambda x, y, z: ca.sin(x) * y + ca.cos(z),
    "angle": lambda x, y, z: ca.atan(x / y) * z,
    "pieces": lambda x, y, z: ca.fmax(x, y) * ca.fabs(z),
    "determinant": lambda x, y, z: (x * x - y * z) * (x * y - z * z) - (x * z - y * y) ** 2,
}


def function_of(name: str) -> ca.Function:
    x = SX.sym("x", N)
    return ca.Function("f", [x], [ca.densify(GRAPHS[name](*ca.vertsplit(x)))])


def boxes(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of all scales; the variables of half of them have one scale, and half hold positive numbers alone."""
    rng = np.random.default_rng(seed)
    power = rng.uniform(-300, 300, (N, count))
    alike = rng.random(count) < 0.7
    power[:, alike] = power[0, alike] + rng.uniform(-3, 3, (N, alike.sum()))
    # Where intermediate results are lost is not far from the roots of the ends of the range.
    near = rng.random(count) < 0.5
    power[:, near] *= 0.58
    centre = 10.0**power * np.where(rng.random((N, count)) < 0.5, 1.0, rng.choice([-1.0, 1.0], (N, count)))
    width = np.abs(centre) * rng.choice([0.0, 1e-9, 1e-3, 0.3, 0.99, 1 - 1e-9, 1.0, 2.0], (N, count))
    return centre - width, centre + width


def points_of(low: np.ndarray, high: np.ndarray, each: int, seed: int) -> np.ndarray:
    """Points (each, n, B) of boxes, most of them corners."""
    rng = np.random.default_rng(seed)
    share = rng.random((each, *low.shape))
    share = np.where(rng.random((each, 1, low.shape[1])) < 0.7, np.round(share), share)
    return np.clip(low + share * (high - low), low, high)


def arb(value: float) -> object:
    return flint.arb(float(value))


def steps(point: np.ndarray, centre: np.ndarray, radius: np.ndarray) -> list[object]:
    """Exact ``e_i`` of a point."""
    return [(arb(x) - arb(c)) / arb(r) if r > 0 else arb(0) for x, c, r in zip(point, centre, radius, strict=True)]


def first_order(forms: Enclosures, box: int, e: list[object]) -> tuple[object, object]:
    t = max((abs(each) for each in e), key=lambda ball: float(ball.mid()))
    value = sum((arb(a) * step for a, step in zip(forms.a[0, :, box], e, strict=True)), arb(forms.c[0, box]))
    s = arb(forms.s[0, box])
    return value + t * t * arb(forms.p[0, box]) - s, value + t * t * arb(forms.q[0, box]) + s


def second_order(forms: Forms, box: int, e: list[object]) -> tuple[object, object]:
    at = monomials(N)
    value = sum((arb(a) * step for a, step in zip(forms.a[0, :, box], e, strict=True)), arb(forms.c[0, box]))
    value += sum((arb(q) * e[i] * e[j] for q, i, j in zip(forms.Q[0, :, box], at.first, at.second, strict=True)), arb(0))
    s = arb(forms.s[0, box])
    return value + arb(forms.p[0, box]) - s, value + arb(forms.q[0, box]) + s


def in_c(function: ca.Function, low: np.ndarray, high: np.ndarray) -> object:
    """Middle, slopes and rest of the kernel's forms of first order."""
    x = SX.sym("x", N)
    return Encloser(x, function(x), "c")(low, high)


def bounds(function: ca.Function, low: np.ndarray, high: np.ndarray, engine: type) -> np.ndarray:
    """Lower and upper bounds (2, B) by the examination of boxes, with its models of second order."""
    x, ends = SX.sym("x", N), np.full(N, 1e308)
    nlp = formulate(load_case("paper-4.2-rotation"))
    found = []
    for sign in (-1.0, 1.0):
        form = StandardForm(nlp, x, -ends, ends, (sign * function(x),), (), (), 1.0, has_epigraph=False)
        chosen = NumpyEngine(form) if engine is NumpyEngine else KernelEngine(form, kernel(), 1)
        found.append(sign * chosen.examine(low, high, -np.inf).bound)
    return np.array(found)


def outside(ball: object, low: object, high: object) -> bool:
    return bool(ball < low) or bool(ball > high)


@pytest.mark.parametrize("name", GRAPHS)
def test_no_value_of_any_scale_is_outside(name: str) -> None:
    function = function_of(name)
    tape = compile_tape(function)
    low, high = boxes(len(name), 160)
    centre, radius = midpoints(low, high)
    with np.errstate(all="ignore"):
        one, two, c = enclose(tape, low, high), enclose_second(tape, low, high), in_c(function, low, high)
        numpy, kernels = (bounds(function, low, high, each) for each in (NumpyEngine, KernelEngine))
        slope, polynomial = SlopeArithmetic(function)(low, high)[0], PolynomialArithmetic(function)(low, high)[0]
    at, paper_centre, paper_radius = places(len(polynomial.on)), *middles(low, high)
    bad: dict[str, int] = {}
    finite: dict[str, int] = {}
    for point in points_of(low, high, 6, 1):
        for box in range(low.shape[1]):
            (ball,), (is_sharp,) = balls.decided_balls(tape, point[:, box])
            if not is_sharp or not ball.is_finite():
                continue
            e = steps(point[:, box], centre[:, box], radius[:, box])
            held: dict[str, tuple[object, object]] = {}
            if np.isfinite(one.s[0, box]):
                held["first"] = first_order(one, box, e)
                held["range of first"] = arb(one.lo[0, box]), arb(one.hi[0, box])
            if np.isfinite(two.s[0, box]):
                held["second"] = second_order(two, box, e)
                held["range of second"] = arb(two.lo[0, box]), arb(two.hi[0, box])
            if np.isfinite(c.r[box, 0]):
                value = sum((arb(a) * step for a, step in zip(c.a[box, 0], e, strict=True)), arb(c.c[box, 0]))
                held["kernel"] = value - arb(c.r[box, 0]), value + arb(c.r[box, 0])
            for key, each in (("NumPy's bound", numpy), ("kernel's bound", kernels)):
                if np.isfinite(each[:, box]).all():
                    held[key] = arb(each[0, box]), arb(each[1, box])
            if not np.isnan(slope.V[0][box]) and not np.isnan(slope.V[1][box]):
                held["slopes"] = arb(slope.V[0][box]), arb(slope.V[1][box])
            if not np.isnan(polynomial.s[box]):
                own = [steps(point[:, box], paper_centre[:, box], paper_radius[:, box])[i] for i in polynomial.on]
                P, d = polynomial.P[:, box], len(polynomial.on)
                value = sum((arb(P[1 + i]) * own[i] + arb(P[1 + d + i]) * own[i] ** 2 for i in range(d)), arb(P[0]))
                for p, i, j in zip(P[1 + 2 * d :], at.first, at.second, strict=True):
                    value += arb(p) * own[i] * own[j]
                held["polynomial"] = value - arb(polynomial.s[box]), value + arb(polynomial.s[box])
                held["range of polynomial"] = arb(polynomial.V[0][box]), arb(polynomial.V[1][box])
            for key, ends in held.items():
                finite[key] = finite.get(key, 0) + 1
                bad[key] = bad.get(key, 0) + outside(ball, *ends)
    wrong = {key: (count, finite[key]) for key, count in bad.items() if count}
    assert not wrong, wrong

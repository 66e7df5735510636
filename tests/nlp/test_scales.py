"""Enclosures of numbers from 1e-300 to 1e300 against 200-bit balls: of kernel, reference, and checkers."""

from collections import Counter
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from kernel_enclosures import enclose
from numpy_engine.bounding import NumpyEngine
from numpy_engine.intervals import midpoints
from numpy_engine.limb_models import NumpyLimbEngine
from numpy_engine.second_order import enclose_second, monomials

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.proof.boxes.engine import Engine, Verdict
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.polynomials import middles, places
from screwsynth.nlp.proof.enclosure.forms import Encloser
from screwsynth.nlp.proof.enclosure.tape import Tape, compile_tape
from screwsynth.nlp.proof.statement.standard_form import StandardForm

flint = pytest.importorskip("flint")
balls = pytest.importorskip("balls")

ENGINES = ("numpy", "c")
N = 3
#: Products, quotients, roots and others of numbers that may be very small or very large.
GRAPHS = {
    "product": lambda v: v[0] * v[1],
    "products": lambda v: v[0] * v[1] * v[2],
    "square": lambda v: v[0] ** 2,
    "squares": lambda v: v[0] * v[0] + v[1] * v[1] - v[2] * v[2],
    "quotient": lambda v: v[0] / v[1],
    "quotients": lambda v: (v[0] * v[1]) / (v[1] + v[2]),
    "inverse": lambda v: 1 / v[0],
    "root": lambda v: ca.sqrt(v[0]) * v[1],
    "length": ca.norm_2,
    "unit": lambda v: v[0] / ca.norm_2(v[:2]),
    "work": lambda v: (v[0] * v[1] - v[2] * v[2]) ** 2 / ca.sumsqr(v[:2]),
    "turned": lambda v: (v[0] * v[1] + v[2] ** 2) ** 2 / (v[0] * v[0] + v[1] * v[2] + v[1] ** 2),
    "arm": lambda v: v[0] ** 2 / v[1],
    "logarithm": lambda v: ca.log(v[0]) * v[1],
    "exponential": lambda v: ca.exp(v[0]) - ca.exp(v[1]),
    "waves": lambda v: ca.sin(v[0]) * v[1] + ca.cos(v[2]),
    "angle": lambda v: ca.atan(v[0] / v[1]) * v[2],
    "pieces": lambda v: ca.fmax(v[0], v[1]) * ca.fabs(v[2]),
    "determinant": lambda v: (v[0] ** 2 - v[1] * v[2]) * (v[0] * v[1] - v[2] ** 2) - (v[0] * v[2] - v[1] ** 2) ** 2,
}


def function_of(name: str) -> ca.Function:
    x = SX.sym("x", N)
    return ca.Function("f", [x], [ca.densify(GRAPHS[name](x))])


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


def linear(c: float, a: np.ndarray, e: list[object]) -> object:
    return sum((arb(each) * step for each, step in zip(a, e, strict=True)), arb(c))


def ball(value: object, low: float, high: float, s: float) -> tuple[object, object]:
    return value + arb(low) - arb(s), value + arb(high) + arb(s)


def form_of(function: ca.Function, sign: float) -> StandardForm:
    x, ends = SX.sym("x", N), np.full(N, 1e308)
    nlp = formulate(load_case("paper-4.2-rotation"))
    return StandardForm(nlp, x, -ends, ends, (sign * function(x),), ())


def engine_of(form: StandardForm, engine: str) -> Engine | NumpyEngine:
    return NumpyEngine(form) if engine == "numpy" else Engine(form, 1)


def bounds(function: ca.Function, low: np.ndarray, high: np.ndarray, engine: str) -> np.ndarray:
    """Lower and upper bounds (2, B) by the examination of boxes, with its models of second order."""
    found = [
        sign * engine_of(form_of(function, sign), engine).examine(low, high, -np.inf).bound for sign in (-1.0, 1.0)
    ]
    return np.array(found)


#: Returns the ends that hold the value at a point, from the number of its box and the point; None where there are none.
Ends = Callable[[int, np.ndarray], tuple[object, object] | None]


def of_search(function: ca.Function, low: np.ndarray, high: np.ndarray) -> dict[str, Ends]:
    """Enclosures of the search: forms of first and second order, and bounds of kernel and reference."""
    tape, at = compile_tape(function), monomials(N)
    centre, radius = midpoints(low, high)
    one, two = enclose(tape, low, high), enclose_second(tape, low, high)
    x = SX.sym("x", N)
    c = Encloser(x, function(x))(low, high)
    numbers = {engine: bounds(function, low, high, engine) for engine in ENGINES}

    def first(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if not np.isfinite(one.s[0, k]):
            return None
        e = steps(point, centre[:, k], radius[:, k])
        t = max((abs(each) for each in e), key=lambda each: float(each.mid()))
        low, high = arb(one.p[0, k]) * t * t, arb(one.q[0, k]) * t * t
        value, s = linear(one.c[0, k], one.a[0, :, k], e), arb(one.s[0, k])
        return value + low - s, value + high + s

    def second(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if not np.isfinite(two.s[0, k]):
            return None
        e = steps(point, centre[:, k], radius[:, k])
        value = linear(two.c[0, k], two.a[0, :, k], e)
        value += linear(0.0, two.Q[0, :, k], [e[i] * e[j] for i, j in zip(at.first, at.second, strict=True)])
        return ball(value, two.p[0, k], two.q[0, k], two.s[0, k])

    def encloser(k: int, point: np.ndarray) -> tuple[object, object] | None:
        value = linear(c.c[k, 0], c.a[k, 0], steps(point, centre[:, k], radius[:, k])) if c.r[k, 0] < np.inf else None
        return None if value is None else ball(value, 0.0, 0.0, c.r[k, 0])

    found: dict[str, Ends] = {"first order": first, "second order": second, "encloser": encloser}
    for name, each in (("first", one), ("second", two)):
        found[f"range of {name} order"] = lambda k, _, each=each: (arb(each.lo[0, k]), arb(each.hi[0, k]))
    for name, ends in numbers.items():
        found[f"bound in {name}"] = lambda k, _, ends=ends: (arb(ends[0, k]), arb(ends[1, k]))
    return found


def of_checker(function: ca.Function, low: np.ndarray, high: np.ndarray) -> dict[str, Ends]:
    """Enclosures of the checker: polynomials with a ball; NaN proves nothing."""
    (value,) = PolynomialArithmetic(function)(low, high)
    at, on, (centre, radius) = places(len(value.on)), list(value.on), middles(low, high)

    def polynomial(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if np.isnan(value.s[k]):
            return None
        e, P = steps(point[on], centre[on, k], radius[on, k]), value.P[:, k]
        total = linear(P[0], P[at.linear], e) + linear(0.0, P[at.squares], [each * each for each in e])
        total += linear(0.0, P[at.products], [e[i] * e[j] for i, j in zip(at.first, at.second, strict=True)])
        return ball(total, 0.0, 0.0, value.s[k])

    def interval(k: int, _: np.ndarray) -> tuple[object, object] | None:
        return None if np.isnan(value.s[k]) else (arb(value.V[0][k]), arb(value.V[1][k]))

    return {"polynomial": polynomial, "range of polynomial": interval}


@pytest.mark.parametrize("name", GRAPHS)
def test_no_value_of_any_scale_is_outside(name: str) -> None:
    function = function_of(name)
    tape = compile_tape(function)
    low, high = boxes(len(name), 70)
    with np.errstate(all="ignore"):
        every = of_search(function, low, high) | of_checker(function, low, high)
    bad, held = Counter[str](), Counter[str]()
    for point in points_of(low, high, 5, 1):
        for k in range(low.shape[1]):
            (exact,), (is_sharp,) = balls.decided_balls(tape, point[:, k])
            if not is_sharp or not exact.is_finite():
                continue
            for key, each in every.items():
                ends = each(k, point[:, k])
                held[key] += ends is not None
                bad[key] += ends is not None and (bool(exact < ends[0]) or bool(exact > ends[1]))
    assert not +bad
    assert min(held.values()) > 20


def highest(tape: Tape, points: np.ndarray, sign: float) -> tuple[np.ndarray, float]:
    """The point (n,) among points (K, n) with the largest value times a sign, and a level just below; NaN without."""
    found = [(balls.decided_balls(tape, point), point) for point in points]
    known = [(sign * each[0], point) for (each, is_sharp), point in found if is_sharp[0] and each[0].is_finite()]
    best = known[0] if known else (flint.arb("nan"), points[0])
    for each in known:
        best = each if each[0] > best[0] else best
    return best[1], float(np.nextafter(float(best[0].mid()), -np.inf))


def test_no_point_of_any_scale_that_reaches_a_level_is_cut_off() -> None:
    cuts = 0
    for name in ("product", "square", "quotients", "length", "work", "determinant"):
        function = function_of(name)
        tape = compile_tape(function)
        low, high = boxes(len(name) + 50, 16)
        points = points_of(low, high, 5, 2)
        for sign in (-1.0, 1.0):
            reached = [highest(tape, points[:, :, k], sign) for k in range(low.shape[1])]
            for engine in (engine_of(form_of(function, sign), each) for each in ENGINES):
                for k, (point, level) in enumerate(reached):
                    if not np.isfinite(level):
                        continue
                    box = low[:, k : k + 1], high[:, k : k + 1]
                    found = engine.examine(*box, level)
                    assert found.verdict[0] in (Verdict.OPEN, Verdict.MONOTONE)
                    if found.verdict[0] == Verdict.OPEN:
                        assert ((found.lower[:, 0] <= point) & (point <= found.upper[:, 0])).all()
                        cuts += bool((found.lower > box[0]).any() or (found.upper < box[1]).any())
    assert cuts > 5


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["work", "turned", "arm"])
def test_models_of_squared_quotients_hold_at_every_scale(name: str, engine: str) -> None:
    """In the search by limbs; polynomials of the same quotients are among the enclosures of the checkers."""
    function = function_of(name)
    tape = compile_tape(function)
    low, high = boxes(len(name) + 90, 120)
    held = 0
    for sign in (-1.0, 1.0):
        form = form_of(function, sign)
        limbs = Engine(form, 1, 0) if engine == "c" else NumpyLimbEngine(NumpyEngine(form, apart=True), 0)
        found = limbs.limb_models(low, high)
        with np.errstate(all="ignore"):
            bound = np.where(found.defined, np.fmin(found.L.bound(), found.bound), np.inf)
        for point in points_of(low, high, 4, 3):
            for k in range(low.shape[1]):
                (exact,), (is_sharp,) = balls.decided_balls(tape, point[:, k])
                if is_sharp and exact.is_finite():
                    held += np.isfinite(bound[k])
                    assert not (np.isfinite(bound[k]) and bool(sign * exact > arb(bound[k])))
    assert held > 100

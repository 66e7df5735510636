"""Enclosures against 200-bit balls: random graphs, models, numbers of all scales, squared quotients."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_enclosures import enclose
from limb_cases import machine, poses, separated
from numpy_engine import first_order, intervals, univariate
from numpy_engine import squared_quotients as quotients
from numpy_engine.bounding import NumpyEngine
from numpy_engine.first_order import Enclosures
from numpy_engine.intervals import midpoints
from numpy_engine.limb_models import NumpyLimbEngine
from numpy_engine.quadratic_models import GradientModel
from numpy_engine.second_order import enclose_second, monomials
from random_graphs import random_boxes, random_function

from screwsynth.nlp import UncoveredError, formulate, load_case
from screwsynth.nlp.proof.boxes.engine import BoxState, Engine, search_tape
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.polynomials import middles, places
from screwsynth.nlp.proof.enclosure.forms import Encloser
from screwsynth.nlp.proof.enclosure.squared_quotients import search_rows
from screwsynth.nlp.proof.enclosure.tape import Op, Tape, compile_tape
from screwsynth.nlp.proof.statement.form import without_ties
from screwsynth.nlp.proof.statement.limb_separation import terms_of
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form

flint = pytest.importorskip("flint")
balls = pytest.importorskip("balls")

Enclose = Callable[[Tape, np.ndarray, np.ndarray], Enclosures]


def count_violations(
    tape: Tape, lower_ends: np.ndarray, upper_ends: np.ndarray, points: int, seed: int, by: Enclose = enclose
) -> tuple[int, int]:
    rng = np.random.default_rng(seed)
    forms = by(tape, lower_ends, upper_ends)
    centre, radius = midpoints(lower_ends, upper_ends)
    bad = checks = 0
    for box in range(lower_ends.shape[1]):
        for k in range(points):
            share = rng.random(len(lower_ends)) if k else rng.integers(0, 2, len(lower_ends))
            point = lower_ends[:, box] + share * (upper_ends[:, box] - lower_ends[:, box])
            point = np.clip(point, lower_ends[:, box], upper_ends[:, box])
            more, made = balls.violations(tape, forms, box, centre[:, box], radius[:, box], point)
            bad, checks = bad + more, checks + made
    return bad, checks


@given(seed=st.integers(0, 2**31), by=st.sampled_from([enclose, first_order.enclose]))
@settings(max_examples=60, deadline=None)
def test_random_graphs_stay_inside_their_enclosures(seed: int, by: Enclose) -> None:
    """Those of the kernel, and those of the reference."""
    tape = compile_tape(random_function(seed, 24))
    bad, checks = count_violations(tape, *random_boxes(seed + 1, 14), points=2, seed=seed, by=by)
    assert bad == 0
    assert checks == 14 * 2 * 2 * 24


MODELS = ("paper-4.1-helical", "paper-4.1-helical-axis-z", "paper-4.2-rotation", "paper-4.3", "paper-4.4-max")


def count_on_models(boxes: int, widths: tuple[float, float], by: Enclose = enclose) -> tuple[int, int]:
    bad = checks = 0
    for name in MODELS:
        form = standard_form(formulate(load_case(name)))
        rng = np.random.default_rng(7)
        room = (form.upper - form.lower)[:, None]
        width = 10.0 ** rng.uniform(*widths, size=(form.n, boxes))
        low = form.lower[:, None] + room * rng.random((form.n, boxes)) * (1 - width)
        high = np.minimum(low + room * width, form.upper[:, None])
        more, made = count_violations(search_tape(form), low, high, 2, 11, by)
        bad, checks = bad + more, checks + made
    return bad, checks


@pytest.mark.slow
def test_models_stay_inside_their_enclosures_and_the_checks_are_many() -> None:
    bad, checks = count_on_models(200, (-12, -0.5))
    assert bad == 0
    assert checks > 100_000


def test_without_the_rounding_terms_violations_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (intervals, univariate, first_order):
        monkeypatch.setattr(module, "ULP", 0.0)
        monkeypatch.setattr(module, "TINY", 0.0)
    monkeypatch.setattr(univariate, "_LIBRARY_ERROR", 0.0)
    bad, checks = count_on_models(6, (-14, -9), first_order.enclose)
    assert bad > checks / 50


def test_every_operation_occurs_in_the_random_graphs() -> None:
    met = {int(op) for seed in range(20) for op in compile_tape(random_function(seed, 24)).op}
    assert met == {int(op) for op in Op}


@pytest.mark.parametrize(
    ("operation", "words"),
    [(each, f"'{each.__name__}'") for each in (ca.ceil, ca.erf, ca.floor, ca.sinh)]
    + [(lambda x, power=power: x**power, "the power") for power in (0.3, 1e3)],
)
def test_what_has_no_rule_is_refused_by_name(operation: Callable[[ca.SX], ca.SX], words: str) -> None:
    x = ca.SX.sym("x", 1)
    with pytest.raises(UncoveredError, match=words):
        compile_tape(ca.Function("f", [x], [operation(x)]))


def test_no_expression_has_no_bounds() -> None:
    """The terms of second order of a robot whose rows change in proportion to errors are no expression at all."""
    z = ca.SX.sym("z", 2)
    found = Encloser(z, ca.SX(0, 1))(-np.ones((2, 3)), np.ones((2, 3)))
    assert (found.c.shape, found.r.shape) == ((3, 0), (3, 0))


@pytest.mark.parametrize("bad", ["sqrt(x - 2)", "1 / x", "log(x)"])
def test_what_may_be_undefined_is_poisoned_for_good(bad: str) -> None:
    x = ca.SX.sym("x", 1)
    inner = eval(bad, {"x": x, "sqrt": ca.sqrt, "log": ca.log})  # noqa: S307 - the three above
    for outer in (ca.sin(inner), ca.cos(inner) ** 2, ca.atan(inner), inner * (x + 3), ca.exp(ca.sin(inner))):
        forms = enclose(compile_tape(ca.Function("f", [x], [outer])), np.array([[-1.0]]), np.array([[1.0]]))
        assert np.isinf([forms.s[0, 0], forms.lo[0, 0], forms.hi[0, 0]]).all()


def test_derivatives_of_the_nearest_points_of_segments_are_enclosed_where_pieces_meet() -> None:
    """The derivative that CasADi writes divides by the sum of two comparisons, whose interval holds 0."""
    x = ca.SX.sym("x", 4)
    clamped = ca.fmax(0, ca.fmin(1, x[0] * x[1] + x[2]))
    value = (clamped * x[3] - 1) ** 2 + ca.fmax(x[0], x[2])
    slopes = ca.jacobian(value, x)
    written = without_ties(slopes, x)
    assert "/" not in str(written)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(4, 500))
    one, other = (ca.Function("f", [x], [ca.densify(each)]).map(500)(points).full() for each in (slopes, written))
    np.testing.assert_array_equal(one, other)
    tape = compile_tape(ca.Function("f", [x], [ca.densify(written).T]))
    forms = enclose(tape, np.full((4, 1), -1.0), np.ones((4, 1)))
    assert np.isfinite(forms.lo).all()
    assert np.isfinite(forms.hi).all()
    inside = np.abs(points).max(axis=0) <= 1
    at = other.reshape(4, 500, order="F")[:, inside]
    assert (forms.lo <= at).all()
    assert (at <= forms.hi).all()


ENGINE_NAMES = ("numpy", "c")
N = 3
#: Products, quotients, roots and others of numbers that may be very small or very large.
GRAPHS = {
    "product": lambda v: v[0] * v[1], "products": lambda v: v[0] * v[1] * v[2], "square": lambda v: v[0] ** 2,
    "squares": lambda v: v[0] * v[0] + v[1] * v[1] - v[2] * v[2], "quotient": lambda v: v[0] / v[1],
    "quotients": lambda v: (v[0] * v[1]) / (v[1] + v[2]), "inverse": lambda v: 1 / v[0],
    "root": lambda v: ca.sqrt(v[0]) * v[1], "length": ca.norm_2, "unit": lambda v: v[0] / ca.norm_2(v[:2]),
    "work": lambda v: (v[0] * v[1] - v[2] * v[2]) ** 2 / ca.sumsqr(v[:2]),
    "turned": lambda v: (v[0] * v[1] + v[2] ** 2) ** 2 / (v[0] * v[0] + v[1] * v[2] + v[1] ** 2),
    "arm": lambda v: v[0] ** 2 / v[1], "logarithm": lambda v: ca.log(v[0]) * v[1],
    "exponential": lambda v: ca.exp(v[0]) - ca.exp(v[1]), "waves": lambda v: ca.sin(v[0]) * v[1] + ca.cos(v[2]),
    "angle": lambda v: ca.atan(v[0] / v[1]) * v[2], "pieces": lambda v: ca.fmax(v[0], v[1]) * ca.fabs(v[2]),
    "determinant": lambda v: (v[0] ** 2 - v[1] * v[2]) * (v[0] * v[1] - v[2] ** 2) - (v[0] * v[2] - v[1] ** 2) ** 2,
}  # fmt: skip


def function_of(name: str) -> ca.Function:
    x = SX.sym("x", N)
    return ca.Function("f", [x], [ca.densify(GRAPHS[name](x))])


def scaled_boxes(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
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


def scaled_points(low: np.ndarray, high: np.ndarray, each: int, seed: int) -> np.ndarray:
    """Points (each, n, B) of boxes, most of them corners."""
    rng = np.random.default_rng(seed)
    share = rng.random((each, *low.shape))
    share = np.where(rng.random((each, 1, low.shape[1])) < 0.7, np.round(share), share)
    return np.clip(low + share * (high - low), low, high)


def ball(value: object, low: float, high: float, s: float) -> tuple[object, object]:
    return value + balls.arb(low) - balls.arb(s), value + balls.arb(high) + balls.arb(s)


def form_of(function: ca.Function, sign: float) -> StandardForm:
    x, ends = SX.sym("x", N), np.full(N, 1e308)
    nlp = formulate(load_case("paper-4.2-rotation"))
    return StandardForm(nlp, x, -ends, ends, (sign * function(x),), ())


def engine_of(form: StandardForm, engine: str) -> Engine | NumpyEngine:
    return NumpyEngine(form) if engine == "numpy" else Engine(form, 1)


def bounds(function: ca.Function, low: np.ndarray, high: np.ndarray, engine: str) -> np.ndarray:
    """Lower and upper bounds (2, B) by the examination of boxes, with its models of second order."""
    engines = {sign: engine_of(form_of(function, sign), engine) for sign in (-1.0, 1.0)}
    return np.array([sign * each.examine(low, high, -np.inf).bound for sign, each in engines.items()])


#: Returns the ends that hold the value at a point, from the number of its box and the point; None where there are none.
Ends = Callable[[int, np.ndarray], tuple[object, object] | None]


def of_search(function: ca.Function, low: np.ndarray, high: np.ndarray) -> dict[str, Ends]:
    """Enclosures of the search: forms of first and second order, and bounds of kernel and reference."""
    tape, at = compile_tape(function), monomials(N)
    centre, radius = midpoints(low, high)
    one, two = enclose(tape, low, high), enclose_second(tape, low, high)
    x = SX.sym("x", N)
    c = Encloser(x, function(x))(low, high)
    numbers = {engine: bounds(function, low, high, engine) for engine in ENGINE_NAMES}

    def first(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if not np.isfinite(one.s[0, k]):
            return None
        e = balls.steps(point, centre[:, k], radius[:, k])
        t = max((abs(each) for each in e), key=lambda each: float(each.mid()))
        low, high = balls.arb(one.p[0, k]) * t * t, balls.arb(one.q[0, k]) * t * t
        value, s = balls.linear(one.c[0, k], one.a[0, :, k], e), balls.arb(one.s[0, k])
        return value + low - s, value + high + s

    def second(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if not np.isfinite(two.s[0, k]):
            return None
        e = balls.steps(point, centre[:, k], radius[:, k])
        value = balls.linear(two.c[0, k], two.a[0, :, k], e)
        value += balls.linear(0.0, two.Q[0, :, k], [e[i] * e[j] for i, j in zip(at.first, at.second, strict=True)])
        return ball(value, two.p[0, k], two.q[0, k], two.s[0, k])

    def encloser(k: int, point: np.ndarray) -> tuple[object, object] | None:
        value = (
            balls.linear(c.c[k, 0], c.a[k, 0], balls.steps(point, centre[:, k], radius[:, k]))
            if c.r[k, 0] < np.inf
            else None
        )
        return None if value is None else ball(value, 0.0, 0.0, c.r[k, 0])

    found: dict[str, Ends] = {"first order": first, "second order": second, "encloser": encloser}
    for name, each in (("first", one), ("second", two)):
        found[f"range of {name} order"] = lambda k, _, each=each: (balls.arb(each.lo[0, k]), balls.arb(each.hi[0, k]))
    for name, ends in numbers.items():
        found[f"bound in {name}"] = lambda k, _, ends=ends: (balls.arb(ends[0, k]), balls.arb(ends[1, k]))
    return found


def of_checker(function: ca.Function, low: np.ndarray, high: np.ndarray) -> dict[str, Ends]:
    """Enclosures of the checker: polynomials with a ball; NaN proves nothing."""
    (value,) = PolynomialArithmetic(function)(low, high)
    at, on, (centre, radius) = places(len(value.on)), list(value.on), middles(low, high)

    def polynomial(k: int, point: np.ndarray) -> tuple[object, object] | None:
        if np.isnan(value.s[k]):
            return None
        e, P = balls.steps(point[on], centre[on, k], radius[on, k]), value.P[:, k]
        total = balls.linear(P[0], P[at.linear], e) + balls.linear(0.0, P[at.squares], [each * each for each in e])
        total += balls.linear(0.0, P[at.products], [e[i] * e[j] for i, j in zip(at.first, at.second, strict=True)])
        return ball(total, 0.0, 0.0, value.s[k])

    def interval(k: int, _: np.ndarray) -> tuple[object, object] | None:
        return None if np.isnan(value.s[k]) else (balls.arb(value.V[0][k]), balls.arb(value.V[1][k]))

    return {"polynomial": polynomial, "range of polynomial": interval}


@pytest.mark.parametrize("name", GRAPHS)
def test_no_value_of_any_scale_is_outside(name: str) -> None:
    function = function_of(name)
    tape = compile_tape(function)
    low, high = scaled_boxes(len(name), 70)
    with np.errstate(all="ignore"):
        every = of_search(function, low, high) | of_checker(function, low, high)
    bad, held = Counter[str](), Counter[str]()
    for point in scaled_points(low, high, 5, 1):
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
        low, high = scaled_boxes(len(name) + 50, 16)
        points = scaled_points(low, high, 5, 2)
        for sign in (-1.0, 1.0):
            reached = [highest(tape, points[:, :, k], sign) for k in range(low.shape[1])]
            for engine in (engine_of(form_of(function, sign), each) for each in ENGINE_NAMES):
                for k, (point, level) in enumerate(reached):
                    if not np.isfinite(level):
                        continue
                    box = low[:, k : k + 1], high[:, k : k + 1]
                    found = engine.examine(*box, level)
                    assert found.verdict[0] in (BoxState.OPEN, BoxState.MONOTONE)
                    if found.verdict[0] == BoxState.OPEN:
                        assert ((found.lower[:, 0] <= point) & (point <= found.upper[:, 0])).all()
                        cuts += bool((found.lower > box[0]).any() or (found.upper < box[1]).any())
    assert cuts > 5


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("name", ["work", "turned", "arm"])
def test_models_of_squared_quotients_hold_at_every_scale(name: str, engine: str) -> None:
    """In the search by limbs; polynomials of the same quotients are among the enclosures of the checkers."""
    function = function_of(name)
    tape = compile_tape(function)
    low, high = scaled_boxes(len(name) + 90, 120)
    held = 0
    for sign in (-1.0, 1.0):
        form = form_of(function, sign)
        limbs = Engine(form, 1, 0) if engine == "c" else NumpyLimbEngine(NumpyEngine(form, apart=True), 0)
        found = limbs.limb_models(low, high)
        with np.errstate(all="ignore"):
            bound = np.where(found.defined, np.fmin(found.L.bound(), found.bound), np.inf)
        for point in scaled_points(low, high, 4, 3):
            for k in range(low.shape[1]):
                (exact,), (is_sharp,) = balls.decided_balls(tape, point[:, k])
                if is_sharp and exact.is_finite():
                    held += np.isfinite(bound[k])
                    assert not (np.isfinite(bound[k]) and bool(sign * exact > balls.arb(bound[k])))
    assert held > 100


ENGINES = {
    "c": lambda form: Engine(form, 1, 0),
    "numpy": lambda form: NumpyLimbEngine(NumpyEngine(form, apart=True), 0),
}


def free_of_limits(form: StandardForm, sign: int = 1) -> StandardForm:
    """The functions of a form alone, or minus them."""
    return replace(form, functions=tuple(sign * each for each in form.functions), conditions=())


def forms() -> list[StandardForm]:
    """Sums of six quotients, one quotient with joint coordinates of its own, a mean over poses; maxima and minima."""
    helical = free_of_limits(standard_form(formulate(load_case("paper-4.1-helical"))))
    limb = separated(machine(2.0, pose_is_free=True))[1].limbs[2].form
    mean = free_of_limits(standard_form(formulate(poses(2))))
    axes = free_of_limits(separated(load_case("paper-4.4-max"))[1].limbs[0].form)
    every = [helical, limb, mean, axes]
    return [free_of_limits(form, sign) for form in every for sign in (1, -1)]


def boxes_of(form: StandardForm, count: int, seed: int, widths: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    room = (form.upper - form.lower)[:, None]
    size = room * 10.0 ** rng.uniform(*widths, (1, count)) * (rng.random((form.n, count)) > 0.1)
    low = form.lower[:, None] + rng.random((form.n, count)) * (room - size)
    return low, np.minimum(low + size, form.upper[:, None])


def points_of(low: np.ndarray, high: np.ndarray, each: int, seed: int) -> np.ndarray:
    """Points (n, B, each) of boxes, half of them corners."""
    rng = np.random.default_rng(seed)
    share = rng.random((*low.shape, each))
    share[:, :, ::2] = np.round(share[:, :, ::2])
    return np.clip(low[:, :, None] + share * (high - low)[:, :, None], low[:, :, None], high[:, :, None])


def quotient_violations(
    form: StandardForm, engine: str, seed: int = 0, widths: tuple[float, float] = (-3, -0.1)
) -> int:
    """Points of random boxes above the bound, centres below their value, and gradients outside of their ends."""
    low, high = boxes_of(form, 60, seed, widths)
    points = points_of(low, high, 30, seed + 1)
    found = ENGINES[engine](form).limb_models(low, high)
    with np.errstate(all="ignore"):
        bound = np.where(found.defined, np.fmin(found.L.bound(), found.bound), np.inf)
    flat = points.reshape(form.n, -1)
    f = ca.Function("f", [form.x], [form.functions[0], ca.gradient(form.functions[0], form.x)])
    values, slopes = (np.array(each) for each in f(flat))
    values, slopes = values.reshape(points.shape[1:]), slopes.reshape(points.shape)
    slack = 1e-11 * (np.abs(values).max() + 1)
    wrong = int((values > bound[:, None] + slack).sum())
    wrong += int((np.array(f(midpoints(low, high).centre)[0]).ravel() < found.value - slack).sum())
    # Only what matters has its gradient enclosed.
    box, is_wide = midpoints(low, high), (high > low)[:, :, None]
    with np.errstate(all="ignore"):
        for least in (None, np.median(values, axis=1)):
            model = NumpyEngine(form, apart=True).model(low, high, box.radius, least)
            matters = np.isfinite(values) & (True if least is None else values >= least[:, None])
            inside = is_wide & matters & (model.value.s[0] < np.inf)[:, None]
            room = 1e-9 * (np.abs(slopes) + 1)
            least_slopes, most_slopes = (each[0][:, :, None] for each in (model.gradient_lo, model.gradient_hi))
            outside = (slopes < least_slopes - room) | (slopes > most_slopes + room)
            wrong += int((outside & inside).sum())
    return wrong


@pytest.mark.parametrize("engine", ENGINES)
def test_no_value_and_no_gradient_is_outside(engine: str) -> None:
    for form in forms():
        assert len(search_rows(form, apart=True).quotients) >= 1
        assert quotient_violations(form, engine) == 0


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("_gradient_factor", lambda each, *_: (2 * each.N.b - each.hi * each.D.b, 2 * each.N.b - each.lo * each.D.b)),
        ("_product", lambda low, high, a, b, _: (low * a, high * b)),
    ],
    ids=["a gradient without what is curved", "a product of lower ends alone"],
)
def test_a_wrong_rule_is_caught(monkeypatch: pytest.MonkeyPatch, name: str, wrong: object) -> None:
    monkeypatch.setattr(quotients, name, wrong)
    assert any(quotient_violations(form, "numpy") for form in forms())


def test_a_bound_that_forgets_the_rest_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The denominator is taken at the centre: then the square is too small wherever it is less."""
    row = quotients._row

    def careless(model: GradientModel, r: int) -> object:
        found = row(model, r)
        return found._replace(lo=found.c, hi=found.c)

    monkeypatch.setattr(quotients, "_row", careless)
    assert any(quotient_violations(form, "numpy") for form in forms())


@pytest.mark.parametrize("engine", ENGINES)
def test_tiny_boxes_hold_their_exact_values(engine: str) -> None:
    """Rounding: on boxes down to points, corners in 200-bit balls are not above the bound."""
    for form in forms()[:4]:
        low, high = boxes_of(form, 25, 3, (-15, -9))
        points = points_of(low, high, 2, 4)
        with np.errstate(all="ignore"):
            bound = ENGINES[engine](form).limb_models(low, high).L.bound()
        rows = search_rows(form, apart=True)
        tape = search_tape(form, rows)
        for box in range(low.shape[1]):
            for k in range(points.shape[2]):
                out = balls.in_balls(tape, points[:, box, k])
                value = out[0]
                for q, quotient in enumerate(rows.quotients):
                    N, D = out[1 + 2 * q], out[2 + 2 * q]
                    value += quotient.sign * N * N / D
                assert not value > flint.arb(float(bound[box]))


def test_terms_of_every_form_are_taken_apart() -> None:
    x = ca.SX.sym("x", 2)
    form = free_of_limits(standard_form(formulate(load_case("paper-4.2-rotation"))))
    square = x[0] ** 2 / (1 + x[1] ** 2)
    function = 3 * (square - x[0]) + 2 * (-square) + x[1] ** 2 / 4
    apart = search_rows(replace(form, x=x, functions=(function,)), apart=True)
    assert [each.sign for each in apart.quotients] == [1, -1]
    rest = ca.Function("rest", [x], [apart.expressions[0]])
    whole = ca.Function("whole", [x], [function])
    for point in ([0.3, -2.0], [5.0, 0.1]):
        parts = sum(each.sign * float(ca.Function("q", [x], [each.N**2 / each.D])(point)) for each in apart.quotients)
        assert float(rest(point)) + parts == pytest.approx(float(whole(point)), rel=1e-14)
    assert len(terms_of(function)) == 4
    assert not search_rows(form, apart=False).quotients

"""Polynomials of the checker against 200-bit balls, undefined values; tangents to the squares of a minimum."""

import itertools
from dataclasses import replace
from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
from limb_cases import poses
from numpy_engine import tangent_bounds
from numpy_engine.bounding import NumpyEngine
from numpy_engine.intervals import midpoints
from numpy_engine.second_order import Forms, enclose_second, monomials
from numpy_engine.tangent_bounds import tangent_forms
from random_graphs import N, random_function

from screwsynth.models import robot_function
from screwsynth.nlp import Case, Search, Sense, Task, UncoveredError, formulate, load_case, solve_program
from screwsynth.nlp.case.pose import Free, Rotation
from screwsynth.nlp.proof.boxes.engine import BoxState, Engine, value_tape
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.polymodels import forms_of, polynomial_sum, reaching_part
from screwsynth.nlp.proof.checker.polynomials import Polynomial, middles, places
from screwsynth.nlp.proof.checker.premises import program_of
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.enclosure.squared_quotients import tangent_rows
from screwsynth.nlp.proof.enclosure.tape import compile_tape
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form
from screwsynth.nlp.solver.certified import certify, proof_of

balls = pytest.importorskip("balls")


def is_outside(each: Polynomial, box: int, ball: object, e: list[object]) -> tuple[bool, bool]:
    """Whether an exact value is surely outside of the polynomial's ball, or of the range."""
    at, d = places(len(each.on)), len(each.on)
    k = 0 if each.P.shape[1] == 1 else box
    own, P = [e[i] for i in each.on], each.P[:, k]
    value = balls.linear(P[0], P[1 : 1 + 2 * d], [*own, *(one * one for one in own)])
    value += balls.linear(0.0, P[1 + 2 * d :], [own[i] * own[j] for i, j in zip(at.first, at.second, strict=True)])
    low, high = (balls.arb(each.V[side][k]) for side in (0, 1))
    return bool(abs(ball - value) > balls.arb(each.s[k])), bool(ball < low or ball > high)  # type: ignore[operator]


def violations(function: ca.Function, low: np.ndarray, high: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Numbers of violations of balls, of ranges and of undefined values, and of what was checked, at random points."""
    tape, values = compile_tape(function), PolynomialArithmetic(function)(low, high)
    centre, radius = middles(low, high)
    counts = np.zeros(4, dtype=int)
    for box in range(low.shape[1]):
        share = rng.random(len(low)) if box % 2 else rng.integers(0, 2, len(low))
        point = np.clip(low[:, box] + share * (high[:, box] - low[:, box]), low[:, box], high[:, box])
        e = balls.steps(point, centre[:, box], radius[:, box])
        exact, sharp = balls.decided_balls(tape, point)
        for each, ball, is_sharp in zip(values, exact, sharp, strict=True):
            k = 0 if each.P.shape[1] == 1 else box
            if np.isnan(each.s[k]):
                counts += (0, 0, not np.isnan(each.V[0][k]), 0)
            elif not ball.is_finite():
                counts += (0, 0, is_sharp, 1)
            else:
                counts += (*is_outside(each, box, ball, e), 0, 1)
    return counts


def test_values_of_random_graphs_and_of_robots_stay_in_their_polynomials() -> None:
    """Boxes of every size from points to units, some of them with sides of no width."""
    counts = np.zeros(4, dtype=int)
    rng = np.random.default_rng(2)
    for _ in range(40):
        centre = rng.normal(size=(N, 12)) * rng.choice([0.3, 1.0, 3.0], size=(1, 12))
        width = 10.0 ** rng.uniform(-12, 0, size=(N, 12)) * (rng.random((N, 12)) > 0.15)
        counts += violations(random_function(rng, 24), centre - width, centre + width, rng)
    for name in ("paper-4.1-helical", "paper-4.4-max"):
        form = standard_form(formulate(load_case(name)))
        function = ca.Function("robot", [form.x], [form.expressions, form.jacobian])
        whole = (form.upper - form.lower)[:, None]
        centre = form.lower[:, None] + rng.random((form.n, 6)) * whole
        width = 10.0 ** rng.uniform(-9, -1, size=(1, 6)) * whole
        counts += violations(function, centre - width, centre + width, rng)
    assert counts[:3].tolist() == [0, 0, 0]
    assert counts[3] > 4000


@pytest.mark.parametrize("bad", ["sqrt(x - 2)", "1 / x", "log(x)"])
def test_what_may_be_undefined_proves_nothing(bad: str) -> None:
    x = ca.SX.sym("x", 1)
    inner = eval(bad, {"x": x, "sqrt": ca.sqrt, "log": ca.log})  # noqa: S307 - the three above
    outer = [ca.sin(inner), ca.cos(inner) ** 2, ca.atan(inner), inner * (x + 3), ca.exp(ca.sin(inner)), inner <= x]
    outer += [ca.fmax(inner, 0), ca.fmin(inner, x), inner + 2, -inner, 0.5 * inner, 2 - inner]
    function = ca.Function("f", [x], [ca.vertcat(*outer)])
    for each in PolynomialArithmetic(function)(np.array([[-1.0]]), np.array([[1.0]])):
        assert np.isnan([each.s[0], each.V[0][0], each.V[1][0]]).all()


def test_the_ball_is_of_third_order() -> None:
    """Halving a box divides the ball by eight: terms of second order are in the coefficients."""
    form = standard_form(formulate(load_case("paper-4.1-helical")))
    arithmetic = PolynomialArithmetic(ca.Function("F", [form.x], [form.expressions[0]]))
    centre, width = form.lower[:, None] + 0.4 * (form.upper - form.lower)[:, None], (form.upper - form.lower)[:, None]
    sizes = [arithmetic(centre - h * width, centre + h * width)[0].s[0] for h in (2.0**-6, 2.0**-7, 2.0**-8)]
    for wide, narrow in itertools.pairwise(sizes):
        assert 7 < wide / narrow < 9


def test_a_power_without_a_rule_is_refused() -> None:
    x = ca.SX.sym("x", 1)
    arithmetic = PolynomialArithmetic(ca.Function("f", [x], [x**0.3]))
    with pytest.raises(UncoveredError, match="power"):
        arithmetic(np.array([[1.0]]), np.array([[2.0]]))


def test_no_point_of_a_box_is_above_the_model_of_a_sum_or_outside_of_the_part_that_reaches_a_level() -> None:
    form = standard_form(formulate(load_case("paper-4.3")))
    assert len(form.expressions.elements()) == 2
    rng = np.random.default_rng(4)
    whole = (form.upper - form.lower)[:, None]
    width = 10.0 ** rng.uniform(-3, -0.7, size=(1, 40)) * whole
    centre = form.lower[:, None] + width + rng.random((form.n, 40)) * (whole - 2 * width)
    lower, upper = centre - width, centre + width
    arithmetic = PolynomialArithmetic(ca.Function("f", [form.x], [form.expressions]))
    forms = forms_of(arithmetic(lower, upper), lower, upper, form)
    weights = np.array([rng.random(40), -10 * rng.random(40) * (rng.random(40) > 0.3)])
    model = polynomial_sum(forms, weights)
    shares = np.concatenate([rng.random((200, form.n, 40)), rng.integers(0, 2, (200, form.n, 40))])
    points = np.clip(lower + shares * (upper - lower), lower, upper)
    values = ca.Function("f", [form.x], [form.expressions])(points.transpose(1, 0, 2).reshape(form.n, -1)).full()
    sums = (weights[:, None] * values.reshape(2, 400, 40)).sum(axis=0)
    size = np.abs(sums).max(axis=0)
    assert (sums.max(axis=0) <= model.bound() + 1e-12 * size).all()
    # The bound is of use: on the smaller half of the boxes it is close to the largest value found.
    narrow = width[0] <= np.median(width[0])
    spread = sums.max(axis=0) - sums.min(axis=0)
    assert (model.bound() - sums.max(axis=0) <= spread)[narrow].all()
    level = np.quantile(sums, 0.95, axis=0)
    low, high = reaching_part(model, level, lower, upper)
    reaches = (sums >= level + 1e-12 * size)[:, None]
    inside = (points >= low) & (points <= high)
    assert reaches.any()
    assert (inside | ~reaches).all()
    assert ((low > lower) | (high < upper)).any()
    # Far above the model nothing is left, and the ends are crossed.
    low, high = reaching_part(model, model.bound() + 10 * size, lower, upper)
    assert (low > high).all()


def test_a_proof_whose_cuts_are_within_rounding_of_loop_equations_is_accepted() -> None:
    """At home the rods of a 6-PUS fix its slides, and the search cuts down to widths of 1e-12."""
    model = robot_function("6-pus")()
    parameters: dict[str, object] = {item.name: item.typical[0] for item in model.parameters}
    for name in ("rb", "rp"):
        typical = float(parameters[name])  # type: ignore[arg-type]
        parameters[name] = Free(0.95 * typical, 1.05 * typical)
    size = float(np.linalg.norm(model.home))
    task = Task(np.array([0.3, -0.5, 0.8, size, -0.4 * size, 0.6 * size]), "max")
    case = Case(model, parameters, list(model.home), [task], Rotation(), characteristic_length=0.7 * size)
    certified = certify(case, gap=1e-4, starts=4, with_proof=True)
    (proof,) = proof_of(certified, "").claims
    nlp = program_of(case, certified.statement)
    assert check_proof(proof, nlp).bound == proof.bound
    assert proof.bound is not None
    with pytest.raises(ProofError, match="could not be proved"):
        check_proof(replace(proof, bound=certified.solution.F * (1 - 1e-6)), nlp)


def test_squared_quotients_stay_in_their_polynomials() -> None:
    """Narrow boxes, where rounding is most of the ball, and wide ones, where terms of third order are."""
    rng, counts = np.random.default_rng(6), np.zeros(4, dtype=int)
    for _ in range(12):
        x = ca.SX.sym("x", N)
        A, B = (ca.DM(rng.normal(size=(N, N))) for _ in range(2))
        over = ca.sumsqr(ca.mtimes(A, x)) + ca.sin(x[0]) + 2
        bent = ca.bilin(B, x, x) + ca.sin(x[1]) + float(rng.normal())
        function = ca.Function("f", [x], [bent**2 / over, (bent / ca.exp(x[2])) ** 2 / over])
        centre = rng.normal(size=(N, 30))
        width = 10.0 ** rng.uniform(-12, 0, size=(1, 30)) * (rng.random((N, 30)) > 0.15)
        counts += violations(function, centre - width, centre + width, rng)
    assert counts[:3].tolist() == [0, 0, 0]
    assert counts[3] > 500


def test_a_norm_that_may_be_zero_has_a_polynomial() -> None:
    """Where a vector may vanish, the sum of its squares is 0 at least: no rounding leaves its root undefined."""
    rng, counts = np.random.default_rng(7), np.zeros(4, dtype=int)
    for _ in range(12):
        x = ca.SX.sym("x", N)
        vector = ca.mtimes(ca.DM(rng.normal(size=(3, N))), x)
        function = ca.Function("f", [x], [ca.norm_2(vector), ca.norm_2(ca.vertcat(vector, ca.sin(x[0]))) + x[1]])
        width = 10.0 ** rng.uniform(-9, 0, size=(1, 30)) * np.ones((N, 30))
        centre = width * rng.uniform(-0.9, 0.9, size=(N, 30))
        assert all(np.isfinite(each.s).all() for each in PolynomialArithmetic(function)(centre - width, centre + width))
        counts += violations(function, centre - width, centre + width, rng)
    assert counts[:3].tolist() == [0, 0, 0]
    assert counts[3] > 500


NAMES = ("paper-4.3", "drilling-spindle", "two poses")


def minimum(name: str) -> StandardForm:
    if name == "two functions":
        form = minimum("paper-4.3")
        one = form.functions[0]
        return replace(form, functions=(one, 1.5 * one + 100 * form.x[0] ** 2))
    nlp = formulate(poses(1) if name == "two poses" else load_case(name))
    return standard_form(replace(nlp, sense=Sense.MIN))


def boxes_near_start(form: StandardForm, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of many widths near the program's start, about which conditions often hold."""
    rng = np.random.default_rng(4)
    room = (form.upper - form.lower)[:, None]
    middle = form.nlp.start[: form.n, None] + 0.2 * room * (rng.random((form.n, count)) - 0.5)
    half = 0.5 * room * 10.0 ** rng.uniform(-2, 0, (1, count)) * rng.uniform(0.3, 1, (form.n, count))
    lower, upper = form.lower[:, None], form.upper[:, None]
    return np.clip(middle - half, lower, upper), np.clip(middle + half, lower, upper)


def tangent_violations(form: StandardForm, count: int) -> tuple[int, int]:
    """Points at which a function is surely above its form with tangents; and points that were looked at."""
    rng, (lower, upper) = np.random.default_rng(5), boxes_near_start(form, count)
    rows, R = tangent_rows(form), form.expressions.numel()
    assert rows is not None
    tape = value_tape(form, rows)
    assert tape is not None
    every = enclose_second(tape, lower, upper)
    with np.errstate(all="ignore"):
        found, usable = tangent_forms(Forms(*(each[R:] for each in vars(every).values())), rows.functions, 1)
    functions = compile_tape(ca.Function("f", [form.x], list(form.functions)))
    (centre, radius), at = midpoints(lower, upper), monomials(form.n)
    bad = 0
    for box in np.flatnonzero(usable):
        share = rng.random(form.n) if rng.random() < 0.5 else rng.integers(0, 2, form.n)
        point = np.clip(lower[:, box] + share * (upper - lower)[:, box], lower[:, box], upper[:, box])
        (ball,), (is_sharp,) = balls.decided_balls(functions, point)  # sets 200 bits
        e = balls.steps(point, centre[:, box], radius[:, box])
        value = balls.linear(found.c[0, box], found.a[0, :, box], e)
        value += balls.arb(found.q[0, box]) + balls.arb(found.s[0, box])
        squares = [e[i] * e[j] for i, j in zip(at.first.tolist(), at.second.tolist(), strict=True)]
        value += balls.linear(0.0, found.Q[0, :, box], squares)
        bad += int(is_sharp and bool(ball > value))
    return bad, int(usable.sum())


@pytest.mark.parametrize("name", NAMES)
def test_no_function_is_above_its_form_with_tangents(name: str) -> None:
    bad, points = tangent_violations(minimum(name), 60)
    assert bad == 0
    assert points > 20


def test_a_tangent_that_is_a_secant_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test of the test above: ``rho^2 D`` a hundredth too small."""
    whole = tangent_bounds._sum

    def careless(rows: Forms, weights: np.ndarray) -> Forms:
        return whole(rows, np.where(weights > 0, weights * 0.99, weights))

    monkeypatch.setattr(tangent_bounds, "_sum", careless)
    assert tangent_violations(minimum("paper-4.3"), 60)[0] > 0


@pytest.mark.parametrize("name", [*NAMES, "two functions"])
def test_tangents_are_those_of_the_reference(name: str) -> None:
    form = minimum(name)
    lower, upper = boxes_near_start(form, 100)
    every = Engine(form, 1).examine(lower, upper, -np.inf).bound
    threshold = float(np.quantile(every[np.isfinite(every)], 0.9))
    one, other = (each.examine(lower, upper, threshold) for each in (NumpyEngine(form), Engine(form, 1)))
    assert (one.verdict == other.verdict).mean() > 0.98
    same = one.verdict == other.verdict
    np.testing.assert_allclose(other.bound[same], one.bound[same], rtol=1e-9)
    opened = same & (one.verdict == BoxState.OPEN) & (one.cut_lower == other.cut_lower).all(axis=0)
    np.testing.assert_allclose(other.lower[:, opened], one.lower[:, opened], rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(one.split[opened], other.split[opened])
    # They close boxes that are open without, and leave none open that is not.
    without = NumpyEngine(form, tangents=False).examine(lower, upper, threshold)
    left, before = (each.verdict == BoxState.OPEN for each in (one, without))
    assert (left <= before).all()
    assert name == "two poses" or left.sum() < before.sum()
    # Points of the box that keep the conditions have no larger value than the bound.
    rng, points = np.random.default_rng(6), 50
    x = np.repeat(lower, points, axis=1) + rng.random((form.n, 100 * points)) * np.repeat(upper - lower, points, axis=1)
    values = np.array(ca.Function("values", [form.x], [form.expressions])(x))
    J = len(form.functions)
    keeps = (values[J:] <= 0).all(axis=0) & np.isfinite(values).all(axis=0)
    least, of = values[:J, keeps].min(axis=0), np.repeat(np.arange(100), points)[keeps]
    assert (least <= other.bound[of] + 1e-12 * abs(least)).all()


def test_a_maximum_has_no_tangents_and_a_quotient_that_may_be_undefined_none_either() -> None:
    assert tangent_rows(standard_form(formulate(load_case("paper-4.3")))) is None
    form = minimum("paper-4.3")
    rows = tangent_rows(form)
    assert rows.functions == (0,) * 6
    x = form.x
    narrow = replace(form, functions=(-((x[0] + 1) ** 2) / (x[1] ** 2 + x[2] ** 2),), conditions=())
    rows = tangent_rows(narrow)
    assert rows is not None
    tape = value_tape(narrow, rows)
    assert tape is not None
    lower = np.full((form.n, 2), -1.0)
    lower[1:3, 1] = 0.5
    every = enclose_second(tape, lower, np.ones((form.n, 2)))
    with np.errstate(all="ignore"):
        usable = tangent_forms(Forms(*(each[1:] for each in vars(every).values())), rows.functions, 1).usable
    assert usable.tolist() == [False, True]


def test_a_tangent_keeps_the_rounding_of_numbers_that_cancel() -> None:
    form, rng = minimum("paper-4.3"), np.random.default_rng(7)
    x, points = form.x, rng.uniform(0.5, 1, (form.n, 200))
    form = replace(form, functions=(1e15 * x[1] - (3e7 * (x[0] + x[2])) ** 2 / (x[3] ** 2 + x[4] ** 2),), conditions=())
    points[1] = 0.9 * (points[0] + points[2]) ** 2 / (points[3] ** 2 + points[4] ** 2)
    a, b, c, d, e = np.vectorize(Fraction, otypes=[object])(points[:5])
    values = 10**15 * b - (3 * 10**7 * (a + c)) ** 2 / (d**2 + e**2)
    bound = Engine(form, 1).examine(points, points, -np.inf).bound
    assert (bound >= values).all()
    assert (bound < 100).all()


def test_a_minimum_takes_fewer_boxes_than_without_and_has_the_same_bound() -> None:
    nlp = replace(formulate(load_case("paper-4.3")), sense=Sense.MIN)
    x = solve_program(nlp, Search(starts=2), jobs=1).x
    found = certify_program(nlp, x, gap=1e-4)
    assert found.status is CertificateStatus.PROVED
    assert found.boxes < 1500
    assert 94.9 < found.bound < 94.94

"""Tangents to the squares of a minimum: against 200-bit ball arithmetic, in both engines, and what they save."""

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

from screwsynth.nlp import CertificateStatus, Search, Sense, certify_program, formulate, load_case, solve_program
from screwsynth.nlp.proof.boxes.engine import Engine, Verdict, value_tape
from screwsynth.nlp.proof.enclosure.squared_quotients import tangent_rows
from screwsynth.nlp.proof.enclosure.tape import compile_tape
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form

flint = pytest.importorskip("flint")


balls = pytest.importorskip("balls")
NAMES = ("paper-4.3", "drilling-spindle", "two poses")


def minimum(name: str) -> StandardForm:
    if name == "two functions":
        form = minimum("paper-4.3")
        one = form.functions[0]
        return replace(form, functions=(one, 1.5 * one + 100 * form.x[0] ** 2))
    nlp = formulate(poses(1) if name == "two poses" else load_case(name))
    return standard_form(replace(nlp, sense=Sense.MIN))


def boxes_of(form: StandardForm, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of many widths near the program's start, about which conditions often hold."""
    rng = np.random.default_rng(4)
    room = (form.upper - form.lower)[:, None]
    middle = form.nlp.start[: form.n, None] + 0.2 * room * (rng.random((form.n, count)) - 0.5)
    half = 0.5 * room * 10.0 ** rng.uniform(-2, 0, (1, count)) * rng.uniform(0.3, 1, (form.n, count))
    lower, upper = form.lower[:, None], form.upper[:, None]
    return np.clip(middle - half, lower, upper), np.clip(middle + half, lower, upper)


def violations(form: StandardForm, count: int) -> tuple[int, int]:
    """Points at which a function is surely above its form with tangents; and points that were looked at."""
    flint.ctx.prec = 200
    rng, (lower, upper) = np.random.default_rng(5), boxes_of(form, count)
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
        e = [
            (flint.arb(float(x)) - flint.arb(float(c))) / flint.arb(float(r)) if r > 0 else flint.arb(0)
            for x, c, r in zip(point, centre[:, box], radius[:, box], strict=True)
        ]
        (ball,), (is_sharp,) = balls.decided_balls(functions, point)
        value = (
            flint.arb(float(found.c[0, box])) + flint.arb(float(found.q[0, box])) + flint.arb(float(found.s[0, box]))
        )
        value += sum((flint.arb(float(a)) * step for a, step in zip(found.a[0, :, box], e, strict=True)), flint.arb(0))
        for q, i, j in zip(found.Q[0, :, box].tolist(), at.first.tolist(), at.second.tolist(), strict=True):
            value += flint.arb(q) * e[i] * e[j]
        bad += int(is_sharp and bool(ball > value))
    return bad, int(usable.sum())


@pytest.mark.parametrize("name", NAMES)
def test_no_function_is_above_its_form_with_tangents(name: str) -> None:
    bad, points = violations(minimum(name), 60)
    assert bad == 0
    assert points > 20


def test_a_tangent_that_is_a_secant_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test of the test above: ``rho^2 D`` a hundredth too small."""
    whole = tangent_bounds._sum

    def careless(rows: Forms, weights: np.ndarray) -> Forms:
        return whole(rows, np.where(weights > 0, weights * 0.99, weights))

    monkeypatch.setattr(tangent_bounds, "_sum", careless)
    assert violations(minimum("paper-4.3"), 60)[0] > 0


@pytest.mark.parametrize("name", [*NAMES, "two functions"])
def test_tangents_are_those_of_the_reference(name: str) -> None:
    form = minimum(name)
    lower, upper = boxes_of(form, 100)
    every = Engine(form, 1).examine(lower, upper, -np.inf).bound
    threshold = float(np.quantile(every[np.isfinite(every)], 0.9))
    one, other = (each.examine(lower, upper, threshold) for each in (NumpyEngine(form), Engine(form, 1)))
    assert (one.verdict == other.verdict).mean() > 0.98
    same = one.verdict == other.verdict
    np.testing.assert_allclose(other.bound[same], one.bound[same], rtol=1e-9)
    opened = same & (one.verdict == Verdict.OPEN) & (one.cut_lower == other.cut_lower).all(axis=0)
    np.testing.assert_allclose(other.lower[:, opened], one.lower[:, opened], rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(one.split[opened], other.split[opened])
    # They close boxes that are open without, and leave none open that is not.
    without = NumpyEngine(form, tangents=False).examine(lower, upper, threshold)
    left, before = (each.verdict == Verdict.OPEN for each in (one, without))
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

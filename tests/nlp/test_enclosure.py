"""Enclosures against 200-bit ball arithmetic: on random graphs over every operation, and on the models."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_enclosures import enclose
from numpy_engine import first_order, intervals, univariate
from numpy_engine.first_order import Enclosures
from numpy_engine.intervals import midpoints
from random_graphs import random_boxes, random_function

from screwsynth.nlp import UncoveredError, formulate, load_case
from screwsynth.nlp.proof.boxes.engine import search_tape
from screwsynth.nlp.proof.enclosure.forms import Encloser
from screwsynth.nlp.proof.enclosure.tape import Op, Tape, compile_tape
from screwsynth.nlp.proof.statement.form import without_ties
from screwsynth.nlp.proof.statement.standard_form import standard_form

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


@pytest.mark.parametrize("operation", [ca.ceil, ca.erf, ca.floor, ca.sinh])
def test_an_operation_without_a_rule_is_refused_by_name(operation: object) -> None:
    x = ca.SX.sym("x", 1)
    name = operation.__name__  # type: ignore[attr-defined]
    with pytest.raises(UncoveredError, match=f"'{name}'"):
        compile_tape(ca.Function("f", [x], [operation(x)]))  # type: ignore[operator]


@pytest.mark.parametrize("power", [0.3, 1e3])
def test_a_power_without_a_rule_is_refused(power: float) -> None:
    x = ca.SX.sym("x", 1)
    with pytest.raises(UncoveredError, match="the power"):
        compile_tape(ca.Function("f", [x], [x**power]))


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
    forms = enclose(
        compile_tape(ca.Function("f", [x], [ca.densify(written).T])), np.full((4, 1), -1.0), np.ones((4, 1))
    )
    assert np.isfinite(forms.lo).all()
    assert np.isfinite(forms.hi).all()
    inside = np.abs(points).max(axis=0) <= 1
    at = other.reshape(4, 500, order="F")[:, inside]
    assert (forms.lo <= at).all()
    assert (at <= forms.hi).all()

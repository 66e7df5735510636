"""Models of squared quotients from those of N and D, against values in 200-bit balls and against gradients."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from limb_cases import machine, poses, separated
from numpy_engine import squared_quotients as quotients
from numpy_engine.bounding import NumpyEngine
from numpy_engine.intervals import midpoints
from numpy_engine.limb_models import NumpyLimbEngine
from numpy_engine.quadratic_models import GradientModel

from screwsynth.nlp import formulate, load_case
from screwsynth.nlp.proof.boxes.engine import Engine, search_tape
from screwsynth.nlp.proof.enclosure.squared_quotients import search_rows
from screwsynth.nlp.proof.statement.limb_separation import terms_of
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form

flint = pytest.importorskip("flint")
balls = pytest.importorskip("balls")

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


def random_boxes(
    form: StandardForm, count: int, seed: int, widths: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
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


def violations(form: StandardForm, engine: str, seed: int = 0, widths: tuple[float, float] = (-3, -0.1)) -> int:
    """Points of random boxes above the bound, centres below their value, and gradients outside of their ends."""
    low, high = random_boxes(form, 60, seed, widths)
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
    box = midpoints(low, high)
    with np.errstate(all="ignore"):
        for least in (None, np.median(values, axis=1)):
            model = NumpyEngine(form, apart=True).model(low, high, box.radius, least)
            matters = np.isfinite(values) & (True if least is None else values >= least[:, None])
            inside = (high > low)[:, :, None] & matters & (model.value.s[0] < np.inf)[:, None]
            room = 1e-9 * (np.abs(slopes) + 1)
            outside = (slopes < model.gradient_lo[0][:, :, None] - room) | (
                slopes > model.gradient_hi[0][:, :, None] + room
            )
            wrong += int((outside & inside).sum())
    return wrong


@pytest.mark.parametrize("engine", ENGINES)
def test_no_value_and_no_gradient_is_outside(engine: str) -> None:
    for form in forms():
        assert len(search_rows(form, apart=True).quotients) >= 1
        assert violations(form, engine) == 0


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
    assert any(violations(form, "numpy") for form in forms())


def test_a_bound_that_forgets_the_rest_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The denominator is taken at the centre: then the square is too small wherever it is less."""
    row = quotients._row

    def careless(model: GradientModel, r: int) -> object:
        found = row(model, r)
        return found._replace(lo=found.c, hi=found.c)

    monkeypatch.setattr(quotients, "_row", careless)
    assert any(violations(form, "numpy") for form in forms())


@pytest.mark.parametrize("engine", ENGINES)
def test_tiny_boxes_hold_their_exact_values(engine: str) -> None:
    """Rounding: on boxes down to points, corners in 200-bit balls are not above the bound."""
    for form in forms()[:4]:
        low, high = random_boxes(form, 25, 3, (-15, -9))
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

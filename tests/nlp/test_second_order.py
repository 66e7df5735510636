"""Forms of second order of the reference against 200-bit ball arithmetic, and the kernel's first pass against it."""

import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import random_graphs
from builders import soaked
from numpy_engine import second_order
from numpy_engine.bounding import NumpyEngine
from numpy_engine.intervals import midpoints
from numpy_engine.second_order import Forms, enclose_second, monomials

from screwsynth.nlp import UncoveredError, formulate, load_case
from screwsynth.nlp.proof.boxes.engine import BoxState, Engine, Examination, value_tape
from screwsynth.nlp.proof.enclosure.tape import Tape, compile_tape
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm, standard_form

flint = pytest.importorskip("flint")
balls = pytest.importorskip("balls")


def count_violations(tape: Tape, lower: np.ndarray, upper: np.ndarray, seed: int) -> tuple[int, int, int]:
    """Results surely outside of their form or interval at random points; checks; and checks of finite forms."""
    flint.ctx.prec = 200
    rng = np.random.default_rng(seed)
    forms, at = enclose_second(tape, lower, upper), monomials(len(lower))
    centre, radius = midpoints(lower, upper)
    bad = checks = finite = 0
    for box in range(lower.shape[1]):
        share = rng.random(len(lower)) if rng.random() < 0.5 else rng.integers(0, 2, len(lower))
        point = np.clip(lower[:, box] + share * (upper - lower)[:, box], lower[:, box], upper[:, box])
        e = [
            (flint.arb(float(x)) - flint.arb(float(c))) / flint.arb(float(r)) if r > 0 else flint.arb(0)
            for x, c, r in zip(point, centre[:, box], radius[:, box], strict=True)
        ]
        for k, (ball, is_sharp) in enumerate(zip(*balls.decided_balls(tape, point), strict=True)):
            checks += 1
            if not is_sharp:
                continue
            if not ball.is_finite():
                bad += int(np.isfinite(forms.s[k, box]))
                continue
            lo, hi = flint.arb(float(forms.lo[k, box])), flint.arb(float(forms.hi[k, box]))
            bad += int(bool(ball < lo) or bool(ball > hi))
            if not np.isfinite(forms.s[k, box]):
                continue
            finite += 1
            value = flint.arb(float(forms.c[k, box]))
            value += sum(
                (flint.arb(float(a)) * step for a, step in zip(forms.a[k, :, box], e, strict=True)), flint.arb(0)
            )
            for q, i, j in zip(forms.Q[k, :, box].tolist(), at.first.tolist(), at.second.tolist(), strict=True):
                value += flint.arb(q) * e[i] * e[j]
            s = flint.arb(float(forms.s[k, box]))
            low, high = value + flint.arb(float(forms.p[k, box])) - s, value + flint.arb(float(forms.q[k, box])) + s
            bad += int(bool(ball < low) or bool(ball > high))
    return bad, checks, finite


def test_random_graphs_stay_inside_their_forms_of_second_order() -> None:
    finite = 0
    for seed in range(24):
        tape = compile_tape(random_graphs.random_function(seed, 24))
        bad, _, some = count_violations(tape, *random_graphs.random_boxes(seed + 1, 10), seed)
        assert bad == 0
        finite += some
    assert finite > 2000


@pytest.mark.parametrize("name", ["paper-4.3", "paper-4.4-max"])
def test_models_stay_inside_their_forms_of_second_order(name: str) -> None:
    form = standard_form(formulate(load_case(name)))
    places = np.arange(min(form.n, 7))
    # A program with more variables: the others held, since the forms are for few.
    x = ca.SX.sym("x", places.size)
    share = np.random.default_rng(4).random(form.n)
    middle = ca.SX(ca.DM(form.lower + share * (form.upper - form.lower)))
    middle[places.tolist()] = x
    tape = compile_tape(ca.Function("values", [x], [ca.cse(ca.substitute(form.expressions, form.x, middle))]))
    rng = np.random.default_rng(5)
    lower, upper = form.lower[places, None], form.upper[places, None]
    width = 10.0 ** rng.uniform(-4, 0, size=(places.size, 30))
    low = lower + (upper - lower) * rng.random((places.size, 30)) * (1 - width)
    bad, checks, finite = count_violations(tape, low, np.minimum(low + (upper - lower) * width, upper), 3)
    assert bad == 0
    assert finite > checks / 4


@pytest.mark.parametrize("fault", ["rounding", "cubic"])
def test_a_form_without_its_rounding_or_its_third_order_is_caught(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if fault == "rounding":
        settled = second_order._Interpreter._settled

        def without(self: second_order._Interpreter, v: Forms) -> second_order._Register:
            self.slack = 0.0
            return settled(self, Forms(**{**vars(v), "s": 0 * v.s}))

        monkeypatch.setattr(second_order._Interpreter, "_settled", without)
    else:
        monkeypatch.setattr(
            second_order._Interpreter, "_cubic_sizes", lambda self, a, *_: np.zeros(self.boxes) + 0 * a[0]
        )
    found = 0
    for seed in range(12):
        tape = compile_tape(random_graphs.random_function(seed, 24))
        found += count_violations(tape, *random_graphs.random_boxes(seed + 1, 10), seed)[0]
    assert found > 10


def random_form(seed: int) -> StandardForm:
    """A random graph as a function and two conditions; where it is undefined does not matter."""
    function = random_graphs.random_function(seed, 9)
    x = ca.SX.sym("x", random_graphs.N)
    values = ca.vertsplit(function(x))
    conditions = tuple(Condition(f"h{k}", values[-1 - k] - 1.0, is_equation=k == 1) for k in range(2))
    ends = np.full(random_graphs.N, 4.0)
    nlp = formulate(load_case("paper-4.2-rotation"))
    return StandardForm(nlp, x, -ends, ends, (values[-3],), conditions)


def test_the_first_pass_is_that_of_the_reference_on_random_graphs() -> None:
    """Trap: comparisons in C lose a NaN that NumPy keeps, and a root below 0 would count as defined."""
    verdicts = np.zeros(5, dtype=int)
    infinite = agree = 0
    for seed in range(16):
        form = random_form(seed)
        if not any(any(row) for row in form.dependence[1:]) or ca.jacobian(form.expressions, form.x).is_constant():
            continue
        lower, upper = random_graphs.random_boxes(seed + 1, 40)
        try:
            reference = NumpyEngine(form)
        except UncoveredError:  # a graph whose value jumps
            continue
        assert value_tape(form) is not None
        one, other = reference.examine(lower, upper, 0.3), Engine(form, 1).examine(lower, upper, 0.3)
        same = one.verdict == other.verdict
        agree += int(same.sum())
        assert np.array_equal(np.isfinite(one.bound), np.isfinite(other.bound)), seed
        fine = same & np.isfinite(one.bound)
        np.testing.assert_allclose(other.bound[fine], one.bound[fine], rtol=1e-9, atol=1e-9)
        verdicts += np.bincount(one.verdict, minlength=5)
        infinite += int((~np.isfinite(one.bound)).sum())
    assert agree > 0.995 * verdicts.sum()
    assert infinite > 30
    assert (verdicts[[BoxState.OPEN, BoxState.BOUNDED, BoxState.INFEASIBLE]] > 10).all()


def boxes_near(form: StandardForm, point: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of many widths near a point, within the box of the form."""
    rng = np.random.default_rng(2)
    room = (form.upper - form.lower)[:, None]
    middle = point[:, None] + (rng.random((form.n, count)) - 0.5) * room * rng.choice([0.01, 0.3], (1, count))
    half = 0.5 * room * 2.0 ** -rng.integers(0, 8, (1, count)) * rng.random((form.n, count))
    lower = form.lower[:, None]
    upper = form.upper[:, None]
    return np.clip(middle - half, lower, upper), np.clip(middle + half, lower, upper)


#: A point well within the limits of hexapod-machining, with F = 485.
MACHINING = (26.8, 11.8, 0.115, 0.223, -1.04, -4.5, 22.3, 0.0568, -0.0564, -0.009)


def assert_engines_agree(form: StandardForm, lower: np.ndarray, upper: np.ndarray, other: Examination) -> None:
    """The NumPy engine finds what the kernel found at a threshold of 430."""
    reference = NumpyEngine(form)
    assert reference._objective is not None
    one = reference.examine(lower, upper, 430.0)
    assert (one.verdict == other.verdict).mean() > 0.98
    assert len(set(one.verdict.tolist())) > 2
    same = (one.verdict == other.verdict) & np.isfinite(one.bound)
    np.testing.assert_allclose(other.bound[same], one.bound[same], rtol=1e-10)
    opened = same & (one.verdict == BoxState.OPEN) & (one.cut_lower == other.cut_lower).all(axis=0)
    np.testing.assert_allclose(other.lower[:, opened], one.lower[:, opened], rtol=1e-9, atol=1e-9)
    assert (one.split == other.split)[opened].mean() > 0.95


@pytest.mark.parametrize("name", soaked(["paper-4.1-helical", "hexapod-machining"], ["paper-4.1-helical"]))
def test_no_point_above_the_threshold_is_cut_off(name: str) -> None:
    """Bounds, contraction and closed boxes against points; and any number of threads gives the same, bit for bit."""
    form = standard_form(formulate(load_case(name)))
    point = np.array(MACHINING) if form.n == 10 else 0.5 * (form.lower + form.upper)
    lower, upper = boxes_near(form, point, 240)
    function = ca.Function("values", [form.x], [form.expressions])
    threshold = 430.0 if form.n == 10 else 0.9 * form.value_at(point)
    found = Engine(form, 1).examine(lower, upper, threshold)
    if form.n == 10:  # where the gradients of conditions wait
        few = slice(0, 64)
        part = Examination(**{name: values[..., few] for name, values in vars(found).items()})
        assert_engines_agree(form, lower[:, few], upper[:, few], part)
    for jobs in (2, 3) if form.n == 6 else (2,):
        again = Engine(form, jobs)
        for one, other in zip(vars(found).values(), vars(again.examine(lower, upper, threshold)).values(), strict=True):
            assert one.tobytes() == other.tobytes()
    rng, points = np.random.default_rng(3), 60
    x = np.repeat(lower, points, axis=1) + rng.random((form.n, 240 * points)) * np.repeat(upper - lower, points, axis=1)
    values = np.array(function(x))
    feasible = (values[1:] <= 0).all(axis=0) & np.isfinite(values).all(axis=0)
    of = np.repeat(np.arange(240), points)
    assert (values[0, feasible] <= found.bound[of[feasible]] * (1 + 1e-12)).all()
    good = np.flatnonzero(feasible & (values[0] > threshold * (1 + 1e-9)))
    # A point of a monotone box may be improved beyond it, and one of a box on a face on that face.
    is_cut = (
        (found.cut_lower != -1).all(axis=0) & (found.cut_upper != -1).all(axis=0) & (found.verdict != BoxState.MONOTONE)
    )
    good = good[is_cut[of[good]]]
    assert (found.verdict[of[good]] == BoxState.OPEN).all()
    inside = (x[:, good] >= found.lower[:, of[good]]) & (x[:, good] <= found.upper[:, of[good]])
    assert inside.all()
    assert good.size > 200


def test_the_headers_of_the_kernel_name_their_references_where_they_are() -> None:
    root, named = Path(__file__).parents[2], set[str]()
    for header in (root / "nlp/proof/enclosure/kernel").glob("*.h"):
        text = header.read_text(encoding="utf-8")
        assert not re.findall(r"(?<![\w/])\w+\.py", text), f"{header.name}: a path begins at the root"
        for path in re.findall(r"[\w/]+\.py", text):
            assert (root / path).is_file(), f"{header.name}: {path}"
            named.add(path)
        for name, path in re.findall(r"(\w{3,}) in (tests/[\w/]+\.py)", text):
            defined = re.findall(rf"^ *(?:def|class) {name}\b", (root / path).read_text(encoding="utf-8"), re.MULTILINE)
            assert defined, f"{header.name}: {name} in {path}"
    modules = {str(each.relative_to(root)) for each in (root / "tests/reference/numpy_engine").glob("[a-z]*.py")}
    assert modules <= named

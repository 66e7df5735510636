"""Symmetries read off expressions: what is found changes nothing, and what is no symmetry is not found."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from limb_cases import machine

from screwsynth.nlp import CertificateStatus, certify_program, formulate, load_case
from screwsynth.nlp.proof.boxes.symmetry import grouped, halved, mirrors
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.statement.limb_separation import separate
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm, standard_form


@cache
def base_form() -> StandardForm:
    return standard_form(formulate(load_case("paper-4.1-helical")))


def form_of(
    function: Callable[[SX], SX], limit: Callable[[SX], SX] | None = None, equation: Callable[[SX], SX] | None = None
) -> StandardForm:
    """A form of three variables between -1 and 1."""
    x = SX.sym("x", 3)
    pairs = (("limit", limit, False), ("equation", equation, True))
    conditions = tuple(Condition(name, each(x), exact) for name, each, exact in pairs if each is not None)
    ends = np.full(3, -1.0), np.full(3, 1.0)
    stated = {"functions": (function(x),), "conditions": conditions}
    return replace(base_form(), x=x, lower=ends[0], upper=ends[1], **stated)


@pytest.mark.parametrize(
    ("function", "limit", "equation", "found"),
    [
        (lambda x: x[0] ** 2 + ca.cos(x[1]) * x[2], None, None, [(0,), (1,)]),
        (lambda x: (x[0] * x[1]) ** 2 + x[2], None, None, [(0,), (1,)]),
        (lambda x: x[0] * x[1] + ca.sin(x[2]) * x[0], None, None, [(0, 1, 2)]),
        (lambda x: ca.atan(x[0]) / x[1] + x[2] ** 2, lambda x: x[2], None, [(0, 1)]),
        (lambda x: x[0] ** 2 + x[1] ** 2 + x[2] ** 2, None, lambda x: x[0] + x[1], [(0, 1), (2,)]),
        (lambda x: x[0] ** 2 + x[1] ** 2 + x[2] ** 2, None, lambda x: x[0] + x[1] - 0.5, [(2,)]),
        (lambda x: (x[0] + 0.1) ** 2 + ca.exp(x[1]) + ca.sqrt(x[2] + 2), None, None, []),
        (lambda x: ca.fmax(x[0], 0) + x[1] ** 3, None, None, [(2,)]),
    ],
)
def test_mirrors_are_those_of_a_graph(
    function: Callable[[SX], SX],
    limit: Callable[[SX], SX] | None,
    equation: Callable[[SX], SX] | None,
    found: list[tuple[int, ...]],
) -> None:
    form = form_of(function, limit, equation)
    assert mirrors(form) == found
    half = halved(form)
    assert [i for i in range(3) if half.lower[i] == 0] == [each[0] for each in found]
    # A variable whose bounds are not opposite numbers changes no sign.
    uneven = replace(form, upper=np.array([2.0, 1.0, 1.0]))
    assert all(0 not in each for each in mirrors(uneven))


def random_graph(rng: np.random.Generator, x: SX) -> SX:
    """A random expression, in which mirrors are frequent and others than those of single variables occur."""
    values = [x[i] for i in range(x.numel())]
    unary = [ca.sin, ca.cos, ca.atan, lambda v: v * v, lambda v: -2 * v, ca.exp, ca.fabs, lambda v: v + 0.5]
    for _ in range(int(rng.integers(2, 9))):
        a, b = (values[int(rng.integers(len(values)))] for _ in range(2))
        kind = int(rng.integers(12))
        new = a * b if kind < 3 else a + b if kind == 3 else a / b if kind == 4 else unary[int(rng.integers(8))](a)
        values.append(new)
    return values[-1]


def test_a_mirror_changes_no_value_and_its_half_reaches_every_point() -> None:
    rng, kinds = np.random.default_rng(0), set()
    for _ in range(150):
        seed = int(rng.integers(2**31))
        form = form_of(*(lambda x, s=seed + k: random_graph(np.random.default_rng(s), x) for k in range(3)))
        found = mirrors(form)
        kinds |= {len(each) for each in found}
        values = ca.Function("f", [form.x], [form.functions[0], *(each.expression for each in form.conditions)]).map(20)
        points = rng.uniform(-1, 1, (3, 20))
        before = [each.full() for each in values(points)]
        half, moved = halved(form), points.copy()
        for each in found:
            # The first variable of each is in no other one, so the others do not undo it.
            moved[np.array(each)[:, None], moved[each[0]] < 0] *= -1
        after = [each.full() for each in values(moved)]
        assert (moved >= half.lower[:, None]).all()
        for name, one, other in zip(("F", "limit", "equation"), before, after, strict=True):
            sizes = (np.abs(one), np.abs(other)) if name == "equation" else (one, other)
            np.testing.assert_allclose(*sizes, rtol=1e-12)
    assert kinds == {1, 2, 3}


def test_copies_have_the_same_maximum_and_others_are_no_copies() -> None:
    form = standard_form(formulate(load_case("paper-4.4-max")))
    found = separate(form)
    forms = [each.form for each in found.limbs]
    assert grouped(forms) == [[0, 1, 2]]
    x = np.random.default_rng(0).uniform(-1, 1, 6)
    assert len({each.value_at(x) for each in forms}) == 1
    narrow = replace(forms[1], upper=0.5 * forms[1].upper)
    other = replace(forms[2], functions=(1.5 * forms[2].functions[0],))
    loose = replace(forms[0], conditions=forms[0].conditions[1:])
    assert grouped([forms[0], narrow, forms[1], other, loose]) == [[0, 2], [1], [3], [4]]
    legs = separate(standard_form(formulate(machine(2.0))))
    assert all(len(each) == 1 for each in grouped([each.form for each in legs.limbs]))


def test_symmetries_leave_the_bound_of_the_paper(monkeypatch: pytest.MonkeyPatch) -> None:
    """Section 4.4: three mirrors of each limb, and three limbs that are copies: at least a tenth of the boxes."""
    nlp = formulate(load_case("paper-4.4-min"))
    found = certify_program(nlp, gap=1e-4)
    assert found.status is CertificateStatus.PROVED
    # The optimum is in another half too, which a point of the box shows that is no point of the half.
    form = standard_form(nlp)
    assert len(mirrors(form)) == 9
    flipped = found.x.copy()
    for each in mirrors(form):
        flipped[list(each)] *= -1
    assert form.value_at(flipped) == pytest.approx(form.value_at(found.x), abs=1e-12)
    again = certify_program(nlp, flipped, gap=1e-4)
    assert again.status is CertificateStatus.PROVED
    monkeypatch.setattr(branch_and_bound, "halved", lambda form: form)
    whole = certify_program(nlp, gap=1e-2)
    assert abs(whole.bound - found.bound) < 1e-6
    assert whole.boxes > 3 * found.boxes

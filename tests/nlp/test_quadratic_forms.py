"""Forms of second order hold what they are made of: products, sizes and solutions at random points of boxes."""

from dataclasses import replace

import numpy as np
import pytest
from builders import Array

from screwsynth.nlp.proof.workspace.numbers.quadratic_forms import Quadratics, solved

BOXES, POINTS = 40, 40


def random_forms(rng: np.random.Generator, shape: tuple[int, int], count: int, errors: int, width: Array) -> Quadratics:
    """Matrices near the identity over boxes of widths (B,): linear parts, products and rests shrink with them.

    With errors of joint centres there are no products.
    """
    p, B = 0 if errors else count * (count + 1) // 2, len(width)
    c = np.eye(*shape)[:, :, None] + 0.2 * rng.normal(size=(*shape, B))
    a = width * rng.normal(size=(*shape, count + 3 * errors, B))
    q = width**2 * rng.normal(size=(*shape, p, B))
    return Quadratics(c, a, q, 0.1 * width**3 * rng.uniform(size=(*shape, B)), 3 * errors)


def values_at(forms: Quadratics, e: Array, part: Array | None = None) -> Array:
    """Values (n, m, B) at points (t, B) of the boxes, at a part of the rests or without them."""
    i, j = np.triu_indices(len(e) if forms.q.shape[2] else 0)
    linear, products = ((each * by).sum(axis=2) for each, by in ((forms.a, e), (forms.q, e[i] * e[j])))
    return np.asarray(forms.c + linear + products + (0.0 if part is None else part * forms.r))


def point(rng: np.random.Generator, count: int, errors: int) -> Array:
    """A point (t, B) of each box, many at ends; errors are vectors of unit size."""
    e = rng.uniform(-1, 1, size=(count, BOXES))
    vectors = rng.normal(size=(errors, 3, BOXES))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.concatenate([np.where(rng.uniform(size=e.shape) < 0.6, np.sign(e), e), vectors.reshape(-1, BOXES)])


@pytest.mark.parametrize(("count", "errors"), [(1, 0), (3, 0), (6, 0), (2, 3)])
def test_products_solutions_and_sizes_are_within_their_forms(count: int, errors: int) -> None:
    rng = np.random.default_rng(count)
    width = np.geomspace(1e-3, 0.2, BOXES) / (count + errors)
    A, D = (random_forms(rng, shape, count, errors, width) for shape in ((4, 4), (4, 2)))
    product, Y, size, entries = A.matmul(D), solved(A, D), D.lengths(), D.by(A[:, :2])
    assert np.isfinite(Y.r[..., : BOXES // 2]).all()
    worst = 0.0
    for _ in range(POINTS):
        e, parts = point(rng, count, errors), [rng.choice([-1.0, 0.0, 1.0], each.r.shape) for each in (A, D)]
        a, d = (values_at(each, e, part) for each, part in zip((A, D), parts, strict=True))
        exact = np.linalg.solve(a.transpose(2, 0, 1), d.transpose(2, 0, 1)).transpose(1, 2, 0)
        for forms, value in ((product, np.einsum("ikb,kjb->ijb", a, d)), (Y, exact), (entries, d * a[:, :2])):
            assert (np.abs(value - values_at(forms, e)) <= forms.r).all()
            assert (value <= forms.upper()).all()
        worst = max(worst, float(np.max(np.abs(exact - values_at(Y, e)) / Y.r)))
        assert (np.linalg.norm(d, axis=0)[None] <= values_at(size, e) + size.r).all()
    assert worst > 0.02, worst  # the largest rest needed is not far below the one allowed


def test_terms_of_third_order_are_all_that_a_solution_leaves() -> None:
    """Half the width leaves an eighth, where the parts have no rests."""
    rng, width = np.random.default_rng(5), np.full(BOXES, 0.02)
    A, D = (random_forms(rng, shape, 3, 0, width) for shape in ((3, 3), (3, 1)))
    rests = []
    for half in (1.0, 0.5):
        own = (replace(each, a=half * each.a, q=half**2 * each.q, r=0 * each.r) for each in (A, D))
        rests.append(solved(*own).r)
    assert (rests[1] <= rests[0] / 7.5).all()
    assert (rests[1] >= rests[0] / 10).all()

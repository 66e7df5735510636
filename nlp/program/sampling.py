"""Starting points: the user's first, then a Latin hypercube; uniform on spheres and in the rotation's ball."""

from __future__ import annotations

import random

import numpy as np

from ...models import FloatArray
from .nlp import Nlp
from .places import FreeRotation


def starting_points(nlp: Nlp, count: int, seed: int) -> FloatArray:
    """Starting points inside the bounds, and inside the rotation's ball.

    The generator is Python's own: importing NumPy's takes longer than a solve's sampling ever does.

    Args:
        nlp: the program.
        count: how many, at least 1.
        seed: of the generator; the same seed gives the same points.

    Returns:
        (count, n) array; the first row is the case's own start.
    """
    generator = random.Random(seed)  # noqa: S311 - starting points, not secrets
    unit = np.empty((count - 1, nlp.n))
    for column in unit.T:
        strata = generator.sample(range(count - 1), count - 1)
        column[:] = [(stratum + generator.random()) / (count - 1) for stratum in strata]
    points = nlp.lower + unit * (nlp.upper - nlp.lower)
    for triple in nlp.program.places.directions:
        points[:, triple] = _sphere(generator, count - 1)
    for rotation in nlp.program.places.rotations:
        if not isinstance(rotation, FreeRotation):
            continue
        ball = nlp.program.constraints.index(rotation.ball)
        inner, outer = max(nlp.g_lower[ball], 0.0) ** 1.5, nlp.g_upper[ball] ** 1.5
        # Equal volumes get equal chances: the cube of the radius is uniform. The hypercube's first column spreads it.
        radii = np.cbrt(inner + unit[:, rotation.q[0]] * (outer - inner))
        points[:, rotation.q] = radii[:, None] * _sphere(generator, count - 1)
    return np.vstack([nlp.start, np.clip(points, nlp.lower, nlp.upper)])


def _sphere(generator: random.Random, count: int) -> FloatArray:
    """Directions, uniform on the unit sphere, (count, 3)."""
    vectors = np.array([[generator.gauss() for _ in range(3)] for _ in range(count)]).reshape(-1, 3)
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), dtype=np.float64)

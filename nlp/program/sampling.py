"""Starting points: the start of the case, then a Latin hypercube, uniform on spheres and in balls of rotations."""

from __future__ import annotations

import random

import numpy as np

from ...models import FloatArray
from .nlp import Nlp
from .places import FreeRotation


def starting_points(nlp: Nlp, count: int, seed: int) -> FloatArray:
    """Return starting points inside the bounds of the variables and inside the balls of the rotations.

    Python's generator is used, because importing NumPy's takes longer than the sampling.

    Args:
        nlp: the program.
        count: number of points, 1 or more.
        seed: seed of the generator; the same seed gives the same points.

    Returns:
        (count, n) array; the first row is the start of the case.
    """
    generator = random.Random(seed)  # noqa: S311 - starting points, not secrets
    unit = np.empty((count - 1, nlp.n))
    for column in unit.T:
        strata = generator.sample(range(count - 1), count - 1)
        column[:] = [(stratum + generator.random()) / (count - 1) for stratum in strata]
    points = nlp.lower + unit * (nlp.upper - nlp.lower)
    for triple in nlp.program.places.directions:
        points[:, triple] = _sphere_points(generator, count - 1)
    for rotation in nlp.program.places.rotations:
        if not isinstance(rotation, FreeRotation):
            continue
        ball = nlp.program.constraints.index(rotation.ball)
        inner, outer = max(nlp.g_lower[ball], 0.0) ** 1.5, nlp.g_upper[ball] ** 1.5
        # Uniform points in volume have a uniform cube of the radius, which the hypercube's first column of q spreads.
        radii = np.cbrt(inner + unit[:, rotation.q[0]] * (outer - inner))
        points[:, rotation.q] = radii[:, None] * _sphere_points(generator, count - 1)
    # Joints start at home, from which the loops close: other values belong to other assembly modes.
    inner = list(nlp.program.places.inner)
    points[:, inner] = nlp.start[inner]
    return np.vstack([nlp.start, np.clip(points, nlp.lower, nlp.upper)])


def _sphere_points(generator: random.Random, count: int) -> FloatArray:
    vectors = np.array([[generator.gauss() for _ in range(3)] for _ in range(count)]).reshape(-1, 3)
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), dtype=np.float64)

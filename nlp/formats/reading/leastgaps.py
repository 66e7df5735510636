"""Least squares of loops that Newton's method does not close from where the model stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....models.arrays import FloatArray
from .description import Description
from .newton import LEAST, Closed, Mover, closed_by, solve

#: Random starts beside the stated configuration, their largest motions in radians and parts of the size, and the seed.
_STARTS, _FAR, _SEED = 4, (0.1, 0.3, 1.0), 0
#: Steps of the Levenberg-Marquardt method: these loops need 60 to 140.
_MOST_STEPS = 300
#: Factors of the damping after a step that reduces the squares, and after one that does not; its smallest and largest.
_SMALLER, _LARGER, _LEAST_DAMPING, _MOST_DAMPING = 0.2, 4.0, 1e-10, 1e12
#: Largest step, and the largest part of a vector of equations that a step may still take away at the end.
_MOST_WAY, _STATIONARY = 1.0, 1e-9


def close_from_other_starts(given: Description, size: float) -> Closed | None:
    """Return a description with its loops closed from another start; None where none of a few closes them."""
    for kept in (True, False):
        for mover in _movers(given, size, kept=kept):
            if _least_squares(mover) <= LEAST and solve(mover) <= LEAST:
                return closed_by(mover, kept=kept)
    return None


def least_gaps(given: Description, size: float) -> dict[str, float]:
    """Return loops that do not close by themselves, all others cut and no actuator held.

    Returns:
        The largest equation at the smallest sum of squares that was found, by the loop's name, in parts of the size.
    """
    parts = [replace(given, closures=(each,), couplings=()) for each in given.closures]
    found = {each.closures[0].name: _least_of(each, size) for each in parts}
    return {name: value for name, value in found.items() if value > LEAST}


def _least_of(given: Description, size: float) -> float:
    """Return the largest equation of the start that comes closest."""
    least = float("inf")
    for mover in _movers(given, size, kept=False):
        least = min(least, _least_squares(mover))
        if least <= LEAST:
            break
    return least


def _movers(given: Description, size: float, *, kept: bool) -> Iterator[Mover]:
    """Yield joints where the model stands, and at random positions, some near and some far."""
    rng = np.random.default_rng(_SEED)
    for k in range(1 + _STARTS):
        mover = Mover(given, size, keeps_driven=kept)
        if k:
            mover.step(rng.uniform(-1, 1, mover.count) * _FAR[k % len(_FAR)] * _scales(mover))
        yield mover


def _scales(mover: Mover) -> FloatArray:
    """Return the unit (n,) of each coordinate: the size for a slide and for the position of a free body, else 1."""
    scales = np.ones(mover.count)
    for body, place in mover.index.items():
        joint = mover.joint_of.get(body)
        if joint is None:
            scales[place][3:] = mover.size
        elif joint.kind == "P":
            scales[place] = mover.size
    return scales


def _least_squares(mover: Mover) -> float:
    """Move the joints to a smallest sum of squares by the Levenberg-Marquardt method; return the largest equation."""
    scales, damping = _scales(mover), 1.0
    values, derivatives = mover.state()
    for _ in range(_MOST_STEPS):
        J, size = derivatives * scales, float(np.linalg.norm(values))
        if not size or float(np.linalg.norm(J.T @ values)) <= _STATIONARY * size or damping > _MOST_DAMPING:
            break
        way = -np.linalg.solve(J.T @ J + damping * np.eye(mover.count), J.T @ values)
        way *= min(1.0, _MOST_WAY / float(np.linalg.norm(way)))
        before = dict(mover.own), dict(mover.coordinates)
        mover.step(scales * way)
        values, derivatives = mover.state()
        if float(np.linalg.norm(values)) < size:
            damping = max(damping * _SMALLER, _LEAST_DAMPING)
        else:
            mover.own, mover.coordinates = before
            values, derivatives = mover.state()
            damping *= _LARGER
    return float(np.abs(values).max(initial=0.0))

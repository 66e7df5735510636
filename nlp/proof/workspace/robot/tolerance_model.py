"""All machines within a tolerance."""

import numpy as np

from .....models import FloatArray
from ...statement.machine import INSIDE
from .posed_robot import Problem as ToleranceModel
from .posed_robot import family_of

__all__ = ["ToleranceModel", "family_of", "steepest"]


def steepest(slopes: FloatArray, tolerance: float) -> FloatArray:
    """Return errors (..., 3) as large as a tolerance along derivatives by them; none along derivatives of zero."""
    sizes = np.linalg.norm(slopes, axis=-1, keepdims=True)
    # A sum with zero has no negative zero.
    return np.asarray(INSIDE * tolerance * slopes / np.maximum(sizes, np.finfo(float).tiny) + 0.0)

"""All machines within a tolerance."""

from .posed_robot import Problem as ToleranceModel
from .posed_robot import family_of

__all__ = ["ToleranceModel", "family_of"]

"""Robots given joint by joint: limbs as chains of joints become the rows, unknowns and loop equations of a model.

The small language of a robot's numbers is :mod:`screwsynth.models.expression`. A robot passes four stages, each of
which imports only those before it: ``written`` (as it is written), ``home`` (at home), ``posed`` (at any pose), and
``model`` (its model).

The model is imported from ``model.robot`` itself, or as :func:`screwsynth.models.robot`: an import of one module, or of
the kinds of faults, does not load them all.
"""

from ..expression import ExpressionError
from .written.forms import RobotError

__all__ = ["ExpressionError", "RobotError"]

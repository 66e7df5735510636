"""Robots given joint by joint: from chains of joints to rows of J, unknowns and loop equations of a model.

Dimensions and points are expressions of :mod:`screwsynth.models.expression`. A robot passes four stages, each of which
imports only earlier ones: ``written`` (as it is written), ``home`` (at home), ``posed`` (at any pose), and ``model``
(its model).

Import the model from ``model.robot`` or as :func:`screwsynth.models.robot`: this package itself loads no module.
"""

from ..expression import ExpressionError
from .written.forms import RobotError

__all__ = ["ExpressionError", "RobotError"]

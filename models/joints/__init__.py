"""Robots given joint by joint: limbs as chains of joints become the rows, unknowns and loop equations of a model.

The small language of a robot's numbers is :mod:`screwsynth.models.expression`. The modules in order, each of which
imports only those before it: ``motion`` (displacements and screws as symbols), ``forms`` (forms of the values of a
robot as it is written), ``words`` (a robot as it is written), ``chain`` (joints, limbs and links at home),
``mechanisms`` (robots in numbers), ``generic`` (ranks at random dimensions), ``faults`` (joints that contradict
themselves, and almost parallel axes), ``cut`` (the joint at which a limb's loop is opened), ``opened`` (the opened
limb: current screws and equations), ``modes`` (signs of home's assembly), ``resistance`` (rows and members of a limb),
``states`` (joints' coordinates from home, and links), ``straight`` (limbs that are straight legs), ``loops``
(independent loop equations), ``network`` (nested loops at any pose), ``nested`` (their members and actuators),
``placed`` (joints at any pose), ``pictures`` (the drawing), ``modelparts`` (measured and listed parts of the model),
``robot`` (the model), ``centres`` (the model with errors of joint centres), ``replacing`` and ``elimination``
(unknowns that follow one after the other, of any dimensions),
``closedform`` (a model without unknowns that follow from the pose in closed form).

The model is imported from ``robot`` itself, or as :func:`screwsynth.models.robot`: an import of one module, or of the
kinds of faults, does not load them all.
"""

from ..expression import ExpressionError
from .forms import RobotError

__all__ = ["ExpressionError", "RobotError"]

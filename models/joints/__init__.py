"""Robots given joint by joint: limbs as chains of joints become the rows, unknowns and loop equations of a model.

The modules in order, each of which imports only those before it: ``expression`` (the small language of a robot's
numbers), ``motion`` (displacements and screws as symbols), ``words`` (a robot as it is written), ``chain`` (joints and
limbs with their symbols), ``cut`` (the joint at which a limb's loop is opened), ``opened`` (the opened limb: current
screws and equations), ``generic`` (ranks at random dimensions), ``resistance`` (rows and members of a limb), ``loops``
(independent loop equations), ``pictures`` (the drawing), ``robot`` (the model).
"""

from .expression import ExpressionError
from .forms import RobotError
from .robot import robot

__all__ = ["ExpressionError", "RobotError", "robot"]

"""Last stage of a robot given joint by joint: its model, also with joint-centre errors or eliminated unknowns.

``pictures`` (drawing), ``modelparts`` (ranks, actuators and structure of the model), ``robot`` (the model), ``centres``
(the model with joint-centre errors), ``replacing`` and ``elimination`` (elimination of unknowns one after the other,
for any dimensions), ``closedform`` (a model without unknowns that have a closed form).
"""

"""Last stage of a robot given joint by joint: its model, also with joint-centre errors, or without some unknowns.

``pictures`` (the drawing), ``modelparts`` (measured and listed parts of the model), ``robot`` (the model), ``centres``
(the model with joint-centre errors), ``replacing`` and ``elimination`` (unknowns that follow one after the other, of
any dimensions), ``closedform`` (a model without unknowns that follow from the pose in closed form).
"""

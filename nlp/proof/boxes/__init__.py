"""Branch and bound over boxes.

The modules import each other in this order: ``engine`` (examination of boxes by the C kernel, on threads), ``search``
(the loop of every search), ``tree`` (record of a search for a proof), ``incumbent``, ``symmetry``, ``optimum``, and
the room ``limbs`` (decomposition into limbs).
"""

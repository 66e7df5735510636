"""Branch and bound over boxes.

The modules import each other in this order: ``engine`` (the examination by the C kernel, on threads), ``search`` (the
one loop), ``tree`` (its record for a proof), ``incumbent``, ``symmetry``, ``optimum``, and the room ``limbs``
(decomposition into limbs).
"""

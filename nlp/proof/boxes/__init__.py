"""Branch and bound over boxes.

The modules import each other in this order: ``threads`` and ``engine`` (the examination by the C kernel), ``rows`` and
``search`` (the one loop), ``tree`` (its record for a proof), ``incumbent``, ``symmetry``, ``optimum``, and the room
``limbs`` (F taken apart into limbs).
"""

"""Branch and bound over boxes.

The modules import each other in this order: ``examination`` (results), ``tapes`` (a form as operations), ``threads``
and ``engines`` (the examination by the C kernel), ``rows`` and ``search`` (the one loop), ``proof_writer``,
``incumbent``, ``symmetry``, ``optimum``, and the room ``limbs`` (F taken apart into limbs).
"""

"""Branch and bound over boxes.

The modules import each other in this order: ``examination`` (results), ``tapes`` (a form as operations), ``threads`` and
``engines`` (the examination by the C kernel), ``open_boxes``,
``proof_writer``, ``incumbent``, ``symmetry``, ``search``, and the room ``limbs`` (F taken apart into limbs).
"""

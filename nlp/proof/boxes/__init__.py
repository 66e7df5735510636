"""Branch and bound over boxes.

The modules import each other in this order: ``examination`` (results), ``first_pass``, ``tapes`` (a form as
operations), ``bounding``, ``threads`` and ``engines`` (the examination in NumPy and in C), ``open_boxes``,
``proof_writer``, ``incumbent``, ``symmetry``, ``search``, and the room ``limbs`` (F taken apart into limbs).
"""

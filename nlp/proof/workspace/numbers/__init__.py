"""Proven smallest and largest values of numbers over a workspace.

``extremes`` (by the certificate's search) bounds expressions, and ``loop_limits`` limits in home's assembly.
``bound_search`` is branch and bound of a number with bounds of its own over boxes: ``left_inverse`` and
``singular_values``, ``clearance``, ``pose_error``. ``searched`` has the claims about these, and ``strokes`` those that
follow from lengths of legs.
"""

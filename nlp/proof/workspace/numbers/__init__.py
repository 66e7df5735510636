"""Proven smallest and largest values of numbers over a workspace.

``extremes`` (by the certificate's search) and ``strokes`` come from expressions; ``bound_search``, ``clearance``,
``singular``, ``pose_error`` and ``leg_numbers`` are branch and bound for numbers of six straight legs that are no
single expression. ``limit_values``, ``spectrum`` and ``loop_limits`` have numbers of robots with loops,
``robot_limits`` the limits of robots that are not six straight legs, ``asked_values`` singular values that no limit
asks for.
"""

"""The formulas of the C kernel in NumPy, box by box the same: the reference that tests hold the kernel against.

The modules import each other in this order: ``intervals``, ``univariate``, ``first_order`` and ``second_order`` (forms
of an expression), ``quadratic_models``, ``squared_quotients``, ``tangent_bounds``, ``first_pass``, ``bounding`` (the
examination of boxes), ``limb_models`` and ``rank_rule``.
"""

"""Ranges of expressions over boxes, with rounding.

The modules import each other in this order: ``engine`` (C or NumPy), ``tape`` and ``instructions`` (an expression graph
as a list), ``intervals``, ``univariate``, ``first_order`` and ``second_order`` (forms of an expression),
``squared_quotients``, ``quadratic_models`` (bounds of sums), ``tangent_bounds``, ``forms`` (of many expressions). The
kernel in C has one header an idea.
"""

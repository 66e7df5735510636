"""Ranges of expressions over boxes, with rounding.

The modules import each other in this order: ``engine`` (the C kernel), ``tape`` (an expression graph as a list),
``forms`` (of expressions, and bounds of their sums) and ``squared_quotients`` (sums taken apart). The kernel in C has
one header an idea.
"""

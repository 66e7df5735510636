"""Ranges of expressions over boxes, including rounding errors.

The modules import each other in this order: ``engine`` (the C kernel), ``tape`` (an expression graph as a list of
operations), ``forms`` (forms and quadratic models of expressions) and ``squared_quotients`` (sums of squares).
The C kernel has one header for each idea.
"""

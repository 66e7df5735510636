"""Ranges of expressions over boxes, with rounding.

The modules import each other in this order: ``tape`` and ``instructions`` (an expression graph as a list),
``intervals``, ``univariate``, ``enclosure`` (forms of first order), ``secondorder`` and ``quotients`` (forms of
second order), ``quadratic`` (bounds of sums).
"""

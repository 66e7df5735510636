"""Searches from many points by the solver of generated C, in this process and without a compiler.

They tell quickly where optima are; what they find is no answer before a solver and the evidence confirm it.
"""

"""Searches from many points by the solver of generated C, in this process and without a compiler.

They find optima quickly; a point is no answer before a solver and the evidence confirm it.
"""

"""Fast searches from many points by the solver of generated C, in this process and without a compiler.

A point is an answer only after a solver and the evidence confirm it.
"""

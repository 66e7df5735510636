"""Proofs for every point of a box, and their checker. Nothing here imports a solver.

The rooms import each other in this order:

* ``statement``: the claims, for search and checker alike;
* ``enclosure``: ranges of expressions over boxes, in C and in NumPy;
* ``boxes``: branch and bound;
* ``certificate``: the global optimum of a program;
* ``workspace``: a robot at every pose of a box.

``checker`` reads proofs and checks them with its own arithmetic and rules. It imports ``statement`` alone.
"""

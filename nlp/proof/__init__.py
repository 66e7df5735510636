"""Proofs for every point of a box, and the checker of proof files. Nothing here imports a solver.

The packages import each other in this order:

* ``statement``: claims, shared by searches and checker;
* ``enclosure``: ranges of expressions over boxes, in C and in NumPy;
* ``boxes``: branch and bound;
* ``certificate``: bounds of the global optimum of a nonlinear program;
* ``workspace``: a robot at every pose of a box, or of a tool path.

``checker`` reads proof files and checks them with independent arithmetic and rules. It imports only ``statement``.
"""

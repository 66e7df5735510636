"""Regular poses of any robot, over a box of poses: rows as expressions, passive joints with loop equations.

The modules import each other in this order: ``problem`` (a robot as loop equations and sparse matrices of the
coordinates), ``matrices`` (whose rank is judged), ``assembled`` (closed loops followed by Newton's method),
``enclosing`` (forms over boxes, in C or NumPy), ``relation`` (what the loops say of passive joints over a box),
``rank`` (the test of a matrix), ``singularpose`` (Newton's method for a singular pose) and ``search``.
"""

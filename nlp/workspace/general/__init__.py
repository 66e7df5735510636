"""Regular poses of any robot, and numbers of it, over a box of poses.

The modules import each other in this order:

* ``assembled`` (closed loops followed by Newton's method), ``enclosing`` (forms over boxes, in C or NumPy),
  ``matrices`` (whose rank is judged), ``problem`` (a robot as loop equations and sparse matrices of the coordinates),
  ``family`` (every machine within a tolerance);
* ``relation`` (how passive joints follow over a box), ``rank`` (the test of a matrix), ``cells`` (boxes of a search),
  ``connected`` (of one assembly), ``covering`` (of a workspace);
* ``limitvalues`` and ``spectrum`` (numbers over boxes), ``machinepoints`` and ``machinenumber`` (their smallest value
  over machines);
* ``singularpose`` and ``singularmachine`` (Newton's method for a singular one), and ``search`` (ranks).
"""

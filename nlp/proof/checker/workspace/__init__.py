"""Proofs of workspaces on paper, and their checker, which uses nothing of the search.

The modules import each other in this order:

* ``tree`` (leaves of poses) and ``expected`` (claims that a proof must name);
* about every machine within a tolerance: ``built``, whose ``statement`` both sides have;
* the check: ``poseroot`` (the box of coordinates), ``ballslopes`` (arithmetic), ``ballrows``
  (rows of legs), ``pieces`` (bisection), ``positive`` (positive definite matrices), ``rankclaim`` and
  ``clearanceclaim`` (claims about boxes), ``inverserows`` (the inverse of the rows), ``singularclaim`` and
  ``errorclaim`` (claims that need it), ``anyrobot`` (ranks of robots that are not six straight legs),
  ``comparing`` (with the case), and ``check``.
"""

"""Proofs of workspaces on paper, and their checker, which uses nothing of the search.

The modules import each other in this order, and who checks a proof imports nothing of who made it:

* both sides: ``document`` (a proof as JSON), ``tree`` (boxes as bytes) and ``expected`` (claims that it must name);
* the search: ``record`` (trees of searches) and ``written`` (the document of a judgement);
* about every machine within a tolerance: ``built``, whose ``statement`` both sides have;
* the check: ``exactly`` (fractions), ``poseroot`` (the box of coordinates), ``ballslopes`` (arithmetic), ``ballrows``
  (rows of legs), ``pieces`` (bisection), ``positive`` (positive definite matrices), ``rankclaim`` and
  ``clearanceclaim`` (claims about boxes), ``inverserows`` (the inverse of the rows), ``singularclaim`` and
  ``errorclaim`` (claims that need it), ``anyrobot`` (ranks of robots that are not six straight legs),
  ``comparing`` (with the case), and ``check``.
"""

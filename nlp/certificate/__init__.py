"""Proven bounds of the global optimum over the whole box, and their proofs. Nothing here imports a solver.

The modules import each other in this order, and who checks a proof imports nothing of who made it:

* both sides: ``standardform`` (a program as functions and conditions), ``proof`` (a proof as JSON and bytes);
* the search: ``instructions`` (an expression graph as a list), ``intervals``, ``univariate`` and ``enclosure`` (ranges
  over boxes), ``quadratic`` (bounds of sums), ``examination`` (results), ``bounding`` and ``engines`` (the
  examination of boxes, in NumPy and in C), ``openboxes``, ``incumbent``, ``certificate``, ``branchandbound`` and
  ``proofwriter``;
* the check: ``prooftree`` (claims of a proof), ``slopes``, ``slopebounds``, ``slopeweights``, ``slopecut`` and
  ``proofcheck``.
"""

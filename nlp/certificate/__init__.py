"""Proven bounds of the global optimum over the whole box, and their proofs. Nothing here imports a solver.

The modules import each other in this order, and who checks a proof imports nothing of who made it:

* both sides: ``kinks`` (derivatives of fmin and fmax), ``standardform`` (a program as functions and conditions),
  ``separation`` (its limbs), ``proof`` (a proof as JSON and bytes);
* the search: ``tape`` and ``instructions`` (an expression graph as a list), ``intervals``, ``univariate``,
  ``enclosure`` and ``secondorder`` (ranges over boxes), ``quadratic`` (bounds of sums), ``examination`` (results),
  ``firstpass``, ``bounding`` and ``engines`` (the examination of boxes, in NumPy and in C), ``limbmodels`` (upper
  models of limbs), ``openboxes``, ``incumbent``, ``certificate``, ``proofwriter``, ``boxsearch``, ``limbsearch``,
  ``ownboxes``, ``limbsums``, ``sharedcuts``, ``sharedsearch`` and ``branchandbound``;
* the check: ``prooftree`` (claims of a proof), ``slopes``, ``slopebounds``, ``slopeweights``, ``slopecut`` and
  ``proofcheck``.
"""

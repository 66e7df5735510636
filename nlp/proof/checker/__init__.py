"""Proofs as files, and their checker, which imports nothing of the search.

The modules import each other in this order: ``proof`` (JSON and bytes), ``premises`` (the program of a case, and the
claim in words), ``prooftree`` (claims of a proof), ``intervals`` and ``arithmetic`` (what both arithmetics share),
``slopes``, ``slopebounds``, ``slopeweights``, ``slopecut``, ``polynomials``, ``polynomialrules``, ``polymodels``,
``optimum``, ``wrongclaims``, the room ``limbs`` (limbs that share variables) and ``proofcheck``. Proofs of a whole box
and of independent limbs are checked by polynomials. ``fractions`` and the room ``workspace`` serve proofs about poses.
"""

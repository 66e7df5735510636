"""Proofs as files, and their checker, which imports nothing of the search.

The modules import each other in this order: ``proof`` (JSON and bytes), ``statement`` (the program of a case, and the
claim in words), ``prooftree`` (claims of a proof), ``ends`` and ``operations`` (what both arithmetics share),
``slopes``, ``slopebounds``, ``slopeweights``, ``slopecut``, ``polynomials``, ``polynomialrules``, ``polymodels``,
``showing``, ``wrongclaims``, the room ``limbs`` (limbs that share variables) and ``proofcheck``. Proofs of a whole box
and of independent limbs are checked by polynomials.
"""

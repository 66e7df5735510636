"""Proofs as files, and their checker, which imports the statement of what is proved and nothing of the search.

The modules import each other in this order: ``proof_file`` (JSON), ``tree`` (boxes as bytes), ``bisection`` (the loop
that shows claims), ``fingerprint`` and ``premises`` (the program of a case, and the claim in words), ``parts`` (claims
of a proof about a program), ``intervals`` and ``arithmetic`` (what both arithmetics share), ``slopes``,
``slopebounds``, ``slopeweights``, ``slopecut``, ``polynomials``, ``polynomialrules``, ``polymodels``, ``optimum``,
``wrongclaims``, the room ``limbs`` (limbs that share variables) and ``proofcheck``. Proofs of a whole box and of
independent limbs are checked by polynomials. ``fractions`` and the room ``workspace`` serve proofs about poses.
"""

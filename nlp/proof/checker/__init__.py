"""Proofs as files, and their checker, which imports the statement of what is proved and nothing of the search.

The modules import each other in this order: ``proof_file`` (JSON), ``tree`` (boxes as bytes, and what their leaves
claim), ``bisection`` (the loop that shows claims), ``premises`` (the program of a case, and the claim in words),
``intervals`` and ``arithmetic`` (what both arithmetics share), ``slopes`` and ``polynomials`` (the arithmetics),
``polymodels`` (weighted sums of polynomials), ``optimum`` (rules of claims about a program) and ``check``. Proofs of a
program are checked by polynomials. ``fractions``, ``slopes`` and the room ``workspace`` serve proofs about poses.
"""

"""Proof files and their checker. The checker shares the statement of claims with the search, and nothing else.

The modules import each other in this order: ``packed`` (trees in files, and their budget), ``proof_file`` (JSON),
``tree`` (boxes as bytes, and the claims of their leaves), ``bisection`` (the loop that proves claims), ``premises``
(the program of a case, and the claim in words), ``polynomials`` (values over boxes, and the rules of operations on
them), ``arithmetic`` (operations of CasADi's graphs), ``polymodels`` (weighted sums of polynomials), ``optimum`` (rules
for claims about a program) and ``check``. ``fractions`` and the room ``workspace`` serve proofs about poses.
"""

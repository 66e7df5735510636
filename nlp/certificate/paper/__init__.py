"""Proofs as files, and their checker, which imports nothing of the search.

The modules import each other in this order: ``proof`` (JSON and bytes), ``prooftree`` (claims of a proof), ``slopes``,
``slopebounds``, ``slopeweights``, ``slopecut``, the room ``limbs`` (limbs that share variables) and ``proofcheck``.
"""

"""Proofs of limbs that share variables, and their check.

The modules import each other in this order: ``squares`` (squared quotients), ``tilts`` (quadratic functions of shared
variables), ``sharedtree`` (bytes of a proof), ``tilted`` (upper models without tilts), ``limbclaims`` (bounds of one
limb over boxes) and ``sharedcheck``.
"""

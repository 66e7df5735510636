"""Checks of proofs by limbs.

The modules import each other in this order: ``squares`` (squared quotients), ``tilts`` (quadratic functions of shared
variables), ``sharedtree`` (bytes of a proof), ``tilted`` (upper models without tilts), ``limbclaims`` (bounds of one
limb over boxes), ``limbpart`` (limbs that share none) and ``sharedcheck``.
"""

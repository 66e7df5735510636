"""Searches that take F apart into limbs.

The modules import each other in this order: ``independent`` (limbs that share no variable); ``models`` (upper models of
limbs), ``boxes``, ``sums``, ``cuts`` and ``shared`` (limbs that share some).
"""

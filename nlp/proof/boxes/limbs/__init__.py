"""Searches that take F apart into limbs.

The modules import each other in this order: ``independent`` (limbs that share no variable); ``boxes``, ``sums``,
``cuts`` and ``shared`` (limbs that share some).
"""

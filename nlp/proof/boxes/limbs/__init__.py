"""Searches of F decomposed into limbs.

The modules import each other in this order: ``independent`` (limbs that share no variable); ``decomposition`` (bounds
of limbs that share some) and ``shared`` (their search).
"""

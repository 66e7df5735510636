"""Searches of F by decomposition into limbs.

The modules import each other in this order: ``independent`` (limbs without shared variables); ``decomposition`` (bounds
of limbs with shared variables) and ``shared`` (their search).
"""

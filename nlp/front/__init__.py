"""Fronts of two goals: the best of one for each bound of the other.

The modules import each other in this order: ``goals``, ``programs``, ``front``.
"""

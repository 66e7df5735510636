"""Fronts of several goals: the best of one for bounds of the others.

The modules import each other in this order: ``goals``, ``boxes``, ``front``, ``data``.
"""

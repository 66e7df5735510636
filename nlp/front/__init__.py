"""Pareto fronts of several goals of a case.

The modules import each other in this order: ``goals``, ``boxes``, ``front``, ``data``.
"""

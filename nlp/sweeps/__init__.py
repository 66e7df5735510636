"""Sweeps: one case solved at thousands of values of its fixed parameters, bounds or limits.

The modules import each other in this order: ``points``, ``journal``, ``places``, ``engines``, ``workers``, ``sweep``,
``columns``.
"""

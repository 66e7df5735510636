"""Comparison of robots on one task: each robot in the place of the case's own, scaled to one size, then solved.

The modules import each other in this order: ``robots``, ``entry``, ``compare``, ``data``.
"""

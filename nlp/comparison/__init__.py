"""Comparison of robots on one case: each robot replaces the robot of the case, is scaled to a common size, and solved.

The modules import each other in this order: ``robots``, ``entry``, ``compare``, ``data``.
"""

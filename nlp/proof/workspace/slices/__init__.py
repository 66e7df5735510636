"""Slices through a workspace.

The modules import each other in this order: ``regions``, ``limitcells`` (limits on boxes), ``firstviolated``;
``anylimits``, ``assemblies`` and ``anyslice`` (any robot); ``slices`` (planes covered by boxes).
"""

"""Programmed paths: files of poses and of G-code, read as segments whose poses are known at every point.

``orientation`` and ``arcs`` have formulas, ``options``, ``idle`` and ``path`` values; ``words`` reads a line of G-code,
``gcode`` a program, ``poses_csv`` a table of poses, and ``reader`` chooses between them.
"""

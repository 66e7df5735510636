"""Tool paths: G-code programs and tables of poses, read as segments with a pose at every point.

``orientation`` and ``arcs`` contain formulas, ``options``, ``idle`` and ``path`` values; ``words`` reads a line of
G-code, ``gcode`` a program, ``poses_csv`` a table of poses, and ``reader`` chooses between them.
"""

"""Tool paths: G-code programs and tables of poses, read as segments with a pose at every point.

``orientation`` and ``arcs`` contain formulas; ``options``, ``idle`` and ``path`` contain data classes. ``words`` reads
a line of G-code, ``gcode`` a program, ``poses_csv`` a table of poses; ``reader`` calls ``gcode`` or ``poses_csv``.
"""

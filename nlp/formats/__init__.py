"""Import and export of robots in the formats of other programs.

``reading`` imports MJCF and URDF; ``solved`` converts a solved case to a mechanism, ``writing`` a mechanism to files,
and ``export`` runs both. ``frames`` (frames and rotations) and ``extra`` (optional libraries) are used by all of them.
"""

"""Robots in the formats of other programs.

The rooms: ``reading`` takes descriptions in; ``solved`` makes a mechanism of a solved case, and ``writing`` makes files
of a mechanism; ``export`` does both. ``frames`` (places and rotations) and ``extra`` (libraries that only some formats
need) serve all of them.
"""

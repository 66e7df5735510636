"""Robots in the formats of other programs.

The rooms: ``reading`` takes descriptions in; ``solved`` makes a mechanism of a solved case, and ``writing`` makes files
of a mechanism; ``export`` does both.
"""

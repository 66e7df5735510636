"""Descriptions of robots in other programs' formats: ``reading`` takes them in."""

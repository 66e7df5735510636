"""Colours and numbers that look the same in picture files and on pages."""

from __future__ import annotations

#: Blue shortens, grey stays, orange lengthens: distinct with any colour blindness, and never as light as paper.
RATE_COLOURS = ("#08519c", "#3f86c4", "#9aa3ab", "#e08a3c", "#b34700")
#: Forces and moments of loads, forces of legs that push and that pull the platform, and of actuators on their slides.
FORCE_COLOURS = {"load": "#007a87", "moment": "#007a87", "push": "#b5005b", "pull": "#00703c", "drive": "#b5005b"}
#: Distance of the arrow of a force from its leg or slide, in parts of the robot's size.
BESIDE = 0.045


def signed_text(value: float) -> str:
    """Return a number with its sign and three digits, for people."""
    return f"{value:+.3g}".replace("-", "\N{MINUS SIGN}")


def rate_text(value: float) -> str:
    """Return a rate with its sign and as many digits as the tables of results have."""
    return f"{value + 0.0:+.6g}".replace("-", "\N{MINUS SIGN}")

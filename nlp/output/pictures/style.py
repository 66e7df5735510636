"""Common colours and number formats of picture files and pages."""

from __future__ import annotations

#: Colours of rates: blue for shortening, grey for zero, orange for lengthening; distinct with any colour blindness.
RATE_COLOURS = ("#08519c", "#3f86c4", "#9aa3ab", "#e08a3c", "#b34700")
#: Colours of load forces and moments, of legs in compression and in tension, and of actuator forces on slides.
FORCE_COLOURS = {"load": "#007a87", "moment": "#007a87", "push": "#b5005b", "pull": "#00703c", "drive": "#b5005b"}
#: Distance of the arrow of a force from its leg or slide, as a fraction of the robot's size.
BESIDE = 0.045


def signed_text(value: float) -> str:
    """Return the text of a number with its sign and three digits."""
    return f"{value:+.3g}".replace("-", "\N{MINUS SIGN}")


def rate_text(value: float) -> str:
    """Return the text of a rate with its sign, with the digits of the tables of results."""
    return f"{value + 0.0:+.6g}".replace("-", "\N{MINUS SIGN}")

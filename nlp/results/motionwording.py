"""Motions and wrenches in words: axis, point and pitch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..units import Units
from .rounding import NOISE, number, settled

if TYPE_CHECKING:
    from .motiondata import MotionData, WrenchData


def motion_words(motion: MotionData, units: Units, size: float = 0.0, part: float = NOISE) -> str:
    """Return a motion in words: its axis, point and pitch.

    Args:
        motion: of the platform.
        units: of the case.
        size: length that the motion was computed from, beside which its point and pitch have rounding error.
        part: error bound of its pitch, as a part of this length.
    """
    if motion.point is None or motion.pitch == "inf":
        return f"translation along {triple(motion.axis, 1.0)}"
    reach = reach_of(motion, size)
    return f"{screw_words(motion, units, reach, part)} through {triple(motion.point, reach)}"


def screw_words(motion: MotionData, units: Units, size: float, part: float = NOISE) -> str:
    """Return pitch and axis of a motion that is no translation; other arguments are those of :func:`motion_words`."""
    pitch = settled(0.0 if motion.pitch == "inf" else motion.pitch, size, part)
    words = f"screw of pitch {pitch:.5g} {units.length}" if pitch else "rotation"
    return f"{words} about {triple(motion.axis, 1.0)}"


def reach_of(motion: MotionData, size: float) -> float:
    """Return the length beside which a motion's point and pitch have rounding error: |v| / |omega| at least."""
    omega, v = math.hypot(*motion.twist[:3]), math.hypot(*motion.twist[3:])
    return max(size, v / omega if omega else 0.0)


def triple(values: Sequence[float], size: float) -> str:
    """Return three numbers in parentheses, 0 where they are rounding error beside a size."""
    return f"({', '.join(number(value, size, digits=4) for value in values)})"


def wrench_words(wrench: WrenchData, units: Units, size: float) -> str:
    """Return a wrench in words; the arguments are those of :func:`motion_words`."""
    if wrench.point is None or wrench.pitch == "inf":
        return f"couple about {triple(wrench.axis, 1.0)}"
    pitch = settled(wrench.pitch, size)
    words = f"wrench of pitch {pitch:.5g} {units.length}" if pitch else "force"
    return f"{words} along {triple(wrench.axis, 1.0)} through {triple(wrench.point, size)}"

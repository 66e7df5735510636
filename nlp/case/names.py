"""Names of a case's own numbers: of the robot's parameters, and of position and rotation of each stated pose.

A robot may give its parameters any names. A parameter, or a component of one, that has the name of a number of a
pose, such as ``p_x``, is written ``robot.p_x``.
"""

from __future__ import annotations

from functools import lru_cache

from ...models import component_names

#: Stands before the name of a parameter that a pose uses too.
_ROBOT = "robot."


def pose_prefixes(count: int) -> tuple[str, ...]:
    """Return the prefix of the names of each stated pose's numbers; an empty one for a single pose.

    Args:
        count: number of stated poses.
    """
    return ("",) if count == 1 else tuple(f"pose{k + 1}_" for k in range(count))


@lru_cache
def pose_numbers(count: int) -> frozenset[str]:
    """Return the names of position, axis and angle of every stated pose.

    Args:
        count: number of stated poses.
    """
    parts = (*component_names("p", 3), "angle", "axis")
    return frozenset(f"{prefix}{part}" for prefix in pose_prefixes(count) for part in parts)


def parameter_name(name: str, count: int) -> str:
    """Return the name of a parameter, or of one of its components, in a case; different names stay different.

    Args:
        name: the name that the robot gives it.
        count: number of stated poses of the case.
    """
    return f"{_ROBOT}{name}" if name in pose_numbers(count) or name.startswith(_ROBOT) else name

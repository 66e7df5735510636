"""Names of a case's quantities: parameters of the robot, and position and rotation of each stated pose.

A robot may give its parameters any names. A parameter or component with the name of a pose coordinate, such as
``p_x``, is written ``robot.p_x``.
"""

from __future__ import annotations

from functools import lru_cache

from ...models import component_names

#: Prefix of a parameter whose name is also that of a pose coordinate.
_ROBOT = "robot."


def pose_prefixes(count: int) -> tuple[str, ...]:
    """Return the prefix of the coordinate names of each stated pose; empty for a single pose.

    Args:
        count: number of stated poses.
    """
    return ("",) if count == 1 else tuple(f"pose{k + 1}_" for k in range(count))


@lru_cache
def pose_names(count: int) -> frozenset[str]:
    """Return the names of position, axis and angle of every stated pose.

    Args:
        count: number of stated poses.
    """
    parts = (*component_names("p", 3), "angle", "axis")
    return frozenset(f"{prefix}{part}" for prefix in pose_prefixes(count) for part in parts)


def name_of_task(name: str, task: int) -> str:
    """Return the name of a dimension of one task, such as ``x1.task2``.

    Args:
        name: name of the dimension in the case.
        task: index of the task.
    """
    return f"{name}.task{task + 1}"


def parameter_name(name: str, count: int) -> str:
    """Return the name of a parameter or component in a case, which differs from all names of pose coordinates.

    Args:
        name: name of the parameter or component in the robot.
        count: number of stated poses of the case.
    """
    return f"{_ROBOT}{name}" if name in pose_names(count) or name.startswith(_ROBOT) else name

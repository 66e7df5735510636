"""The registry of all types of limits, and the table ``[limits]`` of a case file that follows from it.

To add a limit, write a subclass of :class:`~.limit.Limit` in a file of its own, and add it to :data:`LIMIT_TYPES`. A
case without limits does not load this module: the tables need pydantic, which takes longer to import than the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import ConfigDict, Field, create_model

from ..table import Table
from .clearance import LegClearance, LinkClearance
from .forces import ActuatorForce, ActuatorPower, ActuatorSpeed, Deflection
from .interval import IntervalTable, QuantityLimit
from .joint_motion import JointCone, JointMotion
from .joints import BaseJointAngle, PlatformJointAngle
from .legs import Actuator, LegLength
from .limit import Limit
from .plates import Footprint, JointSpacing, RadiusRatio
from .rates import ActuatorRate, RateShare
from .relation import Relations
from .singular_values import ConditionNumber, SmallestSingularValue

#: Every type of limit, in the order of documentation and messages.
LIMIT_TYPES: tuple[type[Limit[Any]], ...] = (
    LegLength,
    Actuator,
    BaseJointAngle,
    PlatformJointAngle,
    JointSpacing,
    Footprint,
    RadiusRatio,
    LegClearance,
    LinkClearance,
    ConditionNumber,
    SmallestSingularValue,
    ActuatorRate,
    ActuatorForce,
    ActuatorSpeed,
    ActuatorPower,
    Deflection,
    JointMotion,
    JointCone,
    RateShare,
    Relations,
    QuantityLimit,
)


class _OpenTable(Table):
    """Limits that a design must keep to be built; other keys are measures that the robot itself has."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, IntervalTable]

    over: Literal["poses", "workspace", "path"] = Field(
        default="poses",
        description="whether the limits hold at the stated poses alone, or over the workspace or along the path too",
    )


if TYPE_CHECKING:
    LimitsTable: TypeAlias = _OpenTable
else:
    #: The table ``[limits]`` of a case file.
    LimitsTable = create_model(
        "LimitsTable",
        __base__=_OpenTable,
        __doc__=_OpenTable.__doc__,
        __module__=__name__,
        **{key: tuple(field) for kind in LIMIT_TYPES for key, field in kind.fields().items()},
    )

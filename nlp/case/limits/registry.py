"""Registry of all limit types, and the table ``[limits]`` of case files.

To add a limit, write a subclass of :class:`~.limit.Limit` in a new file, and add it to :data:`LIMIT_TYPES`. A case
without limits does not import this module, because pydantic builds its tables slowly.
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

#: All limit types, in the order of documentation and messages.
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
    """Limits that a design must satisfy to be buildable; other keys are quantities that the robot's file defines."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, IntervalTable]

    over: Literal["poses", "workspace", "path"] = Field(
        default="poses",
        description="poses at which the limits must hold: poses: the stated poses; workspace or path: also every pose "
        "of the workspace or along the tool path",
    )


if TYPE_CHECKING:
    LimitsTable: TypeAlias = _OpenTable
else:
    #: Table ``[limits]`` of a case file.
    LimitsTable = create_model(
        "LimitsTable",
        __base__=_OpenTable,
        __doc__=_OpenTable.__doc__,
        __module__=__name__,
        **{key: tuple(field) for kind in LIMIT_TYPES for key, field in kind.fields().items()},
    )

"""The table ``[limits.joint]`` of a case file, and how it names joints of a robot given joint by joint."""

from __future__ import annotations

import abc
from collections.abc import Iterator
from typing import ClassVar, NamedTuple, Self

from pydantic import Field, FiniteFloat

from ....models import Model
from ....models.limbjoints import LimbJoint
from ...errors import CaseError, listing
from ...units import Units
from ..table import Table, Vector
from .interval import IntervalTable
from .limit import Limit, Written

#: Keys of a table that limit one of several coordinates of a joint.
PARTS = ("first", "second", "angle", "stroke")
#: So many joints are listed in a message.
_LISTED = 12


class JointTable(IntervalTable):
    """The motion of a joint from home."""

    first: IntervalTable | None = Field(default=None, description="angle of a universal joint's first axis")
    second: IntervalTable | None = Field(default=None, description="angle of its second axis")
    angle: IntervalTable | None = Field(default=None, description="angle of a cylindrical joint")
    stroke: IntervalTable | None = Field(default=None, description="displacement of a cylindrical joint")
    cone: FiniteFloat | None = Field(
        default=None, description="half angle of the cone of a universal or spherical joint"
    )
    axis: Vector | None = Field(default=None, description="axis of the cone at home; the link's direction if left out")


class StatedMotion(NamedTuple):
    """A range or a cone as a case file states it: the joint, the part of its table, and the table."""

    joint: str
    part: str
    table: JointTable


class LimitOnJoint(Limit[StatedMotion], abc.ABC):
    """A limit on all joints that one text names."""

    joint: str
    needs_joints: ClassVar[bool] = True

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type that a case file states.

        Raises:
            CaseError: a table of a joint contradicts itself.
        """
        for joint, table in (getattr(limits, "joint", None) or {}).items():
            for part in cls.stated(joint, table):
                yield cls.from_table(Written(f"joint.{joint}", StatedMotion(joint, part, table), limits, model, units))

    @classmethod
    @abc.abstractmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the parts of a joint's table that are limits of this type.

        Raises:
            CaseError: the table contradicts itself.
        """

    def joints(self, model: Model) -> list[LimbJoint]:
        """Return the joints that are meant.

        Raises:
            CaseError: the robot has no such joint.
        """
        found = [each for each in model.joints if each.is_called(self.joint)]
        if not found:
            raise CaseError(f"limits.joint.{self.joint}", f"is no joint of {model.name!r}; it has {_known(model)}")
        return found


def _known(model: Model) -> str:
    """Return the names and labels of a robot's joints for a sentence."""
    names = list(dict.fromkeys(each.name for each in model.joints if each.name))
    labels = [each.label for each in model.joints]
    several = [f"and {len(labels) - _LISTED} more"] if len(labels) > _LISTED else []
    return listing([*names, *labels[:_LISTED], *several])

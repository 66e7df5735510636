"""The tables of a case file that say what can be built: limits, several poses, tolerances."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, Tag

from ..table import Table, Vector


class IntervalTable(Table):
    """A limit with one side or two."""

    min: FiniteFloat | None = Field(default=None, description="smallest value")
    max: FiniteFloat | None = Field(default=None, description="largest value")


class AtLeast(Table):
    """A limit from below."""

    min: FiniteFloat = Field(description="smallest value")


class AtMost(Table):
    """A limit from above."""

    max: FiniteFloat = Field(description="largest value")


class ActuatorTable(Table):
    """A telescoping leg over all poses; its stroke is its longest length less its shortest."""

    stroke_max: FiniteFloat | None = Field(default=None, description="largest stroke")
    dead_length: FiniteFloat | None = Field(
        default=None, description="what the leg has beside its stroke: shortest >= dead_length + stroke"
    )


def _kind_of_axes(value: object) -> str:
    if not isinstance(value, list):
        return "<word>"
    return "<lists>" if value and isinstance(value[0], list) else "<list>"


Axes = Annotated[
    Annotated[Literal["normal", "home"], Tag("<word>")]
    | Annotated[Vector, Tag("<list>")]
    | Annotated[list[Vector], Tag("<lists>")],
    Discriminator(_kind_of_axes),
]


class ConeTable(Table):
    """The cone of a passive joint."""

    max: FiniteFloat = Field(description="half angle")
    about: Axes = Field(
        default="normal",
        description="mounting axes: the plate's normal, the leg's direction at limits.home, a direction in the "
        "plate's frame, or a list with one for each leg",
    )


class HomeTable(Table):
    """The pose at which joints are mounted straight."""

    position: Vector = Field(description="origin of the platform frame")
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="axis of rotation")
    angle: FiniteFloat = Field(default=0.0, description="angle of rotation")


class FootprintTable(Table):
    """Largest distance of joint centres from their plate's axis."""

    base: FiniteFloat | None = Field(default=None, description="of the base's joints")
    platform: FiniteFloat | None = Field(default=None, description="of the platform's joints")


class SmallestTable(Table):
    """The smallest singular value of J, homogenised."""

    min: FiniteFloat = Field(description="smallest value")
    length: FiniteFloat = Field(description="by which moments about the platform's origin are divided")


class ConditionTable(Table):
    """The ratio of the singular values of J, homogenised."""

    max: FiniteFloat = Field(description="largest value")
    length: FiniteFloat = Field(description="by which moments about the platform's origin are divided")


NumberOrCone = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[ConeTable, Tag("<range>")],
    Discriminator(lambda value: "<range>" if isinstance(value, dict | ConeTable) else "<number>"),
]


class LimitsTable(Table):
    """What a design must keep to be built; other keys are measures that the robot itself has."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, IntervalTable]

    leg_length: IntervalTable | None = Field(default=None, description="of every leg at every pose")
    actuator: ActuatorTable | None = Field(default=None, description="of every leg over all poses")
    base_joint_angle: NumberOrCone | None = Field(default=None, description="half angle of the base joints' cones")
    platform_joint_angle: NumberOrCone | None = Field(default=None, description="of the platform joints' cones")
    home: HomeTable | None = Field(default=None, description='the pose that about = "home" speaks of')
    joint_spacing: AtLeast | None = Field(default=None, description="between joint centres of one plate")
    footprint: FootprintTable | None = Field(default=None, description="largest radii")
    radius_ratio: IntervalTable | None = Field(default=None, description="platform's radius over base's")
    leg_clearance: AtLeast | None = Field(default=None, description="between legs as line segments")
    condition_number: ConditionTable | None = Field(default=None, description="of J, made homogeneous by a length")
    smallest_singular_value: SmallestTable | None = Field(default=None, description="of the same J")
    rate_share: AtMost | None = Field(default=None, description="part of F that one limb carries")
    custom: list[str] = Field(default_factory=list, description='relations such as "x1 - 1.5*x2 >= 0"')


class AlongTable(Table):
    """Poses along the finite screw motion of a task, evenly spaced."""

    task: str | None = Field(default=None, description="name of the task; needed where there are several")
    first: FiniteFloat = Field(description="where it begins: an angle, or a length for a translation")
    last: FiniteFloat = Field(description="where it ends")
    count: int = Field(ge=2, le=50, description="number of poses")


class OffsetsTable(Table):
    """Offsets of the platform's position along one axis, evenly spaced."""

    min: FiniteFloat = Field(description="first offset")
    max: FiniteFloat = Field(description="last offset")
    count: int = Field(ge=2, le=20, description="number of offsets")


class GridTable(Table):
    """Poses over a box about the stated one: every combination of offsets along the world's axes."""

    x: OffsetsTable | None = Field(default=None, description="offsets along x; none if left out")
    y: OffsetsTable | None = Field(default=None, description="offsets along y")
    z: OffsetsTable | None = Field(default=None, description="offsets along z")


class ToleranceTable(Table):
    """Manufacturing tolerances."""

    joint_centre: FiniteFloat = Field(description="how far off each joint centre may be built, in any direction")

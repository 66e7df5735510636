"""Workspace of a case: a box of poses, or a set inside it, over which a robot is verified. Angles are radians."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING

from ...models import Dimension
from ...models.values import dataclass
from ..errors import CaseError
from ..units import Units
from .checks import check_value
from .pose import Free, Value, ends_of, written_value
from .positionsets import PositionSet

if TYPE_CHECKING:
    from .toml import TomlValue

#: Largest magnitude of a rotation angle: searches use the tangent of half the angle as coordinate, which grows without
#: bound towards half a turn.
LARGEST_TURN = math.radians(150)
#: Coordinates of a position, and angles of a rotation by roll, pitch and yaw.
POSITION = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")


class TurnKind(enum.Enum):
    """Kinds of coordinates for the rotations of a workspace."""

    ANY_AXIS = "any axis"
    AXIS = "axis"
    ROLL_PITCH_YAW = "roll, pitch, yaw"


class PoseSettings(enum.Enum):
    """Rules for dimensions that are reset for every pose of a workspace."""

    AFFINE = "affine"
    ANY = "any"


@dataclass(frozen=True)
class Turns:
    """Rotations of a workspace.

    Attributes:
        kind: kind of coordinates. ``ANY_AXIS``: all rotations about any axis by at most the larger end of the angle;
            ``AXIS``: rotations about one axis; ``ROLL_PITCH_YAW``: ``Rz(yaw) Ry(pitch) Rx(roll)``.
        angles: angles, radians, each fixed or free: three for ``ROLL_PITCH_YAW``, else one.
        axis: (3,) unit axis of rotation in the world frame, for ``AXIS``.
    """

    kind: TurnKind = TurnKind.AXIS
    angles: tuple[Value, ...] = (0.0,)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class DependentCoordinate:
    """Dependent coordinate of the pose: the independent coordinates determine it by the loop equations.

    Attributes:
        index: index among the six coordinates of a pose: position, then rotation.
        lower: lower end of the range in which a search looks for the coordinate, length or radians; not a limit.
        upper: upper end of this range.
    """

    index: int
    lower: float
    upper: float


@dataclass(frozen=True)
class Workspace:
    """Box of poses; with a set of positions, the poses of the box with positions in the set.

    Attributes:
        position: (3,) origin of the platform frame in the world frame, length; each coordinate fixed or free. With a
            set of positions it is the box that encloses the set.
        turns: rotations of the platform.
        has_limits: If true, a solve finds a design without singularities and violated limits at every pose of the box.
        about_pose: If true, position and rotation are excursions from the stated pose of the case, see
            :mod:`.excursions`; if false, they are in the world frame.
        dependent: dependent coordinates of the robot, which a verification adds; empty in a case. A range stated for a
            dependent coordinate is a limit; a number is the start of the search for its value.
        held: indices of independent coordinates with a fixed value; empty without dependent coordinates.
        position_set: set of positions; None for all positions of the box.
        settings: rule for dimensions that are reset for every pose. ``AFFINE``: affine functions of the position;
            ``ANY``: any value of the range that satisfies the limits at the pose. None without such dimensions.
        setting_names: names of these dimensions, which a case adds.

    Raises:
        CaseError: a coordinate is not allowed; the message names its key in a case file.
    """

    position: Sequence[Value]
    turns: Turns = field(default_factory=Turns)
    has_limits: bool = False
    about_pose: bool = False
    dependent: tuple[DependentCoordinate, ...] = ()
    held: tuple[int, ...] = ()
    position_set: PositionSet | None = None
    settings: PoseSettings | None = None
    setting_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.position) != 3:
            fault = f"must be a list of 3, each a number or {{ min, max }}, got {len(self.position)}"
            raise CaseError("workspace.position", fault)
        object.__setattr__(self, "position", tuple(self.position))

    @classmethod
    def within(
        cls,
        positions: PositionSet,
        turns: Turns | None = None,
        has_limits: bool = False,
        *,
        about_pose: bool = False,
    ) -> Workspace:
        """Return the workspace with all positions of a set; see the attributes of the class."""
        return cls(positions.box, turns or Turns(), has_limits, about_pose, position_set=positions)

    @property
    def middle(self) -> tuple[float, float, float]:
        """Position from which searches begin: the middle of the box, or a position inside the set."""
        if self.position_set is None:
            x, y, z = (sum(ends_of(each)) / 2 for each in self.position)
        else:
            x, y, z = self.position_set.middle.tolist()
        return x, y, z

    def check(self, units: Units) -> None:
        """Check the ranges of all coordinates.

        Args:
            units: units of messages.

        Raises:
            CaseError: a coordinate is out of its range, or the box is a single pose.
        """
        if self.position_set is not None:
            self.position_set.check(units)
        for index, value in enumerate(self.position):
            check_value(value, f"workspace.position[{index}]", Dimension.LENGTH, units)
        turns, key = self.turns, "workspace.rotation"
        names = TURNS if turns.kind is TurnKind.ROLL_PITCH_YAW else ("angle",)
        domain = (-LARGEST_TURN, LARGEST_TURN)
        for name, value in zip(names, turns.angles, strict=True):
            check_value(value, f"{key}.{name}", Dimension.ANGLE, units, domain)
        if turns.kind is TurnKind.ANY_AXIS:
            angle = turns.angles[0]
            whole = (
                isinstance(angle, Free)
                and angle.upper > 0
                and (angle.lower == 0 or math.isclose(-angle.lower, angle.upper))
            )
            if not whole:
                fault = "must be { min = -a, max = a } or { min = 0, max = a }: about any axis the sign is arbitrary"
                raise CaseError(f"{key}.angle", fault)
        if not any(isinstance(value, Free) for value in (*self.position, *turns.angles)):
            raise CaseError("workspace", "is only one pose: give one coordinate or more as { min, max }")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the six coordinates of a pose; rotations about any axis have the components of the Cayley vector."""
        turns: tuple[str, ...] = TURNS
        if self.turns.kind is TurnKind.ANY_AXIS:
            turns = tuple(f"cayley_{axis}" for axis in POSITION)
        elif self.turns.kind is TurnKind.AXIS:
            turns = ("angle", "tilt_1", "tilt_2")
        return (*POSITION, *turns)

    @property
    def dependent_names(self) -> tuple[str, ...]:
        """Names of the dependent coordinates."""
        return tuple(self.names[each.index] for each in self.dependent)

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent coordinates with a range."""
        dependent = [each.index for each in self.dependent]
        return tuple(self.names[k] for k, _ in self.ranged if k not in dependent)

    def set_words(self, units: Units, digits: Callable[[float], str] = "{:.7g}".format) -> str:
        """Return a description of the box without dependent coordinates, such as ``roll, pitch in [-5, 5] deg``.

        Args:
            units: units of the description.
            digits: formatter of numbers.
        """
        dependent, groups = [each.index for each in self.dependent], dict[str, list[str]]()
        is_any, chosen_set = self.turns.kind is TurnKind.ANY_AXIS, self.position_set
        shaped = () if chosen_set is None else chosen_set.shaped
        for k, value in self.ranged:
            if k in dependent or (is_any and k >= 3) or k in shaped:
                continue
            dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
            low, high = (digits(units.shown(each, dimension)) for each in ends_of(value))
            groups.setdefault(f"in [{low}, {high}] {units.label(dimension)}", []).append(self.names[k])
        values: list[Value] = [*self.position, *self.turns.angles, 0.0, 0.0]
        for k in self.held:
            dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
            at = f"= {digits(units.shown(ends_of(values[k])[0], dimension))} {units.label(dimension)}"
            groups.setdefault(at, []).append(self.names[k])
        texts = [] if chosen_set is None else [f"position in the {chosen_set.words(units, digits)}"]
        texts += [f"{', '.join(names)} {ends}".rstrip() for ends, names in groups.items()]
        if is_any:
            most = max(map(abs, ends_of(self.turns.angles[0])))
            angle = f"{digits(units.shown(most, Dimension.ANGLE))} {units.label(Dimension.ANGLE)}"
            chosen = [self.names[k] for k in range(3, 6) if k not in dependent]
            texts.append(
                f"rotation by at most {angle} about any axis"
                if len(chosen) == 3
                else f"rotation with ({', '.join(chosen)}) of at most {angle}"
            )
        return ", ".join(texts)

    @property
    def ranged(self) -> list[tuple[int, Value]]:
        """Indices and values of the coordinates with a range."""
        values: list[Value] = [*self.position, *self.turns.angles]
        if self.turns.kind is TurnKind.ANY_AXIS:
            values += self.turns.angles * 2
        return [(k, each) for k, each in enumerate(values) if isinstance(each, Free)]

    def by_three_angles(self) -> Workspace:
        """Return the same box with roll, pitch and yaw instead of the angle about a coordinate axis.

        Raises:
            CaseError: the axis of rotation is not a coordinate axis.
        """
        axis, (angle,) = self.turns.axis, self.turns.angles
        places = [k for k in range(3) if abs(axis[k]) == 1.0]
        if not places:
            fault = "must be { roll, pitch, yaw }: this platform also rotates about axes other than the given one"
            raise CaseError("workspace.rotation", fault)
        angles: list[Value] = [0.0, 0.0, 0.0]
        angles[places[0]] = angle if axis[places[0]] > 0 else _negative(angle)
        return replace(self, turns=Turns(TurnKind.ROLL_PITCH_YAW, tuple(angles)))

    def to_keys(self, units: Units) -> dict[str, TomlValue | None]:
        """Return the keys of the table ``[workspace]`` that state this workspace."""
        turns = self.turns
        angles = [_written(value, units, Dimension.ANGLE) for value in turns.angles]
        rotation: dict[str, TomlValue | None] = {"angle": angles[0]}
        if turns.kind is TurnKind.ROLL_PITCH_YAW:
            rotation = dict(zip(TURNS, angles, strict=True))
        elif turns.kind is TurnKind.AXIS:
            rotation = {"axis": list(turns.axis), "angle": angles[0]}
        return {
            "about": "pose" if self.about_pose else None,
            "position": [_written(value, units, Dimension.LENGTH) for value in self.position]
            if self.position_set is None
            else self.position_set.to_table(units),
            "rotation": None if turns == Turns() else rotation,
            "settings": None if self.settings is None else self.settings.value,
        }


def _negative(value: Value) -> Value:
    """Return a fixed or free value with the opposite sign."""
    return Free(-value.upper, -value.lower) if isinstance(value, Free) else -value


def _written(value: Value, units: Units, dimension: Dimension) -> TomlValue:
    """Return a fixed or free value as TOML in the case's unit, without a start."""
    return written_value(replace(value, start=None) if isinstance(value, Free) else value, units, dimension)

"""The workspace of a case: a box of poses for which a machine is judged. Angles are radians."""

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

if TYPE_CHECKING:
    from .toml import TomlValue

#: Largest size of a rotation's angle: the coordinates in which boxes of rotations are covered, tangents of half the
#: angle, grow without bound towards half a turn.
LARGEST_TURN = math.radians(150)
#: The coordinates of a position, and the three angles of a rotation by roll, pitch and yaw.
POSITION = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")


class TurnKind(enum.Enum):
    """Coordinates of the rotations of a workspace."""

    ANY_AXIS = "any axis"
    AXIS = "axis"
    ROLL_PITCH_YAW = "roll, pitch, yaw"


@dataclass(frozen=True)
class Turns:
    """The rotations of a workspace.

    Attributes:
        kind: ``ANY_AXIS``: by at most the larger end of the one angle, about any axis; ``AXIS``: by an angle about the
            axis; ``ROLL_PITCH_YAW``: ``Rz(yaw) Ry(pitch) Rx(roll)``.
        angles: one value, or three, radians; fixed or free.
        axis: (3,) unit axis of ``AXIS``, in the world frame.
    """

    kind: TurnKind = TurnKind.AXIS
    angles: tuple[Value, ...] = (0.0,)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class DependentCoordinate:
    """A coordinate of the pose that the robot cannot choose: it follows from the others.

    Attributes:
        index: among the six of a pose: position, then rotation.
        lower, upper: working range in which a search begins, length or radians: no limit, and nothing is proved of it.
    """

    index: int
    lower: float
    upper: float


@dataclass(frozen=True)
class Workspace:
    """A box of poses.

    Attributes:
        position: origin of the platform frame in the world frame, length; fixed or free components.
        turns: rotations.
        has_limits: whether a solve must find a design that is regular and keeps the case's limits at each of the poses.
        about_pose: whether the numbers are excursions about the stated pose of the case, see :mod:`.excursions`, and
            not coordinates of the world.
        dependent: coordinates that the robot of a case cannot choose, as a judgement of it finds them; empty in a case.
            A range stated for one is a limit, and a number the place where its value is looked for.
        held: indices of fixed coordinates that it chooses beside those with ranges; empty without dependent ones.

    Raises:
        CaseError: a number is not allowed; the key is in the words of a case file.
    """

    position: Sequence[Value]
    turns: Turns = field(default_factory=Turns)
    has_limits: bool = False
    about_pose: bool = False
    dependent: tuple[DependentCoordinate, ...] = ()
    held: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if len(self.position) != 3:
            raise CaseError("workspace.position", "must be a list of 3, each a number or { min, max }")
        object.__setattr__(self, "position", tuple(self.position))

    def check(self, units: Units) -> None:
        """Refuse a number that is out of its range, and a box that is one pose.

        Args:
            units: units for people.

        Raises:
            CaseError: it is refused.
        """
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
                fault = (
                    "must be { min = -a, max = a } or { min = 0, max = a }: with the axis free its sign means nothing"
                )
                raise CaseError(f"{key}.angle", fault)
        if not any(isinstance(value, Free) for value in (*self.position, *turns.angles)):
            raise CaseError("workspace", "is one pose: give at least one number as { min, max }")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the six coordinates of a pose: those of a rotation about any axis are parts of its Cayley vector."""
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
        """Names of the coordinates with ranges that the robot chooses."""
        dependent = [each.index for each in self.dependent]
        return tuple(self.names[k] for k, _ in self.ranged if k not in dependent)

    def set_words(self, units: Units, digits: Callable[[float], str] = "{:.7g}".format) -> str:
        """Return the set of poses in words, without dependent coordinates, such as ``roll, pitch in [-5, 5] deg``.

        Args:
            units: units for people.
            digits: writes a number.
        """
        dependent, groups = [each.index for each in self.dependent], dict[str, list[str]]()
        is_any = self.turns.kind is TurnKind.ANY_AXIS
        for k, value in self.ranged:
            if k in dependent or (is_any and k >= 3):
                continue
            dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
            low, high = (digits(units.shown(each, dimension)) for each in ends_of(value))
            groups.setdefault(f"in [{low}, {high}] {units.label(dimension)}", []).append(self.names[k])
        values: list[Value] = [*self.position, *self.turns.angles, 0.0, 0.0]
        for k in self.held:
            dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
            at = f"= {digits(units.shown(ends_of(values[k])[0], dimension))} {units.label(dimension)}"
            groups.setdefault(at, []).append(self.names[k])
        texts = [f"{', '.join(names)} {ends}".rstrip() for ends, names in groups.items()]
        if is_any:
            most = max(map(abs, ends_of(self.turns.angles[0])))
            angle = f"{digits(units.shown(most, Dimension.ANGLE))} {units.label(Dimension.ANGLE)}"
            own = [self.names[k] for k in range(3, 6) if k not in dependent]
            texts.append(
                f"rotation by at most {angle} about any axis"
                if len(own) == 3
                else f"rotation with ({', '.join(own)}) of at most {angle}"
            )
        return ", ".join(texts)

    @property
    def ranged(self) -> list[tuple[int, Value]]:
        """The coordinates that have ranges, with their indices."""
        values: list[Value] = [*self.position, *self.turns.angles]
        if self.turns.kind is TurnKind.ANY_AXIS:
            values += self.turns.angles * 2
        return [(k, each) for k, each in enumerate(values) if isinstance(each, Free)]

    def by_three_angles(self) -> Workspace:
        """Return the same box with the rotation about one coordinate axis as roll, pitch and yaw.

        Raises:
            CaseError: the rotation is about another axis.
        """
        axis, (angle,) = self.turns.axis, self.turns.angles
        places = [k for k in range(3) if abs(axis[k]) == 1.0]
        if not places:
            fault = "the platform turns about other axes too: state the rotation as { roll, pitch, yaw }"
            raise CaseError("workspace.rotation", fault)
        angles: list[Value] = [0.0, 0.0, 0.0]
        angles[places[0]] = angle if axis[places[0]] > 0 else _negative(angle)
        return replace(self, turns=Turns(TurnKind.ROLL_PITCH_YAW, tuple(angles)))

    def to_keys(self, units: Units) -> dict[str, TomlValue | None]:
        """Return the table of a case file that states this workspace."""
        turns = self.turns
        angles = [_written(value, units, Dimension.ANGLE) for value in turns.angles]
        rotation: dict[str, TomlValue | None] = {"angle": angles[0]}
        if turns.kind is TurnKind.ROLL_PITCH_YAW:
            rotation = dict(zip(TURNS, angles, strict=True))
        elif turns.kind is TurnKind.AXIS:
            rotation = {"axis": list(turns.axis), "angle": angles[0]}
        return {
            "about": "pose" if self.about_pose else None,
            "position": [_written(value, units, Dimension.LENGTH) for value in self.position],
            "rotation": None if turns == Turns() else rotation,
        }


def _negative(value: Value) -> Value:
    """Return the same number of the opposite sense."""
    return Free(-value.upper, -value.lower) if isinstance(value, Free) else -value


def _written(value: Value, units: Units, dimension: Dimension) -> TomlValue:
    """Return a fixed or free number in the case's unit; a start means nothing in a box."""
    return written_value(replace(value, start=None) if isinstance(value, Free) else value, units, dimension)

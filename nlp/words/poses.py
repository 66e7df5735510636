"""Poses in words, with rotations in the form of their case, and the command that shows a pose."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension, component_names
from ..case.pose import Free, Rotation, RotationForm
from ..results.poses import rotation_form, rotation_numbers
from ..results.rounding import TURNED
from .joints import triple
from .numbers import number

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.overrides import Settings
    from ..evidence.state import WorkspacePose

#: Digits of a pose in a command: the fewest, the number for a pose without a violated limit, and all digits.
_FEWEST, _ENOUGH, _ALL = 3, 6, 17
#: Names of two faults of a pose, beside names of violated limits: the model has no value; loops are open.
_IMPOSSIBLE, _OPEN = "impossible", "open loops"
#: Keys of a rotation, after the prefix of the pose.
_ROTATION = ("axis", "angle", *(each.value for each in (RotationForm.RPY, RotationForm.QUATERNION)))


def _rotation(case: Case, numbers: Mapping[str, list[float]]) -> Rotation:
    """Return the rotation that numbers describe in the rotation form of the case.

    Raises:
        CaseError: a quaternion is rounded too much.
    """
    if RotationForm.QUATERNION.value in numbers:
        return Rotation.from_quaternion(numbers[RotationForm.QUATERNION.value])
    if RotationForm.RPY.value in numbers:
        angles = numbers[RotationForm.RPY.value]
        return Rotation.from_rpy(*(case.units.to_internal(each, Dimension.ANGLE) for each in angles))
    return Rotation(tuple(numbers["axis"]), case.units.to_internal(numbers["angle"][0], Dimension.ANGLE))


def _rotation_words(case: Case, axis: Sequence[float], angle: float, form: RotationForm) -> str:
    """Return a rotation in words; empty without a rotation."""
    if abs(case.units.to_internal(angle, Dimension.ANGLE)) <= TURNED:
        return ""
    numbers, unit = rotation_numbers(case, axis, angle, form), case.units.angle
    if form is RotationForm.QUATERNION:
        return f"quaternion ({', '.join(number(each, 1.0, digits=5) for each in numbers[form.value])})"
    if form is RotationForm.RPY:
        half_turn = case.units.shown(math.pi, Dimension.ANGLE)
        roll, pitch, yaw = (number(each, half_turn, digits=5) for each in numbers[form.value])
        return f"roll {roll}, pitch {pitch}, yaw {yaw} {unit}"
    x, y, z = numbers["axis"]
    return f"{numbers['angle'][0]:.5g} {unit} about {triple((x, y, z), 1.0)}"


def pose_words(case: Case, pose: WorkspacePose, form: RotationForm | None = None) -> str:
    """Return a pose in a few words.

    Args:
        case: the case.
        pose: the pose.
        form: form of the rotation; None for the form of the case.
    """
    stated = () if case.workspace is None else case.workspace.position
    ends = [part for each in stated for part in ((each.lower, each.upper) if isinstance(each, Free) else (each,))]
    size = max(map(abs, (*ends, *pose.position)))
    position = f"({', '.join(number(value, size, digits=5) for value in pose.position)})"
    rotation = _rotation_words(case, pose.axis, pose.angle, rotation_form(case) if form is None else form)
    return ", ".join(each for each in (position, rotation) if each)


def evaluate_command(
    name: str,
    case: Case,
    settings: Settings,
    pose: WorkspacePose,
    form: RotationForm | None = None,
    *,
    claim: str = "",
    further: Iterable[WorkspacePose] = (),
) -> str:
    """Return the shell command that shows a robot at a pose.

    The pose has the fewest digits with which the command shows the same violated limits and singularities.

    Args:
        name: name of the case, or of its file, as the user wrote it.
        case: the case, with fixed dimensions.
        settings: values that replace those of the case's file.
        pose: the pose.
        form: form of its rotation; None for the form of the case.
        claim: name of the limit that the pose violates; empty if unknown.
        further: other poses with a violation of this limit. The first one at which it is shown replaces a pose at
            which it counts as rounding error.
    """
    form = rotation_form(case) if form is None else form
    position, turn = list(pose.position), rotation_numbers(case, pose.axis, pose.angle, form)
    wanted = _shown(case, position, turn)
    is_hidden = wanted is not None and wanted.isdisjoint((claim, "rank", _IMPOSSIBLE, _OPEN))
    for other in further if is_hidden else ():
        point = list(other.position), rotation_numbers(case, other.axis, other.angle, form)
        found = _shown(case, *point)
        if found is not None and claim in found:
            (position, turn), wanted = point, found
            break
    least = _FEWEST if wanted else _ENOUGH
    for digits in range(_ALL if wanted is None else least, _ALL):
        shorter = _rounded(position, digits), {key: _rounded(each, digits) for key, each in turn.items()}
        if _is_shown(wanted or frozenset(), _shown(case, *shorter)):
            position, turn = shorter
            break
    prefix = case.pose_prefixes[0]
    others = {key: value for key, value in settings.items() if key.removeprefix(prefix) not in _ROTATION}
    numbers = {key: [each] for key, each in zip(component_names("p", 3), position, strict=True)} | turn
    written = {**others, **{f"{prefix}{key}": each for key, each in numbers.items()}}
    texts = [f"--set {shlex.quote(f'{key}={_digits(value)}')}" for key, value in written.items()]
    return " ".join(["screwsynth evaluate", shlex.quote(name), *texts])


def _is_shown(wanted: frozenset[str], found: frozenset[str] | None) -> bool:
    """Return whether a pose shows all faults of another pose, and is impossible only if the other pose is."""
    fatal = {_IMPOSSIBLE, _OPEN}
    return found is not None and found >= wanted and found & fatal == wanted & fatal


def _shown(case: Case, position: Sequence[float], turn: Mapping[str, list[float]]) -> frozenset[str] | None:
    """Return the faults that an evaluation at a pose shows: violated limits, a lost rank, or an impossible pose.

    As in the command ``evaluate``, limits on speeds and powers of a case without a motion are left out. The result is
    None if the case is refused, because its error says nothing about the pose.
    """
    from ..errors import CaseError, ScrewsynthError  # noqa: PLC0415 - few results have a pose to be shown
    from ..evidence.closing import closed_start  # noqa: PLC0415
    from ..evidence.evaluation import without_speeds  # noqa: PLC0415
    from ..evidence.margins import margins_of  # noqa: PLC0415
    from ..evidence.state import evaluate, loops_are_closed  # noqa: PLC0415
    from ..program.formulation import formulate_each  # noqa: PLC0415
    from ..proof.statement.posed_layout import at_one_pose  # noqa: PLC0415

    try:
        nlp = formulate_each(at_one_pose(without_speeds(case), position, _rotation(case, turn)))[0]
        x = closed_start(nlp)
        lost = ["rank"] if evaluate(nlp, x).is_singular else []
        lost += [] if loops_are_closed(nlp, x) else [_OPEN]
        return frozenset([*lost, *(row.name for row in margins_of(nlp, x, optimal=False) if row.violated)])
    except CaseError:
        return None
    except ScrewsynthError:
        return frozenset([_IMPOSSIBLE])


def _rounded(values: Sequence[float], digits: int) -> list[float]:
    """Return numbers rounded to one common decimal place, which gives the largest number so many digits."""
    size = max(map(abs, values))
    if size == 0:
        return list(values)
    return [round(each, digits - 1 - math.floor(math.log10(size))) for each in values]


def _digits(value: float | list[float]) -> str:
    """Return a number, or several with commas, with all digits."""
    values = value if isinstance(value, list) else [value]
    return ",".join(repr(float(each) + 0.0).removesuffix(".0") for each in values)

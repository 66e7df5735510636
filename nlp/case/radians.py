"""Check for angles in degrees instead of radians in cases made in Python: angles above a whole turn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from ...models import Dimension, Model
from ..errors import CaseError
from ..units import Units
from .limits.limits import Limits
from .pose import Free, Rotation
from .workspace import TURNS, Workspace

#: Largest angle, radians. A larger value was given in degrees: no rotation needs more than a whole turn.
_TURN = 2 * math.pi
#: Relative rounding error of a whole turn.
_ROUNDING = 1e-9
#: Largest magnitude of an angle in a case: a whole turn, with its rounding error.
WHOLE_TURN = _TURN * (1 + _ROUNDING)


def angles_of(
    model: Model,
    parameters: Mapping[str, object],
    rotations: Sequence[Rotation],
    limits: Limits,
    workspace: Workspace | None,
) -> Iterator[tuple[str, float]]:
    """Yield the dotted key and the value, radians, of each angle of a case; values that are not numbers are skipped."""
    for item in model.parameters:
        if item.dimension is Dimension.ANGLE and item.name in parameters:
            yield from _ends(f"robot.parameters.{item.name}", parameters[item.name])
    for k, rotation in enumerate(rotations):
        yield from _ends(f"pose{f'[{k}]' if k else ''}.rotation.angle", rotation.angle)
    for limit in limits:
        try:
            angles = limit.angles(model) if limit.exists_for(model) else {}
        except CaseError:  # the check of limits reports a contradiction
            continue
        for key, angle in angles.items():
            yield from _ends(f"limits.{key}", angle)
    if workspace is not None:
        turns = workspace.turns.angles
        for name, value in zip(("angle",) if len(turns) == 1 else TURNS, turns, strict=False):
            yield from _ends(f"workspace.rotation.{name}", value)


def check_radians(angles: Iterable[tuple[str, float]], units: Units) -> None:
    """Refuse an angle of more than a whole turn.

    Raises:
        CaseError: an angle is too large.
    """
    for key, angle in angles:
        if abs(angle) > WHOLE_TURN:
            fault = f"must be at most {units.text(_TURN, Dimension.ANGLE)} in magnitude"
            raise CaseError(key, fault, units.shown(angle, Dimension.ANGLE))


def with_radians(error: CaseError, angles: Iterable[tuple[str, float]]) -> CaseError:
    """Return an error about an angle with its value in radians and degrees added; any other error unchanged."""
    angle = next((angle for key, angle in angles if key == error.key), None)
    if angle is None or error.value is None:
        return error
    words = f"{angle:.6g} rad = {math.degrees(angle):.1f} deg; angles are radians in Python"
    return CaseError(error.key, f"{error.fault}; {words}", error.value, error.source)


def _ends(key: str, value: object) -> Iterator[tuple[str, float]]:
    """Yield the dotted key and the value of each number of a fixed value, a free value or a sequence."""
    if isinstance(value, Free):
        for name, end in (("min", value.lower), ("max", value.upper), ("start", value.start)):
            yield from _ends(f"{key}.{name}", end)
        for k, each in enumerate(value.values):
            yield from _ends(f"{key}.values[{k}]", each)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        for k, each in enumerate(value):
            yield from _ends(key if len(value) == 1 else f"{key}[{k}]", each)
    elif isinstance(value, int | float):
        yield key, float(value)

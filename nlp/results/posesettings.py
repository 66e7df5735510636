"""Existence of settings at every pose of a workspace as a result: types and construction."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.pose import Free, ends_of
from ..evidence.state import WorkspacePose
from ..proof.workspace.verdict import Outcome
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector
from .parts import HeadData, SettingsData, VersionsData, settings_data
from .point import head_data, versions
from .verdicts import pose_data

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.overrides import Settings
    from ..proof.workspace.pose_settings import SettingBox, SettingsProof


class SettingRangeData(JsonObject):
    """Range of a dimension that is set for every pose.

    Attributes:
        name: name of the dimension.
        unit: unit of its values; empty for a plain number.
        lower: smallest value.
        upper: largest value.
    """

    name: str
    unit: str
    lower: float
    upper: float


class SettingBoxData(JsonObject):
    """Box of poses with settings that are proved at each of its poses.

    Attributes:
        coordinates: smallest and largest value of each coordinate of the pose that varies, by name, in the units of the
            case.
        values: value of each setting, by name.
    """

    coordinates: Mapping[str, Vector]
    values: Mapping[str, float]


class PoseSettingsResult(JsonObject):
    """Proof that at every pose of a workspace some value of the settings satisfies all limits, or its refutation.

    Attributes:
        head: the case.
        settings: values that replaced those of the case file, by the names of ``--set``; absent without any.
        ranges: the dimensions that are set for every pose, with their ranges.
        proved: If true, at every pose some value of the settings satisfies all limits, without a singularity.
        outcome: ``proved``; ``refuted``, with a pose at which no value works; ``open`` (undecided).
        setting_boxes: proved boxes with their settings. If the claim is proved, they cover the workspace. Settings
            differ from box to box, and are reset at a standstill.
        pose: pose at which no value works, or middle of an undecided box; absent if the claim is proved.
        parts: number of parts of the range that were excluded at the refuting pose; absent otherwise.
        examined: number of examined boxes.
        open: number of undecided boxes.
        reason: reason for an early end; absent otherwise.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    settings: Absent[SettingsData]
    ranges: tuple[SettingRangeData, ...]
    proved: bool
    outcome: Outcome
    setting_boxes: tuple[SettingBoxData, ...]
    pose: Absent[WorkspacePose]
    parts: Absent[int]
    examined: int
    open: int
    reason: Absent[str]
    versions: VersionsData


def pose_settings_of(found: "SettingsProof", settings: "Settings | None" = None) -> PoseSettingsResult:
    """Return the existence of settings as a result.

    Args:
        found: the verdict.
        settings: values that replaced values of the case file; None without such values.
    """
    case, units = found.case, found.case.units
    dimensions = {name: item.dimension for item in case.model.parameters for name in item.components}
    values = {
        name: value
        for item in case.model.parameters
        for name, value in zip(item.components, case.components(item.name), strict=True)
    }
    ranges = []
    for name in found.names:
        low, high = (units.shown(end, dimensions[name]) for end in ends_of(values[name]))
        ranges.append(SettingRangeData(name=name, unit=units.label(dimensions[name]), lower=low, upper=high))
    return PoseSettingsResult(
        head=head_data(case),
        settings=settings_data(settings or {}),
        ranges=tuple(ranges),
        proved=found.is_proved,
        outcome=found.outcome,
        setting_boxes=tuple(_box(each, found, dimensions) for each in found.boxes),
        pose=None if found.pose is None else pose_data(found.pose, units),
        parts=found.parts or None,
        examined=found.examined,
        open=found.open,
        reason=found.reason or None,
        versions=versions(),
    )


def policy_of(case: "Case") -> tuple[str, ...]:
    """Return each affine setting of a case as a function of the position, such as ``x1 = 25.2 - 0.85 (z - 20)``.

    Settings with a free value or slope are left out.
    """
    texts, units = [], case.units
    dimensions = {name: item.dimension for item in case.model.parameters for name in item.components}
    components = {
        name: value
        for item in case.model.parameters
        for name, value in zip(item.components, case.components(item.name), strict=True)
    }
    for each in case.model.settings:
        dimension = dimensions[each.name]
        stated = [components[each.name], *(components[f"{each.name}_slope_{axis}"] for axis in "xyz")]
        numbers = [value for value in stated if not isinstance(value, Free)]
        if len(numbers) < len(stated):
            continue
        at, *slopes = numbers
        words = f"{each.name} = {units.shown(at, dimension):.7g}"
        along = Dimension.ANGLE if dimension is Dimension.ANGLE else Dimension.NUMBER
        for axis, slope, centre in zip("xyz", slopes, each.centre, strict=True):
            if slope:
                shown, middle = units.shown(slope, along), units.shown(centre, Dimension.LENGTH)
                place = axis if not middle else f"({axis} {'-' if middle > 0 else '+'} {abs(middle):.7g})"
                words += f" {'-' if shown < 0 else '+'} {abs(shown):.7g} {place}"
        texts.append(words)
    return tuple(texts)


def _box(each: "SettingBox", found: "SettingsProof", dimensions: Mapping[str, Dimension]) -> SettingBoxData:
    """Return a proved box in the units of the case."""
    units, workspace = found.case.units, each.workspace
    coordinates = {}
    for k, value in workspace.ranged:
        dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
        low, high = ends_of(value)
        coordinates[workspace.names[k]] = (units.shown(low, dimension), units.shown(high, dimension))
    values = {name: units.shown(v, dimensions[name]) for name, v in zip(found.names, each.values, strict=True)}
    return SettingBoxData(coordinates=coordinates, values=values)

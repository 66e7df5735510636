"""Settings for every pose of a workspace: dimensions that are reset for every pose, within their ranges.

With ``settings = "affine"`` each setting is an affine function of the platform's position, and the robot of the case is
replaced by the robot that follows these functions. With ``settings = "any"`` some value of the range must do at each
pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from ...models import Model, Parameter, PoseSetting, component_names
from ...models.posesettings import can_follow_pose, slope_name, value_name, with_pose_settings
from ..errors import CaseError
from ..units import Units
from .checks import check_value
from .limits.limits import Limits
from .loads import Loading
from .pose import Free, PerPose, PerTask, Value, ends_of
from .workspace import PoseSettings, Workspace

#: Limits that are evaluated once for the whole design, or whose reference is a pose with a setting of its own.
_WITHOUT_POSE = ("joint_spacing", "footprint", "radius_ratio")
_ABOUT_HOME = ("base_joint_angle", "platform_joint_angle")
#: Limits that compare lengths at different poses.
_OVER_POSES = ("actuator",)


class Resolved(NamedTuple):
    """Parts of a case in which settings are ordinary parameters.

    Attributes:
        model: robot; with affine settings, the robot that follows them.
        parameters: value of each parameter by name, without settings for every pose.
        limits: limits, with the ranges of affine settings.
        workspace: workspace, with the names of the settings.
    """

    model: Model
    parameters: Mapping[str, Any]
    limits: Limits
    workspace: Workspace | None


class _Setting(NamedTuple):
    """Setting of a case: its parameter, its name, its dotted key, and its value."""

    item: Parameter
    name: str
    key: str
    value: PerPose


def with_settings_resolved(
    model: Model,
    parameters: Mapping[str, Any],
    limits: Limits,
    workspace: Workspace | None,
    loading: Loading,
    tolerance: float | None,
    units: Units,
) -> Resolved:
    """Return the parts of a case in which settings for every pose are ordinary parameters.

    Args:
        model: robot of the case.
        parameters: value of each parameter by name, as stated.
        limits: limits of the case.
        workspace: workspace of the case.
        loading: loads and motion of the case.
        tolerance: joint-centre tolerance; None without one.
        units: units of messages.

    Raises:
        CaseError: a setting is not allowed.
    """
    found = list(_settings(model, parameters))
    how = None if workspace is None else workspace.settings
    if not found:
        if how is not None and not model.settings and not (workspace and workspace.setting_names):
            fault = 'has no effect: write per = "pose" in the range of a dimension, or remove the key'
            raise CaseError("workspace.settings", fault, how.value)
        return Resolved(model, parameters, limits, workspace)
    if workspace is None:
        raise CaseError(f"{found[0].key}.per", "needs the table [workspace] with its poses", "pose")
    if how is None:
        raise CaseError("workspace.settings", f"is missing: {found[0].key} has per = 'pose'; write 'affine' or 'any'")
    for each in found:
        _check(each, units)
    _check_conflicts(limits, loading, tolerance, is_affine=how is PoseSettings.AFFINE)
    if how is PoseSettings.ANY:
        return _any(found, model, parameters, limits, workspace)
    return _affine(found, model, parameters, limits, workspace)


def _any(
    found: Sequence[_Setting], model: Model, parameters: Mapping[str, Any], limits: Limits, workspace: Workspace
) -> Resolved:
    """Return the parts of a case in which the ranges of settings are parameters.

    Raises:
        CaseError: a setting states a policy.
    """
    for each in found:
        if each.value.at is not None or each.value.slope is not None:
            fault = "is for settings = 'affine'; with 'any' the proof chooses the value at each pose"
            raise CaseError(f"{each.key}.{'slope' if each.value.at is None else 'at'}", fault)
    ranges = {each.name: each.value.range for each in found}
    named = replace(workspace, setting_names=tuple(ranges))
    return Resolved(model, _replaced(parameters, ranges, model), limits, named)


def _affine(
    found: Sequence[_Setting], model: Model, parameters: Mapping[str, Any], limits: Limits, workspace: Workspace
) -> Resolved:
    """Return the parts of a case in which values and slopes of settings are parameters.

    Raises:
        CaseError: settings of this robot cannot be affine, or have catalogue values.
    """
    from .limits.interval import QuantityLimit  # noqa: PLC0415 - most cases start without the tables of limits

    if workspace.about_pose:
        raise CaseError("workspace.about", "must be 'world' with settings = 'affine'", "pose")
    for each in found:
        if each.value.range.values:
            raise CaseError(f"{each.key}.values", "needs settings = 'any'; with 'affine' give min and max")
    if not model.settings:
        model = _following(model, found, workspace)
    at = {each.name: _start(each.value) for each in found}
    slopes = {slope_name(each.name): _slope(each, workspace) for each in found}
    ranges = (QuantityLimit(value_name(s.name), min=s.lower, max=s.upper) for s in model.settings)
    others = (each for each in limits if each.name not in setting_limits(model))
    named = replace(workspace, setting_names=tuple(each.name for each in model.settings))
    return Resolved(model, {**_replaced(parameters, at, model), **slopes}, Limits(*others, *ranges), named)


def check_pose_settings(model: Model, workspace: Workspace | None, changes: int, *, has_path: bool) -> None:
    """Refuse settings for every pose together with a path, or with values that change from task to task.

    Args:
        model: robot of the case.
        workspace: workspace of the case, with its settings.
        changes: number of values that change from task to task.
        has_path: If true, the case has a tool path.

    Raises:
        CaseError: a combination is not supported.
    """
    if not model.settings and (workspace is None or not workspace.setting_names):
        return
    if has_path:
        raise CaseError("path", "conflicts with per = 'pose': settings move along a path with per = 'path'")
    if changes:
        raise CaseError("workspace.settings", "conflicts with per = 'task'")
    if workspace is not None and workspace.settings is PoseSettings.ANY and workspace.has_limits:
        fault = "must be 'affine' with limits over the workspace: a solve finds affine settings only"
        raise CaseError("workspace.settings", fault, "any")


def stated_setting(model: Model, name: str, at: Value, slope: Sequence[Value]) -> PerPose:
    """Return an affine setting as a case states it.

    Args:
        model: robot that follows its settings.
        name: name of the setting.
        at: value at the reference position.
        slope: (3,) slopes.
    """
    own = next(each for each in model.settings if each.name == name)
    return PerPose(Free(own.lower, own.upper), at, tuple(slope))


def setting_limits(model: Model) -> frozenset[str]:
    """Return the names of the limits that state the ranges of affine settings."""
    return frozenset(value_name(each.name) for each in model.settings)


def _settings(model: Model, parameters: Mapping[str, Any]) -> Iterator[_Setting]:
    """Yield the settings of a case, in the order of the parameters."""
    for item in model.parameters:
        given = parameters.get(item.name)
        parts = list(given) if isinstance(given, Sequence) and not isinstance(given, str | bytes) else [given]
        for k, part in enumerate(parts):
            if isinstance(part, PerPose):
                key = f"robot.parameters.{item.name}{f'[{k}]' if len(parts) > 1 else ''}"
                if item.is_direction:
                    raise CaseError(key, "cannot be set for every pose: it is a direction")
                name = item.components[k] if k < len(item.components) else item.name
                yield _Setting(item, name, key, part)


def _check(each: _Setting, units: Units) -> None:
    """Refuse a setting whose range is not allowed, or whose policy begins outside its range."""
    value = each.value
    domain = (each.item.lower, each.item.upper)
    check_value(value.range, each.key, each.item.dimension, units, domain)
    if value.at is not None:
        check_value(value.at, f"{each.key}.at", each.item.dimension, units, domain)
        low, high = ends_of(value.at)
        if not value.range.lower <= low <= high <= value.range.upper:
            ends = (units.shown(end, each.item.dimension) for end in (value.range.lower, value.range.upper))
            at = units.shown(low if low < value.range.lower else high, each.item.dimension)
            raise CaseError(f"{each.key}.at", "must lie between min and max, {:.7g} and {:.7g}".format(*ends), at)
    if value.slope is not None and len(value.slope) != 3:
        fault = f"must be a list of 3, the changes along x, y and z, got {len(value.slope)}"
        raise CaseError(f"{each.key}.slope", fault)


def _check_conflicts(limits: Limits, loading: Loading, tolerance: float | None, *, is_affine: bool) -> None:
    """Refuse what a setting for every pose does not support."""
    if tolerance is not None:
        raise CaseError("tolerance.joint_centre", "is not supported with per = 'pose'")
    how = "affine" if is_affine else "any"
    for limit in limits:
        if limit.name in _ABOUT_HOME and getattr(limit, "reference", "") == "home":
            fault = f"must not be 'home' with settings = '{how}': the settings of the mounting pose are not stated"
            raise CaseError(f"limits.{limit.name}.about", fault)
        if limit.name in _OVER_POSES and not is_affine:
            fault = "is not supported with settings = 'any': it compares poses, whose settings differ"
            raise CaseError(f"limits.{limit.name}", fault)
    if not is_affine:
        return
    if loading.motion is not None:
        fault = "is not supported with settings = 'affine': speeds of actuators assume settings at a standstill"
        raise CaseError("motion", fault)
    for limit in limits:
        if limit.needs_motion:
            fault = "is not supported with settings = 'affine': speeds assume settings at a standstill"
            raise CaseError(f"limits.{limit.name}", fault)
        if limit.name in _WITHOUT_POSE:
            raise CaseError(f"limits.{limit.name}", "is not supported with settings = 'affine': it holds at one pose")


def _following(model: Model, found: Sequence[_Setting], workspace: Workspace) -> Model:
    """Return the robot that follows its affine settings.

    Raises:
        CaseError: the robot is given joint by joint.
    """
    if not can_follow_pose(model):
        fault = f"must be 'any' for {model.name!r}: affine settings are for robots on legs that are not given by joints"
        raise CaseError("workspace.settings", fault, "affine")
    centre = workspace.middle
    return with_pose_settings(
        model, [PoseSetting(each.name, each.value.range.lower, each.value.range.upper, centre) for each in found]
    )


def _start(value: PerPose) -> Value:
    """Return the value at the reference position: the stated one, or the whole range."""
    return value.range if value.at is None else value.at


def _slope(each: _Setting, workspace: Workspace) -> tuple[Value, ...]:
    """Return the slopes (3,): the stated ones, or all slopes that keep the range along the edges of the box."""
    if each.value.slope is not None:
        return tuple(each.value.slope)
    width = each.value.range.upper - each.value.range.lower
    sizes = [high - low for low, high in map(ends_of, workspace.position)]
    return tuple(
        Free(-width / size, width / size) if size > 0 and math.isfinite(width / size) else 0.0 for size in sizes
    )


def _replaced(parameters: Mapping[str, Any], values: Mapping[str, Value], model: Model) -> dict[str, Any]:
    """Return the parameters with the values of some components replaced."""
    found = dict(parameters)
    for item in model.parameters:
        names = [name for name in item.components if name in values]
        if not names:
            continue
        given = found[item.name]
        parts: list[Value | PerTask] = list(given) if isinstance(given, Sequence) else [given]
        for name in names:
            parts[item.components.index(name)] = values[name]
        found[item.name] = parts
    return found


def override_setting(tables: dict[str, Any], name: str, value: float | list[float]) -> bool:
    """Replace the value, the slopes or a bound of a setting for every pose in a document; return whether it is one.

    The value of an affine setting is that in the middle of the workspace. Any other setting becomes fixed.

    Args:
        tables: the document; changed in place.
        name: name of the value, such as ``x1``, ``x1.max``, ``x1_slope`` or ``x1_slope_z``.
        value: new value; three numbers for the slopes.

    Raises:
        CaseError: one slope is to be set, and the others are free.
    """
    parameters, workspace = tables.get("robot", {}).get("parameters", {}), tables.get("workspace", {})
    places = {
        part: (holder, place)
        for key, given in parameters.items()
        for part, holder, place in (
            zip(component_names(key, len(given)), [given] * len(given), range(len(given)), strict=True)
            if isinstance(given, list) and 1 < len(given) <= 3
            else [(key, parameters, key)]
        )
    }
    stated = {part: holder[place] for part, (holder, place) in places.items()}
    settings = {part: each for part, each in stated.items() if isinstance(each, dict) and each.get("per") == "pose"}
    whole, _, end = name.rpartition(".")
    if whole in settings and end in ("min", "max") and end in settings[whole]:
        settings[whole][end] = value
    elif name in settings and workspace.get("settings") == PoseSettings.AFFINE.value:
        settings[name]["at"] = value
    elif name in settings:
        holder, place = places[name]
        holder[place] = value
        if len(settings) == 1:
            workspace.pop("settings", None)
    else:
        return _override_slope(settings, name, value)
    return True


def _override_slope(settings: Mapping[str, Any], name: str, value: float | list[float]) -> bool:
    """Replace the slopes of a setting, or one of them; arguments and errors are those of :func:`override_setting`."""
    for key, given in settings.items():
        parts = component_names(slope_name(key), 3)
        if name == slope_name(key):
            given["slope"] = value
        elif name in parts and "slope" in given:
            given["slope"][parts.index(name)] = value
        elif name in parts:
            raise CaseError(name, f"cannot be set: the slopes are free; set {slope_name(key)} to three numbers")
        else:
            continue
        return True
    return False

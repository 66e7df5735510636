"""Schedule of a solve as JSON: values that change along the path, the best constant, and the bound of all schedules."""

from collections.abc import Mapping

import numpy as np

from ..case.pose import OverPoses
from ..solver.scheduled import Schedule
from ..system.jsonvalues import Absent, JsonObject, Vector, finite_or_none, vector


class ConstantSettingData(JsonObject):
    """Best settings that are the same at all points of the path.

    Attributes:
        values: value of each setting.
        value: objective with these values.
        design: values of the free dimensions of the design with these values.
        gain: relative gain of the schedule over these values; 0 for a gain below 1e-6.
    """

    values: Vector
    value: float
    design: Mapping[str, float]
    gain: float


class RateData(JsonObject):
    """Rate of a setting, per second.

    Attributes:
        used: largest rate between two points; null without times of the path.
        max: largest rate of the case; null for no limit.
    """

    used: float | None
    max: float | None


class ScheduleData(JsonObject):
    """Schedule: settings at the points of the path, linear between them.

    Attributes:
        names: names of the settings.
        units: unit of each setting.
        over: combination of F over the points: mean or worst.
        value: objective: mean weighted by time, or worst value.
        segments: number of segments between the points.
        design: values of the free dimensions of the design.
        constant: best constant settings; null if no constant keeps the limits.
        rates: rate of each setting.
        times: times of the points, seconds; absent without times of the path.
        rows: values of the settings at each point.
        F: objective of each point.
        bound: proved bound of the objective of all schedules of this design; absent if no proof was requested.
        gap: relative distance of the bound from the objective.
        reason: reason why the requested gap of the bound was not reached; absent if it was.
        statement: proved statement in words.
        proved: true if the schedule is proved to have no singularity and no violated limit along the whole path; absent
            without limits over the path.
        added: number of points that were added to keep the limits between the points; absent without limits over the
            path.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    over: OverPoses
    value: float
    segments: int
    design: Mapping[str, float]
    constant: ConstantSettingData | None
    rates: tuple[RateData, ...]
    times: Absent[Vector]
    rows: tuple[Vector, ...]
    F: Vector
    bound: Absent[float]
    gap: Absent[float]
    reason: Absent[str]
    statement: Absent[str]
    proved: Absent[bool]
    added: Absent[int]


def schedule_data(schedule: Schedule) -> ScheduleData:
    """Return the schedule of a solve."""
    constant = schedule.constant
    is_timed = bool(np.isfinite(schedule.times).all())
    return ScheduleData(
        names=schedule.names,
        units=tuple(schedule.units.label(each) for each in schedule.dimensions),
        over=schedule.over,
        value=schedule.value,
        segments=len(schedule.values) - 1,
        design=schedule.design,
        constant=None
        if constant is None
        else ConstantSettingData(
            values=vector(constant.values), value=constant.value, design=constant.design, gain=schedule.gain or 0.0
        ),
        rates=tuple(
            RateData(used=finite_or_none(used), max=finite_or_none(most))
            for used, most in zip(schedule.rates_used.tolist(), schedule.rates.tolist(), strict=True)
        ),
        times=vector(schedule.times) if is_timed else None,
        rows=tuple(vector(row) for row in schedule.values),
        F=vector(schedule.F),
        bound=schedule.bound,
        gap=schedule.gap,
        reason=schedule.reason or None,
        statement=schedule.statement or None,
        proved=None if schedule.judgement is None else schedule.judgement.is_proved,
        added=None if schedule.judgement is None else schedule.added,
    )

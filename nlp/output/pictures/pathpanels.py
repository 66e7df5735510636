"""Content of charts along a tool path: curves, limits, violations and margins, in the units of the case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....models import Dimension, FloatArray
from ....models.statics import driven_joints
from ...case.forces import dimension_of_speed
from ...case.motors import ActuatorQuantity
from ...case.task import Sense
from ...errors import load_words
from ...path.sampling import Progress, ProgressKind, progress_of
from ...proof.workspace.judgement import Judgement
from ...proof.workspace.path_samples import PathSamples, SampledNumber, motor_numbers
from ...proof.workspace.verdict import Outcome
from ...results.path import PathResult, PathVerdictData
from ...results.pathtable import path_settings, settings_at
from ...words.claims import CLAIM_WORDS
from ...words.numbers import key_words, number
from ...words.path import checked_claims

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Sentence on the evidence of curves.
SAMPLED = "The curves are sampled; the verdicts are proved."
#: Colours of actuators, distinct with any colour blindness.
ACTUATOR_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9")
#: Colours of the nearest limits.
LIMIT_COLOURS = ("#08519c", "#e08a3c", "#0b6b57", "#a3559e", "#8a5a00", "#5aa0d8", "#68747f", "#3b3b8f")
#: Largest number of load cases with panels.
_LOADS = 4
#: Largest number of lines in one label.
_LINES = 6
#: Factors on the typical size and on the largest limit above which curves of forces and speeds have gaps: near singular
#: poses they would hide all other values.
_MOST, _BEYOND, _PAST = 95, 10.0, 3.0
#: Dimensions of the rates of settings.
_RATES = {Dimension.LENGTH: Dimension.SPEED, Dimension.ANGLE: Dimension.TURN_SPEED}
#: Smallest drawn margin, percent.
_LEAST_MARGIN = -100.0


class PathCurve(NamedTuple):
    """Curve of a quantity at P points of a path.

    Attributes:
        name: name of the actuator.
        place: index of the actuator, which selects the colour.
        values: (P,) values in the case's unit; NaN for missing ones.
        is_other: True for the curve of the smaller of two values; another curve has the larger value.
    """

    name: str
    place: int
    values: FloatArray
    is_other: bool = False


class PathPanel(NamedTuple):
    """Chart of curves over the position along a path.

    Attributes:
        title: short title.
        unit: unit of the curves; empty for dimensionless values.
        curves: curves of the chart, at least one.
        limits: limits of the case, in this unit.
        is_cut: True if very large values are omitted.
        is_coordinate: True for coordinates of actuators and values of settings, False for forces, speeds and rates.
        is_speed: True for speeds, which only segments with a time have.
        is_lower: True if the only limit is a lower one.
        is_setting: True if the only curve is a setting of the path, or its rate, instead of curves of actuators.
    """

    title: str
    unit: str
    curves: tuple[PathCurve, ...]
    limits: tuple[float, ...]
    is_cut: bool = False
    is_coordinate: bool = False
    is_speed: bool = False
    is_lower: bool = False
    is_setting: bool = False

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


class PathMark(NamedTuple):
    """First known violation of a limit or rank along a path.

    Attributes:
        at: position along the path.
        line: line of the path file.
        place: index of the segment, and parameter in the segment.
        names: names of the violated claims.
    """

    at: float
    line: int
    place: tuple[int, float]
    names: tuple[str, ...]


class PathBand(NamedTuple):
    """Consecutive segments that are not proved: start, end, and whether a violation is known."""

    start: float
    end: float
    is_refuted: bool


@dataclass(frozen=True, eq=False)
class PathPicture:
    """Content of the charts of a path.

    Attributes:
        judged: judgement of the path.
        samples: robot at points of the path.
        result: verdicts along the path.
        way: time or length along the path.
        at: (P,) positions of the points along the path.
        label: label of the position, with its unit.
        panels: charts of curves.
        margins: (P,) smallest margins, percent; empty without limits.
        marks: first violations.
        bands: segments that are not proved.
    """

    judged: Judgement
    samples: PathSamples
    result: PathResult
    way: Progress
    at: FloatArray
    label: str
    panels: tuple[PathPanel, ...]
    margins: FloatArray
    marks: tuple[PathMark, ...]
    bands: tuple[PathBand, ...]

    @property
    def drawn_margins(self) -> FloatArray:
        """Smallest margins (P,), percent, cut off below: near singular poses they would hide all other values."""
        return np.maximum(self.margins, _LEAST_MARGIN)

    @property
    def limits(self) -> list[tuple[int, str]]:
        """Indices and descriptions of the limits that are nearest at some point."""
        shown = sorted({*self.samples.nearest.tolist()} - {-1})
        units, numbers = self.judged.case.units, {each.claim.key: each for each in self.samples.numbers}
        found = []
        for k, key in ((k, self.samples.keys[k]) for k in shown):
            dimension = numbers[key].claim.reading.dimension
            value = number(units.shown(numbers[key].limit or 0.0, dimension))
            words = key_words(f"limits.{key}")
            # A custom relation is a difference that is compared with 0.
            found.append(
                (k, key if key.startswith("custom[") else f"{words} = {value} {units.label(dimension)}".rstrip())
            )
        return found

    @property
    def notes(self) -> list[str]:
        """Notes on the charts."""
        notes = [SAMPLED]
        if self.margins.size:
            notes.append(
                "The margin is the distance from the nearest limit, relative to the range between two limits of a "
                "quantity, or to its only limit. A negative margin is a violation."
            )
            if (self.margins < _LEAST_MARGIN).any():
                notes.append(f"Margins below {_LEAST_MARGIN:g} % are not shown.")
        if any(each.is_refuted for each in self.bands):
            notes.append("Red: segments with a known violation. Vertical lines: first violation of each limit or rank.")
        if any(not each.is_refuted for each in self.bands):
            notes.append("Grey: undecided segments, or segments with unknown joint coordinates.")
        claims = checked_claims(self.result)
        unplaced = [CLAIM_WORDS.get(each.name, each.name) for each in claims if _is_open(each) and each.segment is None]
        if unplaced:
            notes.append(f"Undecided without a known segment: {', '.join(unplaced)}.")
        if self.judged.case.joint_centre_tolerance:
            notes.append("The curves are for the nominal robot, without the tolerance.")
        if any(each.is_cut for each in self.panels):
            notes.append("Curves have gaps where forces or speeds are more than ten times their usual size.")
        if self.samples.left_out:
            notes.append(f"Not shown: {', '.join(self.samples.left_out)}.")
        more = len(self.judged.case.loading.cases) - _LOADS
        if more > 0:
            notes.append(f"Forces under {more} further loads are not shown.")
        return notes


def path_picture(judged: Judgement, samples: PathSamples, result: PathResult) -> PathPicture:
    """Return the content of the charts of a judged path."""
    way = progress_of(judged.path)
    units = {ProgressKind.TIME: ", s", ProgressKind.LENGTH: f", {judged.case.units.length}", ProgressKind.SEGMENTS: ""}
    panels = (
        *_settings(judged, samples),
        *_coordinates(judged, samples),
        *_speeds(judged, samples),
        *_forces(judged, samples),
    )
    least = 100 * samples.least if len(samples.keys) else np.zeros(0)
    return PathPicture(
        judged,
        samples,
        result,
        way,
        way.at(samples.points),
        f"{way.kind.value}{units[way.kind]}",
        panels,
        np.where(np.isfinite(least), least, np.nan),
        tuple(_marks(result, way)),
        tuple(_bands(samples, result, way)),
    )


def _settings(judged: Judgement, samples: PathSamples) -> Iterator[PathPanel]:
    """Yield a chart of each value that changes along the path and, with times, a chart of its rate."""
    path, units = judged.path, judged.case.units
    values, changes = settings_at(path, *samples.points)
    rates = changes / path.durations[samples.points.segments, None]
    for k, (name, dimension) in enumerate(path_settings(judged.case, path)):
        if not np.ptp(values[:, k]):
            continue
        rate = _RATES.get(dimension, Dimension.NUMBER)
        factor, speed = (units.shown(1.0, each) for each in (dimension, rate))
        curve = PathCurve(name, k, factor * values[:, k])
        yield PathPanel(f"setting {name}", units.label(dimension), (curve,), (), is_coordinate=True, is_setting=True)
        if path.is_timed:
            curve = PathCurve(name, k, speed * rates[:, k])
            yield PathPanel(f"rate of {name}", units.label(rate) or "1/s", (curve,), (), is_setting=True)


def _coordinates(judged: Judgement, samples: PathSamples) -> Iterator[PathPanel]:
    """Yield charts of the actuator coordinates, one for each kind of actuator."""
    joints = samples.joints
    if joints is None:
        return
    drives = driven_joints(judged.case.model)
    for measure in dict.fromkeys(joints.measures):
        own = [k for k, each in enumerate(joints.measures) if each == measure]
        dimension = Dimension.ANGLE if measure == "actuator_angle" else Dimension.LENGTH
        factor = judged.case.units.shown(1.0, dimension)
        curves = [PathCurve(drives[k].name, k, factor * joints.coordinates[:, k]) for k in own]
        names = {f"{measure} limb {drives[k].name}" for k in own}
        limited = [each for each in judged.extremes if each.name in names and each.limit is not None]
        limits = {each.limit for each in limited if each.limit is not None}
        is_lower = bool(limited) and all(each.sense is Sense.MIN for each in limited)
        words = {"leg_length": "leg lengths", "actuator_angle": "actuator angles"}.get(measure, "actuator lengths")
        ends, unit = tuple(sorted(factor * each for each in limits)), judged.case.units.label(dimension)
        yield PathPanel(words, unit, tuple(curves), ends, is_coordinate=True, is_lower=is_lower)


def _speeds(judged: Judgement, samples: PathSamples) -> Iterator[PathPanel]:
    """Yield charts of actuator speeds: along a timed path, or otherwise the largest speeds in the case's motions."""
    units, every = judged.case.units, motor_numbers(samples.numbers, ActuatorQuantity.SPEED).get("", [])
    limited = {each.claim.motor.actuator: each.limit for each in every if each.claim.motor and each.limit is not None}
    timed = [(k, each) for k, each in enumerate(driven_joints(judged.case.model)) if k < samples.speeds.shape[1]]
    if np.isfinite(samples.speeds).any():
        for dimension in dict.fromkeys(dimension_of_speed(each) for _, each in timed):
            own = [(k, each) for k, each in timed if dimension_of_speed(each) is dimension]
            factor = units.shown(1.0, dimension)
            curves = tuple(PathCurve(each.name, k, factor * samples.speeds[:, k]) for k, each in own)
            ends = {factor * limited[each.name] for _, each in own if each.name in limited}
            limits = tuple(sign * end for end in ends for sign in (-1, 1))
            panel = PathPanel("speeds along the path", units.label(dimension), curves, limits, is_speed=True)
            yield _without_peaks(panel)
    if not judged.path.is_timed:
        yield from _of_motors(judged, every, "largest speeds in the motions of the case")


def _forces(judged: Judgement, samples: PathSamples) -> Iterator[PathPanel]:
    """Yield charts of the actuator forces under each load."""
    found = motor_numbers(samples.numbers, ActuatorQuantity.FORCE)
    for load, every in list(found.items())[:_LOADS]:
        yield from _of_motors(judged, every, f"forces, {load_words(load)}")


def _of_motors(judged: Judgement, every: Sequence[SampledNumber], title: str) -> Iterator[PathPanel]:
    """Yield charts of a quantity of the actuators, one for each unit."""
    units = judged.case.units
    for dimension in dict.fromkeys(each.claim.reading.dimension for each in every):
        own, factor = [each for each in every if each.claim.reading.dimension is dimension], units.shown(1.0, dimension)
        curves, shown = [], dict[int, FloatArray]()
        # Largest values come first; an equal smallest value, as under a load with one direction, is omitted.
        for each in sorted(own, key=lambda each: each.claim.sense is Sense.MIN):
            motor = each.claim.motor
            if motor is None or (motor.place in shown and np.allclose(shown[motor.place], each.values, equal_nan=True)):
                continue
            is_other = motor.place in shown
            shown.setdefault(motor.place, each.values)
            curves.append(PathCurve(motor.actuator, motor.place, factor * each.values, is_other))
        limits = {factor * each.limit for each in own if each.limit is not None}
        yield _without_peaks(PathPanel(title, units.label(dimension), tuple(curves), tuple(sorted(limits))))


def _without_peaks(panel: PathPanel) -> PathPanel:
    """Return a chart whose curves have gaps at values far above the typical ones."""
    sizes = np.abs(np.concatenate([each.values for each in panel.curves]))
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        return panel
    most = max(_BEYOND * float(np.percentile(sizes, _MOST)), _PAST * max(map(abs, panel.limits), default=0.0))
    if sizes.max() <= most:
        return panel
    kept = [each._replace(values=np.where(np.abs(each.values) <= most, each.values, np.nan)) for each in panel.curves]
    return panel._replace(curves=tuple(kept), is_cut=True)


def _marks(result: PathResult, way: Progress) -> Iterator[PathMark]:
    """Yield the first violations, in the order of the path."""
    faults = [(each.fault, each.name) for each in checked_claims(result) if each.fault is not None]
    ordered = sorted(faults, key=lambda each: (each[0].segment, each[0].parameter))
    for place, group in groupby(ordered, key=lambda each: (each[0].segment, each[0].parameter)):
        own = list(group)
        start, end = way.knots[place[0]], way.knots[place[0] + 1]
        at = float(start + place[1] * (end - start))
        yield PathMark(at, own[0][0].line, place, tuple(name for _, name in own))


def _bands(samples: PathSamples, result: PathResult, way: Progress) -> Iterator[PathBand]:
    """Yield the segments with a known violation or an undecided claim."""
    state = np.zeros(len(way.knots) - 1, dtype=int)
    state[samples.points.segments[samples.is_apart]] = 1
    for each in checked_claims(result):
        if _is_open(each) and each.segment is not None:
            state[each.segment] = 1
    state[samples.points.segments[samples.is_violated]] = 2
    state[[each.fault.segment for each in checked_claims(result) if each.fault is not None]] = 2
    for kind, group in groupby(range(len(state)), key=lambda k: int(state[k])):
        own = list(group)
        if kind:
            yield PathBand(float(way.knots[own[0]]), float(way.knots[own[-1] + 1]), kind == 2)


def _is_open(claim: PathVerdictData) -> bool:
    return claim.outcome is Outcome.OPEN


def marks_text(marks: Sequence[PathMark]) -> str:
    """Return the lines of violations in one label, such as ``lines 4, 5``."""
    lines = list(dict.fromkeys(each.line for each in marks))
    more = [f"and {len(lines) - _LINES} more"] if len(lines) > _LINES else []
    return f"line{'s' * (len(lines) > 1)} {', '.join([*map(str, lines[:_LINES]), *more])}"


def actuator_names(picture: PathPicture) -> dict[int, str]:
    """Return the names of the actuators with curves, by index."""
    return {each.place: each.name for panel in picture.panels if not panel.is_setting for each in panel.curves}


def percent(margin: float) -> str:
    """Return the text of a margin in percent."""
    return f"{number(margin, 100.0, digits=3)} %"


def nearest_parts(nearest: NDArray[np.intp], key: int, values: FloatArray) -> FloatArray:
    """Return values (P,) where a limit is nearest, and at the next point to avoid gaps; NaN elsewhere."""
    own = nearest == key
    return np.where(own | np.concatenate([[False], own[:-1]]), values, np.nan)

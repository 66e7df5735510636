"""Small charts as SVG in a page: they need no script, scale with the page, and can be printed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .markup import Markup, join_markup, tag

#: Width and height of a chart in units of its viewBox, and the margins for its axes.
_WIDTH, _HEIGHT = 320.0, 190.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 12.0, 10.0, 38.0
#: Height of a strip, and room between two strips.
_STRIP, _BETWEEN = 46.0, 6.0


@dataclass(frozen=True)
class Curve:
    """Line of a chart.

    Attributes:
        x, y: coordinates of the points; the line has a gap at points with an infinite or undefined ``y``.
        kind: CSS class of the line.
        steps: If true, the line is a step function, constant up to each point.
    """

    x: Sequence[float]
    y: Sequence[float]
    kind: str
    steps: bool = False


@dataclass(frozen=True)
class Spot:
    """Marked point of a chart.

    Attributes:
        x, y: coordinates of the point.
        kind: CSS class of the mark.
        words: text for a tooltip and for screen readers.
    """

    x: float
    y: float
    kind: str
    words: str


class Band(NamedTuple):
    """Shaded interval of the horizontal axis: its two ends and its CSS class."""

    start: float
    end: float
    kind: str


def line_chart(
    curves: Sequence[Curve],
    spots: Sequence[Spot],
    *,
    words: str,
    labels: tuple[str, str],
    bounds: Sequence[float] = (),
    levels: Sequence[float] = (),
    bands: Sequence[Band] = (),
    ends: tuple[float, float] | None = None,
    has_cursor: bool = False,
) -> Markup:
    """Return a chart of lines over one axis, or a sentence if no point of the lines has a value.

    Args:
        curves: lines of the chart, at least one.
        spots: marked points.
        words: text alternative of the chart, a sentence.
        labels: labels of the horizontal and the vertical axis.
        bounds: values on the horizontal axis with vertical lines.
        levels: values on the vertical axis with horizontal lines.
        bands: shaded intervals of the horizontal axis.
        ends: ends of the horizontal axis; by default they enclose the content.
        has_cursor: If true, a vertical line follows a slider of the page.
    """
    xs = [x for curve in curves for x in curve.x] + [spot.x for spot in spots] + list(bounds)
    ys = [y for curve in curves for y in curve.y if math.isfinite(y)] + [spot.y for spot in spots]
    ys += levels if ys else []
    if not ys:
        return tag("p", f"{words} No chart: F has no value here.")
    across = _range_with_room(min(xs), max(xs), 0.03) if ends is None else _range_with_room(*ends, 0.0)
    scale = _Scale(across, _range_with_room(min(ys), max(ys), 0.08))
    floor = scale.floor
    parts: list[object] = [_band(scale, each) for each in bands]
    parts += _axes(scale, labels)
    parts += [tag("path", d=f"M{_LEFT:g} {scale.y(y):.1f}H{_WIDTH - _RIGHT:g}", class_="level") for y in levels]
    parts += [tag("path", d=f"M{scale.x(x):.1f} {_TOP:g}V{floor:g}", class_="bound") for x in bounds]
    parts += [tag("path", d=_path(scale, curve), class_=curve.kind) for curve in curves]
    for spot in spots:
        place = {"cx": f"{scale.x(spot.x):.1f}", "cy": f"{scale.y(spot.y):.1f}", "r": "4.5"}
        parts.append(tag("circle", tag("title", spot.words), class_=spot.kind, **place))
    if has_cursor:
        parts.append(_cursor(scale, floor))
    return _svg(parts, words)


def _cursor(scale: _Scale, floor: float) -> Markup:
    """Return the vertical line that follows a slider; the script sets its position as a fraction of the axis."""
    start, width = scale.x(scale.across[0]), scale.x(scale.across[1]) - scale.x(scale.across[0])
    ways = {"data_low": scale.across[0], "data_high": scale.across[1], "data_left": start, "data_width": width}
    return tag("path", d=f"M0 {_TOP:g}V{floor:g}", class_="cursor", **ways)


class Strip(NamedTuple):
    """Strip of a chart: its name and its lines."""

    name: str
    curves: Sequence[Curve]


def strip_chart(
    strips: Sequence[Strip],
    *,
    words: str,
    labels: tuple[str, str],
    bounds: Sequence[float] = (),
    levels: Sequence[float] = (),
    bands: Sequence[Band] = (),
    ends: tuple[float, float],
) -> Markup:
    """Return a chart with a strip for each name, one below the other, with common scales and a cursor.

    Lines that change quickly would cover each other in one strip.

    Args:
        strips: strips of the chart, at least one.
        words: text alternative of the chart, a sentence.
        labels: labels of the horizontal and the vertical axis.
        bounds: values on the horizontal axis with vertical lines.
        levels: values on the vertical axis with horizontal lines.
        bands: shaded intervals of the horizontal axis.
        ends: ends of the horizontal axis.
    """
    ys = [y for strip in strips for curve in strip.curves for y in curve.y if math.isfinite(y)]
    if not ys:
        return tag("p", f"{words} No chart: no value is known here.")
    low, high = min([*ys, *levels]), max([*ys, *levels])
    across, up = _range_with_room(*ends, 0.0), _range_with_room(low, high, 0.08)
    floor, right = _TOP + len(strips) * _STRIP, _WIDTH - _RIGHT
    whole = _Scale(across, up, _TOP, floor)
    parts: list[object] = [_band(whole, each) for each in bands]
    for k, strip in enumerate(strips):
        scale = _Scale(across, up, _TOP + k * _STRIP, _TOP + (k + 1) * _STRIP - _BETWEEN)
        for value in _ticks(*up, 2):
            y = scale.y(value)
            parts.append(tag("path", d=f"M{_LEFT:g} {y:.1f}H{right:g}", class_="rule"))
            parts.append(tag("text", _tick_text(value), x=f"{_LEFT - 5:g}", y=f"{y + 3:.1f}", class_="tick small end"))
        parts += [tag("path", d=f"M{_LEFT:g} {scale.y(y):.1f}H{right:g}", class_="level") for y in levels]
        parts += [tag("path", d=_path(scale, curve), class_=curve.kind) for curve in strip.curves]
        parts.append(tag("path", d=f"M{_LEFT:g} {scale.top:g}V{scale.floor:g}H{right:g}", class_="axis"))
        parts.append(tag("text", strip.name, x=f"{_LEFT + 4:g}", y=f"{scale.top + 9:g}", class_="strip"))
    parts += [tag("path", d=f"M{whole.x(x):.1f} {_TOP:g}V{floor:g}", class_="bound") for x in bounds]
    parts += [*_axis_across(whole, labels[0], floor), _axis_label(labels[1], (_TOP + floor) / 2)]
    parts.append(_cursor(whole, floor))
    return _svg(parts, words, floor + _BOTTOM)


def _band(scale: _Scale, band: Band) -> Markup:
    """Return a shaded interval of the horizontal axis."""
    left, right = scale.x(band.start), scale.x(band.end)
    size = {"width": f"{max(right - left, 0.5):.1f}", "height": f"{scale.floor - scale.top:g}"}
    return tag("rect", x=f"{left:.1f}", y=f"{_TOP:g}", class_=band.kind, **size)


def count_chart(values: Sequence[tuple[float, int]], *, words: str, labels: tuple[str, str]) -> Markup:
    """Return a chart of counts with one stem per value.

    Args:
        values: pairs of value and count, with the best value first.
        words: text alternative of the chart, a sentence.
        labels: labels of the horizontal and the vertical axis.
    """
    ys = [value for value, _ in values]
    scale = _Scale(_range_with_room(min(ys), max(ys), 0.12), (0.0, 1.12 * max(count for _, count in values)))
    parts: list[object] = [*_axes(scale, labels)]
    for k, (value, count) in enumerate(values):
        x, y = scale.x(value), scale.y(count)
        kind = "spot" if k == 0 else "other"
        parts.append(tag("path", d=f"M{x:.1f} {scale.y(0):.1f}V{y:.1f}", class_=f"stem {kind}"))
        found = f"{count} at F = {value + 0.0:.7g}"
        parts.append(tag("circle", tag("title", found), cx=f"{x:.1f}", cy=f"{y:.1f}", r="5", class_=kind))
    return _svg(parts, words)


@dataclass(frozen=True)
class _Scale:
    """Scales of a chart, from values to units of its viewBox.

    Attributes:
        across, up: range of values on the horizontal and on the vertical axis.
        top, floor: ends of the vertical axis, in units of the viewBox.
    """

    across: tuple[float, float]
    up: tuple[float, float]
    top: float = _TOP
    floor: float = _HEIGHT - _BOTTOM

    def x(self, value: float) -> float:
        low, high = self.across
        return _LEFT + (value - low) / (high - low) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: float) -> float:
        low, high = self.up
        return self.floor - (value - low) / (high - low) * (self.floor - self.top)


def _svg(parts: Sequence[object], words: str, height: float = _HEIGHT) -> Markup:
    """Return a chart with its text alternative."""
    return tag(
        "svg", join_markup(parts), viewBox=f"0 0 {_WIDTH:g} {height:g}", role="img", aria_label=words, class_="chart"
    )


def _axes(scale: _Scale, labels: tuple[str, str]) -> list[Markup]:
    """Return the axes with ticks and labels."""
    floor, right = scale.floor, _WIDTH - _RIGHT
    parts = _axis_across(scale, labels[0], floor)
    for value in _ticks(*scale.up, 5):
        y = scale.y(value)
        parts.append(tag("path", d=f"M{_LEFT:g} {y:.1f}H{right:g}", class_="rule"))
        parts.append(tag("text", _tick_text(value), x=f"{_LEFT - 5:g}", y=f"{y + 3.5:.1f}", class_="tick end"))
    parts.append(tag("path", d=f"M{_LEFT:g} {_TOP:g}V{floor:g}H{right:g}", class_="axis"))
    parts.append(_axis_label(labels[1], (_TOP + floor) / 2))
    return parts


def _axis_across(scale: _Scale, label: str, floor: float) -> list[Markup]:
    """Return the ticks and the label of the horizontal axis, below a height."""
    parts = []
    for value in _ticks(*scale.across, 5):
        x = f"{scale.x(value):.1f}"
        parts.append(tag("text", _tick_text(value), x=x, y=f"{floor + 14:g}", class_="tick middle"))
    middle = (_LEFT + _WIDTH - _RIGHT) / 2
    return [*parts, tag("text", label, x=f"{middle:g}", y=f"{floor + _BOTTOM - 6:g}", class_="label middle")]


def _axis_label(label: str, height: float) -> Markup:
    """Return the turned label of the vertical axis at a height."""
    return tag("text", label, x="12", y=f"{height:g}", transform=f"rotate(-90 12 {height:g})", class_="label middle")


def _path(scale: _Scale, curve: Curve) -> str:
    """Return the SVG path data of a curve, with a new piece after each gap."""
    parts: list[str] = []
    is_new, last = True, 0.0
    for x, y in zip(curve.x, curve.y, strict=True):
        if not math.isfinite(y):
            is_new = True
            continue
        at = f"{scale.x(x):.1f} {scale.y(y):.1f}"
        level = f"L{scale.x(x):.1f} {scale.y(last):.1f}" if curve.steps and not is_new else ""
        parts.append(f"M{at}" if is_new else f"{level}L{at}")
        is_new, last = False, y
    return "".join(parts) or "M0 0"


def _range_with_room(low: float, high: float, part: float) -> tuple[float, float]:
    """Return a range with room at its ends, a fraction of its width; a range without width is widened first."""
    # Otherwise rounding errors would fill the whole height.
    width = high - low
    if width <= 1e-6 * max(abs(low), abs(high)):
        width = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = (low + high) / 2 - width, (low + high) / 2 + width
    return low - part * width, high + part * width


def _ticks(low: float, high: float, about: int) -> list[float]:
    """Return at most ``about + 1`` round values in a range."""
    step = 10.0 ** math.floor(math.log10((high - low) / about))
    step *= next(factor for factor in (1, 2, 5, 10) if (high - low) / (factor * step) <= about)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def _tick_text(value: float) -> str:
    """Return the label of a tick."""
    return f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}")

"""Data of the 3-D view of a path: postures of the robot, path with nearest limits and margins, violations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from ....models import FloatArray
from ...words.claims import SINGULAR
from ...words.numbers import number
from ..pictures.drawing import Drawing, drawing_without_task
from ..pictures.pathpanels import LIMIT_COLOURS, PathPicture, percent
from ..pictures.posture import Linkage, Posture
from .frames import JointData, LinkData, PointData, first_eye, joint_data, link_data
from .markup import with_signs

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest number of postures of a page, of their values, and of points of the path.
_POSTURES, _NUMBERS, _POINTS = 300, 60_000, 600
#: Rounding of coordinates relative to the robot's size, and of directions: finer than a page shows.
_FINE, _ROUGH = 1e-7, 1e-4
#: Room around the drawing, as a fraction of the robot's size.
_ROOM = 0.08
#: Margin, percent, above which the colour is constant.
MOST_MARGIN = 50


class PathFrame(TypedDict):
    """Robot at one point of the path: description of the point, and points and joints as in the view of a solution."""

    words: str
    at: float
    position: list[float]
    points: list[list[float]]
    joints: list[list[list[float]]]


class PathMarkData(TypedDict):
    """Violation: its description, and the position of the platform's origin."""

    words: str
    position: list[float]


class PathViewData(TypedDict):
    """Content of the view, in the case's units.

    ``path`` has positions of the platform's origin, ``nearest`` the index of the nearest limit at each of them, -1 for
    none, ``margins`` the smallest margins in percent, and ``first`` is the index of the initial frame.
    """

    unit: str
    size: float
    eye: list[float]
    ranges: list[list[float]]
    points: list[PointData]
    links: list[LinkData]
    joints: list[JointData]
    plates: dict[str, list[int]]
    limits: list[dict[str, str]]
    path: list[list[float]]
    nearest: list[int]
    margins: list[float | None]
    most: int
    marks: list[PathMarkData]
    first: int
    frames: list[PathFrame]


class PathView(NamedTuple):
    """Data of the view, the initial drawing of the robot, and the index of the sample of each frame."""

    data: PathViewData
    drawing: Drawing
    shown: list[int]


def path_view(picture: PathPicture) -> PathView | None:
    """Return the view of a path; None if the robot has no known joint coordinates at any point of the path."""
    judged, samples = picture.judged, picture.samples
    case, model, joints = judged.case, judged.case.model, samples.joints
    if joints is None or not joints.closed.any():
        return None
    scene = model.scene
    numbers = 3 * (len(scene.points) + sum(1 + len(each.axes) for each in scene.joints))
    shown = thinned(picture, min(_POSTURES, _NUMBERS // numbers), np.flatnonzero(joints.closed))
    settings = judged.path.settings
    numbers_at = case.fixed_parameters("postures have fixed dimensions", settings.names)
    linkage = Linkage(model, numbers_at, case.characteristic_length)
    moving = [[name for item in model.parameters for name in item.components].index(name) for name in settings.names]
    postures = []
    for k, values in zip(
        shown, settings.at(samples.points.segments[shown], samples.points.parameters[shown]), strict=True
    ):
        numbers_at = numbers_at.copy()
        numbers_at[moving] = values
        pose = samples.poses.rotations[k], samples.poses.positions[k]
        postures.append(linkage.posture_at(*pose, joints.unknowns[k], numbers_at))
    first = _first(picture, shown)
    drawing = drawing_without_task(case, model, linkage, postures[first])
    size, way = drawing.size, thinned(picture, _POINTS, np.arange(len(picture.at)))
    places = [each.place for each in picture.marks]
    marks = judged.path.poses_at([k for k, _ in places], [s for _, s in places]).positions
    every = np.vstack([*(each.points for each in postures), samples.poses.positions[way], marks])
    return PathView(
        {
            "unit": case.units.length,
            "size": size,
            "eye": first_eye(drawing),
            "ranges": np.stack([every.min(axis=0) - _ROOM * size, every.max(axis=0) + _ROOM * size], 1).tolist(),
            "points": [{"name": point.name, "body": point.body.value} for point in model.scene.points],
            "links": link_data(drawing),
            "joints": joint_data(drawing),
            "plates": {body.value: list(loop) for body, loop in drawing.plates},
            "limits": [
                {"words": words, "colour": LIMIT_COLOURS[k % len(LIMIT_COLOURS)]} for k, words in picture.limits
            ],
            "path": _rounded(samples.poses.positions[way], size),
            "nearest": _nearest(picture)[way].tolist(),
            "margins": [_margin(picture, k) for k in way],
            "most": MOST_MARGIN,
            "marks": [
                {
                    "words": f"line {each.line}: {', '.join(SINGULAR.get(name, name) for name in each.names)}",
                    "position": _rounded(position, size),
                }
                for each, position in zip(picture.marks, marks, strict=True)
            ],
            "first": first,
            "frames": [_frame(picture, k, each, size) for k, each in zip(shown, postures, strict=True)],
        },
        drawing,
        shown,
    )


def thinned(picture: PathPicture, most: int, among: NDArray[np.intp]) -> list[int]:
    """Return the indices of at most ``most`` samples, including the first, the last and those at violations."""
    if len(among) <= most:
        return [int(k) for k in among]
    points, faults = picture.samples.points, {each.place for each in picture.marks}
    kept = [
        k for k in among if faults and (int(points.segments[k]), float(points.parameters[k])) in faults
    ][: most // 2]  # fmt: skip
    spread = among[np.linspace(0, len(among) - 1, most - len(kept)).astype(int)]
    return sorted({int(k) for k in (*kept, *spread)})


def _first(picture: PathPicture, shown: list[int]) -> int:
    """Return the index among the shown samples of the sample nearest to the first violation, 0 without violations."""
    if not picture.marks:
        return 0
    return int(np.argmin(np.abs(picture.at[shown] - picture.marks[0].at)))


def _nearest(picture: PathPicture) -> NDArray[np.intp]:
    """Return the indices (P,) of the nearest limits among the shown limits; -1 for none."""
    order = [k for k, _ in picture.limits]
    return np.array([order.index(k) if k in order else -1 for k in picture.samples.nearest.tolist()])


def _margin(picture: PathPicture, k: int) -> float | None:
    """Return the smallest margin at a sample, percent; None without a margin."""
    found = float(picture.margins[k]) if picture.margins.size else math.nan
    return float(f"{found:.4g}") if math.isfinite(found) else None


def _frame(picture: PathPicture, k: int, posture: Posture, size: float) -> PathFrame:
    """Return the robot at a sample."""
    samples, judged = picture.samples, picture.judged
    line = int(judged.path.lines[samples.points.segments[k]])
    label, _, unit = picture.label.partition(", ")
    words = (
        f"line {line}, {label} {number(float(picture.at[k]), float(picture.way.knots[-1]), digits=4)} {unit}".rstrip()
    )
    margin, nearest = _margin(picture, k), dict(picture.limits).get(int(samples.nearest[k]))
    if margin is not None and nearest is not None:
        words += (
            f": {nearest} violated by {percent(-margin)}" if margin < 0 else f": margin {percent(margin)} to {nearest}"
        )
    return {
        "words": with_signs(words),
        "at": float(picture.at[k]),
        "position": _rounded(posture.position, size),
        "points": _rounded(posture.points, size),
        "joints": [[*_rounded(each[:1], size), *_rounded(each[1:], _ROUGH / _FINE)] for each in posture.joints],
    }


def _rounded(values: FloatArray, size: float) -> Any:  # noqa: ANN401 - lists as deep as the array
    """Return coordinates as lists, rounded relative to the robot's size."""
    return np.round(values, max(0, math.ceil(-math.log10(_FINE * size)))).tolist()

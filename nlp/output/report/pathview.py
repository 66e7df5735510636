"""Data of the 3-D view of a path: the postures of the robot along it, the path with its nearest limits, and faults."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from ....models import FloatArray
from ...words.numbers import number
from ..pictures.drawing import Drawing, drawing_without_task
from ..pictures.pathpanels import LIMIT_COLOURS, PathPicture, percent
from ..pictures.posture import Linkage, Posture
from .frames import JointData, LinkData, PointData, first_eye, joint_data, link_data

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Postures of a page and their numbers, and points of the path, at most.
_POSTURES, _NUMBERS, _POINTS = 300, 60_000, 600
#: Part of the robot's size to which coordinates are rounded, and part of 1 for directions: a page shows less.
_FINE, _ROUGH = 1e-7, 1e-4
#: Room around everything that is drawn, in parts of the robot's size.
_ROOM = 0.08
#: Margin, percent, from which on its colour stays the same.
MOST_MARGIN = 50


class PathFrame(TypedDict):
    """The robot at one point of the path: its place in words, and points and joints as in the view of a solution."""

    words: str
    at: float
    position: list[float]
    points: list[list[float]]
    joints: list[list[list[float]]]


class PathMarkData(TypedDict):
    """A fault: its words, and the platform's origin there."""

    words: str
    position: list[float]


class PathViewData(TypedDict):
    """Content of the view, in the case's units.

    ``path`` has points of the platform's origin, ``nearest`` the index of the limit that is nearest there, -1 for none,
    ``margins`` the smallest margins in percent, and ``first`` is the index of the frame that is shown first.
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
    """Data of the view, and the drawing of the robot that is shown first."""

    data: PathViewData
    drawing: Drawing


def path_view(picture: PathPicture) -> PathView | None:
    """Return the robot along a path; None where it is not assembled anywhere, or its joints are not known."""
    judged, samples = picture.judged, picture.samples
    case, model, joints = judged.case, judged.case.model, samples.joints
    if joints is None or not joints.closed.any():
        return None
    scene = model.scene
    numbers = 3 * (len(scene.points) + sum(1 + len(each.axes) for each in scene.joints))
    shown = thinned(picture, min(_POSTURES, _NUMBERS // numbers), np.flatnonzero(joints.closed))
    linkage = Linkage(model, case.fixed_parameters("postures have fixed dimensions"), case.characteristic_length)
    postures = [
        linkage.posture_at(samples.poses.rotations[k], samples.poses.positions[k], joints.unknowns[k]) for k in shown
    ]
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
                {"words": f"line {each.line}: {', '.join(each.names)}", "position": _rounded(position, size)}
                for each, position in zip(picture.marks, marks, strict=True)
            ],
            "first": first,
            "frames": [_frame(picture, k, each, size) for k, each in zip(shown, postures, strict=True)],
        },
        drawing,
    )


def thinned(picture: PathPicture, most: int, among: NDArray[np.intp]) -> list[int]:
    """Return the indices of at most so many of some samples, the first and the last one and places of faults too."""
    if len(among) <= most:
        return [int(k) for k in among]
    points, faults = picture.samples.points, {each.place for each in picture.marks}
    kept = [
        k for k in among if faults and (int(points.segments[k]), float(points.parameters[k])) in faults
    ][: most // 2]  # fmt: skip
    spread = among[np.linspace(0, len(among) - 1, most - len(kept)).astype(int)]
    return sorted({int(k) for k in (*kept, *spread)})


def _first(picture: PathPicture, shown: list[int]) -> int:
    """Return the index, among the samples shown, of the one nearest to the first fault, or else of the first."""
    if not picture.marks:
        return 0
    return int(np.argmin(np.abs(picture.at[shown] - picture.marks[0].at)))


def _nearest(picture: PathPicture) -> NDArray[np.intp]:
    """Return the places (P,) of the nearest limits among those that are shown; -1 for none."""
    order = [k for k, _ in picture.limits]
    return np.array([order.index(k) if k in order else -1 for k in picture.samples.nearest.tolist()])


def _margin(picture: PathPicture, k: int) -> float | None:
    """Return the smallest margin at a sample, percent; None without one."""
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
        words += f": {percent(-margin)} beyond {nearest}" if margin < 0 else f": margin {percent(margin)} to {nearest}"
    return {
        "words": words,
        "at": float(picture.at[k]),
        "position": _rounded(posture.position, size),
        "points": _rounded(posture.points, size),
        "joints": [[*_rounded(each[:1], size), *_rounded(each[1:], _ROUGH / _FINE)] for each in posture.joints],
    }


def _rounded(values: FloatArray, size: float) -> Any:  # noqa: ANN401 - lists as deep as the array
    """Return coordinates as lists, rounded to a small part of the robot's size."""
    return np.round(values, max(0, math.ceil(-math.log10(_FINE * size)))).tolist()

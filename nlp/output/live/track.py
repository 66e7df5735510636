"""Live view along a tool path: recorded postures, curves and violations, with sliders of dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ....models import axis_angle_from_matrix
from ...case.case import Case
from ...errors import CaseError, InputError
from ...results.path import PathVerdictData
from ...view.source import ViewSource, view_source
from ..pictures.pathpanels import PathPanel, PathPicture
from ..report.markup import LiveView, no_live_view
from ..report.path import path_page
from ..report.pathview import PathView, path_view
from .embed import embedded
from .page import Track, live_parts
from .posing import HALF_TURN, pose_places, with_free_pose

#: Room beyond the range of a coordinate in its bars, as a fraction of the range.
_BAR_ROOM = 0.05


def live_path_page(
    picture: PathPicture, text: str, command: Callable[[PathVerdictData], str], name: str = "case.toml"
) -> str:
    """Return the page about a path, whose first screen is the live view if C can be generated and compiled.

    Args:
        picture: path with its verdicts and curves.
        text: text of the case file.
        command: function that returns the command that shows a violated claim.
        name: name of the case on the command line.
    """
    view = path_view(picture)
    if view is None:
        live = no_live_view("the joint coordinates are not known at any point of the path")
    else:
        live = _live_view(picture, view, name)
    return path_page(picture, text, command, live)


def _live_view(picture: PathPicture, view: PathView, name: str) -> LiveView:
    """Return the live view along a path; the reason without C for the case, or if dimensions change along the path."""
    if moving := picture.judged.path.settings.names:
        names = " and ".join(map(picture.judged.case.parameter_name, moving))
        return no_live_view(f"the live view does not move {names} along a path")
    try:
        source = view_source(_case_along(picture, view))
        parts = live_parts(source, None, name, _track(picture, view, source))
    except (CaseError, InputError) as error:
        return no_live_view(str(error))
    return embedded(parts)


def _case_along(picture: PathPicture, view: PathView) -> Case:
    """Return the case with the poses of the path as its range, at one pose, and without the path."""
    poses = picture.samples.poses
    largest = max(axis_angle_from_matrix(each).angle for each in poses.rotations)
    if largest >= HALF_TURN:
        raise InputError("the path turns the platform by half a turn")
    return with_free_pose(picture.judged.case, poses.positions, largest, view.data["size"])


def _track(picture: PathPicture, view: PathView, source: ViewSource) -> Track:
    """Return the postures of a view as variables of the live view's program."""
    samples, nlp, path = picture.samples, source.subject.nlp, picture.judged.path
    joints = samples.joints
    if joints is None:
        raise InputError("the joint coordinates along the path are not known")
    places = pose_places(nlp)
    inner = nlp.program.places.unknowns[0]
    frames = []
    x = nlp.start.copy()
    for number, (k, frame) in enumerate(zip(view.shown, view.data["frames"], strict=True)):
        axis, angle = axis_angle_from_matrix(samples.poses.rotations[k])
        values = [*samples.poses.positions[k], *(np.asarray(axis) * math.sin(angle / 2)), *joints.unknowns[k]]
        has_time = bool(np.isfinite(path.durations[samples.points.segments[k]]))
        numbers = [float(each) for each in values]
        frames.append({"words": frame["words"], "at": frame["at"], "values": numbers, "has_time": has_time})
        if number == view.data["first"]:
            x[[*places, *inner]] = values
    shown = {key: view.data[key] for key in ("limits", "path", "nearest", "margins", "most", "marks", "first")}
    panels = [
        {
            "title": panel.title,
            "unit": panel.unit,
            "limits": list(panel.limits),
            "is_speed": panel.is_speed,
            "is_lower": panel.is_lower,
            **_scale(panel),
            "curves": [
                {
                    "name": f"{each.name} min" if each.is_other else each.name,
                    "values": [_known(each.values[k]) for k in view.shown],
                }
                for each in panel.curves
            ],
        }
        for panel in picture.panels
    ]
    return Track(x, {**shown, "places": [*places, *inner], "frames": frames, "panels": panels})


def _scale(panel: PathPanel) -> dict[str, float]:
    """Return the ends of the bars of a panel, and the value at which bars begin.

    Forces and speeds have a zero in the middle. The zero of a joint coordinate has no meaning for its limits: its bars
    begin at the lower end of the range of limits and values.
    """
    every = np.concatenate([np.array(panel.limits), *(each.values for each in panel.curves)])
    every = every[np.isfinite(every)]
    if not panel.is_coordinate:
        most = float(np.max(np.abs(every), initial=0.0)) or 1.0
        return {"low": -most, "high": most, "base": 0.0}
    low, high = float(np.min(every, initial=math.inf)), float(np.max(every, initial=-math.inf))
    room = _BAR_ROOM * (high - low) or 1.0
    return {"low": low - room, "high": high + room, "base": low - room}


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None

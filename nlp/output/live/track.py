"""Live view along a tool path: recorded postures, curves and violations, with sliders of dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....models import FloatArray, axis_angle_from_matrix
from ...case.case import Case
from ...case.pose import Free, Rotation
from ...errors import CaseError, InputError
from ...program.nlp import Nlp
from ...program.places import FreeRotation
from ...results.path import PathVerdictData
from ...view.source import ViewSource, view_source
from ..pictures.pathpanels import PathPicture
from ..report.markup import NO_LIVE_VIEW, LiveView
from ..report.path import path_page
from ..report.pathview import PathView, path_view
from .embed import embedded
from .page import Track, live_parts

#: Room around the path in its box of positions, as a fraction of the robot's size, and of the rotations, radians.
_ROOM, _TURN = 0.05, 0.2
#: Largest rotation, radians: the page's variables are smooth below half a turn.
_HALF_TURN = math.pi - 0.01


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
    return path_page(picture, text, command, NO_LIVE_VIEW if view is None else _live_view(picture, view, name))


def _live_view(picture: PathPicture, view: PathView, name: str) -> LiveView:
    """Return the live view along a path; no view without C for the case, or if dimensions change along the path."""
    if picture.judged.path.settings.names:
        return NO_LIVE_VIEW
    try:
        source = view_source(_case_along(picture, view))
        parts = live_parts(source, None, name, _track(picture, view, source))
    except (CaseError, InputError):
        return NO_LIVE_VIEW
    return embedded(parts)


def _case_along(picture: PathPicture, view: PathView) -> Case:
    """Return the case with the poses of the path as its range, at one pose, and without the path."""
    case, poses = picture.judged.case, picture.samples.poses
    room = _ROOM * view.data["size"]
    position = [
        Free(float(low) - room, float(high) + room)
        for low, high in zip(poses.positions.min(axis=0), poses.positions.max(axis=0), strict=True)
    ]
    largest = max(axis_angle_from_matrix(each).angle for each in poses.rotations) + _TURN
    if largest > _HALF_TURN:
        raise InputError("the path turns the platform by half a turn or more")
    rotation = Rotation(axis=None, angle=Free(-largest, largest))
    return replace(
        case,
        position=position,
        rotation=rotation,
        displacements=case.displacements[:1],
        further=(),
        workspace=None,
        path=None,
        worst_everywhere=False,
    )


def _track(picture: PathPicture, view: PathView, source: ViewSource) -> Track:
    """Return the postures of a view as variables of the live view's program."""
    samples, nlp = picture.samples, source.subject.nlp
    joints = samples.joints
    if joints is None:
        raise InputError("the joint coordinates along the path are not known")
    places = _places(nlp)
    inner = nlp.program.places.unknowns[0]
    frames = []
    x = nlp.start.copy()
    for number, (k, frame) in enumerate(zip(view.shown, view.data["frames"], strict=True)):
        axis, angle = axis_angle_from_matrix(samples.poses.rotations[k])
        values = [*samples.poses.positions[k], *(np.asarray(axis) * math.sin(angle / 2)), *joints.unknowns[k]]
        frames.append({"words": frame["words"], "at": frame["at"], "values": [float(each) for each in values]})
        if number == view.data["first"]:
            x[[*places, *inner]] = values
    shown = {key: view.data[key] for key in ("limits", "path", "nearest", "margins", "most", "marks", "first")}
    panels = [
        {
            "title": panel.title,
            "unit": panel.unit,
            "limits": list(panel.limits),
            "most": _largest(panel.limits, [each.values for each in panel.curves]),
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


def _places(nlp: Nlp) -> list[int]:
    """Return the indices in ``x`` of position and rotation: three coordinates, then the quaternion's vector part."""
    numbers = dict(zip(nlp.case.scalars, nlp.program.places.numbers, strict=True))
    (rotation,) = nlp.program.places.rotations
    if not isinstance(rotation, FreeRotation):
        raise InputError("the rotation of the platform has no variables")
    return [*(numbers[f"p_{letter}"].index for letter in "xyz"), *rotation.q]


def _largest(limits: tuple[float, ...], curves: list[FloatArray]) -> float:
    """Return the largest magnitude of limits and values."""
    every = np.abs(np.concatenate([np.array(limits), *curves]))
    return float(np.max(every[np.isfinite(every)], initial=0.0)) or 1.0


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None

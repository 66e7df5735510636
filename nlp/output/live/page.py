"""Live page of a case: the robot, its sliders, and the module that solves, in one HTML text."""

from __future__ import annotations

import base64
import gzip
import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np

from ....models import FloatArray
from ...errors import EvaluationError, InputError
from ...evidence.evaluation import starting_point
from ...evidence.state import evaluate
from ...program.formulation import formulate
from ...program.nlp import Nlp
from ...program.places import FreeRotation
from ...solver.solution import Solution
from ...view.data import view_data
from ...view.source import ViewSource
from ...view.wasm import compile_module
from ...words.lines import title_line
from ...words.text import Line
from ..pictures.drawing import Drawing, drawing_of
from ..pictures.posture import Posture
from ..pictures.view import clearest_view
from ..report.frames import joint_data, link_data, postures_along_motion
from ..report.markup import Markup, script_json, tag
from .casefile import case_parts, stated_tasks
from .controls import body_of, footer_of
from .headline import answer_of, headline_of, name_of_objective, task_markup, task_of

#: Modules of the page in the order of their imports.
SCRIPTS = (
    "numbers.js",
    "names.js",
    "module.js",
    "limits.js",
    "state.js",
    "text.js",
    "scene.js",
    "canvas.js",
    "panel.js",
    "tasks.js",
    "bars.js",
    "jumps.js",
    "map.js",
    "play.js",
    "schedule.js",
    "track.js",
    "main.js",
)
#: Recorded positions on each side of the pose, and rounding of coordinates relative to the robot's size.
_RECORDED, _FINE = 12, 1e-7
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./\w+\.js";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=const|class)", re.MULTILINE)
#: Pieces of the view in the template of its page.
_PIECES = ("style", "heading", "task", "answer", "body", "footer", "data", "module", "script")
#: Statuses of the module in words, by code.
_STATUSES = (
    "optimum",
    "the search in the page ended at no optimum; the point is feasible",
    "no feasible point was found with these values",
    "the values are not allowed",
    "the search was stopped",
    "an optimum in another assembly mode than home",
    "optimum at the end of a joint range or of the home assembly mode",
)


@dataclass(frozen=True, eq=False)
class Track:
    """Postures along a path.

    Attributes:
        x: (n,) variables at the first shown posture.
        data: data of the script: postures, path, violations, and curves at each posture.
        names: settings that change along the path, whose sliders are those of the track.
        answer: headline of the page before its script starts.
        task: motions of the tasks in words.
    """

    x: FloatArray
    data: dict[str, Any]
    names: tuple[str, ...] = ()
    answer: str = ""
    task: tuple[Line, ...] = ()


@dataclass(frozen=True, eq=False)
class LivePage:
    """Live page of a case.

    Attributes:
        text: HTML of the page.
        fault: reason why the page cannot solve; empty if it can.
        size: bytes of the module; 0 without one.
    """

    text: str
    fault: str
    size: int


@dataclass(frozen=True, eq=False)
class LiveParts:
    """Pieces of the live view of a case, for its own page and for the first screen of other pages.

    Attributes:
        style: style sheet; its rules hold in a document and in the shadow tree of an element.
        heading: title of the case.
        task: task in words.
        answer: content of the headline.
        body: picture and controls.
        footer: origin of the values.
        data: JSON of the script.
        module: WebAssembly module, compressed and encoded; empty without one.
        script: script, as one text without imports.
        fault: reason why the view cannot solve; empty if it can.
        size: bytes of the module; 0 without one.
    """

    style: Markup
    heading: Markup
    task: Markup
    answer: Markup
    body: Markup
    footer: Markup
    data: Markup
    module: str
    script: Markup
    fault: str
    size: int


def live_page(source: ViewSource, solution: Solution | None, command: str, track: Track | None = None) -> LivePage:
    """Return the live page of a case; the arguments are those of :func:`live_parts`."""
    parts = live_parts(source, solution, command, track)
    case = source.subject.nlp.case
    texts = {name: getattr(parts, name) for name in _PIECES}
    title = tag("title", f"{case.title or case.name} - screwsynth")
    return LivePage(Template(_file("live.html.in")).substitute(texts, title=title), parts.fault, parts.size)


def live_parts(source: ViewSource, solution: Solution | None, command: str, track: Track | None = None) -> LiveParts:
    """Return the pieces of the live view of a case.

    Args:
        source: C of the live view.
        solution: solution of the case; None for a case that is only evaluated.
        command: name of the case on the command line.
        track: postures along a path, with which the page moves; None for none.

    Raises:
        InputError: the robot has no configuration at the shown point.
    """
    nlp = source.subject.nlp
    case = nlp.case
    module, fault = _module(source)
    data = view_data(source)
    answer = None if solution is None else answer_of(solution)
    start = starting_point(nlp) if track is None else track.x
    x = start if answer is None else np.array(answer["x"])
    drawing = _drawing(nlp, x)
    if track is not None:
        # The range of rotations is only that of the path.
        data["rows"] = [each for each in data["rows"] if each["name"] != "angle"]
        for slider in data["sliders"]:
            if slider["name"] in track.names:
                slider["group"] = "setting"
    page = {
        **data,
        "scene": _scene(drawing),
        "camera": _camera(drawing),
        "view": _view(source, x),
        "p": nlp.arguments.tolist(),
        "start": start.tolist(),
        "answer": answer,
        "statuses": list(_STATUSES),
        "F_name": name_of_objective(case),
        "is_stated": case.tasks[0].is_stated,
        "command": shlex.quote(command),
        "case_parts": case_parts(
            case,
            [each["key"] for each in data["limits"]],
            has_weights=all(each["weight"] >= 0 for each in data["tasks"]),
        ),
        "has_module": bool(module),
        "stated_tasks": _for_json(stated_tasks(case)),
        "prefixes": list(case.pose_prefixes),
        "track": None if track is None else track.data,
        "recorded": _recorded(nlp, x, is_needed=track is None and (bool(fault) or not _has_free_turns(nlp))),
    }
    return LiveParts(
        style=Markup(_file("live.css")),
        heading=tag("h1", title_line(case).words),
        task=task_of(case, solution) if track is None else task_markup(track.task),
        answer=headline_of(nlp, x, answer, None if track is None else track.answer, has_module=bool(module)),
        body=body_of(case, data, drawing, fault),
        footer=footer_of(source, module),
        data=script_json(page),
        module=base64.b64encode(gzip.compress(module, mtime=0)).decode("ascii") if module else "",
        script=Markup(script_text()),
        fault=fault,
        size=len(module),
    )


def _module(source: ViewSource) -> tuple[bytes, str]:
    """Return the compiled module and an empty text; without a module, the reason."""
    if source.fault:
        return b"", source.fault
    try:
        return compile_module(source.files), ""
    except InputError as error:
        return b"", str(error)


def script_text(names: Sequence[str] = SCRIPTS) -> str:
    """Return modules of the page as one: imports and exports are left out, so all names are in one scope."""
    return "".join(_EXPORT.sub("", _IMPORT.sub("", _file(name))) for name in names)


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.live") / "page" / name).read_text(encoding="utf-8")


def _drawing(nlp: Nlp, x: FloatArray) -> Drawing:
    """Return the drawing of the robot at a point.

    Raises:
        InputError: the robot has no configuration at the point.
    """
    try:
        return drawing_of(nlp, x, evaluate(nlp, x))
    except EvaluationError as error:
        raise InputError(f"{error}; there is no robot to show") from None


def _scene(drawing: Drawing) -> dict[str, Any]:
    """Return the lines, outlines and joints of the drawing."""
    joints = zip(joint_data(drawing), drawing.model.scene.joints, strict=True)
    return {
        "links": link_data(drawing),
        "plates": {body.value: list(loop) for body, loop in drawing.plates},
        "joints": [{**data, "axes": len(joint.axes)} for data, joint in joints],
        "corners": list(drawing.corners),
        "size": drawing.size,
    }


def _has_free_turns(nlp: Nlp) -> bool:
    """Return whether the module can turn the robot at every pose about any axis."""
    return all(isinstance(each, FreeRotation) for each in nlp.program.places.rotations)


def _recorded(nlp: Nlp, x: FloatArray, *, is_needed: bool) -> list[dict[str, Any] | None]:
    """Return the robot along the motion of each task, for a page that cannot compute it; None where it cannot move."""
    found: list[dict[str, Any] | None] = []
    for k, task in enumerate(nlp.case.tasks):
        if not is_needed or not task.is_stated:
            found.append(None)
            continue
        drawing = _drawing_of_task(nlp, x, k)
        postures, zero = postures_along_motion(drawing, _RECORDED)
        values = [_drawn_values(each.posture, drawing.size) for each in postures]
        found.append({"zero": zero, "frames": values} if len(values) > 1 else None)
    return found


def _drawing_of_task(nlp: Nlp, x: FloatArray, task: int) -> Drawing:
    """Return the robot at the first pose of a task."""
    if not nlp.case.changes:
        return drawing_of(nlp, x, evaluate(nlp, x), task)
    own, places = formulate(nlp.case, task), nlp.program.places
    at = x[places.of_task(task, len(places.owners))]
    return drawing_of(own, at, evaluate(own, at))


def _drawn_values(posture: Posture, size: float) -> list[float]:
    """Return points, circles, joints and position of a posture, rounded relative to the robot's size."""
    parts = [posture.points, posture.circles, *posture.joints, posture.position]
    places = max(0, math.ceil(-math.log10(_FINE * size)))
    return [round(value, places) for part in parts for value in np.ravel(part).tolist()]


def _for_json(tasks: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return tasks for JSON, with the text ``inf`` for the pitch of a translation."""
    return [{**task, "pitch": str(task["pitch"])} if task else {} for task in tasks]


def _camera(drawing: Drawing) -> dict[str, float]:
    view = clearest_view(drawing)
    return {"azimuth": view.azimuth, "elevation": view.elevation}


def _view(source: ViewSource, x: FloatArray) -> list[float]:
    """Return the values of the view at a point, for a picture before the module starts."""
    nlp, functions = source.subject.nlp, source.functions
    inputs = functions.inputs(x, nlp.arguments).full().ravel()[: functions.view.numel_in(0)]
    values = functions.view(inputs).full().ravel()
    return [float(each) if np.isfinite(each) else 0.0 for each in values]

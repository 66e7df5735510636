"""Live page of a case: the robot, its sliders, and the module that solves, in one HTML text."""

from __future__ import annotations

import base64
import gzip
import math
import re
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np

from ....models import FloatArray
from ...case.case import Case
from ...errors import EvaluationError, InputError
from ...evidence.evaluation import starting_point
from ...evidence.state import evaluate
from ...program.formulation import formulate
from ...program.nlp import Nlp
from ...program.places import FreeRotation
from ...results.data import OutcomeData, SolveResult
from ...results.objective import unit_of_objective
from ...results.result import result_of
from ...solver.solution import Solution
from ...view.data import ViewData, view_data
from ...view.source import ViewSource
from ...view.wasm import compile_module
from ...words.lines import headline, task_lines, title_line
from ...words.numbers import number
from ...words.text import Line
from ..pictures.drawing import Drawing, drawing_of
from ..pictures.posture import Posture
from ..pictures.view import clearest_view
from ..report.frames import joint_data, link_data, postures_along_motion
from ..report.markup import Markup, join_markup, paragraphs, script_json, tag
from .casefile import case_parts, stated_tasks

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
    answer = None if solution is None else _answer(solution)
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
        "F_name": _name_of_F(case),
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
        task=_task(case, solution) if track is None else _task_markup(track.task),
        answer=_headline(nlp, x, answer, track, has_module=bool(module)),
        body=_body(case, data, drawing, fault),
        footer=_footer(source, module),
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


def _name_of_F(case: Case) -> str:  # noqa: N802 - the objective's name
    """Return the name of the objective in the headline."""
    if len(case.tasks) > 1:
        return case.method.value
    return "F" if case.pose_count == 1 else f"F ({case.over_poses.value} over {case.pose_count} poses)"


def _answer(solution: Solution) -> dict[str, Any]:
    """Return the program's answer: point, words of the terminal's headline, and whether it is an optimum."""
    combination = solution.combination
    own = solution.outcomes[0].own if combination is None else combination.combined
    x = solution.x if own is None else own.x
    result = result_of(solution)
    found: dict[str, Any] = {"x": x.tolist(), "isOptimum": solution.status.is_answer, "optima": [], "tasks": []}
    if isinstance(result, SolveResult):
        return {**found, "words": headline(result, solution.case).words}
    method, value = solution.case.method.value, result.combined.value
    words = f"tasks combined by {method}" if value is None else f"{method} = {number(value)}"
    units = [unit_of_objective(solution.case, k) for k in range(len(result.combined.tasks))]
    return {
        **found,
        "words": f"{words}   ({solution.status.value})",
        "optima": [each.best for each in result.combined.tasks],
        "tasks": [_task_words(each, unit) for each, unit in zip(result.combined.tasks, units, strict=True)],
    }


def _task_words(task: OutcomeData, unit: str) -> str:
    """Return F of one of several tasks as a part of its separate optimum; ``panel.js`` writes it after a change."""
    if task.F is None:
        return f"{task.name}: no F"
    words = f"{task.name}: F = {number(task.F)} {unit}".rstrip()
    if task.best is None:
        return words
    part = f"{100 * task.F / task.best:.4g}\N{NO-BREAK SPACE}% of " if task.best else ""
    return f"{words}, {part}the separate {task.sense.value}imum {number(task.best)}"


def _headline(
    nlp: Nlp, x: FloatArray, answer: dict[str, Any] | None, track: Track | None, *, has_module: bool
) -> Markup:
    """Return the headline of an answer, of a track or, without both and without a module, of the shown point."""
    if answer is not None:
        return _answer_markup(answer["words"], answer["tasks"])
    if track is not None:
        return _answer_markup(track.answer)
    return _answer_markup("") if has_module else _value_markup(nlp, x)


def _answer_markup(words: str, tasks: Sequence[str] = ()) -> Markup:
    """Return the content of the headline, with words for each of several tasks; the script fills it after a change."""
    return join_markup(
        [
            tag("span", words, id="F"),
            tag("span", id="word"),
            tag("span", id="words"),
            tag("ul", *(tag("li", each) for each in tasks), id="task-values", hidden=not tasks),
        ]
    )


def _value_markup(nlp: Nlp, x: FloatArray) -> Markup:
    """Return the headline of a page without an answer and without a module: the objective at the shown point."""
    F = float(np.ravel(nlp.program.kernels.derivatives(x, nlp.arguments).F)[0])
    words = f"{_name_of_F(nlp.case)} = {number(F)} {unit_of_objective(nlp.case)}".rstrip()
    if len(nlp.case.tasks) > 1 or not math.isfinite(F):
        words = ""
    return join_markup(
        [
            tag("span", words, id="F"),
            tag("span", "point", id="word"),
            tag("span", "nothing is optimised", id="words"),
            tag("ul", id="task-values", hidden=True),
        ]
    )


def _task(case: Case, solution: Solution | None) -> Markup:
    """Return the task in words."""
    result = None if solution is None else result_of(solution)
    lines: list[Line] = []
    if isinstance(result, SolveResult) and result.robot is not None and result.robot.task is not None:
        lines = [*task_lines(result.robot.task, case.units)]
    return _task_markup(lines)


def _task_markup(lines: Sequence[Line]) -> Markup:
    """Return the place of the task in words."""
    return tag("div", paragraphs(lines), class_="task", id="stated-task")


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


def _body(case: Case, data: ViewData, drawing: Drawing, fault: str) -> Markup:
    """Return the picture and the controls."""
    stated = drawing.case is not None and case.tasks[0].is_stated
    choices = [("rate 0", "rate of the shown task")] if case.changes and stated else []
    if not case.changes:
        choices = [(f"rate {k}", f"rate, {task['name']}") for k, task in enumerate(data["tasks"]) if stated]
    choices += [(f"force {k}", f"actuator force, {name}") for k, name in enumerate(data["loads"])]
    options = [tag("option", words, value=value) for value, words in choices or [("rate 0", "rate")]]
    poses = [tag("option", words, value=k) for k, words in enumerate(_pose_words(data))]
    words = "Robot in three dimensions. Arrow keys turn it, plus and minus zoom, 0 resets the view."
    picture = tag(
        "figure",
        tag("canvas", id="robot", tabindex="0", role="img", aria_label=words),
        tag(
            "figcaption",
            tag("label", "Colour of limbs: ", tag("select", *options, id="colour")),
            tag(
                "span",
                tag("span", class_="scale", aria_hidden="true"),
                tag("span", "blue negative, orange positive"),
                class_="together",
            ),
            tag("label", "Shown: ", tag("select", *poses, id="pose")) if len(poses) > 1 else None,
            *_players(case),
            tag("button", "Reset view", type="button", id="view-reset"),
            tag("button", "Fit", type="button", id="view-fit"),
            tag("span", _legend(stated=stated), class_="extra") if stated else None,
        ),
        id="picture",
    )
    return join_markup([picture, tag("div", *_controls(data, fault), id="controls", tabindex="-1"), _values(data)])


def _pose_words(data: ViewData) -> list[str]:
    """Return the name of each pose: that of its task, if dimensions or the pose change from task to task."""
    tasks = data["pose_tasks"]
    if not tasks:
        return [f"pose {k + 1}" for k in range(data["poses"])]
    names = [data["tasks"][task]["name"] for task in tasks]
    if len(set(tasks)) == len(tasks):
        return names
    return [
        f"{name}, pose {tasks[: k + 1].count(task)}" for k, (name, task) in enumerate(zip(names, tasks, strict=True))
    ]


def _players(case: Case) -> Iterable[Markup]:
    """Yield the buttons that play the motion of each task; the script shows them if the robot can follow it."""
    for k, task in enumerate(case.tasks):
        if task.is_stated:
            words = "Play motion" if len(case.tasks) == 1 else f"Play {task.name}"
            yield tag("button", words, type="button", class_="play", data_play=k, aria_pressed="false", hidden=True)


def _legend(*, stated: bool) -> str:
    return "Straight arrow: axis of the task. Purple: its pitch, and velocities of the platform." if stated else ""


def _controls(data: ViewData, fault: str) -> list[Markup]:
    """Return the controls beside the picture."""
    if fault:
        return [tag("p", f"The sliders of this page do not work: {fault}.", class_="warning")]

    def button(key: str, words: str, **more: object) -> Markup:
        return tag("button", words, type="button", id=key, **more)

    modes = tag(
        "div",
        button("mode-solve", "Solve", aria_pressed="true"),
        button("mode-evaluate", "Evaluate", aria_pressed="false"),
        tag("span", class_="gap"),
        button("to-answer", "Program's answer"),
        button("to-start", "Start"),
        button("to-next", "Next optimum"),
        button("free-all", "Release all"),
        class_="controls",
        role="group",
        aria_label="Mode and points",
    )
    note = "A moved value is held, the others are solved for. Thin bars: change of F over each range."
    tasks = tag("details", tag("summary", "Task"), tag("div", id="tasks"), id="tasks-group", hidden=True)
    groups = [
        tag("section", tag("h2", words), tag("div", id=f"{key}s"), id=f"{key}-group")
        for key, words in (("dimension", "Dimensions"), ("pose", "Pose"))
    ]
    copies = tag(
        "div",
        button("copy-set", "Copy command"),
        button("copy-case", "Copy case file"),
        button("copy-link", "Copy link"),
        class_="controls",
    )
    copied = tag(
        "div",
        tag("label", "Text", id="copied-words", for_="copied-text"),
        tag("textarea", id="copied-text", readonly=True, spellcheck="false"),
        id="copied",
        hidden=True,
    )
    content = [modes, tag("p", note, class_="note"), *groups, tasks, copies, copied]
    notice = [tag("p", f"In this page {data['notice']}.", class_="note")] if data["notice"] else []
    return [tag("div", *notice, *content, class_="needs-module")]


def _values(data: ViewData) -> Markup:
    """Return the places of limits, singular values, rotation, forces and speeds at the point."""
    values = tag(
        "dl",
        *(
            tag("div", tag("dt", words), tag("dd", id=key), id=f"{key}-row")
            for key, words in (
                ("rank", "rank of J"),
                ("singular", "smallest singular value"),
                ("turn", "rotation"),
                ("time", "last change"),
            )
        ),
    )
    limits = tag("section", tag("h2", "Limits"), tag("div", id="limits"), id="limits-group")
    track = tag("section", id="track", aria_label="Actuators at this point of the path")
    return tag("div", track, values, _actuators(data), limits, _map(), id="values", class_="needs-module")


def _map() -> Markup:
    """Return the place of a map over two values."""
    whats = [tag("option", words, value=key) for key, words in (("F", "F"), ("singular", "smallest singular value"))]
    choices = tag(
        "div",
        tag("label", "Value: ", tag("select", *whats, id="map-what")),
        tag("label", "across: ", tag("select", id="map-x")),
        tag("label", "upwards: ", tag("select", id="map-y")),
        class_="controls",
    )
    picture = tag("canvas", id="map", role="img", aria_label="Map of a value over two sliders; a click moves there")
    words = tag("p", id="map-words", class_="note")
    return tag("details", tag("summary", "Map"), choices, picture, words, id="map-group")


def _actuators(data: ViewData) -> Markup:
    """Return the table of actuator forces and speeds; empty without loads and speeds."""
    if "largest" not in data["blocks"]:
        return Markup("")
    forces, speeds = ({each[key] for each in data["actuators"]} for key in ("force", "speed"))
    heads = ["actuator", *(f"{name}, {_one(forces)}" for name in data["loads"])]
    heads += [f"speed, {_one(speeds)}"] if data["blocks"]["speeds"][1] else []
    head = tag("thead", tag("tr", *(tag("th", words, scope="col") for words in heads)))
    table = tag("table", tag("caption", "Actuator forces and speeds"), head, tag("tbody", id="actuators"))
    return tag("div", table, class_="scroll", tabindex="0", role="region", aria_label="Actuator forces and speeds")


def _one(units: Sequence[str] | set[str]) -> str:
    """Return the common unit; several units one after the other."""
    return " or ".join(sorted(units))


def _footer(source: ViewSource, module: bytes) -> Markup:
    """Return the origin of the values of the page."""
    if not module:
        return tag("p", "Made by screwsynth.")
    words = (
        "Made by screwsynth. Values after a change are computed in this page by the C that "
        "screwsynth codegen writes, compiled to WebAssembly; SHA-256 of the C: "
    )
    return tag("p", words, tag("code", source.checksum[:16]), ".")

"""Content of a live page: the robot, its sliders and buttons, the values, the map and the footer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...case.case import Case
from ...view.data import ViewData
from ...view.source import ViewSource
from ..pictures.drawing import Drawing
from ..report.markup import Markup, join_markup, tag


def body_of(case: Case, data: ViewData, drawing: Drawing, fault: str) -> Markup:
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


def footer_of(source: ViewSource, module: bytes) -> Markup:
    """Return the origin of the values of the page."""
    if not module:
        return tag("p", "Made by screwsynth.")
    words = (
        "Made by screwsynth. Values after a change are computed in this page by the C that "
        "screwsynth codegen writes, compiled to WebAssembly; SHA-256 of the C: "
    )
    return tag("p", words, tag("code", source.checksum[:16]), ".")

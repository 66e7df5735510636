"""Section of a report with the robot: 3-D view with controls and legend, and the table of rates."""

from __future__ import annotations

from collections.abc import Iterator

from ..pictures.style import RATE_COLOURS
from .frames import ViewData
from .markup import (
    Markup,
    beside,
    caption,
    join_markup,
    paragraphs,
    script_frame,
    tag,
    view_buttons,
)
from .report import Report
from .stills import narrow_image, still_element
from .tables import aligned

#: Largest number of drawings in a page; further views have only their tables.
_DRAWINGS = 12


def pose_controls(views: list[ViewData], poses: int) -> Markup | None:
    """Return a slider over the poses and a sentence on the worst pose, or None for a single pose."""
    if poses == 1:
        return None
    first = views[0]
    worst = next((view for view in views if view["task"] == first["task"] and view["is_worst"]), None)
    words = f"{first['pose_words']}, worst pose" if first["is_worst"] else first["pose_words"]
    slider = tag("input", type="range", id="pose", min=1, max=poses, step=1, value=first["pose"] + 1)
    shown = tag("output", words, id="posed", for_="pose")
    button = tag("button", "Show worst pose", type="button", id="worst", disabled=first["is_worst"])
    controls = tag("p", tag("label", "Pose", for_="pose"), slider, shown, button, class_="controls travel script")
    if worst is None:
        return controls
    task = f" for “{first['name']}”" if any(view["task"] != first["task"] for view in views) else ""
    return join_markup([controls, tag("p", f"Worst pose{task}: {worst['pose_words']}.", id="worst-words")])


def drawings(report: Report) -> Markup:
    """Return drawings of the views as pictures; one of them is shown in a browser without WebGL or JavaScript."""
    found = [
        (index, view, drawing)
        for index, (view, drawing) in enumerate(
            pair for part in report.parts for pair in zip(part.views, part.drawings, strict=True)
        )
    ]
    stills = []
    for index, view, drawing in found[:_DRAWINGS]:
        words = f"Robot, {view['pose_words']}; values are in the table."
        kind = "still" if index else "still chosen"
        stills.append(still_element(drawing, alt=words, class_=kind, data_view=index))
    return join_markup(stills)


def first_still(report: Report) -> Markup:
    """Return the first drawing with labels that a telephone shows large enough; empty without a drawing."""
    drawing = next((drawing for part in report.parts for drawing in part.drawings), None)
    if drawing is None:
        return Markup("")
    words = "the design, at its first pose" if report.case.poses_per_task > 1 else "the design"
    image = narrow_image(drawing, alt=f"Robot: {words}", class_="design")
    return tag("figure", image, caption("Robot", words, "; limbs with their rates." if drawing.rows else "."))


def robot_section(report: Report, *, is_live: bool = False) -> Markup:
    """Return the 3-D view with its controls and legend, and the table of rates.

    With a live view, the section has drawings instead of the 3-D view, and the table of rates of each task.
    """
    views = [view for part in report.parts for view in part.views]
    if not views:
        return paragraphs(["No picture: the robot does not exist at the final point of the search."])
    first = views[0]
    head: list[Markup] = []
    if not report.is_answer:
        head.append(tag("p", "Final point of the search, not an optimum.", class_="warning"))
    if is_live:
        return join_markup([*head, *_still_parts(report)])
    if len(report.parts) > 1:
        options = [tag("option", part.name, value=k) for k, part in enumerate(report.parts) if part.views]
        head.append(
            tag("p", tag("label", "Task: ", for_="task"), tag("select", *options, id="task"), class_="controls script")
        )
    controls = pose_controls(views, report.case.poses_per_task)
    if controls is not None:
        head.append(controls)
    last = len(first["frames"]) - 1
    moving = tag(
        "p",
        tag("label", "Displacement along the task's motion", for_="travel"),
        tag("input", type="range", id="travel", min=0, max=last, step=1, value=first["zero"]),
        tag("output", first["frames"][first["zero"]]["words"], id="travelled", for_="travel"),
        class_="controls travel script",
    )
    fixed = "No WebGL in this browser: the drawing of the robot is fixed, but the table follows the sliders."
    words = "3-D view of the robot; values are in the table."
    picture = tag(
        "figure",
        tag("p", fixed, class_="flat-words", role="status"),
        tag("div", script_frame("view", "picture", words), drawings(report), class_="stage"),
        view_buttons(),
        # The copy is for printing, because browsers do not print WebGL.
        tag("img", id="view-copy", class_="copy", alt="3-D view of the robot; values are in the table"),
        caption("Robot", _legend(first), id="view-words"),
    )
    shown = beside(picture, _rates(first)) if first["rows"] else picture
    content = [*head, moving, shown] if first["motion"] else [*head, shown]
    note = "The view needs JavaScript; the tables are complete without it."
    return join_markup([*content, tag("noscript", tag("p", note))])


def _still_parts(report: Report) -> Iterator[Markup]:
    """Yield a drawing and the table of rates for each task and pose of the design."""
    shown = 0
    for part in report.parts:
        for view, drawing in zip(part.views, part.drawings, strict=True):
            several = len(report.parts) > 1 or report.case.poses_per_task > 1
            words = view["pose_words"] if report.case.poses_per_task > 1 else f"task “{view['name']}”"
            if several:
                heading = f"{words[0].upper()}{words[1:]}"
                yield tag("h3", f"{heading}, worst pose" if view["is_worst"] else heading)
            parts = []
            if shown < _DRAWINGS:
                image = still_element(drawing, alt=f"Robot, {words}", class_="design")
                parts.append(tag("figure", image, caption("Robot", _legend(view, is_still=True))))
            shown += 1
            if view["rows"]:
                parts.append(_rates(view, None if several else "rates"))
            yield beside(*parts)


def _legend(view: ViewData, *, is_still: bool = False) -> Markup:
    """Return the legend of the colours and lines of the view."""
    gradient = f"background:linear-gradient(90deg,{','.join(RATE_COLOURS)})"
    bar = tag("span", class_="scale", style=gradient, aria_hidden="true")
    forces = tag("span", view["forces_words"], id="forces-words") if view["forces_words"] else ""
    joints = " Dark joints are actuated." if view["joints"] else ""
    if not view["rows"]:
        return join_markup(
            [
                "pose of the design. ",
                forces,
                " Dotted grey: starting point of the search." if view["reference"] else "",
                joints,
            ]
        )
    words = [
        "colours of limbs show the rate relative to the largest shown; blue negative, grey zero, orange positive.",
        " Bold black: axis of the task's motion",
        ", with a purple helix of its pitch" if view["motion"] and view["motion"]["path"] else "",
        ". Purple arrows: velocities of the platform's corners, not to scale.",
        " Dotted grey: starting point of the search." if view["reference"] else "",
        " Green, dashed: free motions with all actuators locked." if view["free"] else "",
        " Arrows with two heads: couples." if any(row["kind"] == "couple" for row in view["rows"]) else "",
        " No displacement: the loops of the robot would open along the task's motion."
        if view["motion"] and len(view["frames"]) == 1
        else "",
        joints,
        "" if is_still else f" Tooltips: {view['measure']['words']}, rate, share of F and wrench of a limb",
        " " if is_still else "; kind of a joint. " if view["joints"] else ". ",
        forces,
    ]
    return join_markup([bar, *words])


def _measure_header(view: ViewData) -> str:
    """Return the header of the limbs' quantity, with the unit if all rows have the same one."""
    words = "actuator from home" if view["joints"] else view["measure"]["words"]
    units = {unit for unit in view["measure"]["units"] if unit}
    return f"{words}, {units.pop()}" if len(units) == 1 else words


def _rates(view: ViewData, anchor: str | None = "rates") -> Markup:
    """Return the table of the rates at the shown posture; the script updates it as the platform moves.

    Args:
        view: view with its postures.
        anchor: identifier of the table; None for one of several tables, which the script does not update.
    """
    frame = view["frames"][view["zero"]]
    # If the task's motion is free, the rates are rounding errors.
    rates = [rate if abs(rate) > frame["noise"] else 0.0 for rate in frame["rates"]]
    largest = max(map(abs, rates), default=0.0) or 1.0
    total = sum(rate**2 for rate in rates)
    couples = any(row["kind"] == "couple" for row in view["rows"])
    headers = [
        "limb",
        *(["wrench"] if couples else []),
        _measure_header(view),
        f"{view['rate_word']}, {view['rate_unit']}",
        "",
        "share of F",
    ]
    lengths = aligned(["" if each is None else f"{each:.5g}" for each in frame["lengths"]])
    texts = aligned([f"{rate:+.6g}" for rate in rates])
    shares = aligned([f"{100 * rate**2 / total:.1f} %" if total > 0 else "none" for rate in rates])
    body = []
    for k, row in enumerate(view["rows"]):
        rate = rates[k]
        part = rate / largest
        bar = tag("span", tag("i"), class_="bar minus" if rate < 0 else "bar", style=f"--part:{abs(part):.4f}")
        cells = [lengths[k], texts[k], bar, shares[k]]
        kinds = ["length number", "rate number", "bars", "share number"]
        body.append(
            tag(
                "tr",
                tag("th", row["member"], scope="row"),
                tag("td", row["kind"]) if couples else None,
                *(tag("td", cell, class_=kind) for cell, kind in zip(cells, kinds, strict=True)),
            )
        )
    head = tag("tr", *(tag("th", header, scope="col") if header else tag("td") for header in headers))
    head_words = tag(
        "caption",
        "Limb rates: F = ",
        tag("span", f"{frame['F'] if total > 0 else 0:.7g} {view['objective_unit']}".rstrip(), id=anchor and "F-there"),
        ", platform ",
        tag("span", frame["words"], id=anchor and "where"),
    )
    table = tag("table", head_words, tag("thead", head), tag("tbody", *body), id=anchor)
    return tag("div", table, class_="scroll", tabindex="0", role="region", aria_label="Limb rates at the shown pose")

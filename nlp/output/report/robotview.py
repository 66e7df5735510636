"""The section of a report with the robot: the view with its controls, poses and legend, and the rates of every row."""

from __future__ import annotations

import re

from ..pictures.figures import picture
from ..pictures.style import RATE_COLOURS
from .frames import ViewData
from .markup import Markup, image_source, join_markup, paragraphs, script_frame, tag, view_buttons
from .report import Report

#: So many drawings stand in a page at most; the other views have their tables only.
_DRAWINGS = 12
#: Outlines of an SVG picture, and numbers in them with digits that nobody sees.
_OUTLINE, _DIGITS = re.compile(rb' d="[^"]*"'), re.compile(rb"(\.\d\d)\d+")


def _with_fewer_digits(content: bytes) -> bytes:
    """Return an SVG picture with two digits behind the points of its outlines, in units of 1/72 in."""
    return _OUTLINE.sub(lambda found: _DIGITS.sub(rb"\1", found[0].replace(b"\n", b" ")), content)


def pose_controls(views: list[ViewData], poses: int) -> Markup | None:
    """Return a slider over the poses with the worst of them named, or None for a single pose."""
    if poses == 1:
        return None
    first = views[0]
    worst = next((view for view in views if view["task"] == first["task"] and view["is_worst"]), None)
    words = f"{first['pose_words']}, the worst" if first["is_worst"] else first["pose_words"]
    slider = tag("input", type="range", id="pose", min=1, max=poses, step=1, value=first["pose"] + 1)
    shown = tag("output", words, id="posed", for_="pose")
    button = tag("button", "Show the worst", type="button", id="worst", disabled=first["is_worst"])
    controls = tag("p", tag("label", "Pose", for_="pose"), slider, shown, button, class_="controls travel script")
    if worst is None:
        return controls
    task = f" for “{first['name']}”" if any(view["task"] != first["task"] for view in views) else ""
    return join_markup([controls, tag("p", f"The worst{task}: {worst['pose_words']}.", id="worst-words")])


def drawings(report: Report) -> Markup:
    """Return drawings of the views as pictures, of which one is shown where the browser has no 3-D, or no script."""
    found = [
        (index, view, drawing)
        for index, (view, drawing) in enumerate(
            pair for part in report.parts for pair in zip(part.views, part.drawings, strict=True)
        )
    ]
    stills = []
    for index, view, drawing in found[:_DRAWINGS]:
        source = image_source(_with_fewer_digits(picture([drawing], ".svg")))
        words = f"The robot, {view['pose_words']}; the table below has its numbers."
        kind = "still" if index else "still chosen"
        stills.append(tag("img", src=source, alt=words, class_=kind, data_view=index))
    words = "This browser has no WebGL: the robot is drawn flat and does not move, but the numbers follow the sliders."
    return join_markup([tag("p", words, class_="flat-words", role="status"), *stills])


def robot_section(report: Report) -> Markup:
    """Return the 3-D view with its controls, its legend and the rates."""
    views = [view for part in report.parts for view in part.views]
    if not views:
        return paragraphs(["The robot does not exist at the point reached, so there is no picture of it."])
    first = views[0]
    head: list[Markup] = []
    if not report.is_answer:
        head.append(tag("p", "This is the point reached, and not an optimum.", class_="warning"))
    if len(report.parts) > 1:
        options = [tag("option", part.name, value=k) for k, part in enumerate(report.parts) if part.views]
        head.append(
            tag("p", tag("label", "Task: ", for_="task"), tag("select", *options, id="task"), class_="controls script")
        )
    controls = pose_controls(views, report.case.pose_count)
    if controls is not None:
        head.append(controls)
    last = len(first["frames"]) - 1
    moving = tag(
        "p",
        tag("label", "Move the platform along the task's motion", for_="travel"),
        tag("input", type="range", id="travel", min=0, max=last, step=1, value=first["zero"]),
        tag("output", first["frames"][first["zero"]]["words"], id="travelled", for_="travel"),
        class_="controls travel script",
    )
    picture = tag(
        "figure",
        script_frame("view", "picture", "The robot in three dimensions; the table below says the same in numbers."),
        drawings(report),
        view_buttons(),
        # A copy of the picture is for printing, because browsers do not print WebGL.
        tag("img", id="view-copy", class_="copy", alt="The robot in three dimensions, as in the table below"),
        tag("figcaption", _legend(first), id="view-words"),
    )
    content = [*head, moving, picture] if first["motion"] else [*head, picture]
    content += [tag("h3", "Rates at this position"), _rates(first)] if first["rows"] else []
    note = "Without a script nothing moves; every number is in the tables."
    return join_markup([*content, tag("noscript", tag("p", note))])


def _legend(view: ViewData) -> Markup:
    """Return what the colours and lines of the view mean."""
    gradient = f"background:linear-gradient(90deg,{','.join(RATE_COLOURS)})"
    bar = tag("span", class_="scale", style=gradient, aria_hidden="true")
    forces = tag("span", view["forces_words"], id="forces-words") if view["forces_words"] else ""
    joints = " Joints: dark where an actuator drives them." if view["joints"] else ""
    if not view["rows"]:
        return join_markup([forces, " Dotted grey: the start." if view["reference"] else "", joints])
    words = [
        "Limbs by their rate, scaled to the largest here: blue is negative, grey none, orange positive.",
        " Bold black: the axis of the task's motion",
        ", with a purple path of its pitch" if view["motion"] and view["motion"]["path"] else "",
        ". Purple arrows: velocities of the platform's corners, not to scale.",
        " Dotted grey: the start." if view["reference"] else "",
        " Green, dashed: motions that nothing resists." if view["free"] else "",
        " Arrows with two heads: couples." if any(row["kind"] == "couple" for row in view["rows"]) else "",
        " Nothing moves: the loops open along the task's motion."
        if view["motion"] and len(view["frames"]) == 1
        else "",
        joints,
        f" Point at a limb for its {view['measure']['words']}, rate, share of F and wrench",
        ", at a joint for its kind. " if view["joints"] else ". ",
        forces,
    ]
    return join_markup([bar, *words])


def _measure_header(view: ViewData) -> str:
    """Return the header of the measure of limbs, with its unit where all rows have one."""
    words = "actuator from home" if view["joints"] else view["measure"]["words"]
    units = {unit for unit in view["measure"]["units"] if unit}
    return f"{words}, {units.pop()}" if len(units) == 1 else words


def _rates(view: ViewData) -> Markup:
    """Return the rates of every row at the drawn posture; the script updates the table as the platform moves."""
    frame = view["frames"][view["zero"]]
    # Where nothing resists the task's motion, the rates are rounding error.
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
    body = []
    for k, row in enumerate(view["rows"]):
        rate = rates[k]
        part = rate / largest
        bar = tag("span", tag("i"), class_="bar minus" if rate < 0 else "bar", style=f"--part:{abs(part):.4f}")
        share = f"{100 * rate**2 / total:.1f} %" if total > 0 else "none"
        length = frame["lengths"][k]
        cells = ["" if length is None else f"{length:.5g}", f"{rate:+.6g}", bar, share]
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
    caption = tag(
        "caption",
        "F = ",
        tag("span", f"{frame['F'] if total > 0 else 0:.7g} {view['objective_unit']}".rstrip(), id="F-there"),
        " with the platform ",
        tag("span", frame["words"], id="where"),
    )
    table = tag("table", caption, tag("thead", head), tag("tbody", *body), id="rates")
    return tag("div", table, class_="scroll", tabindex="0", role="region", aria_label="Rates at this position")

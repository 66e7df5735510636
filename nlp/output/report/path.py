"""Page about the verification of a tool path: verdicts, violations, the robot along the path, curves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...case.pose import RotationForm
from ...results.path import PathVerdictData
from ...system.jsonvalues import json_data
from ...words.path import checked_claims, fault_words, first_refuted, path_summary, verdict_words
from ...words.poses import pose_words
from ..pictures.pathpanels import (
    ACTUATOR_COLOURS,
    LIMIT_COLOURS,
    PathPanel,
    PathPicture,
    actuator_names,
    marks_text,
    nearest_parts,
)
from .charts import Band, Curve, Strip, line_chart, strip_chart
from .markup import (
    NO_LIVE_VIEW,
    LiveView,
    Markup,
    answer_box,
    beside,
    caption,
    contents_and_body,
    join_markup,
    packed_plotly,
    paragraphs,
    script_frame,
    tag,
    view_buttons,
    whole_page,
)
from .pathview import MOST_MARGIN, PathView, path_view, thinned
from .stills import narrow_image, still_element
from .verdicts import dimensions_table, origin, refuting_place, shown_verdicts

#: Largest number of points of a curve.
_POINTS = 600


def path_page(
    picture: PathPicture, text: str, command: Callable[[PathVerdictData], str], live: LiveView = NO_LIVE_VIEW
) -> str:
    """Return the page, which opens without a network; verdicts and curves need no script.

    Args:
        picture: path with its verdicts and curves.
        text: text of the case file.
        command: function that returns the command that shows a violated claim.
        live: live view along the path, which replaces the 3-D view.
    """
    case, result = picture.judged.case, picture.result
    title = case.title or case.name
    view = path_view(picture)
    verdicts = [
        ("verdicts", "Verdicts along the path", _verdicts(picture)),
        ("refuted", "Violated limits and singularities", _refuted(picture, command)),
    ]
    # One section, in which the slider stays visible.
    shown = join_markup([_robot(picture, view, is_live=live.is_live), _curves(picture)])
    robot = [("robot", "Robot along the path", shown)]
    # Without a live view, the robot comes first.
    sections = [*verdicts, *robot] if live.is_live else [*robot, *verdicts]
    sections.append(("origin", "Case file and versions", origin(result.versions, text)))
    contents, body = contents_and_body(sections)
    words = verdict_words(result)
    answers = [f"{words[0].upper()}{words[1:]}."]
    first = first_refuted(result)
    if first is not None and first.fault is not None:
        answers.append(f"First violation: {fault_words(first, first.fault)}.")
    return whole_page(
        f"{title} - {picture.judged.path.source}",
        f"Tool path: {case.name}, robot {case.model.name}, along {picture.judged.path.source}",
        answer_box(answers, is_answer=result.proved),
        body,
        heading=title,
        contents=contents,
        styles=("workspace.css", "path.css"),
        scripts=() if view is None or live.is_live else ("tools.js", "joints.js", "robot.js", "path.js"),
        data={"result": json_data(result), "view": None if view is None or live.is_live else view.data},
        plotly="" if view is None or live.is_live else packed_plotly(),
        live=_first_screen(picture, view, live),
    )


def _first_screen(picture: PathPicture, view: PathView | None, live: LiveView) -> Markup:
    """Return the live view with its slider, and the robot with its dimensions until the script has started."""
    if view is None or not live.is_live:
        return live.markup
    words = view.data["frames"][view.data["first"]]["words"]
    image = narrow_image(view.drawing, alt=f"Robot: {words}", class_="design")
    figure = tag("figure", image, caption("Robot", f"{words}."))
    table = dimensions_table(picture.judged.case)
    return join_markup([_controls(view), live.shown(beside(figure, table))])


def _verdicts(picture: PathPicture) -> Markup:
    """Return the lines and tables of the terminal, without the title."""
    words = (
        "A proved claim holds at every point of every segment, not only at samples. No point exceeds a proved bound. "
        "The reached value occurs at the line and the pose of its row."
    )
    return shown_verdicts(path_summary(picture.judged.case, picture.result), "path", words)


def _controls(view: PathView) -> Markup:
    """Return the slider over the path, with its button."""
    data, last = view.data, len(view.data["frames"]) - 1
    words = data["frames"][data["first"]]["words"]
    return tag(
        "p",
        tag("button", "Play", type="button", id="play"),
        tag("label", "Position along the path", for_="travel"),
        tag("input", type="range", id="travel", min=0, max=last, step=1, value=data["first"], aria_valuetext=words),
        tag("output", words, id="travelled", for_="travel"),
        class_="controls travel along script",
    )


def _robot(picture: PathPicture, view: PathView | None, *, is_live: bool) -> Markup:
    """Return the 3-D view with its slider and legend; with a live view, a drawing and the legend."""
    if view is None:
        return paragraphs(["No view: the joint coordinates are not known at any point of the path."])
    data = view.data
    words = data["frames"][data["first"]]["words"]
    options = [tag("option", "nearest limit", value="nearest"), tag("option", "margin", value="margin")]
    colour = (
        tag("label", "Colour of the path: ", for_="path-colour" if is_live else "colour"),
        tag("select", *options, id="path-colour" if is_live else "colour"),
    )
    coloured = [tag("p", *colour, class_="controls script")] if data["limits"] else []
    if is_live:
        image = narrow_image(view.drawing, alt=f"Robot, {words}.", class_="design printed")
        return join_markup([*coloured, tag("figure", image, _legend(picture, data["marks"] != []))])
    flat = "No WebGL in this browser: the drawing of the robot is fixed, but the curves follow the slider."
    figure = tag(
        "figure",
        tag("p", flat, class_="flat-words", role="status"),
        tag(
            "div",
            script_frame("view", "picture", "3-D view of the robot and of the path of its platform's origin."),
            still_element(view.drawing, alt=f"Robot, {words}.", class_="still chosen"),
            class_="stage",
        ),
        view_buttons(),
        tag("img", id="view-copy", class_="copy", alt="3-D view of the robot"),
        _legend(picture, data["marks"] != [], id="view-words"),
    )
    note = "The view needs JavaScript; all curves and tables are complete without it."
    shown = beside(figure, dimensions_table(picture.judged.case))
    return join_markup([_controls(view), *coloured, shown, tag("noscript", tag("p", note))])


def _legend(picture: PathPicture, has_marks: bool, **attributes: object) -> Markup:
    """Return the caption of the view, with the colours of the path; the attributes are those of the element."""
    entries = [tag("li", _swatch(f"l{k % len(LIMIT_COLOURS)}"), words) for k, words in picture.limits]
    if (picture.margins < 0).any():
        entries.append(tag("li", _swatch("limit"), "limit violated"))
    parts = []
    if entries:
        parts.append(tag("p", "Path of the platform's origin, coloured by the nearest limit:", class_="by-limit"))
        parts.append(tag("ul", *entries, class_="legend by-limit"))
        words = f" 0 % (red) to {MOST_MARGIN} % and more (blue)."
        bar = tag("span", class_="scale margins", aria_hidden="true")
        parts.append(
            tag("p", "Path of the platform's origin, coloured by the smallest margin:", words, bar, class_="by-margin")
        )
    words = "Red diamonds: first violation of each limit or rank." if has_marks else ""
    dark = " Dark joints are actuated." if picture.judged.case.model.scene.joints else ""
    parts.append(tag("p", f"{words}{dark}".strip()))
    return caption("Robot along the path", *parts, **attributes)


def _curves(picture: PathPicture) -> Markup:
    """Return charts of all quantities along the path, with a cursor at the shown posture."""
    names = actuator_names(picture)
    entries = [
        tag("li", _swatch(f"a{place % len(ACTUATOR_COLOURS)}"), f"actuator {name}") for place, name in names.items()
    ]
    if any(each.is_other for panel in picture.panels for each in panel.curves):
        entries.append(tag("li", "dashed: smaller of two values"))
    if any(panel.limits for panel in picture.panels) or picture.margins.size:
        entries.append(tag("li", _swatch("limit"), "limit"))
    if picture.marks:
        entries.append(tag("li", f"dotted: first violations, {marks_text(picture.marks)}"))
    shown = thinned(picture, _POINTS, np.arange(len(picture.at)))
    charts = [_panel(picture, each, shown) for each in picture.panels]
    if picture.margins.size:
        charts.append(_margins(picture, shown))
    return join_markup(
        [
            tag("h3", "Curves along the path"),
            paragraphs(picture.notes),
            tag("ul", *entries, class_="legend"),
            tag("div", *charts, class_="charts along"),
        ]
    )


def _panel(picture: PathPicture, panel: PathPanel, shown: list[int]) -> Markup:
    """Return the chart of a panel."""
    at = picture.at[shown].tolist()
    count = len(ACTUATOR_COLOURS)
    names, strips = actuator_names(picture), dict[int, list[Curve]]()
    names = {each.place: "" for each in panel.curves} if panel.is_setting else names
    for each in panel.curves:
        colour = "" if panel.is_setting else f" a{each.place % count}"
        kind = f"curve{colour}{' other' * each.is_other}"
        strips.setdefault(each.place, []).append(Curve(at, each.values[shown].tolist(), kind))
    every = np.concatenate([each.values[np.isfinite(each.values)] for each in panel.curves])
    ends = f"{every.min():.5g} to {every.max():.5g} {panel.unit}".rstrip() if every.size else "no known value"
    named = [Strip(f"actuator {names[place]}".strip(), curves) for place, curves in strips.items()]
    return _chart(picture, named, (panel.title, ends), panel.unit, panel.limits)


def _margins(picture: PathPicture, shown: list[int]) -> Markup:
    """Return the chart of the smallest margin."""
    at, nearest = picture.at[shown].tolist(), picture.samples.nearest[shown]
    curves = [
        Curve(at, nearest_parts(nearest, k, picture.drawn_margins[shown]).tolist(), f"curve l{k % len(LIMIT_COLOURS)}")
        for k, _ in picture.limits
    ]
    known = picture.margins[np.isfinite(picture.margins)]
    words = f"at least {known.min():.3g} %" if known.size else "no known margin"
    return _chart(
        picture,
        [Strip("", curves or [Curve(at, picture.drawn_margins[shown].tolist(), "curve")])],
        ("smallest margin of all limits", words),
        "margin, %",
        (0.0,),
    )


def _chart(
    picture: PathPicture, strips: list[Strip], named: tuple[str, str], label: str, limits: tuple[float, ...]
) -> Markup:
    """Return a chart over the position along the path, with violations and segments that are not proved.

    Args:
        picture: path with its verdicts and curves.
        strips: strips of the chart, at least one.
        named: name and content of the chart, for its caption.
        label: label of the vertical axis.
        limits: limits of the case, in the unit of the chart.
    """
    name, content = named
    words = f"{name[0].upper()}{name[1:]}: {content}."
    labels, bounds = (picture.label, label), [each.at for each in picture.marks]
    bands = [Band(each.start, each.end, "refuted" if each.is_refuted else "open") for each in picture.bands]
    ends = (float(picture.way.knots[0]), float(picture.way.knots[-1]))
    if len(strips) == 1:
        curves = strips[0].curves
        chart = line_chart(
            curves,
            [],
            words=words,
            labels=labels,
            bounds=bounds,
            levels=limits,
            bands=bands,
            ends=ends,
            has_cursor=True,
        )
    else:
        chart = strip_chart(strips, words=words, labels=labels, bounds=bounds, levels=limits, bands=bands, ends=ends)
    return tag("figure", caption(name, f"{content}."), chart)


def _swatch(kind: str) -> Markup:
    """Return a colour sample for a legend, of the colour that charts of the page have for a kind of curve."""
    return tag("span", class_=f"swatch {kind}")


def _refuted(picture: PathPicture, command: Callable[[PathVerdictData], str]) -> Markup:
    """Return each violated claim with its first known violation and a command for the pose."""
    case = picture.judged.case
    refuted = [(each, each.fault) for each in checked_claims(picture.result)]
    return join_markup(
        refuting_place(fault_words(each, fault), pose_words(case, fault.pose, RotationForm.RPY), command(each))
        for each, fault in refuted
        if fault is not None
    )

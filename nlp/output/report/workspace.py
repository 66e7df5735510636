"""A page about a judged workspace: verdicts, numbers with their poses, the robot at the worst pose, slices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...case.case import Case
from ...errors import EvaluationError
from ...evidence.state import WorkspacePose
from ...proof.workspace.slices.slices import Slice
from ...results.claims import refuted_claims, worst_claim
from ...results.workspace import WorkspaceResult
from ...system.jsonvalues import json_data
from ...words.claims import claim_words
from ...words.numbers import number
from ...words.poses import pose_words
from ...words.text import TextTable
from ...words.verdicts import machine_lines
from ...words.workspace import verdict_words, workspace_summary
from ..pictures.figures import picture
from ..pictures.workspaces import Kind, drawing_at, slice_images, slices_legend, slices_notes
from .markup import (
    Markup,
    answer_box,
    contents_and_body,
    html_table,
    image_source,
    join_markup,
    paragraphs,
    tag,
    whole_page,
)
from .verdicts import origin, refuting_place, shown_command, shown_verdicts


@dataclass(frozen=True, eq=False)
class WorkspaceReport:
    """Content of a page about a workspace.

    Attributes:
        case: the case, with fixed dimensions.
        text: of the case file.
        result: the verdicts.
        slices: of the workspace; empty for a robot that has none.
        command: returns the command that shows a pose.
    """

    case: Case
    text: str
    result: WorkspaceResult
    slices: Sequence[Slice]
    command: Callable[[WorkspacePose], str]


def workspace_page(report: WorkspaceReport) -> str:
    """Return the whole page, which opens without a network and needs no script for its content."""
    case, result = report.case, report.result
    title = case.title or case.name
    sections = [
        ("robot", "The machine", join_markup([_robot(report), _dimensions(report)])),
        ("verdicts", "Verdicts", _verdicts(report)),
        ("slices", "Slices of the workspace", _slices(report)),
        ("refuted", "Poses that refute a claim", _refuted(report)),
        ("origin", "Case text and versions", origin(result.versions, report.text)),
    ]
    contents, body = contents_and_body(sections)
    words = verdict_words(result)
    return whole_page(
        f"{title} - workspace",
        f"{case.name}, robot {case.model.name}: the whole workspace",
        answer_box([f"{words[0].upper()}{words[1:]}."], is_answer=result.proved),
        body,
        heading=title,
        contents=contents,
        styles=("workspace.css",),
        data={"result": json_data(result)},
    )


def _verdicts(report: WorkspaceReport) -> Markup:
    """Return the lines and tables that the terminal shows, without the title."""
    words = (
        "Each proved claim holds at every pose of the workspace, and not only at samples. A proven bound is not passed "
        "by any pose; the value reached is met at the pose named beside it."
    )
    return shown_verdicts(workspace_summary(report.case, report.result), "workspace", words)


def _refuted(report: WorkspaceReport) -> Markup:
    """Return each refuted claim with its pose and the command that shows it; empty without one."""
    return join_markup(
        refuting_place(claim_words(claim), pose_words(report.case, claim.pose), report.command(claim.pose))
        for claim in refuted_claims(report.result)
    )


def _dimensions(report: WorkspaceReport) -> Markup:
    """Return the dimensions of the machine, and the tolerance of its joint centres."""
    case = report.case
    rows = []
    for item in case.model.parameters:
        shown = report.result.parameters[item.name]
        values = shown if isinstance(shown, tuple) else (shown,)
        largest, unit = max(map(abs, values)), case.units.label(item.dimension)
        names = case.component_names(item)
        rows += [(name, number(value, largest), unit) for name, value in zip(names, values, strict=True)]
    table = html_table(TextTable(("", "value", "unit"), tuple(rows), "dimensions"), "Its dimensions", id="dimensions")
    return join_markup([table, paragraphs(machine_lines(case, report.result.joint_centre))])


def _robot(report: WorkspaceReport) -> Markup:
    """Return a picture of the robot at the worst pose; a sentence where there is none."""
    worst = worst_claim(report.result, report.case.tasks[0].sense)
    if worst is None:
        return Markup("")
    try:
        content = picture([drawing_at(report.case, worst)], ".svg")
    except EvaluationError as error:
        return tag("p", f"No picture: {error}.")
    at = pose_words(report.case, worst.pose)
    image = tag("img", src=image_source(content), alt=f"The robot at {at}: {claim_words(worst)}", class_="posed")
    figure = tag("figure", image, tag("figcaption", f"The machine at its worst pose, {at}: {claim_words(worst)}."))
    return join_markup([figure, shown_command(report.command(worst.pose))])


def _slices(report: WorkspaceReport) -> Markup:
    """Return the slices with their legend; empty for a robot without slices."""
    slices = report.slices
    if not slices:
        return Markup("")
    words = (
        "Two coordinates vary in each slice, three times as wide as the workspace; the others stay at its middle. "
        "The colour of a box is proved for all of its poses."
    )
    if report.case.joint_centre_tolerance:
        words += " The slices are those of the design itself, without its tolerance."
    legend = [tag("li", _swatch(kind), kind.words) for kind in slices_legend(report.case, slices)]
    legend.append(tag("li", tag("span", class_="swatch outline"), "workspace"))
    notes = [f"{note[0].upper()}{note[1:]}." for note in slices_notes(slices)]
    images = [
        tag("img", src=image_source(content, "png"), alt=f"Slice of {each.names[0]} and {each.names[1]}")
        for each, content in zip(slices, slice_images(report.case, slices), strict=True)
    ]
    return join_markup(
        [
            paragraphs([words]),
            tag("ul", *legend, class_="legend"),
            paragraphs(notes),
            tag("div", *images, class_="slices"),
        ]
    )


def _swatch(kind: Kind) -> Markup:
    """Return a small box of a kind's colour."""
    return tag("span", class_="swatch hatched" if kind.hatch else "swatch", style=f"--fill: {kind.colour}")

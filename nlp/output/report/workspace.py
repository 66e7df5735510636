"""A page about a judged workspace: verdicts, numbers with their poses, the robot at the worst pose, slices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...case.case import Case
from ...errors import EvaluationError
from ...proof.workspace.slices.slices import Slice
from ...results.jsondata import json_data
from ...results.tables import origin_table
from ...results.text import Line
from ...results.workspace import WorkspacePose, WorkspaceResult
from ...results.workspaceposes import PosedClaim, refuted_claims, worst_claim
from ...results.workspacewording import pose_words, verdict_words, workspace_summary
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
        ("verdicts", "Verdicts", _verdicts(report)),
        ("robot", "The robot at its worst pose", _robot(report)),
        ("slices", "Slices of the workspace", _slices(report)),
        ("refuted", "Poses that refute a claim", _refuted(report)),
        ("origin", "Case text and versions", _origin(report)),
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
    _, *items = workspace_summary(report.case, report.result)
    parts = [
        paragraphs([each]) if isinstance(each, Line) else html_table(each, each.title, id=f"workspace-{each.name}")
        for each in items
    ]
    words = (
        "Each proved claim holds at every pose of the workspace, and not only at samples. A proven bound is not passed "
        "by any pose; the value reached is met at the pose named beside it."
    )
    return join_markup([*parts, tag("p", words)])


def _refuted(report: WorkspaceReport) -> Markup:
    """Return each refuted claim with its pose and the command that shows it; empty without one."""
    return join_markup(
        part
        for claim in refuted_claims(report.result)
        for part in (
            tag("h3", claim.words),
            tag("p", f"At {pose_words(report.case, claim.pose)}."),
            _see(report, claim),
        )
    )


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
    image = tag("img", src=image_source(content), alt=f"The robot at {at}: {worst.words}", class_="posed")
    return join_markup([tag("figure", image, tag("figcaption", f"{worst.words}, at {at}.")), _see(report, worst)])


def _see(report: WorkspaceReport, claim: PosedClaim) -> Markup:
    """Return the command that shows a claim's pose."""
    return tag("pre", tag("code", report.command(claim.pose)), tabindex="0", aria_label="Command", class_="command")


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


def _origin(report: WorkspaceReport) -> Markup:
    """Return versions, and the text of the case."""
    table = html_table(origin_table(report.result.versions), "What the numbers depend on", id="versions")
    text = tag("pre", tag("code", report.text, id="case-text"), tabindex="0", aria_label="Case text")
    return join_markup([table, tag("h3", "Case file"), text])

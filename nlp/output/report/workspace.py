"""Page about the verification of a workspace: verdicts, violations, the robot at the worst pose, slices."""

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
from ...words.poses import pose_words
from ...words.verdicts import tolerance_lines
from ...words.workspace import verdict_words, workspace_summary
from ..pictures.workspaces import Kind, drawing_at, slice_images, slices_legend, slices_notes
from .markup import (
    Markup,
    answer_box,
    beside,
    caption,
    contents_and_body,
    image_source,
    join_markup,
    paragraphs,
    tag,
    whole_page,
)
from .stills import still_element
from .verdicts import dimensions_table, in_words, origin, refuting_place, shown_command, shown_verdicts


@dataclass(frozen=True, eq=False)
class WorkspaceReport:
    """Content of a page about a workspace.

    Attributes:
        case: case with fixed dimensions.
        text: text of the case file.
        result: verdicts over the workspace.
        slices: slices of the workspace; empty for a robot without slices.
        command: function that returns the command for a pose.
    """

    case: Case
    text: str
    result: WorkspaceResult
    slices: Sequence[Slice]
    command: Callable[[WorkspacePose], str]


def workspace_page(report: WorkspaceReport) -> str:
    """Return the page, which opens without a network and needs no script for its content."""
    case, result = report.case, report.result
    title = case.title or case.name
    sections = [
        ("robot", "Robot at the worst pose", beside(_robot(report), _dimensions(report))),
        ("verdicts", "Verdicts over the workspace", _verdicts(report)),
        ("refuted", "Violated limits and singularities", _refuted(report)),
        ("slices", "Slices of the workspace", _slices(report)),
        ("origin", "Case file and versions", origin(result.versions, report.text)),
    ]
    contents, body = contents_and_body(sections)
    words = verdict_words(result)
    return whole_page(
        f"{title} - workspace",
        f"Workspace: {case.name}, robot {case.model.name}",
        answer_box([f"{words[0].upper()}{words[1:]}."], is_answer=result.proved),
        body,
        heading=title,
        contents=contents,
        styles=("workspace.css",),
        data={"result": json_data(result)},
    )


def _verdicts(report: WorkspaceReport) -> Markup:
    """Return the lines and tables of the terminal, without the title."""
    words = (
        "A proved claim holds at every pose of the workspace, not only at samples. No pose exceeds a proved bound. "
        "The reached value occurs at the pose of its row."
    )
    return shown_verdicts(workspace_summary(report.case, report.result), "workspace", words)


def _refuted(report: WorkspaceReport) -> Markup:
    """Return each violated claim with its pose and a command for the pose."""
    return join_markup(
        refuting_place(claim_words(claim), pose_words(report.case, claim.pose), report.command(claim.pose))
        for claim in refuted_claims(report.result)
    )


def _dimensions(report: WorkspaceReport) -> Markup:
    """Return the dimensions of the robot, and the tolerance of its joint centres."""
    case = report.case
    table = dimensions_table(case)
    return tag("div", table, paragraphs(tolerance_lines(case, report.result.joint_centre)))


def _robot(report: WorkspaceReport) -> Markup:
    """Return a picture of the robot at the worst pose, or a sentence with the reason for the missing picture."""
    worst = worst_claim(report.result, report.case.tasks[0].sense)
    if worst is None:
        return Markup("")
    try:
        drawing = drawing_at(report.case, worst)
    except EvaluationError as error:
        return tag("p", f"No picture: {error}.")
    at = pose_words(report.case, worst.pose)
    image = still_element(drawing, alt=f"Robot at {at}: {in_words(claim_words(worst))}", class_="posed")
    words = caption("Robot at the worst pose", f"{in_words(claim_words(worst))}; at {at}.")
    return tag("figure", image, words, shown_command(report.command(worst.pose)))


def _slices(report: WorkspaceReport) -> Markup:
    """Return the slices with their legend; empty for a robot without slices."""
    slices = report.slices
    if not slices:
        return Markup("")
    words = (
        "Each slice varies two coordinates over three times the width of the workspace; the others stay at its centre. "
        "The colour of a box is proved for all its poses."
    )
    if report.case.joint_centre_tolerance:
        words += " The slices are for the nominal robot, without the tolerance."
    legend = [tag("li", _swatch(kind), kind.words) for kind in slices_legend(report.case, slices)]
    legend.append(tag("li", tag("span", class_="swatch outline"), "workspace"))
    notes = [f"{note[0].upper()}{note[1:]}." for note in slices_notes(slices)]
    images = [
        tag("figure", tag("img", src=image_source(content, "png"), alt=f"Slice: {words}"), caption("Slice", words))
        for each, content in zip(slices, slice_images(report.case, slices), strict=True)
        for words in [f"{each.names[0]} and {each.names[1]}"]
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
    """Return a colour sample for the legend."""
    return tag("span", class_="swatch hatched" if kind.hatch else "swatch", style=f"--fill: {kind.colour}")

"""The command ``workspace``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    CaseName,
    CsvFile,
    Jobs,
    JsonFile,
    LegError,
    Outputs,
    ResultFile,
    SettingTexts,
    Time,
    console,
    number_option,
    read_settings,
    write_csv,
    write_json,
)
from .progress import spinner

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..case.case import Case
    from ..proof.workspace.judge import Judgement
    from ..proof.workspace.paper_record import PaperRecord
    from ..proof.workspace.slices.slices import Slice
    from ..results.workspace import WorkspacePose, WorkspaceResult


def workspace(
    case: CaseName,
    settings: SettingTexts = None,
    of: ResultFile = None,
    of_quantity: Annotated[
        list[str] | None, typer.Option("--of-quantity", metavar="NAME", help="Bound this measure of the robot too.")
    ] = None,
    gap: Annotated[float, number_option("--gap", "PART", "Largest relative gap of a bound.")] = 1e-3,
    time: Time = None,
    leg_error: LegError = 0.0,
    scale: Annotated[bool, typer.Option("--scale", help="Find the largest box that is proved, to 1 %.")] = False,
    proof: Annotated[str | None, typer.Option(metavar="FILE", help="Write the proof, for verify-proof.")] = None,
    jobs: Jobs = None,
    json_file: JsonFile = None,
    csv_file: CsvFile = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Draw slices of the workspace: a .png, .svg or .pdf file."),
    ] = None,
    picture: Annotated[
        str | None,
        typer.Option("--picture", metavar="FILE", help="Draw the robot at its worst pose: a .png, .svg or .pdf file."),
    ] = None,
    page: Annotated[
        str | None, typer.Option("--html", metavar="FILE", help="Write a page: verdicts, poses, slices; - is stdout.")
    ] = None,
) -> None:
    """Prove regular poses and limits over a whole workspace."""
    from ..errors import InputError
    from ..interruption import Milestone, answer_after
    from ..proof.statement.machine import workspace_of_case
    from ..results.workspace import scale_data, workspace_of
    from ..results.workspaceposes import evaluate_command
    from .paper import paper_record, read_machine, write_paper

    if not 1e-9 <= gap < 1:
        raise InputError(f"--gap {gap:g}: must be at least 1e-9 and below 1")
    record = paper_record(proof, json_file)
    answer_after(Milestone.BOUND)
    (loaded, text, inputs), chosen = read_machine(case, read_settings(settings), of)
    workspace_of_case(loaded)
    files = Outputs(json=json_file, csv=csv_file, plot=plot, picture=picture, html=page, proof=proof)
    files.check(inputs)
    slices = _slices(loaded, files)
    judged = _judge_with_progress(loaded, list(of_quantity or ()), gap, time, leg_error, jobs, record)
    largest = None
    if scale:
        from ..proof.workspace.scale import largest_scale

        largest = scale_data(largest_scale(loaded, time_limit=time, jobs=jobs), loaded.units)
    result = workspace_of(judged, largest)

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose."""
        return evaluate_command(case, chosen, pose, loaded.pose_prefixes[0])

    write_json(json_file, result)
    if csv_file is not None:
        from ..results.text import TextTable
        from ..results.workspacewording import workspace_summary

        write_csv(csv_file, [each for each in workspace_summary(loaded, result) if isinstance(each, TextTable)], None)
    if plot is not None:
        from ..output.pictures.workspaces import slices_figure

        files.draw("plot", slices_figure, loaded, slices)
    if picture is not None:
        files.draw("picture", _worst, loaded, result, picture)
    if page is not None:
        from ..output.files import write_text
        from ..output.report.workspace import WorkspaceReport, workspace_page

        write_text(page, workspace_page(WorkspaceReport(loaded, text, result, slices, command)))
    if proof is not None:
        write_paper(proof, judged, record, text, of_quantity or (), leg_error)
    if not files.is_piped:
        from ..output.terminal import show
        from ..results.workspacewording import workspace_summary

        show(console(), workspace_summary(loaded, result, command))
    raise typer.Exit(0 if result.proved else 1)


def _judge_with_progress(
    case: Case,
    quantities: list[str],
    gap: float,
    time: float | None,
    leg_error: float,
    jobs: int | None,
    paper: PaperRecord | None,
) -> Judgement:
    """Judge a machine with a line of progress on standard error, where standard error is a terminal."""
    from ..proof.workspace.judge import TIME_LIMIT, judge_workspace

    with spinner("formulating") as show:
        return judge_workspace(
            case,
            quantities=quantities,
            gap=gap,
            time_limit=TIME_LIMIT if time is None else time,
            leg_error=leg_error,
            jobs=jobs,
            rank_progress=lambda seconds, boxes, left: show(
                f"regular poses: {boxes:,} boxes, {left:,} left, {seconds:.0f} s"
            ),
            progress=lambda name, done, total: show(f"{name}: {done} of {total} numbers done"),
            paper=paper,
        )


def _slices(case: Case, files: Outputs) -> tuple[Slice, ...]:
    """Return the slices that the files show; a page has none of a robot without slices.

    Raises:
        CaseError: a picture of slices is asked for, of a robot that has none.
    """
    from ..errors import CaseError
    from ..proof.workspace.slices.slices import slices_of

    if files["plot"] is None and files["html"] is None:
        return ()
    try:
        return slices_of(case)
    except CaseError:
        if files["plot"] is not None:
            raise
        return ()


def _worst(case: Case, result: WorkspaceResult, target: str) -> Figure:
    """Return a picture of the robot at its worst pose.

    Raises:
        InputError: no pose is known.
    """
    from ..errors import InputError
    from ..output.pictures.figures import figure_of
    from ..output.pictures.workspaces import drawing_at
    from ..results.workspaceposes import worst_claim

    worst = worst_claim(result, case.tasks[0].sense)
    if worst is None:
        raise InputError(f"--picture {target}: no pose of the workspace is known at which a number is reached")
    return figure_of([drawing_at(case, worst)])

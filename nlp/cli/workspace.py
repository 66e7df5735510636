"""The command ``workspace``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .numbers import Number
from .options import CaseName, Jobs, JsonFile, LegError, ResultFile, SettingTexts, Time, console, read_settings
from .workspacefiles import WorkspaceFiles

if TYPE_CHECKING:
    from ..case.case import Case
    from ..proof.workspace.judge import Judgement
    from ..proof.workspace.proof_writer import PaperRecord
    from ..results.workspace import WorkspacePose


def workspace(
    case: CaseName,
    settings: SettingTexts = None,
    of: ResultFile = None,
    of_quantity: Annotated[
        list[str] | None, typer.Option("--of-quantity", metavar="NAME", help="Bound this measure of the robot too.")
    ] = None,
    gap: Annotated[
        float,
        typer.Option(parser=Number("--gap"), metavar="PART", help="Part of a value that its bound may be off by."),
    ] = 1e-3,
    time: Time = None,
    leg_error: LegError = 0.0,
    scale: Annotated[bool, typer.Option("--scale", help="Find the largest box that is proved, to 1 %.")] = False,
    proof: Annotated[str | None, typer.Option(metavar="FILE", help="Write the proof, for verify-proof.")] = None,
    jobs: Jobs = None,
    json_file: JsonFile = None,
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
    from ..results.workspace import workspace_of
    from ..results.workspaceposes import evaluate_command
    from .dimensions import read_machine
    from .paper import paper_record, write_paper

    if not 1e-9 <= gap < 1:
        raise InputError(f"--gap {gap:g}: must be at least 1e-9 and below 1")
    record = paper_record(proof, json_file)
    answer_after(Milestone.BOUND)
    (loaded, text, inputs), chosen = read_machine(case, read_settings(settings), of)
    workspace_of_case(loaded)
    files = WorkspaceFiles(json_file, plot, picture, page, proof)
    files.check(inputs)
    slices = files.slices(loaded)
    judged = _judge_with_progress(loaded, list(of_quantity or ()), gap, time, leg_error, jobs, record)
    largest = None
    if scale:
        from ..proof.workspace.scale import largest_scale
        from ..results.workspacescale import scale_data

        largest = scale_data(largest_scale(loaded, time_limit=time, jobs=jobs), loaded.units)
    result = workspace_of(judged, largest)

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose."""
        return evaluate_command(case, chosen, pose, loaded.pose_prefixes[0])

    files.write(loaded, text, result, slices, command)
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
    import sys

    from ..proof.workspace.judge import TIME_LIMIT, judge_workspace

    time = TIME_LIMIT if time is None else time

    if not sys.stderr.isatty():
        return judge_workspace(
            case, quantities=quantities, gap=gap, time_limit=time, leg_error=leg_error, jobs=jobs, paper=paper
        )
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TextColumn

    from ..errors import one_line

    columns = SpinnerColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("formulating", total=None)

        def show_boxes(seconds: float, boxes: int, left: int) -> None:
            bar.update(line, description=f"regular poses: {boxes:,} boxes, {left:,} left, {seconds:.0f} s")

        def show_number(name: str, done: int, total: int) -> None:
            bar.update(line, description=f"{escape(one_line(name))}: {done} of {total} numbers done")

        return judge_workspace(
            case,
            quantities=quantities,
            gap=gap,
            time_limit=time,
            leg_error=leg_error,
            jobs=jobs,
            rank_progress=show_boxes,
            progress=show_number,
            paper=paper,
        )

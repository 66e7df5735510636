"""Command ``workspace``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NoReturn

from . import contents, options
from .progress import spinner, tell_workspace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from matplotlib.figure import Figure

    from ..case.case import Case
    from ..case.overrides import Settings
    from ..evidence.state import WorkspacePose
    from ..proof.workspace.judgement import Judgement
    from ..proof.workspace.proof_record import ProofRecord
    from ..proof.workspace.slices.slices import Slice
    from ..results.workspace import WorkspaceResult
    from ..words.text import Line, TextTable

#: Seconds for the table of free travel.
_TRAVEL_TIME = 30.0


def workspace(
    case: options.CaseName,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    quantities: Annotated[
        list[str] | None, options.several("--quantity", "NAME", "Also bound this quantity of the robot")
    ] = None,
    gap: options.RangeGap = 1e-3,
    time: Annotated[float | None, options.time("60 for the proofs if left out")] = None,
    leg_error: options.LegError = 0.0,
    scale: Annotated[
        bool, options.flag("--scale", "Find the largest proved box, to 1 %, or radius, to 0.05 %")
    ] = False,
    proof: options.ProofFile = None,
    jobs: options.Jobs = None,
    json_file: options.JsonFile = None,
    csv_file: options.CsvFile = None,
    plot: Annotated[str | None, options.plot("Draw slices of the workspace")] = None,
    plot_pose: Annotated[str | None, options.plot("Draw the robot at its worst pose", "--plot-pose")] = None,
    html: Annotated[str | None, options.page(": verdicts, poses, slices")] = None,
    whole: options.ShowAll = False,
) -> None:
    """Prove no singularity and no violated limit over a workspace.

    The case states the box of poses under [workspace]. Quantities without a limit are bounded for information.
    """
    from ..interruption import Milestone, answer_after, seconds_left, within
    from ..proof.statement.fixed_robot import workspace_of_case
    from ..results.workspace import scale_data, workspace_of
    from ..words.poses import evaluate_command
    from .proofs import proof_record, proof_text

    record = proof_record(proof, json_file)
    answer_after(Milestone.BOUND)
    (loaded, text, inputs), chosen = options.read_changed_case(case, settings, of)
    if loaded.has_any_settings:
        unsupported = {
            "--scale": scale,
            "--quantity": quantities,
            "--leg-error": leg_error,
            "--plot": plot,
            "--plot-pose": plot_pose,
            "--html": html,
        }
        _refuse(unsupported)
        files = options.Outputs(json=json_file, csv=csv_file, proof=proof)
        files.check(inputs)
        _existence(case, loaded, text, chosen, time, files, whole=whole)
    workspace_of_case(loaded)
    tell_workspace(loaded)
    files = options.Outputs(json=json_file, csv=csv_file, plot=plot, plot_pose=plot_pose, html=html, proof=proof)
    files.check(inputs)
    slices = _slices(loaded, files)
    # Two searches share the time: the first one takes at most half of it.
    with within(seconds_left() / 2 if scale else None):
        judged = _judge_with_progress(loaded, quantities or [], gap, time, leg_error, jobs, record)
    largest = None
    if scale:
        from ..proof.workspace.scale import largest_scale

        largest = scale_data(largest_scale(loaded, time_limit=time, jobs=jobs, judged=judged), loaded.units)
    result = workspace_of(judged, largest, chosen)

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose."""
        return evaluate_command(case, loaded, chosen, pose)

    files.deliver(
        lambda: [*contents.workspace_summary(loaded, result, command), *(_free_travel(loaded) if whole else ())],
        whole=whole,
        done=result.proved,
        json=lambda: result,
        csv=lambda: contents.tables_as_csv(contents.workspace_summary(loaded, result)),
        plot=lambda: contents.slices_figure(loaded, slices),
        plot_pose=lambda: _worst(loaded, result, plot_pose),
        html=lambda: contents.workspace_page(contents.WorkspaceReport(loaded, text, result, slices, command)),
        proof=lambda: proof_text(proof, judged, record, text, quantities or (), leg_error),
    )


def _refuse(given: Mapping[str, object]) -> None:
    """Refuse options of a workspace in which some setting must work at each pose.

    Raises:
        InputError: an option is given.
    """
    from ..errors import InputError

    for option, value in given.items():
        if value:
            raise InputError(f'{option}: is not supported with settings = "any"; use settings = "affine"')


def _existence(
    name: str, case: Case, text: str, chosen: Settings, time: float | None, files: options.Outputs, *, whole: bool
) -> NoReturn:
    """Prove that settings exist at every pose, write the files, show the answer, and exit."""
    from ..proof.workspace.judge import TIME_LIMIT
    from ..proof.workspace.pose_settings import prove_settings
    from ..results.posesettings import pose_settings_of
    from ..words.poses import evaluate_command
    from .proofs import settings_proof_text

    with spinner("formulating") as show:
        found = prove_settings(
            case,
            time_limit=TIME_LIMIT if time is None else time,
            progress=lambda proved, left: show(f"settings: {proved} boxes proved, {left} left"),
        )
    result = pose_settings_of(found, chosen)
    middle = {each.name: (each.lower + each.upper) / 2 for each in result.ranges}

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose with the settings in the middle of their ranges."""
        return evaluate_command(name, case.replace(middle), {**chosen, **middle}, pose)

    def summary() -> Iterator[Line | TextTable]:
        """Return the verdict and the settings of each box."""
        return contents.pose_settings_summary(case, result, command)

    files.deliver(
        summary,
        whole=whole,
        done=result.proved,
        json=lambda: result,
        csv=lambda: contents.tables_as_csv(summary()),
        proof=lambda: settings_proof_text(files["proof"], found, text),
    )


def _judge_with_progress(
    case: Case,
    quantities: list[str],
    gap: float,
    time: float | None,
    leg_error: float,
    jobs: int | None,
    record: ProofRecord | None,
) -> Judgement:
    """Judge a robot with a line of progress on standard error, where standard error is a terminal."""
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
                f"singularities: {boxes:,} boxes, {left:,} left, {seconds:.0f} s"
            ),
            progress=lambda name, done, total: show(f"{name}: {done} of {total} quantities done"),
            record=record,
        )


def _free_travel(case: Case) -> Iterator[Line | TextTable]:
    """Yield the table of free travel from the stated pose of a robot with six degrees of freedom."""
    from ...models.statics import degrees_of_freedom
    from ..errors import InputError
    from ..proof.workspace.axis_ranges import axis_ranges
    from ..results.axisranges import axis_ranges_result
    from ..words.axisranges import axis_ranges_tables
    from ..words.text import in_part

    if degrees_of_freedom(case.model) < 6:
        return
    try:
        found = axis_ranges(case, with_pairs=False, time_limit=_TRAVEL_TIME)
    except InputError:  # the pose is free
        return
    if found.axes:
        axes, _ = axis_ranges_tables(axis_ranges_result(found))
        yield from in_part("free travel", [axes])


def _slices(case: Case, files: options.Outputs) -> tuple[Slice, ...]:
    """Return the slices that the files show; empty for a page about a robot without slices.

    Raises:
        CaseError: a picture of slices is requested for a robot without slices.
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


def _worst(case: Case, result: WorkspaceResult, target: str | None) -> Figure:
    """Return a picture of the robot at its worst pose.

    Raises:
        InputError: no pose is known.
    """
    from ..errors import InputError
    from ..results.claims import worst_claim

    worst = worst_claim(result, case.tasks[0].sense)
    if worst is None:
        fault = "nothing to draw: no pose with a violation or with the worst value of a quantity is known"
        raise InputError(f"--plot-pose {target}: {fault}")
    return contents.figure_of([contents.drawing_at(case, worst)])

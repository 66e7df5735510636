"""Command ``path``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from . import contents, options, pathoptions
from .progress import spinner

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..proof.workspace.path_knots import Sampling
    from ..results.path import PathVerdictData


def path(
    case: options.CaseName,
    along: pathoptions.AlongFile = None,
    ranges: Annotated[
        bool,
        options.flag(
            "--range", "Prove the free travel from a pose along each coordinate and each pair, instead of a path"
        ),
    ] = False,
    most: Annotated[
        str | None, options.text("--most", "LENGTH,ANGLE", "Largest travel to each side with --range, angle in degrees")
    ] = None,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    unit: pathoptions.Unit = None,
    start: Annotated[
        str | None,
        options.text("--start", "X,Y,Z,A,B,C", "Pose before the G-code, or of --range; X,Y,Z if the angles are 0"),
    ] = None,
    offset: pathoptions.Offsets = None,
    angles: pathoptions.Angles = None,
    between: pathoptions.BetweenPoints = None,
    flavour: pathoptions.Flavour = None,
    end_of_file: pathoptions.EndOfFile = False,
    part: pathoptions.Part = None,
    macro: pathoptions.Macros = None,
    gap: options.RangeGap = 1e-3,
    time: Annotated[float | None, options.time("600 if left out; 120 with --range")] = None,
    json_file: options.JsonFile = None,
    proof: options.ProofFile = None,
    csv_file: Annotated[str | None, options.table("the actuators along the path")] = None,
    step: Annotated[
        float | None, options.number("--step", "LENGTH", "Distance between rows of --csv; for rotations, 1 degree")
    ] = None,
    within: Annotated[
        float | None,
        options.number(
            "--within",
            "LENGTH",
            "Place rows of --csv so that linear actuator motion between them stays this close to the path",
        ),
    ] = None,
    plot: Annotated[str | None, options.plot("Draw quantities along the path")] = None,
    html: Annotated[str | None, options.page(": verdicts, curves, robot")] = None,
    whole: options.ShowAll = False,
) -> None:
    """Prove no singularity and no violated limit along a tool path.

    The path is G-code or a CSV file of poses, from the case or from --along.
    """
    from functools import cache
    from pathlib import Path

    from ..case.pose import RotationForm
    from ..interruption import Milestone, answer_after
    from ..path.options import PathOptions
    from ..path.reader import options_of, path_of_case, read_path
    from ..path.settings import changing_of
    from ..proof.workspace.path_judge import TIME_LIMIT, judge_path
    from ..results.path import path_result, violating_poses
    from ..words.poses import evaluate_command
    from .proofs import path_premises, path_proof_text, proof_record

    sampling = _sampling(step, within, is_written=csv_file is not None)
    _refuse_elsewhere(
        {"--along": along, "--unit": unit, "--offset": offset, "--angles": angles, "--between": between}
        | {"--flavour": flavour, "--end-of-file": end_of_file or None, "--part": part, "--macro": macro}
        | {"--step": step, "--within": within, "--plot": plot, "--html": html, "--proof": proof},
        most,
        ranges=ranges,
    )
    record = proof_record(proof, json_file)
    answer_after(Milestone.BOUND)
    (loaded, text, inputs), chosen = options.read_changed_case(case, settings, of)
    files = options.Outputs(json=json_file, csv=csv_file, plot=plot, html=html, proof=proof)
    own = PathOptions() if along is not None or ranges or loaded.path is None else options_of(loaded.path)
    choices = pathoptions.PathChoices(
        unit, start, offset or [], angles, between, flavour, end_of_file, part, macro or ()
    ).over(own)
    if ranges:
        from .axisranges import show_ranges

        files.check(inputs)
        with spinner("the pose") as show:
            show_ranges(loaded, choices.start, most, time, files, show, whole=whole)
    if html is not None:
        from ..output.pictures.requirements import check_library

        check_library("plotly", "pages with a robot")
    files.check(inputs if along is None else {**inputs, Path(along): "the path that is read"})
    with spinner("reading the path") as show:
        programmed = (
            path_of_case(loaded, choices)
            if along is None
            else read_path(along, loaded.units, choices, changing_of(loaded))
        )
        premises = path_premises(proof, loaded, along, choices)
        limit = TIME_LIMIT if time is None else time
        judged = judge_path(
            loaded, programmed, gap=gap, time_limit=limit, sampling=sampling, progress=show, record=record
        )
    result = path_result(judged, chosen)

    def command(claim: PathVerdictData) -> str:
        """Return the command that shows a violated claim; empty if the case is optimised along its path."""
        if loaded.over_path is not None:
            return ""  # evaluate refuses such a case: its F needs the feed at a point of the path
        pose, *further = violating_poses(judged, claim)
        return evaluate_command(case, loaded, chosen, pose, RotationForm.RPY, claim=claim.name, further=further)

    @cache
    def picture() -> contents.PathPicture:
        """Return the curves that the picture and the page show."""
        from ..proof.workspace.path_samples import samples_of

        return contents.path_picture(judged, samples_of(judged), result)

    files.deliver(
        lambda: contents.path_summary(judged.case, result, command),
        whole=whole,
        done=result.proved,
        json=lambda: result,
        csv=lambda: None if judged.knots is None else contents.knots_csv(judged.case, judged.path, judged.knots),
        plot=lambda: contents.path_figure(picture()),
        html=lambda: contents.live_path_page(picture(), text, command, case),
        proof=lambda: path_proof_text(proof, loaded, judged, record, text, premises),
    )


def _refuse_elsewhere(along: Mapping[str, object], most: str | None, *, ranges: bool) -> None:
    """Refuse options of paths with ``--range``, and options of ``--range`` without it.

    Raises:
        InputError: such an option is given.
    """
    from ..errors import InputError

    for name, given in along.items() if ranges else [("--most", most)]:
        if given not in (None, []):
            raise InputError(f"{name}: conflicts with --range" if ranges else f"{name}: needs --range")


def _sampling(step: float | None, within: float | None, *, is_written: bool) -> Sampling | None:
    """Return the requirements on the rows of a table; None without a table.

    Raises:
        InputError: a length is not positive, or both options are given.
    """
    from ..errors import InputError
    from ..proof.workspace.path_knots import Sampling

    for option, length in (("--step", step), ("--within", within)):
        if length is not None and not 0 < length < math.inf:
            raise InputError(f"{option} {length:g}: must be a length above 0")
    if step is not None and within is not None:
        raise InputError("--step and --within: give only one; both set the distance between rows")
    return None if step is None and within is None and not is_written else Sampling(step, within)

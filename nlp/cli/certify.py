"""The command ``certify``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import (
    AllAssemblies,
    CaseName,
    Jobs,
    JsonFile,
    Outputs,
    SettingTexts,
    Time,
    console,
    number_option,
    read_settings,
    starts_option,
    write_json,
)


def certify(
    case: CaseName,
    settings: SettingTexts = None,
    gap: Annotated[float, number_option("--gap", "PART", "Largest relative gap of the bound.")] = 1e-4,
    time: Time = None,
    above: Annotated[
        float | None, number_option("--above", "F", "Prove that F is above this value on the whole box.")
    ] = None,
    proof: Annotated[str | None, typer.Option(metavar="FILE", help="Write the proof, for verify-proof.")] = None,
    starts: Annotated[int | None, starts_option("Starting points for the incumbent instead of the case's.")] = None,
    all_assemblies: AllAssemblies = False,
    jobs: Jobs = None,
    json_file: JsonFile = None,
) -> None:
    """Prove a bound of the global optimum over the whole box."""
    from ..case.reader import read_case
    from ..errors import InputError, one_line
    from ..interruption import Milestone, answer_after
    from ..output.files import write_text
    from ..output.terminal import show
    from ..results.evidence import certified_of
    from ..results.robotwording import unknown_lines
    from ..solver.certified import CertifyOptions, OptionError, proof_of
    from .progress import certify_with_progress

    try:
        answer_after(Milestone.START)
        answer_after(Milestone.BOUND)
        CertifyOptions(gap, above, time, jobs)  # a wrong option is reported before a wrong case
        files = Outputs(json=json_file, proof=proof)
        loaded, text, inputs = read_case(case, read_settings(settings))
        files.check(inputs)
        if not files.is_piped:
            show(console(), unknown_lines(loaded.model, all_assemblies=all_assemblies))
        certified = certify_with_progress(
            loaded,
            gap=gap,
            above=above,
            time_limit=time,
            jobs=jobs,
            starts=starts,
            all_assemblies=all_assemblies,
            with_proof=proof is not None,
        )
    except OptionError as error:
        raise InputError(f"--{error}") from None
    result = certified_of(certified)
    if proof is not None:
        if certified.tree is not None:
            write_text(proof, proof_of(certified, text).as_text())
        else:
            # A file of an earlier run is left as it is: it must not be taken for the proof of this one.
            typer.echo(f"--proof {one_line(proof)}: not written, as there is no complete proof", err=True)
    write_json(json_file, result)
    if not files.is_piped:
        from ..results.summary import certified_summary

        show(console(), certified_summary(loaded, result))
    raise typer.Exit(0 if certified.is_proved else 1)

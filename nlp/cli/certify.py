"""The command ``certify``."""

from __future__ import annotations

from typing import Annotated

from . import options
from .commandline import print_notice


def certify(
    case: options.CaseName,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    gap: options.OptimumGap = 1e-4,
    time: options.Time = None,
    above: Annotated[
        float | None, options.number("--above", "F", "Prove that F is above this value on the whole box")
    ] = None,
    proof: options.ProofFile = None,
    starts: Annotated[int | None, options.starts("Starting points for the incumbent; the case's if left out")] = None,
    seed: options.Seed = None,
    all_assemblies: options.AllAssemblies = False,
    jobs: options.Jobs = None,
    json_file: options.JsonFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Prove a bound of the global optimum over the whole box."""
    from ..errors import InputError, one_line
    from ..interruption import Milestone, answer_after
    from ..output.files import write_text
    from ..results.evidence import certified_of
    from ..results.robotwording import unknown_lines
    from ..solver.certified import CertifyOptions, OptionError, proof_of
    from .progress import certify_with_progress

    try:
        answer_after(Milestone.START)
        answer_after(Milestone.BOUND)
        CertifyOptions(gap, above, time, jobs)  # a wrong option is reported before a wrong case
        files = options.Outputs(json=json_file, proof=proof)
        loaded, text, inputs = options.read_machine(case, settings, of).file
        files.check(inputs)
        certified = certify_with_progress(
            loaded,
            gap=gap,
            above=above,
            time_limit=time,
            jobs=jobs,
            starts=starts,
            seed=seed,
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
            print_notice(f"--proof {one_line(proof)}: not written, as there is no complete proof")
    options.write_json(json_file, result)
    if not files.is_piped:
        from ..results.summary import certified_summary

        in_home_mode = all(each.nlp.in_home_mode for each in certified.certificates)
        options.show(unknown_lines(loaded.model, all_assemblies=not in_home_mode), whole=True)
        options.show(certified_summary(loaded, result), whole=whole)
    raise SystemExit(0 if certified.is_proved else 1)

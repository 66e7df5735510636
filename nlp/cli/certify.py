"""Command ``certify``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import contents, options
from .commandline import print_notice

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..words.text import Line, TextTable


def certify(
    case: options.CaseName,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    gap: options.OptimumGap = 1e-4,
    time: options.Time = None,
    above: Annotated[
        float | None,
        options.number("--above", "F", "Only prove that F is above this value everywhere within the bounds"),
    ] = None,
    proof: options.ProofFile = None,
    starts: Annotated[
        int | None, options.starts("Starting points of the solve for the best known point; the case's if left out")
    ] = None,
    seed: options.Seed = None,
    all_assemblies: options.AllAssemblies = False,
    jobs: options.Jobs = None,
    json_file: options.JsonFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Prove a bound of the global optimum of a case.

    The bound holds for every point within the bounds of the variables and the limits of the case.
    """
    from ..errors import InputError, one_line
    from ..interruption import Milestone, answer_after
    from ..results.evidence import certified_of
    from ..solver.certified import CertifyOptions, OptionError, proof_of
    from .progress import certify_with_progress

    try:
        answer_after(Milestone.START)
        answer_after(Milestone.BOUND)
        CertifyOptions(gap, above, time, jobs)  # a fault of an option is reported before a fault of the case
        files = options.Outputs(json=json_file, proof=proof)
        loaded, text, inputs = options.read_changed_case(case, settings, of).file
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

    def proof_text() -> str | None:
        if certified.tree is not None:
            return proof_of(certified, text).as_text()
        # The file of an earlier run stays: an empty file would look like a proof of this run.
        print_notice(f"--proof {one_line(proof or '')}: not written, as there is no complete proof")
        return None

    def shown() -> Iterable[Line | TextTable]:
        in_home_mode = all(each.nlp.in_home_mode for each in certified.certificates)
        unknowns = contents.unknown_lines(loaded.model, all_assemblies=not in_home_mode)
        return [*contents.certified_summary(loaded, result), *unknowns]

    files.deliver(shown, whole=whole, done=certified.is_proved, proof=proof_text, json=lambda: result)

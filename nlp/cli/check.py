"""Command ``check``."""

from __future__ import annotations

from typing import Annotated

from . import contents, options
from .commandline import Argument, print_notice


def check(
    cases: Annotated[
        list[str] | None,
        Argument("[CASE]...", "Case files or names of shipped cases, - is stdin; all shipped cases if left out."),
    ] = None,
    json_file: options.JsonFile = None,
    junit: Annotated[
        str | None, options.file("--junit", "Write JUnit XML for continuous integration; - is stdout")
    ] = None,
    markdown: Annotated[bool, options.flag("--markdown", "Print a table of the published values in Markdown")] = False,
    _time: options.Time = None,
    whole: options.ShowAll = False,
) -> None:
    """Compare results with expected and published values.

    A case states these values under [expect] and [[published]].
    """
    from ..case.source import case_inputs, shipped_cases
    from ..errors import InputError
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..results.checks import check as check_cases
    from ..results.checks import checks_of

    if [json_file, junit, "-" if markdown else None].count("-") > 1:
        raise InputError("only one of --json -, --junit - and --markdown can go to standard output")
    inputs = {path: words for each in cases or shipped_cases() for path, words in case_inputs(each).items()}
    files = options.Outputs(json=json_file, junit=junit, markdown="-" if markdown else None)
    files.check(inputs)
    answer_after(Milestone.CASE)
    checks = check_cases(cases)
    is_stopped = is_requested()
    if is_stopped:
        print_notice(f"{why_stopped()}: {len(checks)} of {len(cases or shipped_cases())} cases are checked")
    files.deliver(
        lambda: contents.checks_summary(checks),
        whole=whole,
        done=all(each.passed for each in checks) and not is_stopped,
        json=lambda: checks_of(checks),
        junit=lambda: contents.checks_as_junit(checks),
        markdown=lambda: contents.checks_as_markdown(checks),
    )

"""The command ``check``."""

from __future__ import annotations

import sys
from typing import Annotated

from . import options
from .commandline import Argument, print_notice


def check(
    cases: Annotated[
        list[str] | None,
        Argument("[CASE]...", "Case files or names of shipped cases, - is stdin; all shipped ones if left out."),
    ] = None,
    json_file: options.JsonFile = None,
    junit: Annotated[str | None, options.file("--junit", "Write JUnit XML for a CI; - is stdout")] = None,
    markdown: Annotated[bool, options.flag("--markdown", "Print the published numbers as a table")] = False,
    _time: options.Time = None,
    whole: options.ShowAll = False,
) -> None:
    """Compare cases with their expected and published values."""
    from ..case.source import case_inputs, shipped_cases
    from ..errors import InputError
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..output.checks import checks_as_junit, checks_as_markdown
    from ..output.files import check_outputs, write_text
    from ..results.checks import checks_of
    from ..results.regression import check as check_cases

    if [json_file, junit, "-" if markdown else None].count("-") > 1:
        raise InputError("standard output can take one of --json -, --junit - and --markdown only")
    inputs = {path: words for each in cases or shipped_cases() for path, words in case_inputs(each).items()}
    check_outputs(inputs, {"--json": json_file, "--junit": junit})
    answer_after(Milestone.CASE)
    checks = check_cases(cases)
    is_stopped = is_requested()
    if is_stopped:
        print_notice(f"{why_stopped()}: {len(checks)} of {len(cases or shipped_cases())} cases are checked")
    options.write_json(json_file, checks_of(checks))
    if junit is not None:
        write_text(junit, checks_as_junit(checks))
    if markdown:
        sys.stdout.write(checks_as_markdown(checks))
    elif "-" not in (json_file, junit):
        from ..results.checks import checks_summary

        options.show(checks_summary(checks), whole=whole)
    raise SystemExit(0 if all(each.passed for each in checks) and not is_stopped else 1)

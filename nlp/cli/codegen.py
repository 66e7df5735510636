"""Command ``codegen``."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

from . import options
from .commandline import print_line


def codegen(
    case: options.CaseName,
    out: options.Folder,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    no_measure: Annotated[
        bool, options.flag("--no-measure", "Do not compile the code to measure its flash and stack size")
    ] = False,
    force: options.Force = False,
) -> None:
    """Write F and its derivatives as C code for controllers."""
    from ..embedding.codegen import generate_c, size_words
    from ..embedding.ctext import identifier
    from ..errors import one_line
    from ..output.files import check_folder, check_outputs, write_folder

    if not force:
        check_folder(out)
    loaded, text, inputs = options.read_changed_case(case, settings, of).file
    files = generate_c(loaded, text)
    for name in files if Path(out).is_dir() else ():
        check_outputs(inputs, {"--out": str(Path(out) / name)})
    print_line(size_words(loaded, files))
    if loaded.limits_over:
        print_line(loaded.stated_pose_notice)
    if not no_measure:
        files = _measured(files, identifier(loaded.name))
    write_folder(out, files, force=force)
    command = f"make -C {shlex.quote(one_line(out))} test"
    print_line(f"{len(files)} files in {one_line(out)}; {command} compiles and tests them")


def _measured(files: dict[str, str], prefix: str) -> dict[str, str]:
    """Return the files with the measured sizes of flash and stack, which are printed; a terminal shows the progress."""
    from ..embedding.measure import figure_words, measure, with_figures

    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status("compiling to measure flash and stack; --no-measure skips this"):
            figures = measure(files, prefix)
    else:
        figures = measure(files, prefix)
    for each in figures:
        print_line(figure_words(each))
    return with_figures(files, prefix, figures)

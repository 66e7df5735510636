"""The command ``codegen``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import CaseName, SettingTexts, read_settings


def codegen(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="DIR", help="Folder to write into.")],
    settings: SettingTexts = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that screwsynth did not write.")] = False,
) -> None:
    """Write F and its derivatives as C for embedding."""
    from ..case.reader import read_case
    from ..embedding.codegen import generate_c, size_words
    from ..errors import one_line
    from ..output.files import check_folder, check_outputs, write_folder

    if not force:
        check_folder(out)
    loaded, text, inputs = read_case(case, read_settings(settings))
    files = generate_c(loaded, text)
    for name in files if Path(out).is_dir() else ():
        check_outputs(inputs, {"--out": str(Path(out) / name)})
    typer.echo(size_words(loaded, files))
    write_folder(out, files, force=force)
    typer.echo(f"{len(files)} files in {one_line(out)}: make -C {one_line(out)} test")

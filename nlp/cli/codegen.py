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
    language: Annotated[str, typer.Option(help="c is the only one.")] = "c",
    precision: Annotated[str, typer.Option(help="double is the only one.")] = "double",
) -> None:
    """Write F and its derivatives as C for embedding."""
    from ..case.reader import find_case, read_case
    from ..embedding.codegen import generate_c
    from ..errors import InputError, one_line
    from ..output.files import check_folder, check_outputs, write_folder

    if language != "c":
        raise InputError(f"--language {language}: only c is generated")
    if precision != "double":
        raise InputError(
            f"--precision {precision}: only double is generated; in single precision, optimising over these functions "
            "was tried and fails"
        )
    path = find_case(case)
    if not force:
        check_folder(out)
    files = generate_c(*read_case(case, read_settings(settings)))
    for name in files if Path(out).is_dir() else ():
        check_outputs([path], {"--out": str(Path(out) / name)})
    write_folder(out, files, force=force)
    typer.echo(f"{len(files)} files in {one_line(out)}: make -C {one_line(out)} test")

"""The command ``codegen``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import CaseName, SettingTexts, read_settings


def codegen(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="DIR", help="Folder to write into.")],
    settings: SettingTexts = None,
    language: Annotated[str, typer.Option(help="c is the only one.")] = "c",
    precision: Annotated[str, typer.Option(help="double is the only one.")] = "double",
) -> None:
    """Write F and its derivatives as C for embedding."""
    from ..case.reader import read_case
    from ..embedding.codegen import generate_c
    from ..errors import InputError
    from ..output.files import write_folder

    if language != "c":
        raise InputError(f"--language {language}: only c is generated")
    if precision != "double":
        raise InputError(
            f"--precision {precision}: only double is generated; in single precision, optimising over these functions "
            "was tried and fails"
        )
    files = generate_c(*read_case(case, read_settings(settings)))
    write_folder(out, files)
    typer.echo(f"{len(files)} files in {out}: make -C {out} test")

"""The command ``codegen``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import CaseName


def codegen(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="DIR", help="Folder to write into.")],
) -> None:
    """Write F and its derivatives as C for embedding."""
    from ..case.reader import find_case, load_case
    from ..embedding.codegen import generate_c, size_words
    from ..output.files import read_text, write_folder

    loaded = load_case(case)
    files = generate_c(loaded, read_text(str(find_case(case))))
    typer.echo(size_words(loaded, files))
    write_folder(out, files)
    typer.echo(f"{len(files)} files in {out}: make -C {out} test")

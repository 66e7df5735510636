"""The commands and their common help."""

from __future__ import annotations

from typing import Annotated

import typer

from .certify import certify
from .check import check
from .codegen import codegen
from .compare import compare
from .evaluate import evaluate
from .export import export
from .importing import SeveralValues, import_
from .models import models
from .new import new
from .pareto import pareto
from .report import report
from .schema import schema
from .solve import solve
from .sweep import sweep
from .tradeoff import tradeoff
from .verify_proof import verify_proof
from .workspace import workspace

app = typer.Typer(
    name="screwsynth",
    help="Geometry and pose of a parallel robot for a given instantaneous screw motion.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)

# In the order in which help lists them.
for command in (
    solve,
    report,
    tradeoff,
    sweep,
    pareto,
    compare,
    certify,
    verify_proof,
    workspace,
    check,
    evaluate,
    codegen,
    export,
    models,
    schema,
    new,
):
    app.command()(command)
app.command("import", cls=SeveralValues)(import_)


def _print_version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        typer.echo(f"screwsynth {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass

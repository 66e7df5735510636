"""The commands and their common help."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

if TYPE_CHECKING:
    from collections.abc import Callable

#: What help says of each command, in the order in which it lists them: the first line of the command's own help. Help
#: and every command are read from here without the modules of the others.
SUMMARIES = {
    "solve": "Maximise or minimise F, and show the evidence.",
    "report": "Solve a case and write a page about it.",
    "tradeoff": "Solve along one limit or number, and show F against it.",
    "sweep": "Solve at thousands of values of fixed numbers.",
    "pareto": "Find the front of two or more goals of a case.",
    "compare": "Compare several robots on the task of a case.",
    "certify": "Prove a bound of the global optimum over the whole box.",
    "verify-proof": "Check a proof with independent code.",
    "workspace": "Prove regular poses and limits over a whole workspace.",
    "path": "Prove regular poses and limits at every point of a path.",
    "check": "Compare cases with their expected and published values.",
    "evaluate": "Show F, J, rank and rates at one point.",
    "inverse": "Compute positions of actuators and joints at many poses.",
    "codegen": "Write F and its derivatives as C for embedding.",
    "export": "Write the solved robot as MJCF, URDF, CSV or DXF.",
    "models": "List the robots, or show one in full.",
    "schema": "Print the JSON Schema of case files.",
    "new": "Print a commented starter case.",
    "import": "Read a robot with closed loops from MJCF or URDF.",
}


class Commands(TyperGroup):
    """The commands, of which only the one that is called is built."""

    def __init__(self, **attributes: Any) -> None:  # noqa: ANN401 - of typer
        super().__init__(**attributes)
        listed = (TyperCommand(name, help=summary, rich_markup_mode=None) for name, summary in SUMMARIES.items())
        self.commands = dict(zip(SUMMARIES, listed, strict=True))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 - of typer or of click
        """Return the name, the command and its arguments."""
        name, listed, rest = super().resolve_command(ctx, args)
        return name, listed if name is None else command_of(name), rest


def command_of(name: str) -> Any:  # noqa: ANN401 - of typer or of click
    """Return a command with its options, from its module."""
    single = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    if name == "import":
        from .importing import SeveralValues, import_

        single.command(name, cls=SeveralValues)(import_)
    else:
        module = name.replace("-", "_")
        function: Callable[..., None] = getattr(import_module(f".{module}", __package__), module)
        single.command(name)(function)
    return typer.main.get_command(single)


app = typer.Typer(
    name="screwsynth",
    cls=Commands,
    help="Geometry and pose of a parallel robot for a given instantaneous screw motion.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


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

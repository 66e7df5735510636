"""The commands and their common help."""

from __future__ import annotations

from contextlib import nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from .usage import Command, faults_in_sentences

if TYPE_CHECKING:
    from collections.abc import Callable

#: What help says of each command, by what the command is for: the first line of the command's own help, and an example.
#: Help and every command are read from here without the modules of the others.
GROUPS = {
    "Solve": {
        "new": ("Print a commented starter case.", "new stewart-gough > my-robot.toml"),
        "models": ("List the robots, or show one in full.", "models 6-ups --plot robot.png"),
        "solve": ("Maximise or minimise F, and show the evidence.", "solve paper-4.1-helical --json result.json"),
        "evaluate": ("Show F, J, rank and rates at one point.", "evaluate paper-4.1-helical --set p_z=40"),
        "inverse": (
            "Compute positions of actuators and joints at many poses.",
            "inverse hexapod-linuxcnc --poses poses.csv --csv joints.csv",
        ),
        "report": ("Solve a case and write a page about it.", "report paper-4.1-helical --out report.html"),
    },
    "Prove": {
        "certify": (
            "Prove a bound of the global optimum over the whole box.",
            "certify paper-4.1-helical --proof proof.json",
        ),
        "workspace": (
            "Prove regular poses and limits over a whole workspace.",
            "workspace hexapod-linuxcnc --html workspace.html",
        ),
        "path": (
            "Prove regular poses and limits at every point of a path.",
            "path hexapod-pocket --html path.html",
        ),
        "verify-proof": ("Check a proof with independent code.", "verify-proof proof.json paper-4.1-helical"),
    },
    "Explore": {
        "tradeoff": (
            "Solve along one limit or number, and show F against it.",
            "tradeoff hexapod-machining --over limits.leg_length.max=28:40:13",
        ),
        "sweep": (
            "Solve at thousands of values of fixed numbers.",
            "sweep paper-4.1-helical --over x1=10:14:41 --out sweep.csv",
        ),
        "pareto": (
            "Find the front of two or more goals of a case.",
            "pareto hexapod-machining --goal 'max F' --goal 'min limits.leg_length.max'",
        ),
        "compare": (
            "Compare several robots on the task of a case.",
            "compare drilling-spindle case 6-ups delta --html robots.html",
        ),
    },
    "Exchange": {
        "import": (
            "Read a robot with closed loops from MJCF or URDF.",
            "import robot.xml --platform head --out robot.toml",
        ),
        "export": (
            "Write the solved robot as MJCF, URDF, CSV or DXF.",
            "export paper-4.1-helical --format mjcf --format csv --out robot",
        ),
        "codegen": ("Write F and its derivatives as C for embedding.", "codegen paper-4.1-helical --out helical"),
        "schema": ("Print the JSON Schema of case files.", "schema --result > result.schema.json"),
    },
    "Paper": {
        "check": ("Compare cases with their expected and published values.", "check paper-4.1-helical --markdown"),
    },
}
#: So many columns of a terminal are left for an example.
_WIDTH = 76
SUMMARIES = {name: summary for group in GROUPS.values() for name, (summary, _) in group.items()}
EXAMPLES = {name: f"screwsynth {example}" for group in GROUPS.values() for name, (_, example) in group.items()}


class Commands(TyperGroup):
    """The commands, of which only the one that is called is built."""

    def __init__(self, **attributes: Any) -> None:  # noqa: ANN401 - of typer
        super().__init__(**attributes)
        listed = (TyperCommand(name, help=summary, rich_markup_mode=None) for name, summary in SUMMARIES.items())
        self.commands = dict(zip(SUMMARIES, listed, strict=True))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - of typer or of click
        """Read the options before the command; without a word, help is shown."""
        with faults_in_sentences("screwsynth", self.params) if args else nullcontext():
            return super().parse_args(ctx, args)

    def resolve_command(self, _: Any, args: list[str]) -> Any:  # noqa: ANN401 - of typer or of click
        """Return the name, the command and its arguments.

        Raises:
            InputError: there is no such command.
        """
        if args[0] not in SUMMARIES:
            from ..errors import InputError

            raise InputError(f"{args[0]}: no such command; {_meant(args)}")
        return args[0], command_of(args[0]), args[1:]

    def format_commands(self, _: Any, formatter: Any) -> None:  # noqa: ANN401 - of typer or of click
        """Write the commands by what they are for."""
        width = max(map(len, SUMMARIES))
        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), summary) for name, (summary, _) in group.items()])


def _meant(args: list[str]) -> str:
    """Return what may be meant by arguments whose first one is no command, as a clause."""
    import shlex
    from pathlib import Path

    from ...models import model_names
    from ..case.source import shipped_cases
    from ..errors import nearest

    word, *others = args
    if word == "help":
        return f"write screwsynth {others[0] if others and others[0] in SUMMARIES else ''} --help".replace("  ", " ")
    if word == "version":
        return "write screwsynth --version"
    if word in model_names():
        return f"this is a robot: screwsynth models {word} shows it, screwsynth new {word} writes a case of it"
    if word in shipped_cases() or word.endswith(".toml") or Path(word).is_file():
        return f"a case stands behind a command, as in screwsynth solve {shlex.quote(word)}"
    return nearest(word, SUMMARIES)


def command_of(name: str) -> Any:  # noqa: ANN401 - of typer or of click
    """Return a command with its options, from its module."""
    single = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    # A command that is too wide for a line goes on in the next one.
    begin, option, end = EXAMPLES[name].rpartition(" --")
    example = f"{begin} \\\n   {option}{end}" if len(EXAMPLES[name]) > _WIDTH else EXAMPLES[name]
    epilog = f"\b\nExample:\n  {example}"
    if name == "import":
        from .importing import SeveralValues, import_

        single.command(name, cls=SeveralValues, epilog=epilog)(import_)
    else:
        module = name.replace("-", "_")
        function: Callable[..., None] = getattr(import_module(f".{module}", __package__), module)
        single.command(name, cls=Command, epilog=epilog)(function)
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

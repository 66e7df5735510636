"""The commands and their common help."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated

from ..errors import InputError, nearest
from .commandline import HELP_ROW, Command, Option, print_line, print_notice
from .usage import with_present_names

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


def help_of_commands() -> str:
    """Return the help of the command line: the commands by what they are for."""
    from .helptext import paragraphs, table, usage

    options = [("--version", "Print the version."), HELP_ROW]
    width = max(map(len, SUMMARIES))
    blocks = [
        usage("screwsynth", ["[OPTIONS]", "COMMAND", "[ARGS]..."]),
        paragraphs(_program.__doc__ or ""),
        table("Options", options),
    ]
    for title, group in GROUPS.items():
        blocks.append(table(title, [(name.ljust(width), summary) for name, (summary, _) in group.items()]))
    return "\n\n".join(blocks)


def run_command(words: list[str]) -> None:
    """Run the command that a command line names; without a word, help goes to standard error.

    Raises:
        InputError: the command line has a fault.
        SystemExit: with an exit status other than 0.
    """
    first = next((k for k, word in enumerate(words) if word in ("-", "--") or not word.startswith("-")), len(words))
    given = Command("screwsynth", _program, "").read(words[:first])
    if given is None:
        print_line(help_of_commands())
        return
    if given["version"]:
        from .. import __version__

        print_line(f"screwsynth {__version__}")
        return
    rest = words[first:]
    if rest[:1] == ["--"]:
        del rest[0]
    if not rest:
        print_notice(help_of_commands())
        raise SystemExit(2)
    if rest[0] not in SUMMARIES:
        raise InputError(f"{rest[0]}: no such command; {_meant(rest)}")
    command_of(rest[0]).run(rest[1:])


def _program(version: Annotated[bool, Option("--version", "", "Print the version.")] = False) -> None:
    """Geometry and pose of a parallel robot for a given instantaneous screw motion."""


def _meant(args: list[str]) -> str:
    """Return what may be meant by arguments whose first one is no command, as a clause."""
    import shlex
    from pathlib import Path

    from ...models import model_names
    from ..case.source import shipped_cases

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


def command_of(name: str) -> Command:
    """Return a command with its options, from its module."""
    # A command that is too wide for a line goes on in the next one.
    begin, option, end = EXAMPLES[name].rpartition(" --")
    example = f"{begin} \\\n   {option}{end}" if len(EXAMPLES[name]) > _WIDTH else EXAMPLES[name]
    if name == "import":
        from .importing import import_, with_repeated_options

        return Command(name, import_, example, with_repeated_options)
    module = name.replace("-", "_")
    function: Callable[..., None] = getattr(import_module(f".{module}", __package__), module)
    return Command(name, function, example, lambda words: with_present_names(name, words))

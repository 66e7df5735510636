"""Commands of the command line, and the help that lists them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated

from ..errors import InputError, nearest
from .commandline import HELP_ROW, Command, Option, print_line, print_notice
from .usage import with_present_names

if TYPE_CHECKING:
    from collections.abc import Callable

#: Commands by purpose, with the first line of their help and an example. With this list, a command starts without the
#: modules of the other commands.
GROUPS = {
    "Solve": {
        "new": ("Print a commented starter case.", "new stewart-gough > my-robot.toml"),
        "models": ("List the robots, or show one in full.", "models 6-ups --plot robot.png"),
        "solve": ("Optimise F, and show the evidence of the optimum.", "solve paper-4.1-helical --json result.json"),
        "evaluate": (
            "Show F, limits, rank and rates at one design and pose.",
            "evaluate paper-4.1-helical --set p_z=40",
        ),
        "inverse": (
            "Compute actuator and joint coordinates at many poses.",
            "inverse hexapod-linuxcnc --poses poses.csv --csv joints.csv",
        ),
        "report": ("Solve a case, and write an HTML report.", "report paper-4.1-helical --out report.html"),
    },
    "Prove": {
        "certify": (
            "Prove a bound of the global optimum of a case.",
            "certify paper-4.1-helical --proof proof.json",
        ),
        "workspace": (
            "Prove no singularity and no violated limit over a workspace.",
            "workspace hexapod-linuxcnc --html workspace.html",
        ),
        "path": (
            "Prove no singularity and no violated limit along a tool path.",
            "path hexapod-pocket --html path.html",
        ),
        "verify-proof": ("Check a proof file with independent code.", "verify-proof proof.json paper-4.1-helical"),
    },
    "Explore": {
        "tradeoff": (
            "Re-solve for a range of values of one limit or parameter.",
            "tradeoff hexapod-machining --over limits.leg_length.max=28:40:13",
        ),
        "sweep": (
            "Solve for thousands of values of fixed parameters.",
            "sweep paper-4.1-helical --over x1=10:14:41 --out sweep.csv",
        ),
        "pareto": (
            "Compute the Pareto front of two or more goals.",
            "pareto hexapod-machining --goal 'max F' --goal 'min limits.leg_length.max'",
        ),
        "compare": (
            "Compare robots on the task of a case, and order them by F.",
            "compare drilling-spindle case 6-ups delta --html robots.html",
        ),
    },
    "Exchange": {
        "import": (
            "Convert a closed-loop MJCF or URDF model to a robot file.",
            "import robot.xml --platform head --out robot.toml",
        ),
        "export": (
            "Write the solved robot as MJCF, URDF, CSV or DXF.",
            "export paper-4.1-helical --format mjcf --format csv --out robot",
        ),
        "codegen": (
            "Write F and its derivatives, or the kinematics alone, as C code for controllers.",
            "codegen paper-4.1-helical --out helical",
        ),
        "schema": ("Print the JSON Schema of case files or results.", "schema --result > result.schema.json"),
    },
    "Paper": {
        "check": ("Compare results with expected and published values.", "check paper-4.1-helical --markdown"),
    },
}
#: Columns of a terminal that an example may take.
_WIDTH = 76
SUMMARIES = {name: summary for group in GROUPS.values() for name, (summary, _) in group.items()}
EXAMPLES = {name: f"screwsynth {example}" for group in GROUPS.values() for name, (_, example) in group.items()}


def help_of_commands() -> str:
    """Return the help of the command line: the commands by purpose."""
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
    """Run the command of a command line; without a command, help goes to standard error.

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
        raise InputError(f"{rest[0]}: no such command; {_suggestion(rest)}")
    command_of(rest[0]).run(rest[1:])


def _program(version: Annotated[bool, Option("--version", "", "Print the version.")] = False) -> None:
    """Synthesis of parallel robots: dimensions and pose for a given instantaneous screw motion."""


def _suggestion(args: list[str]) -> str:
    """Return a suggestion, as a clause, for arguments that do not begin with a command."""
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
        return f"this is a robot: screwsynth models {word} shows it, screwsynth new {word} prints a case for it"
    if word in shipped_cases() or word.endswith(".toml") or Path(word).is_file():
        return f"this is a case: write it after a command, as in screwsynth solve {shlex.quote(word)}"
    return nearest(word, SUMMARIES)


def command_of(name: str) -> Command:
    """Return a command with its options, from its module."""
    # A command that is too wide for a line continues on the next one.
    begin, option, end = EXAMPLES[name].rpartition(" --")
    example = f"{begin} \\\n   {option}{end}" if len(EXAMPLES[name]) > _WIDTH else EXAMPLES[name]
    if name == "import":
        from .importing import import_, with_repeated_options

        return Command(name, import_, example, with_repeated_options)
    module = name.replace("-", "_")
    function: Callable[..., None] = getattr(import_module(f".{module}", __package__), module)
    return Command(name, function, example, lambda words: with_present_names(name, words))

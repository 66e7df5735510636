"""How a command line is read: earlier names of options, and faults of use as sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, cast

import typer
from typer.core import TyperCommand

#: Earlier names of options by command, which work, are told of, and stand in no help; an empty one has no effect.
EARLIER = {
    "report": {"--html": "--out"},
    "tradeoff": {"--page": "--html"},
    "sweep": {"--points": "--over"},
    "pareto": {"--goals": "--goal"},
    "compare": {"--range": "--part"},
    "workspace": {"--of-quantity": "--quantity", "--picture": "--plot-pose"},
    "codegen": {"--measure": ""},
}
#: The first version that may be without these names: see docs/versions.md.
_UNTIL = "0.3"
#: Every fault that typer finds in a command line, or click where typer stands on it.
_Fault = cast("type[Exception]", typer.BadParameter.__mro__[1])


class Command(TyperCommand):
    """A command that takes its options by their earlier names too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - of typer or of click
        """Write the options by their names, telling of earlier ones, and read the arguments.

        Raises:
            InputError: an option or an argument is missing, or is not one of the command.
        """
        names = EARLIER.get(self.name or "", {})
        end = args.index("--") if "--" in args else len(args)
        parts = [word.partition("=") for word in args[:end]]
        named = [names.get(name, name) + equals + value for name, equals, value in parts if names.get(name) != ""]
        for name in dict.fromkeys(name for name, _, _ in parts if name in names):
            fault = f"is an earlier name of {names[name]}, and" if names[name] else "has no effect any more, and"
            typer.echo(f"screwsynth: {self.name} {name}: {fault} works until {_UNTIL}", err=True)
        with faults_in_sentences(self.name or "", self.params):
            return super().parse_args(ctx, [*named, *args[end:]])


@contextmanager
def faults_in_sentences(command: str, params: Sequence[Any]) -> Iterator[None]:
    """Turn the faults of a command line into sentences that say what is allowed.

    Args:
        command: its name.
        params: its arguments and options, of typer or of click.

    Raises:
        InputError: there is a fault.
    """
    from ..errors import InputError

    try:
        yield
    except _Fault as error:
        raise InputError(_sentence(error, command, params)) from None


def _sentence(error: Any, command: str, params: Sequence[Any]) -> str:  # noqa: ANN401 - of typer or of click
    """Return a fault as a sentence; the arguments are those of :func:`faults_in_sentences`."""
    from ..errors import nearest

    options = {name: param for param in params if param.param_type_name == "option" for name in param.opts}
    param, name = getattr(error, "param", None), getattr(error, "option_name", None)
    if param is not None and not error.message:
        words = param.help.removesuffix(".")
        # Words such as CSV keep their letters.
        words = words if words[1:2].isupper() else words[:1].lower() + words[1:]
        is_option = param.param_type_name == "option"
        return f"{param.opts[0] if is_option else param.metavar}: is missing: {f'{param.metavar}, ' * is_option}{words}"
    if hasattr(error, "possibilities"):
        return f"{name}: no such option of {command}; {nearest(str(name), [*options, '--help'])}"
    if name is not None:
        is_flag = name not in options or options[name].is_flag
        return f"{name}: {'takes no value' if is_flag else f'needs a value, {options[name].metavar}'}"
    arguments = ", ".join(param.metavar for param in params if param.param_type_name == "argument")
    message = error.format_message().removesuffix(".")
    return f"{command}: {message[:1].lower()}{message[1:]}; it takes {arguments or 'options alone'}"

"""Commands declared by the signatures of functions: arguments, options, reading, and help.

The annotation of a parameter has the option or argument, as in ``Annotated[int, Option("--jobs", "N", "Threads")]``. A
parameter without a default is required; one that is a list takes several values.

Libraries for this load slower than everything else that help needs, and ``argparse`` takes a value with a minus sign,
such as the vector -1,0,0, for an option.
"""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, NamedTuple, get_args, get_origin, get_type_hints

from ..errors import InputError, nearest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from contextlib import AbstractContextManager

#: Names of the option of every command, and its row in help.
HELP = ("-h", "--help")
HELP_ROW = (", ".join(HELP), "Show this message and exit.")


class Argument(NamedTuple):
    """Argument of a command.

    Attributes:
        metavar: placeholder in help.
        help: sentence of help.
    """

    metavar: str
    help: str


class Option(NamedTuple):
    """Option of a command.

    Attributes:
        name: name, with its two dashes.
        metavar: placeholder for the value in help; empty for a flag, which has no value.
        help: sentence of help.
        read: reader of the value; it raises InputError.
        during: function that returns a context in which the command runs, from the value or the default.
    """

    name: str
    metavar: str
    help: str
    read: Callable[[str], Any] = str
    during: Callable[[Any], AbstractContextManager[object]] | None = None


class Parameter(NamedTuple):
    """Parameter of a command's function.

    Attributes:
        key: name in the function.
        declared: option or argument.
        is_several: If true, the parameter is a list.
        is_required: If true, the parameter has no default.
        default: default; None for a required parameter.
    """

    key: str
    declared: Option | Argument
    is_several: bool
    is_required: bool
    default: Any

    @property
    def name(self) -> str:
        """Name of the option, or placeholder of the argument."""
        return self.declared.name if isinstance(self.declared, Option) else self.declared.metavar

    @property
    def row(self) -> tuple[str, str]:
        """Row of the parameter in help: form and sentence."""
        each, words = self.declared, self.declared.help
        if self.is_required:
            words += "  [required]"
        elif self.default is not None and not isinstance(self.default, bool) and self.default != "":
            words += f"  [default: {self.default}]"
        return (f"{each.name} {each.metavar}".rstrip() if isinstance(each, Option) else each.metavar), words

    @property
    def missing(self) -> str:
        """Words of the message that the required parameter is missing."""
        words = self.declared.help.removesuffix(".")
        # Words such as CSV keep their letters.
        words = words if words[1:2].isupper() else words[:1].lower() + words[1:]
        return f"{self.declared.metavar}, {words}" if isinstance(self.declared, Option) else words

    def value_of(self, texts: list[str]) -> Any:  # noqa: ANN401 - of the type that the function states
        """Return the value that one or more texts give."""
        if isinstance(self.declared, Argument):
            return texts if self.is_several else texts[-1]
        if not self.declared.metavar:
            return True
        return [self.declared.read(text) for text in texts] if self.is_several else self.declared.read(texts[-1])


class Command:
    """A command.

    Attributes:
        name: name of the command.
        arguments: arguments; the last one may be a list.
        options: options by name, without the help option.

    Args:
        name: name of the command.
        function: function that the command calls; its docstring is the text of the help.
        shown: example for help.
        rewritten: function that changes the words of a command line before reading.
    """

    def __init__(
        self, name: str, function: Callable[..., None], shown: str, rewritten: Callable[[list[str]], list[str]] = list
    ) -> None:
        self.name, self._function, self._example, self._rewritten = name, function, shown, rewritten
        self._parameters = {each.key: each for each in _parameters_of(function)}
        self.arguments = [each for each in self._parameters.values() if isinstance(each.declared, Argument)]
        self.options = {each.name: each for each in self._parameters.values() if isinstance(each.declared, Option)}

    @property
    def help(self) -> str:
        """Help of the command."""
        from .helptext import example, paragraphs, table, usage

        name = f"screwsynth {self.name}"
        blocks = [usage(name, ["[OPTIONS]", *(each.name for each in self.arguments)])]
        blocks.append(paragraphs(self._function.__doc__ or ""))
        if self.arguments:
            blocks.append(table("Arguments", [each.row for each in self.arguments]))
        blocks.append(table("Options", [*(each.row for each in self.options.values()), HELP_ROW]))
        return "\n\n".join([*blocks, example(self._example)])

    def run(self, words: list[str]) -> None:
        """Call the function with the values of a command line, or print help where it is requested.

        Raises:
            InputError: the command line has a fault.
        """
        given = self.read(words)
        if given is None:
            print_line(self.help)
            return
        with ExitStack() as stack:
            for each in self.options.values():
                if isinstance(each.declared, Option) and each.declared.during is not None:
                    stack.enter_context(each.declared.during(given[each.key]))
            self._function(**given)

    def read(self, words: list[str]) -> dict[str, Any] | None:
        """Return the values of a command line by the names of the function's parameters; None if help is requested.

        Raises:
            InputError: an option or argument is missing, unknown, or has a value that is not allowed.
        """
        texts, places, is_help = self._sorted(self._rewritten(words))
        if is_help:
            return None
        for each in self.arguments:
            count = len(places) if each.is_several else 1
            if places:
                texts[each.key], places = places[:count], places[count:]
        given = {key: self._parameters[key].value_of(some) for key, some in texts.items()}
        for key, each in self._parameters.items():
            if key not in given and each.is_required:
                raise InputError(f"{each.name}: is missing: {each.missing}")
            given.setdefault(key, each.default)
        if places:
            taken = ", ".join(each.name for each in self.arguments) or "only options"
            raise InputError(f"{self.name}: got unexpected extra argument(s) ({' '.join(places)}); it takes {taken}")
        return given

    def _sorted(self, words: Iterable[str]) -> tuple[dict[str, list[str]], list[str], bool]:
        """Return texts of options by parameter, texts of arguments, and True if help is requested."""
        texts: dict[str, list[str]] = {}
        places: list[str] = []
        is_help, rest = False, iter(words)
        for word in rest:
            if word == "--":
                break
            if word == "-" or not word.startswith("-"):
                places.append(word)
                continue
            name, equals, text = word.partition("=")
            if name not in self.options and name not in HELP:
                raise InputError(f"{name}: no such option of {self.name}; {nearest(name, [*self.options, HELP[1]])}")
            metavar = self.options[name].declared.metavar if name in self.options else ""
            if equals and not metavar:
                raise InputError(f"{name}: takes no value")
            if metavar and not equals:
                following = next(rest, None)
                if following is None:
                    raise InputError(f"{name}: needs a value, {metavar}")
                text = following
            if name in self.options:
                texts.setdefault(self.options[name].key, []).append(text)
            else:
                is_help = True
        return texts, [*places, *rest], is_help


def _parameters_of(function: Callable[..., None]) -> list[Parameter]:
    """Return the parameters of a command's function."""
    hints = {name: hint for name, hint in get_type_hints(function, include_extras=True).items() if name != "return"}
    defaults = dict(zip(reversed(hints), reversed(function.__defaults__ or ()), strict=False))
    parameters = []
    for name, hint in hints.items():
        kind, declared = get_args(hint)
        is_several = any(get_origin(each) is list for each in (kind, *get_args(kind)))
        parameters.append(Parameter(name, declared, is_several, name not in defaults, defaults.get(name)))
    return parameters


def print_line(text: str) -> None:
    """Write a line to standard output."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def print_notice(text: str) -> None:
    """Write a line to standard error: a remark that does not belong to the result."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()

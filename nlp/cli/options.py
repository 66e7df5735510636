"""Arguments and options that several commands share, readers of numbers, and the files that a command writes."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    from matplotlib.figure import Figure
    from rich.console import Console

    from ..case.case import Case
    from ..case.overrides import Settings
    from ..results.jsondata import JsonObject
    from ..results.text import TextTable


_P = ParamSpec("_P")


class WholeNumber:
    """Reader of an option that is a whole number.

    Attributes:
        option: name of the option.
        least, most: smallest and largest allowed number; no largest one for None.
    """

    def __init__(self, option: str, least: int, most: int | None = None) -> None:
        self.option, self.least, self.most = option, least, most
        # The command line names the type of an option by its reader.
        self.__name__ = "N"

    def __call__(self, text: str | int) -> int:
        """Return the number.

        Raises:
            InputError: the text is no whole number, or the number is not allowed.
        """
        from ..errors import InputError

        try:
            number = int(text)
        except ValueError:
            number = self.least - 1
        if number < self.least or (self.most is not None and number > self.most):
            allowed = f"of at least {self.least}" if self.most is None else f"from {self.least} to {self.most}"
            raise InputError(f"{self.option} {text}: must be a whole number {allowed}")
        return number


class Number:
    """Reader of an option that is a number; the command checks whether it is allowed.

    Attributes:
        option: name of the option.
    """

    def __init__(self, option: str) -> None:
        self.option = option
        self.__name__ = "NUMBER"

    def __call__(self, text: str | float) -> float:
        """Return the number.

        Raises:
            InputError: the text is no number.
        """
        from ..errors import InputError

        try:
            return float(text)
        except ValueError:
            raise InputError(f"{self.option} {text}: must be a number") from None


CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case file, or the bare name of a shipped case.")]
PlotFile = Annotated[
    str | None, typer.Option("--plot", metavar="FILE", help="Draw the robot: a .png, .svg or .pdf file.")
]
PageFile = Annotated[str | None, typer.Option("--html", metavar="FILE", help="Write a page of HTML.")]
CurveFile = Annotated[
    str | None, typer.Option("--plot", metavar="FILE", help="Draw the curve: a .png, .svg or .pdf file.")
]
JsonFile = Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is stdout.")]
CsvFile = Annotated[
    str | None, typer.Option("--csv", metavar="FILE", help="Write the tables with all digits; - is stdout.")
]
CsvTable = Annotated[
    str | None, typer.Option("--table", metavar="NAME", help="Write this table only, such as design, limbs or limits.")
]


def number_option(name: str, metavar: str, words: str) -> Any:  # noqa: ANN401 - typer's own type is not public
    """Return an option that is a number, with what the help says of it."""
    return typer.Option(name, parser=Number(name), metavar=metavar, help=words)


def whole_option(name: str, words: str, least: int, most: int | None = None) -> Any:  # noqa: ANN401 - as above
    """Return an option that is a whole number within ends, with what the help says of it."""
    return typer.Option(name, parser=WholeNumber(name, least, most), metavar="N", help=words)


def starts_option(words: str) -> Any:  # noqa: ANN401 - as above
    """Return the option ``--starts``, with what the help says of it."""
    return whole_option("--starts", words, 1, 100_000)


def jobs_option(words: str) -> Any:  # noqa: ANN401 - as above
    """Return the option ``--jobs``, with what the help says of it."""
    return whole_option("--jobs", words, 1, 256)


Starts = Annotated[int | None, starts_option("Starting points instead of the case's.")]
Seed = Annotated[int | None, whole_option("--seed", "Seed instead of the case's.", 0)]
Jobs = Annotated[int | None, jobs_option("Threads; results do not depend on them.")]


def _begin(context: typer.Context, seconds: float | None) -> float | None:
    """Begin the time of a command: its searches take from what is left of it.

    Raises:
        InputError: the number is not positive.
    """
    from ..errors import check_seconds
    from ..interruption import within

    check_seconds(seconds)
    context.with_resource(within(seconds))
    return seconds


def time_option(words: str) -> Any:  # noqa: ANN401 - typer's own type is not public
    """Return the option ``--time``, with what the help says of it."""
    return typer.Option("--time", parser=Number("--time"), metavar="SECONDS", callback=_begin, help=words)


Time = Annotated[float | None, time_option("Seconds for the whole command, which then shows its results.")]
AllAssemblies = Annotated[
    bool,
    typer.Option("--all-assemblies", help="Cover all working modes of a robot's joints, not home's alone."),
]
LegError = Annotated[
    float, number_option("--leg-error", "LENGTH", "Largest error of a leg's length: bounds the errors of the pose.")
]
ResultFile = Annotated[
    str | None,
    typer.Option("--of", metavar="RESULT", help="Take the dimensions from a result that solve --json wrote."),
]
SettingTexts = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Replace a number of the case: x4=20, p_z=40, axis=0,0,1."),
]


def read_settings(texts: list[str] | None) -> Settings:
    """Return the numbers that ``--set`` gives, by name; the last counts where one is given twice.

    Raises:
        InputError: a text is neither ``NAME=NUMBER`` nor ``NAME=X,Y,Z``.
    """
    return dict(_read_setting(text) for text in texts or [])


def _read_setting(text: str) -> tuple[str, float | list[float]]:
    """Return the name and the number or numbers of one setting; the error is that of :func:`read_settings`."""
    from ..errors import InputError

    name, equals, value = (part.strip() for part in text.partition("="))
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if not (name and equals and numbers):
        raise InputError(f"--set {text}: must be NAME=NUMBER, or axis=X,Y,Z")
    return name, numbers[0] if len(numbers) == 1 else numbers


#: Options of files for which ``-`` is a name: pictures, and the table of a sweep.
_PICTURES, _TABLE = ("plot", "picture"), "out"


class Outputs:
    """The files that a command writes; it refuses those that cannot be made, before the work begins.

    Args:
        targets: file by the option that names it, such as ``json``; None for one that is not asked for. All but
            pictures and the table of a sweep are standard output for ``-``, one of them at most.

    Raises:
        InputError: several are standard output, a picture's ending is none, or Matplotlib is not installed.
    """

    def __init__(self, **targets: str | None) -> None:
        self._targets = targets
        pictures = [target for name in _PICTURES if (target := targets.get(name)) is not None]
        texts = {name: target for name, target in targets.items() if name not in (*_PICTURES, _TABLE)}
        #: Whether a file is standard output.
        self.is_piped = "-" in texts.values()
        if list(texts.values()).count("-") > 1:
            from ..errors import InputError

            *names, last = (f"--{name} -" for name in texts)
            raise InputError(f"standard output can take one of {', '.join(names)} and {last} only")
        if pictures or targets.get("html") is not None:
            from ..output.pictures.requirements import check_library, check_picture

            for target in pictures:
                check_picture(target)
            if targets.get("html") is not None:
                check_library("matplotlib", "pages")

    def __getitem__(self, name: str) -> str | None:
        """Return the file of an option; None where it is not asked for."""
        return self._targets[name]

    def check(self, inputs: Mapping[Path, str]) -> None:
        """Refuse files that cannot be written, that are an input, or that are each other.

        Args:
            inputs: files that are read, and the words for each in messages.

        Raises:
            InputError: a file is refused.
        """
        from ..output.files import check_outputs

        check_outputs(inputs, {f"--{name}": target for name, target in self._targets.items()})

    def draw(self, name: str, make: Callable[_P, Figure], *values: _P.args, **options: _P.kwargs) -> None:
        """Write the picture of an option, of the figure that a function returns for arguments.

        Raises:
            InputError: the file cannot be written.
        """
        from ..output.files import write_bytes
        from ..output.pictures.figures import picture_of
        from ..output.pictures.requirements import ending_of

        target = self._targets[name]
        if target is not None:
            write_bytes(target, picture_of(ending_of(target), make, *values, **options))


def write_json(target: str | None, result: JsonObject) -> None:
    """Write a result as JSON where it is asked for, to standard output for ``-``.

    Raises:
        InputError: the file cannot be written.
    """
    import json

    from ..output.files import write_text
    from ..results.jsondata import json_data

    if target is not None:
        write_text(target, json.dumps(json_data(result), indent=2, allow_nan=False) + "\n")


def check_csv(target: str | None, table: str | None, case: Case, *, at_point: bool) -> None:
    """Refuse a table that the command has none of, before the work begins.

    Args:
        target: of the tables.
        table: name of the only table to write.
        case: the case.
        at_point: whether the case is evaluated at a point, and not solved.

    Raises:
        InputError: it is refused.
    """
    from ..errors import InputError, listing
    from ..results.summary import table_names

    if target is None and table is not None:
        raise InputError(f"--table {table}: needs --csv FILE")
    names = table_names(case, at_point=at_point)
    if table is not None and table not in names:
        raise InputError(f"--table {table}: must be one of {listing(names)}")


def write_csv(target: str | None, tables: Iterable[TextTable], name: str | None) -> None:
    """Write tables as comma-separated values where they are asked for, to standard output for ``-``.

    Raises:
        InputError: it cannot be written, or the result has no table of this name.
    """
    from ..output.csvtables import tables_as_csv
    from ..output.files import write_text

    if target is not None:
        write_text(target, tables_as_csv(tables, name))


def console() -> Console | None:
    """Return a console on standard output for lines and tables; None where that shows no styles."""
    # With one of these variables, the console itself decides whether it shows styles.
    if not sys.stdout.isatty() and not os.environ.keys() & {"FORCE_COLOR", "TTY_COMPATIBLE"}:
        return None
    from rich.console import Console

    from ..output.terminal import PLAIN_WIDTH

    # In a file or a pipe, a table is as wide as its content.
    width = None if sys.stdout.isatty() else PLAIN_WIDTH
    return Console(highlight=False, markup=False, emoji=False, width=width)

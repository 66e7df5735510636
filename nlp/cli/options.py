"""Arguments and options of the commands, their readers, and the files that a command writes.

Options of several commands are defined here, once.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated, NamedTuple, NoReturn, cast

from ..interruption import within
from .commandline import Argument, Option, print_notice

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    from matplotlib.figure import Figure
    from rich.console import Console

    from ...models import Model
    from ..case.case import Case
    from ..case.overrides import Settings
    from ..case.reader import CaseFile
    from ..system.jsonvalues import JsonObject
    from ..words.text import Line, TextTable


class WholeNumber:
    """Reader of an option that is a whole number.

    Attributes:
        option: name of the option.
        least, most: smallest and largest allowed number; None for no largest number.
    """

    def __init__(self, option: str, least: int, most: int | None = None) -> None:
        self.option, self.least, self.most = option, least, most

    def __call__(self, text: str) -> int:
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
    """Reader of an option that is a number.

    Attributes:
        option: name of the option.
        least: smallest allowed number, for numbers below 1; None if the command checks the number.
    """

    def __init__(self, option: str, least: float | None = None) -> None:
        self.option, self.least = option, least

    def __call__(self, text: str) -> float:
        """Return the number.

        Raises:
            InputError: the text is no number, or the number is not allowed.
        """
        from ..errors import InputError
        from ..system.slips import hint_of

        try:
            number = float(text)
        except ValueError:
            raise InputError(f"{self.option} {text}: must be a number{hint_of(text)}") from None
        if self.least is not None and not self.least <= number < 1:
            raise InputError(f"{self.option} {number:g}: must be at least {self.least:g} and below 1")
        return number


# Words of the command line: an option of several commands has one name, one form and one sentence of help, to which a
# command adds words of its own.


def text(name: str, metavar: str, words: str) -> Option:
    """Return an option that is a text, with its sentence of help."""
    return Option(name, metavar, f"{words}.")


def several(name: str, metavar: str, words: str) -> Option:
    """Return an option that is given once for each value."""
    return Option(name, metavar, f"{words}; may be repeated.")


def flag(name: str, words: str) -> Option:
    """Return an option without a value."""
    return Option(name, "", f"{words}.")


def file(name: str, words: str) -> Option:
    """Return an option that names a file."""
    return text(name, "FILE", words)


def plot(words: str, name: str = "--plot") -> Option:
    """Return the option of a picture."""
    return file(name, f"{words}: a .png, .svg or .pdf file")


def page(words: str) -> Option:
    """Return the option of a page of HTML."""
    return file("--html", f"Write an HTML page{words}; - is stdout")


def table(words: str) -> Option:
    """Return the option of comma-separated values."""
    return file("--csv", f"Write {words} as CSV; - is stdout")


def number(name: str, metavar: str, words: str, least: float | None = None) -> Option:
    """Return an option that is a number; with a smallest allowed number, it must be below 1 too."""
    return Option(name, metavar, f"{words}.", Number(name, least))


def whole(name: str, words: str, least: int, most: int | None = None) -> Option:
    """Return an option that is a whole number between two bounds."""
    return Option(name, "N", f"{words}.", WholeNumber(name, least, most))


def starts(words: str) -> Option:
    """Return the option ``--starts``."""
    return whole("--starts", words, 1, 100_000)


def jobs(words: str) -> Option:
    """Return the option ``--jobs``."""
    return whole("--jobs", words, 1, 256)


def _seconds(text: str) -> float:
    """Return the time of a text, seconds.

    Raises:
        InputError: the text is no number, or the number is not positive.
    """
    from ..errors import check_seconds

    seconds = Number("--time")(text)
    check_seconds(seconds)
    return seconds


def time(left_out: str, end: str = "shows its results") -> Option:
    """Return the option ``--time``, with the default time, and the command's action at the end of the time."""
    words = f"Time limit in seconds, after which the command {end}; {left_out}."
    return Option("--time", "SECONDS", words, _seconds, within)


CaseName = Annotated[str, Argument("CASE", "Case file, or name of a shipped case; - is stdin.")]
SettingTexts = Annotated[
    list[str] | None, several("--set", "NAME=VALUE", "Replace a value of the case: x4=20, p_z=40, axis=0,0,1")
]
ResultFile = Annotated[str | None, text("--of", "RESULT", "Take the dimensions from a result of solve --json")]
Starts = Annotated[int | None, starts("Number of starting points; the case's if left out")]
Seed = Annotated[int | None, whole("--seed", "Random seed; the case's if left out", 0)]
Jobs = Annotated[int | None, jobs("Number of threads, which does not change results; all cores if left out")]
Time = Annotated[float | None, time("no limit if left out")]
PoseNumber = Annotated[int, whole("--pose", "Number of the pose to draw or write, in a case of several poses", 1)]
Certify = Annotated[bool, flag("--certify", "Also prove a bound of every optimum, as certify does")]
# A certificate has one bound, with a gap of 1e-4; a workspace has dozens of ranges, with a gap of 1e-3.
OptimumGap = Annotated[
    float, number("--gap", "FRACTION", "Stop when bound and best value differ by less than this fraction", 1e-10)
]
RangeGap = Annotated[
    float,
    number("--gap", "FRACTION", "Tighten a range until bound and best value differ by less than this fraction", 1e-9),
]
AllAssemblies = Annotated[bool, flag("--all-assemblies", "Cover all working modes of the robot, not only that of home")]
LegError = Annotated[
    float, number("--leg-error", "LENGTH", "Also bound the pose error for leg-length errors up to this length")
]
ProofFile = Annotated[str | None, file("--proof", "Write the proof file for verify-proof")]
JsonFile = Annotated[str | None, file("--json", "Write the result as JSON; - is stdout")]
CsvFile = Annotated[str | None, table("all tables, with all digits,")]
CsvTable = Annotated[
    str | None, text("--table", "NAME", "Write only this table with --csv, such as design, limbs or limits")
]
PlotFile = Annotated[str | None, plot("Draw the robot")]
CurveFile = Annotated[str | None, plot("Draw the curve")]
PageFile = Annotated[str | None, page("")]
MarkdownFile = Annotated[str | None, file("--markdown", "Write the table in Markdown; - is stdout")]
ResumeFile = Annotated[
    str | None, file("--resume", "Journal of solved points: after a stop, the same command continues from it")
]
ShowAll = Annotated[bool, flag("--all", "Show all rows and tables, not only the answer")]
Folder = Annotated[str, text("--out", "DIR", "Folder to write into")]
Force = Annotated[bool, flag("--force", "Overwrite files that screwsynth did not write")]


def read_settings(texts: list[str] | None) -> Settings:
    """Return the values of ``--set`` by name; for a repeated name, the last value.

    Raises:
        InputError: a text is neither ``NAME=NUMBER`` nor ``NAME=X,Y,Z``.
    """
    return dict(_read_setting(text) for text in texts or [])


def _read_setting(text: str) -> tuple[str, float | list[float]]:
    """Return the name and the number or numbers of one setting; the error is that of :func:`read_settings`."""
    from ..errors import InputError
    from ..system.slips import hint_of

    name, equals, value = (part.strip() for part in text.partition("="))
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    # No value of a case is a pair: two numbers are one with a decimal comma, or an axis without its third part.
    is_pair = len(numbers) == 2 and not name.endswith("axis")
    if not (name and equals and numbers) or is_pair:
        raise InputError(f"--set {text}: must be NAME=NUMBER, or axis=X,Y,Z{hint_of(value)}")
    return name, numbers[0] if len(numbers) == 1 else numbers


class ChangedCase(NamedTuple):
    """Case, and the values that replace values of its file."""

    file: CaseFile
    settings: Settings


def read_changed_case(
    name: str, texts: list[str] | None, of: str | None, *, at_pose: bool = False, claim: str | None = None
) -> ChangedCase:
    """Read a case with the values of ``--set``, and with the dimensions of the result of ``--of``.

    Args:
        name: name of the case.
        texts: texts of ``--set``: values that replace those of the file, and of the result.
        of: file of the result; None without a result.
        at_pose: If true, a result of this case also gives the pose.
        claim: result file and number of a violated claim, for dimensions and pose; None without a claim.

    Raises:
        InputError: a file cannot be read or has a fault, or the result is no answer for this robot in these units.
    """
    from ..case.reader import read_case

    settings = read_settings(texts)
    if claim is not None:
        from ..results.settings import claim_settings

        settings = {**claim_settings(claim, read_case(name, settings).case), **settings}
    if of is None:
        return ChangedCase(read_case(name, settings), settings)
    from ..errors import one_line
    from ..results.settings import dimensions_of, load_answer, place_of, robots_of, settings_of

    case, result = read_case(name, settings).case, load_answer(of)
    robots, is_same = robots_of(result, f"--of {of}", case, of_any_case=True), result.head.case == case.name
    # A workspace about the pose moves with it.
    moves = case.workspace is not None and case.workspace.about_pose and robots[0].several is None
    has_pose = (at_pose and is_same) or moves
    numbers = settings_of(robots, case) if has_pose else dimensions_of(robots, case)
    chosen = {**numbers, **place_of(result, case), **settings}
    if not is_same:
        what = "dimensions and the pose" if has_pose else "dimensions"
        print_notice(f"--of {one_line(of)}: gives the {what} of the case {one_line(result.head.case)!r}")
    return ChangedCase(read_case(name, chosen), chosen)


def read_robot(file: str) -> Model:
    """Return the robot of a robot file, without a case.

    Raises:
        InputError: the file cannot be read, or holds a fault.
    """
    from pathlib import Path

    from ..case.robotfile import model_of_definition, read_definition
    from ..errors import CaseError, InputError

    try:
        return model_of_definition(read_definition(file, Path()), file)
    except CaseError as error:
        # The key belongs to a case that names the file, and there is no case here.
        raise (InputError(f"{file}: {error.fault}") if error.key == "robot.file" else error) from None


#: Options for which ``-`` is the name of a file: pictures; the table of a sweep, and journals.
_PICTURES, _NAMED = ("plot", "plot_pose"), ("out", "resume")


class Outputs:
    """Output files of a command; files that cannot be made are refused before the work begins.

    Args:
        targets: files by option, such as ``json``, or ``plot_pose`` for ``--plot-pose``; None for a file that is not
            requested. ``-`` is standard output, for one file at most; not for pictures, journals and a sweep's table.

    Raises:
        InputError: several files are standard output, a picture's ending is unknown, or Matplotlib is not installed.
    """

    def __init__(self, **targets: str | None) -> None:
        self._targets = targets
        pictures = [target for name in _PICTURES if (target := targets.get(name)) is not None]
        texts = {name: target for name, target in targets.items() if name not in (*_PICTURES, *_NAMED)}
        #: Whether a file is standard output.
        self.is_piped = "-" in texts.values()
        if list(texts.values()).count("-") > 1:
            from ..errors import InputError

            *names, last = (f"--{name} -" for name in texts)
            raise InputError(f"only one of {', '.join(names)} and {last} can go to standard output")
        if pictures or targets.get("html") is not None:
            from ..output.pictures.requirements import check_library, check_picture

            for target in pictures:
                check_picture(target)
            if targets.get("html") is not None:
                check_library("matplotlib", "pages")

    def __getitem__(self, name: str) -> str | None:
        """Return the file of an option; None if it is not requested."""
        return self._targets[name]

    def check(self, inputs: Mapping[Path, str]) -> None:
        """Refuse files that cannot be written, that are inputs, or that are named by two options.

        Args:
            inputs: input files, with a word for each in messages.

        Raises:
            InputError: a file is refused.
        """
        from ..output.files import check_outputs

        check_outputs(inputs, {f"--{name.replace('_', '-')}": target for name, target in self._targets.items()})

    def deliver(
        self,
        shown: Callable[[], Iterable[Line | TextTable]],
        *,
        whole: bool,
        done: bool = True,
        **contents: Callable[[], JsonObject | str | Figure | None],
    ) -> NoReturn:
        """Write the requested files, show the answer where standard output takes no file, and exit.

        Only requested contents are made. A file is written completely or not at all, in the order of the contents.

        Args:
            shown: function that returns the lines and tables for the terminal.
            whole: If true, everything is shown, not only the answer.
            done: If true, the exit status is 0; otherwise 1.
            contents: for each option, a function that returns the content of the file: a result for JSON, a text, or a
                figure; None to leave the file unwritten.

        Raises:
            InputError: a file cannot be written.
            SystemExit: at the end, with the exit status.
        """
        for name, make in contents.items():
            target = self._targets.get(name)
            if target is not None:
                _write(target, make, is_picture=name in _PICTURES)
        if not self.is_piped:
            show(shown(), whole=whole)
        raise SystemExit(0 if done else 1)


def _write(target: str, make: Callable[[], JsonObject | str | Figure | None], *, is_picture: bool) -> None:
    """Write a file, or standard output for ``-``; ``make`` returns the content."""
    from ..output.files import write_bytes, write_text

    if is_picture:
        from ..output.pictures.figures import picture_of
        from ..output.pictures.requirements import ending_of

        write_bytes(target, picture_of(ending_of(target), cast("Callable[[], Figure]", make)))
        return
    content = make()
    if isinstance(content, str):
        write_text(target, content)
    elif content is not None:
        import json

        from ..system.jsonvalues import json_data

        write_text(target, json.dumps(json_data(cast("JsonObject", content)), indent=2, allow_nan=False) + "\n")


def check_csv(target: str | None, table: str | None, case: Case, *, at_point: bool) -> None:
    """Refuse the name of a table that the command does not write, before the work begins.

    Args:
        target: file of the tables.
        table: name of the only table to write.
        case: the case.
        at_point: If true, the case is evaluated at a point, not solved.

    Raises:
        InputError: the table is refused.
    """
    from ..errors import InputError, listing
    from ..words.summary import table_names

    if target is None and table is not None:
        raise InputError(f"--table {table}: needs --csv FILE")
    names = table_names(case, at_point=at_point)
    if table is not None and table not in names:
        raise InputError(f"--table {table}: must be one of {listing(names)}")


def show(items: Iterable[Line | TextTable], *, whole: bool) -> None:
    """Print lines and tables: everything, or the answer and the parts that fit."""
    from ..output.terminal import show as show_on

    show_on(console(), items, whole=whole)


def console() -> Console | None:
    """Return a console on standard output for lines and tables; None if standard output shows no styles."""
    # With one of these variables, the console itself decides whether it shows styles.
    if not sys.stdout.isatty() and not os.environ.keys() & {"FORCE_COLOR", "TTY_COMPATIBLE"}:
        return None
    from rich.console import Console

    from ..output.terminal import PLAIN_WIDTH

    width = None if sys.stdout.isatty() else PLAIN_WIDTH
    return Console(highlight=False, markup=False, emoji=False, width=width)

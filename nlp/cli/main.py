"""The command line: words in, words out, no mathematics.

Exit status: 0 done; 1 the answer is not what was asked for; 2 the input is wrong. What a command needs is imported when
it runs, so that help is there at once.
"""

from __future__ import annotations

import gc
import io
import json
import os
import sys
from dataclasses import replace
from functools import partial
from importlib import import_module
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rich.console import Console

    from ..case.case import Case
    from ..output.pictures.drawing import Drawing
    from ..solve.certified import Certified, CertifyOptions
    from ..solve.compromise import Compromise
    from ..solve.multistart import Solution

app = typer.Typer(
    name="screwsynth",
    help="Geometry and pose of a parallel robot for a given instantaneous screw motion.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)

CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case file, or the bare name of a shipped case.")]
PlotFile = Annotated[
    str | None, typer.Option("--plot", metavar="FILE", help="Draw the robot: a .png, .svg or .pdf file.")
]
JsonFile = Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is stdout.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"screwsynth {version('screwsynth')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command()
def solve(
    case: CaseName,
    starts: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Starting points instead of the case's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed instead of the case's.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; the result does not depend on it.")] = None,
    compiled: Annotated[
        bool, typer.Option("--compiled", help="Call the objective as compiled C; needs a C compiler.")
    ] = False,
    json_file: JsonFile = None,
    plot: PlotFile = None,
    certify: Annotated[
        bool, typer.Option("--certify", help="Prove the optimum too, to a gap of 1e-4; see certify.")
    ] = False,
) -> None:
    """Maximise or minimise F, and show the evidence."""
    from ..case.reader import load_case
    from ..solve.compromise import Compromise

    loaded = load_case(case)
    loaded = replace(loaded, search=loaded.search.but(starts, seed, compiled=compiled))
    _check_target(json_file)
    _check_picture(plot)
    if json_file != "-":
        # The library of tables loads while Ipopt works outside of the interpreter.
        Thread(target=import_module, args=("screwsynth.nlp.output.terminal",), daemon=True).start()
    solution, result, proved = _solved(loaded, jobs, certify=certify)
    if json_file is not None:
        _write_json(json_file, result)
    if plot is not None:
        from ..output.pictures.solutions import drawings_of

        _write_picture(plot, drawings_of(solution))
    if json_file != "-":
        from ..output.terminal import print_compromise, print_solution

        (print_compromise if isinstance(solution, Compromise) else print_solution)(_console(), loaded, result)
    raise typer.Exit(0 if solution.status.is_answer and proved else 1)


@app.command()
def report(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="FILE", help="Page to write, such as report.html; - is stdout.")],
    certify: Annotated[
        bool, typer.Option("--certify", help="Prove the optimum too, and show the proof's way.")
    ] = False,
    starts: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Starting points instead of the case's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed instead of the case's.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; the result does not depend on it.")] = None,
) -> None:
    """Solve a case and write a page about it: one file that opens without a network."""
    from ..case.reader import find_case, load_case
    from ..output.files import read_text, write_text
    from ..output.pictures.requirements import check_library

    loaded = load_case(case)
    text = read_text(str(find_case(case)))
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    _check_target(out)
    check_library("plotly", "reports")
    from ..output.report.report import report_of
    from ..output.report.webpage import page_of

    solution, result, proved = _solved(loaded, jobs, certify=certify)
    write_text(out, page_of(report_of(case, text, solution, result)))
    if out != "-":
        typer.echo(f"{out}: {result['status']}")
    raise typer.Exit(0 if solution.status.is_answer and proved else 1)


@app.command()
def certify(
    case: CaseName,
    gap: Annotated[float, typer.Option(help="Part of the best F that the bound may be off by.")] = 1e-4,
    time: Annotated[float | None, typer.Option(metavar="SECONDS", help="Stop then, with the bound reached.")] = None,
    above: Annotated[
        float | None, typer.Option(metavar="F", help="Prove that F is above this value on the whole box.")
    ] = None,
    proof: Annotated[str | None, typer.Option(metavar="FILE", help="Write the proof, for verify-proof.")] = None,
    starts: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Starting points for the incumbent instead of the case's.")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; the result does not depend on it.")] = None,
    json_file: JsonFile = None,
) -> None:
    """Prove a bound of the global optimum over the whole box."""
    from ..case.reader import find_case, load_case
    from ..errors import InputError
    from ..output.files import write_text
    from ..results.data import certified_of
    from ..solve.certified import CertifyOptions, proof_of

    if not 1e-10 <= gap < 1:
        raise InputError(f"--gap {gap:g}: must be at least 1e-10 and below 1")
    if time is not None and not time > 0:
        raise InputError(f"--time {time:g}: must be positive")
    if above is not None and not abs(above) < float("inf"):
        raise InputError(f"--above {above:g}: must be finite")
    if proof == "-" and json_file == "-":
        raise InputError("standard output can take one of --json - and --proof - only")
    loaded = load_case(case)
    loaded = replace(loaded, search=loaded.search.but(starts, None))
    for target in (json_file, proof):
        _check_target(target)
    wanted = CertifyOptions(gap, above, time, jobs)
    certified = _certify(loaded, wanted, with_proof=proof is not None)
    result = certified_of(certified)
    if proof is not None and certified.tree is not None:
        write_text(proof, proof_of(certified, find_case(case).read_text(encoding="utf-8")).as_text())
    if json_file is not None:
        _write_json(json_file, result)
    if "-" not in (json_file, proof):
        from ..output.terminal import print_certified

        print_certified(_console(), loaded, result)
    raise typer.Exit(0 if certified.is_proved else 1)


@app.command()
def verify_proof(
    proof: Annotated[str, typer.Argument(metavar="PROOF", help="A proof that certify --proof wrote.")],
    case: Annotated[
        str | None, typer.Argument(metavar="[CASE]", help="The case that it must be for; else the one it carries.")
    ] = None,
) -> None:
    """Check a proof anew, with nothing of what made it."""
    import tomllib

    from ..case.reader import case_from_tables, load_case
    from ..certificate.proof import ProofError, read_proof
    from ..certificate.proofcheck import check_proof
    from ..output.files import read_text
    from ..solve.certified import program_of

    given = read_proof(read_text(proof), proof)
    if case is not None:
        loaded = load_case(case)
    else:
        try:
            tables = tomllib.loads(given.case)
        except tomllib.TOMLDecodeError as error:
            raise ProofError(f"{proof}: the case that it carries is no TOML: {error}") from None
        loaded = case_from_tables(tables, name=given.name, source=proof)
    gc.enable()
    try:
        checked = check_proof(given, program_of(loaded, given.statement))
    except ProofError as error:
        typer.echo(f"rejected: {error}", err=True)
        raise typer.Exit(1) from None
    nlp = program_of(loaded, given.statement)
    what = "there is no feasible point"
    if given.bound is not None:
        what = f"F is at most {given.bound:.10g}" if nlp.sign < 0 else f"F is at least {-given.bound:.10g}"
    typer.echo(f"holds: {what} within the limits of {loaded.name}")
    typer.echo(f"{checked.leaves:,} leaves, shown on {checked.pieces:,} boxes")


@app.command()
def check(
    cases: Annotated[
        list[str] | None, typer.Argument(metavar="[CASE]...", help="All shipped cases if left out.")
    ] = None,
    json_file: JsonFile = None,
    junit: Annotated[str | None, typer.Option(metavar="FILE", help="Write JUnit XML for a CI; - is stdout.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the published numbers as a table.")] = False,
) -> None:
    """Hold cases to their expected and published values."""
    from ..case.reader import shipped_cases
    from ..errors import InputError
    from ..output import checks as checkreport
    from ..output.files import write_text
    from ..results.regression import check_case

    if [json_file, junit, "-" if markdown else None].count("-") > 1:
        raise InputError("standard output can take one of --json -, --junit - and --markdown only")
    for target in (json_file, junit):
        _check_target(target)
    gc.enable()
    solved: dict[str, dict[str, Any]] = {}
    checks = [check_case(name, solved) for name in cases or shipped_cases()]
    if json_file is not None:
        _write_json(json_file, checkreport.checks_as_data(checks))
    if junit is not None:
        write_text(junit, checkreport.checks_as_junit(checks))
    if markdown:
        typer.echo(checkreport.checks_as_markdown(checks), nl=False)
    elif "-" not in (json_file, junit):
        from ..output.terminal import print_checks

        print_checks(_console(), checks)
    raise typer.Exit(0 if all(each.passed for each in checks) else 1)


@app.command()
def evaluate(
    case: CaseName,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A number instead of the case's: x4=20, p_z=40, axis=0,0,1."),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """Show F, J, rank and rates at one point; nothing is optimised.

    What is free stands at its start, or in the middle of its range.
    """
    from ..case.reader import load_case
    from ..evidence import state as evaluation
    from ..evidence.kkt import assembled
    from ..program.epigraph import with_exact_level
    from ..program.formulation import formulate_each
    from ..results.data import evaluation_of

    loaded = load_case(case, dict(_setting(text) for text in settings or []))
    _check_target(json_file)
    nlps = formulate_each(loaded)
    x = with_exact_level(nlps[0], assembled(nlps[0], nlps[0].start))
    result = evaluation_of(nlps, x, [evaluation.evaluate(nlp, x) for nlp in nlps])
    if json_file is not None:
        _write_json(json_file, result)
    if json_file != "-":
        from ..output.terminal import print_state

        print_state(_console(), loaded, result)
    raise typer.Exit(1 if result["violated"] else 0)


@app.command()
def codegen(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="DIR", help="Folder to write into.")],
    language: Annotated[str, typer.Option(help="c is the only one.")] = "c",
    precision: Annotated[str, typer.Option(help="double is the only one.")] = "double",
) -> None:
    """Write F and its derivatives as C for embedding."""
    from ..case.reader import find_case, load_case
    from ..embedding.codegen import generate_c
    from ..errors import InputError
    from ..output.files import write_folder

    if language != "c":
        raise InputError(f"--language {language}: only c is generated")
    if precision != "double":
        raise InputError(
            f"--precision {precision}: only double is generated; in single precision, optimising over these functions "
            "was tried and fails"
        )
    loaded = load_case(case)
    files = generate_c(loaded, find_case(case).read_text(encoding="utf-8"))
    write_folder(out, files)
    typer.echo(f"{len(files)} files in {out}: make -C {out} test")


@app.command()
def models(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="One robot, in full.")] = None,
    plot: PlotFile = None,
) -> None:
    """List the robots, or show one with its parameters, options and wrenches."""
    from ...models import model_names
    from ..case.robots import build_model, model_options
    from ..errors import InputError
    from ..output.terminal import print_model, print_models

    _check_picture(plot)
    if name is None:
        if plot is not None:
            raise InputError(f"--plot {plot}: needs the name of a robot")
        print_models(_console(), [(each, _description(each)) for each in model_names()])
        return
    options = model_options(name)
    needed = [option for option, _, default in options if default is None]
    # Without the options that it cannot do without, a robot has no parameters to show yet.
    model = None if needed else build_model(name)
    if plot is not None:
        from ..output.pictures.drawing import drawing_of_model

        if model is None:
            raise InputError(f"--plot {plot}: robot {name!r} needs its option {needed[0]!r} first")
        _write_picture(plot, [drawing_of_model(model)])
    print_model(_console(), name, model, options)


@app.command()
def schema() -> None:
    """Print the JSON Schema of case files, with which editors complete and check."""
    from ..case.schema import Document

    typer.echo(json.dumps(Document.model_json_schema(), indent=2))


@app.command()
def new(model: Annotated[str, typer.Argument(metavar="MODEL", help="Name of a robot.")]) -> None:
    """Print a commented case file to begin with: screwsynth new stewart-gough > my-robot.toml."""
    from ..case.robots import build_model
    from ..case.starter import starter_case

    typer.echo(starter_case(build_model(model)), nl=False)


def main() -> None:
    """The command ``screwsynth``: run, and leave without taking the interpreter down.

    Every file is closed by then, and taking the numerical libraries down takes a tenth of a short command's time.
    """
    status = run()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # nobody reads any more
        status = status or 1
    os._exit(status)


def run() -> int:
    """Run the command line on ``sys.argv``; errors become one sentence on standard error.

    Returns:
        Exit status: 0 done; 1 the answer is not what was asked for; 2 the input is wrong; 130 interrupted.
    """
    from ..errors import ScrewsynthError

    # pydantic would look for plugins in every installed distribution: a tenth of a short command's time.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The matrices here are a dozen wide: BLAS threads would only cost their start and spin beside the solver's own.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Collecting garbage while modules are loaded finds none, and takes a twentieth of a short command's time.
    gc.disable()
    # Between two calls of Ipopt a thread needs the interpreter for a moment only, and must not wait long for it.
    sys.setswitchinterval(5e-4)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot show a letter of a title shows its escape instead.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    except ScrewsynthError as error:
        typer.echo(f"screwsynth: {error}", err=True)
        return 2
    except KeyboardInterrupt:
        typer.echo("screwsynth: interrupted", err=True)
        return 130
    finally:
        gc.enable()
    return 0


def _description(model: str) -> str:
    """What a robot is, or why it cannot be used: another package's fault must not hide the others."""
    from ..case.robots import build_model
    from ..errors import CaseError

    try:
        return build_model(model).description
    except CaseError as error:
        return error.fault


def _solved(case: Case, jobs: int | None, *, certify: bool) -> tuple[Solution | Compromise, dict[str, Any], bool]:
    """A case solved, its result as plain data, and whether what was to be proved is."""
    from ..results.data import compromise_of, result_of
    from ..solve.compromise import Compromise

    if certify:
        from ..solve.certified import CertifyOptions

        certified = _certify(case, CertifyOptions(jobs=jobs), with_proof=False)
        solution = certified.solution
        if isinstance(solution, Compromise):
            return solution, compromise_of(solution, certified.tasks, certified.combined), certified.is_proved
        return solution, result_of(solution, certificate=certified.tasks[0]), certified.is_proved
    solution = _solve(case, jobs)
    return solution, compromise_of(solution) if isinstance(solution, Compromise) else result_of(solution), True


def _solve(case: Case, jobs: int | None) -> Solution | Compromise:
    from ..solve.compromise import solve_tasks
    from ..solve.multistart import solve as solve_case

    gc.enable()
    several = len(case.tasks) > 1
    if not sys.stderr.isatty():
        return (solve_tasks if several else solve_case)(case, jobs=jobs)
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("starts", total=None)

        def show(what: str, done: int, total: int, best: float | None) -> None:
            best_text = "" if best is None else f", best {best:.7g}"
            bar.update(line, completed=done, total=total, description=f"{escape(what)}{best_text}")

        if several:
            return solve_tasks(case, jobs=jobs, progress=show)
        return solve_case(case, jobs=jobs, progress=partial(show, "starts"))


def _certify(case: Case, wanted: CertifyOptions, *, with_proof: bool) -> Certified:
    from ..solve.certified import certify_case

    gc.enable()
    if not sys.stderr.isatty():
        return certify_case(case, wanted, case.search, with_proof=with_proof)
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TextColumn

    columns = SpinnerColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("solving for an incumbent", total=None)

        def shown(name: str) -> Callable[[float, float, float, int, int], None]:
            def show(seconds: float, bound: float, incumbent: float, boxes: int, left: int) -> None:
                text = f"{escape(name)}: bound {bound:.7g}, best {incumbent:.7g}, gap {abs(bound - incumbent):.2g}"
                bar.update(line, description=f"{text}, {boxes:,} boxes, {left:,} left, {seconds:.0f} s")

            return show

        return certify_case(case, wanted, case.search, with_proof=with_proof, progress=shown)


def _setting(text: str) -> tuple[str, float | list[float]]:
    from ..errors import InputError

    name, equals, value = (part.strip() for part in text.partition("="))
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if not (name and equals and numbers):
        raise InputError(f"--set {text}: must be NAME=NUMBER, or axis=X,Y,Z")
    return name, numbers[0] if len(numbers) == 1 else numbers


def _check_target(target: str | None) -> None:
    from ..output.files import check_target

    if target is not None:
        check_target(target)


def _check_picture(target: str | None) -> None:
    if target is not None:
        from ..output.pictures.requirements import check_picture

        check_picture(target)
        _check_target(target)


def _write_picture(target: str, drawings: Sequence[Drawing]) -> None:
    from ..output.files import write_bytes
    from ..output.pictures.figures import picture
    from ..output.pictures.requirements import ending_of

    write_bytes(target, picture(drawings, ending_of(target)))


def _write_json(target: str, result: dict[str, Any]) -> None:
    from ..output.files import write_text

    write_text(target, json.dumps(result, indent=2, allow_nan=False) + "\n")


def _console() -> Console:
    from rich.console import Console

    # Into a file or a pipe, tables are as wide as they need to be.
    return Console(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else 120)

"""Display of robots, cases, solutions and certificates in notebooks, as HTML, text and pictures."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console

from ...models import Dimension, FloatArray, Model, component_names
from ..case.case import Case
from ..case.choices import catalogue_dimensions, values_of_component, within_ranges
from ..case.limits.limits import Limits
from ..case.pose import NO_DISPLACEMENT, Free, Value
from ..errors import CaseError, EvaluationError, InputError
from ..evidence.state import evaluate
from ..program.formulation import formulate_each
from ..program.nlp import Nlp
from ..proof.certificate.certificate import Certificate
from ..results.evidence import certificate_data
from ..results.point import task_data
from ..results.result import result_of
from ..solver.certified import Certified
from ..solver.solution import Solution
from ..words.lines import certificate_lines, task_lines, title_line
from ..words.models import model_words
from ..words.numbers import number
from ..words.robot import free_words
from ..words.summary import case_summary
from ..words.text import Line, TextTable
from .pictures.drawing import Drawing, drawing_of, drawing_of_model
from .pictures.requirements import check_library
from .pictures.solutions import drawings_of
from .report.markup import image_source, join_markup, paragraphs, tag
from .report.tables import html_table
from .terminal import show

#: Width of a text in columns, as the command line writes it into a file.
_WIDTH = 80


@dataclass(frozen=True)
class Picture:
    """Picture for a notebook.

    Attributes:
        svg: content of the picture as SVG.
    """

    svg: str

    def __repr__(self) -> str:
        return f"<Picture: SVG of {len(self.svg)} characters>"

    def _repr_svg_(self) -> str:
        return self.svg


def text_of(solution: Solution | Certified, width: int = _WIDTH) -> str:
    """Return the tables of a solution as text, as ``solve --all`` prints them.

    Args:
        solution: solution, or solution with certificates.
        width: width of the text in columns.
    """
    out = io.StringIO()
    case = (solution if isinstance(solution, Solution) else solution.solution).case
    # In a notebook, rich would show its lines at once instead of writing them to the file.
    plain = Console(
        file=out, width=width, color_system=None, force_jupyter=False, highlight=False, markup=False, emoji=False
    )
    show(plain, case_summary(case, result_of(solution)))
    return "".join(f"{line.rstrip()}\n" for line in out.getvalue().splitlines())


def picture_of(subject: Solution | Model) -> Picture:
    """Return the drawing of the robot of a solution with its tasks, or of a robot at its typical dimensions.

    Raises:
        InputError: Matplotlib is not installed.
        EvaluationError: the robot does not exist at the final point of the solve, or at its typical dimensions.
    """
    return _picture([drawing_of_model(subject)] if isinstance(subject, Model) else drawings_of(subject))


def html_of(value: object) -> str | None:
    """Return tables and a drawing of a value as HTML for a notebook; None for a value of any other type.

    Without Matplotlib, or if the robot does not exist, a sentence replaces the drawing.

    Args:
        value: robot, case, solution, or certificate.
    """
    if isinstance(value, Model):
        return _html(model_words(value.name, value, []), lambda: [drawing_of_model(value)])
    if isinstance(value, Case):
        return _html(_case_words(value), lambda: _drawings_at_start(value))
    if isinstance(value, Solution | Certified):
        solution = value if isinstance(value, Solution) else value.solution
        return _html(case_summary(solution.case, result_of(value)), lambda: drawings_of(solution))
    if isinstance(value, Certificate):
        words = [title_line(value.nlp.case), *certificate_lines(certificate_data(value))]
        return _html(words, lambda: [] if value.x is None else [_drawing_at(value.nlp, value.x, "best known point")])
    return None


def _html(items: Iterable[Line | TextTable], drawings: Callable[[], Sequence[Drawing]]) -> str:
    """Return lines, tables and a drawing as HTML."""
    parts = [paragraphs([item]) if isinstance(item, Line) else html_table(item, "") for item in items]
    try:
        found = drawings()
        source = image_source(_picture(found).svg.encode("utf-8")) if found else ""
        parts.append(tag("img", src=source, alt="the robot") if found else tag("p"))
    except (InputError, EvaluationError) as error:
        parts.append(tag("p", str(error)))
    return tag("div", join_markup(parts))


def _picture(drawings: Sequence[Drawing]) -> Picture:
    """Return drawings as a picture.

    Raises:
        InputError: Matplotlib is not installed.
    """
    check_library("matplotlib", "pictures")
    from .pictures.figures import picture  # noqa: PLC0415 - needs Matplotlib, whose absence is reported above

    return Picture(picture(drawings, ".svg").decode("utf-8"))


def _case_words(case: Case) -> Iterable[Line | TextTable]:
    """Yield lines and a table of a case: title, tasks, parameters, pose, and limits."""
    yield title_line(case)
    for index in range(len(case.tasks)):
        yield from task_lines(task_data(case, index), case.units)
    rows = []
    for item in case.model.parameters:
        for k in range(len(item.components)):
            rows += [_row(case, each.name, each.value, item.dimension) for each in values_of_component(case, item, k)]
    for prefix, pose in zip(case.pose_prefixes, case.poses, strict=True):
        names = component_names(f"{prefix}p", 3)
        rows += [_row(case, *each, Dimension.LENGTH) for each in zip(names, pose.position, strict=True)]
        axis = pose.rotation.axis
        shown = "free" if axis is None else "  ".join(number(float(part)) for part in np.asarray(axis))
        rows.append((f"{prefix}axis", shown, ""))
        rows.append(_row(case, f"{prefix}angle", pose.rotation.angle, Dimension.ANGLE))
    yield TextTable(("", "value or bounds", "unit"), tuple(rows))
    if case.limits:
        yield Line(", ".join(limit.name for limit in case.limits), label="limits")
    if case.pose_count > 1:
        yield Line(str(case.pose_count), label="poses")


def _row(case: Case, name: str, value: Value, dimension: Dimension) -> tuple[str, str, str]:
    units = case.units
    if isinstance(value, Free):
        return name, free_words(value, units, dimension, 7), units.label(dimension)
    return name, f"{units.shown(value, dimension):.7g}", units.label(dimension)


def _drawings_at_start(case: Case) -> list[Drawing]:
    """Return the robot of a case with each of its tasks, at the first starting point and the first pose.

    Raises:
        EvaluationError: the robot does not exist there.
    """
    # Limits and further poses do not change the drawing, but take time.
    numbers = catalogue_dimensions(case)
    case = within_ranges(case, numbers, tuple((0, 1) for _ in numbers))
    parts = [case.of_task(k) for k in range(len(case.tasks))] if case.changes else [case]
    steps = (NO_DISPLACEMENT,)
    plain = [
        replace(part, limits=Limits(), displacements=steps, further=(), joint_centre_tolerance=None) for part in parts
    ]
    try:
        nlps = [nlp for part in plain for nlp in formulate_each(part)]
    except CaseError as error:
        raise EvaluationError(str(error)) from None
    return [
        _drawing_at(nlp, nlp.start, "first starting point", min(task, len(nlp.case.tasks) - 1))
        for task, nlp in enumerate(nlps)
    ]


def _drawing_at(nlp: Nlp, x: FloatArray, where: str, task: int = 0) -> Drawing:
    """Return the drawing of the robot at a point of a nonlinear program.

    Args:
        nlp: nonlinear program of a case.
        x: (n,) point.
        where: name of the point for the heading.
        task: index of the task in the case.

    Raises:
        EvaluationError: the robot does not exist there.
    """
    state = evaluate(nlp, x)
    return drawing_of(nlp, x, state, task, headline=f"{where}: F = {nlp.evaluate(x).F:.7g}")

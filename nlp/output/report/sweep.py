"""A sweep as a page of HTML."""

from __future__ import annotations

import numpy as np

from ...case.case import Case
from ...program.formulation import formulate
from ...results.objective import unit_of_objective
from ...results.rounding import number
from ...results.tables import sizes_of_variables
from ...results.text import TextTable
from ...sweeps.columns import SweepColumns, stated_pose_note
from ...sweeps.points import Points
from ..pictures.figures import picture_of
from ..pictures.sweeps import sweep_figure, sweep_legend
from ..sweeptable import TablePoint
from .markup import answer_box, html_table, join_markup, paragraphs, picture_figure, tag, whole_page

#: Rows of the table on a page; a browser is slow with many more, and the table's file has all.
_ROWS = 500


def sweep_page(case: Case, points: Points, found: SweepColumns) -> str:
    """Return a whole page about a sweep, which opens without a network.

    Args:
        case: the case at one of the points.
        points: of the sweep.
        found: the answers.
    """
    title = case.title or case.name
    answers = int(np.isfinite(found.F).sum())
    words = f"{answers:,} of {len(found):,} points have an answer"
    proved = found.certificate.count("proved")
    if any(found.certificate):
        words += f", {proved:,} of them with a proof"
    notice = stated_pose_note(case, found.note)
    parts = [tag("h2", "F over the points"), paragraphs([] if notice is None else [f"Note: {notice}."])]
    changing = [axis for axis in points.axes if len(axis) > 1]
    if 1 <= len(changing) <= 2 and answers:
        sides = [TablePoint(float(F), "; ".join(active)) for F, active in zip(found.F, found.active, strict=True)]
        picture = picture_of(".svg", sweep_figure, case, points, sides, legend=())
        parts.append(picture_figure(picture, "F at each point. Numbers: the limits that are active in a region."))
        parts.append(tag("ul", *(tag("li", line) for line in sweep_legend(sides)), class_="plain"))
    else:
        parts.append(paragraphs(["A picture needs a grid over one or two numbers."]))
    if len(found) > _ROWS:
        parts.append(paragraphs([f"The first {_ROWS} points; the table's file has all {len(found):,}."]))
    parts.append(html_table(_table(case, found), "points", id="swept"))
    return whole_page(
        f"{title} - sweep",
        f"{case.name}, robot {case.model.name}, over {', '.join(points.names)}",
        answer_box([f"{words}."], is_answer=bool(answers)),
        tag("section", join_markup(parts)),
    )


def _table(case: Case, found: SweepColumns) -> TextTable:
    """Return the first points as a table: numbers, status, F, its proof, the design and its active limits."""
    unit, is_proved = unit_of_objective(case), any(found.certificate)
    headers = ["point", *found.numbers, "status", f"F\n{unit}" if unit else "F"]
    headers += ["certificate", "gap"] if is_proved else []
    headers += [*found.design, "active"]
    nlp, rows = formulate(case), []
    names = [each.name for each in nlp.program.variables]
    sizes = dict(zip(names, sizes_of_variables(nlp), strict=True))
    for k in range(min(len(found), _ROWS)):
        row = [str(k), *(number(values[k]) for values in found.numbers.values()), found.status[k], _text(found.F[k])]
        row += [found.certificate[k], _text(found.gap[k])] if is_proved else []
        row += [_text(values[k], sizes.get(name, 0.0)) for name, values in found.design.items()]
        rows.append((*row, ", ".join(found.active[k]) or found.note[k]))
    return TextTable(tuple(headers), tuple(rows))


def _text(value: float, size: float = 0.0) -> str:
    return number(value, size) if np.isfinite(value) else ""

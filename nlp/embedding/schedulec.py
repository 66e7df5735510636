"""C of the next step along a tool path: tables of the value of each setting with all further points, and the schedule.

A controller that takes the best reachable setting at each point may run into limits later. The tables look ahead: the
value of a setting at a point counts this point and the best continuation,

    V_i(m) = f_i(m) + max { V_(i+1)(m') : |m' - m| <= w_i }

with ``min`` in place of ``+`` for the worst point. A disturbed controller takes the reachable setting with the largest
value. Settings of the table keep all limits at the points; values between them are interpolated.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...models import Dimension, FloatArray
from ..case.case import Case
from ..errors import CaseError, listing
from ..solver.schedule.dynamic import sliding_maximum
from ..solver.schedule.formulation import schedule_problem
from ..solver.schedule.problem import ScheduleProblem
from ..system.markdown import markdown_text
from .ctext import comment_text, identifier
from .templates import fill_template

#: Largest number of points, and of values of the setting.
MOST_POINTS, _MOST_VALUES = 1000, 601
#: Smallest number of values, and number of steps between values that the rate allows between two points.
_FEWEST_VALUES, _STEPS = 101, 4
#: Value of a setting that violates a limit, now or at a later point.
FORBIDDEN = -1e30
_FILES = ("selftest.c", "Makefile", "README.md")


class StepTables(NamedTuple):
    """Tables of the steps along a path, for one setting.

    Attributes:
        values: (M,) values of the setting.
        ahead: (N, M) value of each setting at each point with its best continuation; minus infinity if each
            continuation violates a limit.
        schedule: (N,) the best schedule of grid values.
        mean: objective of this schedule.
    """

    values: FloatArray
    ahead: FloatArray
    schedule: FloatArray
    mean: float


def schedule_c(case: Case, source: str) -> dict[str, str]:
    """Return the files of a folder with the C of the next step along the path of a case.

    Args:
        case: case with fixed dimensions and one value that changes along its path.
        source: text of the case file, which goes into the folder as ``case.toml``.

    Raises:
        CaseError: a dimension is free, not exactly one value changes, or no schedule keeps the limits.
        InputError: the path cannot be read.
    """
    problem = schedule_problem(case)
    tables = step_tables(problem)
    setting, prefix = problem.settings[0], identifier(case.name)
    rate = math.inf if setting.rate is None else setting.rate
    unit = {Dimension.ANGLE: "rad", Dimension.LENGTH: case.units.length}.get(setting.dimension, "1")
    names = {
        "id": prefix,
        "ID": prefix.upper(),
        "title": comment_text(case.title or case.name),
        "name": setting.name,
        "unit": comment_text(unit),
        "points": str(len(problem.points)),
        "values": str(len(tables.values)),
        "lower": repr(setting.lower),
        "upper": repr(setting.upper),
        "rate": repr(rate) if math.isfinite(rate) else "1e30",
        "forbidden": repr(FORBIDDEN),
        "times": _row(problem.points.times - problem.points.times[0]),
        "schedule": _row(tables.schedule),
        "ahead": ",\n    ".join(f"{{{_floats(row)}}}" for row in tables.ahead),
        "objective": "worst" if problem.is_worst else "mean",
        "value": f"{problem.sign * tables.mean:.9g}",
    }
    files = {f"{prefix}-schedule{end}": fill_template(f"schedule/schedule{end}.in", names) for end in (".h", ".c")}
    files |= {name: fill_template(f"schedule/{name}.in", names) for name in _FILES[:2]}
    title = markdown_text(" ".join((case.title or case.name).split()))
    files[_FILES[2]] = fill_template("schedule/README.md.in", {**names, "title": title})
    return {**files, "case.toml": source}


def step_tables(problem: ScheduleProblem) -> StepTables:
    """Return the tables of the steps along a path; a setting on the grid is allowed only if it keeps all limits.

    Raises:
        CaseError: a dimension is free, not exactly one value changes, or no schedule keeps the limits.
    """
    case, count = problem.case, len(problem.points)
    _check(problem)
    setting = problem.settings[0]
    steps = problem.steps[:, 0]
    span, typical = setting.upper - setting.lower, float(np.median(steps))
    # A whole number of steps of the grid is just within the rate, so that the tables waste little of it.
    wanted = [math.ceil(k * span / typical) + 1 for k in range(1, _STEPS + 1)] if typical < span else [_FEWEST_VALUES]
    fitting = [max(each, _FEWEST_VALUES) for each in wanted if each <= _MOST_VALUES]
    values = np.linspace(setting.lower, setting.upper, max(fitting, default=_MOST_VALUES))
    size = len(values)
    found = problem.at(np.zeros(0), np.tile(values, count)[:, None], np.repeat(np.arange(count), size).tolist())
    own = problem.combined(found.objective).reshape(count, size)
    allowed = (found.excess.reshape(count, size, -1) <= 0).all(axis=2) & np.isfinite(own)
    gain = np.where(allowed, own if problem.is_worst else own * problem.points.weights[:, None], -np.inf)
    reach = np.minimum(np.floor(steps / (values[1] - values[0])), size).astype(int)
    if (reach < 1).any():
        fault = "is too small for the tables: between two points the setting hardly changes; take fewer points"
        raise CaseError(f"{setting.name}.rate", fault, source=case.source)
    ahead = gain.copy()
    for i in range(count - 2, -1, -1):
        further = sliding_maximum(ahead[i + 1], int(reach[i]))
        ahead[i] = np.minimum(gain[i], further) if problem.is_worst else gain[i] + further
    if not np.isfinite(ahead[0]).any():
        fault = f"no schedule on a grid of {size} values keeps all limits at the {count} points"
        raise CaseError(f"{setting.name}", fault, source=case.source)
    chosen = [int(ahead[0].argmax())]
    for i in range(1, count):
        low = max(chosen[-1] - int(reach[i - 1]), 0)
        chosen.append(low + int(ahead[i, low : chosen[-1] + int(reach[i - 1]) + 1].argmax()))
    return StepTables(values, ahead, values[chosen], float(ahead[0].max()))


def _check(problem: ScheduleProblem) -> None:
    """Refuse a problem with free dimensions, another number of settings, or too many points.

    Raises:
        CaseError: the problem is not supported.
    """
    case, count = problem.case, len(problem.points)
    if problem.design:
        fault = "is free, and codegen of a schedule needs fixed dimensions: give it with --set"
        raise CaseError(problem.design[0].name, fault, source=case.source)
    if len(problem.settings) != 1:
        names = listing(each.name for each in problem.settings)
        fault = f"codegen has tables for one value that changes along the path; this case has {len(problem.settings)}"
        raise CaseError("path", f"{fault}: {names}", source=case.source)
    if problem.is_periodic:
        raise CaseError("path.periodic", "is not supported by codegen", source=case.source)
    if count > MOST_POINTS:
        raise CaseError("path", f"codegen has tables for at most {MOST_POINTS} points, got {count}", source=case.source)


def _row(values: FloatArray) -> str:
    """Return numbers of C in double precision."""
    return ", ".join(repr(float(value)) for value in values)


def _floats(values: FloatArray) -> str:
    """Return numbers of C in single precision; forbidden values are large and negative."""
    texts = (f"{value:.9g}" for value in _finite(values))
    return ", ".join(f"{text}f" if "." in text or "e" in text else f"{text}.0f" for text in texts)


def _finite(values: FloatArray) -> list[float]:
    return [value if math.isfinite(value) else FORBIDDEN for value in values.tolist()]

"""Points of a sweep: a grid of lists and ranges, or the rows of a CSV file; and the case at each point."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..case.csvrows import csv_rows, number_table
from ..case.overrides import Settings
from ..case.reader import CaseFile, case_from_tables
from ..errors import InputError
from ..system.slips import hint_of

#: Largest number of points: their values and positions in the journal then need less than a gigabyte.
MOST_POINTS = 10_000_000
#: Number of evenly spread points that are read, in addition to those with extreme values.
_BETWEEN = 3
_FORMS = "NAME=FIRST:LAST:COUNT or NAME=V1,V2,..., such as x1=10:14:41"


class PointBlock(NamedTuple):
    """Block of points: indices, varied values (N, m), seconds until the end, and seconds for the proof of one point."""

    indices: Sequence[int]
    values: FloatArray
    seconds: float = math.inf
    proof_seconds: float = math.inf


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a sweep.

    Attributes:
        names: m names of the varied parameters, bounds and limits, as for ``--set``.
        values: (N, m) varied values, in the case's units.
        axes: values of each name on a grid; empty for the rows of a file.
    """

    names: tuple[str, ...]
    values: FloatArray
    axes: tuple[FloatArray, ...] = ()

    def __len__(self) -> int:
        return len(self.values)

    def settings(self, k: int) -> dict[str, float | list[float]]:
        """Return the values of point k by name."""
        return dict(zip(self.names, self.values[k].tolist(), strict=True))

    def chosen(self) -> Points:
        """Return the points with the smallest and the largest value of each name, and some intermediate points.

        A case allows an interval of values: if it allows these points, it allows almost all others.
        """
        ends = {int(f(column)) for column in self.values.T for f in (np.argmin, np.argmax)}
        rows = sorted(ends | {int(k) for k in np.linspace(0, len(self) - 1, _BETWEEN)})
        return Points(self.names, self.values[rows])


def grid(texts: Sequence[str]) -> Points:
    """Return the grid of one or more ranges and lists; the last name varies fastest.

    Args:
        texts: texts of the form ``NAME=FIRST:LAST:COUNT`` or ``NAME=V1,V2,...``.

    Raises:
        InputError: a text does not have this form, a name occurs twice, or there are too many points.
    """
    read = [_read_axis(text) for text in texts]
    return grid_of(tuple(name for name, _ in read), [values for _, values in read])


def grid_of(names: tuple[str, ...], axes: Sequence[FloatArray]) -> Points:
    """Return the grid of values (k,) of each name; the last name varies fastest.

    Raises:
        InputError: a name occurs twice, or there are too many points.
    """
    _check_names(names, "--over")
    count = math.prod(map(len, axes))
    if count > MOST_POINTS:
        raise InputError(f"--over: {count:,} points are too many; at most {MOST_POINTS:,} are allowed")
    values = np.stack([each.ravel() for each in np.meshgrid(*axes, indexing="ij")], axis=1)
    return Points(names, frozen_array(values, values.shape), tuple(axes))


def points_of_csv(text: str, source: str) -> Points:
    """Return the points of a CSV file, whose first row has the names.

    Args:
        text: text of the file.
        source: name of the file for messages.

    Raises:
        InputError: the file has no points, a row has not one cell for each name, or a value is not a finite number.
    """
    records = csv_rows(text, source)
    _, names = next(records, (0, []))
    if not names:
        raise InputError(f"{source}: is empty: the first row must have the names of the varied values")
    _check_names(names, source)
    table = number_table(islice(records, MOST_POINTS + 1), names, source)
    if not 1 <= len(table.rows) <= MOST_POINTS:
        few = "has 0 points: a row of values must follow the names"
        raise InputError(f"{source}: {f'has more than {MOST_POINTS:,} points' if len(table.rows) else few}")
    for name, column in table.columns.items():
        table.refuse(~np.isfinite(column), name, "must be finite")
    values = np.stack(list(table.columns.values()), axis=1)
    return Points(tuple(names), frozen_array(values, values.shape))


def _read_axis(text: str) -> tuple[str, FloatArray]:
    """Return name and values of one range or list; errors as for :func:`grid`."""
    name, equals, right = (part.strip() for part in text.partition("="))
    if not (name and equals and right):
        raise InputError(f"--over {text}: must be {_FORMS}")
    parts = right.split(":")
    if len(parts) == 1:
        values = [_number(part, f"--over {text}: value") for part in right.split(",")]
        if len(set(values)) < len(values):
            raise InputError(f"--over {text}: contains a value twice; the values must be different")
        return name, np.array(values)
    if len(parts) != 3:
        raise InputError(f"--over {text}: must be {_FORMS}")
    first, last = (_number(part, f"--over {text}: {end}") for part, end in zip(parts, ("FIRST", "LAST"), strict=False))
    try:
        count = int(parts[2])
    except ValueError:
        count = 0
    if not 1 <= count <= MOST_POINTS:
        raise InputError(f"--over {text}: COUNT = {parts[2].strip()} must be a whole number from 1 to {MOST_POINTS:,}")
    if (first == last) != (count == 1):
        fault = "COUNT must be 2 or more, because FIRST and LAST differ" if count == 1 else "FIRST and LAST must differ"
        raise InputError(f"--over {text}: {fault}; for a single value write NAME=VALUE")
    if count == 1:
        return name, np.array([first])
    # Both ends, and round values between them, are exact.
    steps = np.arange(count)
    with np.errstate(over="ignore"):  # the case refuses a value that is too large
        along = (first * (count - 1 - steps) + last * steps) / (count - 1)
    along[0], along[-1] = first, last
    return name, along


def _check_names(names: Sequence[str], source: str) -> None:
    """Refuse names that are empty or occur twice.

    Raises:
        InputError: a name is empty or occurs twice.
    """
    if not all(names):
        raise InputError(f"{source}: name {list(names).index('') + 1} is empty")
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(f"{source}: {twice} is given twice; each name must occur once")


def _number(text: str, where: str) -> float:
    """Return a finite number.

    Raises:
        InputError: the text is not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where} = {text.strip()!r}: must be a finite number{hint_of(text)}")
    return value


class CaseSource(NamedTuple):
    """Case as text that needs no other file.

    Attributes:
        text: text in TOML.
        name: name of the case in results.
        source: name of the case file in messages.
    """

    text: str
    name: str
    source: str

    @classmethod
    def from_file(cls, read: CaseFile) -> CaseSource:
        """Return the source of a case that was read from a file."""
        return cls(read.text, read.case.name, read.case.source or read.case.name)

    def case_at(self, settings: Settings) -> Case:
        """Return the case with values replaced by name.

        Raises:
            CaseError: a name is unknown in the case, or a value is not allowed.
        """
        return case_from_tables(tomllib.loads(self.text), name=self.name, source=self.source, settings=settings)

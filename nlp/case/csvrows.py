"""Poses and tasks from CSV files: each row becomes the table that a case file would have.

The first row names the columns. Numbers are fixed, and in the units of the case. A fault is told with the file, the row
as a spreadsheet counts it, and the column. Files of paths have the columns of poses too, and are read by the same
functions, and so are the points of a sweep.
"""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.values import dataclass
from ..errors import CaseError, InputError, listing, nearest

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest size of a file, bytes, and the largest number of its rows: what is larger is no trajectory of a case.
_MOST_BYTES, _MOST_ROWS = 4_000_000, 1_000
#: The same where poses are no part of a case, and nothing is optimised.
_MOST_BYTES_APART, _MOST_ROWS_APART = 64_000_000, 200_000

#: Columns of one number of a table, or of several that stand or lack together, by key within the table.
_Columns = Mapping[str, tuple[str, ...]]


class RowKind(NamedTuple):
    """What rows of a file become.

    Attributes:
        key: of the tables in a case file.
        needed: columns that every file has.
        others: columns that a file may have.
        words: columns of text.
        alternatives: keys of which a file has the columns of one only.
        nested: key within a table, below which all but the needed columns stand; empty for none.
    """

    key: str
    needed: _Columns
    others: _Columns
    words: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, ...], ...] = ()
    nested: str = ""

    @property
    def columns(self) -> list[str]:
        """Every column."""
        return [column for part in (self.needed, self.others) for names in part.values() for column in names]


#: Rows that are poses.
POSE_ROWS = RowKind(
    "pose",
    needed={"position": ("x", "y", "z")},
    others={
        "rpy": ("roll", "pitch", "yaw"),
        "quaternion": ("qw", "qx", "qy", "qz"),
        "axis": ("axis_x", "axis_y", "axis_z"),
        "angle": ("angle",),
    },
    alternatives=(("rpy",), ("quaternion",), ("axis", "angle")),
    nested="rotation",
)
#: By the key that names the file.
_KINDS: Mapping[str, RowKind] = {
    "poses": POSE_ROWS,
    "tasks": RowKind(
        "task",
        needed={"sense": ("sense",)},
        others={
            "name": ("name",),
            "weight": ("weight",),
            "axis": ("axis_x", "axis_y", "axis_z"),
            "point": ("point_x", "point_y", "point_z"),
            "pitch": ("pitch",),
            "twist": ("omega_x", "omega_y", "omega_z", "v_x", "v_y", "v_z"),
        },
        words=("sense", "name"),
        alternatives=(("axis", "point", "pitch"), ("twist",)),
    ),
}


@dataclass(frozen=True)
class _Source:
    """Where the tables of a key come from.

    Attributes:
        file: name of the file.
        rows: number of each row in the file, as a spreadsheet counts.
        columns: columns of each key within a table.
        nested: key within a table, below which some keys stand.
    """

    file: str
    rows: tuple[int, ...]
    columns: _Columns
    nested: str


@dataclass(frozen=True)
class TableOrigins:
    """Where the poses and tasks of a document come from, for messages.

    Attributes:
        sources: by key of the tables, ``pose`` or ``task``; none for those of the case file itself.
    """

    sources: Mapping[str, _Source] = field(default_factory=dict)

    def error_in(self, error: CaseError, document: str) -> CaseError:
        """Return an error with the name of its file: a CSV file, with row and column, or the document.

        Args:
            error: the error.
            document: name of the case file.
        """
        found = re.fullmatch(r"(\w+)(?:\[(\d+)\])?(?:\.(.+))?", error.key)
        source = None if found is None else self.sources.get(found[1])
        if found is None or source is None:
            return error.within(document)
        row, key = source.rows[int(found[2] or 0)], found[3] or ""
        parts = re.fullmatch(r"(\w+)(?:\[(\d+)\])?.*", key.removeprefix(f"{source.nested}."))
        columns = () if parts is None else source.columns.get(parts[1], ())
        if parts is not None and parts[2] is not None and int(parts[2]) < len(columns):
            columns = (columns[int(parts[2])],)
        where = (
            f", column{'s' if len(columns) > 1 else ''} {listing(columns)}" if columns else f", {key}" if key else ""
        )
        return CaseError(f"row {row}{where}", error.fault, error.value, source.file)


def named_csv_files(tables: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the CSV files that a document names.

    Args:
        tables: the document, as ``tomllib`` returns it.
        folder: folder of the document, beside which the files are.
    """
    files = (tables.get(name) for name in _KINDS)
    return tuple(folder / file for file in files if isinstance(file, str))


def insert_rows(tables: dict[str, Any], folder: Path) -> TableOrigins:
    """Put the rows of the CSV files that a document names in the places of their names.

    Args:
        tables: the document, as ``tomllib`` returns it; ``poses`` and ``tasks`` become ``pose`` and ``task``.
        folder: folder of the document, beside which the files are.

    Raises:
        CaseError: a document has poses or tasks in two ways, or a file cannot be read or has a fault.
        InputError: a file is no table at all.
    """
    sources = {}
    for name, kind in _KINDS.items():
        file = tables.get(name)
        if name not in tables or not isinstance(file, str):
            continue  # the schema refuses what is no name
        if kind.key in tables:
            raise CaseError(name, f"cannot stand beside [[{kind.key}]]; state the {name} in one way", file)
        found, sources[kind.key] = _read_rows(file, folder, kind, name)
        # In the place of the name, so that tables keep their order.
        items = [(kind.key, found) if key == name else (key, value) for key, value in tables.items()]
        tables.clear()
        tables.update(items)
    return TableOrigins(sources)


def pose_tables(file: str, option: str) -> tuple[list[dict[str, Any]], TableOrigins, tuple[int, ...]]:
    """Return the tables of the poses of a file that no case names, where they come from, and the number of each row.

    Args:
        file: its name.
        option: that names it, for messages.

    Raises:
        CaseError: the file cannot be read, or has a fault.
        InputError: the file is no table at all.
    """
    most = _MOST_BYTES_APART, _MOST_ROWS_APART
    tables, source = _read_rows(file, Path(), POSE_ROWS, option, *most)
    return tables, TableOrigins({"pose": source}), source.rows


def _read_rows(
    file: str, folder: Path, kind: RowKind, name: str, most_bytes: int = _MOST_BYTES, most_rows: int = _MOST_ROWS
) -> tuple[list[dict[str, Any]], _Source]:
    """Return the tables of a file's rows, and where they come from.

    Raises:
        CaseError: the file cannot be read, or has a fault.
        InputError: the file is no table at all.
    """
    records = list(csv_rows(_text_of(folder / file, file, name, most_bytes), file))
    if len(records) < 2:
        raise InputError(f"{file}: has no rows below a row that names the columns")
    if len(records) - 1 > most_rows:
        raise InputError(f"{file}: has {len(records) - 1} rows, of which at most {most_rows} are allowed")
    (top, header), *body = records
    columns = check_header(header, kind, lambda fault: CaseError(f"row {top}", fault, source=file))
    tables = [_table_of(number, record, header, columns, kind, file) for number, record in body]
    return tables, _Source(file, tuple(number for number, _ in body), columns, kind.nested)


def csv_rows(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of every row that is not empty, without the spaces around them, and its number.

    Args:
        text: of the file; commas or semicolons separate its cells.
        file: its name, for messages.

    Raises:
        InputError: the text is no table at all.
    """
    import csv  # noqa: PLC0415 - most cases name no files

    lines = io.StringIO(text, newline="")
    first = next((line for line in lines if line.strip()), "")
    lines.seek(0)
    records = csv.reader(lines, delimiter=";" if ";" in first and "," not in first else ",")
    try:
        for number, record in enumerate(records, 1):
            cells = [cell.strip() for cell in record]
            if any(cells):
                yield number, cells
    except csv.Error as error:
        raise InputError(f"{file}: is not CSV: {error}") from None


def _number_in(text: str, row: int, column: str, file: str) -> float:
    """Return the number of a cell.

    Raises:
        CaseError: the cell holds none.
    """
    try:
        return float(text)
    except ValueError:
        from ..system.slips import hint_of  # noqa: PLC0415 - only messages need it

        fault = f"must be a number{hint_of(text)}" if text else "is empty; it must be a number"
        raise CaseError(f"row {row}, column {column}", fault, text or None, file) from None


class NumberTable(NamedTuple):
    """Numbers of a file.

    Attributes:
        source: name of the file.
        rows: (n,) numbers of the rows, as a spreadsheet counts.
        columns: (n,) numbers of each column, by its name.
    """

    source: str
    rows: NDArray[np.int32]
    columns: Mapping[str, FloatArray]

    def block(self, names: str) -> FloatArray:
        """Return columns (n, k) by their names, which spaces separate."""
        return np.stack([self.columns[name] for name in names.split()], axis=1)

    def refuse(self, is_wrong: NDArray[np.bool_], name: str, fault: str) -> None:
        """Refuse the first row at which something is wrong.

        Args:
            is_wrong: (n,) whether it is, at each row.
            name: of the columns, for messages.
            fault: the fault, in words.

        Raises:
            CaseError: there is such a row.
        """
        if is_wrong.any():
            at = int(np.argmax(is_wrong))
            value = float(self.columns[name][at]) if name in self.columns else None
            raise CaseError(f"row {self.rows[at]}, column{'s' * (value is None)} {name}", fault, value, self.source)


def number_table(
    records: Iterable[tuple[int, list[str]]], header: list[str], file: str, left_out: Sequence[Mapping[int, str]] = ()
) -> NumberTable:
    """Return the numbers of a file.

    Args:
        records: rows below the one that names the columns, with their numbers.
        header: names of the columns.
        file: name of the file, for messages.
        left_out: cells in the place of those of columns that a row may leave empty together, by place.

    Raises:
        CaseError: a row has not a cell for each column, or a cell is no number.
        InputError: the file is no table at all.
    """
    rows, numbers = array("i"), array("d")
    for row, cells in records:
        _check_count(cells, header, row, file)
        for others in left_out:
            if not any(cells[place] for place in others):
                for place, cell in others.items():
                    cells[place] = cell
        try:
            numbers.extend([float(cell) for cell in cells])
        except ValueError:
            for cell, name in zip(cells, header, strict=True):
                _number_in(cell, row, name, file)  # of which one raises
        rows.append(row)
    columns = np.array(numbers).reshape(-1, len(header)).T
    return NumberTable(file, np.array(rows, dtype=np.int32), dict(zip(header, columns, strict=True)))


def _check_count(cells: Sequence[str], header: Sequence[str], row: int, file: str) -> None:
    """Refuse a row that has not a cell for each column, by a CaseError."""
    if len(cells) != len(header):
        raise CaseError(f"row {row}", f"must have {len(header)} cells, got {len(cells)}", source=file)


def _text_of(path: Path, file: str, name: str, most: int) -> str:
    """Return the text of a file.

    Raises:
        CaseError: it cannot be read, is too large, or no text.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(most + 1)
        if len(content) > most:
            raise CaseError(name, f"is larger than {most // 1_000_000} MB", file)
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise CaseError(name, "cannot be read: it is not UTF-8 text", file) from None
    except (OSError, ValueError) as error:
        fault = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise CaseError(name, f"cannot be read: {fault}", file) from None


def check_header(header: Sequence[str], kind: RowKind, error: Callable[[str], CaseError]) -> _Columns:
    """Return the columns that a file has, by key within a table.

    Raises:
        CaseError: a column is unknown, missing or there twice, or two forms of one thing stand beside each other.
    """
    for name in header:
        if name not in kind.columns:
            raise error(f"no such column, {name!r}; {nearest(name, kind.columns)}")
        if list(header).count(name) > 1:
            raise error(f"column {name!r} is there twice")
    found = {}
    for key, names in {**kind.needed, **kind.others}.items():
        missing = [name for name in names if name not in header]
        if len(missing) < len(names) or key in kind.needed:
            if missing:
                raise error(f"column{'s' if len(missing) > 1 else ''} {listing(missing)} missing")
            found[key] = names
    forms = [[key for key in form if key in found] for form in kind.alternatives]
    given = [form[0] for form in forms if form]
    if len(given) > 1:
        one, other = (found[key][0] for key in given[:2])
        raise error(f"column {other!r} cannot stand beside {one!r}; state it in one way")
    return found


def _table_of(
    number: int, record: Sequence[str], header: Sequence[str], columns: _Columns, kind: RowKind, file: str
) -> dict[str, Any]:
    """Return the table of a row.

    Raises:
        CaseError: a cell is no number, or missing.
    """
    _check_count(record, header, number, file)
    cells = dict(zip(header, record, strict=True))

    def value(column: str) -> float | str:
        return cells[column] if column in kind.words else _number_in(cells[column], number, column, file)

    table: dict[str, Any] = {}
    for key, names in columns.items():
        if key not in kind.needed and not any(cells[name] for name in names):
            continue  # empty cells state nothing
        values = [value(name) for name in names]
        place = table.setdefault(kind.nested, {}) if kind.nested and key not in kind.needed else table
        place[key] = values[0] if len(names) == 1 else values
    return table

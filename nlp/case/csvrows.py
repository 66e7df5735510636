"""CSV files of poses, tasks, paths and sweep points: rows become tables of a case file, or arrays.

The first row has the names of the columns. Values are fixed, and in the units of the case. Messages name the file, the
row number as in a spreadsheet, and the column.
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

#: Largest size, bytes, and largest number of rows of a file with poses or tasks of a case.
_MOST_BYTES, _MOST_ROWS = 4_000_000, 1_000
#: Both for poses outside of a case, for which nothing is optimised.
_MOST_BYTES_APART, _MOST_ROWS_APART = 64_000_000, 200_000

#: Columns of each key of a table; the columns of a key are all present or all absent.
_Columns = Mapping[str, tuple[str, ...]]


class RowKind(NamedTuple):
    """Columns of a CSV file, and the tables that its rows become.

    Attributes:
        key: key of the tables in a case file, ``pose`` or ``task``.
        needed: required columns, by key within the table.
        others: optional columns, by key within the table.
        words: names of the columns with text; all others have numbers.
        alternatives: groups of keys; a file may have the columns of only one group.
        nested: key of a table within the table, for the optional columns; empty to put them into the table itself.
    """

    key: str
    needed: _Columns
    others: _Columns
    words: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, ...], ...] = ()
    nested: str = ""

    @property
    def columns(self) -> list[str]:
        """Names of all columns."""
        return [column for part in (self.needed, self.others) for names in part.values() for column in names]


#: Rows with poses.
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
#: Kinds of rows by the key with the name of the file.
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
    """CSV file from which the tables of a key were read.

    Attributes:
        file: name of the file.
        rows: row number of each table in the file, from 1.
        columns: columns of each key within a table.
        nested: key of a table within the table, for the optional columns.
    """

    file: str
    rows: tuple[int, ...]
    columns: _Columns
    nested: str


@dataclass(frozen=True)
class TableOrigins:
    """CSV files from which poses and tasks of a document were read, for messages.

    Attributes:
        sources: file of each key, ``pose`` or ``task``; without an entry for tables of the case file itself.
    """

    sources: Mapping[str, _Source] = field(default_factory=dict)

    def error_in(self, error: CaseError, document: str) -> CaseError:
        """Return an error with the name of its file: the CSV file with row and column, or the case file.

        Args:
            error: error without the name of a file.
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
    """Return the CSV files to which a document refers.

    Args:
        tables: the document, as ``tomllib`` returns it.
        folder: folder of the document, from which the file names begin.
    """
    files = (tables.get(name) for name in _KINDS)
    return tuple(folder / file for file in files if isinstance(file, str))


def insert_rows(tables: dict[str, Any], folder: Path) -> TableOrigins:
    """Replace the names of CSV files in a document by their rows.

    Args:
        tables: the document, as ``tomllib`` returns it; ``poses`` and ``tasks`` become ``pose`` and ``task``.
        folder: folder of the document, from which the file names begin.

    Raises:
        CaseError: the document has poses or tasks both as tables and as a file, or a file cannot be read or has an
            error.
        InputError: a file is not a table.
    """
    sources = {}
    for name, kind in _KINDS.items():
        file = tables.get(name)
        if name not in tables or not isinstance(file, str):
            continue  # the schema refuses values other than text
        if kind.key in tables:
            raise CaseError(name, f"conflicts with [[{kind.key}]]; state the {name} in one way", file)
        found, sources[kind.key] = _read_rows(file, folder, kind, name)
        # The order of the keys is kept.
        items = [(kind.key, found) if key == name else (key, value) for key, value in tables.items()]
        tables.clear()
        tables.update(items)
    return TableOrigins(sources)


def pose_tables(file: str, option: str) -> tuple[list[dict[str, Any]], TableOrigins, tuple[int, ...]]:
    """Return the poses of a file given by an option, as tables, with their origin and their row numbers.

    Args:
        file: name of the file.
        option: option with the name of the file, for messages.

    Raises:
        CaseError: the file cannot be read, or has an error.
        InputError: the file is not a table.
    """
    most = _MOST_BYTES_APART, _MOST_ROWS_APART
    tables, source = _read_rows(file, Path(), POSE_ROWS, option, *most)
    return tables, TableOrigins({"pose": source}), source.rows


def _read_rows(
    file: str, folder: Path, kind: RowKind, name: str, most_bytes: int = _MOST_BYTES, most_rows: int = _MOST_ROWS
) -> tuple[list[dict[str, Any]], _Source]:
    """Return the tables of a file's rows, and their origin.

    Raises:
        CaseError: the file cannot be read, or has an error.
        InputError: the file is not a table.
    """
    records = list(csv_rows(_text_of(folder / file, file, name, most_bytes), file))
    if len(records) < 2:
        raise InputError(
            f"{file}: has no rows: expected a first row with the names of the columns, then rows of values"
        )
    if len(records) - 1 > most_rows:
        raise InputError(f"{file}: must have at most {most_rows} rows, got {len(records) - 1}")
    (top, header), *body = records
    columns = check_header(header, kind, lambda fault: CaseError(f"row {top}", fault, source=file))
    tables = [_table_of(number, record, header, columns, kind, file) for number, record in body]
    return tables, _Source(file, tuple(number for number, _ in body), columns, kind.nested)


def csv_rows(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the row number and the stripped cells of every row that is not empty.

    Args:
        text: text of the file, with commas or semicolons between the cells.
        file: name of the file, for messages.

    Raises:
        InputError: the text is not CSV.
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
        CaseError: the cell is empty, or not a number.
    """
    try:
        return float(text)
    except ValueError:
        from ..system.slips import hint_of  # noqa: PLC0415 - only messages need it

        fault = f"must be a number{hint_of(text)}" if text else "must be a number, got an empty cell"
        raise CaseError(f"row {row}, column {column}", fault, text or None, file) from None


class NumberTable(NamedTuple):
    """Numeric columns of a file.

    Attributes:
        source: name of the file.
        rows: (n,) row numbers in the file, from 1.
        columns: (n,) values of each column by name.
    """

    source: str
    rows: NDArray[np.int32]
    columns: Mapping[str, FloatArray]

    def block(self, names: str) -> FloatArray:
        """Return several columns as an array (n, k).

        Args:
            names: names of the columns, separated by spaces.
        """
        return np.stack([self.columns[name] for name in names.split()], axis=1)

    def refuse(self, is_wrong: NDArray[np.bool_], name: str, fault: str) -> None:
        """Refuse the first row with an error.

        Args:
            is_wrong: (n,) True for each row with the error.
            name: name of the column or columns, for messages.
            fault: description of the error and of the allowed values.

        Raises:
            CaseError: a row has the error.
        """
        if is_wrong.any():
            at = int(np.argmax(is_wrong))
            value = float(self.columns[name][at]) if name in self.columns else None
            raise CaseError(f"row {self.rows[at]}, column{'s' * (value is None)} {name}", fault, value, self.source)


def number_table(
    records: Iterable[tuple[int, list[str]]], header: list[str], file: str, left_out: Sequence[Mapping[int, str]] = ()
) -> NumberTable:
    """Return the numeric columns of a file.

    Args:
        records: row number and cells of each row below the header.
        header: names of the columns.
        file: name of the file, for messages.
        left_out: groups of columns that a row may leave empty together: default cell of each column, by column index.

    Raises:
        CaseError: a row does not have one cell per column, or a cell is not a number.
        InputError: the file is not CSV.
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
                _number_in(cell, row, name, file)  # raises for the first cell that is not a number
        rows.append(row)
    columns = np.array(numbers).reshape(-1, len(header)).T
    return NumberTable(file, np.array(rows, dtype=np.int32), dict(zip(header, columns, strict=True)))


def _check_count(cells: Sequence[str], header: Sequence[str], row: int, file: str) -> None:
    """Raise a CaseError for a row without exactly one cell per column."""
    if len(cells) != len(header):
        raise CaseError(f"row {row}", f"must have {len(header)} cells, got {len(cells)}", source=file)


def _text_of(path: Path, file: str, name: str, most: int) -> str:
    """Return the text of a file.

    Raises:
        CaseError: the file cannot be read, is too large, or is not UTF-8 text.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(most + 1)
        if len(content) > most:
            raise CaseError(name, f"cannot be read: it is larger than {most // 1_000_000} MB", file)
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise CaseError(name, "cannot be read: it is not UTF-8 text", file) from None
    except (OSError, ValueError) as error:
        fault = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise CaseError(name, f"cannot be read: {fault}", file) from None


def check_header(header: Sequence[str], kind: RowKind, error: Callable[[str], CaseError]) -> _Columns:
    """Return the columns of a file by key within a table.

    Args:
        header: names of the columns in the file.
        kind: allowed columns.
        error: function that makes an error from a message.

    Raises:
        CaseError: a column is unknown, missing or duplicate, or columns of two alternatives are present.
    """
    for name in header:
        if name not in kind.columns:
            raise error(f"no such column, {name!r}; {nearest(name, kind.columns)}")
        if list(header).count(name) > 1:
            raise error(f"column {name!r} appears twice; remove one")
    found = {}
    for key, names in {**kind.needed, **kind.others}.items():
        missing = [name for name in names if name not in header]
        if len(missing) < len(names) or key in kind.needed:
            if missing:
                is_one = len(missing) == 1
                raise error(f"column{'' if is_one else 's'} {listing(missing)} {'is' if is_one else 'are'} missing")
            found[key] = names
    forms = [[key for key in form if key in found] for form in kind.alternatives]
    given = [form[0] for form in forms if form]
    if len(given) > 1:
        one, other = (found[key][0] for key in given[:2])
        raise error(f"column {other!r} conflicts with {one!r}; give only one of the two forms")
    return found


def _table_of(
    number: int, record: Sequence[str], header: Sequence[str], columns: _Columns, kind: RowKind, file: str
) -> dict[str, Any]:
    """Return the table of a row.

    Raises:
        CaseError: a cell is missing, or not a number.
    """
    _check_count(record, header, number, file)
    cells = dict(zip(header, record, strict=True))

    def value(column: str) -> float | str:
        return cells[column] if column in kind.words else _number_in(cells[column], number, column, file)

    table: dict[str, Any] = {}
    for key, names in columns.items():
        if key not in kind.needed and not any(cells[name] for name in names):
            continue  # empty cells: the key is left out
        values = [value(name) for name in names]
        place = table.setdefault(kind.nested, {}) if kind.nested and key not in kind.needed else table
        place[key] = values[0] if len(names) == 1 else values
    return table

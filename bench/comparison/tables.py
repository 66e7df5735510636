"""Markdown tables of all sections except the comparison of methods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]
#: Load of each core at the start above which the computer counts as busy.
_BUSY = 0.5
_RUNS = {"quick": "A quick run, with few attempts and short limits", "full": "A full run"}


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    return "\n".join([*lines, *(f"| {' | '.join(each.replace('|', '/') for each in row)} |" for row in rows)]) + "\n"


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with some significant digits and no exponent; a dash for none."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    after = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{after}f}"


def percent(value: float | None) -> str:
    """Return a ratio in per cent."""
    return "-" if value is None else f"{number(100 * value, 2)} %"


def machine_lines(data: Row) -> str:
    """Return computer, versions, date and kind of the run."""
    at = data["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in at["packages"].items())
    run = _RUNS[data["run"]] + (", cut short" if data.get("is_shortened") else "")
    if at["load"] > _BUSY * at["cores"]:
        run = f"**Preliminary, on a busy computer.** {run}"
    begin = f"{run}, {at['date']}, revision {at['revision']}, {data.get('seconds', '-')} s."
    hardware = f"{at['processor']}, {at['cores']} cores, load {at['load']} at the start."
    return f"{begin} {hardware} {at['system']}, Python {at['python']}, {at['compiler']}; {packages}.\n"


def evaluation_tables(section: Row) -> str:
    """Return nanoseconds of F and its derivatives by implementation."""
    implementations = ("generated C", "CasADi", "NumPy", "C by hand")
    columns = (
        "case",
        "quantity",
        "operations",
        "divisions and roots",
        "lower bound, ns",
        *(f"{way}, ns" for way in implementations),
    )
    rows = []
    for row in section["rows"]:
        if "note" in row:
            rows.append((f"`{row['case']}`", row["note"], *("-" for _ in columns[2:])))
            continue
        least = row["operations"] * row["operation_nanoseconds"]
        times = [row["nanoseconds"].get(way) for way in implementations]
        cells = [
            "-" if each is None else f"{number(each)} ({number(each / times[0], 2)})" if k else number(each)
            for k, each in enumerate(times)
        ]
        counts = (str(row["operations"]), str(row["divisions_and_roots"]), number(least))
        rows.append((f"`{row['case']}`", row["quantity"], *counts, *cells))
    return table(columns, rows)


def certificate_tables(section: Row) -> str:
    """Return bounds of the global optimum by method."""
    names = {"screwsynth": "screwsynth", "scip": "SCIP", "maingo": "MAiNGO"}
    rows = []
    for row in section["rows"]:
        best, bound = row.get("best"), row.get("bound")
        gap = None if best is None or bound is None else abs(bound - best) / max(abs(best), 1e-9)
        nodes = f"{row['nodes']:,}" if "nodes" in row else "-"
        cells = (number(best, 6), number(bound, 6), percent(gap), nodes, number(row.get("seconds")))
        rows.append((row["problem"], names[row["method"]], *cells, row.get("note", "")))
    head = f"At most {number(section['seconds_each'])} s each, for a gap of {percent(section['gap'])}.\n\n"
    return head + table(("problem", "method", "best F", "bound", "gap", "boxes or nodes", "s", "remark"), rows)


def growth_tables(section: Row) -> str:
    """Return times by size, and fitted exponents."""
    rows = []
    for series in section["series"]:
        if not series.get("sizes"):
            rows.append((series["name"], "-", "-", "-", series.get("note", "")))
            continue
        pairs = zip(series["sizes"], series["seconds"], series["counts"], strict=True)
        each = [f"{size}: {number(s)} s{'' if n is None else f', {n:,} boxes'}" for size, s, n in pairs]
        exponent = number(series["exponent"], 2)
        fit = f"boxes: factor {exponent} for each" if series["is_exponential"] else f"power {exponent}"
        reach = f"{min(series['sizes'])} to {max(series['sizes'])}"
        turns = f"median of {series['turns']}"
        remark = "; ".join(part for part in (turns, series["note"]) if part)
        rows.append((series["name"], "; ".join(each), "-" if series["exponent"] is None else fit, reach, remark))
    return table(("varied size", "size: time", "fit", "range", "remark"), rows)

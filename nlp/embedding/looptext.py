"""C text of a program's loops: their tables, the calls of their functions, and the sizes of their workspace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from .ctext import short_table
from .stages import LoopFunctions, StagedFunctions


def loop_texts(staged: StagedFunctions, prefix: str) -> dict[str, str]:
    """Return the texts for the placeholders about loops."""
    loops, most = staged.loops, _largest(staged)
    rows = ""
    if loops:
        what = "limits that repeat, and F over several poses, by loops over functions of `-casadi.c`"
        rows += f"| `{prefix}-loops.c` | {what} |\n"
    if loops.spectra:
        rows += f"| `{prefix}-spectrum.c` | limits on singular values of J, with their derivatives, by loops |\n"
    return {
        "has_loops": str(int(bool(loops))),
        "nspectra": str(len(loops.spectra)),
        "spectrum_lengths": ", ".join(repr(float(each.spectral.length)) for each in loops.spectra),
        "spectrum_kinds": ", ".join(str(each.spectral.end.value) for each in loops.spectra),
        "loop_rows": rows,
        "nentries": str(loops.entries.numel()),
        "nslots": str(loops.slot_count),
        "nplain": str(len(loops.plain)),
        "ninner": str(len(loops.inner)),
        "nloops": str(len(loops.all)),
        "has_objective": str(int(loops.has_objective)),
        "by_direction": str(int(staged.by_direction)),
        "constants_at": str(staged.prepare.numel_out(0) - loops.constants.numel()),
        "loop_tables": _tables(staged),
        "loop_cases": _cases(staged.of_loops),
        **{f"most_{name}": str(count) for name, count in most.items()},
        "ncolumns": str(len(_columns(staged).columns)),
        "casadi_work": str(casadi_work(staged)),
        # Eigenvalues by another order of operations, and by inverses, lose two digits more.
        "limits_close": "1e-10" if loops.spectra else "1e-12",
    }


def casadi_work(staged: StagedFunctions) -> int:
    """Return the number of doubles in the workspace of CasADi's functions."""
    return max(1, *(function.sz_w() for function in staged.all))


def loop_work(staged: StagedFunctions, rows: int, n: int) -> int:
    """Return the number of doubles that ``loops.c`` divides its workspace into, beside CasADi's own; see there."""
    loops = staged.loops
    if not loops:
        return 0
    plain, slots = len(loops.plain), loops.slot_count
    first = slots + len(_columns(staged).columns) + sum(_largest(staged).values()) + plain * (1 + n)
    second = slots + plain + loops.entries.numel() + n + n * n + n
    of_j = 6 * rows
    # The locals of spectrum.c: matrices (6, 6) along the variables, and second derivatives.
    spectrum = 10 * n * n + 115 * n + 1080 + of_j
    return first + second + (3 * of_j + 2 * of_j * n + n * n + spectrum if loops.spectra else 0)


class _Columns(NamedTuple):
    """Variables on which slots depend: where those of each slot begin, with the end of the last, and their indices."""

    first: list[int]
    columns: list[int]


def _columns(staged: StagedFunctions) -> _Columns:
    """Return the variables on which the slots depend by structure."""
    entries = staged.loops.entries
    own: list[list[int]] = [[] for _ in range(staged.loops.slot_count)]
    for row, column in zip(*ca.jacobian(entries, staged.x).sparsity().get_triplet(), strict=True):
        own[row].append(column)
    for loop, functions in zip(staged.loops.inner, staged.of_loops, strict=False):
        for slots, outputs in zip(loop.slots, loop.outputs, strict=True):
            for value, place in enumerate(outputs):
                taken = (own[slots[i]] for r, i in functions.slopes if r == value)
                own[place] = sorted({column for columns in taken for column in columns})
    first = [0]
    for columns in own:
        first.append(first[-1] + len(columns))
    return _Columns(first, [column for columns in own for column in sorted(columns)])


def _largest(staged: StagedFunctions) -> dict[str, int]:
    """Return the largest numbers of inputs, values, derivatives and so on of a loop, each at least 1."""
    counts = [
        {
            "inputs": loop.inputs.numel(),
            "constants": loop.constants.numel(),
            "values": loop.values.numel(),
            # The place of the slopes in the workspace has derivatives by the inputs too.
            "slopes": max(len(own.slopes), loop.inputs.numel()),
            "second": len(own.second),
        }
        for loop, own in zip(staged.loops.all, staged.of_loops, strict=True)
    ]
    names = ("inputs", "constants", "values", "slopes", "second")
    return {name: max((each[name] for each in counts), default=0) or 1 for name in names}


def _tables(staged: StagedFunctions) -> str:
    """Return the constant tables of slots, constants and outputs."""
    loops = staged.loops
    slots, constants, outputs, slopes, second = tables = [list[int]() for _ in range(5)]
    lines = []
    for loop, own in zip(loops.all, staged.of_loops, strict=True):
        sizes = (len(loop.slots), loop.inputs.numel(), loop.constants.numel(), loop.values.numel())
        counts = (len(own.slopes), len(own.second))
        firsts = (len(slots), len(constants), len(outputs), len(slopes) // 2, len(second) // 2)
        lines.append(", ".join(map(str, (*sizes, *counts, *firsts))))
        slopes.extend(each for pair in own.slopes for each in pair)
        second.extend(each for pair in own.second for each in pair)
        for into, table in ((slots, loop.slots), (constants, loop.constant_places), (outputs, loop.outputs)):
            into.extend(value for row in table for value in row)
    rows = ",\n".join(f"    {{{line}}}" for line in (*lines, ", ".join("0" * 11)))
    names = ("slots", "constant_places", "outputs", "slope_places", "second_places")
    blocks = [short_table(name, table) for name, table in zip(names, tables, strict=True)]
    columns = _columns(staged)
    blocks += [short_table("first_column", columns.first), short_table("columns", columns.columns)]
    blocks.append(f"static const loop loops[LOOPS + 1] = {{\n{rows}}};")
    blocks.append(short_table("plain_places", loops.plain))
    if loops.spectra:
        blocks.append(short_table("spectral_places", [each.place for each in loops.spectra]))
        blocks.append(short_table("spectral_slots", [slot for each in loops.spectra for slot in each.slots]))
    return "\n".join(blocks) + "\n"


def _cases(functions: Sequence[LoopFunctions]) -> str:
    """Return the cases of the switch that calls the loops' functions."""
    flat = [function for own in functions for function in (own.values, own.curvature)]
    return "".join(f"    case {i}: return {each.name()}(arg, res, 0, work, 0);\n" for i, each in enumerate(flat))

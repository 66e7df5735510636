"""C text of a program's loops: their tables, the calls of their functions, and the sizes of their workspace."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import casadi as ca
from casadi import SX

from .ctext import short_table
from .stages import StagedFunctions


def loop_texts(staged: StagedFunctions, prefix: str) -> dict[str, str]:
    """Return the texts for the placeholders about loops.

    Args:
        staged: the functions.
        prefix: beginning of the names in C.
    """
    loops, parts = staged.loops, []
    if loops:
        parts.append("loops")
    if loops.spectra:
        parts.append("spectrum")
    explained = {
        "loops": "limits that repeat, and F over several poses, by loops over functions of `-casadi.c`",
        "spectrum": "limits on singular values of J, with their derivatives, by loops",
    }
    return {
        "has_loops": str(int(bool(loops))),
        "nspectra": str(len(loops.spectra)),
        "spectrum_lengths": ", ".join(repr(float(each.spectral.length)) for each in loops.spectra),
        "spectrum_kinds": ", ".join(str(each.spectral.end.value) for each in loops.spectra),
        "loop_rows": "".join(f"| `{prefix}-{part}.c` | {explained[part]} |\n" for part in parts),
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
        "most_inputs": str(_most(loop.inputs for loop in loops.all)),
        "most_constants": str(_most(loop.constants for loop in loops.all)),
        "most_values": str(_most(loop.values for loop in loops.all)),
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
    k, q, r = (
        _most(each)
        for each in (
            [loop.inputs for loop in loops.all],
            [loop.constants for loop in loops.all],
            [loop.values for loop in loops.all],
        )
    )
    plain, slots = len(loops.plain), loops.slot_count
    first = slots * (1 + n) + k + q + r + r * k + plain * (1 + n)
    second = slots + plain + loops.entries.numel() + k * k + k * n + n * n + n
    of_j = 6 * rows
    return first + second + (3 * of_j + 2 * of_j * n + n * n if loops.spectra else 0)


def _most(vectors: Iterable[SX]) -> int:
    """Return the largest length of vectors (k, 1), at least 1."""
    return max((int(each.numel()) for each in vectors), default=0) or 1


def _tables(staged: StagedFunctions) -> str:
    """Return the constant tables of slots, constants and outputs."""
    loops = staged.loops
    slots: list[int] = []
    constants: list[int] = []
    outputs: list[int] = []
    lines = []
    for loop in loops.all:
        sizes = (len(loop.slots), loop.inputs.numel(), loop.constants.numel(), loop.values.numel())
        lines.append(", ".join(map(str, (*sizes, len(slots), len(constants), len(outputs)))))
        for into, table in ((slots, loop.slots), (constants, loop.constant_places), (outputs, loop.outputs)):
            into.extend(value for row in table for value in row)
    rows = ",\n".join(f"    {{{line}}}" for line in (*lines, "0, 0, 0, 0, 0, 0, 0"))
    blocks = [short_table("slots", slots), short_table("constant_places", constants), short_table("outputs", outputs)]
    blocks.append(f"static const loop loops[LOOPS + 1] = {{\n{rows}}};")
    blocks.append(short_table("plain_places", loops.plain))
    if loops.spectra:
        blocks.append(short_table("spectral_places", [each.place for each in loops.spectra]))
        blocks.append(short_table("spectral_slots", [slot for each in loops.spectra for slot in each.slots]))
    return "\n".join(blocks) + "\n"


def _cases(functions: Sequence[tuple[ca.Function, ca.Function]]) -> str:
    """Return the cases of the switch that calls the loops' functions."""
    flat = [function for pair in functions for function in pair]
    return "".join(f"    case {i}: return {each.name()}(arg, res, 0, work, 0);\n" for i, each in enumerate(flat))

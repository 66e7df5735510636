"""Figures of flash and stack, written into the header, the README and the manifest of generated C."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from ..errors import one_line
from .ctext import comment_text
from .manifest import MANIFEST, json_text
from .measure import Figures

#: What stands in the place of the figures where no compiler was run.
NOT_MEASURED = "Flash and stack were not measured when this folder was generated."


def with_figures(files: Mapping[str, str], prefix: str, figures: Sequence[Figures]) -> dict[str, str]:
    """Return the files of a folder with figures in the header, the README and the manifest."""
    manifest = json.loads(files[MANIFEST])
    manifest["measured"] = [
        {
            "target": each.target.name,
            "compiler": each.compiler,
            "flash_bytes": each.flash,
            "stack_bytes": each.stack,
            "stack_bytes_with_room": each.with_room,
            "painted_stack_bytes": each.painted,
            "fault": each.fault,
        }
        for each in figures
    ]
    header = f"{prefix}.h"
    return {
        **files,
        header: files[header].replace(f"/* {NOT_MEASURED} */", _macros(prefix.upper(), figures)),
        "README.md": files["README.md"].replace(NOT_MEASURED, _rows(figures)),
        MANIFEST: json_text(manifest),
    }


def figure_words(figures: Figures) -> str:
    """Return the figures of a target in one line."""
    parts = [
        "" if figures.flash is None else f"flash {figures.flash / 1000:.1f} kB",
        "" if figures.stack is None else f"stack at most {figures.stack} bytes",
        f"not measured: {one_line(figures.fault)}" if figures.fault else "",
    ]
    return f"{figures.target.name}: {', '.join(part for part in parts if part)}"


def _macros(prefix: str, figures: Sequence[Figures]) -> str:
    """Return macros of the header; a comment says what is not measured."""
    lines = []
    for each in figures:
        name = each.target.macro
        if each.compiler:
            lines.append(f"/* {each.target.name}: {comment_text(each.compiler)} */")
        if each.flash is not None:
            lines.append(f"#define {prefix}_FLASH_BYTES_{name} {each.flash} /* code and constants of the library */")
        if each.stack is not None:
            painted = "" if each.painted is None else f"; {each.painted} were measured with them, from all seeds"
            said = f"bound of a solve by that compiler, without functions of math.h{painted}"
            room = "with room for other compilers, and for functions of math.h"
            lines.append(f"#define {prefix}_STACK_BYTES_{name}_GCC {each.stack} /* {said} */")
            lines.append(f"#define {prefix}_STACK_BYTES_{name} {each.with_room} /* {room} */")
        if each.fault:
            lines.append(f"/* {each.target.name}: not measured: {comment_text(each.fault)} */")
    return "\n".join(lines)


def _rows(figures: Sequence[Figures]) -> str:
    """Return a table for the README; a line says what is not measured."""
    heads = ("flash, bytes", "bound of the stack, bytes", "with room for others", "stack measured, bytes")
    lines = [f"| machine | {' | '.join(heads)} | compiler and flags |", "|---|---|---|---|---|---|"]
    for each in figures:
        numbers = " | ".join("-" if own is None else str(own) for own in each.numbers)
        lines.append(f"| {each.target.name} | {numbers} | {comment_text(each.compiler) or '-'} |")
    for each in figures:
        lines += ["", f"{each.target.name}: not measured: {comment_text(each.fault)}."] if each.fault else []
    return "\n".join(lines)

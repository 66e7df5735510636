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


def header_texts() -> dict[str, str]:
    """Return the texts of the placeholders for figures, as they are before a measurement."""
    return {"measured_macros": f"/* {NOT_MEASURED} */", "measured_rows": NOT_MEASURED}


def with_figures(files: Mapping[str, str], prefix: str, figures: Sequence[Figures]) -> dict[str, str]:
    """Return the files of a folder with figures in the header, the README and the manifest.

    Args:
        files: text by file name, as :func:`~screwsynth.nlp.generate_c` returns it.
        prefix: of the case's names in C.
        figures: of each target.
    """
    header, readme = f"{prefix}.h", "README.md"
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
    return {
        **files,
        header: files[header].replace(header_texts()["measured_macros"], _macros(prefix.upper(), figures)),
        readme: files[readme].replace(NOT_MEASURED, _rows(figures)),
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
            lines += [
                (
                    f"#define {prefix}_STACK_BYTES_{name}_GCC {each.stack} "
                    f"/* bound of a solve by that compiler, without functions of math.h{painted} */"
                ),
                (
                    f"#define {prefix}_STACK_BYTES_{name} {each.with_room} "
                    "/* with room for other compilers, and for functions of math.h */"
                ),
            ]
        if each.fault:
            lines.append(f"/* {each.target.name}: not measured: {comment_text(each.fault)} */")
    return "\n".join(lines)


def _rows(figures: Sequence[Figures]) -> str:
    """Return a table for the README; a line says what is not measured."""
    rows = [
        (
            "| machine | flash, bytes | bound of the stack, bytes | with room for others | stack measured, bytes "
            "| compiler and flags |"
        ),
        "|---|---|---|---|---|---|",
        *(
            f"| {each.target.name} | {' | '.join('-' if own is None else str(own) for own in each.numbers)} "
            f"| {comment_text(each.compiler) or '-'} |"
            for each in figures
        ),
    ]
    faults = [f"{each.target.name}: not measured: {comment_text(each.fault)}." for each in figures if each.fault]
    return "\n".join([*rows, *(line for fault in faults for line in ("", fault))])

"""Texts of the C interface: an index macro for every number, and the version."""

from __future__ import annotations

import re

from ..program.program import Program
from .ctext import c_names


def index_macros(program: Program, prefix: str) -> str:
    """Return a macro for the index of every entry of x and p, such as ``PREFIX_x_p_z``.

    The macros continue the prefix by a small letter, as no other macro does: so they meet none of another case.

    Args:
        program: the program.
        prefix: of the case's names in C.
    """
    lines = ["/* Indices of the entries of x and of p. */"]
    for vector, scalars in (("x", program.variables), ("p", program.arguments)):
        names = c_names(scalar.name for scalar in scalars)
        lines += [f"#define {prefix.upper()}_{vector}_{name} {index}" for index, name in enumerate(names)]
    return "\n".join(lines) + "\n"


def version_texts(version: str) -> dict[str, str]:
    """Return the texts for the placeholders about the version.

    Args:
        version: of the package, such as ``1.2.3``; a part that is missing is 0.
    """
    parts = [*(match.group() for match in re.finditer(r"\d+", version)), "0", "0", "0"]
    named = dict(zip(("version_major", "version_minor", "version_patch"), parts, strict=False))
    # Semantic versioning: with the major version 0 a minor one may break what was, with a later one it may not.
    named["compatibility"] = "SameMinorVersion" if int(parts[0]) == 0 else "SameMajorVersion"
    number = (int(parts[0]) * 1000 + int(parts[1])) * 1000 + int(parts[2])
    return {"version": version, "version_number": str(number)} | named

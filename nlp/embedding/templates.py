"""Texts of generated C: templates with their placeholders replaced, and functions as CasADi writes them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from string import Template

import casadi as ca

from .ctext import for_controllers

#: Folder of the templates.
TEMPLATES = Path(__file__).parent / "c"


def fill_template(template: str, names: Mapping[str, str]) -> str:
    """Return the text of a template with its placeholders replaced."""
    return Template((TEMPLATES / template).read_text(encoding="utf-8")).substitute(names)


def prototype(kin: str, name: str) -> str:
    """Return the C declaration of a CasADi function of the kinematics; ``kin`` begins its name."""
    return f"int {kin}_CASADI_{name}(const real **arg, real **res, int *iw, real *w, int mem);"


def casadi_texts(functions: Iterable[ca.Function], name: str) -> dict[str, str]:
    """Generate C and header, by file ending; CasADi's names in these texts begin with ``name``."""
    generator = ca.CodeGenerator(f"{name}.c", {"with_header": True, "casadi_int": "int", "indent": 0})
    for function in functions:
        generator.add(function)
    # CasADi writes files only.
    with tempfile.TemporaryDirectory() as folder:
        generator.generate(folder + os.sep)
        texts = {end: (Path(folder) / f"{name}{end}").read_text(encoding="utf-8") for end in (".c", ".h")}
    return {end: for_controllers(text) for end, text in texts.items()}

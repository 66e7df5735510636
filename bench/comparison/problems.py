"""The cases of the comparison: shipped ones, and starters of gallery robots written to temporary case files."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

from screwsynth.nlp import Case, Nlp, build_model, formulate, load_case
from screwsynth.nlp.program.pairs import with_all_pairs
from screwsynth.nlp.starter.text import starter_case

SHIPPED = (
    "paper-4.1-helical",
    "paper-4.2-rotation",
    "paper-4.3",
    "paper-4.4-max",
    "hexapod-machining",
)
GALLERY = ("delta", "3-rps")
CASES = (*SHIPPED, *GALLERY)


class Subject(NamedTuple):
    """A case and its program with all its constraints, also those on pairs that ``solve`` adds when they bind."""

    case: Case
    nlp: Nlp


def case_of(name: str) -> Case:
    """Return a case by its name; a gallery robot's is what ``screwsynth new`` prints."""
    if name not in GALLERY:
        return load_case(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(starter_case(build_model(name)), encoding="utf-8")
        return load_case(str(path))


def subject_of(name: str) -> Subject:
    """Return a case with its program, whose functions are built, so that no peer's time has that."""
    case = case_of(name)
    nlp = with_all_pairs(formulate(case))
    _ = nlp.program.kernels.values, nlp.program.kernels.derivatives, nlp.program.kernels.hessian
    _ = nlp.objective_scale, nlp.row_sizes, nlp.sides
    return Subject(case, nlp)

"""One search by the generated C from one random start; generating and compiling it are not counted."""

from __future__ import annotations

import tempfile
from pathlib import Path

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, CompiledCase, generate_c, load_compiled

from .interface import Peer, Problem

_KEPT: dict[str, CompiledCase] = {}


def compiled(case: Case) -> CompiledCase:
    """Return the library of a case, compiled once in a process and cached by its text."""
    if case.name not in _KEPT:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in generate_c(case, "").items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            _KEPT[case.name] = load_compiled(folder)
    return _KEPT[case.name]


def search(problem: Problem) -> FloatArray:
    """Return where the search of the C ends."""
    library = compiled(problem.case)
    found = library.solve(problem.x(problem.start), seeds=0, threads=1)
    problem.iterations = int(found.iterations[0])
    return (found.x[0] - problem.nlp.centre) / problem.nlp.scale


PEERS = (Peer("screwsynth, generated C from one start", "screwsynth", search, "exact"),)

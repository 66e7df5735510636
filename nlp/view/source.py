"""C of a live view: the files of ``codegen``, with the view's functions and the exports of the module."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Template

from ..case.case import Case
from ..case.task import Method
from ..embedding.codegen import c_of_subject
from ..embedding.ctext import identifier
from ..embedding.manifest import solver_files
from ..embedding.subject import Subject, find_subject
from ..embedding.templates import casadi_texts
from ..errors import CaseError
from ..program.formulation import formulate_each, formulate_whole
from ..program.nlp import Nlp
from .functions import ViewFunctions, view_functions
from .parts import in_parts

#: Folder of the template and of the headers in place of those of a C library.
FOLDER = Path(__file__).parent / "c"
_HEADERS = ("math.h", "string.h", "memory.c")


@dataclass(frozen=True, eq=False)
class ViewSource:
    """C of a live view.

    Attributes:
        subject: program of the C, and its optimal value.
        functions: functions of the view.
        files: text by file name; empty if C cannot be generated.
        fault: reason why C cannot be generated; empty if it can.
    """

    subject: Subject
    functions: ViewFunctions
    files: Mapping[str, str]
    fault: str = ""

    @property
    def checksum(self) -> str:
        """SHA-256 of all files."""
        return checksum_of(self.files)


def checksum_of(files: Mapping[str, str], *further: str) -> str:
    """Return the SHA-256 of files by name, and of further texts."""
    parts = [*(part for item in sorted(files.items()) for part in item), *further]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def view_source(case: Case) -> ViewSource:
    """Return the C of the live view of a case.

    Raises:
        CaseError: the case is inconsistent, or C cannot be generated for it.
        InputError: the functions of the case have no finite value at any trial point.
    """
    subject = find_subject(case)
    generated = c_of_subject(subject)
    prefix = identifier(case.name)
    functions = view_functions(subject.nlp, f"{prefix}_VIEW")
    files = {name: generated[name] for name in solver_files(generated, prefix, ".c", ".h")}
    files |= {f"{prefix}-view-casadi{end}": text for end, text in casadi_texts(functions.all, f"{prefix}_VIEW").items()}
    files = {name: in_parts(text) if name.endswith("-casadi.c") else text for name, text in files.items()}
    files[f"{prefix}-view.c"] = _exports(subject, functions, prefix)
    files |= {name: (FOLDER / name).read_text(encoding="utf-8") for name in _HEADERS}
    return ViewSource(subject, functions, files)


def view_without_solver(case: Case, error: CaseError) -> ViewSource:
    """Return the live view of a case for which C cannot be generated: its drawing, without a module.

    Args:
        case: the case.
        error: reason why C cannot be generated.
    """
    subject = Subject(formulate_whole(case) if case.changes else formulate_each(case)[0], None)
    functions = view_functions(subject.nlp, f"{identifier(case.name)}_VIEW")
    return ViewSource(subject, functions, {}, _reason(case, error))


def view_or_drawing(case: Case) -> ViewSource:
    """Return the C of the live view of a case; where C cannot be generated, the view without a module."""
    try:
        return view_source(case)
    except CaseError as error:
        return view_without_solver(case, error)


def _reason(case: Case, error: CaseError) -> str:
    """Return the reason why C cannot be generated as a plain sentence, without keys of case files."""
    match error.key:
        case "objective.minimise":
            return f"the solver in the page optimises F only, and this case minimises the {_spaced(str(error.value))}"
        case "combine.method" if case.method is Method.AVERAGE:
            return "the solver in the page does not combine tasks by the average of their optima"
        case "combine.method":
            return "the tasks cannot be combined, because for one of them no optimum was found"
        case "robot":
            return "the solver in the page does not support robots with loops within a limb"
        case "pose":
            return "the limits between all pairs of the poses are too many for the solver in the page"
        case _:
            return str(error)


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _exports(subject: Subject, functions: ViewFunctions, prefix: str) -> str:
    """Return the C of the module's exports."""
    places, epigraph = subject.nlp.program.places, subject.nlp.program.places.epigraph
    joints = [*sorted(places.inner), *([] if epigraph is None else [epigraph.level])]
    tables = {
        "closure": functions.closure,
        "levels": functions.levels,
        "joints": joints,
        "followers": functions.followers,
        "groups": _groups(subject.nlp),
    }
    names = {
        "id": prefix,
        "ID": prefix.upper(),
        "ninputs": functions.view.numel_in(0),
        "nview": functions.view.numel_out(0),
        "rows_at": functions.blocks["rows"][0],
        **{f"n{name}": len(table) for name, table in tables.items()},
        **{name: ", ".join(map(str, [*table, 0])) for name, table in tables.items()},
        "nreadings": len(functions.readings.known),
        "has_slopes": int(functions.slopes is not None),
        "view_work": max(each.sz_w() for each in functions.all),
        "view_sz_arg": max(each.sz_arg() for each in functions.all),
        "view_sz_res": max(each.sz_res() for each in functions.all),
    }
    return Template((FOLDER / "view.c.in").read_text(encoding="utf-8")).substitute(names)


def _groups(nlp: Nlp) -> list[int]:
    """Return the number of rows of each wrench and of each limb member, in the order of the rows."""
    model = nlp.case.model
    return [*(1 for _ in model.wrenches), *(each.size for each in model.members)]

"""Journal of searches and certificates, from which an interrupted command resumes.

The key of an entry is the search: names, bounds and arguments of the program, its values at a few points, settings and
first points. A command that repeats a search reads its outcome from the journal, in any order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...models import Dimension, FloatArray, frozen_array
from .. import __version__
from ..case.settings import Search
from ..evidence.optimality import examine
from ..evidence.state import state_or_none
from ..interruption import is_requested
from ..program.nlp import Nlp, PairPlace
from ..program.pairs import with_pairs
from ..program.relaxation import RelaxedLimit
from ..proof.certificate.branch_and_bound import GAP
from ..proof.certificate.certificate import Certificate, CertificateStatus
from ..system.journal import JournalFile, line_of, row_of
from .kept import journal_in_force
from .starts import Optimum, Start, StartStatus
from .status import Status

#: Number of points of the box at which values of programs are compared.
_POINTS = 3
#: Significant digits of the values that distinguish two searches, and part of the largest value of an array below which
#: another value is rounding.
_DIGITS, _ROUNDING = 12, 1e-14


class KeptSearch(NamedTuple):
    """Entry of the journal: outcome of a search of a program. Numbers are texts, to keep every digit and infinity.

    Attributes:
        key: text that identifies the search.
        status: value of the status.
        x, lower, upper: best point, and bounds of the last searched program.
        pairs: constraints of limits on pairs that were added to the program.
        has_evidence: If true, evidence of optimality exists at ``x``.
        starts: status, objective, stationarity, violation, iterations, solver and point of each start.
        optima: objective, count, spread and point of each distinct optimum.
        relaxation: key, unit, dimension, limit and needed value of each limit to relax.
        seed, seconds, better: fields of :class:`.multistart.ProgramSolution`.
    """

    key: str
    status: str
    x: str
    lower: str
    upper: str
    pairs: tuple[tuple[int, ...], ...]
    has_evidence: bool
    starts: tuple[tuple[str, ...], ...]
    optima: tuple[tuple[str, ...], ...]
    relaxation: tuple[tuple[str, ...], ...]
    seed: int
    seconds: float
    better: str


class KeptCertificate(NamedTuple):
    """Entry of the journal: certificate of a program.

    Attributes:
        key: text that identifies the search.
        x: incumbent; None without an incumbent.
        numbers: fields with real values, by name, as texts.
        words: fields with texts, by name.
        counts: fields with whole numbers and truth values, by name.
        history: history of the certificate.
    """

    key: str
    x: str | None
    numbers: Mapping[str, str]
    words: Mapping[str, str]
    counts: Mapping[str, int | bool]
    history: tuple[tuple[float, ...], ...]


_NUMBERS, _WORDS = ("incumbent", "bound", "allowed", "seconds", "bound_of_tree"), ("engine", "reason", "scope")
_COUNTS = ("boxes", "open", "is_relative", "was_beaten", "in_other_mode")


class SearchJournal(JournalFile):
    """Completed searches and certificates, in a file.

    Args:
        path: name of the file; a missing file is created.

    Raises:
        InputError: the file cannot be written, is no journal of this version, or is locked by another process.
    """

    def __init__(self, path: Path) -> None:
        self._kept: dict[str, KeptSearch | KeptCertificate] = {}
        super().__init__(
            path, {"screwsynth": "searches", "version": __version__}, "command", "choose another --resume, or remove it"
        )

    def load_entry(self, place: int, line: bytes) -> None:
        """Keep in memory an entry that was read from the file."""
        del place
        with suppress(ValueError):
            try:
                entry: KeptSearch | KeptCertificate = row_of(KeptSearch, line)
            except ValueError:
                entry = row_of(KeptCertificate, line)
            self._kept[entry.key] = entry

    def __len__(self) -> int:
        return len(self._kept)

    def __getitem__(self, key: str) -> KeptSearch | KeptCertificate | None:
        """Return the entry of the journal with a key, or None."""
        return self._kept.get(key)

    def add(self, entry: KeptSearch | KeptCertificate) -> None:
        """Append an entry to the journal.

        Raises:
            InputError: the file cannot be written.
        """
        self._kept[entry.key] = entry
        self.append([line_of(entry)])

    def search(
        self, nlp: Nlp, search: Search, first: Sequence[FloatArray], solve: Callable[[], Any], make: Callable[..., Any]
    ) -> Any:  # noqa: ANN401 - as in Keeper
        """Return the solution of a search from the journal; without an entry, search and add the solution.

        See :class:`.Keeper`.
        """
        key = _key_of(nlp, repr(search), *first)
        known = self[key]
        if isinstance(known, KeptSearch):
            with suppress(ValueError, LookupError):  # the file may be damaged or written by another program
                return make(**_fields_of(known, nlp))
        found = solve()
        if not is_requested():  # a stopped search has no outcome
            self.add(_entry_of(key, found))
        return found

    @property
    def words(self) -> str:
        """Number of entries, and the way to resume, in words."""
        return f"{self.count}: the same command continues from there" if self._kept else "no search is complete"

    @property
    def count(self) -> str:
        """Number of entries, with the name of the file."""
        return f"{len(self):,} search{'es are' if len(self) != 1 else ' is'} in {self.path}"


def _key_of(nlp: Nlp, settings: str, *points: FloatArray) -> str:
    """Return a text that identifies a search, in any unit.

    The last digits of values are left out: a repeated command may compute a program's constants with other rounding.
    """
    program = nlp.program
    names = [[each.name for each in group] for group in (program.variables, program.constraints, program.arguments)]
    values = [nlp.arguments, nlp.lower, nlp.upper, nlp.g_lower, nlp.g_upper, *points]
    for share in np.random.default_rng(0).random((_POINTS, nlp.n)):
        at = nlp.evaluate(nlp.lower + share * (nlp.upper - nlp.lower))
        values.append(np.append(at.g, at.F))
    # A value that is rounding compared with the largest of its array is 0.
    shown = [
        f"{0.0 if abs(each) <= _ROUNDING * size else each:.{_DIGITS}g}"
        for group in values
        for size in [float(np.max(np.abs(group), initial=0.0, where=np.isfinite(group)))]
        for each in np.ravel(group).tolist()
    ]
    return hashlib.sha256(repr((names, nlp.sense.value, nlp.in_home_mode, settings, shown)).encode()).hexdigest()[:32]


def _text(values: FloatArray) -> str:
    return " ".join(map(repr, values.tolist()))


def _vector(text: str, count: int) -> FloatArray:
    """Return an array (n,) from a text.

    Raises:
        ValueError: the text does not have ``count`` values.
    """
    values = [float(part) for part in text.split()]
    if len(values) != count:
        raise ValueError(f"the entry belongs to another nonlinear program: expected {count} values, got {len(values)}")
    return frozen_array(values, (count,))


def _entry_of(key: str, found: Any) -> KeptSearch:  # noqa: ANN401 - as above
    """Return the journal entry of a solution."""
    nlp: Nlp = found.nlp
    return KeptSearch(
        key,
        found.status.value,
        _text(found.x),
        _text(nlp.lower),
        _text(nlp.upper),
        tuple(tuple(place) for place in nlp.pairs),
        found.evidence is not None,
        tuple(
            (
                *(each.status.name, repr(each.F), repr(each.stationarity), repr(each.violation)),
                *(str(each.iterations), each.solver, _text(each.x)),
            )
            for each in found.starts
        ),
        tuple((repr(each.F), str(each.count), repr(each.spread), _text(each.x)) for each in found.optima),
        tuple(
            (each.key, each.unit, each.dimension.value, repr(each.limit), repr(each.needed))
            for each in found.relaxation
        ),
        found.seed,
        found.seconds,
        "" if found.better is None else repr(found.better),
    )


def _fields_of(kept: KeptSearch, nlp: Nlp) -> Mapping[str, Any]:
    """Return the fields of a solution from an entry; state and evidence are computed again.

    Raises:
        ValueError, LookupError: the entry belongs to another program.
    """
    nlp = with_pairs(nlp, [PairPlace(*place) for place in kept.pairs])
    nlp = replace(nlp, lower=_vector(kept.lower, nlp.n), upper=_vector(kept.upper, nlp.n))
    x = _vector(kept.x, nlp.n)
    return {
        "status": Status(kept.status),
        "nlp": nlp,
        "x": x,
        "state": state_or_none(nlp, x),
        "evidence": examine(nlp, x) if kept.has_evidence else None,
        "starts": tuple(
            Start(StartStatus[status], _vector(at, nlp.n), float(F), float(still), float(outside), int(count), solver)
            for status, F, still, outside, count, solver, at in kept.starts
        ),
        "optima": tuple(
            Optimum(float(F), int(count), _vector(at, nlp.n), float(spread), examine(nlp, _vector(at, nlp.n)), nlp)
            for F, count, spread, at in kept.optima
        ),
        "seed": kept.seed,
        "seconds": kept.seconds,
        "relaxation": tuple(
            RelaxedLimit(key=key, limit=float(limit), needed=float(needed), unit=unit, dimension=Dimension(dimension))
            for key, unit, dimension, limit, needed in kept.relaxation
        ),
        "better": float(kept.better) if kept.better else None,
    }


def kept_certificate(
    nlp: Nlp,
    x: FloatArray | None,
    certified: Callable[[], Certificate],
    *,
    gap: float = GAP,
    above: float | None = None,
) -> Certificate:
    """Return the certificate of a program from the active journal; without an entry, certify the program and add it.

    A certificate that an interrupt or the time limit cuts short is not kept.

    Args:
        nlp: the nonlinear program.
        x: (n,) incumbent; None without an incumbent.
        certified: function that certifies the program, beginning with the incumbent.
        gap: requested gap, as for :func:`.certify_program`.
        above: value of F to prove as a lower bound, as for :func:`.certify_program`.
    """
    journal = journal_in_force()
    if not isinstance(journal, SearchJournal):
        return certified()
    key = _key_of(nlp, f"certificate {gap!r} {above!r}", *([] if x is None else [x]))
    known = journal[key]
    if isinstance(known, KeptCertificate):
        with suppress(ValueError, LookupError, TypeError):
            values: dict[str, Any] = {
                **{name: float(known.numbers[name]) for name in _NUMBERS},
                **{name: known.words[name] for name in _WORDS},
                **{name: known.counts[name] for name in _COUNTS},
            }
            history, status = tuple((a, b, c) for a, b, c in known.history), CertificateStatus(known.words["status"])
            at = None if known.x is None else _vector(known.x, nlp.n)
            return Certificate(status, nlp, at, above=above, history=history, **values)
    found = certified()
    if found.status is not CertificateStatus.INCOMPLETE or not is_requested():
        journal.add(
            KeptCertificate(
                key,
                None if found.x is None else _text(found.x),
                {name: repr(float(getattr(found, name))) for name in _NUMBERS},
                {"status": found.status.value, **{name: getattr(found, name) for name in _WORDS}},
                {name: getattr(found, name) for name in _COUNTS},
                found.history,
            )
        )
    return found

"""Proof of the best combination of values of listed numbers: bounds of parts that hold all combinations together.

A part that the solve left out is proved with its numbers free between the ends of their values, and divided into its
combinations where that bound is too wide. A part far from the best combination needs no narrow bound: its gap is as
wide as the best one allows.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, NamedTuple, Protocol, TypeVar

from ..case.case import Case
from ..case.choices import Ranges, listed_numbers, within_ranges
from ..interruption import is_requested, seconds_left, why_stopped, within
from ..proof.certificate.certificate import Certificate, CertificateStatus
from .choices import combinations_of, exists
from .solution import Choice, ChoicePart

#: Gaps of parts: as a part of the one asked for, so that a part as good as the best combination is not divided; and the
#: widest one.
_NARROWEST, _WIDEST = 0.5, 0.5
#: Part of a gap by which a bound may exceed it and still count as met: rounding.
_ROUNDING = 1e-6


class _Proved(Protocol):
    """A case with certificates: of each task, and of the program that decides."""

    @property
    def tasks(self) -> tuple[Certificate, ...]: ...

    @property
    def certificate(self) -> Certificate | None: ...


Proved = TypeVar("Proved", bound=_Proved)


class ChoiceProof(NamedTuple, Generic[Proved]):
    """Proof over all combinations of values.

    Attributes:
        best: the best combination, proved by itself.
        chosen: ranges of this combination.
        certificate: of all combinations together; None where no program combines the tasks of the best one.
    """

    best: Proved
    chosen: Ranges
    certificate: Certificate | None


def prove_choices(
    case: Case, choice: Choice, prove: Callable[[Case, float], Proved], gap: float, *, is_each: bool
) -> ChoiceProof[Proved]:
    """Prove a bound over all combinations of values of a case's listed numbers.

    Args:
        case: the case.
        choice: from its solve.
        prove: certifies a case without listed numbers to a gap.
        gap: allowed distance of the bound from the incumbent, as a part of the incumbent.
        is_each: whether every combination is proved by itself, as for a value that F is to be above.
    """
    began = time.perf_counter()
    numbers, chosen = listed_numbers(case), choice.chosen
    parts = [part for part in choice.parts if part.ranges != choice.chosen]
    if is_each:
        parts = [each for part in parts for each in _combinations_in(part, choice.chosen)]
    with within(_share(parts)):
        best = prove(within_ranges(case, numbers, choice.chosen), gap)
    first = _deciding(best)
    if first is None:
        return ChoiceProof(best, chosen, None)
    known = first
    found, boxes, unknown = [first], 0, ""
    while parts and not unknown and known.status is not CertificateStatus.REFUSED:
        if is_requested():
            unknown = why_stopped()
            break
        part = parts.pop()
        if _is_one(part) and not exists(case, numbers, part.ranges):
            continue
        is_better = part.cost is not None and part.cost < _cost(known, known.incumbent) - known.allowed
        if is_better and not _is_one(part):  # as an earlier end of the solve may leave one
            parts += _combinations_in(part, choice.chosen)
            continue
        with within(_share(parts)):
            answer = prove(within_ranges(case, numbers, part.ranges), _gap_of(part, known, gap))
        certificate = _deciding(answer)
        if certificate is None:
            unknown = "the tasks of a combination cannot be combined"
            continue
        is_refused = certificate.status is CertificateStatus.REFUSED
        if _is_one(part) and (is_refused or _cost(certificate, certificate.incumbent) < _cost(known, known.incumbent)):
            best, chosen, known = answer, part.ranges, certificate
        is_final = _is_one(part) and part.cost is None
        if is_final or _is_met(certificate.bound, certificate, known):
            found.append(certificate)
            continue
        # Its gap was too wide: a better point than that of the solve was found.
        boxes += certificate.boxes
        parts += [ChoicePart(part.ranges, None)] if _is_one(part) else _combinations_in(part, choice.chosen)
    together = _together(known, first, found, choice.combinations, boxes, unknown)
    return ChoiceProof(best, chosen, _at_end(together, time.perf_counter() - began))


def _deciding(answer: _Proved) -> Certificate | None:
    """Return the certificate that decides; that of a task which has no point within the limits stands for all."""
    none = (each for each in answer.tasks if each.status is CertificateStatus.INFEASIBLE)
    return next(none, answer.certificate)


def _together(
    known: Certificate, first: Certificate, found: Sequence[Certificate], count: int, boxes: int, unknown: str
) -> Certificate:
    """Return the certificate of all combinations.

    Args:
        known: of the best combination.
        first: of the combination that the solve found best.
        found: of the parts that hold all combinations.
        count: number of combinations.
        boxes: number of boxes examined beside those of these certificates.
        unknown: why some combinations are in none of these; empty where all are.
    """
    possible = [each for each in found if each.status is not CertificateStatus.INFEASIBLE]
    bounds = [known.nlp.sign * each.bound for each in possible]
    bound = -math.inf if unknown else min(bounds, default=math.nan)
    reason = unknown or next((each.reason for each in possible if each.reason), "")
    status = CertificateStatus.PROVED
    if known.status is CertificateStatus.REFUSED:
        status, reason = CertificateStatus.REFUSED, known.reason
    elif not possible and not unknown:
        status = CertificateStatus.INFEASIBLE
    elif reason or any(each.status is not CertificateStatus.PROVED for each in possible):
        status = CertificateStatus.INCOMPLETE
    elif known.above is None and not all(_is_met(each.bound, each, known) for each in possible):
        status, reason = CertificateStatus.INCOMPLETE, "the bounds of some combinations are wider than asked for"
    return replace(
        known,
        status=status,
        bound=known.nlp.sign * bound,
        was_beaten=known.was_beaten or known is not first,
        boxes=boxes + sum(each.boxes for each in found),
        open=sum(each.open for each in found),
        reason=reason,
        scope=f"with any of the {count:,} combinations of values",
    )


def _at_end(certificate: Certificate, seconds: float) -> Certificate:
    """Return a certificate with the time of the whole search, of which only the end is known."""
    is_known = math.isfinite(certificate.bound) and math.isfinite(certificate.incumbent)
    history = ((seconds, certificate.bound, certificate.incumbent),) if is_known else ()
    return replace(certificate, seconds=seconds, history=history)


def _share(parts: Sequence[ChoicePart]) -> float | None:
    """Return the seconds for one part beside so many others; None without a limit."""
    return None if math.isinf(seconds_left()) else seconds_left() / (1 + len(parts))


def _is_met(bound: float, certificate: Certificate, known: Certificate) -> bool:
    """Return whether a bound is no better than the best combination known by more than the gap asked for."""
    return _cost(certificate, bound) >= _cost(known, known.incumbent) - (1 + _ROUNDING) * known.allowed


def _combinations_in(part: ChoicePart, chosen: Ranges) -> list[ChoicePart]:
    """Return the combinations in a part but for the chosen one, which is proved already."""
    return [ChoicePart(each, None) for each in combinations_of(part.ranges) if each != chosen]


def _is_one(part: ChoicePart) -> bool:
    """Return whether a part is one combination."""
    return all(behind - first == 1 for first, behind in part.ranges)


def _cost(certificate: Certificate, value: float) -> float:
    """Return a number of an objective, the smaller the better; infinite for an infeasible program, or without one."""
    is_none = certificate.status is CertificateStatus.INFEASIBLE or math.isnan(value)
    return math.inf if is_none else certificate.nlp.sign * value


def _gap_of(part: ChoicePart, known: Certificate, gap: float) -> float:
    """Return the gap to which a part is proved: its bound is to be no better than the best combination allows."""
    best = _cost(known, known.incumbent)
    if not part.cost or math.isinf(best):
        return gap
    return min(max((part.cost - best + known.allowed) / abs(part.cost), _NARROWEST * gap), _WIDEST)

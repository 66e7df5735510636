"""Proof of the best combination of listed values, from bounds of parts that together cover all combinations.

A part that the solve skipped is bounded with its parameters free between their smallest and largest values. The
part is split into its combinations if this bound is too wide. The gap of a part far from the best combination may be
wide.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, NamedTuple, Protocol, TypeVar

from ..case.case import Case
from ..case.choices import Ranges, catalogue_dimensions, within_ranges
from ..interruption import is_requested, seconds_left, why_stopped, within
from ..proof.certificate.certificate import Certificate, CertificateStatus
from .choices import combinations_of, exists
from .solution import Choice, ChoicePart

#: Gaps of parts: smallest one relative to the requested gap, so that a part as good as the best combination is not
#: split; and largest one.
_NARROWEST, _WIDEST = 0.5, 0.5
#: Part of a gap by which a bound may exceed the gap and still meets it: rounding.
_ROUNDING = 1e-6


class _Proved(Protocol):
    """Certificates of a case: of each task, and of the deciding program."""

    @property
    def tasks(self) -> tuple[Certificate, ...]: ...

    @property
    def certificate(self) -> Certificate | None: ...


Proved = TypeVar("Proved", bound=_Proved)


class ChoiceProof(NamedTuple, Generic[Proved]):
    """Proof over all combinations of listed values.

    Attributes:
        best: certificates of the best combination.
        chosen: index ranges of the best combination.
        certificate: certificate over all combinations; None if the tasks have no common nonlinear program.
    """

    best: Proved
    chosen: Ranges
    certificate: Certificate | None


def prove_choices(
    case: Case, choice: Choice, prove: Callable[[Case, float], Proved], gap: float, *, is_each: bool
) -> ChoiceProof[Proved]:
    """Prove a bound over all combinations of listed values of a case.

    Args:
        case: the case.
        choice: search over the combinations from the solve of the case.
        prove: function that certifies a case without listed values to a gap.
        gap: allowed relative difference between bound and incumbent.
        is_each: If true, certify every combination separately, as for a lower bound on F.
    """
    began = time.perf_counter()
    numbers, chosen = catalogue_dimensions(case), choice.chosen
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
        if is_better and not _is_one(part):  # a solve that ended early may leave such a part
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
        # The gap was too wide: the solve missed a better point.
        boxes += certificate.boxes
        parts += [ChoicePart(part.ranges, None)] if _is_one(part) else _combinations_in(part, choice.chosen)
    together = _together(known, first, found, choice.combinations, boxes, unknown)
    return ChoiceProof(best, chosen, _at_end(together, time.perf_counter() - began))


def _deciding(answer: _Proved) -> Certificate | None:
    """Return the deciding certificate; a task without any feasible point decides for all tasks."""
    none = (each for each in answer.tasks if each.status is CertificateStatus.INFEASIBLE)
    return next(none, answer.certificate)


def _together(
    known: Certificate, first: Certificate, found: Sequence[Certificate], count: int, boxes: int, unknown: str
) -> Certificate:
    """Return the certificate over all combinations.

    Args:
        known: certificate of the best combination.
        first: certificate of the best combination of the solve.
        found: certificates of the parts that cover all combinations.
        count: number of combinations.
        boxes: number of examined boxes that these certificates do not count.
        unknown: reason why some combinations are not covered; empty if all are covered.
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
        status, reason = CertificateStatus.INCOMPLETE, "the gaps of some combinations are wider than requested"
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
    """Return a certificate with the time of the whole search, and only the final entry in its history."""
    is_known = math.isfinite(certificate.bound) and math.isfinite(certificate.incumbent)
    history = ((seconds, certificate.bound, certificate.incumbent),) if is_known else ()
    return replace(certificate, seconds=seconds, history=history)


def _share(parts: Sequence[ChoicePart]) -> float | None:
    """Return the seconds for one of several parts; None without a time limit."""
    return None if math.isinf(seconds_left()) else seconds_left() / (1 + len(parts))


def _is_met(bound: float, certificate: Certificate, known: Certificate) -> bool:
    """Return whether a bound is within the requested gap of the best known combination."""
    return _cost(certificate, bound) >= _cost(known, known.incumbent) - (1 + _ROUNDING) * known.allowed


def _combinations_in(part: ChoicePart, chosen: Ranges) -> list[ChoicePart]:
    """Return the combinations of a part, except the chosen combination, which is already certified."""
    return [ChoicePart(each, None) for each in combinations_of(part.ranges) if each != chosen]


def _is_one(part: ChoicePart) -> bool:
    """Return whether a part has only one combination."""
    return all(behind - first == 1 for first, behind in part.ranges)


def _cost(certificate: Certificate, value: float) -> float:
    """Return the objective as a cost to be minimised; infinite for an infeasible program, or without a value."""
    is_none = certificate.status is CertificateStatus.INFEASIBLE or math.isnan(value)
    return math.inf if is_none else certificate.nlp.sign * value


def _gap_of(part: ChoicePart, known: Certificate, gap: float) -> float:
    """Return the gap with which a certificate proves that a part has no better combination."""
    best = _cost(known, known.incumbent)
    if not part.cost or math.isinf(best):
        return gap
    return min(max((part.cost - best + known.allowed) / abs(part.cost), _NARROWEST * gap), _WIDEST)

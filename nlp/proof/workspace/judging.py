"""Steps of a judgement over any domain: ranks first, then quantities, with the use of earlier verdicts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ...case.case import Case
from ...case.task import Sense
from ...interruption import is_requested
from ..statement.claims import REGULAR, Claim
from ..statement.tolerance import Directions
from .judgement import Judgement
from .numbers.extremes import DEFAULT, NumberSearch
from .numbers.searched import Subject, searched_extremes
from .numbers.strokes import stroke_verdicts
from .verdict import Outcome, Verdict, not_judged

if TYPE_CHECKING:
    from ...case.workspace import Workspace

#: Beginning of the names of leg lengths.
_LENGTH = "leg_length limb "
#: Reason for ranks that are not judged.
_SAMPLED = "a sampled pose violates a limit"


class Judging(ABC):
    """Judgement of a robot over a domain (a box of poses or a tool path), in progress.

    Args:
        case: the case, its dimensions fixed.
        workspace: box that contains the domain's poses, with the dependent coordinates.
        measures: names of quantities of the robot whose smallest and largest values are requested.
        search: requested gap, threads, and recorder for a proof file.
        until_fault: If true, stop at the first claim about a rank or limit that is not proved.

    Attributes:
        case, workspace, measures, search, until_fault: the arguments.
        has_numbers: whether quantities can be judged.
        verdicts: verdicts so far, by claim. A finer verdict replaces an earlier verdict on the same claim.
    """

    def __init__(
        self,
        case: Case,
        workspace: Workspace,
        measures: Sequence[str] = (),
        search: NumberSearch = DEFAULT,
        *,
        until_fault: bool = False,
    ) -> None:
        self.case, self.workspace, self.measures = case, workspace, measures
        self.search, self.until_fault = search, until_fault
        self.has_numbers = True
        self.verdicts: dict[Claim, Verdict] = {}

    def judgement(self, *, with_numbers: bool = True) -> Judgement:
        """Return the judgement; with ``with_numbers`` false it has only the verdicts on ranks."""
        sampled = self.sampled_fault() if with_numbers and self.until_fault else None
        if sampled is not None and (fault := self.shown(sampled)).outcome is Outcome.REFUTED:
            return Judgement(self.case, self.workspace, (not_judged(REGULAR, _SAMPLED), fault))
        for each in self.ranks():
            self.verdicts[each.claim] = each
        if with_numbers and self.has_numbers and not self._is_over():
            for each in self._numbers():
                self.verdicts[each.claim] = each
                if self._is_over():
                    break
        return Judgement(self.case, self.workspace, tuple(map(self.shown, self.verdicts.values())))

    def _is_over(self) -> bool:
        """Return whether the judgement ends because a claim has failed."""
        return self.until_fault and any(each.fails for each in self.verdicts.values())

    def _numbers(self) -> Iterator[Verdict]:
        """Yield the verdicts on quantities.

        If a stroke needs leg lengths with a smaller gap, these come again before the stroke.
        """
        yield from self.expressions()
        lengths = [each for each in self.verdicts.values() if each.name.startswith(_LENGTH)]
        subject = self.subject(min((each.bound for each in lengths if each.sense is Sense.MIN), default=0.0))
        yield from stroke_verdicts(subject, lengths, partial(self._finer_length, [each.claim for each in lengths]))
        yield from searched_extremes(subject, self.measures, self.search)
        yield from self.actuators(subject)

    def _finer_length(
        self, claims: Sequence[Claim], leg: int, sense: Sense, gap: float, about: Directions | None
    ) -> Verdict | None:
        """Return the verdict on a leg length with a smaller gap; None if the work is requested to stop."""
        if is_requested():
            return None
        claim = next(each for each in claims if each.legs == (leg,) and each.sense is sense)
        return self.finer(claim, gap, about)

    def sampled_fault(self) -> Verdict | None:
        """Return a limit that a sampled pose violates; None if none is found, or without samples."""
        return None

    @abstractmethod
    def ranks(self) -> Iterator[Verdict]:
        """Yield the verdict on the rank of J, and on the rank of the constraint wrenches if the robot has any."""

    @abstractmethod
    def expressions(self) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of the pose: reach, limits, leg lengths, requested quantities, F."""

    @abstractmethod
    def subject(self, shortest: float) -> Subject:
        """Return the robot for the searches of clearances, singular values and actuator quantities.

        ``shortest`` is a lower bound of its leg lengths.
        """

    @abstractmethod
    def actuators(self, subject: Subject) -> Iterator[Verdict]:
        """Yield the verdicts on actuator forces, speeds and powers, and on pose errors."""

    @abstractmethod
    def finer(self, claim: Claim, gap: float, about: Directions | None) -> Verdict | None:
        """Judge a leg length again with a smaller gap; return None if the domain has no such search.

        If directions are given, the claim is about the length minus the components of the joint-centre errors along
        these directions. These components are the same at every pose.
        """

    def shown(self, verdict: Verdict) -> Verdict:
        """Return a verdict as the judgement reports it."""
        return verdict

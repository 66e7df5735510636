"""Steps of a judgement that are the same over every domain: ranks first, then numbers, each from earlier verdicts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ...case.case import Case
from ...case.task import Sense
from ...interruption import is_requested
from ..statement.claims import Claim
from ..statement.tolerance import Directions
from .judgement import Judgement
from .numbers.extremes import DEFAULT, NumberSearch
from .numbers.searched import Subject, searched_extremes
from .numbers.strokes import stroke_verdicts
from .verdict import Verdict

if TYPE_CHECKING:
    from ...case.workspace import Workspace

#: Beginning of the names of leg lengths.
_LENGTH = "leg_length limb "


class Judging(ABC):
    """A judgement in progress, of a robot over a domain.

    Args:
        case: the case, its dimensions fixed.
        workspace: box of the domain's poses, with its dependent coordinates.
        measures: names of measures of the robot whose smallest and largest values are requested.
        search: gap, threads and record of the searches.
        until_fault: whether the work ends at the first rank or limit that is not proved.

    Attributes:
        case, workspace, measures, search, until_fault: the arguments.
        has_numbers: whether numbers can be judged.
        verdicts: the verdicts so far, by claim. A finer verdict on a claim takes the place of the one before.
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
        """Return the judgement; of ranks alone where numbers are left out."""
        for each in self.ranks():
            self.verdicts[each.claim] = each
        if with_numbers and self.has_numbers and not self._is_over():
            for each in self._numbers():
                self.verdicts[each.claim] = each
                if self._is_over():
                    break
        return Judgement(self.case, self.workspace, tuple(map(self.shown, self.verdicts.values())))

    def _is_over(self) -> bool:
        """Return whether a claim fails after which nothing else is judged."""
        return self.until_fault and any(each.fails for each in self.verdicts.values())

    def _numbers(self) -> Iterator[Verdict]:
        """Yield the verdicts on numbers; leg lengths that a stroke needs more finely come again before it."""
        yield from self.expressions()
        lengths = [each for each in self.verdicts.values() if each.name.startswith(_LENGTH)]
        subject = self.subject(min((each.bound for each in lengths if each.sense is Sense.MIN), default=0.0))
        yield from stroke_verdicts(subject, lengths, partial(self._finer_length, [each.claim for each in lengths]))
        yield from searched_extremes(subject, self.measures, self.search)
        yield from self.actuators(subject)

    def _finer_length(
        self, claims: Sequence[Claim], leg: int, sense: Sense, gap: float, about: Directions | None
    ) -> Verdict | None:
        """Return a leg length that is proved more finely; None where the work is requested to stop."""
        if is_requested():
            return None
        claim = next(each for each in claims if each.legs == (leg,) and each.sense is sense)
        return self.finer(claim, gap, about)

    @abstractmethod
    def ranks(self) -> Iterator[Verdict]:
        """Yield the verdict on the rank of J, and that on the constraint wrenches of a robot that has them."""

    @abstractmethod
    def expressions(self) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of the pose: reach, limits, leg lengths, measures, F of the tasks."""

    @abstractmethod
    def subject(self, shortest: float) -> Subject:
        """Return the robot of which the other numbers are; none of its legs is shorter than a length."""

    @abstractmethod
    def actuators(self, subject: Subject) -> Iterator[Verdict]:
        """Yield the verdicts on actuators under loads and in motions, and on errors of the pose."""

    @abstractmethod
    def finer(self, claim: Claim, gap: float, about: Directions | None) -> Verdict | None:
        """Return the verdict on a leg length with a finer gap; None where there is none.

        With directions it is the length less the part of its errors along them, which no pose changes.
        """

    def shown(self, verdict: Verdict) -> Verdict:
        """Return a verdict as the judgement has it."""
        return verdict

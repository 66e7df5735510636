"""Judgement of a robot over a domain: the verdicts on all claims."""

from __future__ import annotations

from dataclasses import dataclass

from ...case.case import Case
from ...case.task import Sense
from ...case.workspace import Workspace
from ...path.path import ProgrammedPath
from ..statement.claims import CONSTRAINTS, REGULAR
from .path_knots import Knots
from .verdict import Fault, Outcome, Verdict


@dataclass(frozen=True, eq=False)
class Judgement:
    """Verdicts on a robot over a domain; with a joint-centre tolerance, on every robot within the tolerance.

    Attributes:
        case: the case, its dimensions fixed.
        workspace: box of poses, with its dependent coordinates; for a tool path, a box that contains the path.
        verdicts: verdicts on ranks, then on quantities: reach of limbs, limits, leg lengths,
            requested quantities, F, actuators.
        tool_path: the tool path; None for a box of poses.
        knots: knots of the path with the robot's joint coordinates; None if none were requested.
    """

    case: Case
    workspace: Workspace
    verdicts: tuple[Verdict, ...]
    tool_path: ProgrammedPath | None = None
    knots: Knots | None = None

    @property
    def path(self) -> ProgrammedPath:
        """The tool path.

        Raises:
            TypeError: the judgement is about a box of poses.
        """
        if self.tool_path is None:
            raise TypeError("a judgement over a box of poses has no tool path")
        return self.tool_path

    @property
    def dependent(self) -> tuple[str, ...]:
        """Names of the dependent coordinates of the pose."""
        return self.workspace.dependent_names

    @property
    def ranks(self) -> tuple[Verdict, ...]:
        """Verdicts on the rank of J, and on the rank of the constraint wrenches if the robot has any."""
        return tuple(each for each in self.verdicts if each.is_rank)

    @property
    def regularity(self) -> Verdict:
        """Verdict on the claim that J has full rank at every pose."""
        return next(each for each in self.verdicts if each.name == REGULAR)

    @property
    def constraints(self) -> Verdict | None:
        """Verdict on the claim that the constraint wrenches keep their rank; None without constraint wrenches."""
        return next((each for each in self.verdicts if each.name == CONSTRAINTS), None)

    @property
    def extremes(self) -> tuple[Verdict, ...]:
        """Verdicts on the smallest and largest values of quantities."""
        return tuple(each for each in self.verdicts if not each.is_rank)

    @property
    def faults(self) -> dict[tuple[str, Sense], Fault]:
        """First known points of a path that refute limits, by label; only points before the point of the verdict."""
        return {(each.name, each.sense): each.fault for each in self.verdicts if each.fault is not None}

    @property
    def is_regular(self) -> bool:
        """Whether all ranks are proved to be full."""
        return not any(each.fails for each in self.ranks)

    @property
    def is_proved(self) -> bool:
        """Whether all ranks and limits are proved, and the requested largest distance from the path."""
        return not any(each.fails for each in self.verdicts) and (self.knots is None or not self.knots.reason)

    @property
    def is_refuted(self) -> bool:
        """Whether a pose is known that is singular or violates a limit of the case."""
        return any(each.outcome is Outcome.REFUTED for each in self.verdicts)

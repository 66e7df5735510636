"""Claims that a proof of a workspace must name, one by one, and comparison of a proof with its case."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .....models import Model, WrenchKind
from .....models.joints import RobotError
from .....models.joints.closedform import closed_form
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.legs import Actuator
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.task import Sense
from ....case.workspace import Workspace
from ....program.layout import Layout
from ...statement.claims import CONSTRAINTS, REGULAR, SPECTRAL, Claim, asked_name, asked_spectra, claims_of
from ...statement.machine import Legs, legs_of
from ...statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..premises import exact
from ..proof_file import ProofError, WorkspaceProof, workspace_numbers
from .pose_boxes import pose_root
from .tolerance import Machines

#: Names of the errors of the pose: of its position and of its rotation.
ERRORS = ("position error", "rotation error")
#: Part of a limit by which a bound may be beyond it and still count as on it: rounding, as in the search.
_ON_LIMIT = 1e-9
#: Part of the largest coordinate by which joint centres may differ: the same case gives other last digits elsewhere.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class ExpectedClaim:
    """A claim about a case over its workspace.

    Attributes:
        name: in the words of the command.
        sense: ``min`` or ``max`` for a number, else empty.
        kind: ``regular``, ``constraints``, ``number``, ``stroke``, ``dead length``, ``clearance``, ``singular value``,
            ``condition`` or ``error``.
        limit: of the number, in the unit of its search; None without one.
        claim: of a number that the search of ``certify`` bounds.
        legs: indices of the two legs of a clearance, or of the leg of a stroke.
        length: by which moments are divided.
        layout: whose symbols the claim has; None for those of the other claims.
    """

    name: str
    sense: str
    kind: str
    limit: float | None = None
    claim: Claim | None = None
    legs: tuple[int, ...] = ()
    length: float = 1.0
    layout: Layout | None = None

    @property
    def key(self) -> tuple[str, str]:
        """Name and sense, which tell claims apart."""
        return self.name, self.sense

    def keep_limit(self, bound: float) -> None:
        """Refuse a bound beyond the limit of the case.

        Raises:
            ProofError: it is beyond.
        """
        if self.limit is None:
            return
        sign = 1.0 if self.sense == Sense.MAX.value else -1.0
        slack = _ON_LIMIT * max(abs(self.limit), abs(bound))
        if not sign * (bound - self.limit) <= slack:
            raise ProofError(f"the bound {bound:.10g} does not keep the case's limit {self.limit:.10g}")


@dataclass(frozen=True, eq=False)
class RobotClaims:
    """The robot that claims about a workspace are about.

    Attributes:
        legs: joint centres of six straight legs; None for another robot.
        layout: the case as symbols of the pose in which its numbers are bounded: without the unknowns that follow in
            closed form, where all limbs reach every pose.
        model: the robot without these unknowns, over whose poses its ranks are claimed.
        more: claims about constraint wrenches and reach; none about six straight legs.
        numbers_at: assemblies that its numbers are about, in words; empty for a robot without unknowns.
        machines: every machine within the tolerance, in whose symbols the numbers and ``more`` are then; None where
            the design is meant, or machines cannot be put together.
    """

    legs: Legs | None
    layout: Layout
    model: Model
    more: tuple[ExpectedClaim, ...] = ()
    numbers_at: str = ""
    machines: Machines | None = None


def robot_claims(case: Case, workspace: Workspace, reached: Collection[str]) -> RobotClaims:
    """Return the robot of a case, with the claims that robots beside six straight legs have.

    Args:
        case: with fixed dimensions.
        workspace: the poses.
        reached: names of those claims about reach that are proved.
    """
    legs, machines = legs_of(case), _machines(case, workspace)
    if machines is not None:
        reaches, _ = machines.symbols.claims(())
        more = [*_of_constraints(machines.model), *map(_of_number, reaches)]
        home = "the assembly of home" if case.model.unknowns else ""
        return RobotClaims(legs, machines.symbols.layout, machines.model, tuple(more), home, machines)
    closed = closed_form(case.model)
    more = _of_constraints(closed.model)
    numbers_at, layout = "every assembly" if case.model.unknowns else "", None
    if closed.reaches:
        place, claims = reach_claims(case, closed, workspace)
        more += [_of_number(each, place) for each in claims]
        if all(each.name in reached for each in claims):
            layout = closed_layout(case, closed, workspace)
            partly = "every assembly in which limbs in closed form are as at home"
            numbers_at = partly if closed.model.unknowns else "the assembly of home"
    return RobotClaims(legs, layout or posed_layout(case, workspace), closed.model, tuple(more), numbers_at)


def _of_constraints(model: Model) -> list[ExpectedClaim]:
    """Return the claim about the rank of a robot's constraint wrenches, if it has some."""
    return [ExpectedClaim(CONSTRAINTS, "", "constraints")] if has_constraints(model) else []


def _machines(case: Case, workspace: Workspace) -> Machines | None:
    """Return every machine within the case's tolerance; None for the design, or where machines are not known."""
    if not case.joint_centre_tolerance:
        return None
    try:
        return Machines(case, closed_form(case.model).model, workspace, pose_root(workspace))
    except RobotError:
        return None


def has_constraints(model: Model) -> bool:
    """Return whether a robot has constraint wrenches, of which a rank is claimed."""
    if model.generic is not None:
        return 0 < model.generic.constraints < 6
    return not model.members and any(row.kind is WrenchKind.COUPLE for row in model.wrenches)


def expected_claims(case: Case, robot: RobotClaims, quantities: Sequence[str], leg_error: float) -> list[ExpectedClaim]:
    """Return the claims about a case over its workspace.

    Args:
        case: the case.
        robot: its robot.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.

    Raises:
        InputError: the robot has no measure of a name.
    """
    claims = claims_of(robot.layout, [name for name in quantities if name not in SPECTRAL])
    every = [ExpectedClaim(REGULAR, "", "regular"), *robot.more, *map(_of_number, claims)]
    return every if robot.legs is None else [*every, *_of_legs(case, quantities, leg_error)]


def _of_number(claim: Claim, layout: Layout | None = None) -> ExpectedClaim:
    """Return the claim about a number that the search of ``certify`` bounds."""
    return ExpectedClaim(claim.name, claim.sense.value, "number", claim.limit, claim, layout=layout)


def _of_legs(case: Case, quantities: Sequence[str], leg_error: float) -> Iterator[ExpectedClaim]:
    """Yield the claims about six straight legs that have rules of their own."""
    names = [leg.name for leg in case.model.legs]
    stroke = next((each for each in case.limits if isinstance(each, Actuator)), None)
    for k, name in enumerate(names if stroke is not None else ()):
        for end, sense, kind in (("stroke_max", "max", "stroke"), ("dead_length", "min", "dead length")):
            limit = getattr(stroke, end)
            if limit is not None:
                yield ExpectedClaim(f"actuator.{end} limb {name}", sense, kind, limit, legs=(k,))
    yield from _of_limits(case, names)
    for name in asked_spectra(case, quantities):
        sense, kind = ("max", "condition") if name == ConditionNumber.key else ("min", "singular value")
        yield ExpectedClaim(asked_name(case, name), sense, kind, length=case.characteristic_length)
    if leg_error_of(case, leg_error) > 0:
        yield from (ExpectedClaim(name, "max", "error") for name in ERRORS)


def _of_limits(case: Case, names: Sequence[str]) -> Iterator[ExpectedClaim]:
    """Yield the limits on singular values, and on distances between legs with these names."""
    for each in case.limits:
        if isinstance(each, SmallestSingularValue):
            yield ExpectedClaim("smallest_singular_value", "min", "singular value", each.min, length=each.length)
        elif isinstance(each, ConditionNumber):
            yield ExpectedClaim("condition_number", "max", "condition", each.max, length=each.length)
        elif isinstance(each, LegClearance):
            for i, j in itertools.combinations(range(len(names)), 2):
                name = f"leg_clearance limbs {names[i]} and {names[j]}"
                yield ExpectedClaim(name, "min", "clearance", each.min, legs=(i, j))


def leg_error_of(case: Case, leg_error: float) -> float:
    """Return by how much a leg is off at most when its length and its joint centres are in error."""
    return leg_error + 2 * (case.joint_centre_tolerance or 0.0)


def hold_premises(case: Case, workspace: Workspace, legs: Legs | None, leg_error: float, proof: WorkspaceProof) -> None:
    """Refuse a proof whose file names other premises than those of the case; the check does without the file's.

    Args:
        case: the case.
        workspace: its poses.
        legs: its joint centres; None for a robot that is not six straight legs.
        leg_error: largest error of a leg's length.
        proof: the proof.

    Raises:
        ProofError: it is for another workspace, other joint centres or other errors.
    """
    if workspace_numbers(workspace) != proof.workspace:
        raise ProofError("the proof is for another workspace than this case's")
    if proof.leg_error != leg_error:
        stated = f"the proof is for legs that are off by at most {exact(proof.leg_error)} {case.units.length}"
        raise ProofError(f"{stated}, and not {exact(leg_error)}: see --leg-error")
    numbers = np.zeros((0, 3)) if legs is None else np.concatenate([legs.base, legs.platform])
    given = [list(each) for each in proof.legs]
    same = len(numbers) == len(given) and all(len(each) == 3 for each in given)
    if not same or not np.allclose(given or numbers, numbers, rtol=0.0, atol=_SAME * np.abs(numbers).max(initial=0.0)):
        raise ProofError("the proof is for other joint centres than this case's")
    if (case.joint_centre_tolerance or 0.0) != proof.tolerance:
        raise ProofError("the proof is for machines within another tolerance on joint centres than this case's")

"""Claims that a proof of a workspace must name, one by one, and comparison of a proof with its case."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Dimension, Model, WrenchKind
from .....models.joints import RobotError
from .....models.joints.closedform import closed_form
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.constraint import LENGTH, NUMBER, Reading
from ....case.limits.legs import Actuator
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.workspace import Workspace
from ....program.layout import Layout
from ...statement.claims import CONSTRAINTS, REGULAR, SPECTRAL, Claim, asked_name, asked_spectra, claims_of
from ...statement.machine import Legs, legs_of
from ...statement.posed_layout import closed_layout, posed_layout, reach_claims
from ...statement.tolerance import MachineLayout, PoseCoordinates, built_model, design_layout, machine_layout
from ..premises import exact
from ..proof_file import Premises, ProofError, workspace_numbers
from .motion_matrix import turned_rotation
from .pose_boxes import PoseRoot, pose_root

#: Errors of the pose, of its position and of its rotation, and how they read.
ERRORS = {"position error": LENGTH, "rotation error": Reading(Dimension.ANGLE)}
#: Part of the largest coordinate by which joint centres may differ: the same case gives other last digits elsewhere.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class ExpectedClaim:
    """A claim about a case over its workspace.

    Attributes:
        name: in the words of the command.
        sense: ``min`` or ``max`` for a number, else empty.
        kind: ``rank``, ``number``, ``lengths`` of a leg, ``clearance``, ``singular value`` or ``error``.
        reading: how the number of its search reads in results.
        limit: of this number; None without one.
        claim: of a number that the search of ``certify`` bounds.
        layout: whose symbols this claim has.
        legs: indices of the two legs of a clearance, or of the leg of whose lengths the number is made.
        weights: of the longest and of the shortest length of this leg.
        length: by which moments are divided.
    """

    name: str
    sense: str
    kind: str
    reading: Reading = NUMBER
    limit: float | None = None
    claim: Claim | None = None
    layout: Layout | None = None
    legs: tuple[int, ...] = ()
    weights: tuple[float, float] = (0.0, 0.0)
    length: float = 1.0

    @property
    def key(self) -> tuple[str, str]:
        """Name and sense, which tell claims apart."""
        return self.name, self.sense


class Machines:
    """Every machine within a tolerance on joint centres, as the check states it.

    With the derivatives g_j of a number g by the error of centre j, and the blocks H_jk of its second derivatives, the
    number of a machine within the tolerance t differs from that of the design by at most

        t sum_j |g_j| + t^2 / 2 sum_jk |H_jk|

    at each pose. The first sum is an expression of the pose. The second is shown to be at most the bound that the proof
    gives, over all poses and errors (:class:`~.number_claims.SecondOrderClaim`).

    Attributes:
        model: the robot of a case with fixed dimensions, without unknowns in closed form.
        root: the box of coordinates.
        symbols: the machines as symbols of one pose.

    Raises:
        RobotError: the robot cannot be put together with errors of its joint centres.
    """

    def __init__(self, case: Case, model: Model, root: PoseRoot) -> None:
        self._case, self.model, self.root = case, model, root

        def rotation(turn: SX) -> SX:
            """Return the rotation (3, 3) with coordinates (3, 1)."""
            turned, scale = turned_rotation(root, ca.vertsplit(turn))
            return turned / scale

        self._at = PoseCoordinates(root.values, rotation, root.ball)
        tolerance = case.joint_centre_tolerance or 0.0
        self.symbols: MachineLayout = machine_layout(case, built_model(case.model), tolerance, self._at)

    @cached_property
    def design(self) -> Layout:
        """The design as symbols of the pose; refuses a robot of which coordinates follow from others."""
        if self.model.unknowns:
            raise ProofError("numbers of machines with loops that are not in closed form have no proof")
        return design_layout(self._case, self.model, self._at)

    def varies(self, claim: Claim) -> bool:
        """Return whether a number changes with the errors."""
        errors = self.symbols.errors
        return bool(errors.numel()) and any(ca.which_depends(claim.expression, errors, 1, True))

    def number(self, claim: Claim, rest: float) -> SX:
        """Return a bound (1, 1) of a number over all machines in the symbols of the design, from the rest's bound."""
        errors, pose = self.symbols.errors, self.design.table.variables_vector
        slopes, sign = ca.densify(ca.gradient(claim.expression, errors)), claim.sense.sign
        squares = [ca.sumsqr(slopes[k : k + 3]) for k in range(0, errors.numel(), 3)]
        small = self.symbols.near_zero(claim.expression, self.design).tolist()
        first = sum((ca.sqrt(each + size**2) for each, size in zip(squares, small, strict=True)), SX(0))
        whole = claim.expression + sign * (self.symbols.tolerance * first + rest)
        return self.symbols.of(whole, SX.zeros(errors.numel()), pose)


@dataclass(frozen=True, eq=False)
class RobotClaims:
    """The robot that claims about a workspace are about.

    Attributes:
        legs: joint centres of six straight legs; None for another robot.
        layout: the case as symbols of the pose in which its numbers are bounded: without the unknowns that follow in
            closed form, where all limbs reach every pose.
        model: the robot without these unknowns, over whose poses its ranks are claimed.
        reaches: claims that limbs reach every pose.
        numbers_at: assemblies that its numbers are about, in words; empty for a robot without unknowns.
        machines: every machine within the tolerance, in whose symbols the numbers and ``reaches`` are then; None where
            the design is meant, or machines cannot be put together.
    """

    legs: Legs | None
    layout: Layout
    model: Model
    reaches: tuple[ExpectedClaim, ...] = ()
    numbers_at: str = ""
    machines: Machines | None = None


def robot_claims(case: Case, workspace: Workspace, reached: Collection[str]) -> RobotClaims:
    """Return the robot of a case with fixed dimensions, and the claims about its reach, of which some are proved."""
    legs, closed, is_open = legs_of(case), closed_form(case.model), bool(case.model.unknowns)
    if case.joint_centre_tolerance:
        try:
            machines = Machines(case, closed.model, pose_root(workspace))
        except RobotError:
            pass
        else:
            layout, home = machines.symbols.layout, "the assembly of home" if is_open else ""
            reaches, _ = machines.symbols.claims(())
            return RobotClaims(legs, layout, closed.model, _of_numbers(reaches, layout), home, machines)
    claims: tuple[ExpectedClaim, ...] = ()
    if closed.reaches:
        place, every = reach_claims(case, closed, workspace)
        claims = _of_numbers(every, place)
        if all(each.name in reached for each in every):
            partly = "every assembly in which limbs in closed form are as at home"
            numbers_at = partly if closed.model.unknowns else "the assembly of home"
            return RobotClaims(legs, closed_layout(case, closed, workspace), closed.model, claims, numbers_at)
    numbers_at = "every assembly" if is_open else ""
    return RobotClaims(legs, posed_layout(case, workspace), closed.model, claims, numbers_at)


def expected_claims(case: Case, robot: RobotClaims, quantities: Sequence[str], leg_error: float) -> list[ExpectedClaim]:
    """Return the claims about a case over its workspace, and about measures that were asked for.

    Raises:
        InputError: the robot has no measure of a name.
    """
    ranks = [REGULAR, *([CONSTRAINTS] if _has_constraints(robot.model) else [])]
    claims = claims_of(robot.layout, [name for name in quantities if name not in SPECTRAL])
    every = [*(ExpectedClaim(name, "", "rank") for name in ranks), *robot.reaches, *_of_numbers(claims, robot.layout)]
    return every if robot.legs is None else [*every, *_of_legs(case, quantities, leg_error)]


def _has_constraints(model: Model) -> bool:
    """Return whether a robot has constraint wrenches, of which a rank is claimed."""
    if model.generic is not None:
        return 0 < model.generic.constraints < 6
    return not model.members and any(row.kind is WrenchKind.COUPLE for row in model.wrenches)


def _of_numbers(claims: Sequence[Claim], layout: Layout) -> tuple[ExpectedClaim, ...]:
    """Return the claims about numbers that the search of ``certify`` bounds, in the symbols of a layout."""
    return tuple(
        ExpectedClaim(each.name, each.sense.value, "number", each.reading, each.limit, each, layout) for each in claims
    )


def _of_legs(case: Case, quantities: Sequence[str], leg_error: float) -> Iterator[ExpectedClaim]:
    """Yield the claims about six straight legs that have rules of their own."""
    names = [leg.name for leg in case.model.legs]
    for each in case.limits:
        if isinstance(each, Actuator):
            yield from _of_strokes(each, names)
        elif isinstance(each, SmallestSingularValue):
            yield _of_spectrum(each.key, each.key, each.length, each.min)
        elif isinstance(each, ConditionNumber):
            yield _of_spectrum(each.key, each.key, each.length, each.max)
        elif isinstance(each, LegClearance):
            for i, j in itertools.combinations(range(len(names)), 2):
                name = f"{each.key} limbs {names[i]} and {names[j]}"
                yield ExpectedClaim(name, "min", "clearance", LENGTH, each.min, legs=(i, j))
    for key in asked_spectra(case, quantities):
        yield _of_spectrum(asked_name(case, key), key, case.characteristic_length)
    if leg_error_of(case, leg_error) > 0:
        yield from (ExpectedClaim(name, "max", "error", reading) for name, reading in ERRORS.items())


def _of_strokes(limit: Actuator, names: Sequence[str]) -> Iterator[ExpectedClaim]:
    """Yield the claims about the stroke of each leg with these names, and about its dead length."""
    for k, name in enumerate(names):
        for end, sense, weights in (("stroke_max", "max", (1.0, -1.0)), ("dead_length", "min", (-1.0, 2.0))):
            most = getattr(limit, end)
            if most is not None:
                full = f"{limit.key}.{end} limb {name}"
                yield ExpectedClaim(full, sense, "lengths", LENGTH, most, legs=(k,), weights=weights)


def _of_spectrum(name: str, key: str, length: float, limit: float | None = None) -> ExpectedClaim:
    """Return the claim about the smallest singular value of J, or its condition number."""
    sense = "max" if key == ConditionNumber.key else "min"
    return ExpectedClaim(name, sense, "singular value", limit=limit, length=length)


def leg_error_of(case: Case, leg_error: float) -> float:
    """Return by how much a leg is off at most when its length and its joint centres are in error."""
    return leg_error + 2 * (case.joint_centre_tolerance or 0.0)


def legs_numbers(legs: Legs | None) -> tuple[tuple[float, ...], ...]:
    """Return joint centres (12, 3), base before platform; none for a robot that is not six straight legs."""
    return () if legs is None else tuple(map(tuple, [*legs.base.tolist(), *legs.platform.tolist()]))


def hold_premises(case: Case, workspace: Workspace, legs: Legs | None, leg_error: float, given: Premises) -> None:
    """Refuse a proof whose file names other premises than those of the case; the check does without the file's."""
    if workspace_numbers(workspace) != given.workspace:
        raise ProofError("the proof is for another workspace than this case's")
    if given.leg_error != leg_error:
        stated = f"the proof is for legs that are off by at most {exact(given.leg_error)} {case.units.length}"
        raise ProofError(f"{stated}, and not {exact(leg_error)}: see --leg-error")
    numbers = legs_numbers(legs)
    same = list(map(len, numbers)) == list(map(len, given.legs))
    if not same or not np.allclose(given.legs, numbers, rtol=0.0, atol=_SAME * np.abs(numbers).max(initial=0.0)):
        raise ProofError("the proof is for other joint centres than this case's")
    if (case.joint_centre_tolerance or 0.0) != given.joint_centre:
        raise ProofError("the proof is for machines within another tolerance on joint centres than this case's")

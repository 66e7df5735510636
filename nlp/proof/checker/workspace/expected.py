"""Claims that a proof of a workspace must name, one by one: proved or not."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.legs import Actuator
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....program.layout import Layout
from ...statement.claims import REGULAR, SPECTRAL, Claim, asked_name, asked_spectra, claims_of
from ...statement.machine import Legs

#: Names of the errors of the pose: of its position and of its rotation.
ERRORS = ("position error", "rotation error")


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


def leg_error_of(case: Case, leg_error: float) -> float:
    """Return by how much a leg is off at most when its length and its joint centres are in error."""
    return leg_error + 2 * (case.joint_centre_tolerance or 0.0)


def expected_claims(
    case: Case,
    layout: Layout,
    legs: Legs | None,
    quantities: Sequence[str],
    leg_error: float,
    more: Sequence[ExpectedClaim] = (),
) -> list[ExpectedClaim]:
    """Return the claims about a case over its workspace.

    Args:
        case: the case.
        layout: the case as symbols of the pose, and of errors of joint centres.
        legs: its joint centres; None for a robot that is not six straight legs.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
        more: claims about another robot than six straight legs alone.

    Raises:
        InputError: the robot has no measure of a name.
    """
    found = [ExpectedClaim(REGULAR, "", "regular"), *more]
    claims = claims_of(layout, [name for name in quantities if name not in SPECTRAL])
    found += [ExpectedClaim(each.name, each.sense.value, "number", each.limit, each) for each in claims]
    if legs is None:
        return found
    found += _of_strokes(case)
    for limit in case.limits:
        if isinstance(limit, SmallestSingularValue):
            name = "smallest_singular_value"
            found.append(ExpectedClaim(name, "min", "singular value", limit.min, length=limit.length))
        elif isinstance(limit, ConditionNumber):
            found.append(ExpectedClaim("condition_number", "max", "condition", limit.max, length=limit.length))
        elif isinstance(limit, LegClearance):
            names = [leg.name for leg in case.model.legs]
            for pair in itertools.combinations(range(len(names)), 2):
                name = f"leg_clearance limbs {names[pair[0]]} and {names[pair[1]]}"
                found.append(ExpectedClaim(name, "min", "clearance", limit.min, legs=pair))
    length = case.characteristic_length
    for name in asked_spectra(case, quantities):
        sense, kind = ("max", "condition") if name == ConditionNumber.key else ("min", "singular value")
        found.append(ExpectedClaim(asked_name(case, name), sense, kind, length=length))
    if leg_error_of(case, leg_error) > 0:
        found += [ExpectedClaim(name, "max", "error") for name in ERRORS]
    return found


def _of_strokes(case: Case) -> Iterator[ExpectedClaim]:
    """Yield the limits on telescoping legs."""
    limit = next((each for each in case.limits if isinstance(each, Actuator)), None)
    if limit is None:
        return
    for k, leg in enumerate(case.model.legs):
        if limit.stroke_max is not None:
            yield ExpectedClaim(f"actuator.stroke_max limb {leg.name}", "max", "stroke", limit.stroke_max, legs=(k,))
        if limit.dead_length is not None:
            yield ExpectedClaim(
                f"actuator.dead_length limb {leg.name}", "min", "dead length", limit.dead_length, legs=(k,)
            )

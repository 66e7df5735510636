"""What the check of a proof asks about every machine within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray
from .....case.task import Sense
from .....program.layout import Layout
from ....statement.claims import Claim, exact_length_name, one_machine_name
from ....statement.machine import LEGS, Legs
from ...fractions import determinant_sign
from ...proof_file import ProofClaim, ProofError
from ..pose_boxes import COORDINATES, PoseRoot
from .changes import change_of_jacobian
from .rules import Machines, length_beside
from .statement import BuiltNumber, BuiltNumbers

#: Part of itself by which a computed number is moved outwards: more than the rounding of a root and a few sums.
_ROUNDING = 1e-14
#: Checks a tree of ``certify`` for an expression, and returns its proven bound.
BoundOf = Callable[[SX, Sense, ProofClaim], float]


class Shown(NamedTuple):
    """A proven bound: as people read it, and in the terms of its program."""

    number: float
    value: float


class Built:
    """All machines within a tolerance.

    Args:
        layout: the case as symbols of the pose.
        root: the box of coordinates.
        legs: joint centres, with the tolerance.
        lemmas: claims that others rest on, by name and sense.
        bound_of: checks one of them.

    Raises:
        ProofError: a length of the exact machine's legs could not be shown.
    """

    def __init__(
        self,
        layout: Layout,
        root: PoseRoot,
        legs: Legs,
        lemmas: Mapping[tuple[str, str], ProofClaim],
        bound_of: BoundOf,
    ) -> None:
        self._layout, self._legs, self._lemmas, self._bound_of = layout, legs, lemmas, bound_of
        self.tolerance, self.shortest = legs.tolerance, self._shortest()
        farthest = float(np.linalg.norm(np.maximum(np.abs(root.lower[:3]), np.abs(root.upper[:3]))))
        self._machines = Machines(legs, layout.robots[0], self.shortest, farthest)
        is_known = self.shortest > 2 * self.tolerance
        self._numbers = BuiltNumbers(layout, self._machines) if is_known else None

    def _shortest(self) -> float:
        """Return a proven shortest length of the exact machine's legs; 0 without a proof."""
        lengths = []
        for leg in self._layout.robots[0].legs:
            given = self._lemmas.get((exact_length_name(leg.name), "min"))
            if given is None:
                return 0.0
            try:
                square = self._bound_of(ca.sumsqr(leg.span), Sense.MIN, given)
            except ProofError as error:
                raise ProofError(f"{given.name}: {error}") from None
            lengths.append(math.sqrt(max(square, 0.0)) * (1 - _ROUNDING))
        return min(lengths, default=0.0)

    def number(self, claim: Claim) -> BuiltNumber:
        """Return the number of a claim over all machines.

        Raises:
            ProofError: it has no rule, or no length above the errors is proved.
        """
        if self._numbers is None:
            raise ProofError("no length of legs above the errors of joint centres is proved")
        return self._numbers.of(claim)

    def shown(self, claim: Claim, number: BuiltNumber, bound: float) -> Shown:
        """Return the bound of a number over all machines from that of its expression."""
        sign = 1.0 if claim.sense is Sense.MAX else -1.0
        exact = claim.reading.from_value(bound)
        off = number.allowance + _ROUNDING * (abs(exact) + number.allowance)
        at = min(max(exact + sign * off, number.least), number.most)
        return Shown(at, float(claim.reading.to_value(SX(at))))

    def change(self, joints: Legs, length: float) -> float:
        """Return by how much a singular value of J changes at most, moments divided by a length."""
        return change_of_jacobian(joints, self.tolerance, length, self.shortest)

    def stroke(self, name: str, leg: int, sense: str, weights: tuple[float, float], given: ProofClaim) -> float:
        """Return the bound of a number made from the lengths of a leg at two poses, whose errors are the same.

        Args:
            name: of the claim.
            leg: index of the leg.
            sense: whether the largest or the smallest value is meant.
            weights: of the longest and of the shortest length.
            given: the claim with the directions c_b and c_p.

        Raises:
            ProofError: the directions or the lengths are missing, or a length could not be shown.
        """
        sides = [np.array(side, dtype=float) for side in given.sides]
        if len(sides) != 2 or any(side.shape != (3,) or not np.isfinite(side).all() for side in sides):
            raise ProofError("the claim has no two directions")
        if not self.shortest > 2 * self.tolerance:
            raise ProofError("no length of legs above the errors of joint centres is proved")
        total, parts = 0.0, []
        for weight, length_sense in zip(weights, (Sense.MAX, Sense.MIN), strict=True):
            lemma = self._lemmas.get((one_machine_name(name), length_sense.value))
            if lemma is None:
                raise ProofError("the lengths of the leg of one machine have no proof")
            sign = 1.0 if length_sense is Sense.MAX else -1.0
            expression = length_beside(self._machines, leg, sign, sides[0], sides[1])
            parts.append(weight * self._bound_of(expression, length_sense, lemma))
            total += weight
        # The part of the errors that is the same at both poses, of as many lengths as are left.
        left = abs(total) * self.tolerance * sum(float(np.linalg.norm(side)) for side in sides)
        off = left + _ROUNDING * (abs(parts[0]) + abs(parts[1]) + left)
        return sum(parts) + (off if sense == Sense.MAX.value else -off)

    def refuse_unless_singular(self, root: PoseRoot, sides: Sequence[Sequence[float]]) -> None:
        """Refuse a machine unless one between it and the exact machine is singular at a pose.

        Args:
            root: the box of coordinates.
            sides: a pose (6,), and the joint centres of the machine (12, 3), base before platform.

        Raises:
            ProofError: the pose or the machine is none of those meant, or the determinant has the same sign for both.
        """
        numbers: list[FloatArray] = [np.array(side, dtype=float) for side in sides]
        shapes = [(COORDINATES,), *[(3,)] * (2 * LEGS)]
        if [each.shape for each in numbers] != shapes or not all(np.isfinite(each).all() for each in numbers):
            raise ProofError("the claim has no pose and machine")
        if not root.holds(numbers[0]):
            raise ProofError("the pose is not one of the workspace")
        exact = [*self._legs.base.tolist(), *self._legs.platform.tolist()]
        moved = [each.tolist() for each in numbers[1:]]
        for one, other in zip(exact, moved, strict=True):
            square = sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(one, other, strict=True))
            if square > Fraction(self.tolerance) ** 2:
                raise ProofError("a joint centre of the machine is off by more than the tolerance")
        y = numbers[0].tolist()
        signs = [
            determinant_sign(root.kind, root.axis.tolist(), joints[:LEGS], joints[LEGS:], y)
            for joints in (exact, moved)
        ]
        if signs[0] * signs[1] > 0:
            raise ProofError("the determinant has the same sign for both machines")

"""Every machine within a tolerance on joint centres, as the check states and bounds them.

With the derivatives g_j of a number g by the error of centre j, and the blocks H_jk of its second derivatives, the
number of a machine within the tolerance t differs from that of the design by at most

    t sum_j |g_j| + t^2 / 2 sum_jk |H_jk|

at each pose. The first sum is an expression of the pose. The second is shown to be at most the bound that the proof
gives, over all poses and errors, by the check's ranges.

Of six straight legs, with e and f the errors of both joints of a leg in the world frame, the row
``(s (p - b) + u, u x (p - b))`` changes by

    (s (f - e),  s f x (p - b) - u x e - s f x e).

A component of a vector product with f is at most t times the size of the two other components of the other vector.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model
from ....case.case import Case
from ....case.pose import Free, Value
from ....case.task import Sense
from ....case.workspace import TurnKind, Workspace
from ....errors import UncoveredError
from ....program.layout import Layout
from ...statement.claims import Claim
from ...statement.machine import LEGS, Legs
from ...statement.tolerance import MachineLayout, PoseCoordinates, built_model, design_layout, is_smooth, machine_layout
from ..fractions import determinant_sign
from ..proof_file import ProofError
from .forms import UP, FormArithmetic
from .motion_matrix import turned_rotation
from .pose_boxes import COORDINATES, Attempt, PoseRoot

#: Indices after a component, and before it, of a vector.
_AFTER, _BEFORE = [1, 2, 0], [2, 0, 1]


class Machines:
    """Every machine within a tolerance.

    Args:
        case: with fixed dimensions and a tolerance.
        model: its robot, without unknowns in closed form.
        workspace: the poses.
        root: the box of coordinates.

    Attributes:
        model: as given.
        symbols: the machines as symbols of one pose.

    Raises:
        RobotError: the robot cannot be put together with errors of its joint centres.
    """

    def __init__(self, case: Case, model: Model, workspace: Workspace, root: PoseRoot) -> None:
        turns, angles = workspace.turns, [*workspace.turns.angles, 0.0, 0.0][:3]
        if turns.kind is TurnKind.ANY_AXIS:
            angles = [Free(-1.0, 1.0) if root.upper[3] > 0 else 0.0] * 3
        values: list[Value] = [*workspace.position, *angles]
        self._free = [k for k, each in enumerate(values) if isinstance(each, Free) and each.lower < each.upper]
        for k, each in enumerate(values):
            if k in self._free:
                values[k] = Free(float(root.lower[k]), float(root.upper[k]))
            elif isinstance(each, Free):
                values[k] = each.lower

        def rotation(turn: SX) -> SX:
            """Return the rotation (3, 3) with coordinates (3, 1)."""
            turned, scale = turned_rotation(root, ca.vertsplit(turn))
            return turned / scale

        self._at = PoseCoordinates(values, rotation, root.ball)
        self._case, self.model, self.tolerance = case, model, case.joint_centre_tolerance or 0.0
        self.symbols: MachineLayout = machine_layout(case, built_model(case.model), self.tolerance, self._at)

    @cached_property
    def design(self) -> Layout:
        """The design as symbols of the pose.

        Raises:
            ProofError: coordinates of the robot follow from others.
        """
        if self.model.unknowns:
            raise ProofError("numbers of machines with loops that are not in closed form have no proof")
        return design_layout(self._case, self.model, self._at)

    def number(self, claim: Claim, rest: float) -> SX:
        """Return a bound (1, 1) of a number over all machines in the symbols of the design.

        Args:
            claim: the number, in the symbols of machines.
            rest: bound of its terms of second order.
        """
        errors, pose = self.symbols.errors, self.design.table.variables_vector
        slopes, sign = ca.densify(ca.gradient(claim.expression, errors)), 1.0 if claim.sense is Sense.MAX else -1.0
        squares = [ca.sumsqr(slopes[k : k + 3]) for k in range(0, errors.numel(), 3)]
        small = self.symbols.near_zero(claim.expression, self.design).tolist()
        first = sum((ca.sqrt(each + size**2) for each, size in zip(squares, small, strict=True)), SX(0))
        whole = claim.expression + sign * (self.tolerance * first + rest)
        return self.symbols.of(whole, SX.zeros(errors.numel()), pose)

    def varies(self, claim: Claim) -> bool:
        """Return whether a number changes with the errors."""
        return bool(self.symbols.errors.numel()) and any(
            ca.which_depends(claim.expression, self.symbols.errors, 1, True)
        )

    def second_order(self, claim: Claim, bound: float) -> SecondOrderClaim:
        """Return the claim that the terms of second order of a number are at most a bound.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        return SecondOrderClaim(self.symbols, claim.expression, self._free, bound)


class SecondOrderClaim:
    """The claim that the terms of second order of a number of machines are at most a bound.

    Args:
        symbols: the machines.
        expression: (1, 1) the number.
        free: places of the symbols of the pose among the six coordinates.
        bound: of these terms.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, symbols: MachineLayout, expression: SX, free: Sequence[int], bound: float) -> None:
        self._free, self._bound, self._tolerance = list(free), bound, symbols.tolerance
        pose, errors = SX.sym("pose", len(free)), SX.sym("errors", symbols.errors.numel())
        number = symbols.of(expression, errors, pose)
        if not is_smooth(number):
            raise UncoveredError("a number whose derivatives jump")
        second = ca.hessian(number, errors)[0]
        rows, columns = (np.array(each, dtype=int) for each in second.sparsity().get_triplet())
        # Errors that second derivatives do not depend on are no variables of theirs.
        entries = ca.vertcat(SX(0, 1), *[second.nz[k] for k in range(second.nnz())])
        own = [k for k in range(errors.numel()) if ca.depends_on(entries, errors[k])]
        _, self._block = np.unique(rows // 3 * errors.numel() + columns // 3, return_inverse=True)
        self._errors = len(own)
        z = ca.vertcat(pose, errors[own])
        self._entries = FormArithmetic(z, entries)

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        errors = np.full((len(lower), self._errors), self._tolerance)
        values = self._entries(
            np.concatenate([lower[:, self._free], -errors], axis=1),
            np.concatenate([upper[:, self._free], errors], axis=1),
        )
        squares = np.zeros((self._block.max(initial=-1) + 1, len(lower)))
        np.add.at(squares, self._block, np.abs(values.ends()).max(axis=0) ** 2)
        whole = 0.5 * self._tolerance**2 * np.sqrt(squares).sum(axis=0) * UP
        return Attempt(np.asarray(whole <= self._bound), np.zeros(lower.shape))


def refuse_unless_singular(root: PoseRoot, legs: Legs, sides: Sequence[Sequence[float]]) -> None:
    """Refuse a machine of six straight legs unless one between it and the design is singular at a pose.

    Args:
        root: the box of coordinates.
        legs: joint centres of the design, with the tolerance.
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
    exact = [*legs.base.tolist(), *legs.platform.tolist()]
    moved = [each.tolist() for each in numbers[1:]]
    for one, other in zip(exact, moved, strict=True):
        square = sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(one, other, strict=True))
        if square > Fraction(legs.tolerance) ** 2:
            raise ProofError("a joint centre of the machine is off by more than the tolerance")
    y = numbers[0].tolist()
    signs = [
        determinant_sign(root.kind, root.axis.tolist(), joints[:LEGS], joints[LEGS:], y) for joints in (exact, moved)
    ]
    if signs[0] * signs[1] > 0:
        raise ProofError("the determinant has the same sign for both machines")


def change_of_rows(
    scale: FloatArray, span: FloatArray, arm: FloatArray, tolerance: float, length: float = 1.0
) -> FloatArray:
    """Return bounds (B, 6, 6) of the change of the rows, entry by entry, by errors within a tolerance.

    Args:
        scale: (B,) largest s.
        span: (B, 6, 3) largest sizes of ``p - b``.
        arm: (B, 6, 3) largest sizes of ``u``.
        tolerance: t.
        length: by which moments are divided.
    """
    s = scale[:, None, None]
    across, along = (np.hypot(each[..., _AFTER], each[..., _BEFORE]) for each in (span, arm))
    # |f x e| is at most t^2, and so is each of its components.
    moments = (s * (across + tolerance) + along) * UP / length
    return np.concatenate([np.broadcast_to(2 * s, moments.shape), moments], axis=2) * tolerance * UP


def change_of_jacobian(joints: Legs, tolerance: float, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J, by which every singular value changes at most.

    The unit force of a leg changes by at most ``h = 2 t / l``, and its moment by ``|a| h + t``.

    Args:
        joints: joint centres of the design.
        tolerance: t.
        length: by which moments are divided.
        shortest: l: no leg of any machine is shorter.

    Returns:
        Infinite where the errors may take up a whole leg.
    """
    if not shortest > 0:
        return math.inf
    turned = 2 * tolerance / shortest * UP
    moments = (np.linalg.norm(joints.platform, axis=1) * UP * turned + tolerance) / length * UP
    return float(np.sqrt((turned * turned + moments * moments).sum()) * UP)

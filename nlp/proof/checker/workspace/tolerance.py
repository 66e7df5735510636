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

from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model
from ....case.case import Case
from ....case.pose import Free
from ....case.task import Sense
from ....errors import UncoveredError
from ....program.layout import Layout
from ...statement.claims import Claim
from ...statement.tolerance import MachineLayout, PoseCoordinates, built_model, design_layout, is_smooth, machine_layout
from ..proof_file import ProofError
from .forms import UP, FormArithmetic
from .motion_matrix import turned_rotation
from .pose_boxes import Attempt, PoseRoot

#: Indices after a component, and before it, of a vector.
_AFTER, _BEFORE = [1, 2, 0], [2, 0, 1]


class Machines:
    """Every machine within a tolerance.

    Args:
        case: with fixed dimensions and a tolerance.
        model: its robot, without unknowns in closed form.
        root: the box of coordinates.

    Attributes:
        model, root: as given.
        symbols: the machines as symbols of one pose.

    Raises:
        RobotError: the robot cannot be put together with errors of its joint centres.
    """

    def __init__(self, case: Case, model: Model, root: PoseRoot) -> None:
        def rotation(turn: SX) -> SX:
            """Return the rotation (3, 3) with coordinates (3, 1)."""
            turned, scale = turned_rotation(root, ca.vertsplit(turn))
            return turned / scale

        self._case, self._at, self.model, self.root = (
            case,
            PoseCoordinates(root.values, rotation, root.ball),
            model,
            root,
        )
        tolerance = case.joint_centre_tolerance or 0.0
        self.symbols: MachineLayout = machine_layout(case, built_model(case.model), tolerance, self._at)

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
        whole = claim.expression + sign * (self.symbols.tolerance * first + rest)
        return self.symbols.of(whole, SX.zeros(errors.numel()), pose)

    def varies(self, claim: Claim) -> bool:
        """Return whether a number changes with the errors."""
        return bool(self.symbols.errors.numel()) and any(
            ca.which_depends(claim.expression, self.symbols.errors, 1, True)
        )


class SecondOrderClaim:
    """The claim that the terms of second order of a number of machines are at most a bound.

    Args:
        machines: the machines.
        expression: (1, 1) the number, in their symbols.
        bound: of these terms.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, machines: Machines, expression: SX, bound: float) -> None:
        symbols = machines.symbols
        self.free = [k for k, each in enumerate(machines.root.values) if isinstance(each, Free)]
        self._bound, self._tolerance = bound, symbols.tolerance
        pose, errors = SX.sym("pose", len(self.free)), SX.sym("errors", symbols.errors.numel())
        number = symbols.of(expression, errors, pose)
        if not is_smooth(number):
            raise UncoveredError("a number whose derivatives jump")
        second = ca.hessian(number, errors)[0]
        rows, columns = (np.array(each, dtype=int) for each in second.sparsity().get_triplet())
        # Errors that second derivatives do not depend on are no variables of theirs.
        entries = ca.vertcat(SX(0, 1), second.nz[:])
        own = [k for k in range(errors.numel()) if ca.depends_on(entries, errors[k])]
        _, self._block = np.unique(rows // 3 * errors.numel() + columns // 3, return_inverse=True)
        self._errors, self._entries = len(own), FormArithmetic(ca.vertcat(pose, errors[own]), entries)

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        errors = np.full((len(lower), self._errors), self._tolerance)
        values = self._entries(np.hstack([lower[:, self.free], -errors]), np.hstack([upper[:, self.free], errors]))
        squares = np.zeros((self._block.max(initial=-1) + 1, len(lower)))
        np.add.at(squares, self._block, np.abs(values.ends()).max(axis=0) ** 2)
        whole = 0.5 * self._tolerance**2 * np.sqrt(squares).sum(axis=0) * UP
        return Attempt(np.asarray(whole <= self._bound), np.zeros((len(lower), len(self.free))))


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

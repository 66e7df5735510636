"""Claims about expressions of a robot with closed loops over boxes, for the nominal robot or within a tolerance.

Joint-centre errors are coordinates of the forms, and are never bisected.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model
from .....models.member import scaled_twists
from ....case.case import Case
from ....errors import UncoveredError
from ...statement.tolerance import BuiltModel
from ..proof_file import ProofError
from .closed_loops import Assembly, ClosedBoxes, Enclosed, needed_equations, start_of
from .forms import Values
from .motion_matrix import PosedRobot, Root
from .path_loops import PathAssembly
from .path_root import PathRoot
from .pose_boxes import Attempt, PoseRoot

#: Test of omitted equations and screws at random joint-centre errors: errors relative to the robot's length, fraction
#: of the workspace about its centre that contains the poses, number of tests, and largest residual of a closed loop.
_OFF, _SPREAD, _TESTS, _CLOSED, _SEED = 1e-2, 0.5, 4, 1e-9, 2
#: Fraction of the largest singular value below which singular values count as zero.
_ZERO = 1e-9
#: Test of omitted equations by a motion of a pose coordinate: step relative to a length, or in radians; largest change
#: of the left sides; and number of position coordinates.
_SHORT, _ROUNDING, _POSITION = 1e-3, 1e-12, 3
#: Largest number of coordinates of boxes with closed loops that are stored for a claim.
_MOST_KEPT = 2**24


class PosedLoops(NamedTuple):
    """A robot over a workspace or a path with its closed loops, and with the joint-centre errors of a tolerance.

    Attributes:
        robot: expressions of the robot.
        start: (n,) closed point near the workspace centre, or at the first point of the path.
        assembly: closed loops connected continuously with the start.
        tolerance: largest error of each joint centre; 0 for the nominal robot.
        needed: indices of the independent loop equations.
    """

    robot: PosedRobot
    start: FloatArray
    assembly: Assembly
    tolerance: float
    needed: Sequence[int]


def posed_loops(
    case: Case, model: Model, root: Root, tolerance: float = 0.0, built: BuiltModel | None = None
) -> PosedLoops:
    """Return the expressions of a robot with its closed loops over a box, from the home assembly mode.

    Loop equations that follow from the others are omitted, by their ranks at a few points. If an equation is omitted
    by mistake, claims cover more than the closed points, and are only stronger.

    Args:
        case: case with fixed dimensions.
        model: model of its robot without the unknowns in closed form.
        root: box of coordinates.
        tolerance: largest error of each joint centre; 0 for the nominal robot.
        built: model with joint-centre errors as coordinates; None for the nominal robot.

    Raises:
        ProofError: the loops cannot be closed at the workspace centre, are singular there or leave a joint free;
            an expression has an operation without a rule; or joint-centre errors remove degrees of freedom.
    """
    if isinstance(root, PathRoot):
        return _along_path(case, model, root, posed_loops(case, model, root.box, tolerance, built), built)
    robot = PosedRobot(case, model, root)
    start = start_of(robot)
    needed = needed_equations(robot, start)
    if built is not None:
        robot = PosedRobot(case, built.model, root)
        start = np.concatenate([start, np.zeros(robot.errors)])
    try:
        assembly = Assembly(robot, robot.equations[needed] if needed else SX(0, 1), start)
    except UncoveredError as error:
        raise ProofError(f"the checker has no rule for {error.operation}") from None
    if built is not None:
        _refuse_other_mobility(robot, assembly)
    if len(needed) < robot.equations.numel():
        _refuse_narrow(robot, assembly, root)
    return PosedLoops(robot, start, assembly, tolerance, needed)


def _along_path(case: Case, model: Model, root: PathRoot, about: PosedLoops, built: BuiltModel | None) -> PosedLoops:
    """Return a robot whose loops are solved along a path, given the solved loops over a box around the path."""
    robot, poses = PosedRobot(case, model if built is None else built.model, root), len(about.robot.free)
    following = [about.robot.free.index(k) for k in root.box.dependent]
    start = np.concatenate([[0.0], about.start[following], about.start[poses:]])
    try:
        assembly = PathAssembly(robot, robot.equations[about.needed, :], start, len(root.poses))
    except UncoveredError as error:
        raise ProofError(f"the checker has no rule for {error.operation}") from None
    return PosedLoops(robot, assembly.start, assembly, about.tolerance, about.needed)


def _refuse_narrow(robot: PosedRobot, assembly: Assembly, root: PoseRoot) -> None:
    """Refuse an omitted equation that seems redundant only because a pose coordinate has a narrow range."""
    equations = ca.vertcat(robot.equations, robot.loops)
    # Constants of a robot that should be 0 may be rounding errors.
    first = robot.at(equations, assembly.start)
    for j in (each for each in assembly.independent if each < len(robot.free)):
        k = robot.free[j]
        for end in (root.lower[k], root.upper[k]):
            to = assembly.start[None].copy()
            # A dimension that changes along a path may have any unit.
            turn = 1.0 if k < root.of_pose else max(abs(root.lower[k]), abs(root.upper[k]))
            near = _SHORT * (robot.length if k < _POSITION else turn)
            to[0, j] = np.clip(end, to[0, j] - near, to[0, j] + near)
            (z,) = assembly.moved(assembly.start[None], to[:, assembly.independent])
            off = np.abs(robot.at(equations, z) - first)
            if np.isfinite(z).all() and not off.max(initial=0.0) <= _ROUNDING:
                raise ProofError("the loops of the robot do not close at every pose of the workspace")


def _refuse_other_mobility(robot: PosedRobot, assembly: Assembly) -> None:
    """Refuse a tolerance if, for random errors, omitted equations or screws do not follow from the kept ones."""
    rng, n = np.random.default_rng(_SEED), len(assembly.start) - robot.errors
    poses = [j for j in assembly.independent if j < n]
    for _ in range(_TESTS):
        to = assembly.start[None].copy()
        to[:, poses] += _SPREAD * robot.size[poses] * rng.uniform(-1, 1, len(poses))
        to[:, n:] = _OFF * robot.length * rng.uniform(-1, 1, robot.errors)
        (z,) = assembly.moved(assembly.start[None], to[:, assembly.independent])
        every = robot.at(ca.vertcat(robot.equations, robot.loops), z)
        if not (np.isfinite(z).all() and np.abs(every).max(initial=0.0) <= _CLOSED):
            raise ProofError("with joint-centre errors the robot cannot reach the poses of the workspace exactly")
        for each in (one for one in robot.members if one.rank < one.screws.shape[1]):
            columns = scaled_twists(each.screws, each.centre, SX(robot.length), each.size)
            sizes = np.linalg.svd(robot.at(columns, z), compute_uv=False)
            if int(np.count_nonzero(sizes > _ZERO * sizes.max(initial=0.0))) != each.rank:
                raise ProofError(
                    "joint-centre errors remove degrees of freedom from this overconstrained robot: "
                    "the tolerance cannot be verified"
                )


class LoopClaim(ABC):
    """A claim about expressions (R, 1) of a robot's coordinates.

    Raises:
        ProofError: an expression has an operation without a rule.
    """

    def __init__(self, loops: PosedLoops, expressions: SX) -> None:
        robot, self.assembly, self.tolerance = loops.robot, loops.assembly, loops.tolerance
        # Independent coordinates use the order of pose coordinates.
        self.free = [robot.free[j] for j in self.assembly.independent if j < len(robot.free)]
        self.errors, self._shown, self._kept = robot.errors, list[ClosedBoxes](), 0
        self.coordinates = robot.coordinates
        try:
            self._entries = robot.forms(expressions)
        except UncoveredError as error:
            raise ProofError(f"the checker has no rule for {error.operation}") from None

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6)."""
        closed = self.closed(lower, upper)
        holds, shares = closed.is_known.copy(), closed.shares[:, : len(self.free)].copy()
        is_wrong = np.zeros(len(holds), dtype=bool)
        if holds.any():
            known = closed.only(holds)
            found = self.examined(known)
            if found.is_wrong is not None:
                is_wrong[holds] = found.is_wrong
            shares[holds], holds[holds] = found.shares, found.holds
            if self.assembly.dependent:
                self._keep(known.boxes(found.holds))
        return Attempt(holds, shares, is_wrong)

    @abstractmethod
    def examined(self, closed: Enclosed) -> Attempt:
        """Try to prove the claim on boxes whose closed loops are already enclosed."""

    def finish(self) -> None:
        """Refuse boxes whose closed loops are not proved to belong to one assembly mode, at the end of the check."""
        if self._shown:
            every = zip(*self._shown, strict=True)
            self.assembly.refuse_apart(ClosedBoxes(*map(np.concatenate, every)))

    def _keep(self, boxes: ClosedBoxes) -> None:
        """Store boxes whose closed loops must belong to one assembly mode."""
        self._shown.append(boxes)
        self._kept += sum(each.size for each in boxes)
        if self._kept > _MOST_KEPT:
            most = _MOST_KEPT // sum(each.shape[1] for each in boxes)
            raise ProofError(
                f"this claim needs more than {most:,} boxes with closed loops, the largest number that can be checked"
            )

    def closed(self, lower: FloatArray, upper: FloatArray) -> Enclosed:
        """Return the closed loops over boxes (B, c) for all errors, or over boxes (B, c + e) with errors."""
        if lower.shape[1] == self.coordinates:
            errors = np.full((len(lower), self.errors), self.tolerance)
            lower, upper = np.hstack([lower, -errors]), np.hstack([upper, errors])
        own = [*self.free, *range(self.coordinates, self.coordinates + self.errors)]
        return self.assembly.enclosed(lower[:, own], upper[:, own])

    def values(self, closed: Enclosed) -> Values:
        """Return polynomials of the claim's expressions over boxes with enclosed loops."""
        return self._entries(closed.lower, closed.upper)

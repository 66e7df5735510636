"""Robots given joint by joint, in MuJoCo: F, its members and ranks from the engine's own Jacobians, for tests.

Nothing here comes from the package: a robot in numbers (``robot_files``) becomes a model of the whole closed mechanism
(``robot_mjcf``), and everything follows from the Jacobian of the engine's constraints.

Twists are ``chi = (omega, v)`` with ``v`` the velocity of the platform's point at the world origin. In *scaled
coordinates about c*, with a length ``l``, a twist is ``x = (v + omega x c, l omega)`` and a wrench
``y = (f, (m - c x f) / l)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from builders import Array
from measures import cross_matrix
from numpy.typing import NDArray
from robot_files import Robot
from robot_mjcf import Loop, Writer

Index = NDArray[np.intp]

#: Singular values below this share of the largest count as zero: measured regular ones of the gallery are above 1e-3 of
#: it, rounding leaves 1e-15.
RANK_TOLERANCE = 1e-9

#: Loops are closed when no row of the closure is larger, times the robot's size where that is above 1. Newton's method
#: ends at 1e-16 to 1e-15 for a robot of size 1, and at 1e-14 for one of size 50 far from the world's origin.
CLOSURE_TOLERANCE = 2e-14

NEWTON_STEPS = 60
CONTINUATION_STEPS = 8


def singular_rank(matrix: Array, scale: float | None = None) -> int:
    """Number of singular values that are not zero, measured by the largest one or by a given scale."""
    values = np.linalg.svd(matrix, compute_uv=False) if matrix.size else np.zeros(0)
    return int(np.sum(values > RANK_TOLERANCE * (np.max(values, initial=0.0) if scale is None else scale)))


def column_space(matrix: Array, scale: float) -> Array:
    """Orthonormal basis (n, r) of the span of the columns: no columns where they are rounding errors of the scale."""
    U, _, _ = np.linalg.svd(matrix, full_matrices=True)
    return np.asarray(U[:, : singular_rank(matrix, scale)])


def left_null_space(matrix: Array) -> Array:
    """Orthonormal basis (n, n - r) of what is orthogonal to every column; columns are scaled to length 1 first."""
    lengths = np.linalg.norm(matrix, axis=0)
    # A joint that does not move the loop leaves rounding errors, which must not be scaled up.
    moving = lengths > RANK_TOLERANCE * np.max(lengths, initial=0.0)
    scaled = matrix[:, moving] / lengths[moving]
    U, _, _ = np.linalg.svd(scaled, full_matrices=True)
    return np.asarray(U[:, singular_rank(scaled) :])


def null_space(matrix: Array) -> Array:
    """Orthonormal basis (n, n - r) of the null space."""
    _, _, V = np.linalg.svd(matrix, full_matrices=True)
    return np.asarray(V[singular_rank(matrix) :].T)


def scaled_twists(c: Array, length: float) -> Array:
    """Matrix (6, 6) from ``chi`` to scaled coordinates about ``c``."""
    return np.block([[-cross_matrix(c), np.eye(3)], [length * np.eye(3), np.zeros((3, 3))]])


@dataclass(frozen=True, eq=False)
class Member:
    """A member with its actuators locked; ``F_k = |P_k x(chi)|^2`` with its projector ``P_k``."""

    centre: Array  # (3,) c_k in the world frame
    W: Array  # (6, d) orthonormal basis of W_k in scaled coordinates about the centre

    @property
    def projector(self) -> Array:
        return np.asarray(self.W @ self.W.T)


class Ranks(NamedTuple):
    """Dimensions and ranks of a robot in one configuration."""

    W: tuple[int, ...]  # dimension of each member's W_k
    C: tuple[int, ...]  # dimension of each member's C_k
    J: int  # rank of all W_k together
    constraints: int  # rank of all C_k together, those of members that share an actuator taken as one
    freedoms: int  # of the platform with actuators free
    rotations: int  # independent angular velocities among them
    locked: int  # freedoms of the platform with actuators locked
    mobility: int  # freedoms of the whole mechanism, the spins of rods too


class Oracle:
    """A robot in MuJoCo, at home until driven, with a characteristic length."""

    def __init__(self, robot: Robot, length: float) -> None:
        self.robot, self.length = robot, length
        writer = Writer(robot, length)
        self.loops, self.tolerance = writer.loops, CLOSURE_TOLERANCE * max(1.0, writer.size)
        self.model = mujoco.MjModel.from_xml_string(writer.mjcf)
        self.data = mujoco.MjData(self.model)
        first = self.model.joint("platform").dofadr[0]
        self.platform_dofs: Index = np.arange(first, first + 6)
        self.actuated: Index = np.array([self.model.joint(name).dofadr[0] for name in writer.actuators], dtype=np.intp)
        places = [self.model.joint(name).qposadr[0] for name in writer.actuators]
        self.actuated_q: Index = np.array(places, dtype=np.intp)
        others = np.setdiff1d(np.arange(self.model.nv), self.platform_dofs)
        self.joint_dofs: Index = others
        self.passive: Index = np.setdiff1d(others, self.actuated)
        # Which constraints belong together follows from the tree of bodies alone, and not from where they are.
        self.member_constraints = self.components(self.passive)
        self.limb_constraints = self.components(others)
        self.update()

    def update(self) -> None:
        """Evaluate the constraints where ``qpos`` is, each weld with its anchor at the member's centre."""
        mujoco.mj_kinematics(self.model, self.data)
        for loop in self.loops:
            if loop.weld:
                number = self.model.equality(loop.constraint).id
                frame = self.data.body("platform")
                anchor = frame.xmat.reshape(3, 3).T @ (self.current(loop) - frame.xpos)
                # In the platform's frame and in that of the chain's end, which are one where the loop is closed.
                self.model.eq_data[number, 0:3] = self.model.eq_data[number, 3:6] = anchor
        mujoco.mj_fwdPosition(self.model, self.data)
        self.J: Array = np.array(self.data.efc_J).reshape(self.data.nefc, self.model.nv)
        self.row_constraint: Index = np.array(self.data.efc_id, dtype=np.intp)
        self.from_platform: Array = self.platform_jacobian()
        self.found_members: dict[bool, list[Member]] = {}

    def current(self, loop: Loop) -> Array:
        frame = self.data.body(loop.carrier)
        return np.asarray(frame.xpos + frame.xmat.reshape(3, 3) @ loop.centre)

    @property
    def closure(self) -> float:
        """Largest error of a loop."""
        return float(np.max(np.abs(self.data.efc_pos)))

    @property
    def rotation(self) -> Array:
        """``R`` (3, 3), platform to world coordinates."""
        return np.array(self.data.body("platform").xmat).reshape(3, 3)

    @property
    def position(self) -> Array:
        """``p`` (3,), the platform's origin in the world frame, length."""
        return np.array(self.data.body("platform").xpos) + self.rotation @ self.robot.home

    def drive(self, displacements: Sequence[float]) -> None:
        """Move the actuators by these displacements, and close the loops again by Newton's method."""
        free = np.concatenate([self.passive, self.platform_dofs])
        step = np.asarray(displacements, dtype=float) / CONTINUATION_STEPS
        for _ in range(CONTINUATION_STEPS):
            self.data.qpos[self.actuated_q] += step
            self.update()
            for _ in range(NEWTON_STEPS):
                if self.closure < self.tolerance:
                    break
                change = np.zeros(self.model.nv)
                change[free] = -np.linalg.lstsq(self.J[:, free], np.array(self.data.efc_pos), rcond=RANK_TOLERANCE)[0]
                mujoco.mj_integratePos(self.model, self.data.qpos, change, 1.0)
                self.update()
            if self.closure >= self.tolerance:
                raise ValueError(f"{self.robot.name} does not close: its loops are open by {self.closure:.2g}")

    def platform_jacobian(self) -> Array:
        """Matrix (6, 6) from the platform's generalised velocities to ``chi``: the engine's body Jacobian."""
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        body = self.model.body("platform").id
        mujoco.mj_jac(self.model, self.data, linear, angular, np.zeros(3), body)
        return np.vstack([angular, linear])[:, self.platform_dofs]

    def platform_velocity(self, chi: Array) -> Array:
        return np.asarray(np.linalg.solve(self.from_platform, chi))

    def components(self, dofs: Index) -> list[Index]:
        """Constraints in groups that share one of these degrees of freedom, directly or through others."""
        allowed, groups = set(dofs.tolist()), []
        for number in range(self.model.neq):
            touched = self.touched(number) & allowed
            joined = [group for group in groups if group[1] & touched]
            groups = [group for group in groups if not group[1] & touched]
            numbers = {number}.union(*(group[0] for group in joined))
            groups.append((numbers, touched.union(*(group[1] for group in joined))))
        ordered = sorted(sorted(numbers) for numbers, _ in groups)
        # A coupling whose both coordinates are outside, or that stands alone, transmits nothing.
        return [np.array(numbers, dtype=np.intp) for numbers in ordered if self.loops_of(numbers)]

    def touched(self, number: int) -> set[int]:
        """Degrees of freedom that a constraint's bodies or joints depend on, by the tree of bodies."""
        equality = self.model.eq_type[number]
        first, second = int(self.model.eq_obj1id[number]), int(self.model.eq_obj2id[number])
        if equality == mujoco.mjtEq.mjEQ_JOINT:
            return {int(self.model.jnt_dofadr[first]), int(self.model.jnt_dofadr[second])}
        dofs: set[int] = set()
        for body in (first, second):
            link = body
            while link > 0:
                start = int(self.model.body_dofadr[link])
                dofs |= set(range(start, start + int(self.model.body_dofnum[link])))
                link = int(self.model.body_parentid[link])
        return dofs - set(self.platform_dofs.tolist())

    def loops_of(self, numbers: Sequence[int]) -> list[Loop]:
        names = {self.model.equality(int(number)).name for number in numbers}
        return [loop for loop in self.loops if loop.constraint in names]

    def wrenches(self, numbers: Index, dofs: Index, c: Array) -> Array:
        """Wrenches on the platform without power in these joints: orthonormal basis (6, d), scaled about ``c``.

        Constraint forces ``lambda`` with ``J_dofs' lambda = 0`` act on the platform by ``J_platform' lambda``. These
        are the wrenches reciprocal to all platform twists that the constraints allow.
        """
        rows = np.isin(self.row_constraint, numbers)
        forces = left_null_space(self.J[rows][:, dofs])
        to_scaled = scaled_twists(c, self.length) @ self.from_platform
        on_platform = self.J[rows][:, self.platform_dofs] @ np.linalg.inv(to_scaled)
        return column_space(on_platform.T @ forces, float(np.linalg.norm(on_platform)))

    def members(self, *, locked: bool = True) -> list[Member]:
        """Members with actuators locked; with ``locked=False`` limbs, whose ``W`` is then ``C_k``."""
        if locked not in self.found_members:
            dofs = self.passive if locked else self.joint_dofs
            found = []
            for numbers in self.member_constraints if locked else self.limb_constraints:
                c = np.mean([self.current(loop) for loop in self.loops_of(numbers.tolist())], axis=0)
                found.append(Member(c, self.wrenches(numbers, dofs, c)))
            self.found_members[locked] = found
        return self.found_members[locked]

    def constraint_dimensions(self) -> tuple[int, ...]:
        """``dim C_k`` of each member: with its actuators free, but apart from other members that share them."""
        found = [self.wrenches(numbers, self.joint_dofs, np.zeros(3)) for numbers in self.member_constraints]
        return tuple(each.shape[1] for each in found)

    def member_objectives(self, chi: Array) -> Array:
        """``F_k`` of each member in a twist: squared length of the projection on ``W_k``."""
        return np.array([np.sum((m.W.T @ (scaled_twists(m.centre, self.length) @ chi)) ** 2) for m in self.members()])

    def objective(self, chi: Array) -> float:
        """F in a twist, from the members."""
        return float(np.sum(self.member_objectives(chi)))

    def feasible_twists(self) -> Array:
        """Orthonormal basis (6, d), as plain vectors, of the platform's twists with all actuators free."""
        onto = self.from_platform
        return column_space(onto @ null_space(self.J)[self.platform_dofs], float(np.linalg.norm(onto)))

    def feasible(self, chi: Array) -> Array:
        """The twist's projection (6,), as a plain vector, on the feasible twists."""
        basis = self.feasible_twists()
        return np.asarray(basis @ (basis.T @ chi))

    def rates(self, chi: Array) -> Array:
        """Actuator rates of a feasible twist."""
        mismatch = self.J[:, self.platform_dofs] @ self.platform_velocity(chi)
        motion = np.zeros(self.model.nv)
        joints = self.J[:, self.joint_dofs]
        motion[self.joint_dofs] = -np.linalg.lstsq(joints, mismatch, rcond=RANK_TOLERANCE)[0]
        if np.max(np.abs(mismatch + joints @ motion[self.joint_dofs])) > RANK_TOLERANCE * np.max(np.abs(chi)):
            raise ValueError(f"the platform of {self.robot.name} cannot make the twist {chi}")
        return motion[self.actuated]

    def ranks(self) -> Ranks:
        """Dimensions and ranks; those of J and C come from the members, the freedoms from the whole mechanism."""

        def stacked(members: Sequence[Member]) -> int:
            # About one point: the rank does not depend on which.
            back = [m.W.T @ scaled_twists(m.centre, self.length) for m in members]
            return singular_rank(np.vstack(back), 1.0)

        members = self.members()
        twists = self.feasible_twists()
        unlocked = np.concatenate([self.passive, self.platform_dofs])
        locked = null_space(self.J[:, unlocked])[-6:]
        return Ranks(
            W=tuple(m.W.shape[1] for m in members),
            C=self.constraint_dimensions(),
            J=stacked(members),
            constraints=stacked(self.members(locked=False)),
            freedoms=twists.shape[1],
            rotations=singular_rank(twists[:3], 1.0),
            locked=singular_rank(locked, 1.0),
            mobility=null_space(self.J).shape[1],
        )

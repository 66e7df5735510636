"""A robot in MuJoCo whose platform is a body of a tree: wrenches and rates from the engine's joints and constraints.

Nothing here comes from the package. Places and axes are those that the engine computes. Twists are ``(omega, v)`` with
``v`` at the world origin, wrenches ``(f, m)`` with moments about it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np
from builders import Array
from mujoco_robots import null_space

#: Singular values below this part of the largest are zero: regular ones are above 1e-4 of it, rounding leaves 1e-14.
ZERO = 1e-9


class Joint(NamedTuple):
    """A joint between two rigid groups, or a shared point: its name, the groups, and its screws (6, n)."""

    name: str
    one: int
    other: int
    screws: Array


@dataclass
class Tree:
    """A model in its key frame, with lengths in parts of a size."""

    text: str
    size: float
    model: mujoco.MjModel = field(init=False)
    data: mujoco.MjData = field(init=False)

    def __post_init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(self.text)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        mujoco.mj_forward(self.model, self.data)

    @property
    def open(self) -> float:
        """Largest residual of a loop, in parts of the size."""
        return float(np.abs(self.data.efc_pos).max(initial=0.0)) / self.size

    @property
    def driven(self) -> list[int]:
        """Degrees of freedom of the actuators, in order."""
        return [int(self.model.jnt_dofadr[joint]) for joint in self.model.actuator_trnid[:, 0]]

    @property
    def jacobians(self) -> tuple[Array, Array]:
        """Rows (n, nv) of the constraints, and the platform's twist (6, nv) at the world origin."""
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, linear, angular, np.zeros(3), self.model.body("platform").id)
        return np.array(self.data.efc_J).reshape(self.data.nefc, self.model.nv), np.vstack([angular, linear])

    def motion(self, twist: Array) -> tuple[Array, float]:
        """All joint rates with which the platform moves by a twist and the loops stay closed, and what is left."""
        constraints, of_platform = self.jacobians
        rows = np.vstack([constraints, of_platform])
        wanted = np.concatenate([np.zeros(len(constraints)), twist])
        rates = np.linalg.lstsq(rows, wanted, rcond=ZERO)[0]
        return rates, float(np.abs(rows @ rates - wanted).max())

    def feasible_twists(self) -> Array:
        """Basis (6, d) of the platform's twists with its actuators free."""
        constraints, of_platform = self.jacobians
        found = of_platform @ null_space(constraints)
        U, values, _ = np.linalg.svd(found)
        return np.asarray(U[:, : int(np.sum(values > ZERO * values[0]))])

    def wrenches(self, limb_of: Callable[[str], str]) -> dict[str, Array]:
        """Basis (6, n) of the wrenches of each limb with actuators locked, a member's after another's.

        Body by body: unknowns are a twist for each body and the joints' rates. Lengths are in parts of the size.
        """
        leader = self.leaders()
        joints = self.joints(leader)
        ends = {leader[0], leader[self.model.body("platform").id]}
        found: dict[str, list[Array]] = {}
        for own in self.members(joints, ends):
            names = {limb_of(joint.name) for joint in own}
            assert len(names) == 1, names
            found.setdefault(names.pop(), []).append(self.reciprocal(own, leader))
        return {limb: np.hstack(parts) for limb, parts in found.items()}

    def leaders(self) -> list[int]:
        """One body for each rigid group: what is fixed, welded, or joined by a locked actuator."""
        leader = list(range(self.model.nbody))

        def find(body: int) -> int:
            while leader[body] != body:
                body = leader[body]
            return body

        locked = set(self.model.actuator_trnid[:, 0].tolist())
        for body in range(1, self.model.nbody):
            first, count = self.model.body_jntadr[body], self.model.body_jntnum[body]
            if all(joint in locked for joint in range(first, first + count)):
                leader[find(body)] = find(int(self.model.body_parentid[body]))
        for k in range(self.model.neq):
            if self.model.eq_type[k] == mujoco.mjtEq.mjEQ_WELD:
                leader[find(int(self.model.eq_obj1id[k]))] = find(int(self.model.eq_obj2id[k]))
        return [find(body) for body in range(self.model.nbody)]

    def joints(self, leader: list[int]) -> list[Joint]:
        """Two rigid groups and the screws (6, n) between them, for each joint and each shared point."""
        found = []
        locked = set(self.model.actuator_trnid[:, 0].tolist())
        for joint in range(self.model.njnt):
            body = int(self.model.jnt_bodyid[joint])
            if joint in locked:
                continue
            point, axis = self.data.xanchor[joint] / self.size, self.data.xaxis[joint]
            kind = self.model.jnt_type[joint]
            if kind == mujoco.mjtJoint.mjJNT_BALL:
                screws = np.vstack([np.eye(3), np.cross(point, np.eye(3)).T])
            elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
                screws = np.concatenate([np.zeros(3), axis])[:, None]
            else:
                screws = np.concatenate([axis, np.cross(point, axis)])[:, None]
            parent = leader[int(self.model.body_parentid[body])]
            found.append(Joint(self.model.joint(joint).name, parent, leader[body], screws))
        for k in range(self.model.neq):
            if self.model.eq_type[k] == mujoco.mjtEq.mjEQ_CONNECT:
                one, other = int(self.model.eq_obj1id[k]), int(self.model.eq_obj2id[k])
                turn = self.data.xmat[one].reshape(3, 3)
                point = (self.data.xpos[one] + turn @ self.model.eq_data[k, :3]) / self.size
                screws = np.vstack([np.eye(3), np.cross(point, np.eye(3)).T])
                found.append(Joint(self.model.equality(k).name, leader[one], leader[other], screws))
        return found

    @staticmethod
    def members(joints: list[Joint], ends: set[int]) -> list[list[Joint]]:
        """Joints of each connected part between base and platform."""
        groups: list[tuple[set[int], list[Joint]]] = []
        for joint in joints:
            inner = {joint.one, joint.other} - ends
            joined = [group for group in groups if group[0] & inner]
            groups = [group for group in groups if not group[0] & inner]
            bodies = inner.union(*(group[0] for group in joined))
            groups.append((bodies, [*(each for group in joined for each in group[1]), joint]))
        return [own for _, own in groups]

    def reciprocal(self, joints: list[Joint], leader: list[int]) -> Array:
        """Wrenches (6, n), orthonormal, that do no work in the platform's twists that these joints allow."""
        platform, base = leader[self.model.body("platform").id], leader[0]
        bodies = sorted({body for joint in joints for body in (joint.one, joint.other)} - {base, platform})
        places = {platform: 0} | {body: 6 * (k + 1) for k, body in enumerate(bodies)}
        width = 6 * (len(bodies) + 1)
        columns = sum(joint.screws.shape[1] for joint in joints)
        rows = np.zeros((6 * len(joints), width + columns))
        at = width
        for k, (_, one, other, screws) in enumerate(joints):
            for body, sign in ((other, 1.0), (one, -1.0)):
                if body != base:
                    rows[6 * k : 6 * k + 6, places[body] : places[body] + 6] += sign * np.eye(6)
            rows[6 * k : 6 * k + 6, at : at + screws.shape[1]] = -screws
            at += screws.shape[1]
        twists = null_space(rows)[:6]
        U, values, _ = np.linalg.svd(twists)
        rank = int(np.sum(values > ZERO * max(values[0], ZERO))) if values.size else 0
        # (omega, v) . (m, f) = 0: the halves change places.
        return np.asarray(np.roll(U[:, rank:], 3, axis=0))

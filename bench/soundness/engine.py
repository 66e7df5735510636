"""A robot's chains in MuJoCo: poses of the platform, and how far loops are open, by the engine's own kinematics."""

from __future__ import annotations

import mujoco
import numpy as np
from assemblies import Mechanism, angles_of, cayley_of
from legs import Array

INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


class Engine:
    """The chains of a robot as trees of bodies, whose frames at home are the world's.

    Args:
        mechanism: the robot, at home.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, robot = mechanism, mechanism.robot
        trees, factors, coordinates = "", [], []
        for c, chain in enumerate(robot.chains):
            for k, turn in enumerate(chain.turns):
                place, axis = (
                    " ".join(map(repr, each.tolist())) for each in (robot.points_array[turn.centre], turn.axis)
                )
                kind = "slide" if turn.slides else "hinge"
                trees += f'<body name="{c}.{k}"><joint type="{kind}" pos="{place}" axis="{axis}"/>{INERTIA}'
                factors.append(turn.factor)
                coordinates.append(turn.coordinate)
            trees += "</body>" * len(chain.turns)
        text = f'<mujoco><compiler angle="radian"/><worldbody>{trees}</worldbody></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self._factors, self._coordinates = np.array(factors), np.array(coordinates)
        ends = [f"{c}.{len(chain.turns) - 1}" for c, chain in enumerate(robot.chains)]
        self._ends = [
            self.model.body(each).id if chain.turns else 0 for each, chain in zip(ends, robot.chains, strict=True)
        ]

    def measured(self, q: Array) -> tuple[Array, Array]:
        """Return poses (N, 6) at joint coordinates (N, count), and how far loops (N,) are open.

        Distances of the ends of chains are parts of the robot's size; those of rotations are of their matrices.
        """
        every = q[:, self._coordinates] * self._factors
        p, R = np.zeros((len(q), len(self._ends), 3)), np.zeros((len(q), len(self._ends), 3, 3))
        for k, values in enumerate(every):
            self.data.qpos[:] = values
            mujoco.mj_kinematics(self.model, self.data)
            p[k], R[k] = self.data.xpos[self._ends], self.data.xmat[self._ends].reshape(-1, 3, 3)
        home = self.mechanism.robot.home
        turns = cayley_of(R[:, 0]) if self.mechanism.is_ball else angles_of(R[:, 0])
        pose = np.concatenate([p[:, 0] + np.einsum("nij,j->ni", R[:, 0], home), turns], 1)
        off = np.zeros(len(q))
        for one, other in self.mechanism.pairs:
            # Near the platform, which may be far from the world's origin.
            way = p[:, one] - p[:, other] + np.einsum("nij,j->ni", R[:, one] - R[:, other], home)
            turn = np.abs(R[:, one] - R[:, other]).reshape(len(q), -1).max(1)
            off = np.maximum(off, np.maximum(np.abs(way).max(1) / self.mechanism.size, turn))
        if len(self.mechanism.couplings):
            off = np.maximum(off, np.abs(q @ self.mechanism.couplings.T).max(1))
        return pose, off

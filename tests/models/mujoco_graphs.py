"""Mechanisms of any topology in MuJoCo: a tree of bodies whose loops are closed by the engine's constraints, for tests.

Every link is a body whose frame at home is the world's. A joint of the tree is a joint of the engine. Any other joint
carries a further body, which a weld holds to its link; a ball joint is a common point. The engine moves the actuators
and closes the loops, so coordinates, poses and rates do not depend on the package.
"""

from __future__ import annotations

import mujoco
import numpy as np
from builders import Array
from mujoco_robots import null_space

from screwsynth.models.mechanism import Mechanism
from screwsynth.models.mechanism.graph import MechanismJoint

#: Steps from home, steps of Newton's method in each, and the largest residual of a closed loop.
_PATH, _NEWTON, _CLOSED = 8, 40, 1e-12
_INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def _numbers(values: Array) -> str:
    return " ".join(repr(float(each)) for each in values)


def _joints(joint: MechanismJoint) -> str:
    """The engine's joints of an elementary joint; a screw is a hinge and a slide, which a constraint couples."""
    point, axis = _numbers(joint.point), _numbers(joint.axis)
    hinge = f'<joint name="{joint.name}" type="hinge" pos="{point}" axis="{axis}"/>'
    slide = f'<joint name="{{}}" type="slide" pos="{point}" axis="{axis}"/>'
    return {
        "R": hinge,
        "P": slide.format(joint.name),
        "H": slide.format(f"{joint.name} slide") + hinge,
        "S": f'<joint name="{joint.name}" type="ball" pos="{point}"/>',
        "weld": "",
    }[joint.kind]


class GraphEngine:
    """A mechanism in MuJoCo, at home until driven.

    Args:
        mechanism: the mechanism at home.

    Attributes:
        actuators: names of the actuated joints, in the order of the mechanism.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.actuators = tuple(each.name for each in mechanism.joints if each.actuated)
        inside: dict[str, list[str]] = {each.name: [] for each in mechanism.links}
        opening = {mechanism.base: "<worldbody>"}
        left, constraints = list(mechanism.joints), []
        while frontier := [each for each in left if (each.inner in opening) != (each.outer in opening)]:
            joint = min(frontier, key=lambda each: (each.kind == "S", left.index(each)))
            left.remove(joint)
            old, new = (joint.inner, joint.outer) if joint.inner in opening else (joint.outer, joint.inner)
            opening[new] = f'<body name="{new}">{_joints(joint)}{_INERTIA}'
            inside[old].append(new)
        for joint in left:
            bodies = [("world" if each == mechanism.base else each) for each in (joint.inner, joint.outer)]
            ends = f'body1="{bodies[1]}" body2="{bodies[0]}"'
            if joint.kind == "S":
                constraints.append(f'<connect {ends} anchor="{_numbers(joint.point)}"/>')
                continue
            further = f"end of {joint.name}"
            opening[further], inside[further] = f'<body name="{further}">{_joints(joint)}{_INERTIA}', []
            inside[joint.inner].append(further)
            place = _numbers(joint.point)
            constraints.append(f'<weld body1="{bodies[1]}" body2="{further}" anchor="{place}"/>')
        screw = '<joint joint1="{0} slide" joint2="{0}" polycoef="0 {1!r} 0 0 0"/>'
        constraints += [screw.format(each.name, each.pitch) for each in mechanism.joints if each.kind == "H"]

        def tree(link: str) -> str:
            closing = "</worldbody>" if link == mechanism.base else "</body>"
            return opening[link] + "".join(map(tree, inside[link])) + closing

        text = f'<compiler angle="radian"/>{tree(mechanism.base)}<equality>{"".join(constraints)}</equality>'
        self.model = mujoco.MjModel.from_xml_string(f"<mujoco>{text}</mujoco>")
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        self._sign = {each.name: self._sense(each, opening) for each in mechanism.joints}
        self._couplings = np.zeros((len(mechanism.couplings), self.model.nv))
        for row, coupling in zip(self._couplings, mechanism.couplings, strict=True):
            for name, factor in coupling.factors:
                row[self._dof(name)] = factor * self._sign[name]
        plate = mechanism.link(mechanism.platform)
        self._home, self._turned = plate.position, plate.rotation
        self._platform = self.model.body(mechanism.platform).id
        self._motors = [self._dof(name) for name in self.actuators]
        self._senses = np.array([self._sign[name] for name in self.actuators])
        self._update()

    def _sense(self, joint: MechanismJoint, opening: dict[str, str]) -> float:
        """1 where the engine's joint moves the outer link relative to the inner one, else -1."""
        return -1.0 if f'name="{joint.name}"' in opening[joint.inner] else 1.0

    def _dof(self, name: str) -> int:
        return int(self.model.joint(name).dofadr[0])

    def _update(self) -> None:
        mujoco.mj_fwdPosition(self.model, self.data)

    @property
    def rows(self) -> Array:
        """Rows (n, nv) of all constraints."""
        own = np.array(self.data.efc_J).reshape(self.data.nefc, self.model.nv)
        return np.vstack([own, self._couplings])

    def _open(self) -> Array:
        scalar = np.zeros(self.model.nv)
        for k in range(self.model.njnt):
            if self.model.jnt_type[k] != mujoco.mjtJoint.mjJNT_BALL:
                scalar[self.model.jnt_dofadr[k]] = self.data.qpos[self.model.jnt_qposadr[k]]
        return np.concatenate([np.array(self.data.efc_pos), self._couplings @ scalar])

    def drive(self, values: Array) -> bool:
        """Move the actuators from where they are to coordinates from home; return whether the loops close."""
        places = [int(self.model.joint(name).qposadr[0]) for name in self.actuators]
        begin, end = self.data.qpos[places].copy(), values * self._senses
        passive = np.setdiff1d(np.arange(self.model.nv), self._motors)
        for k in range(1, _PATH + 1):
            self.data.qpos[places] = begin + k / _PATH * (end - begin)
            self._update()
            for _ in range(_NEWTON):
                off = self._open()
                if np.abs(off).max(initial=0.0) < _CLOSED:
                    break
                change = np.zeros(self.model.nv)
                change[passive] = -np.linalg.lstsq(self.rows[:, passive], off, rcond=1e-9)[0]
                if np.abs(change).max() > 0.5:
                    return False
                mujoco.mj_integratePos(self.model, self.data.qpos, change, 1.0)
                self._update()
            else:
                return False
        return True

    @property
    def pose(self) -> tuple[Array, Array]:
        """Position (3,) and rotation (3, 3) of the platform."""
        R = np.array(self.data.xmat[self._platform]).reshape(3, 3)
        return self.data.xpos[self._platform] + R @ self._home, R @ self._turned

    def _to_platform(self) -> Array:
        """Twist (6, nv) of the platform about its origin, for rates of all joints."""
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, linear, angular, self.pose[0], self._platform)
        return np.vstack([angular, linear])

    def motions(self) -> tuple[Array, Array]:
        """Twists (n, 6) of the platform about its origin, and the actuator rates (n, a) in each; all closed motions."""
        free = null_space(self.rows)
        return (self._to_platform() @ free).T, (free[self._motors] * self._senses[:, None]).T

    @property
    def regularity(self) -> float:
        """Smallest singular value that is not 0, as a part of the largest.

        The matrices are the constraints with free actuators, with locked actuators, and with the platform at rest.
        """
        passive = np.setdiff1d(np.arange(self.model.nv), self._motors)
        found = []
        for matrix in (self.rows, self.rows[:, passive], np.vstack([self.rows, self._to_platform()])):
            values = np.linalg.svd(matrix, compute_uv=False)
            found.append(float((values[values > 1e-11 * values[0]]).min() / values[0]))
        return min(found)

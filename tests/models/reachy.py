"""The head of Reachy Mini from its maker's kinematic data, for tests: inverse kinematics in closed form, MJCF, URDF.

Numbers: ``src/reachy_mini/assets/kinematics_data.json`` of github.com/pollen-robotics/reachy_mini (commit 70a7c0b),
Copyright 2025 Pollen Robotics, Apache License 2.0: lengths of crank and rod, ``T_motor_world``, ``branch_position`` and
``solution`` of each motor, rounded to nine digits. Lengths in metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from builders import Array

CRANK, ROD = 0.04, 0.085


@dataclass(frozen=True, eq=False)
class Motor:
    """A motor: rotation and translation of the world in its frame, the rod's end in the head's frame, and the elbow."""

    rotation: Array
    translation: Array
    branch: Array
    elbow: int

    @property
    def place(self) -> Array:
        """(3,) origin of its frame in the world; the axis of the motor is z of the frame."""
        return np.asarray(-self.rotation.T @ self.translation)

    def angle(self, position: Array, rotation: Array) -> float:
        """Angle of the crank for a pose of the head, from the triangle of crank, rod and the rod's end."""
        p = self.rotation @ (position + rotation @ self.branch) + self.translation
        cosine = (p @ p + CRANK**2 - ROD**2) / (2 * CRANK * math.hypot(p[0], p[1]))
        turn = math.atan2(p[1], p[0]) + self.elbow * math.acos(cosine)
        return math.remainder(turn, 2 * math.pi)

    def rate(self, position: Array, rotation: Array, twist: Array) -> float:
        """Rate of the crank, from the derivative of the rod's constant length."""
        end = position + rotation @ self.branch
        p = self.rotation @ end + self.translation
        speed = self.rotation @ (twist[3:] + np.cross(twist[:3], end))
        angle = self.angle(position, rotation)
        rod = p - CRANK * np.array([math.cos(angle), math.sin(angle), 0.0])
        return float(rod @ speed / (CRANK * (p[1] * math.cos(angle) - p[0] * math.sin(angle))))


def _motor(numbers: str, branch: tuple[float, float, float], elbow: int) -> Motor:
    rows = np.array([float(each) for each in numbers.split()]).reshape(3, 4)
    return Motor(rows[:, :3], rows[:, 3], np.array(branch), elbow)


MOTORS = [
    _motor(
        "0.866024792 -0.500001060 -2.298079e-6 -0.009999848 4.490196e-6 3.181077e-6 1 -0.076633460"
        " -0.500001060 -0.866024792 4.999994e-6 0.036660158",
        (0.020648178, 0.021763724, 1.03457e-7),
        -1,
    ),
    _motor(
        "-0.866021118 0.500007423 2.298070e-6 -0.010000552 -4.490220e-6 -3.181063e-6 -1 0.076633460"
        " -0.500007423 -0.866021118 5.000011e-6 0.036660087",
        (0.008523816, 0.028763669, 1.18344e-7),
        1,
    ),
    _motor(
        "6.326795e-6 1 -7.055e-12 -0.009999884 -1.019615e-6 1.35e-11 1 -0.076633460"
        " 1 -6.326795e-6 1.019615e-6 0.036660683",
        (-0.029172011, 0.006999943, 4.0290e-8),
        -1,
    ),
    _motor(
        "-3.673205e-6 -1 -6.77e-14 -0.010000000 1.019615e-6 -3.6776e-12 -1 0.076633460"
        " 1 -3.673205e-6 1.019615e-6 0.036660657",
        (-0.029172040, -0.006999996, -3.1608e-8),
        1,
    ),
    _motor(
        "-0.866028465 -0.499994698 2.298079e-6 -0.010000232 4.490173e-6 -3.181110e-6 1 -0.076633460"
        " -0.499994698 0.866028465 4.999994e-6 0.036660161",
        (0.008523809, -0.028763713, -1.43449e-7),
        -1,
    ),
    _motor(
        "0.866024792 0.500001060 -2.298070e-6 -0.009999527 -4.490196e-6 3.181096e-6 -1 0.076633460"
        " -0.500001060 0.866024792 5.000011e-6 0.036660231",
        (0.020648187, -0.021763696, -8.9579e-8),
        1,
    ),
]
#: Place of the head in which all cranks stand at 0, to 1e-5 rad: that of the maker's MuJoCo model.
HOME = np.array([0.0, 0.0, 0.149571])


def _text(vector: Array) -> str:
    return " ".join(repr(float(each)) for each in vector)


def mjcf(*, names: bool = True, lift: float = 0.0) -> str:
    """The head as onshape-to-robot writes it: balls in the tree, sites closing_k_1 and closing_k_2, connects.

    Args:
        names: whether the connects have names.
        lift: way by which the head is above its home, so that the loops are open.
    """
    bodies, sites, equalities, actuators = [], [], [], []
    for k, motor in enumerate(MOTORS, 1):
        axis, elbow = motor.rotation[2], motor.place + CRANK * motor.rotation[0]
        end = HOME + motor.branch
        bodies.append(
            f'<body name="horn_{k}" pos="{_text(motor.place)}">'
            f'<joint name="stewart_{k}" type="hinge" axis="{_text(axis)}" range="-0.8 0.8"/>'
            f'<geom type="mesh" mesh="horn"/><body name="rod_{k}" pos="{_text(elbow - motor.place)}">'
            f'<joint name="passive_{k}" type="ball"/><site name="closing_{k}_1" pos="{_text(end - elbow)}"/>'
            "</body></body>"
        )
        sites.append(f'<site name="closing_{k}_2" pos="{_text(motor.branch)}"/>')
        name = f'name="loop_{k}" ' if names else ""
        equalities.append(f'<connect {name}site1="closing_{k}_1" site2="closing_{k}_2"/>')
        actuators.append(f'<position joint="stewart_{k}"/>')
    above = HOME + np.array([0.0, 0.0, lift])
    return (
        '<mujoco model="head"><compiler angle="radian" meshdir="nowhere"/>'
        '<asset><mesh name="horn" file="missing.stl"/></asset>'
        f'<worldbody><body name="torso">{"".join(bodies)}</body><body name="head" pos="{_text(above)}"><freejoint/>'
        f'<geom type="mesh" mesh="horn"/><site name="nose" pos="0.05 0 0"/>{"".join(sites)}'
        '<body name="ear"><joint name="ear" type="hinge"/></body></body></worldbody>'
        f"<equality>{''.join(equalities)}</equality>"
        f'<actuator>{"".join(actuators)}<position joint="ear"/></actuator></mujoco>'
    )


def urdf(closing: str) -> str:
    """The head as a URDF: balls as three hinges, a floating head, and loops as frames, pairs or constraints.

    Args:
        closing: ``frames`` for links closing_k_1 and closing_k_2, ``pairs`` for other names, or ``constraints``.
    """
    links, joints = ["torso", "head"], []
    joints.append(_joint("free", "floating", "torso", "head", HOME))
    for k, motor in enumerate(MOTORS, 1):
        elbow, end = motor.place + CRANK * motor.rotation[0], HOME + motor.branch
        joints.append(_joint(f"stewart_{k}", "revolute", "torso", f"horn_{k}", motor.place, motor.rotation[2]))
        parent, at = f"horn_{k}", elbow - motor.place
        for letter, axis in zip("xyz", np.eye(3), strict=True):
            child = f"rod_{k}" if letter == "z" else f"rod_{k}_{letter}"
            joints.append(_joint(f"passive_{k}_{letter}", "continuous", parent, child, at, axis))
            links.append(child)
            parent, at = child, np.zeros(3)
        links.append(f"horn_{k}")
        if closing == "constraints":
            joints.append(
                f'<constraint name="closing_{k}" type="spherical"><parent link="rod_{k}"/>'
                f'<parent_origin xyz="{_text(end - elbow)}"/><child link="head"/>'
                f'<child_origin xyz="{_text(motor.branch)}"/></constraint>'
            )
            continue
        first, second = (f"closing_{k}_1", f"closing_{k}_2") if closing == "frames" else (f"loop{k}_A", f"loop{k}_B")
        joints.append(_joint(f"{first}_frame", "fixed", f"rod_{k}", first, end - elbow))
        joints.append(_joint(f"{second}_frame", "fixed", "head", second, motor.branch))
        links += [first, second]
    return f'<robot name="head">{"".join(f"""<link name="{name}"/>""" for name in links)}{"".join(joints)}</robot>'


def _joint(name: str, kind: str, parent: str, child: str, at: Array, axis: Array | None = None) -> str:
    direction = "" if axis is None else f'<axis xyz="{_text(axis)}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{_text(at)}" rpy="0 0 0"/>{direction}'
        f'<parent link="{parent}"/><child link="{child}"/></joint>'
    )

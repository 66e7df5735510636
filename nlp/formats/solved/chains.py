"""Chains of elementary joints from the base to the platform, in numbers, at the configuration in which they are stated.

A universal joint is two hinges, a cylindrical joint a hinge and a slide. A parallelogram is the two hinges of a rod in
its middle, of which the second turns back by the angle of the first; its two rods are at equal distances from that one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ....models import FloatArray
from ....models.mechanism.graph import ElementaryKind

#: Angle of a rotation vector below which its matrix is that of a first-order rotation: the next term is below rounding.
_SMALL = 1e-9


@dataclass(frozen=True, eq=False)
class Step:
    """An elementary joint of a chain.

    Attributes:
        name: unique among the joints of the robot.
        label: of the joint in the robot file that it is part of, such as ``2:3``.
        given: name that the robot file gives that joint; empty for none.
        part: name of the coordinate, such as ``first``; empty for the only one.
        kind: ``R``, ``P``, ``H`` or ``S``.
        point: (3,) its centre, or a point of its axis, in the world frame, length.
        axis: (3,) unit direction; zero for ``S``.
        pitch: translation per radian of an ``H``, length.
        actuated: whether an actuator drives it.
        actuator: name of that actuator; empty for none.
        coordinate: its coordinate from home, where it is known: radians or length.
        follows: whether it turns back by the angle of the step before it, as a parallelogram does.
        side: (3,) from the middle of a parallelogram to one of its two rods, length; None for other joints.
        lever: length of a parallelogram's rod, which turns its coordinate into the way of its actuator; else None.
    """

    name: str
    label: str
    given: str
    part: str
    kind: ElementaryKind
    point: FloatArray
    axis: FloatArray
    pitch: float = 0.0
    actuated: bool = False
    actuator: str = ""
    coordinate: float | None = None
    follows: bool = False
    side: FloatArray | None = None
    lever: float | None = None


class Chain(NamedTuple):
    """A path of elementary joints from the base to the platform.

    Attributes:
        limb: name of the limb.
        name: of the path, for messages.
        steps: from base to platform; those of a stem are the same objects in all paths of a limb.
    """

    limb: str
    name: str
    steps: tuple[Step, ...]


class Chains(NamedTuple):
    """All paths of a robot at the configuration in which they are stated.

    Attributes:
        chains: the paths.
        origin: (3,) origin of the platform frame in the world frame there, length.
        rotation: (3, 3) axes of the platform frame there, platform to world coordinates.
        notes: sentences for people about choices that the result leaves open.
    """

    chains: tuple[Chain, ...]
    origin: FloatArray
    rotation: FloatArray
    notes: tuple[str, ...] = ()


class Moved(NamedTuple):
    """A displacement of a body: a point ``x`` goes to ``R x + t``."""

    R: FloatArray
    t: FloatArray

    def point(self, point: FloatArray) -> FloatArray:
        """Return where a point (3,) goes."""
        return np.asarray(self.R @ point + self.t)

    def after(self, first: Moved) -> Moved:
        """Return this displacement after another one, which comes first."""
        return Moved(self.R @ first.R, self.R @ first.t + self.t)

    def inverse(self) -> Moved:
        """Return the displacement back."""
        return Moved(self.R.T, -self.R.T @ self.t)


#: The displacement that leaves every point in its place.
STILL = Moved(np.eye(3), np.zeros(3))


def cross_matrix(v: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) of the cross product with a vector (3,)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def rotation_by(vector: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,), radians."""
    angle = float(np.linalg.norm(vector))
    if angle < _SMALL:
        return np.asarray(np.eye(3) + cross_matrix(vector))
    K = cross_matrix(vector / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K))


def step_motion(step: Step, value: float | FloatArray) -> Moved:
    """Return the displacement of a joint at its coordinate; the value of an ``S`` is its rotation matrix (3, 3)."""
    if isinstance(value, np.ndarray):
        return Moved(value, step.point - value @ step.point)
    if step.kind == "P":
        return Moved(np.eye(3), value * step.axis)
    R = rotation_by(value * step.axis)
    return Moved(R, step.point - R @ step.point + step.pitch * value * step.axis)


def with_unique_names(chains: Chains) -> Chains:
    """Return chains in which no two joints have one name: a name that is taken gets an underscore."""
    taken: set[str] = set()
    renamed: dict[int, Step] = {}
    for chain in chains.chains:
        for step in chain.steps:
            if id(step) not in renamed:
                name = step.name
                while name in taken:
                    name += "_"
                taken.add(name)
                renamed[id(step)] = replace(step, name=name)
    found = (chain._replace(steps=tuple(renamed[id(step)] for step in chain.steps)) for chain in chains.chains)
    return chains._replace(chains=tuple(found))

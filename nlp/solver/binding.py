"""Poses of a workspace at which a claim is a constraint of a program, and which of them only repeat another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ..program.nlp import Nlp
from ..proof.statement.machine import JointErrors
from ..proof.workspace.robot.pose_box import PoseNumbers

#: Part of its size by which two constraints may differ that count as the same; and the distance of designs, in half
#: ranges, at which they are compared.
_ALIKE, _NEARBY = 3e-4, 0.05
_SEED = 0


class BindingPose(NamedTuple):
    """A pose at which a claim, by its name, is a constraint.

    Attributes:
        name: of the claim.
        pose: the pose; of a stroke that of the shortest length.
        longest: pose of the longest length of a stroke; else None.
        errors: of the joint centres of the machine that is meant; None for the exact one.
    """

    name: str
    pose: PoseNumbers
    longest: PoseNumbers | None = None
    errors: JointErrors | None = None


class Distinct:
    """Constraints without those that only repeat another: the images of a pose in a symmetric robot.

    Two constraints of one kind are the same where they differ by less than they are tighter than their limits, at a
    design and at designs around it. With both a program would have no unique multipliers.
    """

    def __init__(self) -> None:
        self._known: list[tuple[str, FloatArray, float]] = []

    def adds(self, key: str, values: FloatArray) -> bool:
        """Return whether a claim's constraints are new, and note them.

        Args:
            key: of their kind.
            values: (designs, constraints) their numbers.
        """
        size = float(np.abs(values).max(initial=0.0))
        alike = (
            k == key and v.shape == values.shape and np.abs(v - values).max() <= _ALIKE * s for k, v, s in self._known
        )
        if any(alike):
            return False
        self._known.append((key, values, size))
        return True


def points_around(nlp: Nlp, x: FloatArray) -> list[FloatArray]:
    """Return a design (n,) of a program, and designs around it."""
    rng = np.random.default_rng(_SEED)
    steps = (_NEARBY * nlp.scale * rng.normal(size=nlp.n) for _ in range(3))
    return [x, *(np.clip(x + step, nlp.lower, nlp.upper) for step in steps)]

"""A machine within a tolerance that is singular at a pose.

The smallest singular value of the design is made smaller by errors of the joint centres, each along its derivative
(the method of Frank and Wolfe, whose steps stay within the tolerance). From each machine on the way Newton's method
looks for a singular one, at the pose or near it.

Source: M. Frank, P. Wolfe, *An algorithm for quadratic programming*, Naval Research Logistics Quarterly 3 (1956).
"""

from __future__ import annotations

import numpy as np

from .....models import FloatArray
from ..ranks.singular_pose import SingularPose
from ..robot.motion_matrix import RankMatrix
from ..robot.tolerance_model import Family

#: Steps toward smaller singular values.
_STEPS = 6


class SingularMachine:
    """Search for a singular machine.

    Args:
        family: the machines.
        matrix: whose rank is judged, one of the two of the family.
    """

    def __init__(self, family: Family, matrix: RankMatrix) -> None:
        self._family, self._newton, self._loops = family, SingularPose(family.problem, matrix, family), family.loops

    def search(self, z: FloatArray) -> FloatArray | None:
        """Return the coordinates (n + 3 m,) of a singular machine and its pose, near a pose (n,); None without one."""
        family, n = self._family, len(self._family.problem.start)
        dependent = list(family.problem.dependent)
        machine: FloatArray | None = family.exact(z)
        for step in range(_STEPS):
            if dependent and machine is not None:
                machine = self._loops.closed(machine, dependent)
            slopes = None if machine is None else self._newton.slopes(machine)
            if machine is None or slopes is None:
                return None
            parts = slopes[n:].reshape(-1, 3)
            sizes = np.linalg.norm(parts, axis=1, keepdims=True)
            unit = np.divide(parts, sizes, out=np.zeros_like(parts), where=sizes > 0)
            machine = machine.copy()
            machine[n:] += 2 / (step + 2) * (-family.tolerance * unit.ravel() - machine[n:])
            found = self._newton.search(family.within(machine))
            if found is not None:
                return found
        return None

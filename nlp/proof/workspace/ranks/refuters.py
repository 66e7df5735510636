"""Search for a singular pose while boxes are proved: refuters of the claim that a matrix keeps its rank."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from .....models import FloatArray, frozen_array
from ...statement.machine import CentreErrors, JointErrors
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from ..tolerance.singular_machine import SingularMachine
from .loop_boxes import Cells, Examined
from .singular_pose import SingularPose

#: Smallest singular value, in parts of the largest, from which Newton's method looks for a singular pose, and most
#: attempts.
_SMALL, _MOST = 0.1, 24
#: Number of boxes after which a singular machine is looked for first; later ones are twice as many each.
_FIRST = 64
#: Part of the value before at which it tries again.
_SMALLER = 0.6
#: How a singular pose of Newton's method is known.
BY_NEWTON = "found singular to 1e-10 by Newton's method"


class Singular(NamedTuple):
    """A singular pose.

    Attributes:
        y: (6,) its coordinates.
        reason: how it is known, where that is no proof; else empty.
        sides: (2, 6) two poses at which the determinant has opposite signs, without rounding; None without them.
        errors: of the joint centres of the machine that is singular, of six straight legs; None for the design.
        centres: the same for another robot.
    """

    y: FloatArray
    reason: str = ""
    sides: FloatArray | None = None
    errors: JointErrors | None = None
    centres: CentreErrors | None = None


class Refuter(Protocol):
    """Search for a singular pose."""

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose, or None.

        Args:
            found: the boxes that were examined last.
            boxes: number of all that were examined.
        """


class NewtonRefuter:
    """Newton's method from the boxes whose matrices are nearest to a singular one.

    Args:
        problem: the robot.
        matrix: whose rank is judged.
        family: all machines that are meant; None for the design alone.
        is_shown: whether a singular point (n,), or (n + 3 m,) of another machine, is one in home's assembly.
    """

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: Family | None = None,
        is_shown: Callable[[FloatArray], bool] = lambda _: True,
    ) -> None:
        self._problem, self._family, self._is_shown = problem, family, is_shown
        self._newton = SingularPose(problem, matrix)
        self._machine = None if family is None else SingularMachine(family, family.matrix(matrix))
        self._attempts, self._last = 0, _SMALL
        # Number of boxes from which a singular machine is looked for, although no pose of the design is near to one.
        self._due = _FIRST

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose from the worst of these boxes."""
        values = np.where(found.is_regular, np.inf, found.smallest)
        order = np.argsort(values)[:2]
        for k in order:
            if not values[k] < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            near = self._newton.search(self._middle(found.cells, k))
            shown = self._if_shown(near)
            if shown is not None:
                return shown
            # A singular pose of another assembly says nothing about where one of home's is.
            self._last = _SMALLER * float(values[k]) if near is None else self._last
        if self._machine is None or boxes < self._due or not np.isfinite(values[order[0]]):
            return None
        self._due = 2 * boxes
        return self._if_shown(self._machine.search(self._middle(found.cells, order[0])))

    def _if_shown(self, z: FloatArray | None) -> Singular | None:
        """Return a singular pose if it is one in home's assembly: Newton's method may end in another one."""
        return singular_at(self._problem, self._family, z) if z is not None and self._is_shown(z) else None

    def _middle(self, cells: Cells, k: np.int64) -> FloatArray:
        """Return a point (n,) in the middle of a box, with closed loops or near them."""
        z: FloatArray = cells.near[k].copy()
        own = [*self._problem.independent, *self._problem.dependent]
        z[own] = cells.centre[k, own]
        return z


def singular_at(problem: Problem, family: Family | None, z: FloatArray) -> Singular:
    """Return the singular pose at a point (n,), or (n + 3 m,) of another machine."""
    is_machine = family is not None and len(z) > len(problem.start)
    centres = family.errors_of(z) if family is not None and is_machine else None
    return Singular(frozen_array(problem.pose_of(z), (6,)), BY_NEWTON, centres=centres)

"""Working modes: the sense in which the actuators of each limb drive the platform, compared with home.

The actuators of a limb drive the platform by wrenches that are reciprocal to its passive joints. If a limb bends the
other way, such as an elbow, the power of an actuator in its wrench has the opposite sign to home. Between the two modes
lies a serial singularity, where this power is zero. The sense is the sign of

* ``det(A_home' A)``, with the work rates ``A`` in the actuated screws of wrenches with smooth expressions; or
* ``det[passive, actuated, Z]`` relative to home for a limb whose wrenches have no such expressions; the columns ``Z``
  complete the screws of all joints, and are aligned with those at home.

Free actuator coordinates count as locked in both. The sense is compared without a path from home, so a limb that has
turned by more than a right angle may have the other sign in the same working mode: the sense is only an indication.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, Model, Substitution, driven
from ..program.nlp import Nlp
from ..program.program import Kernel, tuple_of

#: Smallest determinant of unit columns with a sign: below it the limb is singular.
_SINGULAR = 1e-9


class Posture(NamedTuple):
    """Joints of a robot at a point.

    Attributes:
        parameters: (k,) components of all parameters, radians for angles.
        unknowns: (u,) internal unknowns.
        rotation: (3, 3) rotation matrix of the platform.
        position: (3,) position of the platform's origin, length.
    """

    parameters: FloatArray
    unknowns: FloatArray
    rotation: FloatArray
    position: FloatArray


def turned_limbs(model: Model, posture: Posture) -> tuple[str, ...]:
    """Return the names of the limbs whose actuators drive the platform in the opposite sense to home.

    Limbs that are singular at home or at the point, and limbs with dependent passive joints, are left out.

    Args:
        model: model of the robot.
        posture: joints of the robot at the point.
    """
    modes = _modes_of(model)
    now, home = modes.at(posture), modes.home
    return tuple(
        limb for limb, one, other in zip(modes.limbs, now, home, strict=True) if modes.sign(limb, one, other) < 0
    )


def turned_over_poses(nlp: Nlp, x: FloatArray) -> tuple[tuple[str, ...], ...]:
    """Return the limbs driven in the opposite sense to home, at each pose of a point (n,)."""
    model = nlp.program.model
    if not (model.actuators and model.unknowns):
        return ()
    found = []
    for kernel, places in zip(nlp.program.kernels.robot_states, nlp.program.places.unknowns, strict=True):
        at = kernel(x, nlp.arguments)
        posture = Posture(at.parameters.ravel(), x[list(places)], at.rotation, at.position.ravel())
        found.append(turned_limbs(model, posture))
    return tuple(found)


@lru_cache(maxsize=4)
def _modes_of(model: Model) -> _Modes:
    """Return the functions of a robot; the last robots are cached, as a search evaluates many points."""
    return _Modes(model)


class _Modes:
    """Matrices that distinguish the working modes of a robot's limbs.

    Args:
        model: model of the robot.

    Attributes:
        limbs: names of the limbs for which the sense is defined.
        home: matrices of these limbs at home.
    """

    def __init__(self, model: Model) -> None:
        own = Substitution.identity(model)
        self.limbs: list[str] = []
        outputs: list[SX] = []
        self._passive: list[int | None] = []
        paths = {each.limb: each for each in model.joint_screws if not each.is_nested}
        for limb in model.limbs:
            rows = [row for row in model.wrenches if row.limb == limb]
            driving = [each for each in model.actuators if each.limb == limb and each.joint not in model.undetermined]
            path = paths.get(limb)
            if rows and driving:
                self._add(limb, driven(rows, driving, SX(1)), None, outputs)
            elif driving and path is not None:
                passive = path.passive
                actuated = [k for k in path.driven if path.joints[k] not in model.undetermined]
                if len(passive) == path.passive_rank and len(passive) + len(actuated) == path.all_rank:
                    self._add(limb, path.all[:, [*passive, *actuated]], len(passive), outputs)
        function = ca.Function("modes", own.all, [ca.densify(each) for each in outputs])
        self._kernel = Kernel(function, tuple_of)
        dimensions = np.concatenate([np.zeros(0), *[item.typical for item in model.parameters]])
        position = np.array(model.home)
        self.home = self.at(Posture(dimensions, np.zeros(len(model.unknowns)), np.eye(3), position))

    def _add(self, limb: str, values: SX, passive: int | None, outputs: list[SX]) -> None:
        self.limbs.append(limb)
        self._passive.append(passive)
        outputs.append(values)

    def at(self, posture: Posture) -> list[FloatArray]:
        """Return the matrix of each limb: work rates of wrenches in actuated screws, or the screws of all joints."""
        rotation = np.asarray(posture.rotation).ravel(order="F")
        values = self._kernel(posture.parameters, posture.unknowns, rotation, np.ravel(posture.position))
        found = []
        for passive, value in zip(self._passive, values, strict=True):
            found.append(np.array(value) if passive is None else _about(np.array(value), np.ravel(posture.position)))
        return found

    def sign(self, limb: str, now: FloatArray, home: FloatArray) -> int:
        """Return 1 if a limb bends as at home, -1 if the limb bends the opposite way, 0 if the sense is unknown."""
        if not (np.isfinite(now).all() and np.isfinite(home).all()):
            return 0
        if self._passive[self.limbs.index(limb)] is None:
            return _sign_of(_unit(home).T @ _unit(now))
        here, there = _oriented(now), _oriented(home)
        turn = np.sign(np.linalg.det(there[:, home.shape[1] :].T @ here[:, now.shape[1] :])) if here.shape[1] else 1.0
        return int(turn) * _sign_of(here) * _sign_of(there)


def _about(screws: FloatArray, centre: FloatArray) -> FloatArray:
    """Return unit twists (6, n) about a centre; velocities are divided by the largest velocity of the centre."""
    velocities = screws[3:] + np.cross(screws[:3].T, centre).T
    reach = float(np.linalg.norm(velocities, axis=0).max(initial=0.0)) or 1.0
    return _unit(np.vstack([screws[:3], velocities / reach]))


def _unit(columns: FloatArray) -> FloatArray:
    """Return columns as unit vectors; zero columns stay zero."""
    lengths = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(lengths > 0, lengths, 1.0))


def _oriented(columns: FloatArray) -> FloatArray:
    """Return columns (6, n) followed by an orthonormal basis (6, 6 - n) of their complement."""
    return np.hstack([columns, np.linalg.svd(columns)[0][:, columns.shape[1] :]])


def _sign_of(matrix: FloatArray) -> int:
    """Return the sign of a determinant; 0 for a nearly zero determinant."""
    value = float(np.linalg.det(matrix))
    return 0 if abs(value) < _SINGULAR else int(np.sign(value))


def names_of(limbs: Sequence[str]) -> str:
    """Return limbs in words, such as ``limb 2`` or ``limbs 1, 3``."""
    return f"limb{'s' * (len(limbs) > 1)} {', '.join(limbs)}"

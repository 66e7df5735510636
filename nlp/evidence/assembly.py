"""Assembly mode of a robot at a point, compared with the home assembly mode along a path from home.

The loop equations often have several solutions for the same dimensions and pose: other assembly modes, and operation
modes in which the platform has other motions. From home, dimensions and pose move along a straight line to those of
the point, and Newton's method keeps the loops closed. Where the robot cannot take a pose of the line, the nearest pose
replaces it. Modes meet at singularities of the loop equations, so the smallest singular values show how near they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np
from casadi import SX

from ...models import (
    Dimension,
    FloatArray,
    Model,
    Substitution,
    axis_angle_from_matrix,
    matrix_from_axis_angle,
)
from ...models.instance import length_of
from ...models.newton import VectorEquations, newton
from ...models.values import dataclass
from ..program.nlp import Nlp
from ..program.program import Kernel, tuple_of
from .state import RobotState
from .workingmode import Posture, names_of, turned_limbs

#: First and shortest step of the path, as parts of its length, and largest number of Newton steps at each step.
_FIRST = 1 / 16
_SHORTEST = 1 / 2048
_STEPS = 11
#: Largest change of scaled pose and unknowns in a step. A larger change, even in the shortest step, is a jump.
_LARGE = 0.05
#: Weight of a pose step relative to a step of the unknowns: the pose moves only where the unknowns do not suffice.
_HEAVY = 1e-3
#: Largest residual of closed loops; equations have magnitudes of about 1.
_CLOSED = 1e-10
#: Largest change of the loops' residuals by scaling the robot: rounding of its dimensions. Residuals are
#: compared at home, and away from it by a distance relative to the robot's size, or in radians.
_SIMILAR, _AWAY = 1e-7, 0.1
_SEED = 0
#: Singular values below this fraction of the largest are zero: such a loop is mobile at home too.
_ZERO = 1e-9
#: A path is near a singularity where a singular value falls below this fraction of that at home.
NEAR_SINGULAR = 0.1
#: Largest difference of an unknown of magnitude about 1 within one assembly mode: in another mode it is about 0.1.
_SAME = 1e-4


@dataclass(frozen=True)
class Assembly:
    """Assembly mode of the joints at a point, compared with home.

    Attributes:
        is_home: If true, the path from home ends at the internal unknowns of the point.
        nearness: smallest singular value of the loop equations on the path, as a fraction of its value at home; 0 if
            the path jumps or does not reach the pose.
        turned: names of the limbs in another working mode than at home: the path ends at joint positions that differ
            from those of the point, and the actuators of the limb drive the platform in the opposite sense.
    """

    is_home: bool
    nearness: float
    turned: tuple[str, ...] = ()

    @property
    def brief(self) -> str:
        """Short description of an assembly mode that differs from home, or may differ; empty for the home mode."""
        if self.turned:
            return f"another working mode ({names_of(self.turned)})"
        if not self.is_home:
            return "another assembly mode" if self.nearness else "another operation or assembly mode"
        return "" if self.nearness >= NEAR_SINGULAR else "possibly another operation mode"

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences that describe an assembly mode that differs from home, or may differ."""
        found = []
        if not self.nearness >= NEAR_SINGULAR:
            low = f"the smallest singular value of the loops falls to {100 * self.nearness:.2g} % of its value at home"
            jump = "the straight path from home has a jump"
            reason = low if self.nearness else jump
            found.append(f"not reached from home without passing near a singularity: {reason}")
        if self.turned:
            who = names_of(self.turned)
            found.append(f"another working mode than at home: {who} bent the other way, driven in the opposite sense")
        elif not self.is_home:
            found.append("another assembly mode than at home: the path from home ends at other joint positions")
        return tuple(found)


def assembly_of(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> Assembly | None:
    """Return the assembly mode at a point; None for a robot without internal unknowns or without a home.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point.
        pose: index of the pose.
    """
    model = nlp.program.model
    if model.generic is None or not model.unknowns:
        return None
    values = [state.parameters[item.name] for item in model.parameters]
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    return assembly_at(model, Posture(np.concatenate([np.zeros(0), *values]), unknowns, state.rotation, state.position))


def assembly_over_poses(nlp: Nlp, x: FloatArray) -> Assembly | None:
    """Return the assembly mode at a point (n,) over all poses; None as for :func:`assembly_of`."""
    model = nlp.program.model
    if model.generic is None or not model.unknowns:
        return None
    found = []
    for kernel, places in zip(nlp.program.kernels.robot_states, nlp.program.places.unknowns, strict=True):
        at = kernel(x, nlp.arguments)
        posture = Posture(at.parameters.ravel(), x[list(places)], at.rotation, at.position.ravel())
        found.append(assembly_at(model, posture))
    return Assembly(
        is_home=all(each.is_home for each in found),
        nearness=min(each.nearness for each in found),
        turned=tuple(dict.fromkeys(limb for each in found for limb in each.turned)),
    )


def assembly_at(model: Model, posture: Posture) -> Assembly:
    """Return the assembly mode of a robot that is described by its joints.

    Args:
        model: model of the robot.
        posture: parameters, unknowns and pose of the robot.
    """
    axis, angle = axis_angle_from_matrix(posture.rotation)
    unknowns = posture.unknowns
    found, nearness = _follow(model, posture.parameters, np.concatenate([angle * axis, posture.position]), unknowns)
    if found is None:
        return Assembly(is_home=False, nearness=0.0)
    angles = np.array([item.dimension is Dimension.ANGLE for item in model.unknowns])
    apart = np.abs(found - unknowns) / _sizes_of_unknowns(model, posture.parameters)
    apart[angles] = np.abs(np.remainder(apart[angles] + np.pi, 2 * np.pi) - np.pi)
    if apart.max(initial=0.0) <= _SAME:
        return Assembly(is_home=True, nearness=nearness)
    # At a fixed pose the limbs are independent: a limb is in another mode if its own unknowns differ.
    return Assembly(is_home=False, nearness=nearness, turned=_turned(model, posture, list(apart > _SAME)))


def _turned(model: Model, posture: Posture, differ: Sequence[bool]) -> tuple[str, ...]:
    """Return the limbs that are driven in the opposite sense to home and have an unknown that ``differ`` marks."""
    owners = [each.limb for each in model.structure for _ in range(each.unknowns)]
    own = {limb for limb, other in zip(owners, differ, strict=True) if other}
    return tuple(limb for limb in turned_limbs(model, posture) if limb in own)


def unknowns_from_home(
    model: Model, parameters: FloatArray, pose: FloatArray, given: FloatArray | None = None
) -> FloatArray | None:
    """Return the internal unknowns (u,) at the end of the path from home to a pose; None if the path ends early.

    Args:
        model: model of the robot.
        parameters: (k,) components of all parameters, radians for angles.
        pose: (6,) rotation vector, radians, and position of the platform.
        given: (u,) values of the unknowns, of which only free actuator coordinates are read; 0 (home) if left out.
    """
    return _follow(model, parameters, pose, np.zeros(len(model.unknowns)) if given is None else given)[0]


def home_position(model: Model, parameters: FloatArray) -> FloatArray:
    """Return the position (3,) of the platform at home, scaled to the size of the robot with parameters (k,)."""
    return np.array(model.home) * _path_of(model).factor(parameters)


def _follow(
    model: Model, parameters: FloatArray, pose: FloatArray, unknowns: FloatArray
) -> tuple[FloatArray | None, float]:
    """Return the unknowns (u,) at the end of the path from home, and the nearness to a singularity along it.

    The unknowns are None if the path ends early. Free actuator coordinates move on the path to their given values.
    """
    path = _path_of(model)
    dimensions = np.concatenate([np.zeros(0), *[item.typical for item in model.parameters]])
    start = np.concatenate([np.zeros(3), model.home])
    given, factor = parameters, path.factor(parameters)
    parameters = np.where(path.is_length, parameters / factor, parameters)
    pose = np.concatenate([pose[:3], pose[3:] / factor])
    at = np.concatenate([start, np.zeros(len(model.unknowns))])
    sizes = _sizes_of_unknowns(model, given)
    free = unknowns / sizes * path.is_free
    at_home = path.singular_values(at, dimensions)
    regular = at_home > _ZERO
    nearness, done, step = 1.0, 0.0, _FIRST
    while done < 1.0:
        part = min(1.0, done + step)
        here = (1 - part) * dimensions + part * parameters
        target = np.concatenate([(1 - part) * start + part * pose, np.where(path.is_free, part * free, at[6:])])
        # The last step ends at the pose itself: here only the unknowns may close the loops.
        closed = path.closed(target, here, with_pose=part < 1.0)
        change = np.inf if closed is None else float(np.linalg.norm((closed - at) / path.scale))
        if change > _LARGE and part - done > _SHORTEST:
            step = (part - done) / 2
            continue
        if closed is None:
            return None, 0.0
        if change > _LARGE:
            nearness = 0.0  # the path jumps to another branch
        at, done = closed, part
        step = 2 * step if change < _LARGE / 4 else step
        nearness = min(nearness, float((path.singular_values(at, here)[regular] / at_home[regular]).min(initial=1.0)))
    return at[6:] * sizes, nearness


@lru_cache(maxsize=4)
def _path_of(model: Model) -> _Path:
    """Return the loop equations of a robot, from a cache of the last four robots."""
    return _Path(model)


class _Path:
    """Loop equations of a robot and their derivatives, as functions of rotation vector, position and unknowns.

    Rotation vector, position and unknowns form one vector, in which unknowns are divided by their sizes. The unit of
    length of the case may differ from that of the robot file. A scaled robot has the same assembly modes, so the path
    uses the scale of the robot file.

    Args:
        model: model of the robot.

    Attributes:
        scale: (6 + u,) size of each component: a length of the robot for positions, 1 for other components.
        is_length: (k,) whether each component of the parameters is a length.
        is_free: (u,) whether each unknown is a free actuator coordinate.
    """

    def __init__(self, model: Model) -> None:
        own = Substitution.identity(model)
        z = SX.sym("z", 6 + len(model.unknowns))
        # A rotation vector of zero has no direction: a tiny number avoids 0 / 0.
        angle = ca.sqrt(ca.sumsqr(z[:3]) + np.finfo(float).tiny)
        rotation = matrix_from_axis_angle(z[:3] / angle, angle)
        equations = ca.vertcat(*[each.scaled for each in model.closure])
        sizes = ca.vertcat(*[item.size for item in model.unknowns])
        (residual,) = ca.Function("closure", own.all, [equations]).call(
            [own.parameters, z[6:] * sizes, rotation, z[3:6]]
        )
        # With lengths of the robot's size, the singular values are those of equations of magnitude about 1.
        outputs = [ca.densify(residual), ca.densify(ca.jacobian(residual, z))]
        self._kernel = Kernel(ca.Function("path", [z, own.parameters], outputs), tuple_of)
        self.scale = np.ones(z.numel())
        self.scale[3:6] = _size(model)
        self._home = np.concatenate([np.zeros(3), model.home, np.zeros(len(model.unknowns))])
        self._typical = np.concatenate([np.zeros(0), *[item.typical for item in model.parameters]])
        lengths = [[item.dimension is Dimension.LENGTH] * len(item.typical) for item in model.parameters]
        self.is_length = np.concatenate([np.zeros(0, dtype=bool), *lengths])
        self.is_free = np.array([item.is_free for item in model.unknowns], dtype=bool)
        self._determined = 6 + np.flatnonzero(~self.is_free)

    def factor(self, parameters: FloatArray) -> float:
        """Return the ratio of the lengths of a robot with parameters (k,) to its typical lengths at home.

        It is 1 for a robot file with lengths besides the parameters: such a robot cannot be scaled.
        """
        sizes = [float(np.linalg.norm(each[self.is_length])) for each in (parameters, self._typical)]
        if not min(sizes) > 0:
            return 1.0
        factor = sizes[0] / sizes[1]
        typical = np.where(self.is_length, factor * self._typical, self._typical)
        larger = np.where(np.isin(np.arange(len(self._home)), (3, 4, 5)), factor, 1.0)
        # Points given by dimensions alone close the loops of home at any size, so residuals away from home count too.
        away = self._home + _AWAY * self.scale * np.random.default_rng(_SEED).uniform(-1, 1, len(self._home))
        change = [self._kernel(larger * z, typical)[0] - self._kernel(z, self._typical)[0] for z in (self._home, away)]
        return factor if float(np.abs(np.concatenate(change)).max(initial=0.0)) <= _SIMILAR else 1.0

    def singular_values(self, z: FloatArray, parameters: FloatArray) -> FloatArray:
        """Return the smallest singular values of two Jacobians: of the determined unknowns, and of these and the pose.

        The array is empty without equations, or without determined unknowns.
        """
        slopes = self._kernel(z, parameters)[1] * self.scale
        with_pose = np.concatenate([np.arange(6), self._determined])
        parts = (slopes[:, own] for own in (self._determined, with_pose))
        return np.array([np.linalg.svd(part, compute_uv=False)[-1] for part in parts if part.size])

    def closed(self, z: FloatArray, parameters: FloatArray, *, with_pose: bool) -> FloatArray | None:
        """Return a point (6 + u,) near the given one with closed loops, or None.

        Args:
            z: (6 + u,) given point.
            parameters: (k,) parameters of the robot.
            with_pose: If true, the pose may move too; otherwise only the determined unknowns.
        """
        movable = np.concatenate([np.arange(6), self._determined]) if with_pose else self._determined
        scale = self.scale[movable].copy()
        scale[movable < 6] *= _HEAVY
        equations = VectorEquations(lambda at: self._kernel(at, parameters), _CLOSED, movable, scale)
        found = newton(equations, equations.at(z), steps=_STEPS, zeros=[_ZERO])
        return found.z if found.error <= _CLOSED else None


def _sizes_of_unknowns(model: Model, parameters: FloatArray) -> FloatArray:
    """Return the sizes (u,) of the unknowns of a robot with parameters (k,)."""
    sizes = ca.vertcat(SX(0, 1), *[item.size for item in model.unknowns])
    function = ca.Function("sizes", [Substitution.identity(model).parameters], [ca.densify(sizes)])
    return np.asarray(function(parameters).full().ravel(), dtype=np.float64)


def _size(model: Model) -> float:
    """Return a length comparable to the robot's size, from its lengths and its home position."""
    lengths = [value for item in model.parameters if item.dimension is Dimension.LENGTH for value in item.typical]
    return float(np.linalg.norm([*lengths, *model.home])) or length_of(model, model.typical.tolist())

"""Robot of a starter case in its home configuration: degrees of freedom, a feasible motion, and characteristic sizes.

A twist is feasible if it is reciprocal to the constraint wrenches. The task of a starter case is feasible at home and
at several poses around it, so that its F has no contribution of constraints at an optimum. If no motion is feasible at
all of these poses, the rotation of the starter's pose is fixed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...models import (
    FloatArray,
    Model,
    Parameter,
    Screw,
    WrenchKind,
    axis_from_screw,
    constraint_rows,
    homogenised,
    screw_from_axis,
)
from ...models.mechanism.mobility import null_space
from ...models.rows import rank_of
from ..case.case import Case
from ..case.pose import Free, Rotation, Value
from ..case.task import Sense, Task
from ..evidence.closing import close_near, closed_start
from ..evidence.paths import numbers_at
from ..evidence.state import RobotState, evaluate, loops_are_closed
from ..program.formulation import formulate
from ..program.nlp import Nlp
from ..program.sampling import starting_points

#: Half range of a free dimension relative to its typical value, and of the position relative to the robot's size.
_SPREAD, _REACH = 0.25, 0.3
#: Half range of an independent rotation, and of a rotation that the position determines, radians.
TURN, FOLLOWING_TURN = math.radians(20), math.radians(60)
#: Number of poses at which the task must be feasible, including home, and seed of the others.
_POSES, _SEED = 7, 0
#: Rounding error of components of unit twists and of F: loops are closed to 1e-10.
_ZERO = 1e-6
#: Smallest force of a unit wrench that counts in the root mean square arm.
_FORCE = 0.1
#: Mantissas of round numbers.
_ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_AXES = (2, 0, 1)


class Turning(NamedTuple):
    """Free rotations of a starter's pose.

    Attributes:
        numbers: number of free rotations: 0, 1 about the axis, or 3 about any axis.
        axis: (3,) unit axis in the world frame; z if it is not used.
        follows: True if the position determines the rotation by the loop equations.
    """

    numbers: int
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    follows: bool = False

    @property
    def largest(self) -> float:
        """Largest angle of the rotation, radians."""
        return FOLLOWING_TURN if self.follows else TURN


class Home(NamedTuple):
    """Robot in its home configuration, with the values that a starter case states.

    Attributes:
        state: the robot at home.
        arm: root mean square arm of the forces about the platform origin, length; the robot's size if all arms are 0.
            It is the characteristic length, and divides moments in the condition number.
        condition: condition number of J at home, or the smallest one around a singular home; infinite if J is singular
            everywhere.
        mobility: degrees of freedom of the platform at home, or around a singular home.
        moves: (3,) True for each free component of the position.
        turning: free rotations of the pose.
        reach: half range of the free components of the position, length.
        free: index of the free parameter; None for no free parameter.
        motion: feasible motion of the platform at home and around it; None for six degrees of freedom.
        is_flat: True if F of this motion is the same at home and around it.
        motions: feasible motions at home and around it: translations along z, x and y, then rotations about these
            directions, then any other motions.
    """

    state: RobotState
    arm: float
    condition: float
    mobility: int
    moves: tuple[bool, ...]
    turning: Turning
    reach: float
    free: int | None
    motion: Screw | None
    is_flat: bool
    motions: tuple[Screw, ...]


class _Place(NamedTuple):
    """Pose with closed loops: unit constraint wrenches (k, 6), rows of J (m, 6), and the position (3,)."""

    constraints: FloatArray
    rows: FloatArray
    position: FloatArray


def round_number(value: float) -> float:
    """Return the nearest number with a short mantissa, such as 2.5."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(_ROUND, key=lambda each: abs(each * power - value)) * power


def starter_values(parameter: Parameter) -> tuple[float, ...]:
    """Return the values of a parameter's components in a starter case."""
    return parameter.starter or parameter.typical


def free_widths(parameter: Parameter) -> tuple[float, ...]:
    """Return the half range of each component of a free parameter; components of a point that are 0 stay fixed."""
    values = starter_values(parameter)
    width = round_number(_SPREAD * max(abs(value) for value in values) or 1.0)
    return tuple(width if value or len(values) == 1 else 0.0 for value in values)


def read_home(model: Model, size: float) -> Home:
    """Return a robot in its home configuration, with the values that a starter case states.

    Args:
        model: the robot.
        size: length comparable to the robot's size.
    """
    reach = round_number(_REACH * size)
    every, any_axis = (True, True, True), Turning(3)
    places = _places(_program(model, every, any_axis, reach))
    moves, turning = _free_pose(places, size)
    free_pose = _program(model, moves, turning, reach)
    places = _places(free_pose)
    possible = _common_twists(places, size)
    if not len(possible):
        # A rotation changes the feasible motions of the platform.
        moves, turning = _moves([_slides(_twists(places[0], size))]), Turning(0)
        free_pose = _program(model, moves, turning, reach)
        places = _places(free_pose)
        possible = _common_twists(places, size)
    mobility = len(_regular_twists(places, size)[0])
    motion, is_flat = None, False
    motions = _motions(possible) if len(possible) else []
    if 0 < len(possible) < 6:
        motion, is_flat = _motion(motions, places, size)
    free = _free_parameter(model, moves, turning, reach, size, motion)
    state, arm = evaluate(free_pose, _home_point(free_pose)), _arm(places[0], size)
    near = _places(_program(model, moves, turning, reach, length=arm))
    condition = min(_condition(each, arm) for each in (near if state.is_singular else near[:1]))
    screws = tuple(_screw(twist, places[0].position, size) for twist in motions)
    return Home(state, arm, condition, mobility, moves, turning, reach, free, motion, is_flat, screws)


def objective_at_home(model: Model, home: Home, motion: Screw) -> float:
    """Return F of a motion at home, with the dimensions and the characteristic length of a starter case."""
    parameters: dict[str, tuple[Value, ...]] = {item.name: starter_values(item) for item in model.parameters}
    point = None if math.isinf(motion.pitch) else motion.point
    task = Task.screw(Sense.MAX, axis=motion.axis, point=point, pitch=motion.pitch)
    nlp = formulate(Case(model, parameters, model.home, [task], characteristic_length=home.arm))
    return evaluate(nlp, _home_point(nlp)).F


def _program(
    model: Model, moves: tuple[bool, ...], turning: Turning, reach: float, free: int | None = None, length: float = 1.0
) -> Nlp:
    """Return the nonlinear program of a robot with some coordinates of its pose free, and optionally a parameter."""
    parameters: dict[str, tuple[Value, ...]] = {item.name: starter_values(item) for item in model.parameters}
    if free is not None:
        item = model.parameters[free]
        values, widths = starter_values(item), free_widths(item)
        ranges = [
            (max(value - width, item.lower), min(value + width, item.upper), value)
            for value, width in zip(values, widths, strict=True)
        ]
        parameters[item.name] = tuple(Free(*each) if each[0] < each[1] else each[2] for each in ranges)
    position = [
        Free(value - reach, value + reach, value) if is_free else value
        for value, is_free in zip(model.home, moves, strict=True)
    ]
    rotation = Rotation()
    if turning.numbers:
        axis = None if turning.numbers == 3 else turning.axis
        rotation = Rotation(axis, Free(-turning.largest, turning.largest, 0.0))
    tasks = [Task.screw(Sense.MAX, axis=(0, 0, 1), pitch=math.inf)]
    case = Case(model, parameters, position, tasks, rotation, characteristic_length=length)
    return formulate(case)


def _home_point(nlp: Nlp) -> FloatArray:
    """Return the starting point (n,) of a program, with closed loops."""
    return closed_start(nlp) if nlp.n else nlp.start


def _places(nlp: Nlp) -> list[_Place]:
    """Return the home pose, and poses around it with closed loops."""
    home = _home_point(nlp)
    points = [home]
    if nlp.n:
        around = starting_points(nlp, _POSES, _SEED)[1:]
        # Free actuator coordinates stay at home.
        held = [index for at_pose in nlp.program.places.joints for index in at_pose]
        around[:, held] = home[held]
        near = (close_near(nlp, home, x) for x in around)
        points += [x for x in near if loops_are_closed(nlp, x)]
    return [_place(nlp, x) for x in points]


def _place(nlp: Nlp, x: FloatArray) -> _Place:
    """Return the pose of the robot at a point (n,) of a program."""
    model = nlp.program.model
    numbers = numbers_at(nlp, x)
    rows, position = numbers.jacobian, numbers.position.ravel()
    if model.generic is None:
        couples = [k for k, row in enumerate(model.frame_rows) if row.kind is not WrenchKind.FORCE]
        return _Place(rows[couples], rows, position)
    return _Place(constraint_rows(model, numbers.velocities, position), rows, position)


def _scaled(rows: FloatArray, centre: FloatArray, size: float) -> FloatArray:
    """Return wrenches (m, 6) with moments about a centre, divided by a length."""
    return np.column_stack(homogenised(rows, centre, size))


def _arm(place: _Place, size: float) -> float:
    """Return the root mean square arm of the forces about the platform origin; the robot's size if it is 0."""
    rows = _scaled(place.rows, place.position, 1.0)
    sizes = np.linalg.norm(rows[:, :3], axis=1)
    forces = sizes > _FORCE
    arms = np.linalg.norm(rows[forces, 3:], axis=1) / sizes[forces]
    arm = math.sqrt(float(np.mean(arms**2))) if len(arms) else 0.0
    return float(f"{arm if arm > _ZERO * size else size:.2g}")


def _condition(place: _Place, arm: float) -> float:
    """Return the condition number of J at a pose, with moments divided by an arm; infinite if J is singular."""
    values = np.linalg.svd(_scaled(place.rows, place.position, arm), compute_uv=False)
    # With fewer than six rows, J does not have full rank.
    return float(values[0] / values[-1]) if len(values) == 6 and values[-1] > _ZERO * values[0] else math.inf


def _twists(place: _Place, size: float) -> FloatArray:
    """Return the feasible twists (f, 6) at a pose: velocity of platform origin, then angular velocity times size."""
    return null_space(_scaled(place.constraints, place.position, size)).T


def _regular_twists(places: list[_Place], size: float) -> list[FloatArray]:
    """Return the feasible twists (f, 6) of all poses with the fewest ones; singular poses have more."""
    every = [_twists(place, size) for place in places]
    least = min(map(len, every))
    return [each for each in every if len(each) == least]


def _common_twists(places: list[_Place], size: float) -> FloatArray:
    """Return the twists (f, 6) that are feasible at all poses, with velocities of the point at the home position."""
    centre = places[0].position
    return null_space(np.vstack([_scaled(each.constraints, centre, size) for each in places])).T


def _free_pose(places: list[_Place], size: float) -> tuple[tuple[bool, ...], Turning]:
    """Return the components of the position and the rotations that the robot can change at some pose."""
    every = _regular_twists(places, size)
    moves = _moves(every)
    _, values, right = np.linalg.svd(np.vstack([each[:, 3:] for each in every]))
    rank = int(np.count_nonzero(values > _ZERO))
    first = every[0]
    follows = rank > 0 and rank_of(np.linalg.svd(first[:, :3], compute_uv=False), 1.0) == len(first)
    if rank == 1:
        axis = right[0] * np.sign(right[0][np.argmax(np.abs(right[0]))])
        x, y, z = (round(float(each), 9) + 0.0 for each in axis)
        return moves, Turning(1, (x, y, z), follows)
    return moves, Turning(3 if rank else 0, follows=follows)


def _moves(twists: list[FloatArray]) -> tuple[bool, ...]:
    """Return True for each component of the position (3,) that changes in one of the twists (f, 6)."""
    every = np.vstack(twists)
    return tuple(bool(np.abs(every[:, k]).max(initial=0.0) > _ZERO) for k in range(3))


def _slides(twists: FloatArray) -> FloatArray:
    """Return an orthonormal basis (k, 6) of the translations among twists (f, 6)."""
    left, values, _ = np.linalg.svd(twists[:, 3:])
    return np.asarray(left[:, int(np.count_nonzero(values > _ZERO)) :].T @ twists)


def _motions(possible: FloatArray) -> list[FloatArray]:
    """Return twists that are feasible at all poses.

    Translations along z, x and y come first, then rotations about these directions. Without any of them, the result is
    a basis of all feasible twists.
    """
    slides = _slides(possible)
    spins = np.where(np.abs(possible[:, 3:]) > _ZERO, possible[:, 3:], 0.0)
    found: list[FloatArray] = []
    for k in _AXES:
        along = np.eye(6)[k]
        if np.linalg.norm(along - (along @ slides.T) @ slides) < _ZERO:
            found.append(along)
    for k in _AXES:
        about = np.eye(3)[k]
        shares = np.linalg.lstsq(spins.T, about, rcond=_ZERO)[0]
        if np.linalg.norm(shares @ spins - about) < _ZERO:
            twist = shares @ possible
            twist[:3] -= (twist[:3] @ slides[:, :3].T) @ slides[:, :3]
            found.append(twist)
    return found or [*slides, *possible]


def _motion(found: list[FloatArray], places: list[_Place], size: float) -> tuple[Screw, bool]:
    """Return the first of the feasible twists whose F changes with the pose, and False; else the first, and True."""
    for twist in found:
        F = _values(twist, places, size)
        if max(F) - min(F) > _ZERO * max(F):
            return _screw(twist, places[0].position, size), False
    return _screw(found[0], places[0].position, size), True


def _values(twist: FloatArray, places: list[_Place], size: float) -> list[float]:
    """Return F of a twist (6,) at each pose."""
    centre = places[0].position
    return [float(np.sum((_scaled(each.rows, centre, size) @ twist) ** 2)) for each in places]


def _screw(twist: FloatArray, centre: FloatArray, size: float) -> Screw:
    """Return the screw of a twist (6,) with the velocity of a centre (3,)."""
    omega = twist[3:] / size
    return axis_from_screw(np.concatenate([omega, twist[:3] - np.cross(omega, centre)]))


def _free_parameter(
    model: Model, moves: tuple[bool, ...], turning: Turning, reach: float, size: float, motion: Screw | None
) -> int | None:
    """Return the index of the first dimension that changes F and leaves the motion feasible; None for no such one."""
    twist = np.zeros(6)
    if motion is not None:
        omega, velocity = np.split(screw_from_axis(motion.axis, motion.point, motion.pitch), 2)
        twist = np.concatenate([velocity, omega])
    for index, item in enumerate(model.parameters):
        nlp = _program(model, moves, turning, reach, index)
        work = max(float(np.abs(each.constraints @ twist).max(initial=0.0)) for each in _places(nlp))
        if work > _ZERO * (np.linalg.norm(twist[:3]) + size * np.linalg.norm(twist[3:])):
            continue
        home = _home_point(nlp)
        other = home.copy()
        parts = [
            k for k, each in enumerate(nlp.program.variables) if each.name.removeprefix("robot.") in item.components
        ]
        other[parts] = nlp.upper[parts]
        one, two = (_gram(_place(nlp, x), size) for x in (home, close_near(nlp, home, other)))
        if not np.allclose(one, two, atol=_ZERO):
            return index
    return None


def _gram(place: _Place, size: float) -> FloatArray:
    """Return the quadratic form (6, 6) of F in the twist."""
    rows = _scaled(place.rows, place.position, size)
    return np.asarray(rows.T @ rows)

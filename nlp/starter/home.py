"""The robot of a starter at home and at poses around it: freedoms, a motion that it can make, and its measures.

A twist is possible where the constraint wrenches do no work in it. The task of a starter is possible at home and at
several closed poses around it, with all numbers free that are free in the starter, so that F of it has no part of
constraints at an optimum. Where no motion is possible at all of these poses, the pose has no rotation.
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
from ...models.mechanism.freedoms import null_space
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

#: Half ranges of a free dimension, as a part of its typical value, and of the position, as a part of the robot's size.
#: Limits hold a design within the second.
_SPREAD, _REACH = 0.25, 0.3
#: Half range of a rotation, and of one that follows from the position, radians.
TURN, FOLLOWING_TURN = math.radians(20), math.radians(60)
#: Number of poses, home among them, at which the task must be possible, and their seed.
_POSES, _SEED = 7, 0
#: Components of unit twists, and parts of F, that are smaller are rounding: loops are closed to 1e-10.
_ZERO = 1e-6
#: Forces below this part of a unit have no arm that counts.
_FORCE = 0.1
#: Mantissas of numbers that people state.
_ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_AXES = (2, 0, 1)


class Turning(NamedTuple):
    """Rotations of a starter's pose.

    Attributes:
        numbers: how many of them are free: 0, 1 about the axis, or 3 about any axis.
        axis: (3,) unit axis in the world; z where it does not count.
        follows: whether the rotation follows from the position by closed loops.
    """

    numbers: int
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    follows: bool = False

    @property
    def largest(self) -> float:
        """Largest size of the rotation, radians."""
        return FOLLOWING_TURN if self.follows else TURN


class Home(NamedTuple):
    """A robot at home with what a starter states of it.

    Attributes:
        state: the robot at home.
        arm: root mean square arm of the forces about the platform's origin, length; 1 where they have none. It is the
            characteristic length, and divides moments in the condition number.
        condition: condition number of J at home, or least one around it where home is singular; infinite for none.
        freedoms: of its platform there, or around it where home is singular.
        moves: whether each component of the position (3,) is free.
        turning: rotations of the pose.
        reach: half range of the free components of the position, length.
        free: index of the parameter that is free; None for none.
        motion: a motion that the platform can make at home and around it; None for one with six freedoms.
        is_flat: whether F of this motion is the same at home and around it.
    """

    state: RobotState
    arm: float
    condition: float
    freedoms: int
    moves: tuple[bool, ...]
    turning: Turning
    reach: float
    free: int | None
    motion: Screw | None
    is_flat: bool


class _Place(NamedTuple):
    """A closed pose: unit constraint wrenches (k, 6), all rows (m, 6), about the world's origin, and the position."""

    constraints: FloatArray
    rows: FloatArray
    position: FloatArray


def round_number(value: float) -> float:
    """Return the nearest number with a short mantissa, such as 2.5."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(_ROUND, key=lambda each: abs(each * power - value)) * power


def starter_values(parameter: Parameter) -> tuple[float, ...]:
    """Return the values of a parameter's components in a starter."""
    return parameter.starter or parameter.typical


def free_widths(parameter: Parameter) -> tuple[float, ...]:
    """Return the half range of each component of a free parameter: a point stays in the planes in which it lies."""
    values = starter_values(parameter)
    width = round_number(_SPREAD * max(abs(value) for value in values) or 1.0)
    return tuple(width if value or len(values) == 1 else 0.0 for value in values)


def read_home(model: Model, size: float) -> Home:
    """Return a robot at home with what a starter states of it.

    Args:
        model: the robot.
        size: length of the order of the robot's.
    """
    reach = round_number(_REACH * size)
    every, any_axis = (True, True, True), Turning(3)
    places = _places(_program(model, every, any_axis, reach))
    moves, turning = _pose_numbers(places, size)
    free_pose = _program(model, moves, turning, reach)
    places = _places(free_pose)
    possible = _common_twists(places, size)
    if not len(possible):
        # A rotation changes the motions that the platform can make.
        moves, turning = _moves([_slides(_twists(places[0], size))]), Turning(0)
        free_pose = _program(model, moves, turning, reach)
        places = _places(free_pose)
        possible = _common_twists(places, size)
    freedoms = len(_regular_twists(places, size)[0])
    motion, is_flat = None, False
    if 0 < len(possible) < 6:
        motion, is_flat = _motion(possible, places, size)
    free = _free_parameter(model, moves, turning, reach, size, motion)
    state, arm = evaluate(free_pose, _home_point(free_pose)), _arm(places[0], size)
    near = _places(_program(model, moves, turning, reach, length=arm))
    condition = min(_condition(each, arm) for each in (near if state.is_singular else near[:1]))
    return Home(state, arm, condition, freedoms, moves, turning, reach, free, motion, is_flat)


def _program(
    model: Model, moves: tuple[bool, ...], turning: Turning, reach: float, free: int | None = None, length: float = 1.0
) -> Nlp:
    """Return the program of a robot with some numbers of its pose free, and a parameter."""
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
    """Return the program's start (n,) with closed loops."""
    return closed_start(nlp) if nlp.n else nlp.start


def _places(nlp: Nlp) -> list[_Place]:
    """Return home, and closed poses around it."""
    home = _home_point(nlp)
    points = [home]
    if nlp.n:
        around = starting_points(nlp, _POSES, _SEED)[1:]
        # Driven joints that the pose does not determine stay at home.
        held = [index for at_pose in nlp.program.places.joints for index in at_pose]
        around[:, held] = home[held]
        near = (close_near(nlp, home, x) for x in around)
        points += [x for x in near if loops_are_closed(nlp, x)]
    return [_place(nlp, x) for x in points]


def _place(nlp: Nlp, x: FloatArray) -> _Place:
    """Return the robot at a point (n,) of a program."""
    model = nlp.program.model
    numbers = numbers_at(nlp, x)
    rows, position = numbers.jacobian, numbers.position.ravel()
    if model.generic is None:
        couples = [k for k, row in enumerate(model.frame_rows) if row.kind is not WrenchKind.FORCE]
        return _Place(rows[couples], rows, position)
    return _Place(constraint_rows(model, numbers.velocities, position), rows, position)


def _scaled(rows: FloatArray, centre: FloatArray, size: float) -> FloatArray:
    """Return wrenches (m, 6) with moments about a centre, in parts of a length."""
    return np.column_stack(homogenised(rows, centre, size))


def _arm(place: _Place, size: float) -> float:
    """Return the root mean square arm of a place's forces about the platform's origin; the robot's size for none."""
    rows = _scaled(place.rows, place.position, 1.0)
    sizes = np.linalg.norm(rows[:, :3], axis=1)
    forces = sizes > _FORCE
    arms = np.linalg.norm(rows[forces, 3:], axis=1) / sizes[forces]
    arm = math.sqrt(float(np.mean(arms**2))) if len(arms) else 0.0
    return float(f"{arm if arm > _ZERO * size else size:.2g}")


def _condition(place: _Place, arm: float) -> float:
    """Return the condition number of J at a place, with moments divided by an arm; infinite where J is singular."""
    values = np.linalg.svd(_scaled(place.rows, place.position, arm), compute_uv=False)
    # Fewer than six rows leave the platform a motion.
    return float(values[0] / values[-1]) if len(values) == 6 and values[-1] > _ZERO * values[0] else math.inf


def _twists(place: _Place, size: float) -> FloatArray:
    """Return the twists (f, 6) of a place: velocity of the platform's origin, then angular velocity times the size."""
    return null_space(_scaled(place.constraints, place.position, size)).T


def _regular_twists(places: list[_Place], size: float) -> list[FloatArray]:
    """Return the twists (f, 6) of each place, of those alone that have fewest: at a singularity there are more."""
    every = [_twists(place, size) for place in places]
    least = min(map(len, every))
    return [each for each in every if len(each) == least]


def _common_twists(places: list[_Place], size: float) -> FloatArray:
    """Return the twists (f, 6) that are possible at all places; the velocity is that of the point at home's origin."""
    centre = places[0].position
    return null_space(np.vstack([_scaled(each.constraints, centre, size) for each in places])).T


def _pose_numbers(places: list[_Place], size: float) -> tuple[tuple[bool, ...], Turning]:
    """Return which numbers of the pose the robot can change at some place."""
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
    """Return whether each component of the position (3,) changes in some of the twists (f, 6)."""
    every = np.vstack(twists)
    return tuple(bool(np.abs(every[:, k]).max(initial=0.0) > _ZERO) for k in range(3))


def _slides(twists: FloatArray) -> FloatArray:
    """Return an orthonormal basis (k, 6) of the translations among twists (f, 6)."""
    left, values, _ = np.linalg.svd(twists[:, 3:])
    return np.asarray(left[:, int(np.count_nonzero(values > _ZERO)) :].T @ twists)


def _motion(possible: FloatArray, places: list[_Place], size: float) -> tuple[Screw, bool]:
    """Return a motion that is possible at all places, and whether F of it is the same there.

    Translations along z, x and y come first, then rotations about these directions, then any other.
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
    found = found or [*slides, *possible]
    for twist in found:
        F = _values(twist, places, size)
        if max(F) - min(F) > _ZERO * max(F):
            return _screw(twist, places[0].position, size), False
    return _screw(found[0], places[0].position, size), True


def _values(twist: FloatArray, places: list[_Place], size: float) -> list[float]:
    """Return F of a twist (6,) at each place."""
    centre = places[0].position
    return [float(np.sum((_scaled(each.rows, centre, size) @ twist) ** 2)) for each in places]


def _screw(twist: FloatArray, centre: FloatArray, size: float) -> Screw:
    """Return the screw of a twist (6,) of the velocity of a centre (3,)."""
    omega = twist[3:] / size
    return axis_from_screw(np.concatenate([omega, twist[:3] - np.cross(omega, centre)]))


def _free_parameter(
    model: Model, moves: tuple[bool, ...], turning: Turning, reach: float, size: float, motion: Screw | None
) -> int | None:
    """Return the first dimension on which F depends, and with any value of which the motion is possible."""
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
        own = [k for k, each in enumerate(nlp.program.variables) if each.name.removeprefix("robot.") in item.components]
        other[own] = nlp.upper[own]
        one, two = (_gram(_place(nlp, x), size) for x in (home, close_near(nlp, home, other)))
        if not np.allclose(one, two, atol=_ZERO):
            return index
    return None


def _gram(place: _Place, size: float) -> FloatArray:
    """Return the form (6, 6) of which F is the value for a twist."""
    rows = _scaled(place.rows, place.position, size)
    return np.asarray(rows.T @ rows)

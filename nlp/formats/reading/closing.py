"""Closure of the loops of a description: by Newton's method from the stated configuration, or by least squares."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism import Coupling, Mechanism, MechanismJoint
from ....models.mechanism.descent import Descent, Reached
from ....models.mechanism.motions import WIDTHS, Coordinates, Equations, Motions, Placed
from ....models.newton import newton
from ..frames import Frame, cross_matrix, rotation_vector
from .description import Closing, Description, LoopClosure, unique_name

#: Largest residual of closed loops, relative to the robot's size: rounding leaves 1e-16 to 1e-14.
CLOSED = 1e-12
#: Largest number of Newton steps, of which values with six digits need three; and the tried fractions of a step.
_STEPS, _PARTS = 60, [0.5**k for k in range(13)]
#: Relative singular values that count as zero, in the order of trial. Rounded decimals make the dependent equations of
#: an overconstrained robot independent; no joint motion should compensate for that.
_RANKS = (1e-5, 1e-9)
#: Largest accepted residual of loops that cannot be closed exactly, relative to the size: rounding of typed decimals.
LEAST = 1e-4
#: Actuated joints move only if this reduces the residual by this factor.
_WORTH = 0.1
#: Number of random starts, their largest motions in radians or relative to the size, and their seed.
_STARTS, _FAR, _SEED = 4, (0.1, 0.3, 1.0), 0
#: Largest number of damped steps, of which loops need 5 to 25; and relative decrease of the residual of the last one.
_DAMPED, _STUCK = 300, 1 - 1e-12


class Gap(NamedTuple):
    """Gap of an open loop.

    Attributes:
        name: name of the joint that closes the loop.
        distance: translational gap, length.
        angle: rotational gap, radians.
    """

    name: str
    distance: float
    angle: float

    def share(self, size: float) -> float:
        """Return the gap relative to the robot's size."""
        return max(self.distance / size, self.angle)

    @property
    def words(self) -> str:
        """Gap as text, with distance and angle."""
        return f"{self.distance:.3g} and {math.degrees(self.angle):.3g} deg"


class Closed(NamedTuple):
    """Description with loops closed as far as possible.

    Attributes:
        description: description with all bodies and joints moved.
        turn: largest rotation of a joint, radians.
        way: largest displacement of a prismatic joint, length.
        kept: True if the actuated joints did not move.
    """

    description: Description
    turn: float
    way: float
    kept: bool


def gap_of(closure: LoopClosure, places: Mapping[str, Frame]) -> Gap:
    """Return the gap of a closure.

    Args:
        closure: the closure.
        places: frame of each body by name.
    """
    A, B = (places[name] @ frame for name, frame in _sides(closure))
    found = _equations(closure, A, B, None, np.zeros((6, 0)))
    return Gap(closure.name, float(np.linalg.norm(found.lengths)), float(np.linalg.norm(found.angles)))


def gap_of_coupling(given: Description, coupling: Coupling) -> Gap:
    """Return the residual of a coupling as a gap, in the unit of the coordinate of its first joint."""
    value = abs(given.offsets.get(coupling.name, 0.0))
    return Gap(coupling.name, value, 0.0) if _is_length(given, coupling) else Gap(coupling.name, 0.0, value)


def _is_length(given: Description, coupling: Coupling) -> bool:
    """Return whether the first joint of a coupling is prismatic."""
    return any(joint.name == coupling.factors[0][0] and joint.kind == "P" for joint in given.joints)


def _sides(closure: LoopClosure) -> tuple[tuple[str, Frame], tuple[str, Frame]]:
    return (closure.first, closure.first_frame), (closure.second, closure.second_frame)


class _Equations(NamedTuple):
    """Equations of a closure, lengths (k,) and angles (m,), and their derivatives (k, n) and (m, n)."""

    lengths: FloatArray
    angles: FloatArray
    by_lengths: FloatArray
    by_angles: FloatArray


def _equations(closure: LoopClosure, A: Frame, B: Frame, kept: float | None, twist: FloatArray) -> _Equations:
    """Return the equations of a closure, and derivatives with respect to relative twists of the second body.

    Args:
        closure: the closure.
        A: frame of the closure on the first body, in world coordinates.
        B: frame of the closure on the second body, in world coordinates.
        kept: required cosine between the axes of a universal joint; None for the present cosine.
        twist: (6, n) twists of the second body minus twists of the first body, with velocities at the world origin.
    """
    w, v = twist[:3], twist[3:]
    # In coordinates of the first body's frame, a common motion of both bodies changes no equation.
    apart, moved = A.rotation.T @ (B.position - A.position), A.rotation.T @ (v - cross_matrix(B.position) @ w)
    x, y, z, other = *A.rotation.T, B.rotation[:, 2]
    angles, turned = np.zeros(0), np.zeros((0, twist.shape[1]))
    match closure.closing:
        case Closing.WELD | Closing.SLIDE:
            angles, turned = rotation_vector(A.rotation.T @ B.rotation), A.rotation.T @ w
        case Closing.HINGE | Closing.CYLINDER:
            angles, turned = A.rotation[:, :2].T @ other, np.array([np.cross(other, x), np.cross(other, y)]) @ w
        case Closing.UNIVERSAL:
            angles = np.array([0.0 if kept is None else float(z @ other) - kept])
            turned = np.cross(other, z)[None] @ w
    # Frames of a prismatic or cylindrical joint are free to move along the axis.
    count = 2 if closure.closing in (Closing.SLIDE, Closing.CYLINDER) else 3
    return _Equations(apart[:count], angles, moved[:count], turned)


class _Loops:
    """Loop equations of a description as functions of the joint coordinates of its tree.

    A floating body gets three prismatic joints and a spherical joint in the world origin.

    Args:
        given: the description.
        size: size of the robot, by which lengths are divided.
        keeps_driven: If true, actuated joints do not move.

    Attributes:
        motions: kinematics of the tree.
    """

    def __init__(self, given: Description, size: float, *, keeps_driven: bool) -> None:
        self.given, self.size, self.keeps_driven = given, size, keeps_driven
        joint_of = {joint.outer: [joint] for joint in given.joints}
        joints = [each for body in given.bodies[1:] for each in joint_of.get(body.name) or _floating(given, body.name)]
        self.motions = motions = Motions(Mechanism(given.name, (), tuple(joints), given.root, given.root))
        self._columns = {each.name: columns for each, columns in zip(joints, motions.columns, strict=True)}
        kept = [columns for name, columns in self._columns.items() if keeps_driven and name in given.driven]
        self._free = np.delete(np.arange(motions.count), np.r_[(slice(0), *kept)])
        lengths = np.array([each.kind == "P" for each in joints for _ in range(WIDTHS[each.kind])], dtype=bool)
        # Scales of the moving coordinates: to radians and relative lengths, and to radians and lengths.
        self._parts = np.where(lengths, size / motions.units, 1.0)[self._free]
        self._lengths = 1 / motions.units[self._free]
        self._cosines = {
            each.name: float(A.rotation[:, 2] @ B.rotation[:, 2])
            for each in given.closures
            for A, B in [[given.place_of(name) @ frame for name, frame in _sides(each)]]
        }

    def equations(self, at: Coordinates, placed: Placed) -> Equations:
        """Return equations (m,) and their derivatives (m, n), with lengths relative to the size."""
        given, size, motions = self.given, self.size, self.motions
        values, rows = [np.zeros(0)], [np.zeros((0, motions.count))]
        for each in given.closures:
            A, B = (_frame(placed, name) @ given.place_of(name) @ frame for name, frame in _sides(each))
            twist = placed.twists[each.second] - placed.twists[each.first]
            found = _equations(each, A, B, self._cosines[each.name], twist * motions.units)
            values.append(np.concatenate([found.lengths / size, found.angles]))
            rows.append(np.vstack([found.by_lengths / size, found.by_angles]))
        for coupling in given.couplings:
            row = np.zeros(motions.count)
            for name, factor in coupling.factors:
                row[self._columns[name]] = factor * motions.units[self._columns[name]]
            unit = size if _is_length(given, coupling) else 1.0
            values.append(np.array([row @ at.values + given.offsets.get(coupling.name, 0.0)]) / unit)
            rows.append(row[None] / unit)
        return Equations(np.concatenate(values), np.vstack(rows))

    def random(self, rng: np.random.Generator, far: float) -> Coordinates:
        """Return random coordinates up to a distance from the stated ones, radians or relative to the size."""
        step = np.zeros(self.motions.count)
        step[self._free] = far * self._parts * rng.uniform(-1, 1, len(self._free))
        return self.motions.stepped(self.motions.stated, step, self.motions.placed(self.motions.stated))

    def solved(self, start: Coordinates, rank: float = _RANKS[0]) -> Reached:
        """Return coordinates near a start with closed loops, or with a residual that no step reduces.

        Each step has the smallest norm, in radians and in the file's unit of length.
        """
        descent = Descent(self.motions, self.equations, self._free, CLOSED / 100, size=self._lengths, is_damped=False)
        return newton(descent, descent.at(start), steps=_STEPS, zeros=[rank], parts=_PARTS)

    def least_squares(self, start: Coordinates) -> Reached:
        """Return coordinates near a start with the smallest sum of squared equations."""
        descent = Descent(self.motions, self.equations, self._free, 0.0, size=self._parts, stuck=_STUCK)
        return newton(descent, descent.at(start), steps=_DAMPED, parts=_PARTS)

    def starts(self) -> Iterator[Coordinates]:
        """Yield the stated coordinates, and random ones at several distances."""
        rng = np.random.default_rng(_SEED)
        yield self.motions.stated
        for k in range(1, 1 + _STARTS):
            yield self.random(rng, _FAR[k % len(_FAR)])

    def closed(self, found: Reached) -> Closed:
        """Return the description with all bodies and joints at the coordinates of a solution."""
        given, values = self.given, found.at.values * self.motions.units
        coordinates = {each.name: float(values[self._columns[each.name]].sum()) for each in given.joints}

        def joint(each: MechanismJoint) -> MechanismJoint:
            carried, way = _frame(found.placed, each.inner), coordinates[each.name]
            limits = None if each.range is None else (each.range[0] - way, each.range[1] - way)
            point, axis = carried.position + carried.rotation @ each.point, carried.rotation @ each.axis
            return replace(each, point=point, axis=axis, range=limits)

        offsets = {
            each.name: given.offsets.get(each.name, 0.0) + sum(f * coordinates[name] for name, f in each.factors)
            for each in given.couplings
        }
        turns = [
            float(np.linalg.norm(rotation_vector(moved[:3, :3])))
            for each, moved in zip(self.motions.mechanism.joints, found.placed.joints, strict=True)
            if each.name in coordinates and each.kind in ("R", "S")
        ]
        ways = [abs(coordinates[each.name]) for each in given.joints if each.kind == "P"]
        description = replace(
            given,
            bodies=tuple(replace(body, place=_frame(found.placed, body.name) @ body.place) for body in given.bodies),
            joints=tuple(joint(each) for each in given.joints),
            offsets=offsets,
        )
        return Closed(description, max(turns, default=0.0), max(ways, default=0.0), self.keeps_driven)


def _floating(given: Description, body: str) -> list[MechanismJoint]:
    """Return the joints of a floating body: three prismatic joints, and a spherical joint in the world origin."""
    taken = {*(each.name for each in given.bodies), *(each.name for each in given.joints)}
    names = [unique_name(f"{body} floating {axis}", taken) for axis in "xyz"]
    inner = [given.root, *names]
    slides = [
        MechanismJoint(name, "P", inner[k], name, np.zeros(3), axis)
        for k, (name, axis) in enumerate(zip(names, np.eye(3), strict=True))
    ]
    return [MechanismJoint(unique_name(f"{body} floating", taken), "S", names[-1], body, np.zeros(3)), *slides]


def _frame(placed: Placed, body: str) -> Frame:
    """Return the displacement of a body from the stated configuration."""
    displacement = placed.displacements[body]
    return Frame(displacement[:3, 3], displacement[:3, :3])


def close(given: Description, size: float) -> Closed:
    """Return a description with its loops closed by Newton's method, without motion of actuated joints if possible.

    Loops of an overconstrained robot with inconsistent dimensions are closed in the least-squares sense.

    Args:
        given: the description.
        size: size of the robot, by which lengths are divided.

    Returns:
        Best result; the gaps of its closures tell how well the loops are closed.
    """
    found: list[tuple[float, Reached, _Loops]] = []
    for rank in _RANKS:
        for keeps_driven in (True, False):
            loops = _Loops(given, size, keeps_driven=keeps_driven)
            reached = loops.solved(loops.motions.stated, rank)
            is_kept = keeps_driven or reached.error <= CLOSED
            found.append((reached.error if is_kept else reached.error / _WORTH, reached, loops))
            if reached.error <= CLOSED:
                break
        if min(found, key=_first)[0] <= LEAST:
            break
    _, reached, loops = min(found, key=_first)
    return loops.closed(reached)


def _first(found: tuple[float, Reached, _Loops]) -> float:
    return found[0]


def close_from_other_starts(given: Description, size: float) -> Closed | None:
    """Return a description with its loops closed from another start; None if no tried start closes them."""
    for keeps_driven in (True, False):
        loops = _Loops(given, size, keeps_driven=keeps_driven)
        for start in loops.starts():
            near = loops.least_squares(start)
            found = loops.solved(near.at) if near.error <= LEAST else near
            if found.error <= LEAST:
                return loops.closed(found)
    return None


def least_gaps(given: Description, size: float) -> dict[str, float]:
    """Return the loops that cannot be closed even if all other loops are cut and all actuators are unlocked.

    Returns:
        Smallest gap of each of these loops by name, relative to the size.
    """
    found = {}
    for each in given.closures:
        loops, least = _Loops(replace(given, closures=(each,), couplings=()), size, keeps_driven=False), float("inf")
        for start in loops.starts():
            least = min(least, loops.least_squares(start).error)
            if least <= LEAST:
                break
        found[each.name] = least
    return {name: value for name, value in found.items() if value > LEAST}

"""Loops of a description closed from where it stands, and by least squares from other starts where this fails."""

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

#: Loops are closed where no equation is larger, in parts of the robot's size: rounding leaves 1e-16 to 1e-14.
CLOSED = 1e-12
#: Steps of Newton's method, of which decimals of six digits need three, and the parts of a step that are tried.
_STEPS, _PARTS = 60, [0.5**k for k in range(13)]
#: Singular values below this share of the largest count as zero, in the order in which they are tried. By its decimals,
#: dependent equations of an overconstrained robot are independent, which no motion of its joints is to make up for.
_RANKS = (1e-5, 1e-9)
#: Largest equation that least squares may leave of loops that do not close, in parts of the size: typed decimals.
LEAST = 1e-4
#: Driven joints move only where this makes the least squares so much smaller.
_WORTH = 0.1
#: Random starts beside the stated configuration, their largest motions in radians and parts of the size, and the seed.
_STARTS, _FAR, _SEED = 4, (0.1, 0.3, 1.0), 0
#: Damped steps to least squares, of which loops need 5 to 25; and the part of the equations that the last one leaves.
_DAMPED, _STUCK = 300, 1 - 1e-12


class Gap(NamedTuple):
    """How far a loop is open.

    Attributes:
        name: name of the joint that closes it.
        distance: in length.
        angle: in radians.
    """

    name: str
    distance: float
    angle: float

    def share(self, size: float) -> float:
        """Return how far the loop is open, in parts of the robot's size."""
        return max(self.distance / size, self.angle)

    @property
    def words(self) -> str:
        """How far the loop is open in words."""
        return f"{self.distance:.3g} and {math.degrees(self.angle):.3g} deg"


class Closed(NamedTuple):
    """A description with its loops closed as far as Newton's method came.

    Attributes:
        description: with all bodies and joints moved.
        turn: largest angle by which a joint moved, radians.
        way: largest displacement of a slide, length.
        kept: whether the driven joints stayed where they were.
    """

    description: Description
    turn: float
    way: float
    kept: bool


def gap_of(closure: LoopClosure, places: Mapping[str, Frame]) -> Gap:
    """Return how far a closure is open where its bodies are."""
    A, B = (places[name] @ frame for name, frame in _sides(closure))
    found = _equations(closure, A, B, None, np.zeros((6, 0)))
    return Gap(closure.name, float(np.linalg.norm(found.lengths)), float(np.linalg.norm(found.angles)))


def gap_of_coupling(given: Description, coupling: Coupling) -> Gap:
    """Return by how much a coupling does not hold: in the unit of the coordinate of its first joint."""
    value = abs(given.offsets.get(coupling.name, 0.0))
    return Gap(coupling.name, value, 0.0) if _is_length(given, coupling) else Gap(coupling.name, 0.0, value)


def _is_length(given: Description, coupling: Coupling) -> bool:
    """Return whether the first joint of a coupling is a slide."""
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
    """Return the equations of a closure, and their derivatives by motions of its second body relative to the first.

    Args:
        closure: the closure.
        A: its frame on the first body, in the world.
        B: its frame on the second body.
        kept: cosine between the axes of a universal joint; None for that of the frames themselves.
        twist: (6, n) twists of the second body minus those of the first, velocities at the world's origin.
    """
    w, v = twist[:3], twist[3:]
    # In axes of the first body's frame no common motion of both bodies changes an equation.
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
    # Along the axis of a slide or cylinder the frames are free.
    count = 2 if closure.closing in (Closing.SLIDE, Closing.CYLINDER) else 3
    return _Equations(apart[:count], angles, moved[:count], turned)


class _Loops:
    """Equations of a description by the joints of its tree.

    A body that floats freely hangs on three slides and a ball joint in the world's origin.

    Args:
        given: the description.
        size: size of the robot, by which lengths become plain numbers.
        keeps_driven: whether driven joints stay where they are.

    Attributes:
        motions: kinematics of the tree.
    """

    def __init__(self, given: Description, size: float, *, keeps_driven: bool) -> None:
        self.given, self.size, self.keeps_driven = given, size, keeps_driven
        joint_of = {joint.outer: [joint] for joint in given.joints}
        joints = [each for body in given.bodies[1:] for each in joint_of.get(body.name) or _floating(given, body.name)]
        self.motions = motions = Motions(Mechanism(given.name, (), tuple(joints), given.root, given.root))
        self._columns = {each.name: columns for each, columns in zip(joints, motions.columns, strict=True)}
        kept = [own for name, own in self._columns.items() if keeps_driven and name in given.driven]
        self._free = np.delete(np.arange(motions.count), np.r_[(slice(0), *kept)])
        lengths = np.array([each.kind == "P" for each in joints for _ in range(WIDTHS[each.kind])], dtype=bool)
        # Of the coordinates that move: what makes radians and parts of the size, or radians and lengths, of order 1.
        self._parts = np.where(lengths, size / motions.units, 1.0)[self._free]
        self._lengths = 1 / motions.units[self._free]
        self._cosines = {
            each.name: float(A.rotation[:, 2] @ B.rotation[:, 2])
            for each in given.closures
            for A, B in [[given.place_of(name) @ frame for name, frame in _sides(each)]]
        }

    def equations(self, at: Coordinates, placed: Placed) -> Equations:
        """Return equations (m,) and their derivatives (m, n), lengths in parts of the size."""
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
        """Return random coordinates up to a distance from the stated ones: radians, or parts of the size."""
        step = np.zeros(self.motions.count)
        step[self._free] = far * self._parts * rng.uniform(-1, 1, len(self._free))
        return self.motions.stepped(self.motions.stated, step, self.motions.placed(self.motions.stated))

    def solved(self, start: Coordinates, rank: float = _RANKS[0]) -> Reached:
        """Return coordinates near others at which loops are closed, or from where no step makes them closer.

        Of all steps those move joints least, in radians and in the file's unit of length.
        """
        descent = Descent(self.motions, self.equations, self._free, CLOSED / 100, size=self._lengths, is_damped=False)
        return newton(descent, descent.at(start), steps=_STEPS, zeros=[rank], parts=_PARTS)

    def least_squares(self, start: Coordinates) -> Reached:
        """Return coordinates near others at which the sum of the squared equations is smallest."""
        descent = Descent(self.motions, self.equations, self._free, 0.0, size=self._parts, stuck=_STUCK)
        return newton(descent, descent.at(start), steps=_DAMPED, parts=_PARTS)

    def starts(self) -> Iterator[Coordinates]:
        """Yield coordinates where the model stands, and random ones, some near and some far."""
        rng = np.random.default_rng(_SEED)
        yield self.motions.stated
        for k in range(1, 1 + _STARTS):
            yield self.random(rng, _FAR[k % len(_FAR)])

    def closed(self, found: Reached) -> Closed:
        """Return the description with all its bodies and joints at coordinates."""
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
            float(np.linalg.norm(rotation_vector(own[:3, :3])))
            for each, own in zip(self.motions.mechanism.joints, found.placed.joints, strict=True)
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
    """Return the joints of a body that floats freely: three slides, and a ball joint in the world's origin."""
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
    """Return a description with its loops closed by Newton's method, with driven joints kept where that is possible.

    Loops of an overconstrained robot whose numbers do not fit each other are closed by least squares.

    Args:
        given: the description.
        size: size of the robot, by which lengths become plain numbers.

    Returns:
        The best that was reached; the gaps of its closures say how good it is.
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
    """Return a description with its loops closed from another start; None where none of a few closes them."""
    for keeps_driven in (True, False):
        loops = _Loops(given, size, keeps_driven=keeps_driven)
        for start in loops.starts():
            near = loops.least_squares(start)
            found = loops.solved(near.at) if near.error <= LEAST else near
            if found.error <= LEAST:
                return loops.closed(found)
    return None


def least_gaps(given: Description, size: float) -> dict[str, float]:
    """Return loops that do not close by themselves, all others cut and no actuator held.

    Returns:
        The largest equation at the smallest sum of squares that was found, by the loop's name, in parts of the size.
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

"""Loops of a description closed by Newton's method, and by least squares from other starts where this fails."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism import Coupling, MechanismJoint
from ..frames import Frame, cross_matrix, rotation_about, rotation_vector
from .description import Body, Closing, Description, LoopClosure

#: Loops are closed where no equation is larger, in parts of the robot's size: rounding leaves 1e-16 to 1e-14.
CLOSED = 1e-12
#: Steps of Newton's method; from decimals of six digits it needs three.
_MOST_STEPS = 60
#: Shortest part of a step that is tried.
_SHORTEST = 2.0**-12
#: Singular values below this share of the largest count as zero, in the order in which they are tried. By its decimals,
#: dependent equations of an overconstrained robot are independent, which no motion of its joints is to make up for.
_RANKS = (1e-5, 1e-9)
#: Largest equation that least squares may leave of loops that do not close, in parts of the size: typed decimals.
LEAST = 1e-4
#: Driven joints move only where this makes the least squares so much smaller.
_WORTH = 0.1

#: Random starts beside the stated configuration, their largest motions in radians and parts of the size, and the seed.
_STARTS, _FAR, _SEED = 4, (0.1, 0.3, 1.0), 0
#: Steps of the Levenberg-Marquardt method: these loops need 60 to 140.
_MOST_DAMPED = 300
#: Factors of the damping after a step that reduces the squares, and after one that does not; its smallest and largest.
_SMALLER, _LARGER, _LEAST_DAMPING, _MOST_DAMPING = 0.2, 4.0, 1e-10, 1e12
#: Largest step, and the largest part of a vector of equations that a step may still take away at the end.
_MOST_WAY, _STATIONARY = 1.0, 1e-9


class Gap(NamedTuple):
    """How far a loop is open.

    Attributes:
        name: of the joint that closes it.
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


class Mover:
    """Positions of all joints, as displacements of their bodies from the stated configuration."""

    def __init__(self, given: Description, size: float, *, keeps_driven: bool) -> None:
        self.given, self.size = given, size
        self.joint_of = {joint.outer: joint for joint in given.joints}
        self.index: dict[str, slice] = {}
        count = 0
        for body in given.bodies[1:]:
            joint = self.joint_of.get(body.name)
            width = 6 if joint is None else {"R": 1, "P": 1, "S": 3}.get(joint.kind, 0)
            if joint is not None and keeps_driven and joint.name in given.driven:
                width = 0
            self.index[body.name] = slice(count, count + width)
            count += width
        self.count = count
        places = {body.name: body.place for body in given.bodies}
        self.cosines = {
            c.name: float(
                (places[c.first] @ c.first_frame).rotation[:, 2] @ (places[c.second] @ c.second_frame).rotation[:, 2]
            )
            for c in given.closures
        }
        #: Displacement of each body relative to its parent, and coordinates of hinges and slides.
        self.own = {body.name: Frame() for body in given.bodies}
        self.coordinates = {joint.name: 0.0 for joint in given.joints}

    def moved(self) -> dict[str, Frame]:
        """Return the displacement of each body in the world."""
        found: dict[str, Frame] = {}
        for body in self.given.bodies:
            found[body.name] = found[body.parent] @ self.own[body.name] if body.parent else self.own[body.name]
        return found

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return equations (m,) and their derivatives (m, n) by coordinates, lengths in parts of the size."""
        moved = self.moved()
        screws = self._screws(moved)
        values: list[FloatArray] = []
        rows: list[FloatArray] = []
        for closure in self.given.closures:
            A, B = (moved[name] @ self.given.place_of(name) @ frame for name, frame in _sides(closure))
            twist = screws[closure.second] - screws[closure.first]
            found = _equations(closure, A, B, self.cosines[closure.name], twist)
            values.append(np.concatenate([found.lengths / self.size, found.angles]))
            rows.append(np.vstack([found.by_lengths / self.size, found.by_angles]))
        for coupling in self.given.couplings:
            row = np.zeros(self.count)
            for name, factor in coupling.factors:
                body = next(joint.outer for joint in self.given.joints if joint.name == name)
                row[self.index[body]] = factor
            change = sum(factor * self.coordinates[name] for name, factor in coupling.factors)
            unit = self.size if _is_length(self.given, coupling) else 1.0
            values.append(np.array([change + self.given.offsets.get(coupling.name, 0.0)]) / unit)
            rows.append(row[None] / unit)
        return np.concatenate([np.zeros(0), *values]), np.vstack([np.zeros((0, self.count)), *rows])

    def _screws(self, moved: Mapping[str, Frame]) -> dict[str, FloatArray]:
        """Return the twist (6, n) of each body by the coordinates, velocities at the world's origin."""
        found: dict[str, FloatArray] = {self.given.root: np.zeros((6, self.count))}
        for body in self.given.bodies[1:]:
            screws = found[body.parent].copy() if body.parent else np.zeros((6, self.count))
            place = self.index[body.name]
            if place.stop > place.start:
                screws[:, place] += self._own_screws(body, moved)
            found[body.name] = screws
        return found

    def _own_screws(self, body: Body, moved: Mapping[str, Frame]) -> FloatArray:
        """Return the current screws (6, k) of the joint of a body."""
        joint = self.joint_of.get(body.name)
        if joint is None:
            return np.eye(6)
        carried = moved[body.parent]
        point, axis = carried.position + carried.rotation @ joint.point, carried.rotation @ joint.axis
        if joint.kind == "P":
            return np.concatenate([np.zeros(3), axis])[:, None]
        axes = np.eye(3) if joint.kind == "S" else axis[:, None]
        return np.vstack([axes, cross_matrix(point) @ axes])

    def step(self, way: FloatArray) -> None:
        """Move all joints by a step (n,) of their coordinates."""
        moved = self.moved()
        for body in self.given.bodies[1:]:
            part = way[self.index[body.name]]
            if not part.size:
                continue
            joint, own = self.joint_of.get(body.name), self.own[body.name]
            if joint is None:
                turn = _rotation(part[:3])
                self.own[body.name] = Frame(part[3:], turn) @ own
            elif joint.kind == "S":
                local = moved[body.parent].rotation.T @ part
                self.own[body.name] = _about(joint.point, _rotation(local)) @ own
            elif joint.kind == "P":
                self.coordinates[joint.name] += float(part[0])
                self.own[body.name] = Frame(joint.axis * self.coordinates[joint.name])
            else:
                self.coordinates[joint.name] += float(part[0])
                self.own[body.name] = _about(joint.point, rotation_about(joint.axis, self.coordinates[joint.name]))


def _rotation(vector: FloatArray) -> FloatArray:
    """Return the rotation of a vector (3,), axis times angle."""
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle == 0 else rotation_about(vector / angle, angle)


def _about(point: FloatArray, rotation: FloatArray) -> Frame:
    """Return the displacement that turns about a point."""
    return Frame(point - rotation @ point, rotation)


def close(given: Description, size: float) -> Closed:
    """Return a description with its loops closed by Newton's method, with driven joints kept where that is possible.

    Loops of an overconstrained robot whose numbers do not fit each other are closed by least squares.

    Args:
        given: the description.
        size: of the robot, by which lengths become plain numbers.

    Returns:
        The best that was reached; the gaps of its closures say how good it is.
    """
    found: list[tuple[float, Mover, bool]] = []
    for rank in _RANKS:
        for keeps_driven in (True, False):
            mover = Mover(given, size, keeps_driven=keeps_driven)
            error = solve(mover, rank)
            found.append((error if keeps_driven or error <= CLOSED else error / _WORTH, mover, keeps_driven))
            if error <= CLOSED:
                break
        if min(found, key=_first)[0] <= LEAST:
            break
    _, mover, keeps_driven = min(found, key=_first)
    return closed_by(mover, kept=keeps_driven)


def closed_by(mover: Mover, *, kept: bool) -> Closed:
    """Return the description with all joints where they were moved; ``kept`` is as in :class:`Closed`."""
    given = mover.given
    turns = [rotation_vector(mover.own[j.outer].rotation) for j in given.joints if j.kind in ("R", "S")]
    ways = [abs(mover.coordinates[j.name]) for j in given.joints if j.kind == "P"]
    return Closed(
        _moved(given, mover),
        max((float(np.linalg.norm(each)) for each in turns), default=0.0),
        max(ways, default=0.0),
        kept,
    )


def _first(found: tuple[float, Mover, bool]) -> float:
    return found[0]


def solve(mover: Mover, rank: float = _RANKS[0]) -> float:
    """Move the joints until the loops are closed, or no step makes them closer; return the largest equation."""
    values, derivatives = mover.state()
    for _ in range(_MOST_STEPS):
        error = float(np.linalg.norm(values))
        if not values.size or np.abs(values).max() <= CLOSED / 100:
            break
        way = -np.linalg.pinv(derivatives, rcond=rank) @ values
        length = 1.0
        before = dict(mover.own), dict(mover.coordinates)
        while length >= _SHORTEST:
            mover.step(length * way)
            values, derivatives = mover.state()
            if float(np.linalg.norm(values)) < error:
                break
            mover.own, mover.coordinates = dict(before[0]), dict(before[1])
            length /= 2
        else:
            values, derivatives = mover.state()
            break
    return float(np.abs(values).max(initial=0.0))


def _moved(given: Description, mover: Mover) -> Description:
    """Return a description with all its bodies and joints where they were moved."""
    moved = mover.moved()

    def joint(each: MechanismJoint) -> MechanismJoint:
        carried, way = moved[each.inner], mover.coordinates[each.name]
        limits = None if each.range is None else (each.range[0] - way, each.range[1] - way)
        point, axis = carried.position + carried.rotation @ each.point, carried.rotation @ each.axis
        return replace(each, point=point, axis=axis, range=limits)

    offsets = {
        each.name: given.offsets.get(each.name, 0.0) + sum(f * mover.coordinates[name] for name, f in each.factors)
        for each in given.couplings
    }
    return replace(
        given,
        bodies=tuple(replace(body, place=moved[body.name] @ body.place) for body in given.bodies),
        joints=tuple(joint(each) for each in given.joints),
        offsets=offsets,
    )


def close_from_other_starts(given: Description, size: float) -> Closed | None:
    """Return a description with its loops closed from another start; None where none of a few closes them."""
    for kept in (True, False):
        for mover in _movers(given, size, kept=kept):
            if _least_squares(mover) <= LEAST and solve(mover) <= LEAST:
                return closed_by(mover, kept=kept)
    return None


def least_gaps(given: Description, size: float) -> dict[str, float]:
    """Return loops that do not close by themselves, all others cut and no actuator held.

    Returns:
        The largest equation at the smallest sum of squares that was found, by the loop's name, in parts of the size.
    """
    parts = [replace(given, closures=(each,), couplings=()) for each in given.closures]
    found = {each.closures[0].name: _least_of(each, size) for each in parts}
    return {name: value for name, value in found.items() if value > LEAST}


def _least_of(given: Description, size: float) -> float:
    """Return the largest equation of the start that comes closest."""
    least = float("inf")
    for mover in _movers(given, size, kept=False):
        least = min(least, _least_squares(mover))
        if least <= LEAST:
            break
    return least


def _movers(given: Description, size: float, *, kept: bool) -> Iterator[Mover]:
    """Yield joints where the model stands, and at random positions, some near and some far."""
    rng = np.random.default_rng(_SEED)
    for k in range(1 + _STARTS):
        mover = Mover(given, size, keeps_driven=kept)
        if k:
            mover.step(rng.uniform(-1, 1, mover.count) * _FAR[k % len(_FAR)] * _scales(mover))
        yield mover


def _scales(mover: Mover) -> FloatArray:
    """Return the unit (n,) of each coordinate: the size for a slide and for the position of a free body, else 1."""
    scales = np.ones(mover.count)
    for body, place in mover.index.items():
        joint = mover.joint_of.get(body)
        if joint is None:
            scales[place][3:] = mover.size
        elif joint.kind == "P":
            scales[place] = mover.size
    return scales


def _least_squares(mover: Mover) -> float:
    """Move the joints to a smallest sum of squares by the Levenberg-Marquardt method; return the largest equation."""
    scales, damping = _scales(mover), 1.0
    values, derivatives = mover.state()
    for _ in range(_MOST_DAMPED):
        J, size = derivatives * scales, float(np.linalg.norm(values))
        if not size or float(np.linalg.norm(J.T @ values)) <= _STATIONARY * size or damping > _MOST_DAMPING:
            break
        way = -np.linalg.solve(J.T @ J + damping * np.eye(mover.count), J.T @ values)
        way *= min(1.0, _MOST_WAY / float(np.linalg.norm(way)))
        before = dict(mover.own), dict(mover.coordinates)
        mover.step(scales * way)
        values, derivatives = mover.state()
        if float(np.linalg.norm(values)) < size:
            damping = max(damping * _SMALLER, _LEAST_DAMPING)
        else:
            mover.own, mover.coordinates = before
            values, derivatives = mover.state()
            damping *= _LARGER
    return float(np.abs(values).max(initial=0.0))

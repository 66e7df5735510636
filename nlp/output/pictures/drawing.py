"""Geometry of a robot with its task in true proportion, independent of the drawing library."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....models import (
    Body,
    FloatArray,
    Link,
    LinkKind,
    Model,
    WrenchKind,
    axis_from_screw,
    frozen_array,
    reciprocal_product,
)
from ...case.case import Case
from ...errors import EvaluationError
from ...evidence.kkt import close_equations
from ...evidence.state import RobotState
from ...program.nlp import Nlp
from .loads import DrawnForces, drawn_forces
from .posture import Linkage, Posture, state_at_pose

#: Helix around the axis: largest number of turns, largest fraction of the axis, radius as a fraction of the robot's
#: size.
_TURNS = 3.0
_ALONG = 0.4
_RADIUS = 0.11
#: Pitch, relative to the radius of the helix, below which it is drawn as a circle with a gap for the sense of rotation.
_NO_PITCH = 0.01
_OPEN_CIRCLE = math.radians(320)
_STEP = math.radians(6)
#: Length of the axis beyond the robot at each end, as a fraction of the robot's size.
_BEYOND = 0.22
#: Distance of a point, as a fraction of the robot's size, above which the starting posture differs from the shown one.
_OTHER_POSTURE = 1e-3
#: Distance, as a fraction of the robot's size, below which two points are one corner.
_SAME_CORNER = 1e-6


@dataclass(frozen=True, eq=False)
class LimbRate:
    """Row of the Jacobian in a drawing.

    Attributes:
        limb: name of the limb that applies the wrench.
        kind: force or couple.
        member: name of the member that applies the wrench.
        rate: work rate ``L_i ^ chi``.
        share: share of F, ``rate^2 / F``; nan if F is 0.
        driving: work rate of the wrench for a unit rate of an actuated joint of the limb; 0 for a constraint.
    """

    limb: str
    kind: WrenchKind
    member: str
    rate: float
    share: float
    driving: float = 0.0


@dataclass(frozen=True, eq=False)
class Motion:
    """Twist in a drawing, in world coordinates.

    Attributes:
        name: short description.
        twist: (6,) angular velocity, then velocity at the world origin.
        axis: (3,) unit vector of the axis.
        pitch: pitch, length; infinite for a translation.
        line: (2, 3) ends of the axis, in its direction, length.
        path: (k, 3) path of a point around the axis: a helix of the true pitch, or a circle for zero pitch; empty for a
            translation.
    """

    name: str
    twist: FloatArray
    axis: FloatArray
    pitch: float
    line: FloatArray
    path: FloatArray

    @property
    def has_path(self) -> bool:
        """True if a path is drawn; a helix of large pitch is almost straight."""
        return len(self.path) > 2


@dataclass(frozen=True, eq=False)
class Drawing:
    """Robot at one posture with its task, if any; world coordinates, lengths in the case's unit.

    Attributes:
        case: case with names and units; None for a robot without a case.
        model: model of the robot.
        linkage: robot with its dimensions, for other postures.
        posture: shown posture.
        links: straight lines, as indices of two points.
        plates: outlines of base and platform, as indices of points.
        corners: indices of the platform's points with velocity arrows, without duplicates.
        rows: rows of the Jacobian with work rates; empty without a motion.
        motion: motion of the task.
        free: motions that are free with all actuators locked.
        reference: posture at the starting point; None if it is the shown posture.
        forces: arrows of the first load, and of the actuator forces that balance it; None without loads.
        size: half of the diagonal of the robot's bounding box, length.
        headline: result in one line.
        is_answer: True if the point is an optimum of the case.
    """

    case: Case | None
    model: Model
    linkage: Linkage
    posture: Posture
    links: tuple[tuple[int, int, Link], ...]
    plates: tuple[tuple[Body, tuple[int, ...]], ...]
    corners: tuple[int, ...]
    rows: tuple[LimbRate, ...] = ()
    motion: Motion | None = None
    free: tuple[Motion, ...] = ()
    reference: Posture | None = None
    forces: DrawnForces | None = None
    size: float = 1.0
    headline: str = ""
    is_answer: bool = True

    def velocities_at(self, posture: Posture) -> FloatArray:
        """Return the velocity (k, 3) of each corner at a posture, ``v + omega x r``; empty without a motion."""
        if self.motion is None:
            return np.zeros((0, 3))
        omega, v = self.motion.twist[:3], self.motion.twist[3:]
        return np.asarray(v + np.cross(omega, posture.points[list(self.corners)]))

    def rates_at(self, posture: Posture) -> FloatArray:
        """Return the work rates (m,) of the task at a posture; empty without a motion."""
        return reciprocal_product(posture.jacobian, self.motion.twist) if self.motion is not None else np.zeros(0)

    def limb_rows(self) -> dict[str, int]:
        """Return the index of the row that colours each limb; empty without a motion.

        It is the row with the largest work rate in an actuator of the limb; without such a row, the row of its force or
        of its couple.
        """
        order = sorted(enumerate(self.rows), key=lambda each: (each[1].driving, each[1].kind is WrenchKind.FORCE))
        return {row.limb: k for k, row in order}

    def limb_rates(self) -> dict[str, float]:
        """Return the rate that colours each limb, from the rows of :meth:`limb_rows`."""
        return {limb: self.rows[k].rate for limb, k in self.limb_rows().items()}

    def link_row(self, link: Link) -> int | None:
        """Return the index of the only row of a link; None for a link with several rows."""
        own = [k for k, row in enumerate(self.rows) if row.limb == link.limb]
        return None if link.row is None or link.row >= len(own) else own[link.row]

    def link_rows(self, limb: str) -> list[LimbRate]:
        """Return the rows of the links of a limb that have only one row, such as rods, in order."""
        found = (self.link_row(link) for _, _, link in self.links if link.limb == limb)
        return [self.rows[k] for k in sorted({k for k in found if k is not None})]

    def attachment(self, limb: str) -> int | None:
        """Return the index of the point that joins a limb to the platform; None if no line of the limb ends there."""
        for start, end, link in self.links:
            if link.limb == limb:
                for index in (end, start):
                    if self.model.scene.points[index].body is Body.PLATFORM:
                        return index
        return None


def drawing_of_model(model: Model) -> Drawing:
    """Return a robot at its typical dimensions and home position, without a task.

    Raises:
        EvaluationError: the robot's expressions have no finite value at these dimensions.
    """
    parameters = model.typical
    middles = np.array([(item.lower + item.upper) / 2 for item in model.unknowns])
    linkage = Linkage(model, parameters)
    headline = ", ".join(f"{key} = {value}" for key, value in model.options.items() if not isinstance(value, Mapping))
    guess = linkage.posture_at(np.eye(3), np.array(model.home), middles)
    # A motion of zero length closes the loops.
    home = linkage.posture_after(guess, np.array([0, 0, 0, 0, 0, 1.0]), 0.0)
    if home is None or not np.isfinite(home.points).all():
        raise EvaluationError(f"{model.name}: the robot cannot be assembled at its typical dimensions")
    return replace(drawing_without_task(None, model, linkage, home), headline=headline)


def drawing_of(
    nlp: Nlp,
    x: FloatArray,
    state: RobotState | None,
    task: int = 0,
    *,
    pose: int = 0,
    headline: str = "",
    is_answer: bool = True,
) -> Drawing:
    """Return the robot at a point of a nonlinear program, with one task of its case.

    Args:
        nlp: nonlinear program of a case.
        x: (n,) point.
        state: state of the robot at the point; None if the robot does not exist there.
        task: index of the task in the case.
        pose: index of the pose of the state.
        headline: result in one line.
        is_answer: True if the point is an optimum of the case.

    Raises:
        EvaluationError: the robot does not exist at the point.
    """
    case, model = nlp.case, nlp.program.model
    if state is None:
        raise EvaluationError(
            f"{case.source or case.name}: no picture: "
            "the search ended at a point at which the robot cannot be assembled"
        )
    linkage, posture = _posture(nlp, x, state, pose)
    chosen = case.tasks[task]
    twist = frozen_array(chosen.twist, (6,))
    rates = reciprocal_product(posture.jacobian, twist)
    total = 0.0 if state.is_zero else float(rates @ rates)
    shares = rates**2 / total if total else np.full(len(rates), math.nan)
    drawing = drawing_without_task(case, model, linkage, posture)
    return replace(
        drawing,
        rows=tuple(
            LimbRate(row.limb, row.kind, row.member, float(rate), float(share), float(driving))
            for row, rate, share, driving in zip(model.rows, rates, shares, posture.driving, strict=True)
            if chosen.is_stated
        ),
        motion=_motion_of_twist(twist, drawing, chosen.name) if chosen.is_stated else None,
        free=tuple(_motion_of_twist(each, drawing, "free motion") for each in state.free_twists),
        reference=_reference(nlp, posture, drawing.size, pose),
        forces=drawn_forces(nlp, x, state, posture, pose, drawing.size),
        headline=headline,
        is_answer=is_answer,
    )


def _motion_of_twist(twist: FloatArray, drawing: Drawing, name: str) -> Motion:
    """Return a twist (6,) as lines: an axis as long as the robot, and a helix of the twist's pitch."""
    screw = axis_from_screw(twist)
    s, size = screw.axis, drawing.size
    if math.isinf(screw.pitch):
        # A translation has a direction but no axis: the arrow begins at the platform.
        ends = drawing.posture.position + np.outer([0.0, 0.8 * size], s)
        return Motion(name, frozen_array(twist, (6,)), s, math.inf, frozen_array(ends, (2, 3)), np.zeros((0, 3)))
    reach = (drawing.posture.points - screw.point) @ s
    first, last = float(reach.min()) - _BEYOND * size, float(reach.max()) + _BEYOND * size
    radius = _RADIUS * size
    turning = _OPEN_CIRCLE
    if abs(screw.pitch) > _NO_PITCH * radius:
        turning = min(2 * math.pi * _TURNS, _ALONG * (last - first) / abs(screw.pitch))
    angles = np.arange(0.0, turning + _STEP / 2, _STEP)
    travel = screw.pitch * angles
    middle = last - 0.12 * size - abs(travel[-1]) / 2
    across = np.cross(s, np.eye(3)[int(np.argmin(np.abs(s)))])
    across /= np.linalg.norm(across)
    around = np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(s, across))
    path = screw.point + radius * around + np.outer(middle + travel - travel[-1] / 2, s)
    ends = screw.point + np.outer([first, last], s)
    return Motion(
        name, frozen_array(twist, (6,)), s, screw.pitch, frozen_array(ends, (2, 3)), frozen_array(path, path.shape)
    )


def _posture(nlp: Nlp, x: FloatArray, state: RobotState, pose: int) -> tuple[Linkage, Posture]:
    """Return the linkage and the posture of the robot at a point (n,) of a nonlinear program, at one of its poses."""
    model = nlp.program.model
    parameters = np.array([value for item in model.parameters for value in state.parameters[item.name]])
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    linkage = Linkage(model, parameters, nlp.case.characteristic_length)
    return linkage, linkage.posture_at(state.rotation, state.position, unknowns)


def _reference(nlp: Nlp, posture: Posture, size: float, pose: int) -> Posture | None:
    """Return the posture at the starting point; None for the shown posture, or if the robot does not exist."""
    if nlp.is_fixed:
        return None
    x = close_equations(nlp, nlp.start)
    state = state_at_pose(nlp, x, pose)
    if state is None:
        return None
    start = _posture(nlp, x, state, pose)[1]
    is_other = np.max(np.abs(start.points - posture.points), initial=0.0) > _OTHER_POSTURE * size
    return start if is_other and np.isfinite(start.points).all() else None


def drawing_without_task(case: Case | None, model: Model, linkage: Linkage, posture: Posture) -> Drawing:
    """Return a robot's lines, outlines, corners and size at a posture."""
    names = [point.name for point in model.scene.points]
    links = tuple((names.index(link.start), names.index(link.end), link) for link in model.scene.links)
    plates = tuple((body, loop) for body in (Body.BASE, Body.PLATFORM) if (loop := _loop(links, body)))
    shown = np.vstack([posture.points, posture.position, np.zeros((1, 3))])
    size = float(np.linalg.norm(np.ptp(shown, axis=0))) / 2 or 1.0
    outline = next((loop for body, loop in plates if body is Body.PLATFORM), ())
    candidates = outline or tuple(i for i, point in enumerate(model.scene.points) if point.body is Body.PLATFORM)
    corners: list[int] = []
    for index in candidates:
        away = [np.linalg.norm(posture.points[index] - posture.points[other]) for other in corners]
        if min(away, default=math.inf) > _SAME_CORNER * size:
            corners.append(index)
    return Drawing(case, model, linkage, posture, links, plates, tuple(corners), size=size)


def _loop(links: Sequence[tuple[int, int, Link]], body: Body) -> tuple[int, ...]:
    """Return indices of the points around a body's outline; none if the body's lines are not one closed loop."""
    following = {start: end for start, end, link in links if link.body is body and link.kind is LinkKind.BAR}
    if len(following) < 3:
        return ()
    first = next(iter(following))
    loop = [first]
    while (index := following.get(loop[-1])) not in (None, first) and len(loop) < len(following):
        loop.append(int(index or 0))
    return tuple(loop) if following.get(loop[-1]) == first and len(loop) == len(following) else ()

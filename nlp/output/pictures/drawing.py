"""A robot with its task as numbers in true proportion, for any robot and any way to paint it."""

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

#: The path around the axis: turns at most, part of the axis at most, and radius in parts of the robot's size.
_TURNS = 3.0
_ALONG = 0.4
_RADIUS = 0.11
#: A pitch below this part of the path's radius shows as a circle; its gap shows the sense of the rotation.
_NO_PITCH = 0.01
_OPEN_CIRCLE = math.radians(320)
_STEP = math.radians(6)
#: Length of the axis beyond the robot at each end, in parts of the robot's size.
_BEYOND = 0.22
#: Distance of a point, in parts of the robot's size, beyond which the start is another posture than the one shown.
_OTHER_POSTURE = 1e-3
#: Points nearer to each other than this part of the robot's size are one corner.
_SAME_CORNER = 1e-6


@dataclass(frozen=True, eq=False)
class LimbRate:
    """A row of the Jacobian as a picture shows it.

    Attributes:
        limb: name of the limb that applies the wrench.
        kind: a force, or a couple.
        member: name of the limb's member that applies it.
        rate: work rate ``L_i ^ chi``.
        share: part of F, ``rate^2 / F``; nan where F is 0.
        driving: its work rate in an actuated joint of the limb at unit rate; 0 for a constraint.
    """

    limb: str
    kind: WrenchKind
    member: str
    rate: float
    share: float
    driving: float = 0.0


@dataclass(frozen=True, eq=False)
class Motion:
    """A twist as a picture shows it, in world coordinates.

    Attributes:
        name: a few words.
        twist: (6,) angular velocity, then velocity at the world origin.
        axis: (3,) unit direction.
        pitch: length; infinite for a translation.
        line: (2, 3) ends of the axis, in its direction, length.
        path: (k, 3) path of a point beside the axis: a helix of the true pitch, or a circle without one; empty for a
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
        """Whether a path is drawn: that of a large pitch is as good as straight."""
        return len(self.path) > 2


@dataclass(frozen=True, eq=False)
class Drawing:
    """A robot at one posture, with its task where it has one; world coordinates, lengths in the case's unit.

    Attributes:
        case: the source of names and units; None for a robot without a case.
        model: the robot.
        linkage: gives other postures of the same robot.
        posture: the posture shown.
        links: straight lines, as indices of two points.
        plates: outlines of base and platform, as indices of points.
        corners: indices of the platform's points that show its velocity, each place once.
        rows: work rates; empty without a motion.
        motion: the task.
        free: motions that no limb resists.
        reference: posture at the start; None where it is the one shown.
        forces: arrows of the first load, and of the forces that hold it; None without loads.
        size: half of the diagonal of the robot's bounding box, length.
        headline: the result in one line.
        is_answer: whether the solve answers the case, rather than ending at some point.
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

        It is the row that drives the limb's actuator most; without such a row, that of its force, or of its couple
        where it applies no force.
        """
        order = sorted(enumerate(self.rows), key=lambda each: (each[1].driving, each[1].kind is WrenchKind.FORCE))
        return {row.limb: k for k, row in order}

    def limb_rates(self) -> dict[str, float]:
        """Return the rate that colours each limb, of the row that :meth:`limb_rows` names."""
        return {limb: self.rows[k].rate for limb, k in self.limb_rows().items()}

    def link_row(self, link: Link) -> int | None:
        """Return the index of the row that a link carries alone; None for a link that carries others too."""
        own = [k for k, row in enumerate(self.rows) if row.limb == link.limb]
        return None if link.row is None or link.row >= len(own) else own[link.row]

    def own_rows(self, limb: str) -> list[LimbRate]:
        """Return the rows that links of a limb carry alone, such as rods, in order."""
        found = (self.link_row(link) for _, _, link in self.links if link.limb == limb)
        return [self.rows[k] for k in sorted({k for k in found if k is not None})]

    def attachment(self, limb: str) -> int | None:
        """Return the index of the point that joins a limb to the platform; None where no line of the limb has one."""
        for start, end, link in self.links:
            if link.limb == limb:
                for index in (end, start):
                    if self.model.scene.points[index].body is Body.PLATFORM:
                        return index
        return None


def drawing_of_model(model: Model) -> Drawing:
    """Return a robot at its parameters' typical values and its platform's home position, without a task.

    Raises:
        EvaluationError: the robot's expressions have no finite value there.
    """
    parameters = model.typical
    middles = np.array([(item.lower + item.upper) / 2 for item in model.unknowns])
    linkage = Linkage(model, parameters)
    headline = ", ".join(f"{key} = {value}" for key, value in model.options.items() if not isinstance(value, Mapping))
    guess = linkage.posture_at(np.eye(3), np.array(model.home), middles)
    # A motion of zero length closes the loops.
    home = linkage.posture_after(guess, np.array([0, 0, 0, 0, 0, 1.0]), 0.0)
    if home is None or not np.isfinite(home.points).all():
        raise EvaluationError(f"{model.name}: the robot cannot be assembled at its typical values")
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
    """Return the robot at a point of a program, with one of its case's tasks.

    Args:
        nlp: the program of a case.
        x: (n,) the point.
        state: the robot there; None where it does not exist.
        task: index of the task in the case.
        pose: index of the pose that the state is at.
        headline: the result in one line.
        is_answer: whether the solve answers the case.

    Raises:
        EvaluationError: the robot does not exist at the point.
    """
    case, model = nlp.case, nlp.program.model
    if state is None:
        raise EvaluationError(f"{case.source or case.name}: the robot does not exist at the point reached: no picture")
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
    """Return a twist (6,) as lines beside a robot: an axis as long as the robot, and a path of the twist's pitch."""
    screw = axis_from_screw(twist)
    s, size = screw.axis, drawing.size
    if math.isinf(screw.pitch):
        # A translation has a direction but no line: the platform is a place to show it.
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
    """Return the linkage and the posture of a program's robot at a point (n,), at one of its poses."""
    model = nlp.program.model
    parameters = np.array([value for item in model.parameters for value in state.parameters[item.name]])
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    linkage = Linkage(model, parameters, nlp.case.characteristic_length)
    return linkage, linkage.posture_at(state.rotation, state.position, unknowns)


def _reference(nlp: Nlp, posture: Posture, size: float, pose: int) -> Posture | None:
    """Return the posture at the start; None where it is the one shown, or where the robot does not exist there."""
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
    """Return indices of the points around a body's outline; none where the body's lines are not one closed loop."""
    following = {start: end for start, end, link in links if link.body is body and link.kind is LinkKind.BAR}
    if len(following) < 3:
        return ()
    first = next(iter(following))
    loop = [first]
    while (index := following.get(loop[-1])) not in (None, first) and len(loop) < len(following):
        loop.append(int(index or 0))
    return tuple(loop) if following.get(loop[-1]) == first and len(loop) == len(following) else ()

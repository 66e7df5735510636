"""What a picture of a robot shows, in numbers and in true proportion, whatever the robot is and whoever paints it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....models import Body, FloatArray, Link, Model, WrenchKind, axis_from_screw, frozen_array
from ....models import reciprocal_product as product
from ...case.case import Case
from ...errors import EvaluationError
from ...evidence.kkt import close_equations
from ...evidence.state import RobotState
from ...program.nlp import Nlp
from ...solver.multistart import state_or_none
from .posture import Linkage, Posture

#: A path around the axis: at most so many turns, over at most this part of the axis, at this part of the robot's size.
_TURNS = 3.0
_ALONG = 0.4
_RADIUS = 0.11
#: A pitch below this part of the path's radius is drawn as none: a circle, not quite closed, shows the sense.
_NO_PITCH = 0.01
_OPEN_CIRCLE = math.radians(320)
_STEP = math.radians(6)
#: How far the axis goes beyond the robot, in parts of the robot's size.
_BEYOND = 0.22
#: A start is another one than the robot when a point of it moved by more than this part of the robot's size.
_MOVED = 1e-3
#: Points nearer to each other than this part of the robot's size are one corner.
_SAME_CORNER = 1e-6


@dataclass(frozen=True, eq=False)
class LimbRate:
    """A row of the Jacobian as the picture shows it: whose it is, its work rate, and its part of F (nan if F is 0)."""

    limb: str
    kind: WrenchKind
    rate: float
    share: float


@dataclass(frozen=True, eq=False)
class Motion:
    """A twist as a picture shows it.

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


@dataclass(frozen=True, eq=False)
class Drawing:
    """A robot to be drawn.

    Attributes:
        case: where names and units come from; None for a robot without a case.
        model: the robot.
        linkage: puts the platform elsewhere.
        posture: where everything is.
        links: straight lines, as indices of two points.
        plates: outlines of base and platform, as indices of points.
        corners: indices of the platform's points that show its velocity, each place once.
        rows: work rates; empty without a motion.
        motion: the task.
        free: motions that nothing resists.
        reference: the start, when it is another posture.
        size: half of the diagonal of the robot's bounding box, length.
        headline: what was found, one line.
        is_answer: whether this is what was asked for, and not merely what was reached.
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
    size: float = 1.0
    headline: str = ""
    is_answer: bool = True

    @property
    def velocities(self) -> FloatArray:
        """(k, 3) velocity of each corner, ``v + omega x r``; empty without a motion."""
        if self.motion is None:
            return np.zeros((0, 3))
        omega, v = self.motion.twist[:3], self.motion.twist[3:]
        return np.asarray(v + np.cross(omega, self.posture.points[list(self.corners)]))

    def limb_rates(self) -> dict[str, float]:
        """Rate by which each limb is coloured: that of its force, or of its couple where it has no force."""
        rates: dict[str, float] = {}
        for row in sorted(self.rows, key=lambda row: row.kind is WrenchKind.FORCE):
            rates[row.limb] = row.rate
        return rates

    def attachment(self, limb: str) -> FloatArray | None:
        """(3,) point where a limb meets the platform, or None where its lines do not show that."""
        for start, end, link in self.links:
            if link.limb == limb:
                for index in (end, start):
                    if self.model.scene.points[index].body is Body.PLATFORM:
                        return np.asarray(self.posture.points[index])
        return None

    def rates_at(self, posture: Posture) -> FloatArray:
        """(m,) work rates of the task with the platform elsewhere."""
        return product(posture.jacobian, self.motion.twist) if self.motion is not None else np.zeros(0)


def drawing_of_model(model: Model) -> Drawing:
    """A robot with its parameters at typical values and its platform at home, without a task.

    Raises:
        EvaluationError: its equations have no finite value there.
    """
    parameters = np.array([value for item in model.parameters for value in item.typical])
    middles = np.array([(item.lower + item.upper) / 2 for item in model.unknowns])
    linkage = Linkage(model, parameters)
    home = linkage.moved(linkage.at(np.eye(3), np.array(model.home), middles), np.array([0, 0, 0, 0, 0, 1.0]), 0.0)
    if home is None or not np.isfinite(home.points).all():
        raise EvaluationError(f"{model.name}: the robot cannot be put together at its typical values")
    return _drawing(None, model, linkage, home)


def drawing_of(
    nlp: Nlp, x: FloatArray, state: RobotState | None, task: int = 0, *, headline: str = "", is_answer: bool = True
) -> Drawing:
    """The robot at a point of a program, with one of its case's tasks.

    Args:
        nlp: the program of a case.
        x: (n,) the point.
        state: the robot there.
        task: index of the task in the case.
        headline: what was found, one line.
        is_answer: whether it is what was asked for.

    Raises:
        EvaluationError: the robot does not exist at the point.
    """
    case, model = nlp.case, nlp.program.model
    if state is None:
        raise EvaluationError(f"{case.source or case.name}: the robot does not exist at the point reached: no picture")
    linkage, posture = _posture(nlp, x, state)
    chosen = case.tasks[task]
    twist = frozen_array(chosen.twist, (6,))
    rates = product(posture.jacobian, twist)
    total = 0.0 if state.is_zero else float(rates @ rates)
    shares = rates**2 / total if total else np.full(len(rates), math.nan)
    drawn = _drawing(case, model, linkage, posture)
    return Drawing(
        case=case,
        model=model,
        linkage=linkage,
        posture=posture,
        links=drawn.links,
        plates=drawn.plates,
        corners=drawn.corners,
        rows=tuple(
            LimbRate(row.limb, row.kind, float(rate), float(share))
            for row, rate, share in zip(model.wrenches, rates, shares, strict=True)
        ),
        motion=motion_of_twist(twist, drawn, chosen.name),
        free=tuple(motion_of_twist(each, drawn, "free motion") for each in state.free_twists),
        reference=_reference(nlp, posture, drawn.size),
        size=drawn.size,
        headline=headline,
        is_answer=is_answer,
    )


def motion_of_twist(twist: FloatArray, drawing: Drawing, name: str) -> Motion:
    """A twist laid out beside a robot: its axis as long as the robot, and a path of its pitch."""
    screw = axis_from_screw(twist)
    s, size = screw.axis, drawing.size
    if math.isinf(screw.pitch):
        # A translation has no place of its own: it is drawn at the platform.
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


def _posture(nlp: Nlp, x: FloatArray, state: RobotState) -> tuple[Linkage, Posture]:
    model = nlp.program.model
    parameters = np.array([value for item in model.parameters for value in state.parameters[item.name]])
    unknowns = x[list(nlp.program.places.unknowns[0])]
    linkage = Linkage(model, parameters, nlp.case.characteristic_length)
    return linkage, linkage.at(state.rotation, state.position, unknowns)


def _reference(nlp: Nlp, posture: Posture, size: float) -> Posture | None:
    """The start, where it is another posture than the one drawn."""
    if nlp.n == 0:
        return None
    x = close_equations(nlp, nlp.start)
    state = state_or_none(nlp, x)
    if state is None:
        return None
    start = _posture(nlp, x, state)[1]
    moved = np.max(np.abs(start.points - posture.points), initial=0.0) > _MOVED * size
    return start if moved and np.isfinite(start.points).all() else None


def _drawing(case: Case | None, model: Model, linkage: Linkage, posture: Posture) -> Drawing:
    """What is drawn of a robot without a task."""
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
    """Indices of the points around a body's outline, or none where its lines do not close to one loop."""
    following = {start: end for start, end, link in links if link.body is body}
    if len(following) < 3:
        return ()
    first = next(iter(following))
    loop = [first]
    while (index := following.get(loop[-1])) not in (None, first) and len(loop) < len(following):
        loop.append(int(index or 0))
    return tuple(loop) if following.get(loop[-1]) == first and len(loop) == len(following) else ()

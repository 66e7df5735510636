"""Data of the 3-D view of a page: limbs, joints and rates of the robot at postures along the task's motion."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypedDict

import numpy as np

from ....models import Dimension, FloatArray, JointSymbol, WrenchKind
from ...evidence.state import ZERO_F
from ...results.rounding import settled
from ...units import Units, objective_unit, rate_unit
from ...words.robot import rate_word
from ..pictures.drawing import Drawing, Motion
from ..pictures.loads import DrawnForces
from ..pictures.posture import Posture
from ..pictures.style import BESIDE, FORCE_COLOURS, RATE_COLOURS, signed_text
from ..pictures.view import View, clearest_view
from .markup import with_signs


class LinkData(TypedDict):
    """Line between two points by index; ``row`` is the index of the row of the Jacobian that gives the colour."""

    ends: list[int]
    limb: str | None
    body: str
    kind: str
    row: int | None


class JointData(TypedDict):
    """Symbol of a joint: kind, actuation, and tooltip."""

    kind: str
    words: str
    actuated: bool


class MeasureData(TypedDict):
    """Quantity of a limb for the table of rates: name, and unit for each row."""

    words: str
    units: list[str]


class RowData(TypedDict):
    """Row of the Jacobian: limb, member, and index of the point that joins the limb to the platform."""

    limb: str
    member: str
    kind: str
    at: int | None


def link_data(drawing: Drawing) -> list[LinkData]:
    """Return the lines with the rows of the Jacobian that give their colours."""
    rows = drawing.limb_rows()
    found: list[LinkData] = []
    for start, end, link in drawing.links:
        own = drawing.link_row(link)
        row = rows.get(link.limb or "") if own is None else own
        kind = link.kind.value
        found.append({"ends": [start, end], "limb": link.limb, "body": link.body.value, "kind": kind, "row": row})
    return found


def row_data(drawing: Drawing) -> list[RowData]:
    """Return the rows; one of several couples of a limb has no point, because only the plane of the couples matters."""
    couples = [row.limb for row in drawing.rows if row.kind is WrenchKind.COUPLE]
    return [
        {
            "limb": row.limb,
            "member": row.member,
            "kind": row.kind.value,
            "at": None if couples.count(row.limb) > 1 else drawing.attachment(row.limb),
        }
        for row in drawing.rows
    ]


def joint_data(drawing: Drawing) -> list[JointData]:
    """Return the joints of the drawing."""
    joints = drawing.model.scene.joints
    return [{"kind": each.kind.value, "words": _joint_words(each), "actuated": each.is_actuated} for each in joints]


def _joint_words(joint: JointSymbol) -> str:
    """Return name, kind and actuation of a joint as text."""
    return f"joint {joint.name}: {joint.kind.words}{', actuated' if joint.is_actuated else ''}"


def measure_data(drawing: Drawing, units: Units) -> MeasureData:
    """Return the quantity of limbs: leg length, or actuator coordinate for a robot defined by joints."""
    rows = drawing.model.rows
    if not drawing.model.scene.joints:
        return {"words": "length", "units": [units.length] * len(rows)}
    kinds = {each.limb: each.dimension for each in reversed(drawing.model.actuators)}
    found = [kinds.get(row.limb) for row in rows]
    return {"words": "actuator", "units": ["" if each is None else units.label(each) for each in found]}


def measured_values(drawing: Drawing, posture: Posture, units: Units) -> list[float | None]:
    """Return the quantity of the limb of each row.

    It is the leg length of the model, or else the length of the limb's lines. For a robot defined by joints it is the
    coordinate of the limb's first actuator, None without an actuator.
    """
    lengths: dict[str, float] = {}
    if drawing.model.scene.joints:
        for item, values in zip(drawing.model.quantities, posture.quantities, strict=True):
            shown = [units.shown(float(value), item.dimension) for value in values]
            lengths |= dict(zip(item.owners, shown, strict=True))
        first = {each.limb: each.name for each in reversed(drawing.model.actuators)}
        return [lengths.get(first.get(row.limb, "")) for row in drawing.model.rows]
    for start, end, link in drawing.links:
        if link.limb is not None:
            part = float(np.linalg.norm(posture.points[end] - posture.points[start]))
            lengths[link.limb] = lengths.get(link.limb, 0.0) + part
    for item, values in zip(drawing.model.quantities, posture.quantities, strict=True):
        if item.name == "leg_length":
            lengths |= dict(zip(item.owners, map(float, values), strict=True))
    return [lengths.get(row.limb, 0.0) for row in drawing.model.rows]


#: Largest and smallest number of postures on each side of the design's pose, and largest total of a page.
_SIDE, _LEAST_SIDE, _SIDES = 20, 2, 80
#: Largest rotation, and largest displacement of a platform corner as a fraction of the robot's size.
_TURN = math.radians(20)
_WAY = 0.3
#: Significant digits of numbers at other postures than the design's: the page shows seven, and computes with them.
_DIGITS = 11
#: Rounding error of a rate relative to its summands.
_ROUNDING = 1e-9
#: First and largest elevation of the camera, degrees: seen from exactly above, "up" would be undefined.
_ELEVATION, _HIGHEST = 26.0, 89.0
#: Least visible fraction of the width of a motion's path in parallel projection; perspective can reduce it.
_WIDTH = 0.43


class PointData(TypedDict):
    """Named point of the robot, and the body to which it belongs."""

    name: str
    body: str


class MotionData(TypedDict):
    """Twist with its lines; see :class:`~screwsynth.nlp.output.pictures.drawing.Motion`."""

    words: str
    twist: list[float]
    translation: bool
    line: list[list[float]]
    path: list[list[float]]


class ForceData(TypedDict):
    """Arrow of a force or of a moment; see :class:`~screwsynth.nlp.output.pictures.loads.ForceArrow`."""

    kind: str
    name: str
    words: str
    colour: str
    ends: list[list[float]]


class FrameData(TypedDict):
    """Robot at one posture.

    ``t`` is the time along the motion, ``lengths`` has the quantity of the limb for each row, ``joints`` has position
    and axes of each joint, and a rate below ``noise`` is rounding error.
    """

    t: float
    words: str
    points: list[list[float]]
    position: list[float]
    rotation: list[list[float]]
    directions: list[list[list[float]]]
    joints: list[list[list[float]]]
    jacobian: list[list[float]]
    rates: list[float]
    F: float
    noise: float
    lengths: list[float | None]
    velocities: list[list[float]]


class ViewData(TypedDict):
    """Content of the 3-D view, in the case's units.

    ``frames`` is in order of ``t``; the frame at index ``zero`` is the posture of the design. ``task`` and ``pose`` are
    indices, and ``is_worst`` is true at the pose with the worst F of several poses.
    """

    name: str
    task: int
    pose: int
    pose_words: str
    is_worst: bool
    headline: str
    is_answer: bool
    measure: MeasureData
    rate_word: str
    rate_unit: str
    objective_unit: str
    unit: str
    size: float
    points: list[PointData]
    links: list[LinkData]
    joints: list[JointData]
    plates: dict[str, list[int]]
    corners: list[int]
    rows: list[RowData]
    directions: list[str]
    motion: MotionData | None
    free: list[MotionData]
    forces: list[ForceData]
    forces_words: str
    reference: list[list[float]] | None
    colours: list[str]
    eye: list[float]
    zero: int
    frames: list[FrameData]


class _TimedPosture(NamedTuple):
    """Posture after a time along the motion."""

    t: float
    posture: Posture


class PostureSequence(NamedTuple):
    """Postures in order of time, and the index of the posture at ``t = 0``."""

    postures: list[_TimedPosture]
    zero: int


class PoseView(NamedTuple):
    """Pose and task of a view.

    Attributes:
        task: index of the task.
        pose: index of the pose.
        poses: number of poses of the case.
        is_worst: True at the pose with the worst F.
        views: number of views of the page, which share its size.
        size: sum of the magnitudes of the terms of F; an F within the rounding error of ``size`` is shown as 0.
        words: value and unit of the optimised actuator quantity at the pose; empty if F is optimised.
    """

    task: int = 0
    pose: int = 0
    poses: int = 1
    is_worst: bool = False
    views: int = 1
    size: float = 0.0
    words: str = ""


def view_data(drawing: Drawing, rates: FloatArray, shown: PoseView = PoseView()) -> ViewData:  # noqa: B008 - immutable
    """Return the data of the 3-D view.

    Args:
        drawing: robot and its motion.
        rates: (m,) work rates of the result at the posture, so that page and result agree to the last bit.
        shown: pose and task of the view.
    """
    model, motion = drawing.model, drawing.motion
    units = drawing.case.units if drawing.case is not None else Units()
    F = settled(float(rates @ rates), shown.size, ZERO_F)
    unit_of_F = "" if motion is None else objective_unit([motion.twist], units)
    postures, zero = postures_along_motion(drawing, min(_SIDE, max(_LEAST_SIDE, _SIDES // shown.views)))
    return {
        "name": "" if motion is None else motion.name,
        "task": shown.task,
        "pose": shown.pose,
        "pose_words": with_signs(
            f"pose {shown.pose + 1} of {shown.poses}, F = {shown.words or f'{F:.7g} {unit_of_F}'}".rstrip()
        ),
        "is_worst": shown.is_worst,
        "headline": drawing.headline,
        "is_answer": drawing.is_answer,
        "measure": measure_data(drawing, units),
        "unit": units.length,
        "rate_word": rate_word(drawing.model),
        "rate_unit": "" if motion is None else rate_unit(motion.twist, units),
        "objective_unit": unit_of_F,
        "size": drawing.size,
        "points": [{"name": point.name, "body": point.body.value} for point in model.scene.points],
        "links": link_data(drawing),
        "joints": joint_data(drawing),
        "plates": {body.value: list(loop) for body, loop in drawing.plates},
        "corners": list(drawing.corners),
        "rows": row_data(drawing),
        "directions": [item.name for item in model.scene.directions],
        "motion": None if motion is None else _motion_data(motion, units),
        "free": [_motion_data(each, units) for each in drawing.free],
        "forces": _force_data(drawing, drawing.forces),
        "forces_words": with_signs(_forces_words(drawing.forces)),
        "reference": None if drawing.reference is None else drawing.reference.points.tolist(),
        "colours": list(RATE_COLOURS),
        "eye": first_eye(drawing),
        "zero": zero,
        "frames": [
            _frame_data(drawing, t, posture, rates, units)
            if k == zero
            else _rounded(_frame_data(drawing, t, posture, drawing.rates_at(posture), units))
            for k, (t, posture) in enumerate(postures)
        ],
    }


def first_eye(drawing: Drawing) -> list[float]:
    """Return the direction (3,) to the camera of the first view of a page."""
    view = clearest_view(drawing, elevation=_ELEVATION, width=_WIDTH)
    return [float(each) for each in View(view.azimuth, min(view.elevation, _HIGHEST)).axes[2]]


def _force_data(drawing: Drawing, forces: DrawnForces | None) -> list[ForceData]:
    """Return the arrows of forces; arrows of legs and slides are moved outwards from the robot's centre."""
    found: list[ForceData] = []
    for arrow in () if forces is None else forces.arrows:
        ends = arrow.ends
        if arrow.is_beside:
            way = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            out = ends[0] - np.mean(drawing.posture.points, axis=0)
            out -= (out @ way) * way
            ends = ends + BESIDE * drawing.size * out / (float(np.linalg.norm(out)) or 1.0)
        colour = FORCE_COLOURS[arrow.kind]
        found.append(
            {
                "kind": arrow.kind,
                "name": arrow.name,
                "words": with_signs(arrow.words),
                "colour": colour,
                "ends": ends.tolist(),
            }
        )
    return found


def _forces_words(forces: DrawnForces | None) -> str:
    """Return the legend of the arrows of forces; empty without a load."""
    if forces is None:
        return ""
    kinds = {arrow.kind for arrow in forces.arrows}
    words = [f"Arrows at the pose of the design: {forces.words} (teal)"]
    words += ["legs in compression (magenta)"] if "push" in kinds else []
    words += ["legs in tension (green, from a dot)"] if "pull" in kinds else []
    words += ["forces of actuators on their slides (magenta)"] if "drive" in kinds else []
    words += [f"without arrows: {forces.torques}"] if forces.torques else []
    return "; ".join(words) + "."


def postures_along_motion(drawing: Drawing, count: int) -> PostureSequence:
    """Return postures along the motion of a drawing, at most ``count`` before and after the drawing's posture.

    The postures end where the robot cannot be assembled; without a motion, there is only the drawing's posture.
    """
    if drawing.motion is None:
        return PostureSequence([_TimedPosture(0.0, drawing.posture)], 0)
    step = _largest_time(drawing) / count
    sides: list[list[_TimedPosture]] = []
    for sign in (-1, 1):
        side: list[_TimedPosture] = []
        last: Posture | None = drawing.posture
        for k in range(1, count + 1):
            # The nearest posture is the best start for closing loops; without loops, no errors add up from the first.
            closes = bool(drawing.model.unknowns)
            start, t = (last, sign * step) if closes else (drawing.posture, sign * step * k)
            last = None if start is None else drawing.linkage.posture_after(start, drawing.motion.twist, t)
            if last is None:
                break
            side.append(_TimedPosture(sign * step * k, last))
        sides.append(side)
    back, forth = sides
    return PostureSequence([*reversed(back), _TimedPosture(0.0, drawing.posture), *forth], len(back))


def _largest_time(drawing: Drawing) -> float:
    """Return the largest ``t``, at which the rotation or the displacement of a corner reaches its limit."""
    twist = np.zeros(6) if drawing.motion is None else drawing.motion.twist
    turn = float(np.linalg.norm(twist[:3]))
    velocities = drawing.velocities_at(drawing.posture)
    way = float(np.max(np.linalg.norm(velocities, axis=1), initial=float(np.linalg.norm(twist[3:]) * (not turn))))
    limits = [_TURN / turn] if turn else []
    limits += [_WAY * drawing.size / way] if way else []
    return min(limits, default=1.0)


def _frame_data(drawing: Drawing, t: float, posture: Posture, rates: FloatArray, units: Units) -> FrameData:
    """Return the data of one posture with its rates (m,)."""
    return {
        "t": t,
        "words": _words(drawing, t, units),
        "points": posture.points.tolist(),
        "position": posture.position.tolist(),
        "rotation": posture.rotation.tolist(),
        "directions": posture.directions.tolist(),
        "joints": [each.tolist() for each in posture.joints],
        "jacobian": posture.jacobian.tolist(),
        "rates": rates.tolist(),
        "F": float(rates @ rates),
        "noise": _noise(drawing, posture),
        "lengths": measured_values(drawing, posture, units),
        "velocities": drawing.velocities_at(posture).tolist(),
    }


def _rounded(frame: FrameData) -> FrameData:
    """Return a frame along the motion with the digits that the page shows; the frame of the result keeps all digits."""
    found: FrameData = _few_digits(frame)
    return found


def _few_digits(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """Return JSON values with rounded numbers."""
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}")
    if isinstance(value, list):
        return [_few_digits(each) for each in value]
    if isinstance(value, dict):
        return {key: _few_digits(each) for key, each in value.items()}
    return value


def _noise(drawing: Drawing, posture: Posture) -> float:
    """Return the magnitude below which a rate is rounding error of its summands."""
    if drawing.motion is None:
        return 0.0
    terms = np.abs(posture.jacobian) @ np.abs(np.concatenate([drawing.motion.twist[3:], drawing.motion.twist[:3]]))
    return _ROUNDING * float(np.max(terms, initial=0.0))


def _words(drawing: Drawing, t: float, units: Units) -> str:
    """Return the platform's displacement as text."""
    if drawing.motion is None or t == 0:
        return "at the pose of the design" if drawing.is_answer else "at the final pose of the search"
    omega, v = drawing.motion.twist[:3], drawing.motion.twist[3:]
    turn = float(np.linalg.norm(omega)) * t
    pitch = drawing.motion.pitch
    if math.isinf(pitch):
        return f"moved {signed_text(float(np.linalg.norm(v)) * t)} {units.length} along the axis"
    turned = f"turned {signed_text(units.shown(turn, Dimension.ANGLE))} {units.angle} about the axis"
    if abs(pitch * turn) < 1e-9 * drawing.size:
        return turned
    return f"{turned}, moved {signed_text(pitch * turn)} {units.length} along it"


def _motion_data(motion: Motion, units: Units) -> MotionData:
    """Return the data of a twist with its description."""
    if math.isinf(motion.pitch):
        words = f"{motion.name}: translation"
    elif abs(motion.pitch) < 1e-9:
        words = f"{motion.name}: rotation"
    else:
        words = f"{motion.name}: screw of pitch {motion.pitch:.5g} {units.length}"
    return {
        "words": words,
        "twist": motion.twist.tolist(),
        "translation": math.isinf(motion.pitch),
        "line": motion.line.tolist(),
        "path": motion.path.tolist(),
    }

"""A drawing as data for a page that turns it: the robot at postures along its task's motion, each with its rates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....models import Body, Dimension, FloatArray, Model
from ...units import Units, rate_unit
from ..pictures.posture import Posture
from ..pictures.scene import Drawing, Motion
from ..pictures.view import View, clearest_view

#: Postures on each side of the one drawn.
_SIDE = 20
#: The farthest turn, and the farthest way of a platform corner in parts of the robot's size.
_TURN = math.radians(20)
_WAY = 0.3
#: Part of the terms of a rate that rounding may leave of it.
_ROUNDING = 1e-9
#: Of the eye at first, degrees.
_ELEVATION = 26.0
#: From shortening to lengthening: the colours of picture files.
RATES = ("#08519c", "#3f86c4", "#9aa3ab", "#e08a3c", "#b34700")


def view_data(drawing: Drawing, rates: FloatArray) -> dict[str, Any]:
    """Everything that the 3-D view shows, in the case's units, as JSON.

    Args:
        drawing: the robot and its motion.
        rates: (m,) work rates there, as the result has them, to the last bit.

    ``frames`` has one entry for each posture, in order of ``t``; the one at ``zero`` is the drawing itself.
    """
    model, motion = drawing.model, drawing.motion
    units = drawing.case.units if drawing.case is not None else Units()
    postures, zero = along(drawing)
    return {
        "name": "" if motion is None else motion.name,
        "headline": drawing.headline,
        "is_answer": drawing.is_answer,
        "unit": units.length,
        "rate_unit": "" if motion is None else rate_unit(motion.twist, units),
        "size": drawing.size,
        "points": [{"name": point.name, "body": point.body.value} for point in model.scene.points],
        "links": [{"ends": [a, b], "limb": link.limb, "body": link.body.value} for a, b, link in drawing.links],
        "plates": {body.value: list(loop) for body, loop in drawing.plates},
        "corners": list(drawing.corners),
        "rows": [
            {"limb": row.limb, "kind": row.kind.value, "at": _attachment(drawing, row.limb)} for row in drawing.rows
        ],
        "directions": [item.name for item in model.scene.directions],
        "motion": None if motion is None else _motion(motion, units),
        "free": [_motion(each, units) for each in drawing.free],
        "reference": None if drawing.reference is None else drawing.reference.points.tolist(),
        "colours": list(RATES),
        "eye": View(clearest_view(drawing).azimuth, _ELEVATION).axes[2].tolist(),
        "zero": zero,
        "frames": [
            _frame(drawing, t, posture, rates if k == zero else drawing.rates_at(posture), units)
            for k, (t, posture) in enumerate(postures)
        ],
    }


def along(drawing: Drawing) -> tuple[list[tuple[float, Posture]], int]:
    """Postures along the motion of a drawing as ``(t, posture)`` in order of ``t``, and the place of ``t = 0``.

    It ends earlier where the robot cannot be put together, and has one posture only without a motion.
    """
    if drawing.motion is None:
        return [(0.0, drawing.posture)], 0
    step = _farthest(drawing) / _SIDE
    sides: list[list[tuple[float, Posture]]] = []
    for sign in (-1, 1):
        side: list[tuple[float, Posture]] = []
        last: Posture | None = drawing.posture
        for k in range(1, _SIDE + 1):
            # Where loops must close, the nearest posture is the best start; else nothing adds up from the first.
            closes = bool(drawing.model.unknowns)
            start, t = (last, sign * step) if closes else (drawing.posture, sign * step * k)
            last = None if start is None else drawing.linkage.moved(start, drawing.motion.twist, t)
            if last is None:
                break
            side.append((sign * step * k, last))
        sides.append(side)
    back, forth = sides
    return [*reversed(back), (0.0, drawing.posture), *forth], len(back)


def _farthest(drawing: Drawing) -> float:
    """Largest ``t``: as far as the turn and the way of the corners stay moderate."""
    twist = np.zeros(6) if drawing.motion is None else drawing.motion.twist
    turn = float(np.linalg.norm(twist[:3]))
    way = float(
        np.max(np.linalg.norm(drawing.velocities, axis=1), initial=float(np.linalg.norm(twist[3:]) * (not turn)))
    )
    limits = [_TURN / turn] if turn else []
    limits += [_WAY * drawing.size / way] if way else []
    return min(limits, default=1.0)


def _frame(drawing: Drawing, t: float, posture: Posture, rates: FloatArray, units: Units) -> dict[str, Any]:
    return {
        "t": t,
        "words": _words(drawing, t, units),
        "points": posture.points.tolist(),
        "position": posture.position.tolist(),
        "rotation": posture.rotation.tolist(),
        "directions": posture.directions.tolist(),
        "jacobian": posture.jacobian.tolist(),
        "rates": rates.tolist(),
        "F": float(rates @ rates),
        "noise": _noise(drawing, posture),
        "lengths": _lengths(drawing, posture),
        "velocities": _velocities(drawing, posture.points).tolist(),
    }


def _noise(drawing: Drawing, posture: Posture) -> float:
    """A rate below this is rounding error: the terms that a rate adds up are so much larger."""
    if drawing.motion is None:
        return 0.0
    terms = np.abs(posture.jacobian) @ np.abs(np.concatenate([drawing.motion.twist[3:], drawing.motion.twist[:3]]))
    return _ROUNDING * float(np.max(terms, initial=0.0))


def _words(drawing: Drawing, t: float, units: Units) -> str:
    """How far the platform has gone, for people."""
    if drawing.motion is None or t == 0:
        return "at the pose found" if drawing.is_answer else "at the pose reached"
    omega, v = drawing.motion.twist[:3], drawing.motion.twist[3:]
    turn = float(np.linalg.norm(omega)) * t
    pitch = drawing.motion.pitch
    if math.isinf(pitch):
        return f"moved {_signed(float(np.linalg.norm(v)) * t)} {units.length} along the axis"
    turned = f"turned {_signed(units.shown(turn, Dimension.ANGLE))} {units.angle} about the axis"
    if abs(pitch * turn) < 1e-9 * drawing.size:
        return turned
    return f"{turned}, moved {_signed(pitch * turn)} {units.length} along it"


def _signed(value: float) -> str:
    return f"{value:+.3g}".replace("-", "\N{MINUS SIGN}")


def _velocities(drawing: Drawing, points: FloatArray) -> FloatArray:
    if drawing.motion is None:
        return np.zeros((0, 3))
    omega, v = drawing.motion.twist[:3], drawing.motion.twist[3:]
    return np.asarray(v + np.cross(omega, points[list(drawing.corners)]))


def _lengths(drawing: Drawing, posture: Posture) -> list[float]:
    """Length of the limb of each row: as the robot measures it, or else that of its lines."""
    measured: dict[str, float] = {}
    for start, end, link in drawing.links:
        if link.limb is not None:
            part = float(np.linalg.norm(posture.points[end] - posture.points[start]))
            measured[link.limb] = measured.get(link.limb, 0.0) + part
    for item, values in zip(drawing.model.quantities, posture.quantities, strict=True):
        if item.name == "leg_length":
            measured |= dict(zip(item.owners, map(float, values), strict=True))
    return [measured.get(limb, 0.0) for limb in _limbs(drawing.model)]


def _limbs(model: Model) -> list[str]:
    return [row.limb for row in model.wrenches]


def _attachment(drawing: Drawing, limb: str) -> int | None:
    """Index of the point where a limb meets the platform."""
    for start, end, link in drawing.links:
        if link.limb == limb:
            for index in (end, start):
                if drawing.model.scene.points[index].body is Body.PLATFORM:
                    return index
    return None


def _motion(motion: Motion, units: Units) -> dict[str, Any]:
    if math.isinf(motion.pitch):
        words = f"{motion.name}: translation"
    elif abs(motion.pitch) < 1e-9:
        words = f"{motion.name}: rotation"
    else:
        words = f"{motion.name}: screw of pitch {motion.pitch:.4g} {units.length}"
    return {
        "words": words,
        "twist": motion.twist.tolist(),
        "translation": math.isinf(motion.pitch),
        "line": motion.line.tolist(),
        "path": motion.path.tolist(),
    }

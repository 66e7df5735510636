"""Straight legs as chains of elementary joints at a pose.

A leg with a force alone is a universal joint at the base, a slide along the leg and a spherical joint at the platform.
Its row does not depend on the axes of the universal joint. Our choice: the first axis is fixed to the base, normal to
the leg and to the base's z axis; the second is normal to it and to the leg.

A leg with a force and a couple (a limb of a 3-UPU) is U, P and U. The axes on the platform are those of the robot.
Those on the base are parallel to them at this pose, which makes the couple a pure one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....models import Body, FloatArray, Model, WrenchKind
from ...errors import InputError
from .chains import Chain, Chains, Step
from .jointchains import clean_name

#: Sine of the angle between a leg and the z axis below which they are parallel.
_PARALLEL = 1e-9

_UPS = (
    "Legs are U, P and S, the robot's model has lines between joint centres only: the first axis of each U is fixed to"
    " the base, normal to the leg and to the base's z axis at this pose; the second is normal to the first and the leg."
)
_UPU = (
    "Limbs are U, P and U: the axes on the platform are the robot's, those on the base are parallel to them at this"
    " pose, which the robot's model leaves open."
)


@dataclass(frozen=True, eq=False)
class PosedLeg:
    """A leg at a pose, in the world frame.

    Attributes:
        name: of the limb.
        base, platform: (3,) centres of its joints, length.
        axes: (3,) each, both axes of its upper universal joint, that on the platform first; none for a spherical joint.
    """

    name: str
    base: FloatArray
    platform: FloatArray
    axes: tuple[FloatArray, ...] = ()


def check_legs(model: Model) -> None:
    """Refuse a robot that is given by its rows, unless straight legs have them all.

    Raises:
        InputError: a limb is no straight leg, or has other rows than a force, or a force and a couple about an axis.
    """
    kinds: dict[str, list[WrenchKind]] = {leg.name: [] for leg in model.legs}
    drawn: Mapping[str, int] = {name: len(axes_of(model, name)) for name in kinds}
    for row in model.rows:
        kinds.setdefault(row.limb, []).append(row.kind)
    for limb, found in kinds.items():
        is_leg = limb in drawn and found == [WrenchKind.FORCE]
        is_limb = limb in drawn and found == [WrenchKind.FORCE, WrenchKind.COUPLE] and drawn[limb] == 2
        if not (is_leg or is_limb):
            fault = "the joints of its limbs are not known; a robot with straight legs or given joint by joint can be"
            raise InputError(f"robot {model.name!r} cannot be exported: {fault}")


def axes_of(model: Model, limb: str) -> list[int]:
    """Return the indices, among the directions of the drawing, of the joint axes of a limb on the platform."""
    return [k for k, each in enumerate(model.scene.directions) if each.limb == limb and each.body is Body.PLATFORM]


def leg_chains(legs: Sequence[PosedLeg], rotation: FloatArray, position: FloatArray) -> Chains:
    """Return the chains of legs at a pose, which is the pose in which they are stated.

    Args:
        legs: the legs at the pose.
        rotation: (3, 3) ``R`` of the pose, platform to world coordinates.
        position: (3,) ``p`` of the pose, length.

    Raises:
        InputError: a leg has no length.
    """
    chains = tuple(Chain(leg.name, leg.name, _steps(leg)) for leg in legs)
    note = _UPU if any(leg.axes for leg in legs) else _UPS
    return Chains(chains, position, rotation, (note,))


def _steps(leg: PosedLeg) -> tuple[Step, ...]:
    """Return the joints of a leg, from the base on, with coordinates 0."""
    span = leg.platform - leg.base
    length = float(np.linalg.norm(span))
    if not length > 0:
        raise InputError(f"limb {leg.name!r} cannot be exported: it has zero length")
    along = span / length

    def step(number: int, part: str, kind: str, point: FloatArray, axis: FloatArray) -> Step:
        name = f"joint_{clean_name(leg.name)}_{number}{f'_{part}' if part else ''}"
        is_slide = kind == "P"
        return Step(
            name,
            f"{leg.name}:{number}",
            "",
            part,
            "P" if is_slide else "S" if kind == "S" else "R",
            point,
            axis,
            actuated=is_slide,
            actuator=leg.name if is_slide else "",
            coordinate=None if kind == "S" else 0.0,
        )

    slide = step(2, "", "P", leg.base, along)
    if leg.axes:
        outer, inner = (axis / np.linalg.norm(axis) for axis in leg.axes)
        return (
            step(1, "first", "R", leg.base, outer),
            step(1, "second", "R", leg.base, inner),
            slide,
            step(3, "first", "R", leg.platform, inner),
            step(3, "second", "R", leg.platform, outer),
        )
    first = np.cross([0.0, 0.0, 1.0], along)
    sine = float(np.linalg.norm(first))
    first = np.array([1.0, 0.0, 0.0]) if sine < _PARALLEL else first / sine
    return (
        step(1, "first", "R", leg.base, first),
        step(1, "second", "R", leg.base, np.cross(along, first)),
        slide,
        step(3, "", "S", leg.platform, np.zeros(3)),
    )

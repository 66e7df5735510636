"""Hexapod given by twelve joint centres; a case fixes or frees each of their coordinates.

``base_i`` is the centre of leg i's base joint in the world frame, ``platform_i`` the centre of its platform joint in
the platform frame. With a symmetry, some legs are given and the others are their images in both frames: the coordinates
of the given legs determine all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated, Literal, NamedTuple, TypeAlias

import casadi as ca
from casadi import SX

from .drawing import Mark, MarkKind
from .legs import legged_platform
from .model import Model, ModelError
from .parts import Dimension, Leg, Parameter, PoseSymbols

Symmetry: TypeAlias = Annotated[
    Literal["none", "mirror", "threefold", "threefold-mirror"],
    '"none": all legs are given; "mirror": legs 1, 3, 4 and their reflections in y = 0; "threefold": legs 1, 2 and '
    'their rotations by 120 and 240 deg about z; "threefold-mirror": leg 1, its reflection, and the rotations of both',
]


class _Image(NamedTuple):
    """Image of a given leg: an optional reflection in the plane y = 0, then a rotation about z.

    Attributes:
        of: index of the given leg.
        thirds: rotation in thirds of a turn.
        mirrored: True if the leg is reflected first.
    """

    of: int
    thirds: int = 0
    mirrored: bool = False


#: Six legs of each symmetry, in order around the plates: legs 1 and 2, 3 and 4, 5 and 6 are pairs at the azimuths 0,
#: 120 and 240 degrees.
_IMAGES: Mapping[str, tuple[_Image, ...]] = MappingProxyType(
    {
        "none": tuple(_Image(i) for i in range(6)),
        "mirror": (
            _Image(0),
            _Image(0, mirrored=True),
            _Image(2),
            _Image(3),
            _Image(3, mirrored=True),
            _Image(2, mirrored=True),
        ),
        "threefold": tuple(_Image(i % 2, i // 2) for i in range(6)),
        "threefold-mirror": tuple(_Image(0, i // 2, mirrored=bool(i % 2)) for i in range(6)),
    }
)


def hexapod(*, symmetry: Symmetry = "none") -> Model:
    """Return a robot with six legs between twelve joint centres, given by their coordinates.

    Args:
        symmetry: ``none``: all legs are given. ``mirror``: legs 1, 3 and 4 are given; legs 2, 6 and 5 are their
            reflections in the plane y = 0. ``threefold``: legs 1 and 2 are given; the other legs are rotated by 120 and
            240 degrees about z. ``threefold-mirror``: leg 1 is given, leg 2 is its reflection, and both are rotated.

    Raises:
        ModelError: the symmetry is unknown.
    """
    if symmetry not in _IMAGES:
        raise ModelError(f"model 'hexapod': symmetry must be one of {', '.join(_IMAGES)}, got {symmetry!r}")
    pose = PoseSymbols()
    images = _IMAGES[symmetry]
    given = sorted({image.of for image in images})
    base, platform = (
        {i: _joint(plate, i, radius, half_angle) for i in given}
        for plate, radius, half_angle in (("base", 12.0, 20.0), ("platform", 8.0, 45.0))
    )
    legs = [
        Leg(str(i + 1), _placed(base[image.of].symbol, image), _placed(platform[image.of].symbol, image))
        for i, image in enumerate(images)
    ]
    parts = legged_platform(legs, pose)
    points = {point.name: point for point in parts.scene.points}
    joints = [
        (plate[i].name, points[f"{letter}{i + 1}"]) for letter, plate in (("B", base), ("A", platform)) for i in given
    ]
    return Model(
        name="hexapod",
        description="six legs between twelve joint centres given by their coordinates",
        options={"symmetry": symmetry} if symmetry != "none" else {},
        parameters=(*base.values(), *platform.values()),
        pose=pose,
        home=(0.0, 0.0, 35.0),
        wrenches=parts.wrenches,
        quantities=parts.quantities,
        scene=replace(
            parts.scene,
            marks=tuple(Mark(name, MarkKind.POINT, (joint.position,), joint.body) for name, joint in joints),
        ),
        legs=parts.legs,
        built=parts.built,
    )


def _joint(plate: str, i: int, radius: float, half_angle: float) -> Parameter:
    name = f"{plate}_{i + 1}"
    words = f"{plate} joint of leg {i + 1}"
    return Parameter(name, SX.sym(name, 3), Dimension.LENGTH, words, _typical_joint(i, radius, half_angle))


def _placed(joint: SX, image: _Image) -> SX:
    """Return the joint centre (3, 1) of a leg: the image of the given leg's joint centre."""
    if image == _Image(image.of):
        return joint
    x, y, z = joint[0], -joint[1] if image.mirrored else joint[1], joint[2]
    cosine, sine = ((1.0, 0.0), (-0.5, math.sqrt(0.75)), (-0.5, -math.sqrt(0.75)))[image.thirds]
    return ca.vertcat(cosine * x - sine * y, sine * x + cosine * y, z) if image.thirds else ca.vertcat(x, y, z)


def _typical_joint(i: int, radius: float, half_angle: float) -> tuple[float, float, float]:
    """Return a joint centre of an octahedral layout with pairs at 0, 120 and 240 degrees, rounded to 0.1 length units.

    Args:
        i: index of the leg.
        radius: radius of the joints' circle, length.
        half_angle: half of the angle between the joints of a pair, degrees.
    """
    azimuth = math.radians(120 * (i // 2) + half_angle * (1 if i % 2 else -1))
    return round(radius * math.cos(azimuth), 1), round(radius * math.sin(azimuth), 1), 0.0

"""The 6-6 Stewart-Gough platform with its joints in pairs on two circles (Fig. 3).

``x1``, ``x2``: radii of the base and platform circles. ``x3``, ``x4``: half of the central angle between the joints of
a pair, on the base and on the platform. Pair ``k = 1, 2, 3`` of the base is centred on azimuth ``120 (k - 1)`` degrees.
Half angle 0 gives a triangle (the joints of a pair coincide), 30 degrees a regular hexagon.

The paper draws the platform pairs above the base pairs (``aligned``): leg ``k+`` joins base joint ``k+`` at azimuth
``120 (k - 1) + x3`` to platform joint ``k+`` at ``120 (k - 1) + x4``, and leg ``k-`` with minus signs. In the
``octahedral`` layout, usual in built robots, the platform pairs are rotated by 60 degrees and each leg goes to the
nearer pair: leg ``k+`` ends at platform azimuth ``120 (k - 1) + 60 - x4``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal, TypeAlias

import casadi as ca
from casadi import SX

from .drawing import Body, Circle, Mark, MarkKind
from .legs import legged_platform
from .model import Model, ModelError
from .parts import Dimension, Leg, Parameter, PoseSymbols

_THIRD = 2 * math.pi / 3
_SIXTH = math.pi / 3
_HEXAGON = math.radians(30)

#: Option of the robot with its meaning.
Layout: TypeAlias = Annotated[
    Literal["aligned", "octahedral"],
    '"aligned": platform pairs above base pairs, as in the paper; "octahedral": platform pairs turned by 60 deg, as in '
    "most hexapods",
]


def stewart_gough(*, layout: Layout = "aligned") -> Model:
    """Return the 6-6 Stewart-Gough platform with joints on two circles (Fig. 3).

    Args:
        layout: ``aligned``: platform pairs above base pairs, as in the paper. ``octahedral``: platform pairs turned by
            60 degrees, as in most hexapods.

    Raises:
        ModelError: the layout is unknown.
    """
    if layout not in ("aligned", "octahedral"):
        raise ModelError(f"model 'stewart-gough': layout must be 'aligned' or 'octahedral', got {layout!r}")
    x1, x2, x3, x4 = (SX.sym(name) for name in ("x1", "x2", "x3", "x4"))
    pose = PoseSymbols()
    legs = []
    for k in range(3):
        # Counter-clockwise around the base, so that the outline in the drawing does not cross itself.
        for sign, mark in ((-1, "-"), (1, "+")):
            centre = k * _THIRD
            platform = centre + sign * (x4 if layout == "aligned" else _SIXTH - x4)
            legs.append(Leg(f"{k + 1}{mark}", _point_on_circle(x1, centre + sign * x3), _point_on_circle(x2, platform)))
    parts = legged_platform(legs, pose)
    # Azimuths of a base pair and of a platform pair at which the drawing shows the half angles.
    centres = (0.0, 0.0 if layout == "aligned" else _SIXTH)
    plates = (
        (Body.BASE, SX.eye(3), SX.zeros(3), x1, x3, centres[0], ("x1", "x3")),
        (Body.PLATFORM, pose.rotation, pose.position, x2, x4, centres[1], ("x2", "x4")),
    )
    return Model(
        name="stewart-gough",
        description="6-6 Stewart-Gough platform: six legs between pairs of joints on two circles",
        options={"layout": layout},
        parameters=(
            Parameter("x1", x1, Dimension.LENGTH, "radius of the base's joint circle", (12.0,), 0.0),
            Parameter("x2", x2, Dimension.LENGTH, "radius of the platform's joint circle", (8.0,), 0.0),
            Parameter(
                "x3",
                x3,
                Dimension.ANGLE,
                "half angle of a base pair (0: triangle, 30 deg: hexagon)",
                (math.radians(20),),
                0.0,
                _HEXAGON,
            ),
            Parameter(
                "x4",
                x4,
                Dimension.ANGLE,
                "half angle of a platform pair (0: triangle, 30 deg: hexagon)",
                (math.radians(8),),
                0.0,
                _HEXAGON,
            ),
        ),
        pose=pose,
        home=(0.0, 0.0, 35.0),
        wrenches=parts.wrenches,
        quantities=parts.quantities,
        scene=replace(
            parts.scene,
            circles=tuple(Circle(p, p + R @ _point_on_circle(r, 0), R[:, 2], body) for body, R, p, r, *_ in plates),
            marks=tuple(mark for plate in plates for mark in _marks(*plate)),
        ),
        legs=parts.legs,
        built=parts.built,
    )


def _point_on_circle(radius: SX, azimuth: SX | float) -> SX:
    return ca.vertcat(radius * ca.cos(azimuth), radius * ca.sin(azimuth), 0)


def _marks(
    body: Body, R: SX, p: SX, radius: SX, half_angle: SX, centre: float, names: tuple[str, str]
) -> tuple[Mark, ...]:
    """Return the marks of a plate's radius, at its third pair, and of its half angle, at its first pair.

    Args:
        body: the plate.
        R: (3, 3) orientation of the plate in the world frame.
        p: (3, 1) centre of the plate in the world frame, length.
        radius: (1, 1) radius of the joints' circle, length.
        half_angle: (1, 1) half of the angle between the joints of a pair, radians.
        centre: azimuth of the first pair, radians.
        names: names of the parameters for radius and half angle.
    """

    def at(azimuth: SX | float) -> SX:
        return p + R @ _point_on_circle(radius, azimuth)

    length = Mark(names[0], MarkKind.LENGTH, (p, at(centre - _THIRD)), body)
    return length, Mark(names[1], MarkKind.ANGLE, (p, at(centre), at(centre + half_angle)), body)

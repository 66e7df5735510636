"""The 3-UPU robot: three extensible limbs between universal joints (Section 4.4).

For limb ``i``: ``s_i`` is the direction from its base joint to its platform joint; ``u1_i``, ``u2_i`` are orthogonal
unit vectors along the axes of its upper universal joint, in platform coordinates; ``u_i`` is their common normal. A
limb applies a force along ``s_i`` and a couple about ``u_i`` (equations 16 to 18), so the Jacobian has three rows of
forces and three of couples.

The joints lie on two circles at azimuths 0, 120 and 240 degrees. Two known robots fix the first axis on the platform:
radially (``snu``, the robot of Seoul National University that Park showed in 2001) and tangentially (``tsai``, Tsai's
translational robot). In a real limb the second axis is also perpendicular to the limb, as in both of these robots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal, TypeAlias

import casadi as ca
from casadi import SX

from .drawing import Body, Circle, Direction, Mark, MarkKind, Scene
from .legs import legged_platform
from .model import Model, ModelError
from .parts import Closure, Dimension, Leg, Parameter, PoseSymbols
from .wrench import couple_about

_THIRD = 2 * math.pi / 3

#: Options of the robot with their meanings.
Axes: TypeAlias = Annotated[
    Literal["free", "limb", "snu", "tsai"],
    'axes of the upper universal joints; "free": both are parameters; "limb": the first is a parameter, the second is '
    'perpendicular to it and to the limb; "snu", "tsai": the first is radial or tangential, the second as in "limb"',
]
Azimuth: TypeAlias = Annotated[
    Literal["fixed", "free"], '"free": the azimuth of the first limb is a parameter; all limbs rotate with it'
]


def three_upu(*, axes: Axes = "free", azimuth: Azimuth = "fixed") -> Model:
    """Return the 3-UPU robot (Section 4.4).

    Args:
        axes: axes of the upper universal joints. ``free``: both axes are parameters ``u1_i`` and ``u2_i``, orthogonal
            within a limb. ``limb``: the first axis is a parameter, the second is perpendicular to it and to the limb.
            ``snu`` and ``tsai``: the first axis is radial or tangential, the second as in ``limb``.
        azimuth: ``free`` makes the azimuth of the first limb a parameter; all limbs rotate with it.

    Raises:
        ModelError: the value of ``axes`` or ``azimuth`` is unknown.
    """
    if axes not in ("free", "limb", "snu", "tsai"):
        raise ModelError(f"model 'three-upu': axes must be 'free', 'limb', 'snu' or 'tsai', got {axes!r}")
    if azimuth not in ("fixed", "free"):
        raise ModelError(f"model 'three-upu': azimuth must be 'fixed' or 'free', got {azimuth!r}")
    base_radius, platform_radius = SX.sym("base_radius"), SX.sym("platform_radius")
    turned = SX.sym("azimuth") if azimuth == "free" else SX(0)
    pose = PoseSymbols()
    parameters = [
        Parameter("base_radius", base_radius, Dimension.LENGTH, "radius of the base's joint circle", (50.0,), 0.0),
        Parameter(
            "platform_radius", platform_radius, Dimension.LENGTH, "radius of the platform's joint circle", (25.0,), 0.0
        ),
    ]
    if azimuth == "free":
        parameters.append(Parameter("azimuth", turned, Dimension.ANGLE, "azimuth of the first limb", (0.0,)))
    radial = [_turned(_radial(k), turned) for k in range(3)]
    legs = [Leg(str(k + 1), base_radius * each, platform_radius * each) for k, each in enumerate(radial)]
    parts = legged_platform(legs, pose)
    couples, built, closure, directions = [], [], [], []
    for k, (row, row_built) in enumerate(zip(parts.wrenches, parts.built, strict=True)):
        first = {"snu": radial[k], "tsai": _turned(_tangential(k), turned)}.get(axes)
        if first is None:
            parameters.append(
                _direction_parameter(
                    f"u1_{row.limb}",
                    f"first axis of limb {row.limb}'s upper joint",
                    _radial(k),
                    starter=_radial(k) if axes == "free" else _tilted(_radial(k)),
                )
            )
            first = parameters[-1].symbol
        if axes == "free":
            parameters.append(
                _direction_parameter(
                    f"u2_{row.limb}",
                    f"second axis of limb {row.limb}'s upper joint",
                    _tangential(k),
                    starter=_tilted(_tangential(k)),
                )
            )
            second = parameters[-1].symbol
            u1, u2 = pose.rotation @ first, pose.rotation @ second
            closure.append(Closure(f"u1_{row.limb} . u2_{row.limb}", ca.dot(first, second)))
            normals = [pose.rotation @ ca.cross(first, second)] * 2
        else:
            u1, u2 = pose.rotation @ first, ca.cross(pose.rotation @ first, row.force)
            normals = [_normal(u1, each.force) for each in (row, row_built)]
        joint = pose.position + pose.rotation @ legs[k].platform
        directions += [
            Direction(f"{name}_{row.limb}", joint, u, Body.PLATFORM, row.limb) for name, u in (("u1", u1), ("u2", u2))
        ]
        couples.append(couple_about(row.limb, normals[0]))
        built.append(couple_about(row.limb, normals[1]))
    return Model(
        name="three-upu",
        description="3-UPU: three limbs, each with a force along it and a couple about its upper joint's normal",
        options={"axes": axes, **({"azimuth": azimuth} if azimuth == "free" else {})},
        parameters=tuple(parameters),
        pose=pose,
        home=(0.0, 0.0, 50.0),
        wrenches=(*parts.wrenches, *couples),
        quantities=parts.quantities,
        scene=replace(_add_circles(parts.scene, legs, pose), directions=tuple(directions)),
        legs=parts.legs,
        built=(*parts.built, *built),
        closure=tuple(closure),
    )


def _normal(u1: SX, s: SX) -> SX:
    """Return the common normal (3, 1) of u1 and ``u1 x s``: ``|u1|^2`` times the part of s perpendicular to u1."""
    return s * ca.sumsqr(u1) - u1 * ca.dot(u1, s)


def _add_circles(scene: Scene, legs: Sequence[Leg], pose: PoseSymbols) -> Scene:
    """Return the drawing with both joint circles added, and with marks of their radii at the first limb."""
    R, p = pose.rotation, pose.position
    base = Circle(SX.zeros(3), legs[0].base, SX([0, 0, 1]), Body.BASE)
    platform = Circle(p, p + R @ legs[0].platform, R[:, 2], Body.PLATFORM)
    radii = (("base_radius", base), ("platform_radius", platform))
    marks = (Mark(name, MarkKind.LENGTH, (each.centre, each.through), each.body) for name, each in radii)
    return replace(scene, circles=(base, platform), marks=tuple(marks))


def _turned(direction: SX, angle: SX) -> SX:
    """Return a horizontal direction (3, 1) turned about z."""
    if angle.is_zero():
        return direction
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], 0)


def _radial(k: int) -> SX:
    """Return the radial unit vector (3, 1) at the azimuth of limb k."""
    return SX([math.cos(k * _THIRD), math.sin(k * _THIRD), 0.0])


def _tangential(k: int) -> SX:
    """Return the tangential unit vector (3, 1) at the azimuth of limb k."""
    return SX([-math.sin(k * _THIRD), math.cos(k * _THIRD), 0.0])


def _tilted(direction: SX) -> SX:
    """Return a horizontal unit vector (3, 1) tilted upwards.

    If all axes lie in the platform's plane, the three couples are parallel and the robot is singular.
    """
    return 0.8 * direction + SX([0.0, 0.0, 0.6])


def _direction_parameter(name: str, description: str, typical: SX, *, starter: SX) -> Parameter:
    """Return a parameter that is a unit vector."""
    return Parameter(
        name,
        SX.sym(name, 3),
        Dimension.NUMBER,
        description,
        _triple(typical),
        -1.0,
        1.0,
        is_direction=True,
        starter=_triple(starter),
    )


def _triple(vector: SX) -> tuple[float, float, float]:
    """Return the components of a constant (3, 1)."""
    x, y, z = (float(vector[i]) for i in range(3))
    return x, y, z

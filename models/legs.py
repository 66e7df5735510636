"""Platforms on extensible legs: rows, quantities and drawing from the joint centres."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
from casadi import SX

from .drawing import Body, Link, Point, Scene
from .parts import Dimension, Leg, PoseSymbols, Quantity
from .values import dataclass
from .wrench import Wrench, force_along


@dataclass(frozen=True, eq=False)
class LeggedPlatform:
    """Parts of a model that follow from legs between base and platform.

    Attributes:
        legs: legs in order around the plates.
        wrenches: one row for each leg.
        built: rows with joint-centre errors of the legs.
        quantities: length of each leg, and its angles with the normals of base and platform.
        scene: drawing: points at joint centres and platform origin, links along legs, outlines of both plates.
    """

    legs: tuple[Leg, ...]
    wrenches: tuple[Wrench, ...]
    built: tuple[Wrench, ...]
    quantities: tuple[Quantity, ...]
    scene: Scene


def legged_platform(legs: Sequence[Leg], pose: PoseSymbols) -> LeggedPlatform:
    """Return the rows, quantities and drawing of legs at a pose.

    With ``d = p + R a - b`` from base joint ``b`` to platform joint ``a``, the row of a leg is the unit force along
    ``d`` through ``b`` (equation 10), and its work rate in a twist is the rate of change of the leg's length.

    Args:
        legs: one or more legs, in order around the plates.
        pose: symbols of the pose.
    """
    R, p = pose.rotation, pose.position
    names = tuple(leg.name for leg in legs)
    ends = [p + R @ leg.platform for leg in legs]
    spans = [end - leg.base for end, leg in zip(ends, legs, strict=True)]
    lengths = [ca.norm_2(span) for span in spans]
    return LeggedPlatform(
        legs=tuple(legs),
        wrenches=_leg_rows(legs, pose),
        built=_leg_rows([leg.built for leg in legs], pose),
        quantities=(
            Quantity("leg_length", names, ca.vertcat(*lengths), Dimension.LENGTH, "distance between a leg's joints"),
            Quantity(
                "base_joint_angle",
                names,
                ca.vertcat(*[angle_between(SX([0, 0, 1]), span) for span in spans]),
                Dimension.ANGLE,
                "angle between a leg and the base's normal",
            ),
            Quantity(
                "platform_joint_angle",
                names,
                ca.vertcat(*[angle_between(R[:, 2], span) for span in spans]),
                Dimension.ANGLE,
                "angle between a leg and the platform's normal",
            ),
        ),
        scene=_scene(legs, ends, pose),
    )


def _leg_rows(legs: Sequence[Leg], pose: PoseSymbols) -> tuple[Wrench, ...]:
    spans = (pose.position + pose.rotation @ leg.platform - leg.base for leg in legs)
    return tuple(force_along(leg.name, leg.base, span) for leg, span in zip(legs, spans, strict=True))


def angle_between(axis: SX, span: SX) -> SX:
    """Return the angle, (1, 1), radians, between a leg or link (3, 1) and a plate's normal or another axis (3, 1).

    Unlike the arc cosine, the result is accurate and differentiable for a leg nearly parallel to the axis.
    """
    return ca.atan2(ca.norm_2(ca.cross(axis, span)), ca.dot(axis, span))


def _scene(legs: Sequence[Leg], ends: Sequence[SX], pose: PoseSymbols) -> Scene:
    """Return the drawing of legs and plates.

    Args:
        legs: legs in order around the plates.
        ends: (3, 1) centre of each platform joint in the world frame, length.
        pose: symbols of the pose.
    """
    base = [Point(f"B{leg.name}", leg.base, Body.BASE) for leg in legs]
    platform = [Point(f"A{leg.name}", end, Body.PLATFORM) for leg, end in zip(legs, ends, strict=True)]
    origin = Point("P", pose.position, Body.PLATFORM)
    links = [Link(b.name, a.name, Body.LIMB, leg.name) for leg, b, a in zip(legs, base, platform, strict=True)]
    for outline in (base, platform):
        following = outline[1:] + outline[:1]
        links += [Link(one.name, next_.name, one.body) for one, next_ in zip(outline, following, strict=True)]
    return Scene((*base, *platform, origin), tuple(links))

"""Settings of a robot that are affine functions of the platform's position: ``s = s0 + k . (p - c)``.

A dimension that a slow drive resets for every pose, such as the radius of base joints on slides, follows a policy. Its
expression replaces the dimension in all parts of the model, so that each reader of the model also reads the policy. The
model then describes the robot at a standstill: work rates and forces are those with locked settings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
from casadi import SX

from .instance import Substitution
from .model import Model
from .parts import Dimension, Parameter, PoseSetting, Quantity
from .whole import expressions_of, with_expressions


def slope_name(setting: str) -> str:
    """Return the name of the parameter with the slopes of a setting, by the name of the setting."""
    return f"{setting}_slope"


def value_name(setting: str) -> str:
    """Return the name of the quantity with the value of a setting at the pose, by the name of the setting."""
    return f"{setting}_setting"


def can_follow_pose(model: Model) -> bool:
    """Return whether dimensions of a robot can follow the pose: a robot that is given by its rows."""
    return not (model.structure or model.unknowns or model.members)


def with_pose_settings(model: Model, settings: Sequence[PoseSetting]) -> Model:
    """Return a robot with dimensions that are affine functions of the platform's position.

    Each dimension keeps its symbol, which becomes the value ``s0`` at the reference position. A parameter with three
    slopes is added for each, and a quantity with its value at the pose.

    Args:
        model: robot that :func:`can_follow_pose`.
        settings: the settings, one or more.
    """
    own = Substitution.identity(model)
    slopes, values, shown = list[Parameter](), list[SX](), list[Quantity]()
    places = [name for item in model.parameters for name in item.components]
    given = list(ca.vertsplit(own.parameters))
    for each in settings:
        k = places.index(each.name)
        slope = SX.sym(slope_name(each.name), 3)
        item = next(item for item in model.parameters if each.name in item.components)
        # A slope of an angle has the unit of the angle in cases.
        dimension = Dimension.ANGLE if item.dimension is Dimension.ANGLE else Dimension.NUMBER
        about = f"change of {each.name} along x, y and z of the platform's position, per unit of length"
        slopes.append(Parameter(slope_name(each.name), slope, dimension, about, (0.0, 0.0, 0.0)))
        values.append(given[k] + ca.dot(slope, own.position - SX(list(each.centre))))
        about = f"value of {each.name} at the pose"
        shown.append(Quantity(value_name(each.name), (each.name,), values[-1], item.dimension, about))
    for each, value in zip(settings, values, strict=True):
        given[places.index(each.name)] = value
    parts = (
        (model.wrenches, model.actuators, model.joint_screws, model.signs, model.quantities),
        (model.scene, model.joints, model.links),
        tuple((leg.base, leg.platform) for leg in model.legs),
    )
    function = ca.Function("model", own.all, expressions_of(parts))
    following = function.call([ca.vertcat(*given), *own.all[1:]])
    (wrenches, actuators, screws, signs, quantities), (scene, joints, links), ends = with_expressions(
        parts, iter(following)
    )
    return replace(
        model,
        parameters=(*model.parameters, *slopes),
        wrenches=wrenches,
        actuators=actuators,
        joint_screws=screws,
        signs=signs,
        quantities=(*quantities, *shown),
        scene=scene,
        joints=joints,
        links=links,
        legs=tuple(replace(leg, base=a, platform=b) for leg, (a, b) in zip(model.legs, ends, strict=True)),
        built=(),
        settings=tuple(settings),
    )
